"""An instance is an item like a triangle: its test is a walk through its mesh's own hierarchy.

A ray that meets the instance's own box is moved into the space of the mesh, walks there, and what
it hits is the hit. The direction is not made a unit vector again, so t is the same in both spaces.
A hierarchy over instances is thus a two-level structure, such as DXR's: the top-level acceleration
structure (TLAS) over instances, a bottom-level one (BLAS) for each mesh. Both levels are walked by
the one walk, and so is a mesh that is made of instances itself.

All arithmetic inside an instance is that of the mesh's space. So every structure over the same
instances gives the same bits; over the same triangles in world space, t differs by rounding.

Between a walk and the walk within, every kernel is dispatched on the geometry: Numba would take a
plain one for recursion, and what it compiles of such would crash when it is loaded from its cache.

DXR: Microsoft, DirectX Raytracing (DXR) Functional Spec, 2018.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..geometry.box import boxes_overlap, span_box
from ..geometry.box_shape import hulls_of_boxes
from ..geometry.geometry import boxes_around, clip_box, hulls_of, in_order, intersect, overlaps
from ..geometry.rays import ray_along
from ..geometry.solids.mixed import Mixed
from ..geometry.triangle import NO_HIT
from ..geometry.triangles import Triangles
from ..kernels import dispatched, implements, inner, whole
from .events import (
    COUNTS,
    COUNTS_OF_INSTANCES,
    COUNTS_OF_LEVEL,
    ENTER,
    ENTERED_NOW,
    IN_VAIN,
    IN_VAIN_NOW,
    LEVEL_NOW,
    MASKED,
    MASKED_NOW,
    NONE,
    note,
)
from .walk import walk
from .workspace import part_below

NOWHERE = np.int32(-1)
"""Mesh of an instance whose matrix is singular: it has no inside that a ray could be moved into."""


class Instances(NamedTuple):
    """Instances as the kernels see them, in any order.

    Attributes
    ----------
    ids : (n,) int32
    reach : (3,) float64
    boxes : (n, 6) float32, or float64 where that does not hold such numbers
    to_object : (n, 3, 4) float64
        From the instance's space to the mesh's.
    mesh : (n,) int32
        NOWHERE for a singular matrix.
    masks : (n,) uint8
    first : (n,) int64
        Number of the first primitive of each.
    forest : NamedTuple of arrays
        The hierarchies of all meshes.
    roots : (m,) int32
        Of each mesh, in the forest.
    items : NamedTuple of arrays
        The geometries of all meshes, in the order of the references.
    reaches : (m, 3) float64
        Of each mesh.
    levels : int
        Instances within instances count; 1 if the meshes are none.
    """

    ids: np.ndarray
    reach: np.ndarray
    boxes: np.ndarray
    to_object: np.ndarray
    mesh: np.ndarray
    masks: np.ndarray
    first: np.ndarray
    forest: Any
    roots: np.ndarray
    items: Any
    reaches: np.ndarray
    levels: int


@dispatched
def rooted(forest, root):
    """Return the tree of a forest that has its root at a node."""
    raise TypeError(f"no trees in {type(forest).__name__}")


@dispatched
def of_mesh(items, reach):
    """Return the items of a forest as those of one mesh, which has this reach, (3,)."""
    raise TypeError(f"no meshes of {type(items).__name__}")


@implements(of_mesh, Triangles)
def triangles_of_mesh(items, reach):
    """Exchange the reach."""
    return Triangles(items.corners, items.ids, reach)


@implements(of_mesh, Mixed)
def solids_of_mesh(items, reach):
    """Exchange the reach."""
    return Mixed(
        items.kinds, items.rows, items.first, items.size, items.points, items.boxes, items.ids,
        reach,
    )  # fmt: skip


@implements(of_mesh, Instances)
def instances_of_mesh(items, reach):
    """Exchange the reach."""
    return Instances(
        items.ids, reach, items.boxes, items.to_object, items.mesh, items.masks, items.first,
        items.forest, items.roots, items.items, items.reaches, items.levels,
    )  # fmt: skip


@inner
def moved_ray(to_object, ray, reach):
    """Return a ray in the space that a matrix, (3, 4), leads to; its t stay what they are."""
    return moved_until(to_object, ray, reach, ray.t_max)


@inner
def moved_until(to_object, ray, reach, end):
    """Return the same up to an end."""
    m = to_object
    ox = m[0, 0] * ray.ox + m[0, 1] * ray.oy + m[0, 2] * ray.oz + m[0, 3]
    oy = m[1, 0] * ray.ox + m[1, 1] * ray.oy + m[1, 2] * ray.oz + m[1, 3]
    oz = m[2, 0] * ray.ox + m[2, 1] * ray.oy + m[2, 2] * ray.oz + m[2, 3]
    # Not -0.0, whose inverse would be -inf.
    dx = m[0, 0] * ray.dx + m[0, 1] * ray.dy + m[0, 2] * ray.dz + 0.0
    dy = m[1, 0] * ray.dx + m[1, 1] * ray.dy + m[1, 2] * ray.dz + 0.0
    dz = m[2, 0] * ray.dx + m[2, 1] * ray.dy + m[2, 2] * ray.dz + 0.0
    return ray_along(
        ox, oy, oz, dx, dy, dz, 1.0 / dx, 1.0 / dy, 1.0 / dz, reach, ray.t_min, end,
        ray.query, ray.time, ray.mask, ray.source, ray.target,
    )  # fmt: skip


@implements(intersect, Instances)
def intersect_instance(geometry, index, ray, limit, number, workspace, log):
    """Test the instance's box, move the ray into its mesh's space, and walk there.

    Of what is hit within, t is moved into the interval of the instance's own box, as that of a
    triangle is into its: so no structure around loses it to rounding.
    """
    mesh = whole(geometry.mesh[index])
    root = whole(geometry.roots[mesh]) if mesh >= 0 else NOWHERE
    return enter_instance(geometry, index, root, ray, limit, workspace, log)


@dispatched
def enter_instance(geometry, index, root, ray, limit, workspace, log):
    """Test an instance's mask and box, move the ray into its mesh's space, and walk from a root.

    What lies beyond `limit` is not looked for, if the ray is still in the instance's box there: for
    t of what is found before is moved at most to the border of that box.
    """
    raise TypeError(f"no instances in {type(geometry).__name__}")


@implements(enter_instance, Instances)
def walk_within(geometry, index, root, ray, limit, workspace, log):
    """Walk within the mesh, and count."""
    first, mesh = geometry.first[index], whole(geometry.mesh[index])
    if mesh < 0:
        return NO_HIT, first
    level = log.written[LEVEL_NOW]
    column = COUNTS + COUNTS_OF_INSTANCES * level
    if (geometry.masks[index] & ray.mask) == 0:
        log.written[column + MASKED_NOW] += 1
        note(log, MASKED, NONE, geometry.ids[index], ray.t_min, ray.t_max)
        return NO_HIT, first
    enter, leave = span_box(geometry.boxes, index, ray, np.inf)
    if enter > leave or enter > limit:
        return NO_HIT, first
    log.written[column + ENTERED_NOW] += 1
    note(log, ENTER, NONE, geometry.ids[index], enter, leave)
    reach = geometry.reaches[mesh]
    end = limit if limit < leave else ray.t_max
    within = moved_until(geometry.to_object[index], ray, reach, end)
    tree = rooted(geometry.forest, root)
    items = of_mesh(geometry.items, reach)
    workspace.mailbox[-1] += 1
    number = workspace.mailbox[-1]
    log.written[LEVEL_NOW] += 1
    found = walk(tree, items, within, number, part_below(workspace, geometry.levels), log)
    log.written[LEVEL_NOW] -= 1
    counts = COUNTS + COUNTS_OF_INSTANCES * (level + geometry.levels) + COUNTS_OF_LEVEL * level
    for count in range(len(found.counts)):
        log.written[counts + count] += found.counts[count]
    t = found.t
    if t == NO_HIT:
        log.written[column + IN_VAIN_NOW] += 1
        note(log, IN_VAIN, NONE, geometry.ids[index], enter, leave)
        return NO_HIT, first
    t = enter if enter > t else t
    t = leave if leave < t else t
    return t, first + found.primitive


@implements(overlaps, Instances)
def overlaps_instance(geometry, index, box):
    """Compare boxes."""
    return boxes_overlap(geometry.boxes[index], box)


@implements(clip_box, Instances)
def clip_instance(geometry, index, cell, box, polygon):
    """Leave the box as it is: nothing more is known of what is in it."""


@boxes_around.register
def _(geometry: Instances) -> np.ndarray:
    return geometry.boxes.astype(np.float64)


@hulls_of.register
def _(geometry: Instances) -> tuple[np.ndarray, np.ndarray]:
    return hulls_of_boxes(geometry.boxes.astype(np.float64))


@in_order.register
def _(geometry: Instances, order: np.ndarray) -> Instances:
    return geometry._replace(
        ids=geometry.ids[order].astype(np.int32), boxes=geometry.boxes[order],
        to_object=geometry.to_object[order], mesh=geometry.mesh[order],
        masks=geometry.masks[order], first=geometry.first[order],
    )  # fmt: skip
