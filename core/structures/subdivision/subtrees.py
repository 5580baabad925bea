"""Building one tree with several threads: the top of it by the caller, large subtrees aside.

The builder of the top stops at a cell that is small enough to be a thread's own, hands it out as a
builder of its own, and goes on behind it. What comes out does not depend on how many threads there
are, since a split depends on its cell alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any, NamedTuple, Protocol, TypeVar

from ...errors import InputError
from ...parallel import core_count
from ...progress import Cancelled, Progress
from .frontier import DEPTH_FIRST, NO_BUDGET, PRIORITY
from .settings import ADVICE

T = TypeVar("T")

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
        Most nodes of the tree; NO_BUDGET for any number.
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


def follows_order(limits: Limits) -> bool:
    """Say whether it makes a difference in which order cells are split.

    Without a budget every order gives the same tree, since a split depends on its cell alone. The
    priority queue is followed even so: nothing else tells in which order it splits.
    """
    return limits.budget < NO_BUDGET or limits.order == PRIORITY


def in_any_order(limits: Limits, count: int, subtree: int) -> Limits:
    """Return the limits of a tree for which the order makes no difference.

    Depth-first needs least memory, and large subtrees can be left to threads.

    Parameters
    ----------
    count : int
        References of the root.
    subtree : int
        References up to which a subtree is built by one thread.
    """
    return limits._replace(order=DEPTH_FIRST, aside=subtree if count > subtree else 0)


class Meter:
    """Adds up what all builders of a tree have done, reports it, and refuses what gets too large.

    Parameters
    ----------
    name : str
        Of the structure.
    total : int
        Triangles of the scene.
    most_references, most_nodes : int
        The tree is refused where it has more of them.
    share : callable
        Returns the share of the tree that is done, from 0 to 1, for the sum of what the builders
        say they have done.
    """

    def __init__(
        self,
        name: str,
        total: int,
        progress: Progress,
        most_references: int,
        most_nodes: int,
        share: Callable[[float], float],
    ) -> None:
        self.name, self.total, self.progress, self.share = name, total, progress, share
        self.most_references, self.most_nodes = most_references, most_nodes
        self.references: dict[int, int] = {}
        self.nodes: dict[int, int] = {}
        self.done: dict[int, float] = {}
        self.stopped = False

    def check(self, builder: int, references: int, nodes: int, done: float) -> None:
        """Note how much a builder, named by its root, has listed, made and done.

        Raises
        ------
        InputError
            If the tree gets too large.
        Cancelled
            If another builder has failed meanwhile.
        """
        self.references[builder], self.nodes[builder] = references, nodes
        self.done[builder] = done
        for counts, most, what in (
            (self.references, self.most_references, "references to"),
            (self.nodes, self.most_nodes, "nodes over"),
        ):
            if _sum(counts) > most:
                raise InputError(
                    f"the {self.name} has more than {most} {what} {self.total} triangles; {ADVICE}"
                )
        if self.stopped:
            raise Cancelled

    def report(self) -> None:
        """Report the share of the tree that is done; raises Cancelled."""
        self.progress.report(self.share(_sum(self.done)), 1.0, f"Building {self.name}")


def _sum(counts: dict[int, Any]) -> Any:
    """Return the sum over all builders, others of which may enter theirs meanwhile."""
    return sum(tuple(counts.values()))


class Builder(Protocol):
    """What builds a tree, or a subtree."""

    def run(self, reports: bool = False) -> int:
        """Build until the tree is DONE or a cell is to be put ASIDE; only one of all reports."""

    def hand_out(self) -> tuple[int, Any]:
        """Return the cell that is put aside and a builder for it; leave it out here."""

    def finished(self) -> Any:
        """Return the tree; all other memory is given back."""


def results_of(futures: Iterable[Future[T]], meter: Meter) -> list[T]:
    """Return what threads return, reporting until all have.

    Raises
    ------
    Cancelled
        From the meter; threads go on.
    Exception
        From the first thread that fails.
    """
    all_of_them = list(futures)
    pending = set(all_of_them)
    while pending:
        done, pending = wait(pending, timeout=WAIT)
        for future in done:
            future.result()
        meter.report()
    return [future.result() for future in all_of_them]


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
                meter.report()
                node, builder = top.hand_out()
                subtrees[node] = pool.submit(build, builder)
                del builder  # the pool gives its memory back
            results_of(subtrees.values(), meter)
        finally:
            meter.stopped = True
            for future in subtrees.values():
                future.cancel()
    return {node: future.result() for node, future in subtrees.items()}
