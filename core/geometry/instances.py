"""Instances: one mesh in many places, each through a matrix of its own.

Here is what a scene knows of them: meshes, matrices, boxes. How a ray meets one is told in
:mod:`..contract.instances`, for that takes a walk.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from ..errors import InputError
from .box_shape import box_segments, corners_of, hulls_of_boxes
from .csg.trees import Csg, lines_of_trees
from .geometry import EVERY_OBJECT, boxes_around, hulls_of, lines_of, moved_by, normals_at
from .instance_settings import MASK_BITS, NUMBER_BITS
from .triangles import Triangles, reach_of

PADDING = float(np.finfo(np.float32).eps)
"""By how much of the largest coordinate that made it a world box is enlarged. Nine roundings make a
corner, and a ray is rounded on its way into a mesh by the more, the farther it comes from: up to
some million sizes away, what it hits lies in the box all the same."""

SMALLEST_SINGLE, LARGEST_SINGLE = 1e-25, 1e30
"""Sizes in between can be told in float32 as exactly as any."""

MOST_LEVELS = 3
"""How deep instances may lie within each other."""


class Instanced(NamedTuple):
    """Meshes and where they are: what a scene holds.

    Attributes
    ----------
    meshes : tuple
        Geometries, each in a space of its own: all Triangles, all Mixed, or all Instanced.
    which : (n,) int32
        The mesh of each instance.
    matrices : (n, 3, 4) float64
        From the mesh's space to that of the instance.
    masks : (n,) uint8
        A ray meets the instance if its own mask has a bit in common.
    boxes : (n, 6) float64
    first : (n + 1,) int64
        Number of the first primitive of each instance, if all of them are counted.
    ids, reach
        As of every geometry.
    instance_ids, hit_groups : (n,) int32
    flags : (n,) uint8
        Of the instances' descriptors, see :mod:`.instance_settings`.
    """

    meshes: tuple[Any, ...]
    which: np.ndarray
    matrices: np.ndarray
    masks: np.ndarray
    boxes: np.ndarray
    first: np.ndarray
    ids: np.ndarray
    reach: np.ndarray
    instance_ids: np.ndarray
    hit_groups: np.ndarray
    flags: np.ndarray


def instanced(
    meshes: Sequence[Any],
    which: np.ndarray,
    matrices: np.ndarray,
    masks: np.ndarray | int = EVERY_OBJECT,
    *,
    instance_ids: np.ndarray | int = 0,
    hit_groups: np.ndarray | int = 0,
    flags: np.ndarray | int = 0,
) -> Instanced:
    """Put meshes into places.

    Parameters
    ----------
    meshes : sequence of geometries
        All of one kind.
    which : (n,) int
    matrices : (n, 3, 4) float
    masks, instance_ids, hit_groups, flags : (n,) int, optional
        Of the instances' descriptors, see :mod:`.instance_settings`.

    Raises
    ------
    InputError
        If there is no instance, a number is not finite, there is no such mesh, a number of a
        descriptor has too many bits, or the meshes are not of one kind.
    """
    which = np.ascontiguousarray(which, dtype=np.int32)
    matrices = np.require(matrices, np.float64, ["C", "W"]).reshape(-1, 3, 4)
    if not len(which) or not len(meshes):
        raise InputError("there are no instances; add one")
    if len(which) != len(matrices):
        raise InputError(f"there are {len(which)} instances and {len(matrices)} matrices")
    wrong = np.flatnonzero((which < 0) | (which >= len(meshes)))
    if len(wrong):
        raise InputError(
            f"instance {wrong[0]} is of mesh {which[wrong[0]]}; meshes are 0 to {len(meshes) - 1}"
        )
    columns = [
        _column(values, name, bits, len(which))
        for values, name, bits in (
            (masks, "mask", MASK_BITS), (instance_ids, "instance id", NUMBER_BITS),
            (hit_groups, "hit group", NUMBER_BITS), (flags, "flags", MASK_BITS),
        )
    ]  # fmt: skip
    if not np.isfinite(matrices).all():
        bad = int((~np.isfinite(matrices).all(axis=(1, 2))).argmax())
        raise InputError(f"the matrix of instance {bad} is not finite; repair it")
    if len({type(mesh) for mesh in meshes}) != 1:
        raise InputError("the meshes of instances must be of one kind; make all of them solids")
    if isinstance(meshes[0], Csg):
        raise InputError("trees of solids cannot be meshes of instances; flatten them")
    if levels_of_mesh(meshes[0]) >= MOST_LEVELS:
        raise InputError(f"instances may lie within each other {MOST_LEVELS} deep, not deeper")
    local = np.array([box_of(mesh) for mesh in meshes])
    # As the kernels have them, so that what is put around them holds these, too.
    boxes = as_single(moved_boxes(local[which], matrices)).astype(np.float64)
    counts = np.array([primitives_in(mesh) for mesh in meshes], dtype=np.int64)
    first = np.concatenate([[0], np.cumsum(counts[which])])
    return Instanced(
        tuple(meshes), which, matrices, columns[0], boxes, first,
        np.arange(len(which), dtype=np.int32),
        reach_of(boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)), *columns[1:],
    )  # fmt: skip


def _column(values: np.ndarray | int, name: str, bits: int, count: int) -> np.ndarray:
    """Return numbers of so many bits, one of each instance."""
    values = np.broadcast_to(values, count)
    wrong = np.flatnonzero((values < 0) | (values >= 2**bits))
    if len(wrong):
        raise InputError(f"{name} {values[wrong[0]]} is not from 0 to {2**bits - 1}")
    return np.array(values, dtype=np.uint8 if bits == MASK_BITS else np.int32)


def box_of(geometry: Any) -> np.ndarray:
    """Return the box around all items of a geometry, (6,)."""
    boxes = boxes_around(geometry)
    return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])


def moved_points(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return points, (..., 3), as they are seen through a matrix, (3, 4)."""
    return points @ matrix[:, :3].T + matrix[:, 3]


def moved_boxes(boxes: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    """Return boxes, (n, 6), around boxes that are seen through matrices, (n, 3, 4)."""
    corners = np.einsum("nij,nkj->nki", matrices[:, :, :3], corners_of(boxes))
    corners += matrices[:, None, :, 3]
    padding = padding_of(boxes, matrices)[:, None]
    return np.concatenate([corners.min(axis=1) - padding, corners.max(axis=1) + padding], axis=1)


def padding_of(boxes: np.ndarray, matrices: np.ndarray) -> np.ndarray:
    """Return by how much such boxes are enlarged, (n,)."""
    # What the sums were made of may be larger than what they are.
    largest = np.abs(matrices[:, :, :3]) @ np.abs(boxes).reshape(-1, 2, 3).max(axis=1)[:, :, None]
    return PADDING * (largest[:, :, 0] + np.abs(matrices[:, :, 3])).max(axis=1)


def as_single(boxes: np.ndarray) -> np.ndarray:
    """Return boxes, (n, 6), as float32, rounded outward; as they are if that holds no such numbers.

    A walk reads half as much, and an instance is smaller by 24 bytes.
    """
    largest = np.abs(boxes).max(initial=0.0)
    if not SMALLEST_SINGLE < largest < LARGEST_SINGLE:
        return boxes
    single = boxes.astype(np.float32)
    low, high = single[:, :3], single[:, 3:]
    low[low > boxes[:, :3]] = np.nextafter(low, np.float32(-np.inf))[low > boxes[:, :3]]
    high[high < boxes[:, 3:]] = np.nextafter(high, np.float32(np.inf))[high < boxes[:, 3:]]
    return single


def primitives_in(geometry: Any) -> int:
    """Return how many primitives a geometry has, those of every instance counted."""
    if isinstance(geometry, Csg):
        return geometry.n_primitives
    return int(geometry.first[-1]) if isinstance(geometry, Instanced) else len(geometry.ids)


def stored_in(geometry: Any) -> int:
    """Return how many primitives a geometry has, those of every mesh counted once."""
    if not isinstance(geometry, Instanced):
        return primitives_in(geometry)
    return sum(stored_in(mesh) for mesh in geometry.meshes)


def levels_of_mesh(geometry: Any) -> int:
    """Return how deep instances lie within each other in a geometry: 0 where there are none."""
    return 1 + levels_of_mesh(geometry.meshes[0]) if isinstance(geometry, Instanced) else 0


def inverted(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the inverses of affine matrices, (n, 3, 4), and where there is none, (n,) bool."""
    linear = matrices[:, :, :3]
    # Of one size, so that only a matrix that makes things flat is called singular.
    size = np.abs(linear).max(axis=2, keepdims=True)
    size = np.where(size > 0.0, size, 1.0)
    with np.errstate(all="ignore"):
        is_singular = ~(np.abs(np.linalg.det(linear / size)) > np.finfo(np.float64).eps ** 2)
        inverse = np.linalg.inv(np.where(is_singular[:, None, None], np.eye(3), linear / size))
    inverse /= size.transpose(0, 2, 1)
    moved = -(inverse @ matrices[:, :, 3:])
    is_singular |= ~(np.isfinite(inverse).all(axis=(1, 2)) & np.isfinite(moved).all(axis=(1, 2)))
    return np.concatenate([inverse, moved], axis=2), is_singular


def mirrors(matrices: np.ndarray) -> np.ndarray:
    """Say which matrices, (n, 3, 4) or (n, 4, 4), mirror what is seen through them, (n,) bool."""
    x, y, z = (matrices[:, :3, column] for column in range(3))
    return (np.cross(x, y) * z).sum(axis=1) < 0.0


def is_of_triangles(geometry: Any) -> bool:
    """Say whether the meshes at the bottom are triangles."""
    if isinstance(geometry, Instanced):
        return is_of_triangles(geometry.meshes[0])
    return isinstance(geometry, Triangles)


def flattened(geometry: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return all triangles of instances in the space that these are in.

    Returns
    -------
    corners : (n, 3, 3) float64
        In the order in which primitives are counted.
    owners : (n,) int64
        The instance of each.
    """
    if isinstance(geometry, Triangles):
        return geometry.corners, np.zeros(len(geometry.corners), dtype=np.int64)
    local = [flattened(mesh)[0] for mesh in geometry.meshes]
    corners = np.empty((int(geometry.first[-1]), 3, 3))
    for number, mesh in enumerate(geometry.which):
        matrix, begin = geometry.matrices[number], geometry.first[number]
        part = corners[begin : geometry.first[number + 1]]
        np.matmul(local[mesh], matrix[:, :3].T, out=part)
        part += matrix[:, 3]
    return corners, np.repeat(np.arange(len(geometry.which)), np.diff(geometry.first))


def parts_in_world(geometry: Any) -> Iterator[tuple[np.ndarray, Callable[[], np.ndarray]]]:
    """Yield the box, (6,), of each instance, and what returns its triangles, (n, 3, 3), there.

    Of solids it returns the lines that show them, (n, 2, 3): points of their surfaces.

    What holds no instances is one part. So whoever looks through all triangles of a scene need not
    hold more than those of one instance.
    """
    if not isinstance(geometry, Instanced):
        everything = np.arange(primitives_in(geometry))
        is_plain = isinstance(geometry, Triangles)
        yield (
            box_of(geometry),
            lambda: geometry.corners if is_plain else lines_of(geometry, everything)[0],
        )
        return
    for number in range(len(geometry.which)):
        yield geometry.boxes[number], functools.partial(_triangles_of, geometry, number)


def _triangles_of(geometry: Instanced, number: int) -> np.ndarray:
    """Return the triangles of an instance, (n, 3, 3)."""
    corners, _ = flattened(geometry.meshes[geometry.which[number]])
    matrix = geometry.matrices[number]
    return corners @ matrix[:, :3].T + matrix[:, 3]


@boxes_around.register
def _(geometry: Instanced) -> np.ndarray:
    return geometry.boxes.copy()


@hulls_of.register
def _(geometry: Instanced) -> tuple[np.ndarray, np.ndarray]:
    return hulls_of_boxes(geometry.boxes)


@normals_at.register
def _(
    geometry: Instanced, primitives: np.ndarray, points: np.ndarray, times: np.ndarray
) -> np.ndarray:
    """Return the normals in the meshes' spaces, moved by the transposed inverse matrices."""
    owners, within = owners_of(geometry, primitives)
    inverse, _ = inverted(geometry.matrices)
    linear = inverse[owners, :, :3]
    local = moved_by(linear, points) + inverse[owners, :, 3]
    normals = np.empty((len(points), 3))
    for number, mesh in enumerate(geometry.meshes):
        here = np.flatnonzero(geometry.which[owners] == number)
        if len(here):
            normals[here] = normals_at(mesh, within[here], local[here], times[here])
    normals = moved_by(linear.transpose(0, 2, 1), normals)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@lines_of.register
def _(
    geometry: Instanced, primitives: np.ndarray, time: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the lines in the meshes' spaces, moved by the matrices."""
    places, within = owners_of(geometry, primitives)
    segments, owners = [np.empty((0, 2, 3))], [np.empty(0, np.int64)]
    for number, mesh in enumerate(geometry.meshes):
        here = np.flatnonzero(geometry.which[places] == number)
        if len(here):
            local, own = lines_of(mesh, within[here], time)
            matrix = geometry.matrices[places[here[own]]]
            moved = np.einsum("nij,nej->nei", matrix[:, :, :3], local)
            segments.append(moved + matrix[:, None, :, 3])
            owners.append(here[own])
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return np.concatenate(segments)[order], owner[order]


def owners_of(geometry: Any, primitives: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the instance of each primitive, and its number within that instance's mesh.

    Parameters
    ----------
    primitives : (n,) int
        As hits have them; -1 for none.

    Returns
    -------
    instance : (n,) int64
        -1 for none, and where there are no instances.
    within : (n,) int64
        -1 for none.
    """
    primitives = np.asarray(primitives, dtype=np.int64)
    if not isinstance(geometry, Instanced):
        return np.full(len(primitives), -1), primitives
    owners = np.searchsorted(geometry.first, primitives, side="right") - 1
    return owners, np.where(primitives >= 0, primitives - geometry.first[owners], -1)


def lines_of_items(geometry: Any, items: np.ndarray) -> np.ndarray:
    """Return lines that show where items of a scene are, (m, 2, 3); of instances, their boxes."""
    if isinstance(geometry, Instanced):
        return box_segments(geometry.boxes[items])
    if isinstance(geometry, Csg):
        return lines_of_trees(geometry, items)
    return lines_of(geometry, items)[0]
