"""Cutting of CSG trees: bounds go from the leaves up, and what lies above cuts those below.

The lecture: "Primary bounding solids are assigned to elementary solids (analytic computation);
bounding solids are propagated from leaves to the root node; subtractive operations can reduce
bounding solids in ancestors (arguments)".

*Up*: a union is bounded by what is around both operands, an intersection by what both bounds share,
a difference by its first operand; and where what is taken away covers a whole slice at an end of
that, by the rest.

*Down*: nothing of an operand matters outside of the bound of the node above; and nothing of what is
taken away outside of what it is taken from. So both are cut with that.

Cut operands have smaller nodes above them, which cut others: passes are repeated until nothing
changes. An operand whose bound becomes empty is *pruned*: nothing is left of an intersection then,
and a union or a difference is its other operand.

A ray that misses the bound of a node need not ask what is below: whatever is found there, none of
it is in what the root is. So cutting changes no hit, bit for bit (see :mod:`.volumes`).

S. Cameron: Efficient Bounds in Constructive Solid Geometry, IEEE CG&A 11(3), 1991.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..solids.mixed import BOX, MATRIX
from .settings import CUT, NONE, UPWARD, CuttingSettings
from .trees import (
    DIFFERENCE,
    HALF_SPACE,
    INTERSECTION,
    NOTHING,
    SOLID,
    UNION,
    Csg,
    Nodes,
    depths_of,
    parents_of,
)
from .volumes import Strips, kind_of, margin_of

UP, DOWN = "up", "down"

MOST_PASSES = 64
"""Of both kinds; two or three of each are usual. Spheres may go on to become smaller a little."""

SMALLER = 1e-9
"""Share by which a bound has to become smaller for another pass."""


class Pass(NamedTuple):
    """How bounds are after one pass.

    Attributes
    ----------
    direction : {"up", "down"}
    rows : (n_nodes, ...) float64
        Of a kind of volume, see :mod:`.volumes`.
    is_pruned : (n_nodes,) bool
        Of which nodes nothing is left by now; what lies below such a one has no meaning.
    changed : (k,) int64
        Nodes that this pass has made smaller, or pruned.
    """

    direction: str
    rows: np.ndarray
    is_pruned: np.ndarray
    changed: np.ndarray


class Cutting(NamedTuple):
    """What cutting has made of trees.

    Attributes
    ----------
    kind : object
        What is known of the kind of volume, see :mod:`.volumes`.
    own : (n_nodes, ...) float64
        The bounds of leaves before the first pass.
    passes : tuple of Pass
    margin : float
        By how much volumes are larger than the bounds.
    pruned : Nodes
        The trees without what is pruned.
    starts : (n,) int32
        As of :class:`.trees.Csg`.
    """

    kind: Any
    own: np.ndarray
    passes: tuple[Pass, ...]
    margin: float
    pruned: Nodes
    starts: np.ndarray

    @property
    def upward(self) -> np.ndarray:
        """The bounds after the first pass: of leaves their own, of nodes those from below."""
        return self.passes[0].rows

    @property
    def final(self) -> Pass:
        """The last pass."""
        return self.passes[-1]


def cutting_of(geometry: Csg, settings: CuttingSettings) -> Cutting:
    """Find the bounds of all nodes, pass by pass.

    With UPWARD there is one pass; with NONE there is as well, to look at.
    """
    kind, margin = kind_of(settings.csg_volume), margin_of(geometry)
    own = kind.of_leaves(geometry)
    inner = inner_boxes(geometry) if isinstance(kind, Strips) else None
    levels = levels_of(geometry.nodes)
    work = _Work(geometry.nodes, kind, margin, inner, levels)
    rows, dead = work.up(own.copy(), np.zeros(len(own), bool), is_first=True)
    everything = np.arange(len(own))
    passes = [Pass(UP, rows, dead, everything)]
    while settings.csg_bounds == CUT and len(passes) < MOST_PASSES:
        for direction, go in ((DOWN, work.down), (UP, work.up)):
            before, was_dead = passes[-1].rows, passes[-1].is_pruned
            rows, dead = go(before.copy(), was_dead.copy())
            changed = np.flatnonzero(is_smaller(before, rows) | (dead & ~was_dead))
            passes.append(Pass(direction, rows, dead, changed))
        if not len(passes[-1].changed):
            break
    is_pruned = passes[-1].is_pruned & (settings.csg_bounds != NONE)
    return Cutting(
        kind, own, tuple(passes), margin, *without_pruned(geometry.nodes, geometry.roots, is_pruned)
    )


def cut(geometry: Csg, settings: CuttingSettings) -> Csg:
    """Return trees whose nodes are bounded as the settings say."""
    return bounded(geometry, cutting_of(geometry, settings), settings)


def bounded(geometry: Csg, cutting: Cutting, settings: CuttingSettings) -> Csg:
    """Return trees with the bounds, and without the operands, that cutting has left."""
    kind, rows = cutting.kind, cutting.final.rows.copy()
    parents = parents_of(cutting.pruned)
    below = np.flatnonzero(parents != NOTHING)
    # Of bounds that do not say exactly what two share, an operand may have been given that of the
    # node above, which a ray has met before. Its own says more then.
    if not kind.is_exact:
        says_nothing = below[kind.holds(rows[below], rows[parents[below]])]
        rows[says_nothing] = cutting.upward[says_nothing]
    is_bounded = kind.is_finite(rows) & (settings.csg_bounds != NONE)
    # Where a bound holds all of that of the node above, a ray that comes there does not miss it. A
    # box of a root is that of the item, which has been tested.
    is_bounded[below] &= ~kind.holds(rows[below], rows[parents[below]])
    if settings.csg_volume == "aabb":
        is_bounded[cutting.starts[cutting.starts != NOTHING]] = False
    return geometry._replace(
        pruned=cutting.pruned, starts=cutting.starts, is_bounded=is_bounded,
        bounds=cutting.kind.volumes(rows, cutting.margin), cutting=settings,
    )  # fmt: skip


def is_smaller(before: np.ndarray, now: np.ndarray) -> np.ndarray:
    """Say which rows have changed by more than is worth another pass, (n,) bool."""
    flat, other = before.reshape(len(before), -1), now.reshape(len(now), -1)
    with np.errstate(invalid="ignore"):
        size = np.where(np.isfinite(flat), np.abs(flat), 0.0).max(axis=1, keepdims=True, initial=0)
        return ((flat != other) & ~(np.abs(flat - other) <= SMALLER * size)).any(axis=1)


def levels_of(nodes: Nodes) -> list[np.ndarray]:
    """Return the set operations of each depth, the deepest first."""
    inner = np.flatnonzero(nodes.kind >= UNION)
    depths = depths_of(nodes)[inner]
    return [inner[depths == depth] for depth in np.unique(depths)[::-1]]


class _Work(NamedTuple):
    """What both kinds of passes need."""

    nodes: Nodes
    kind: Any
    margin: float
    inner: np.ndarray | None
    levels: list[np.ndarray]

    def up(
        self, rows: np.ndarray, dead: np.ndarray, is_first: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Bound nodes by their operands, from the leaves to the roots."""
        nodes, kind = self.nodes, self.kind
        for some in self.levels:
            left, right = nodes.left[some], nodes.right[some]
            a, b, operation = rows[left], rows[right], nodes.kind[some]
            new = a.copy()
            which = np.flatnonzero((operation == UNION) & ~dead[left] & ~dead[right])
            new[which] = kind.together(a[which], b[which])
            which = np.flatnonzero((operation == UNION) & dead[left])
            new[which] = b[which]
            which = np.flatnonzero(operation == INTERSECTION)
            new[which] = kind.shared(a[which], b[which], self.margin)
            if self.inner is not None:
                which = np.flatnonzero((operation == DIFFERENCE) & ~dead[left] & ~dead[right])
                new[which] = self._without_slices(a[which], right[which])
            if not is_first:
                new = kind.shared(new, rows[some], self.margin)
            rows[some] = new
            dead[some] |= kind.is_empty(new, self.margin)
            dead[some] |= np.select(
                [operation == UNION, operation == INTERSECTION],
                [dead[left] & dead[right], dead[left] | dead[right]],
                dead[left],
            ).astype(bool)
        return rows, dead

    def down(self, rows: np.ndarray, dead: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cut operands with the nodes above, from the roots to the leaves."""
        nodes, kind = self.nodes, self.kind
        for some in self.levels[::-1]:
            left, right = nodes.left[some], nodes.right[some]
            rows[left] = kind.shared(rows[left], rows[some], self.margin)
            # Also of a difference: it is within its first operand, and nothing is taken from
            # outside of it.
            rows[right] = kind.shared(rows[right], rows[some], self.margin)
            for operands in (left, right):
                dead[operands] |= kind.is_empty(rows[operands], self.margin) | dead[some]
        return rows, dead

    def _without_slices(self, a: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Return bounds without what is taken away over their whole width, at one of their ends.

        With room to spare: where a side of both is the same, rounding decides which of them a ray
        in that side meets.
        """
        assert self.inner is not None
        low, high = a[:, 0].copy(), a[:, 1].copy()
        inside_low, inside_high = self.inner[right, 0], self.inner[right, 1]
        room = 4.0 * self.margin
        for axis in range(3):
            others = [(axis + 1) % 3, (axis + 2) % 3]
            covers = (
                (inside_low[:, others] <= low[:, others] - room)
                & (inside_high[:, others] >= high[:, others] + room)
            ).all(axis=1)
            begin, end = inside_low[:, axis], inside_high[:, axis]
            at_low = covers & (begin <= low[:, axis] - room) & (end > low[:, axis])
            at_high = covers & (end >= high[:, axis] + room) & (begin < high[:, axis])
            low[at_low, axis] = end[at_low]
            high[at_high, axis] = begin[at_high]
        return np.stack([low, high], axis=1)


def inner_boxes(geometry: Csg) -> np.ndarray:
    """Return a box inside of each node, (n_nodes, 2, 3): low and high; none where low is above.

    Of boxes and half-spaces along the axes, and of what is made of them.
    """
    nodes, solids = geometry.nodes, geometry.solids
    rows = np.empty((len(nodes.kind), 2, 3))
    rows[:, 0], rows[:, 1] = np.inf, -np.inf
    leaves = np.flatnonzero(nodes.kind == SOLID)
    which = nodes.leaf[leaves]
    # A matrix that turns nothing has numbers on its diagonal only.
    turns = (solids.rows[which, MATRIX : MATRIX + 3] != 0.0) != np.eye(3, dtype=bool)
    is_upright = (solids.kinds[which] == BOX) & ~turns.any(axis=(1, 2))
    rows[leaves[is_upright]] = solids.boxes[which[is_upright]].reshape(-1, 2, 3)
    for node in np.flatnonzero(nodes.kind == HALF_SPACE):
        *normal, height = geometry.half_spaces[nodes.leaf[node]]
        axis = int(np.abs(normal).argmax())
        if np.abs(normal).sum() == 1.0:
            rows[node] = [[-np.inf] * 3, [np.inf] * 3]
            rows[node, int(normal[axis] > 0.0), axis] = normal[axis] * height
    for some in levels_of(nodes):
        a, b, operation = rows[nodes.left[some]], rows[nodes.right[some]], nodes.kind[some]
        with np.errstate(invalid="ignore"):
            sizes = [np.maximum(each[:, 1] - each[:, 0], 0.0).prod(axis=1) for each in (a, b)]
        which = operation == UNION
        rows[some[which]] = np.where(~(sizes[0] >= sizes[1])[:, None, None], b, a)[which]
        which = operation == INTERSECTION
        both = np.stack([np.maximum(a[:, 0], b[:, 0]), np.minimum(a[:, 1], b[:, 1])], axis=1)
        rows[some[which]] = both[which]
    return rows


def without_pruned(
    nodes: Nodes, roots: np.ndarray, is_pruned: np.ndarray
) -> tuple[Nodes, np.ndarray]:
    """Return trees without the operands of which nothing is left, and what each begins with.

    Nodes keep their numbers: what held a pruned one is passed over.
    """
    stands_for = np.arange(len(nodes.kind))
    left, right = nodes.left.copy(), nodes.right.copy()
    stands_for[is_pruned] = NOTHING
    for some in levels_of(nodes):
        a, b, operation = stands_for[left[some]], stands_for[right[some]], nodes.kind[some]
        left[some], right[some] = a, b
        gone = is_pruned[some] | (a == NOTHING) & (operation != UNION)
        gone |= (b == NOTHING) & (operation == INTERSECTION)
        passed = np.where(a == NOTHING, b, a)
        is_passed = (a == NOTHING) | (b == NOTHING)
        stands_for[some] = np.where(gone, NOTHING, np.where(is_passed, passed, some))
    return nodes._replace(left=left, right=right), stands_for[roots].astype(np.int32)


__all__ = ["CUT", "NONE", "UPWARD", "Cutting", "CuttingSettings", "Pass", "cut", "cutting_of"]
