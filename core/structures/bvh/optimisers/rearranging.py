"""Rearranging a finished tree: what its ways have in common.

The leaves of a tree hold one triangle each. However the tree is rearranged, they stay the same, and
so does their part of the cost. What can fall is the sum over the inner nodes:

    Cost = (C_trav * sum of SA(inner) + C_isect * sum of SA(leaf)) / SA(root)

So an optimiser looks for changes by which the areas of inner nodes shrink, and makes no other ones:
no step makes the tree worse. Leaves of several triangles are chosen afterwards
(:mod:`..topology.collapse`); to have them in mind while treelets are restructured, as Karras and
Aila do, was tried: it gained 0.1 to 1.6% more, and the curves of the optimisers would not have been
about the same cost.

Every change links nodes anew and fits boxes up to where nothing changes any more; the box of a
parent is always exactly the union of its children's.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from ....contract.build_log import FIT, MOVE, BuildLog
from ....contract.costs import CostSettings
from ....geometry.box import area_of
from ....geometry.box_shape import surface_area
from ....kernels import call, inner
from ....progress import Progress
from ..topology.collapse import list_preorder
from ..topology.tree import LinkedTree, root_of

LEAST_GAIN = 1e-12
"""Share of the root's area up to which a gain is rounding: trees that are equally good would be
exchanged for each other forever."""

ENOUGH = 1e-3
"""Share of the cost: an optimiser stops when two steps in a row gain less than that."""

MOST_COSTS = 50
"""Costs among the figures of a tree."""


class Notes(NamedTuple):
    """What a piece of work has left for the build log.

    Attributes
    ----------
    step : int
    rows : (k, 4) or (k,) int64
        Events, see :class:`Moves`, or nodes whose boxes have changed.
    gains : (k,) float64
        Of events.
    """

    step: int
    rows: np.ndarray
    gains: np.ndarray


class Moves(NamedTuple):
    """Notes of accepted moves.

    Attributes
    ----------
    made : (1,) int64
        Number of accepted moves.
    events : (room, 4) int64
        All moves of one kernel call, for the build log: kind, node, and its children as there.
        Without any rows, nothing is noted.
    gains : (room,) float64
    written : (1,) int64
        How many there are.
    """

    made: np.ndarray
    events: np.ndarray
    gains: np.ndarray
    written: np.ndarray


@dataclass(frozen=True)
class Rearrangement:
    """What an optimiser did.

    Attributes
    ----------
    costs : list of float
        SAH cost of the tree, one triangle a leaf, before the first step and after each.
    made : int
        Number of moves.
    log : callable, optional
        Puts the log of the moves together, if it was asked for; names are the nodes of the linked
        tree.
    """

    costs: list[float]
    made: int
    log: Callable[[], BuildLog] | None = None

    def figures(self) -> dict[str, Any]:
        """Return what the statistics of the tree say about it; of many costs only some."""
        last = len(self.costs) - 1
        shown = np.unique(np.linspace(0, last, min(last + 1, MOST_COSTS)).astype(np.int64))
        return {
            "optimise_costs": [self.costs[i] for i in shown],
            "optimise_steps": last,
            "optimise_moves": self.made,
        }


def make_moves(room: int = 0) -> Moves:
    """Return room for the events of one kernel call."""
    made, written = np.zeros(1, np.int64), np.zeros(1, np.int64)
    return Moves(made, np.empty((room, 4), np.int64), np.empty(room), written)


class Work:
    """An optimiser at work on a tree: what it costs by now, and the moves.

    Parameters
    ----------
    room : int
        Most events of one kernel call; 0 if there is to be no build log.

    Attributes
    ----------
    costs : list of float
        Before the first step and after each.
    moves : Moves
    least : float
        The gain, in units of area, from which on a move is made.
    """

    def __init__(self, tree: LinkedTree, settings: CostSettings, room: int) -> None:
        self._tree, self._settings = tree, settings
        self.costs, self.least = [cost_of(tree, settings)], least_gain(tree)
        self.moves = make_moves(room)
        self._events = [Notes(0, self.moves.events[:0], self.moves.gains[:0])]
        self._changed = [Notes(0, np.empty(0, np.int64), self.moves.gains[:0])]
        self._boxes = self._inner_boxes().copy() if room else None

    def _inner_boxes(self) -> np.ndarray:
        """Return the boxes of inner nodes: those of leaves never change."""
        return self._tree.boxes[(len(self._tree.boxes) + 1) // 2 :]

    def keep_events(self) -> None:
        """Take over what the last kernel call has noted; a log is made of it at the end."""
        if count := int(self.moves.written[0]):
            self.moves.written[0] = 0
            rows, gains = self.moves.events[:count].copy(), self.moves.gains[:count].copy()
            self._events.append(Notes(len(self.costs), rows, gains))

    def end_step(self) -> None:
        """Reckon up a step: what the tree costs now, and which boxes are others than before."""
        if self._boxes is not None:
            now = self._inner_boxes()
            # Six times as quick as asking every row whether any of its numbers has changed.
            rows = np.flatnonzero(now != self._boxes) // 6
            rows = rows[np.diff(rows, prepend=-1) > 0]
            self._boxes[rows] = now[rows]
            nodes = rows + (len(self._tree.boxes) - len(now))
            self._changed.append(Notes(len(self.costs), nodes, self.moves.gains[:0]))
        self.costs.append(cost_of(self._tree, self._settings))

    def done(self) -> Rearrangement:
        """Return what all steps did."""
        log = None
        if self._boxes is not None:
            root_area = float(surface_area(self._tree.boxes[root_of(self._tree)])) or 1.0
            log = functools.partial(
                log_of_work, self._events, self._changed,
                self._settings.C_trav / root_area, len(self._tree.boxes),
            )  # fmt: skip
        return Rearrangement(self.costs, int(self.moves.made[0]), log)


def log_of_work(
    events: list[Notes], changed: list[Notes], cost_of_area: float, n_nodes: int
) -> BuildLog:
    """Return the moves of every step, and behind them the boxes that they have changed.

    Parameters
    ----------
    cost_of_area : float
        What a gain of 1 in area is as a SAH cost.
    """
    names = np.arange(n_nodes)
    step, rows = together(events)
    gains = np.concatenate([notes.gains for notes in events])
    moves = BuildLog.of(MOVE, step, rows[:, 1], rows[:, 2:], cost=gains * cost_of_area, cells=names)
    moves = replace(moves, kind=rows[:, 0].astype(np.int8))
    return moves.merged_with(BuildLog.of(FIT, *together(changed), cells=names))


def together(notes: list[Notes]) -> tuple[np.ndarray, np.ndarray]:
    """Return the step of every row, (k,) int64, and the rows of all notes."""
    steps, counts = [each.step for each in notes], [len(each.rows) for each in notes]
    return np.repeat(steps, counts), np.concatenate([each.rows for each in notes])


def cost_of(tree: LinkedTree, settings: CostSettings) -> float:
    """Return the SAH cost of a tree with one triangle a leaf; 0 if its root has no area."""
    areas = surface_area(tree.boxes)
    n_leaves = (len(areas) + 1) // 2
    inner_sum, leaf_sum = areas[n_leaves:].sum(), areas[:n_leaves].sum()
    root_area = areas[root_of(tree)]
    if not root_area > 0.0:
        return 0.0
    return float((settings.C_trav * inner_sum + settings.C_isect * leaf_sum) / root_area)


def settled(costs: list[float], steps: int = 2) -> bool:
    """Say whether the last steps gained less than ENOUGH together."""
    return len(costs) > steps and not costs[-1] < costs[-1 - steps] * (1.0 - ENOUGH)


def from_leaves_up(
    tree: LinkedTree,
    at_once: int,
    work: Callable[[np.ndarray, int, int], None],
    progress: Progress,
    text: str,
) -> None:
    """Go over all nodes, children before parents.

    Parameters
    ----------
    at_once : int
        Nodes between two looks at the cancel button.
    work : callable
        Gets all nodes, parents first, and the range ``first, last`` to do now, from the last one
        to the first.
    """
    nodes = np.empty(len(tree.left), np.int32)
    call(list_preorder, tree, root_of(tree), nodes)
    for last in range(len(nodes), 0, -at_once):
        progress.report(len(nodes) - last, len(nodes), text)
        work(nodes, max(last - at_once, 0), last)
    progress.report(len(nodes), len(nodes), text)


def least_gain(tree: LinkedTree) -> float:
    """Return the gain, in units of area, from which on a move is made."""
    return LEAST_GAIN * float(surface_area(tree.boxes[root_of(tree)]))


@inner
def note_event(moves, kind, node, first, second, gain):
    """Note a move for the build log, if there is room."""
    row = moves.written[0]
    if row < len(moves.events):
        moves.events[row, 0], moves.events[row, 1] = kind, node
        moves.events[row, 2], moves.events[row, 3] = first, second
        moves.gains[row] = gain
        moves.written[0] = row + 1


@inner
def fit_node(tree, node):
    """Put the box of an inner node around those of its children; say whether it changed."""
    box, a, b = tree.boxes[node], tree.boxes[tree.left[node]], tree.boxes[tree.right[node]]
    changed = False
    for axis in range(3):
        low, high = min(a[axis], b[axis]), max(a[3 + axis], b[3 + axis])
        changed = changed or low != box[axis] or high != box[3 + axis]
        box[axis], box[3 + axis] = low, high
    return changed


@inner
def fit_upwards(tree, node):
    """Fit boxes from a node on up to where nothing changes; return how much area they gained."""
    growth = 0.0
    while node >= 0:
        before = area_of(tree.boxes[node])
        if not fit_node(tree, node):
            break
        growth += area_of(tree.boxes[node]) - before
        node = tree.parent[node]
    return growth


@inner
def sibling_of(tree, node):
    """Return the other child of a node's parent."""
    parent = tree.parent[node]
    return tree.left[parent] + tree.right[parent] - node


@inner
def hang(tree, node, parent, old):
    """Make a node the child of `parent` in place of `old`, or the root if that is -1."""
    tree.parent[node] = parent
    if parent < 0:
        return
    if tree.left[parent] == old:
        tree.left[parent] = node
    else:
        tree.right[parent] = node


@inner
def detach(tree, node):
    """Cut off a node together with its parent, whose place the sibling takes.

    The parent keeps the node as its only child, ready for :func:`attach`. Return the area that this
    saves: all of the parent's, and what ancestors shrink by.
    """
    parent, sibling = tree.parent[node], sibling_of(tree, node)
    above = tree.parent[parent]
    hang(tree, sibling, above, parent)
    return area_of(tree.boxes[parent]) - fit_upwards(tree, above)


@inner
def attach(tree, node, place):
    """Hang a node that was cut off beside `place`; its own parent becomes that of both."""
    parent, above = tree.parent[node], tree.parent[place]
    hang(tree, parent, above, place)
    tree.left[parent], tree.right[parent] = place, node
    tree.parent[place] = parent
    fit_node(tree, parent)
    fit_upwards(tree, above)


class Optimises(Protocol):
    """Rearranges a tree in place; all moves are kept if asked for."""

    def __call__(
        self, tree: LinkedTree, settings: Any, progress: Progress, log: bool = ...
    ) -> Rearrangement:
        """Rearrange a tree as settings say."""


class Optimiser(NamedTuple):
    """A way to rearrange a finished tree.

    Attributes
    ----------
    summary : str
        One sentence without a full stop.
    Settings : type
        Its settings dataclass.
    optimise : callable or None
        Rearranges a tree in place: ``optimise(tree, settings, progress, log)``, where `log` says
        whether all moves are to be kept; None leaves it alone.
    """

    summary: str
    Settings: type
    optimise: Optimises | None
