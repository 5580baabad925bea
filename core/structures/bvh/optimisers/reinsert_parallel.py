r"""Parallel reinsertion: every node looks for a better place at once; then the moves are made.

A round has two halves. In the first, every node X searches the tree as it stands, without changing
it, so that threads share the work. In the second, the moves are made, the greatest gain first and
of equal ones the lowest node first: the tree does not depend on the threads. Moves are in conflict
if they share one of the nodes that they link anew: X, its sibling and parent, the place and its
parent. The first of them is made, the others have to wait for the next round. Moves that share none
may still have changed each other's boxes, so every move is made only if it pays by then.

The search climbs from X to the root. On the way it adds up what X saves where it leaves: the whole
parent, and what each ancestor shrinks by. From every ancestor it descends on the other side:

              A             X hangs below P, beside S. If it moves beside C:
            /   \
          ...   ...         gain =   SA(P) + what the nodes between P and A shrink by
          /       \                - what the nodes between A and C grow by - SA(C + X)
         P         C
        / \                 A contains X before and after; from there up nothing changes.
       X   S

Subtrees in which even SA(X) instead of SA(C + X) would not beat the best gain are left out.

When it pays: every node searches in every round, so the work is one and a half to three times that
of :mod:`.reinsert` on scenes of few large and many small triangles, for the same gain, and about as
much on evenly scanned surfaces. SAH cost saved, and processor seconds:

    builder     mesh (triangles)   parallel       one after another
    binned_sah  Sponza (66,450)    15.9%, 1.1 s   15.4%, 0.4 s
    binned_sah  kitchen (56,939)   21.7%, 0.9 s   21.6%, 0.3 s
    binned_sah  dragon (202,520)    2.8%, 1.4 s    2.8%, 1.8 s
    ploc        Sponza             10.9%, 0.8 s   11.1%, 0.5 s
    ploc        kitchen             8.5%, 0.9 s    8.6%, 0.3 s
    ploc        dragon             10.1%, 2.7 s   10.2%, 2.6 s

All cores share the searching, one makes the moves: it pays with more cores than that factor says.
:mod:`.reinsert_batches` lets only the largest nodes search.

D. Meister, J. Bittner: Parallel Reinsertion for Bounding Volume Hierarchy Optimization,
Computer Graphics Forum 37(2), 2018.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ....contract.build_log import REINSERT
from ....contract.costs import CostSettings
from ....geometry.box import area_of, union_area
from ....kernels import call, inner, kernel
from ....parallel import Spare, for_chunks
from ....progress import Progress
from ..topology.tree import LinkedTree
from .rearranging import (
    Optimiser,
    Rearrangement,
    Work,
    attach,
    detach,
    note_event,
    settled,
    sibling_of,
)

MOST_VISITS = 1 << 13
"""Nodes at which a search ends with the best place so far; some hundred are usual. It also bounds
the stack, however deep the tree is."""

MOVES_AT_ONCE = 512
"""Moves in one kernel call. The first are the dearest: 4096 of a million triangles took 0.6 s."""


class Search(NamedTuple):
    """Scratch memory of one searching thread.

    Attributes
    ----------
    savings : (MOST_VISITS + 2,) float64
    nodes : (MOST_VISITS + 2,) int32
        The stack: subtrees to search, and what hanging X below them saves so far.
    rest : (6,) float64
        Box of an ancestor without X.
    """

    savings: np.ndarray
    nodes: np.ndarray
    rest: np.ndarray


@inner
def widen(box, other):
    """Widen a box so that it contains another one."""
    for axis in range(3):
        box[axis] = min(box[axis], other[axis])
        box[3 + axis] = max(box[3 + axis], other[3 + axis])


@inner
def search_place(tree, node, least, search):
    """Find the best place of a node; return it, or -1, and the gain, which is above `least`."""
    boxes, savings, nodes, rest = tree.boxes, search.savings, search.nodes, search.rest
    box = boxes[node]
    area = area_of(box)
    best, place, visits = least, -1, 0
    came, above = node, tree.parent[node]
    saved = area_of(boxes[above])
    for side in range(6):
        rest[side] = boxes[sibling_of(tree, node), side]
    while above >= 0 and visits < MOST_VISITS:
        # Down on the other side.
        savings[0], nodes[0] = saved, sibling_of(tree, came)
        size = 1
        while size > 0 and visits < MOST_VISITS:
            size -= 1
            visits += 1
            other, saving = nodes[size], savings[size]
            if saving - area <= best:
                continue
            gain = saving - union_area(boxes[other], box)
            if gain > best:
                best, place = gain, other
            saving = gain + area_of(boxes[other])
            if tree.left[other] >= 0 and saving - area > best:
                nodes[size], nodes[size + 1] = tree.right[other], tree.left[other]
                savings[size] = savings[size + 1] = saving
                size += 2
        # Up: what is left of the ancestor, and X hung beside that.
        if came != node:
            widen(rest, boxes[sibling_of(tree, came)])
            saved += area_of(boxes[above]) - area_of(rest)
            if saved - area_of(boxes[above]) > best:
                best, place = saved - area_of(boxes[above]), above
        came, above = above, tree.parent[above]
    return place, best


@kernel
def search_range(tree, nodes, first, last, least, search, places, gains):
    """Find the best places of the nodes of a list from `first` on, before `last`."""
    for i in range(first, last):
        places[i] = -1
        if tree.parent[nodes[i]] >= 0:
            places[i], gains[i] = search_place(tree, nodes[i], least, search)


@inner
def growth(tree, node, place):
    """Return the area that hanging a node beside `place` costs; inf if that is below the node."""
    box = tree.boxes[node]
    cost = union_area(tree.boxes[place], box)
    above = place
    while above >= 0:
        if above == node:
            return np.inf
        if above != place:
            cost += union_area(tree.boxes[above], box) - area_of(tree.boxes[above])
        above = tree.parent[above]
    return cost


@kernel
def make_range(tree, nodes, places, first, last, least, touched, moves):
    """Make those moves of a list that are in no conflict with earlier ones and still pay."""
    for i in range(first, last):
        node, place = nodes[i], places[i]
        parent, sibling, above = tree.parent[node], sibling_of(tree, node), tree.parent[place]
        if (
            touched[node] or touched[place] or touched[parent] or touched[sibling]
            or (above >= 0 and touched[above])
        ):  # fmt: skip
            continue
        saved = detach(tree, node)
        gain = saved - growth(tree, node, place)
        if not gain > least:
            attach(tree, node, sibling)
            continue
        touched[node] = touched[place] = touched[parent] = touched[sibling] = True
        if above >= 0:
            touched[above] = True
        moves.made[0] += 1
        note_event(moves, REINSERT, node, place, sibling, gain)
        attach(tree, node, place)


class Rounds:
    """Rounds of one tree.

    Attributes
    ----------
    costs : list of float
        Before the first round and after each.
    """

    def __init__(
        self, tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool
    ) -> None:
        self._tree, self._progress = tree, progress
        self._work = Work(tree, settings, MOVES_AT_ONCE if log else 0)
        self._spare = Spare(make_search)
        self.costs = self._work.costs

    def run(self, nodes: np.ndarray) -> None:
        """Let some nodes search at once, then make their moves.

        Parameters
        ----------
        nodes : (n,) int32
            In ascending order.

        Raises
        ------
        Cancelled
            From the progress.
        """
        tree, work, number = self._tree, self._work, len(self.costs)
        places, gains = np.empty(len(nodes), np.int32), np.empty(len(nodes))

        def search_chunk(first: int, last: int) -> None:
            with self._spare.lent() as search:
                call(search_range, tree, nodes, first, last, work.least, search, places, gains)

        text = f"Searching places, round {number}"
        for_chunks(search_chunk, len(nodes), 0, self._progress, text)
        found = np.flatnonzero(places >= 0)
        found = found[np.argsort(-gains[found], kind="stable")]
        movers, targets = nodes[found], places[found]
        touched = np.zeros(len(tree.left), np.bool_)
        text = f"Reinserting, round {number}"
        for first in range(0, len(movers), MOVES_AT_ONCE):
            self._progress.report(first, len(movers), text)
            last = min(first + MOVES_AT_ONCE, len(movers))
            call(make_range, tree, movers, targets, first, last, work.least, touched, work.moves)
            work.keep_events()
        self._progress.report(len(movers), len(movers), text)
        work.end_step()

    def rearrangement(self) -> Rearrangement:
        """Return what all rounds did."""
        return self._work.done()


def reinsert_in_parallel(
    tree: LinkedTree, settings: CostSettings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Reinsert in rounds until one gains less than ENOUGH; a step is a round.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    rounds, nodes = Rounds(tree, settings, progress, log), np.arange(len(tree.left), dtype=np.int32)
    while not settled(rounds.costs):
        rounds.run(nodes)
    return rounds.rearrangement()


def make_search() -> Search:
    """Return scratch memory for one thread."""
    size = MOST_VISITS + 2
    return Search(np.empty(size), np.empty(size, np.int32), np.empty(6))


OPTIMISER = Optimiser(
    "All nodes look for a better place at once; on few cores slower than one "
    "after another (Meister and Bittner 2018)",
    CostSettings,
    reinsert_in_parallel,
)
