"""Convex polyhedra given as intersections of half-spaces: their faces, areas and volumes.

A face is what all other half-spaces leave of a plane: a large square in the plane is cut by each of
them (Sutherland and Hodgman 1974). Faces know nothing of each other, so flat polyhedra, redundant
half-spaces and those that touch in a corner only need no care: they make faces without area.

Not every other half-space can cut a face; see :func:`tight_neighbours`.

I. Sutherland, G. Hodgman: Reentrant Polygon Clipping, CACM 17(1), 1974.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from .polygons import Polygons

SHELL = 1e-12
"""How much is left beyond a half-space, relative to the polyhedron's size: rounding may not take
away the faces of a flat one."""

SAME = 1.0 - 1e-12
"""Cosine between normals that are the same."""

THIN = 1e-9
"""Faces below this share of the polyhedron's size squared are not drawn."""


AT_ONCE = 1024
"""Polyhedra whose half-spaces are written out at once."""


class Room(NamedTuple):
    """Scratch memory for one polygon: before and after a cut, and its corners' heights."""

    points: np.ndarray
    heights: np.ndarray


def make_room(planes: int) -> Room:
    """Return room for the faces of polyhedra with so many half-spaces."""
    return Room(np.zeros((2, planes + 8, 3)), np.zeros(planes + 8))


@inner
def start_square(plane, middle, size, points):
    """Write the corners of a square in a plane around the foot of `middle`, half a side `size`."""
    axis = 0
    for other in range(1, 3):
        if abs(plane[other]) < abs(plane[axis]):
            axis = other
    # The axis farthest from the normal n: u = n x e, v = n x u.
    b, c = (axis + 1) % 3, (axis + 2) % 3
    height, norm = plane[3], (plane[b] * plane[b] + plane[c] * plane[c]) ** 0.5
    for k in range(3):
        height -= plane[k] * middle[k]
    for corner in range(4):
        along = size if corner == 1 or corner == 2 else -size
        across = size if corner > 1 else -size
        # n x e_axis has only the components b and c.
        ub, uc = plane[c] / norm, -plane[b] / norm
        points[corner, axis] = across * (plane[b] * uc - plane[c] * ub)
        points[corner, b] = along * ub - across * plane[axis] * uc
        points[corner, c] = along * uc + across * plane[axis] * ub
        for k in range(3):
            points[corner, k] += middle[k] + height * plane[k]


@inner
def cut_polygon(plane, shell, room, row, count):
    """Cut what is above a plane off a polygon; return its row and number of corners then."""
    points, heights = room.points[row], room.heights
    low, high = np.inf, -np.inf
    for i in range(count):
        h = plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2]
        h -= plane[3] + shell
        heights[i] = h
        low = h if h < low else low
        high = h if h > high else high
    if high <= 0.0:
        return row, count
    if low > 0.0:
        return row, 0
    out = room.points[1 - row]
    kept, last = 0, count - 1
    for i in range(count):
        if (heights[i] > 0.0) != (heights[last] > 0.0):
            share = heights[last] / (heights[last] - heights[i])
            for k in range(3):
                out[kept, k] = points[last, k] + share * (points[i, k] - points[last, k])
            kept += 1
        if heights[i] <= 0.0:
            for k in range(3):
                out[kept, k] = points[i, k]
            kept += 1
        last = i
    return 1 - row, kept


@inner
def cut_face(planes, face, neighbours, middle, size, shell, room):
    """Cut out a face; return its row in the room and its number of corners, 0 if there is none."""
    start_square(planes[face], middle, size, room.points[0])
    row, count = 0, 4
    for i in range(len(neighbours)):
        other = neighbours[i]
        if other < 0 or count == 0:
            break
        # Of two half-spaces that are the same, as members of an intersection may have, the second
        # has no face: the first cuts even what lies in its plane.
        a, b = planes[face], planes[other]
        is_same = other < face and a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > SAME
        row, count = cut_polygon(b, -shell if is_same else shell, room, row, count)
    return row, count


@inner
def polygon_area(points, count):
    """Return the area of a polygon with `count` corners."""
    nx, ny, nz = 0.0, 0.0, 0.0
    fx, fy, fz = points[0, 0], points[0, 1], points[0, 2]
    for i in range(1, count - 1):
        ax, ay, az = points[i, 0] - fx, points[i, 1] - fy, points[i, 2] - fz
        bx, by, bz = points[i + 1, 0] - fx, points[i + 1, 1] - fy, points[i + 1, 2] - fz
        nx, ny, nz = nx + ay * bz - az * by, ny + az * bx - ax * bz, nz + ax * by - ay * bx
    return 0.5 * (nx * nx + ny * ny + nz * nz) ** 0.5


@kernel
def measure_range(planes, neighbours, middles, sizes, shells, room, areas, contents):
    """Write areas and volumes; pyramids over the faces, from the middle, make up the volume."""
    for i in range(len(planes)):
        areas[i], contents[i] = 0.0, 0.0
        for face in range(planes.shape[1]):
            row, count = cut_face(
                planes[i], face, neighbours[face], middles[i], sizes[i], shells[i], room
            )
            if count == 0:
                continue
            area, height = polygon_area(room.points[row], count), planes[i, face, 3]
            for k in range(3):
                height -= planes[i, face, k] * middles[i, k]
            areas[i] += area
            contents[i] += area * height / 3.0


@kernel
def write_faces(planes, neighbours, middles, sizes, shells, room, thin, points, sizes_out, owners):
    """Write the corners of faces that are not too thin; return the number of these and of those."""
    n_points, n_faces = 0, 0
    for i in range(len(planes)):
        for face in range(planes.shape[1]):
            row, count = cut_face(
                planes[i], face, neighbours[face], middles[i], sizes[i], shells[i], room
            )
            if count < 3 or polygon_area(room.points[row], count) < thin * sizes[i] * sizes[i]:
                continue
            for corner in range(count):
                for k in range(3):
                    points[n_points + corner, k] = room.points[row, corner, k]
            n_points += count
            sizes_out[n_faces], owners[n_faces] = count, i
            n_faces += 1
    return n_points, n_faces


def every_other(count: int) -> np.ndarray:
    """Return the half-spaces that may cut each face, (m, m - 1) int64: all others."""
    faces = np.arange(count)
    return np.where(faces[:-1] < faces[:, None], faces[:-1], faces[:-1] + 1)


def tight_neighbours(normals: np.ndarray) -> np.ndarray:
    """Return the half-spaces that may cut each face of a polyhedron that fits tightly.

    All half-spaces touch the same object: h is the largest n . p over its points. Where the normals
    a and b of two sum up to a multiple c of that of a third, n, the second cannot cut the first
    one's face: on that, ``b . p = c n . p - a . p <= c h(n) - h(a)``, and the object's point that
    touches the third half-space says ``c h(n) <= h(a) + h(b)``. Nor can its opposite. Of the 25
    others of a 26-DOP that leaves eight to twelve.

    Parameters
    ----------
    normals : (m, 3) float64

    Returns
    -------
    (m, c) int64
        The end of a list is filled with -1.
    """
    sums = normals[:, None] + normals
    lengths = np.linalg.norm(sums, axis=2, keepdims=True)
    units = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    cosines = (sums / np.where(lengths > 0.0, lengths, 1.0)) @ units.T
    may_cut = (lengths[:, :, 0] > 0.0) & (cosines < 1.0 - 1e-9).all(axis=2)
    np.fill_diagonal(may_cut, False)
    lists = np.full((len(normals), may_cut.sum(axis=1).max()), -1)
    for face, row in enumerate(may_cut):
        lists[face, : row.sum()] = np.flatnonzero(row)
    return lists


def prepared(planes: np.ndarray, boxes: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return planes with normals of unit length, and middle, size and shell of each polyhedron."""
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    sizes = np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)
    shells = SHELL * sizes + 16 * np.finfo(float).eps * np.abs(boxes).max(axis=1)
    return planes / np.linalg.norm(planes[:, :, :3], axis=2)[:, :, None], middles, sizes, shells


def measured(volumes: Any, progress: Progress = SILENT) -> tuple[np.ndarray, np.ndarray]:
    """Return surface areas and volumes of convex polyhedra, (n,) each.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        With methods ``boxes()``, ``half_spaces(numbers)`` and ``neighbours()``.
    """
    boxes, neighbours = volumes.boxes(), volumes.neighbours()
    areas, contents = np.empty(len(boxes)), np.empty(len(boxes))

    def work(first: int, last: int) -> None:
        # Not too many at once: their planes should stay in the cache.
        for begin in range(first, last, AT_ONCE):
            numbers = np.arange(begin, min(begin + AT_ONCE, last))
            planes, *rest = prepared(volumes.half_spaces(numbers), boxes[numbers])
            out = areas[numbers[0] : numbers[-1] + 1], contents[numbers[0] : numbers[-1] + 1]
            room = make_room(planes.shape[1])
            call(measure_range, planes, neighbours, *rest, room, *out)

    for_chunks(work, len(boxes), 0, progress, "Measuring volumes")
    return areas, contents


def faces_of(volumes: Any, numbers: np.ndarray) -> Polygons:
    """Return the faces of some polyhedra; the owner of a face is its place in `numbers`.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        With methods ``boxes()``, ``half_spaces(numbers)`` and ``neighbours()``.
    """
    boxes, neighbours = volumes.boxes(), volumes.neighbours()
    lists = []
    for begin in range(0, max(len(numbers), 1), AT_ONCE):
        some = numbers[begin : begin + AT_ONCE]
        planes, *rest = prepared(volumes.half_spaces(some), boxes[some])
        n, m = planes.shape[:2]
        # Of m faces: at most 3 m - 6 edges, each in two of them; and room for double corners.
        points, sizes = np.empty((n * 8 * m, 3)), np.empty(n * m, np.int64)
        owners = np.empty(n * m, np.int64)
        n_points, n_faces = call(
            write_faces, planes, neighbours, *rest, make_room(m), THIN, points, sizes, owners
        )
        lists.append((points[:n_points].copy(), sizes[:n_faces].copy(), owners[:n_faces] + begin))
    points, sizes, owners = (np.concatenate(parts) for parts in zip(*lists))
    return Polygons(points, np.concatenate([[0], np.cumsum(sizes)]), owners)
