"""From descriptions of trees to the arrays of :class:`.trees.Csg`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ..solids.description import Box, Cone, Disc, Item, MovingTriangle, Placed, Polygon, Triangle
from ..solids.making import in_turn, mixed_of
from ..solids.mixed import Mixed
from ..solids.reading import LARGEST
from ..triangles import reach_of
from .closed import refuse_if_open, turned_outward
from .cutting import bounded, cutting_of
from .description import OPERATIONS, ClosedMesh, Difference, HalfSpace, Intersection, Node, is_tree
from .description import Union as UnionOf
from .settings import CuttingSettings
from .trees import (
    DIFFERENCE,
    HALF_SPACE,
    INTERSECTION,
    MESH,
    NOTHING,
    SOLID,
    UNION,
    Csg,
    Nodes,
    nodes_below,
)

KINDS = {UnionOf: UNION, Intersection: INTERSECTION, Difference: DIFFERENCE}

MOST_NODES = 100_000
"""Of all trees: each is looked at in Python when they are cut."""

Described = Node | Mixed


def csg_of(described: Sequence[Described], settings: CuttingSettings | None = None) -> Csg:
    """Return trees, and plain items beside them, as a geometry.

    Parameters
    ----------
    described : sequence
        An item each; but all items of a Mixed are items here, in their order.
    settings : CuttingSettings, optional
        How the trees are bounded.

    Raises
    ------
    InputError
        If a leaf of a tree has no inside, a mesh is open, an operation has no operands, a tree is
        not bounded by anything, or there are too many nodes.
    """
    work = _Making()
    for number, each in enumerate(described):
        if isinstance(each, Mixed):
            work.add_plain(each)
        else:
            work.add(each, number)
    geometry = work.finished()
    return bounded_by_boxes(geometry, settings or CuttingSettings())


def bounded_by_boxes(geometry: Csg, settings: CuttingSettings) -> Csg:
    """Return trees with the boxes of items, and bounds as the settings say.

    The boxes are the same whatever the settings: structures are then, too, and so is every hit.
    """
    boxes = CuttingSettings(csg_volume="aabb")
    cutting = cutting_of(geometry, boxes)
    rows = cutting.final.rows[geometry.roots].copy()
    for item in np.flatnonzero(cutting.starts == NOTHING).tolist():
        rows[item] = _whole_box(geometry, cutting.own, item)
    endless = np.flatnonzero(~(np.abs(rows) < LARGEST).all(axis=(1, 2)))
    if len(endless):
        raise InputError(
            f"item {endless[0]} has no end; intersect its half-spaces with something that has one"
        )
    low, high = rows[:, 0], rows[:, 1]
    margin = np.where(geometry.is_tree, cutting.margin, 0.0)[:, None]
    items = np.hstack([np.minimum(low, high) - margin, np.maximum(low, high) + margin])
    geometry = geometry._replace(
        boxes=items, reach=reach_of(items[:, :3].min(axis=0), items[:, 3:].max(axis=0))
    )
    if settings != boxes:
        cutting = cutting_of(geometry, settings)
    return bounded(geometry, cutting, settings)


def _whole_box(geometry: Csg, own: np.ndarray, item: int) -> np.ndarray:
    """Return what is around the leaves of a tree of which nothing is left, (2, 3).

    It has to be somewhere, and is never hit.
    """
    nodes = nodes_below(geometry.nodes, int(geometry.roots[item]))
    leaves = own[nodes[geometry.nodes.kind[nodes] < UNION]]
    leaves = leaves[np.isfinite(leaves).all(axis=(1, 2))]
    if not len(leaves):
        return np.zeros((2, 3))
    return np.stack([leaves[:, 0].min(axis=0), leaves[:, 1].max(axis=0)])


class _Waiting(NamedTuple):
    """A node to be made, and where its number is to be written."""

    node: Node
    column: str
    parent: int


class _Making:
    """Trees in the making."""

    def __init__(self) -> None:
        self._kinds: list[int] = []
        self._links: dict[str, list[int]] = {"left": [], "right": []}
        self._leaves: list[int] = []
        self._first: list[int] = []
        self._roots: list[int] = []
        self._is_tree: list[bool] = []
        self._n_primitives = 0
        self._n_solids = 0
        self._items: list[Item] = []
        self._item_places: list[int] = []
        self._plain: list[Mixed] = []
        self._plain_places: list[np.ndarray] = []
        self._half_spaces: list[np.ndarray] = []
        self._meshes: list[np.ndarray] = []

    def add(self, described: Node, number: int) -> None:
        """Add a tree or a plain item, with all its nodes."""
        self._roots.append(len(self._kinds))
        self._is_tree.append(is_tree(described))
        waiting = [_Waiting(described, "", NOTHING)]
        while waiting:
            node, column, parent = waiting.pop()
            place = len(self._kinds)
            if place >= MOST_NODES:
                raise InputError(f"there are more than {MOST_NODES} nodes of CSG trees; use fewer")
            if column:
                self._links[column][parent] = place
            while isinstance(node, OPERATIONS) and len(node.operands) == 1:
                node = node.operands[0]
            if isinstance(node, OPERATIONS):
                left, right = _halves(node, number)
                waiting += [_Waiting(right, "right", place), _Waiting(left, "left", place)]
                self._node(KINDS[type(node)], NOTHING, 0)
            else:
                self._leaf(node, number)

    def add_plain(self, items: Mixed) -> None:
        """Add items that are made already."""
        count = len(items.ids)
        begin = len(self._kinds)
        self._plain.append(items)
        self._plain_places.append(self._n_solids + np.arange(count))
        self._kinds += [SOLID] * count
        self._links["left"] += [NOTHING] * count
        self._links["right"] += [NOTHING] * count
        self._leaves += range(self._n_solids, self._n_solids + count)
        self._first += range(self._n_primitives, self._n_primitives + count)
        self._roots += range(begin, begin + count)
        self._is_tree += [False] * count
        self._n_solids += count
        self._n_primitives += count

    def _node(self, kind: int, leaf: int, n_primitives: int) -> None:
        self._kinds.append(kind)
        self._leaves.append(leaf)
        self._links["left"].append(NOTHING)
        self._links["right"].append(NOTHING)
        self._first.append(self._n_primitives)
        self._n_primitives += n_primitives

    def _leaf(self, node: Any, number: int) -> None:
        if isinstance(node, HalfSpace):
            self._node(HALF_SPACE, len(self._half_spaces), 1)
            self._half_spaces.append(_plane_of(node, number))
        elif isinstance(node, ClosedMesh):
            corners = np.asarray(node.vertices, np.float64)[np.asarray(node.triangles)]
            if not (np.abs(corners) < LARGEST).all():
                raise InputError(f"item {number}: a closed mesh must be finite; repair or scale it")
            refuse_if_open(corners, f"item {number}: a mesh")
            self._node(MESH, len(self._meshes), len(corners))
            self._meshes.append(turned_outward(corners))
        else:
            if self._is_tree[-1]:
                _refuse_surface(node, number)
            self._node(SOLID, self._n_solids, 1)
            self._items.append(node)
            self._item_places.append(self._n_solids)
            self._n_solids += 1

    def finished(self) -> Csg:
        """Return the trees without their bounds."""
        parts = list(self._plain)
        places = list(self._plain_places)
        if self._items:
            parts.append(mixed_of(self._items))
            places.append(np.array(self._item_places))
        if not self._roots:
            raise InputError("there are no items; ask for at least one")
        solids = in_turn(parts, np.argsort(np.concatenate(places))) if parts else _no_solids()
        nodes = Nodes(
            np.array(self._kinds, np.uint8), np.array(self._links["left"], np.int32),
            np.array(self._links["right"], np.int32), np.array(self._leaves, np.int32),
            np.array(self._first, np.int32),
        )  # fmt: skip
        roots = np.array(self._roots, np.int32)
        counts = [0, *(len(mesh) for mesh in self._meshes)]
        return Csg(
            np.arange(len(roots), dtype=np.int32), np.zeros(3), np.zeros((len(roots), 6)), roots,
            nodes, np.array(self._is_tree), solids, np.array(self._half_spaces).reshape(-1, 4),
            np.concatenate([np.empty((0, 3, 3)), *self._meshes]),
            np.cumsum(counts, dtype=np.int64), nodes, roots, None, np.zeros(len(nodes.kind), bool),
            CuttingSettings(),
        )  # fmt: skip


def _no_solids() -> Mixed:
    """Return a geometry of none: all leaves are half-spaces or meshes."""
    one = mixed_of([Box((0, 0, 0), (1, 1, 1))])
    none = np.empty(0, np.int64)
    return in_turn([one], none)


def _halves(node: UnionOf | Intersection | Difference, number: int) -> tuple[Node, Node]:
    """Return two operands: half of them each; of a difference, the first and all others."""
    operands = list(node.operands)
    if not operands:
        raise InputError(f"item {number}: a {type(node).__name__} has no operands; give it some")
    if isinstance(node, Difference):
        return operands[0], UnionOf(operands[1:])
    middle = (len(operands) + 1) // 2
    return type(node)(operands[:middle]), type(node)(operands[middle:])


def _plane_of(half_space: HalfSpace, number: int) -> np.ndarray:
    """Return a half-space as [nx, ny, nz, h]."""
    try:
        point = np.array(half_space.point, np.float64).reshape(3)
        normal = np.array(half_space.normal, np.float64).reshape(3)
    except (TypeError, ValueError):
        raise InputError(f"item {number}: a half-space is a point and a normal") from None
    size = np.abs(normal).max()
    if not (np.abs([point, normal]) < LARGEST).all() or size == 0.0:
        raise InputError(f"item {number}: a half-space needs finite numbers and a normal")
    normal = normal / size
    normal = normal / np.sqrt((normal * normal).sum())
    return np.append(normal, (normal * point).sum())


def _refuse_surface(node: Any, number: int) -> None:
    """Raise InputError for a leaf that has no inside."""
    solid = node.solid if isinstance(node, Placed) else node
    is_open = isinstance(solid, Cone) and not solid.is_capped
    if is_open or isinstance(solid, (Disc, Polygon, Triangle, MovingTriangle)):
        what = "cone without its ends" if is_open else type(solid).__name__.lower()
        raise InputError(
            f"item {number}: a {what} has no inside, and cannot be an operand; close it"
        )
