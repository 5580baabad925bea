"""How the benchmark takes times: rounds in turn, medians, and ratios round by round.

What is compared is measured in turn: ours, the peer, ours, the peer ... Whatever else the machine
does then disturbs both, and a ratio within a round is worth more than one of two medians.
"""

from __future__ import annotations

import contextlib
import os
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

from accelscope.core.parallel import core_count

LONG = 20.0
"""Seconds from which on a measurement is not repeated for its precision."""


class Spread(NamedTuple):
    """Median, least and greatest of some values."""

    median: float
    least: float
    most: float

    def __str__(self) -> str:
        """Return ``"0.31 (0.29..0.33)"``."""
        return f"{self.median:.3g} ({self.least:.3g}..{self.most:.3g})"


def spread(values: Sequence[float]) -> Spread:
    """Return median, least and greatest of some values.

    Raises
    ------
    statistics.StatisticsError
        If there are none.
    """
    return Spread(statistics.median(values), min(values), max(values))


def ratios(numerators: Sequence[float], denominators: Sequence[float]) -> Spread:
    """Return the spread of the ratios round by round; rounds that only one has are left out."""
    return spread([a / b for a, b in zip(numerators, denominators)])


def geometric_mean(values: Sequence[float]) -> float:
    """Return the geometric mean of positive values."""
    return statistics.geometric_mean(values)


def timed(work: Callable[[], object]) -> Callable[[], float]:
    """Return a function that runs `work` and returns the wall-clock seconds it took."""

    def run() -> float:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start

    return run


def in_turn(contestants: Mapping[str, Callable[[], float]], rounds: int) -> dict[str, list[float]]:
    """Let contestants run in turn, in every round each once.

    Parameters
    ----------
    contestants : mapping of str to callable
        Each runs once and returns the seconds that it took. Who takes longer than LONG runs in the
        first round only.

    Returns
    -------
    dict of str to list of float
        Seconds of every contestant, round by round.
    """
    found: dict[str, list[float]] = {name: [] for name in contestants}
    for _ in range(rounds):
        for name, run in contestants.items():
            if not found[name] or max(found[name]) < LONG:
                found[name].append(run())
    return found


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Hold this thread, and those that it starts meanwhile, on one core."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def load_in_words(*, is_ours: bool) -> str:
    """Return how busy the machine is, with a warning if that is not with us (`is_ours`)."""
    load, cores = os.getloadavg()[0], core_count()
    text = f"load {load:.1f} on {cores} cores"
    if not is_ours and load > 0.25 * cores:
        text += "; THE MACHINE IS NOT QUIET: trust ratios within a round at most, and no seconds"
    return text
