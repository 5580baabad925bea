"""Top-down construction as a GPU does it: all nodes of a level are split side by side.

The input queue has the m nodes of a level. All are split at once (:mod:`.parallel_split`): node i
writes its children into the places 2 i and 2 i + 1 of the output queue, so nobody has to wait for
anybody; a leaf leaves both empty. Compaction then closes the gaps: the exclusive scan of 1 for a
child and 0 for a gap says where each child belongs. That is the input of the next level. No queue
has more nodes than there are triangles.

C. Lauterbach, M. Garland, S. Sengupta, D. Luebke, D. Manocha: Fast BVH Construction on GPUs,
Eurographics 2009.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from .....kernels import call, inner, kernel, whole
from .....parallel import Spare, core_count
from .....progress import Progress
from ...topology.build_log import log_of_splits
from ...topology.tree import Builder, Grouping, Primitives, Splits, Tree
from .binned_sah import BinnedSettings
from .parallel_split import (
    DataParallel,
    best_candidate,
    data_parallel_rules,
    evaluate_candidates,
    place_candidates,
)
from .recursion import TEXT, compact, enclose, room_for, settle

EMPTY = -1
"""The node in a gap of a queue."""

# Columns of a queue.
NODE, FIRST, COUNT, DEPTH = range(4)

TESTS = 1 << 23
"""Tests of triangles against candidates in one kernel call, some 40 ms. Between calls the builder
looks at the cancel button."""


class Level(NamedTuple):
    """The queues of a level.

    Attributes
    ----------
    queue : (m, 4) int64
        The input: NODE, FIRST, COUNT, DEPTH of every node.
    output : (2 m, 4) int64
        The children, with gaps.
    compacted : (k, 4) int64
        The children without gaps: the queue of the next level.
    """

    queue: np.ndarray
    output: np.ndarray
    compacted: np.ndarray

    def n_split(self) -> int:
        """Return how many nodes were split; the others are leaves."""
        return len(self.compacted) // 2


class Share(NamedTuple):
    """What of the splits of a queue one kernel call does.

    Attributes
    ----------
    begin, end : int
        The nodes ``begin <= i < end``
    largest : int
        that have no more triangles than that.
    begins, ends : bool
        Whether the nodes are prepared before, and split after
    first_candidate, last_candidate : int
        these candidates are evaluated.
    """

    begin: int
    end: int
    largest: int
    begins: bool
    ends: bool
    first_candidate: int
    last_candidate: int


# ------------------------------------------------------------------------------------- kernels


@inner
def write_children(tree, queue, output, i, n_left):
    """Write the children of node i of the queue into its two places of the output."""
    left = whole(tree.first[queue[i, NODE]])
    for child in range(2):
        place = output[2 * i + child]
        place[NODE] = left + child if n_left > 0 else EMPTY
        place[FIRST] = queue[i, FIRST] + child * n_left
        place[COUNT] = n_left if child == 0 else queue[i, COUNT] - n_left
        place[DEPTH] = queue[i, DEPTH] + 1


@kernel
def split_range(rule, tree, splits, queue, output, share):
    """Do a share of the work on the nodes of a queue."""
    for i in range(share.begin, share.end):
        node, first = queue[i, NODE], queue[i, FIRST]
        count, depth = queue[i, COUNT], queue[i, DEPTH]
        if count > share.largest:
            continue
        if share.begins:
            enclose(rule, first, count)
            place_candidates(rule, first, count, depth)
        evaluate_candidates(rule, first, count, share.first_candidate, share.last_candidate)
        if share.ends:
            axis, place, position, cost = best_candidate(rule)
            n_left = settle(rule, tree, splits, node, first, count, axis, place, position, cost)
            write_children(tree, queue, output, i, n_left)


@kernel
def compact_queue(output, places, compacted):
    """Close the gaps of an output queue; return how many nodes there are.

    `places`, one for each, get the exclusive scan.
    """
    n_nodes = 0
    for i in range(len(output)):
        places[i] = n_nodes
        if output[i, NODE] != EMPTY:
            n_nodes += 1
    for i in range(len(output)):
        if output[i, NODE] != EMPTY:
            for column in range(4):
                compacted[places[i], column] = output[i, column]
    return n_nodes


# -------------------------------------------------------------------------------------- driver


def levels_of(
    make_rule: Callable[[], DataParallel],
    count: int,
    tree: Tree,
    splits: Splits,
    progress: Progress,
) -> Iterator[Level]:
    """Build a tree level by level; yield each level when it is done.

    A large node is split by all threads, each with some of the candidates. Small ones are split
    side by side.

    Parameters
    ----------
    make_rule : callable
        Returns a rule with scratch memory of its own, for one thread.
    count : int
        Triangles.
    tree, splits
        From :func:`.recursion.room_for`.

    Raises
    ------
    Cancelled
        From `progress`; calls under way are awaited first.
    """
    queue = np.array([[0, 0, count, 0]], np.int64)
    spare = Spare(make_rule)

    def work(rule: DataParallel, share: Share) -> None:
        call(split_range, rule, tree, splits, queue, output, share)

    def work_on_large(share: Share) -> None:
        work(large._replace(sides=np.empty((2, 6))), share)

    def work_on_small(share: Share) -> None:
        with spare.lent() as rule:
            work(rule, share)

    def run(function: Callable[[Share], None], shares: list[Share]) -> None:
        """Do all shares, on several threads."""
        futures = [pool.submit(function, share) for share in shares]
        try:
            for future in futures:
                future.result()
                progress.report(done, count, TEXT)
        finally:
            for future in futures:
                future.cancel()

    large = make_rule()
    n_candidates = len(large.costs)
    largest = TESTS // n_candidates
    with ThreadPoolExecutor(core_count()) as pool:
        while len(queue):
            done = count - int(queue[:, COUNT].sum())
            progress.report(done, count, TEXT)
            output = np.empty((2 * len(queue), 4), np.int64)
            for i in np.flatnonzero(queue[:, COUNT] > largest).tolist():
                size = int(queue[i, COUNT])
                node = Share(i, i + 1, size, False, False, 0, 0)
                work_on_large(node._replace(begins=True))
                step = max(TESTS // size, 1)
                run(
                    work_on_large,
                    [
                        node._replace(first_candidate=k, last_candidate=min(k + step, n_candidates))
                        for k in range(0, n_candidates, step)
                    ],
                )
                work_on_large(node._replace(ends=True))
            run(
                work_on_small,
                [
                    Share(begin, end, largest, True, True, 0, n_candidates)
                    for begin, end in chunks_of(queue[:, COUNT], largest)
                ],
            )
            compacted = np.empty_like(output)
            n_nodes = call(compact_queue, output, np.empty(len(output), np.int64), compacted)
            level = Level(queue, output, compacted[:n_nodes].copy())
            yield level
            queue = level.compacted
    progress.report(count, count, TEXT)


def chunks_of(counts: np.ndarray, largest: int) -> list[tuple[int, int]]:
    """Cut a queue into ranges of about a quarter of `largest` triangles, to be split by one call.

    Nodes with more triangles than `largest` do not count.
    """
    work = np.cumsum(np.where(counts > largest, 0, counts)) // max(largest // 4, 1)
    ends = [*(np.flatnonzero(np.diff(work)) + 1).tolist(), len(counts)]
    return list(zip([0, *ends[:-1]], ends, strict=True))


def build_parallel_sah(
    primitives: Primitives, settings: BinnedSettings, progress: Progress, log: bool = False
) -> Grouping:
    """Build the tree level by level; the boxes of the primitives are reordered.

    The figures are the length of the queue at every level, and how many of its nodes were split.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    make_rule, order = data_parallel_rules(primitives, settings)
    tree, splits = room_for(len(order), log)
    lengths, split = [], []
    for level in levels_of(make_rule, len(order), tree, splits, progress):
        lengths.append(len(level.queue))
        split.append(level.n_split())
    figures = {"queue_lengths": lengths, "queue_splits": split}
    out = compact(tree)
    told = functools.partial(log_of_splits, out, splits, by_level=True) if log else None
    return Grouping(out, order, figures=figures, log=told)


BUILDER = Builder(
    "From the top down, level by level with queues, as on a GPU (Lauterbach 2009)",
    BinnedSettings,
    build_parallel_sah,
    bytes_per_triangle=370,
)
