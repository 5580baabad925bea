"""How the benchmark takes times."""

from __future__ import annotations

import time
from collections.abc import Callable

REPEATS = 5
ENOUGH_SECONDS = 30.0  # what takes longer is not repeated for its precision


def best_of(work: Callable[[], object]) -> float:
    """Return the least wall-clock seconds of REPEATS runs, fewer of what takes long."""
    times: list[float] = []
    while len(times) < REPEATS and sum(times) < ENOUGH_SECONDS:
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times)
