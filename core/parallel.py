"""Threads of our own over chunks of work; kernels release Python's lock while they run."""

from __future__ import annotations

import contextlib
import itertools
import math
import os
import queue
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from typing import Generic, Self, TypeVar

from .progress import Progress

T = TypeVar("T")

FIRST_CHUNK = 16
"""Items in the first chunk; cheap ones come in chunks of thousands a few milliseconds later."""

TARGET = 0.02
"""Seconds of a chunk: far below the half second within which a cancel must be noticed."""

BLOCK = 1 << 17
"""Items of a block, if one takes some ten nanoseconds."""


def core_count() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def for_chunks(
    work: Callable[[int, int], None],
    total: int,
    threads: int,
    progress: Progress,
    text: str,
) -> None:
    """Run ``work(first, last)`` over ``range(total)`` in chunks on several threads.

    Cancellation is noticed between chunks. Their size adapts, so that each takes some TARGET
    seconds whatever one item costs.

    Parameters
    ----------
    work : callable
        Gets a half-open range.
    threads : int
        Number of threads; 0 takes every core.

    Raises
    ------
    Cancelled
        From `progress`; chunks under way are awaited first.
    """

    def timed(first: int, last: int) -> float:
        start = time.perf_counter()
        work(first, last)
        return time.perf_counter() - start

    threads = threads or core_count()
    size, begun, done = FIRST_CHUNK, 0, 0
    pending: dict[Future[float], int] = {}
    progress.report(0, total, text)
    if threads == 1:
        # Without another thread: to hand a chunk over takes as long as thousands of cheap items.
        while done < total:
            count = min(size, total - done)
            size = _next_size(size, count, timed(done, done + count))
            done += count
            progress.report(done, total, text)
        return
    with ThreadPoolExecutor(max_workers=threads) as pool:
        try:
            while done < total:
                # One chunk in hand for every thread, so that none waits for us.
                while begun < total and len(pending) < 2 * threads:
                    last = min(begun + size, total)
                    pending[pool.submit(timed, begun, last)] = last - begun
                    begun = last
                finished, _ = wait(pending, timeout=0.1, return_when=FIRST_COMPLETED)
                for future in finished:
                    count, seconds = pending.pop(future), future.result()
                    done += count
                    size = _next_size(size, count, seconds)
                progress.report(done, total, text)
        finally:
            for future in pending:
                future.cancel()


def _next_size(size: int, count: int, seconds: float) -> int:
    """Return how many items the next chunk has, after one of `count` has taken so long."""
    if seconds < TARGET and count == size:
        return 2 * size
    return max(count // 2, 1) if seconds > 2 * TARGET else size


def work_off(
    first: T,
    work: Callable[[T], Sequence[T]],
    size_of: Callable[[T], int],
    progress: Progress,
    text: str,
) -> None:
    """Do a task, and the tasks that come of it, on every core, the largest first.

    This thread does its share, and nobody waits to be told what to do: a task costs no more than
    some ten microseconds.

    Parameters
    ----------
    work : callable
        Does a task; returns the tasks that are left to do instead, or none if it is done.
    size_of : callable
        Tells how much there is to do. A task that is done counts as much for the progress.

    Raises
    ------
    Cancelled
        From `progress`, which hears of every task that this thread has done; those under way are
        awaited first.
    """
    total, done, n_open, lock = size_of(first), 0, 1, threading.Lock()
    pile: queue.PriorityQueue[tuple[float, int, T | None]] = queue.PriorityQueue()
    number = itertools.count()  # of equal sizes the first comes first; tasks are not compared

    def stop() -> None:
        for _ in range(core_count()):
            pile.put((-math.inf, next(number), None))

    def do(task: T) -> None:
        nonlocal done, n_open
        try:
            left = work(task)
        except BaseException:
            stop()
            raise
        with lock:
            n_open += len(left) - 1
            done += 0 if left else size_of(task)
            is_over = n_open == 0
        for each in left:
            pile.put((-size_of(each), next(number), each))
        if is_over:
            stop()

    def take_part() -> None:
        while (task := pile.get()[2]) is not None:
            do(task)

    progress.report(0, total, text)
    do(first)
    helpers = core_count() - 1 if n_open else 0
    with ThreadPoolExecutor(max(helpers, 1)) as pool:
        futures = [pool.submit(take_part) for _ in range(helpers)]
        try:
            while n_open:
                progress.report(done, total, text)
                with contextlib.suppress(queue.Empty):
                    if (task := pile.get(timeout=0.1)[2]) is None:
                        break
                    do(task)
        finally:
            stop()
    for future in futures:
        future.result()
    progress.report(done, total, text)


class Spare(Generic[T]):
    """Scratch memory that threads lend and give back, so that no more is made than is needed.

    Parameters
    ----------
    make : callable
        Makes what one thread needs.
    """

    def __init__(self, make: Callable[[], T]) -> None:
        self._make = make
        self._kept: list[T] = []

    @contextlib.contextmanager
    def lent(self) -> Iterator[T]:
        """Lend a piece that nobody else has, until the end of the ``with`` block."""
        try:
            # Not asked for before: another thread could take the last piece in between.
            piece = self._kept.pop()
        except IndexError:
            piece = self._make()
        yield piece
        self._kept.append(piece)


class Team:
    """Threads for work in many short phases: equal blocks, and a wait at the end of each phase.

    :func:`for_chunks` finds out how large its chunks should be; this does not, and so costs some
    tens of microseconds. It is for kernels of a known speed.

    Parameters
    ----------
    progress : Progress
        Hears of every block; may cancel.
    text : str
        What the work is called.
    """

    def __init__(self, progress: Progress, text: str) -> None:
        self._pool = ThreadPoolExecutor(core_count())
        self._progress, self._text = progress, text

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._pool.shutdown(cancel_futures=True)

    def run(self, work: Callable[[int, int], T], total: int, block: int = BLOCK) -> list[T]:
        """Run ``work(first, last)`` over ``range(total)`` in blocks; return what they return.

        Raises
        ------
        Cancelled
            From the progress.
        """
        ranges = [(first, min(first + block, total)) for first in range(0, total, block)]
        self._progress.report(0, total, self._text)
        if len(ranges) == 1:
            return [work(0, total)]
        results = []
        # `map` cancels what has not begun when its results are no longer asked for.
        for each, (_, last) in zip(self._pool.map(lambda r: work(*r), ranges), ranges, strict=True):
            results.append(each)
            self._progress.report(last, total, self._text)
        return results
