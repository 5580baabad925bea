"""The structures of meshes (BLAS), one after the other in one record of arrays.

A kernel is compiled for types, and a tuple of structures would be a type for each length. So all
of them lie in one forest: their arrays one after the other, and where each begins. A walk is given
one of them by :func:`...contract.instances.rooted`: a hierarchy is known by the number of its root,
cells by the part of every array that is theirs.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...contract.instances import rooted
from ...contract.structure import Structure
from ...errors import InputError
from ...geometry.geometry import joined
from ...kernels import implements
from ..bvh.walks.binary_walk import Binary
from ..bvh.walks.wide_walk import Wide
from ..grid.cells import GridArrays
from ..kdtree.storage import KdTreeArrays
from ..octree.storage import PointerOctree
from ..subdivision.walks import WALKS, Heap, March, Neighbours, Recursive, Segments


class Grids(NamedTuple):
    """Uniform grids; those arrays of :class:`GridArrays` that are as long for all are (m, ...).

    Attributes
    ----------
    offsets : (n,) int64
        Of all grids, into `references`.
    begins : (m + 1,) int64
        Where the offsets of each begin.
    """

    box: np.ndarray
    walls: np.ndarray
    cell_size: np.ndarray
    tolerance: np.ndarray
    resolution: np.ndarray
    offsets: np.ndarray
    begins: np.ndarray
    references: np.ndarray
    mailbox: bool


class KdTrees(NamedTuple):
    """kd-trees, see :class:`KdTreeArrays`; `box` is (m, 6), `nodes` and `begins` are (m + 1,)."""

    box: np.ndarray
    split: np.ndarray
    link: np.ndarray
    nodes: np.ndarray
    offsets: np.ndarray
    begins: np.ndarray
    references: np.ndarray


class Octrees(NamedTuple):
    """Octrees with pointers, see :class:`PointerOctree`; `nodes` are where inner nodes begin."""

    box: np.ndarray
    planes: np.ndarray
    children: np.ndarray
    nodes: np.ndarray
    offsets: np.ndarray
    begins: np.ndarray
    references: np.ndarray


@implements(rooted, Grids)
def grid_of(forest, root):
    """Take the part of one grid."""
    return GridArrays(
        forest.box[root], forest.walls[root], forest.cell_size[root], forest.tolerance[root],
        forest.resolution[root], forest.offsets[forest.begins[root] : forest.begins[root + 1]],
        forest.references, forest.mailbox,
    )  # fmt: skip


@implements(rooted, KdTrees)
def kdtree_of(forest, root):
    """Take the part of one tree."""
    first, end = forest.nodes[root], forest.nodes[root + 1]
    return KdTreeArrays(
        forest.box[root], forest.split[first:end], forest.link[first:end],
        forest.offsets[forest.begins[root] : forest.begins[root + 1]], forest.references,
    )  # fmt: skip


@implements(rooted, Octrees)
def octree_of(forest, root):
    """Take the part of one tree."""
    first, end = forest.nodes[root], forest.nodes[root + 1]
    return PointerOctree(
        forest.box[root], forest.planes[first:end],
        forest.offsets[forest.begins[root] : forest.begins[root + 1]], forest.references,
        forest.children[first:end],
    )  # fmt: skip


@implements(rooted, Recursive)
def recursive_of(forest, root):
    """Take one tree, walked in the same way."""
    return Recursive(rooted(forest.tree, root), forest.mailbox)


@implements(rooted, March)
def march_of(forest, root):
    """Take one tree, walked in the same way."""
    return March(rooted(forest.tree, root), forest.mailbox)


@implements(rooted, Segments)
def segments_of(forest, root):
    """Take one tree, walked in the same way."""
    return Segments(rooted(forest.tree, root), forest.mailbox)


@implements(rooted, Heap)
def heap_of(forest, root):
    """Take one tree, walked in the same way."""
    return Heap(rooted(forest.tree, root), forest.mailbox)


@implements(rooted, Neighbours)
def neighbours_of(forest, root):
    """Take one tree, walked in the same way."""
    return Neighbours(rooted(forest.tree, root), forest.mailbox)


# ------------------------------------------------------------------------------------- joining


def forest_of_structures(structures: Sequence[Structure]) -> tuple[Any, np.ndarray, Any]:
    """Return the arrays of structures in one, where each begins, (m,) int32, and all their items.

    Parameters
    ----------
    structures : sequence
        Of one kind and with the same settings, one for each mesh.

    Raises
    ------
    InputError
        If their arrays are of a kind that does not stand in a forest.
    """
    geometries = [each.geometry for each in structures]
    items = joined(geometries[0], geometries[1:])
    starts = np.cumsum([0] + [len(geometry.ids) for geometry in geometries])
    forest, roots = _joined(structures[0].arrays, [each.arrays for each in structures], starts)
    return forest, roots.astype(np.int32), items


@functools.singledispatch
def _joined(first: Any, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    """Return records of one type in one, and where each begins.

    Parameters
    ----------
    starts : (m + 1,) int64
        Number of the first item of each among all.
    """
    raise InputError(
        "such cells cannot be those of meshes; choose lazy=false, links=found and storage=pointer "
        "among blas_settings"
    )


@_joined.register(Binary)
@_joined.register(Wide)
def _(first: Any, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    roots = np.cumsum([0] + [len(part.size) for part in parts])
    links = [
        (part.first + np.where(part.size == 0, root, start)).astype(np.int32)
        for part, root, start in zip(parts, roots, starts, strict=False)
    ]
    columns = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("size", "width")
        if hasattr(first, name)
    }
    volumes = _joined_volumes([part.volumes for part in parts])
    forest = first._replace(volumes=volumes, first=np.concatenate(links), **columns)
    return forest, roots[:-1]


def _joined_volumes(parts: Sequence[Any]) -> Any:
    """Return volumes one after the other; the directions of k-DOPs are the same for all."""
    first = parts[0]
    columns = {}
    for name in first._fields:
        values = [getattr(part, name) for part in parts]
        if isinstance(values[0], tuple):
            columns[name] = _joined_volumes(values)
        else:
            columns[name] = values[0] if name == "directions" else np.concatenate(values)
    return type(first)(**columns)


@_joined.register(GridArrays)
def _(first: GridArrays, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    longest = max(part.walls.shape[1] for part in parts)
    walls = np.full((len(parts), 3, longest), np.inf)
    for row, part in zip(walls, parts, strict=True):
        row[:, : part.walls.shape[1]] = part.walls
    same = {
        name: np.stack([getattr(part, name) for part in parts])
        for name in ("box", "cell_size", "tolerance", "resolution")
    }
    forest = Grids(walls=walls, mailbox=first.mailbox, **same, **_lists(parts, starts))
    return forest, np.arange(len(parts))


@_joined.register(KdTreeArrays)
def _(first: KdTreeArrays, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    forest = KdTrees(
        np.stack([part.box for part in parts]), np.concatenate([part.split for part in parts]),
        np.concatenate([part.link for part in parts]), _begins([part.link for part in parts]),
        **_lists(parts, starts),
    )  # fmt: skip
    return forest, np.arange(len(parts))


@_joined.register(PointerOctree)
def _(first: PointerOctree, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    forest = Octrees(
        np.stack([part.box for part in parts]), np.concatenate([part.planes for part in parts]),
        np.concatenate([part.children for part in parts]),
        _begins([part.children for part in parts]), **_lists(parts, starts),
    )  # fmt: skip
    return forest, np.arange(len(parts))


def _joined_of_walk(first: Any, parts: Sequence[Any], starts: np.ndarray) -> tuple[Any, np.ndarray]:
    trees, roots = _joined(first.tree, [part.tree for part in parts], starts)
    return first._replace(tree=trees), roots


for _walk in WALKS.values():
    _joined.register(_walk)(_joined_of_walk)


def _begins(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return where each of some arrays begins, and the last ends, (m + 1,) int64."""
    return np.cumsum([0] + [len(array) for array in arrays])


def _lists(parts: Sequence[Any], starts: np.ndarray) -> dict[str, np.ndarray]:
    """Return the lists of cells in one: offsets into all references, which are of all items."""
    listed = _begins([part.references for part in parts])
    offsets = [part.offsets + begin for part, begin in zip(parts, listed, strict=False)]
    references = [part.references + start for part, start in zip(parts, starts, strict=False)]
    return {
        "offsets": np.concatenate(offsets),
        "begins": _begins(offsets),
        "references": np.concatenate(references).astype(np.int32),
    }
