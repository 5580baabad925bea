"""A rearranged tree as it was before and after any of its moves: those of its log, made again.

What a move did to boxes depends on all that was moved before. A log of every box would be larger
than the tree by far, and the events are enough: from the tree as it was built they lead to the
finished one, through the very same boxes.
"""

from __future__ import annotations

import numpy as np

from ....contract.build_log import MOVE, REINSERT, BuildLog
from ....kernels import call, kernel
from ....progress import Progress
from ..topology.build_log import tree_as_built
from .rearranging import attach, detach, fit_upwards

EVENTS_AT_ONCE = 1 << 14
"""Events in one kernel call, some 20 ms."""


@kernel
def redo(tree, kinds, nodes, children, begins, first, last):
    """Make the events ``first <= i < last`` of a log again.

    Parameters
    ----------
    begins : (k,) bool
        Where what belongs together begins: boxes are fitted when all of it is linked.
    """
    start = first
    for i in range(first, last):
        node = nodes[i]
        start = i if begins[i] else start
        if kinds[i] == REINSERT:
            detach(tree, node)
            attach(tree, node, children[i, 0])
            continue
        tree.left[node], tree.right[node] = children[i, 0], children[i, 1]
        tree.parent[children[i, 0]] = tree.parent[children[i, 1]] = node
        if i + 1 == last or begins[i + 1]:
            for linked in range(i, start - 1, -1):
                fit_upwards(tree, nodes[linked])


class Replay:
    """A tree between two moves of its optimiser, at first before all of them.

    Parameters
    ----------
    log : BuildLog
        Of a hierarchy that was rearranged.
    boxes : (r, 6) float64
        Of its references.

    Attributes
    ----------
    tree : LinkedTree
        Its nodes are the names of the log.
    node : (k,) int32
        Of every event that is a part of a move, see :class:`....contract.build_log.BuildLog`.
    children : (k, 2) int32
    moves : (j, 2) int64
        Which events every move consists of: its first one, and the one behind its last.
    gains : (j,) float64
        By how much it lowered the SAH cost.
    """

    def __init__(self, log: BuildLog, boxes: np.ndarray) -> None:
        self.tree = tree_as_built(log, boxes)
        events = np.flatnonzero(np.isin(log.kind, (MOVE, REINSERT)))
        self._kind = log.kind[events]
        self.node, self.children = log.node[events], log.children[events]
        gains = log.cost[events]
        # Where branches were balanced, nobody reckoned a gain, but that was a step of its own.
        self._begins = ~np.isnan(gains) | (np.diff(log.step[events], prepend=-1) > 0)
        first = np.flatnonzero(self._begins)
        parts = np.stack([first, np.append(first, len(events))[1:]], axis=1)
        is_move = ~np.isnan(gains[first])
        self.moves, self.gains = parts[is_move], gains[first[is_move]]
        self._done = 0

    def go_on(self, event: int, progress: Progress, text: str) -> None:
        """Make all events before one that begins a move, or all if there is no such event.

        Raises
        ------
        Cancelled
            From `progress`; what has been made stays.
        """
        while self._done < event:
            progress.report(self._done, len(self.node), text)
            last = min(self._done + EVENTS_AT_ONCE, event)
            while last < event and not self._begins[last]:
                last += 1
            call(
                redo, self.tree, self._kind, self.node, self.children, self._begins,
                self._done, last,
            )  # fmt: skip
            self._done = last
