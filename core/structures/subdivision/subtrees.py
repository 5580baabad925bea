"""Building one tree with several threads: the top of it by the caller, large subtrees aside.

The builder of the top stops at a cell that is small enough to be a thread's own, hands it out as a
builder of its own, and goes on behind it. What comes out does not depend on how many threads there
are, since a split depends on its cell alone.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, NamedTuple, Protocol

from ...parallel import core_count

DONE, PAUSED, ASIDE = range(3)
"""What a builder ends with: the tree is complete, there is more to do, a cell is to be put
aside."""

SMALL = 1024
"""References up to which a cell is not worth a thread."""

WAIT = 0.1
"""Seconds between two reports while only threads are at work."""


class Limits(NamedTuple):
    """When to stop.

    Attributes
    ----------
    max_depth, max_leaf_size : int
    budget : int
        Most nodes of the tree.
    references : float
        Most references of the tree, inf for any number.
    order : int
        DEPTH_FIRST, FIFO or PRIORITY.
    aside : int
        Cells with at most so many references, but more than SMALL, are left to the caller; 0 for
        none.
    """

    max_depth: int
    max_leaf_size: int
    budget: int
    references: float
    order: int
    aside: int


class Meter(Protocol):
    """What adds up the work of all builders."""

    stopped: bool

    def report(self) -> None:
        """Report progress; raises Cancelled."""


class Builder(Protocol):
    """What builds a tree, or a subtree."""

    def run(self, reports: bool = False) -> int:
        """Build until the tree is DONE or a cell is to be put ASIDE; only one of all reports."""

    def hand_out(self) -> tuple[int, Any]:
        """Return the cell that is put aside and a builder for it; leave it out here."""

    def finished(self) -> Any:
        """Return the tree; all other memory is given back."""


def build_with_threads(top: Builder, meter: Meter, threads: int = 0) -> dict[int, Any]:
    """Run a builder to its end, and those that it hands out in threads.

    Parameters
    ----------
    threads : int
        0 takes every core.

    Returns
    -------
    pieces : dict of int to object
        The finished subtree of every cell that was handed out, by the number of the cell.

    Raises
    ------
    InputError
        When the tree gets too large.
    Cancelled
        From the meter.
    """

    def build(builder: Builder) -> Any:
        builder.run()
        return builder.finished()

    subtrees: dict[int, Future[Any]] = {}
    with ThreadPoolExecutor(threads or core_count()) as pool:
        try:
            while top.run(reports=True) == ASIDE:
                node, builder = top.hand_out()
                subtrees[node] = pool.submit(build, builder)
                del builder  # the pool gives its memory back
            pending = set(subtrees.values())
            while pending:
                done, pending = wait(pending, timeout=WAIT)
                for future in done:
                    future.result()
                meter.report()
        finally:
            meter.stopped = True
            for future in subtrees.values():
                future.cancel()
    return {node: future.result() for node, future in subtrees.items()}
