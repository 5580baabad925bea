"""Tasks that leave tasks: each is done once by any number of threads; what is raised arrives."""

import threading

import pytest
from accelscope.core import parallel
from accelscope.core.parallel import work_off
from accelscope.core.progress import SILENT, Cancelled, Progress

Range = tuple[int, int]


def size_of(task: Range) -> int:
    return task[1] - task[0]


def parts_of(task: Range) -> list[Range]:
    """Cut a range in three unequal parts, if it has more than two numbers."""
    first, last = task
    if last - first <= 2:
        return []
    cut = first + max((last - first) // 5, 1)
    return [(first, cut), (cut, cut + 1), (cut + 1, last)]


@pytest.mark.parametrize("cores", [1, 2, 8])
def test_all_is_done_once(monkeypatch, cores):
    monkeypatch.setattr(parallel, "core_count", lambda: cores)
    done, reports = [], []

    def work(task):
        parts = parts_of(task)
        if not parts:
            done.append(task)
        return parts

    class Listens(Progress):
        def report(self, done, total, text):
            reports.append((done, total, text))

    before = set(threading.enumerate())
    work_off((0, 3000), work, size_of, Listens(), "Counting")
    assert sorted(number for task in done for number in range(*task)) == list(range(3000))
    assert reports == sorted(reports)
    assert (reports[0], reports[-1]) == ((0, 3000, "Counting"), (3000, 3000, "Counting"))
    assert set(threading.enumerate()) == before


def test_the_largest_comes_first(monkeypatch):
    monkeypatch.setattr(parallel, "core_count", lambda: 1)
    sizes = []

    def work(task):
        sizes.append(size_of(task))
        return [(0, 3), (0, 7), (0, 5)] if size_of(task) == 10 else []

    work_off((0, 10), work, size_of, SILENT, "")
    assert sizes == [10, 7, 5, 3]


@pytest.mark.parametrize("cores", [1, 2, 8])
def test_what_a_task_raises_is_raised(monkeypatch, cores):
    monkeypatch.setattr(parallel, "core_count", lambda: cores)

    def work(task):
        if task[0] <= 1234 < task[1] and size_of(task) < 10:
            raise KeyError(task)
        return parts_of(task)

    before = set(threading.enumerate())
    with pytest.raises(KeyError):
        work_off((0, 3000), work, size_of, SILENT, "")
    assert set(threading.enumerate()) == before


@pytest.mark.parametrize("cores", [1, 2, 8])
def test_a_cancel_stops_all(monkeypatch, cores):
    monkeypatch.setattr(parallel, "core_count", lambda: cores)
    n_begun = 0

    class CancelsSoon(Progress):
        n_reports = 0

        def report(self, done, total, text):
            self.n_reports += 1
            if self.n_reports == 3:
                raise Cancelled

    def work(task):
        nonlocal n_begun
        n_begun += 1
        return parts_of(task)

    before = set(threading.enumerate())
    with pytest.raises(Cancelled):
        work_off((0, 100_000), work, size_of, CancelsSoon(), "")
    # All are over 100,000; the helpers go on for no longer than it takes to tell them.
    assert n_begun < 20_000
    assert set(threading.enumerate()) == before
