"""The hierarchies of the meshes of instances (BLAS), one after the other in one forest.

So are those of the closed meshes in trees of solids.

A kernel is compiled for types, and a tuple of hierarchies would be a type for each length. So the
trees of all meshes lie in one set of arrays, each with its root, and so do their items.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ...contract.csg import CsgTrees, trees_of
from ...contract.instances import NOWHERE, Instances
from ...geometry.box import Boxes
from ...geometry.csg.trees import Csg
from ...geometry.csg.volumes import margin_of
from ...geometry.geometry import in_order, joined
from ...geometry.instances import Instanced, as_single, inverted, levels_of_mesh
from ...geometry.triangles import Triangles
from ...progress import SILENT, Progress
from .grouping import group
from .topology.tree import Tree
from .walks.binary_walk import Binary

Forest = tuple[Any, np.ndarray, Any]
"""The structures of meshes in one record, where each begins, (m,) int32, and all their items."""

Bottom = Callable[[Sequence[Any], Progress], Forest]


def instances_of(
    geometry: Instanced,
    settings: Any,
    progress: Progress = SILENT,
    bottom: Bottom | None = None,
) -> Instances:
    """Return instances as kernels see them, with a hierarchy for each mesh.

    Parameters
    ----------
    settings : BVHSettings
        How what meshes are made of is grouped. Their trees are binary, their volumes boxes.
    bottom : callable, optional
        Makes a forest of the meshes at the bottom, which are made of no instances, in another way.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    forest, roots, items = forest_of(geometry.meshes, settings, progress, bottom)
    to_object, is_singular = inverted(geometry.matrices)
    return Instances(
        geometry.ids, geometry.reach, as_single(geometry.boxes), to_object,
        np.where(is_singular, NOWHERE, geometry.which).astype(np.int32), geometry.masks,
        geometry.first[:-1].copy(), forest, roots, items,
        np.array([mesh.reach for mesh in geometry.meshes]), levels_of_mesh(geometry),
    )  # fmt: skip


def forest_of(
    meshes: Sequence[Any], settings: Any, progress: Progress, bottom: Bottom | None = None
) -> Forest:
    """Return the trees of meshes in one, the root of each, (m,) int32, and all their items."""
    if bottom is not None and not isinstance(meshes[0], Instanced):
        return bottom(meshes, progress)
    settings = dataclasses.replace(settings, volume="aabb", arity="2")
    trees, orders = [], []
    for mesh in meshes:
        grouping, _ = group(mesh, settings, progress, False)
        trees.append(grouping.tree)
        orders.append(grouping.order)
    items = joined_items(meshes, orders, settings, progress, bottom)
    return (*joined_trees(trees, [len(order) for order in orders]), items)


def joined_trees(trees: Sequence[Tree], counts: Sequence[int]) -> tuple[Binary, np.ndarray]:
    """Return trees one after the other, over references that are, too, and their roots."""
    roots = np.cumsum([0] + [len(tree.size) for tree in trees])
    references = np.cumsum([0, *counts])
    first = [
        tree.first + np.where(tree.size == 0, root, reference)
        for tree, root, reference in zip(trees, roots, references, strict=False)
    ]
    return (
        Binary(
            Boxes(np.concatenate([tree.boxes for tree in trees])),
            np.concatenate(first).astype(np.int32),
            np.concatenate([tree.size for tree in trees]),
        ),
        roots[:-1].astype(np.int32),
    )


def joined_items(
    meshes: Sequence[Any],
    orders: Sequence[np.ndarray],
    settings: Any,
    progress: Progress,
    bottom: Bottom | None = None,
) -> Any:
    """Return the items of meshes, each in its order, one mesh after the other."""
    if isinstance(meshes[0], Instanced):
        return joined_instances(meshes, orders, settings, progress, bottom)
    parts = [in_order(mesh, order) for mesh, order in zip(meshes, orders, strict=True)]
    return joined(parts[0], parts[1:])


def joined_instances(
    meshes: Sequence[Instanced],
    orders: Sequence[np.ndarray],
    settings: Any,
    progress: Progress,
    bottom: Bottom | None,
) -> Instances:
    """Return the instances that meshes are made of, over one forest of what these are made of."""
    all_below = [below for mesh in meshes for below in mesh.meshes]
    shift = np.cumsum([0] + [len(mesh.meshes) for mesh in meshes])
    whole = Instanced(
        tuple(all_below),
        np.concatenate([mesh.which + n for mesh, n in zip(meshes, shift, strict=False)]),
        np.concatenate([mesh.matrices for mesh in meshes]),
        np.concatenate([mesh.masks for mesh in meshes]),
        np.concatenate([mesh.boxes for mesh in meshes]),
        np.concatenate([*(mesh.first[:-1] for mesh in meshes), [0]]),
        np.concatenate([mesh.ids for mesh in meshes]), meshes[0].reach,
        *(
            np.concatenate([getattr(mesh, name) for mesh in meshes])
            for name in ("instance_ids", "hit_groups", "flags")
        ),
    )  # fmt: skip
    starts = np.cumsum([0] + [len(mesh.ids) for mesh in meshes])
    order = np.concatenate([order + start for order, start in zip(orders, starts, strict=False)])
    return in_order(instances_of(whole, settings, progress, bottom), order)


def csg_of_forest(geometry: Csg, settings: Any, progress: Progress = SILENT) -> CsgTrees:
    """Return trees of solids as kernels see them, with a hierarchy for each closed mesh.

    Parameters
    ----------
    settings : BVHSettings
        How the triangles of meshes are grouped.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    first = geometry.mesh_first
    if len(first) == 1:
        none = Binary(Boxes(np.empty((0, 6))), np.empty(0, np.int32), np.empty(0, np.int32))
        return trees_of(
            geometry, none, np.empty(0, np.int32), geometry.corners, np.empty(0, np.int32)
        )
    meshes = [
        Triangles(
            geometry.corners[begin:end], np.arange(end - begin, dtype=np.int32), geometry.reach
        )
        for begin, end in zip(first[:-1].tolist(), first[1:].tolist(), strict=True)
    ]
    forest, roots, items = forest_of(meshes, settings, progress)
    # What a line crosses is told from its edges alone: no box may be missed by rounding.
    margin = margin_of(geometry)
    forest.volumes.rows[:, :3] -= margin
    forest.volumes.rows[:, 3:] += margin
    return trees_of(geometry, forest, roots, items.corners, items.ids)
