"""Threads of our own over chunks of work; kernels release Python's lock while they run."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

from .progress import Progress


def core_count() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def for_chunks(
    work: Callable[[int, int], None],
    total: int,
    chunk: int,
    threads: int,
    progress: Progress,
    text: str,
) -> None:
    """Run ``work(first, last)`` over ``range(total)`` in chunks on several threads.

    Parameters
    ----------
    work : callable
        Gets a half-open range; should take well under half a second, since cancellation is
        noticed between chunks.
    threads : int
        Number of threads; 0 takes every core.

    Raises
    ------
    Cancelled
        From `progress`; chunks under way are awaited first.
    """
    ranges = [(first, min(first + chunk, total)) for first in range(0, total, chunk)]
    done = 0
    progress.report(0, total, text)
    with ThreadPoolExecutor(max_workers=threads or core_count()) as pool:
        pending = {pool.submit(work, *each): each for each in ranges}
        try:
            while pending:
                finished, _ = wait(pending, timeout=0.1, return_when=FIRST_COMPLETED)
                for future in finished:
                    first, last = pending.pop(future)
                    future.result()
                    done += last - first
                progress.report(done, total, text)
        finally:
            for future in pending:
                future.cancel()
