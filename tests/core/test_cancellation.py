"""A Progress that raises Cancelled stops the work there and then, and leaves no thread behind.

What "there and then" means is counted in reports, of which there are a few per second.
"""

import threading

import numpy as np
import pytest
from accelscope.core import parallel
from accelscope.core.evaluation.rays.workloads import random_lines, workloads
from accelscope.core.evaluation.records import experiment
from accelscope.core.geometry.rays import Rays
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures import structures
from accelscope.core.structures.subdivision import subtrees
from accelscope.sample_scenes import make_sample


class CancelAt(Progress):
    """Cancels at the report of a number, from 1, and notes what was reported."""

    def __init__(self, number):
        self.number = number
        self.reports = []

    def report(self, done, total, text):
        self.reports.append((done, total, text))
        if len(self.reports) >= self.number:
            raise Cancelled


NEVER = 10**9


@pytest.fixture(autouse=True)
def two_threads(monkeypatch):
    """The more threads there are, the more is done at a report."""
    for module in (parallel, subtrees):
        monkeypatch.setattr(module, "core_count", lambda: 2)


@pytest.fixture(scope="module")
def big():
    return make_sample("soup:count=50000,edge=0.03")


def assert_stopped(progress, threads, share):
    """Check that nothing was done after the cancellation, and little before it."""
    assert len(progress.reports) == progress.number
    done, total, _ = progress.reports[-1]
    assert done <= share * total
    assert set(threading.enumerate()) <= threads


@pytest.mark.parametrize("number", [1, 3])
def test_a_build_stops(big, structure_name, number, monkeypatch):
    # Who waits for threads reports every WAIT: a fast machine would be through before the third.
    monkeypatch.setattr(subtrees, "WAIT", 0.001)
    structure = structures()[structure_name]
    counting = CancelAt(NEVER)
    structure.build(make_sample("tetra:size=2"), structure.Settings(), counting)
    if not counting.reports:
        pytest.skip("there is nothing to build")
    # A bvh is made before there is a third report; what is routed, and shafts, begin with one.
    if structure_name in ("bvh", "routed", "shafts"):
        big = make_sample("soup:count=200000,edge=0.02")
    threads = set(threading.enumerate())
    progress = CancelAt(number)
    with pytest.raises(Cancelled):
        structure.build(big, structure.Settings(), progress)
    assert_stopped(progress, threads, 0.75)


def test_tracing_stops(big, structure_name):
    scene, count = big, 200_000
    if structure_name == "naive":  # where one ray takes a fraction of a millisecond
        scene, count = Scene.from_triangles(big.triangles[:20_000], "soup"), 5_000
    structure = structures()[structure_name].build(scene, structures()[structure_name].Settings())
    rays = Rays.from_arrays(*random_lines(big.lower, big.upper, count, 1))
    structure.trace(rays.select(np.arange(2)))
    threads = set(threading.enumerate())
    for number in (1, 2, 4):
        progress = CancelAt(number)
        with pytest.raises(Cancelled):
            structure.trace(rays, progress=progress)
        assert_stopped(progress, threads, 0.1)


def test_a_grid_of_giants_stops():
    """Large triangles in a fine grid: few triangles, many references."""
    rng = np.random.default_rng(1)
    scene = Scene.from_triangles(rng.random((2000, 3, 3)), "giants")
    grid = structures()["grid"]
    grid.build(make_sample("tetra:size=2"), grid.Settings())
    threads = set(threading.enumerate())
    progress = CancelAt(3)
    with pytest.raises(Cancelled):
        grid.build(scene, grid.Settings(resolution=(200, 200, 200)), progress)
    assert_stopped(progress, threads, 0.1)


def test_experiments_pass_it_on(big):
    bvh, lines = structures()["bvh"], workloads()["random_lines"]
    with pytest.raises(Cancelled):
        experiment.build(big, bvh, bvh.Settings(), CancelAt(1))
    built = experiment.build(big, bvh, bvh.Settings())
    with pytest.raises(Cancelled):
        experiment.trace(built, lines, lines.Settings(), 0, CancelAt(1))


def test_progress_runs_from_nothing_to_all(structure_name):
    scene = make_sample("soup:count=30000")
    structure = structures()[structure_name]
    progress = CancelAt(NEVER)
    built = structure.build(scene, structure.Settings(), progress)
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 10_000, 1))
    if structure_name == "naive":
        rays = rays.select(np.arange(200))
    built.trace(rays, progress=progress)
    by_text = {}
    for done, total, text in progress.reports:
        by_text.setdefault(text, []).append((done, total))
    assert by_text
    for steps in by_text.values():
        dones = [done for done, _ in steps]
        assert dones == sorted(dones)
        assert steps[-1][0] == steps[-1][1]
        assert len({total for _, total in steps}) == 1


def test_an_error_in_progress_is_not_swallowed(big):
    class Broken(Progress):
        def report(self, done, total, text):
            raise ZeroDivisionError

    bvh = structures()["bvh"]
    threads = set(threading.enumerate())
    with pytest.raises(ZeroDivisionError):
        bvh.build(big, bvh.Settings(), Broken())
    assert set(threading.enumerate()) <= threads
