"""What lies within instances, as it stands in the world: boxes, and the trees of meshes.

A structure over instances has cells in world space; each instance has a box there, and within it
the nodes of its mesh's tree, which are boxes in the space of the mesh. All nodes of a mesh would
stand in as many places as the mesh does, so a mesh is seen in its first place only.
"""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from ..geometry.box_shape import corners_of, surface_area
from ..geometry.instances import Instanced, inverted, moved_points
from ..geometry.polygons import Polygons, merged, sides_of
from ..printing import show_integer
from ..progress import SILENT, Progress
from .cells import NEVER, OBJECT, Cells
from .events import HIT, POSTPONE, TEST
from .instances import Instances
from .outlines import by_shape
from .steps import Steps
from .structure import Structure

MOST_BOXES = 2_000
"""Boxes of instances that are drawn: the largest. More of them are a grey mass."""

MOST_NODES = 20_000
"""Nodes within instances that are drawn: those nearest to their roots."""

HERE = np.eye(3, 4)


class Space(NamedTuple):
    """The space that an instance leads into.

    Attributes
    ----------
    matrix : (3, 4) float64
        From it to the world.
    geometry : NamedTuple of arrays
        What is in it, in the order of its numbers.
    boxes : (n, 6) float64 or None
        Of the nodes by which a walk there knows them; None for that of the structure itself.
    """

    matrix: np.ndarray
    geometry: Any
    boxes: np.ndarray | None


def through(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Return the matrix, (3, 4), that does what one does and then what another does."""
    return np.column_stack([outer[:, :3] @ inner[:, :3], outer[:, :3] @ inner[:, 3] + outer[:, 3]])


# ------------------------------------------------------------------------------ where a ray was


def chains_of(steps: Steps, levels: int) -> np.ndarray:
    """Return within which instances each event of a walk was, (n, levels); -1 from its own on.

    The test of an instance is noted when the walk within it has come to its end.
    """
    chains = np.full((len(steps), levels), -1, dtype=np.int64)
    for level in range(levels):
        tests = np.flatnonzero((steps.level == level) & (steps.kind == TEST))
        inside = np.flatnonzero(steps.level > level)
        chains[inside, level] = steps.primitive[tests[np.searchsorted(tests, inside)]]
    return chains


def within_of(steps: Steps, events: np.ndarray, levels: int) -> np.ndarray:
    """Return the events, within instances, that hits of these became hits by.

    Parameters
    ----------
    events : (k,) int
        Of kind HIT or POSTPONE, in the structure itself.
    """
    for level in range(1, levels + 1):
        is_hit = (steps.kind == HIT) | (steps.kind == POSTPONE)
        hits = np.flatnonzero((steps.level == level) & is_hit)
        # The walk within has just ended, and what it hit last is what it hit nearest.
        events = hits[np.searchsorted(hits, events) - 1]
    return events


def instances_in(geometry: Any) -> Instances | None:
    """Return the instances that a geometry is, or refers to; None where there are none."""
    return geometry if isinstance(geometry, Instances) else getattr(geometry, "instances", None)


def space_of(structure: Structure, chain: np.ndarray) -> Space:
    """Return the space that instances within instances, (levels,), lead into; -1 for none."""
    matrix, geometry, boxes = HERE, structure.scene.geometry, None
    kernels: Any = None
    for number in chain[chain >= 0].tolist():
        kernels = instances_in(structure.geometry) if kernels is None else kernels.items
        matrix = through(matrix, geometry.matrices[number])
        geometry = geometry.meshes[geometry.which[number]]
        if hasattr(kernels.forest, "volumes"):
            boxes = kernels.forest.volumes.boxes()
        else:
            boxes = _boxes_by_number(_cells_of(structure, geometry))
    return Space(matrix, geometry, boxes)


@runtime_checkable
class Levelled(Protocol):
    """Knows the structures of meshes, where these are no binary trees in a forest."""

    def bottom_of(self, mesh: Any) -> Structure:
        """Return the structure of a mesh at the bottom."""


def _cells_of(structure: Structure, mesh: Any) -> Cells:
    """Return the cells of the structure of a mesh."""
    assert isinstance(structure, Levelled)
    return structure.bottom_of(mesh).cells()


def _boxes_by_number(cells: Cells) -> np.ndarray:
    """Return the boxes of cells, each at its number."""
    boxes = np.zeros((int(cells.numbers.max(initial=-1)) + 1, 6))
    boxes[cells.numbers] = cells.boxes
    return boxes


# --------------------------------------------------------------------------------- all there is


class _Rows(NamedTuple):
    """Cells to come: corners of boxes in world space, and what is known of them.

    Attributes
    ----------
    corners : (n, 8, 3) float64
    depth, items, parent, instance : (n,) int
        The parent is a number of a row of this kind, counted over all, or -1.
    is_leaf, is_dashed : (n,) bool
    level : (n,) int
    """

    corners: np.ndarray
    depth: np.ndarray
    items: np.ndarray
    parent: np.ndarray
    instance: np.ndarray
    is_leaf: np.ndarray
    is_dashed: np.ndarray
    level: np.ndarray


def cells_with_instances(structure: Structure, progress: Progress = SILENT) -> Cells:
    """Return the cells of a structure and, behind them, those within its instances.

    First come the structure's own, as :meth:`.Structure.cells` has them; then the boxes of the
    instances, dashed; then the nodes of the meshes' trees, each mesh once. Depths go on: boxes are
    one deeper than the deepest cell, the root of a mesh's tree is one deeper again. Of instances
    within instances the same follows. More columns are `level`, that of the structure a row is a
    part of, and `instance`, the number of that in whose place a row stands, or whose box it is, and
    -1 in the structure itself.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    cells = structure.cells(progress)
    instances = instances_in(structure.geometry)
    if instances is None or cells.space != OBJECT:
        return cells
    progress.report(0, 1, "Looking into instances")
    deepest = int(cells.depth.max(initial=0))
    rows, left_out = _rows_within(structure, instances, deepest + 1)
    return _appended(cells, rows, left_out)


def _rows_within(
    structure: Structure, kernels: Instances, depth: int
) -> tuple[_Rows, tuple[str, ...]]:
    """Return what lies within instances, level by level, and what is left out of it."""
    geometry = structure.scene.geometry
    parts: list[_Rows] = []
    boxes_there, nodes_there, count, nodes_room = 0, 0, 0, MOST_NODES
    boxes_room = MOST_BOXES
    # Of the space that instances are in: where it is, and in which instance of the structure.
    spaces: list[tuple[Any, np.ndarray | None, int]] = [(geometry, HERE, -1)]
    level = 0
    while spaces and isinstance(spaces[0][0], Instanced):
        below: list[tuple[Any, np.ndarray | None, int]] = []
        parents: list[int] = []
        seen: set[int] = set()
        boxes = [(np.zeros((0, 8, 3)), np.zeros(0, dtype=np.int64))]
        for each, place, owner in spaces:
            rows_of = np.full(len(each.ids), -1)
            if place is not None:
                chosen = _largest(each.boxes, boxes_room)
                boxes_room -= len(chosen)
                boxes_there += len(each.ids)
                rows_of[chosen] = count + np.arange(len(chosen))
                owners = chosen if owner < 0 else np.full(len(chosen), owner)
                boxes.append((moved_points(corners_of(each.boxes[chosen]), place), owners))
                count += len(chosen)
            _, is_singular = inverted(each.matrices)
            for number, mesh in enumerate(each.meshes):
                users = np.flatnonzero((each.which == number) & ~is_singular)
                if place is None or id(mesh) in seen or not len(users):
                    below.append((mesh, None, -1))
                    parents.append(-1)
                    continue
                seen.add(id(mesh))
                first = int(users[0])
                inside = first if owner < 0 else owner
                below.append((mesh, through(place, each.matrices[first]), inside))
                parents.append(int(rows_of[first]))
        parts.append(_boxes_of_instances(boxes, depth, level))
        level += 1
        taken = below, parents, depth + 1, level, count, nodes_room
        if hasattr(kernels.forest, "volumes") and not hasattr(kernels.forest, "width"):
            nodes, total = _nodes(kernels, *taken)
        else:
            nodes, total = _cells_of_meshes(structure, *taken)
        parts.append(nodes)
        nodes_there += total
        nodes_room -= len(nodes.depth)
        count += len(nodes.depth)
        depth = int(max(part.depth.max(initial=depth) for part in parts)) + 1
        spaces, kernels = below, kernels.items
    joined = _Rows(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    drawn = int(joined.is_dashed.sum())
    left_out = []
    if drawn < boxes_there:
        left_out.append(
            f"boxes of {show_integer(drawn)} of {show_integer(boxes_there)} instances, the largest"
        )
    if count - drawn < nodes_there:
        left_out.append(
            f"{show_integer(count - drawn)} of {show_integer(nodes_there)} nodes within instances, "
            "those nearest to their roots"
        )
    return joined, tuple(left_out)


def _largest(boxes: np.ndarray, most: int) -> np.ndarray:
    """Return the places of the largest boxes, ascending."""
    return np.sort(np.argsort(-surface_area(boxes), kind="stable")[: max(most, 0)])


def _boxes_of_instances(
    boxes: list[tuple[np.ndarray, np.ndarray]], depth: int, level: int
) -> _Rows:
    """Return the boxes of instances: corners, and in which instance of the structure they are."""
    corners = np.concatenate([corners for corners, _ in boxes])
    whole = np.ones(len(corners), dtype=np.int64)
    return _Rows(
        corners, depth * whole, 0 * whole, -whole, np.concatenate([who for _, who in boxes]),
        whole < 0, whole > 0, level * whole,
    )  # fmt: skip


def _nodes(
    kernels: Instances,
    meshes: list[tuple[Any, np.ndarray | None, int]],
    parents: list[int],
    depth: int,
    level: int,
    begin: int,
    most: int,
) -> tuple[_Rows, int]:
    """Return the nodes of meshes' trees nearest to their roots, and how many there are.

    Parameters
    ----------
    meshes : list of (geometry, matrix or None, instance)
        In the order of the roots; without a matrix they are not seen.
    parents : list of int
        Rows of the instances in whose places they are.
    depth, begin : int
        Depth of the roots, and row of the first.
    """
    forest = kernels.forest
    boxes, first, size = forest.volumes.boxes(), forest.first, forest.size
    ends = np.append(kernels.roots[1:], len(size))
    seen = [number for number, (_, place, _) in enumerate(meshes) if place is not None]
    total = int((ends - kernels.roots)[seen].sum())
    nodes, whose = kernels.roots[seen].astype(np.int64), np.array(seen, dtype=np.int64)
    above = np.array(parents, dtype=np.int64)[seen]
    found: list[tuple[np.ndarray, ...]] = []
    while len(nodes) and most > 0:
        nodes, whose, above = nodes[:most], whose[:most], above[:most]
        found.append((nodes, whose, above, np.full(len(nodes), depth)))
        rows = begin + np.arange(len(nodes))
        begin, most, depth = begin + len(nodes), most - len(nodes), depth + 1
        inner = size[nodes] == 0
        # Siblings are neighbours.
        nodes = np.repeat(first[nodes[inner]].astype(np.int64), 2)
        nodes[1::2] += 1
        whose, above = np.repeat(whose[inner], 2), np.repeat(rows[inner], 2)
    if not found:
        return _no_rows(), total
    nodes, whose, above, depths = (np.concatenate(each) for each in zip(*found, strict=True))
    matrices = np.zeros((len(meshes), 3, 4))
    for number in seen:
        matrices[number] = meshes[number][1]
    owners = np.array([owner for _, _, owner in meshes], dtype=np.int64)
    linear, shift = matrices[whose, :, :3], matrices[whose, None, :, 3]
    corners = np.einsum("nij,nkj->nki", linear, corners_of(boxes[nodes])) + shift
    is_leaf = size[nodes] > 0
    return _Rows(
        corners, depths, size[nodes].astype(np.int64), above, owners[whose], is_leaf,
        np.zeros(len(nodes), dtype=bool), np.full(len(nodes), level),
    ), total  # fmt: skip


def _cells_of_meshes(
    structure: Structure,
    meshes: list[tuple[Any, np.ndarray | None, int]],
    parents: list[int],
    depth: int,
    level: int,
    begin: int,
    most: int,
) -> tuple[_Rows, int]:
    """Return the same as :func:`_nodes` of structures that are no binary trees."""
    parts: list[_Rows] = []
    total = 0
    for (mesh, place, owner), above in zip(meshes, parents, strict=True):
        if place is None:
            continue
        cells = _cells_of(structure, mesh)
        total += len(cells)
        few = min(len(cells), max(most, 0))  # they are in the order of their depths
        row_of = np.full(int(cells.numbers.max(initial=-1)) + 2, above)
        row_of[cells.numbers[:few]] = begin + np.arange(few)
        whole = np.ones(few, dtype=np.int64)
        parts.append(
            _Rows(
                moved_points(corners_of(cells.boxes[:few]), place), depth + cells.depth[:few],
                cells.count[:few].astype(np.int64), row_of[cells.parents[:few]], owner * whole,
                cells.is_leaf[:few], whole < 0, level * whole,
            )
        )  # fmt: skip
        begin, most = begin + few, most - few
    if not parts:
        return _no_rows(), total
    return _Rows(*(np.concatenate(columns) for columns in zip(*parts, strict=True))), total


def _no_rows() -> _Rows:
    nothing = np.zeros(0, dtype=np.int64)
    is_none = nothing > 0
    return _Rows(np.zeros((0, 8, 3)), nothing, nothing, nothing, nothing, is_none, is_none, nothing)


def _appended(cells: Cells, rows: _Rows, left_out: tuple[str, ...]) -> Cells:
    """Return cells with rows behind them."""
    own, more = len(cells), len(rows.depth)
    low, high = rows.corners.min(axis=1), rows.corners.max(axis=1)
    boxes = np.concatenate([cells.boxes, np.concatenate([low, high], axis=1)])
    # Of a box, corners 1, 2 and 4 are those beside corner 0.
    x, y, z = (rows.corners[:, corner] - rows.corners[:, 0] for corner in (1, 2, 4))
    areas = 2.0 * sum(np.linalg.norm(np.cross(*pair), axis=1) for pair in ((x, y), (y, z), (z, x)))
    stands_straight = np.isclose(areas, surface_area(boxes[own:]), rtol=1e-9, atol=0.0)
    aslant = np.flatnonzero(~stands_straight)
    sides = sides_of(rows.corners[aslant])
    sides = sides._replace(owners=own + aslant[sides.owners])
    is_box = np.ones(own + more, dtype=bool)
    is_box[by_shape(cells, np.arange(own))[0]] = False
    is_box[own + aslant] = False
    begin = int(cells.numbers.max(initial=-1)) + 1
    parent = np.where(rows.parent < 0, -1, begin + rows.parent)
    own_areas = surface_area(cells.boxes) if cells.areas is None else cells.areas
    last = int(cells.extra["order"].max(initial=0)) if "order" in cells.extra else 0
    extra = {
        name: np.concatenate([values, _nothing_like(values, more, last if name == "order" else -1)])
        for name, values in cells.extra.items()
    }
    extra["level"] = np.concatenate([np.zeros(own, np.int32), rows.level.astype(np.int32)])
    extra["instance"] = np.concatenate([np.full(own, -1, np.int32), rows.instance.astype(np.int32)])
    return dataclasses.replace(
        cells, boxes=boxes,
        numbers=np.concatenate([cells.numbers, begin + np.arange(more)]).astype(np.int32),
        depth=np.concatenate([cells.depth, rows.depth]).astype(np.int32),
        is_leaf=np.concatenate([cells.is_leaf, rows.is_leaf]),
        count=np.concatenate([cells.count, rows.items]).astype(np.int32),
        extra=extra, faces=_joined(cells.faces, sides), areas=np.concatenate([own_areas, areas]),
        replaced=None if cells.replaced is None
        else np.concatenate([cells.replaced, np.full(more, NEVER)]),
        parent=np.concatenate([cells.parents, parent]).astype(np.int32),
        is_box=is_box, is_dashed=np.concatenate([np.zeros(own, dtype=bool), rows.is_dashed]),
        n_own=own, left_out=left_out,
    )  # fmt: skip


def _joined(faces: Polygons | None, sides: Polygons) -> Polygons | None:
    if faces is None:
        return sides if len(sides.owners) else None
    return merged(faces, sides)


def _nothing_like(values: np.ndarray, count: int, whole: int) -> np.ndarray:
    """Return what stands in a column where there is no such figure."""
    if values.dtype.kind == "f":
        return np.full(count, np.nan)
    return (
        np.zeros(count, bool) if values.dtype.kind == "b" else np.full(count, whole, values.dtype)
    )
