"""Convex polyhedra given as intersections of half-spaces: their faces, areas and volumes.

A face is what all other half-spaces leave of a plane: a large square in the plane is cut by each of
them (Sutherland and Hodgman 1974). Faces know nothing of each other, so flat polyhedra, redundant
half-spaces and those that touch in a corner only need no care: they make faces without area.

I. Sutherland, G. Hodgman: Reentrant Polygon Clipping, CACM 17(1), 1974.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from ..parallel import for_chunks
from ..progress import SILENT
from .polygons import Polygons

SHELL = 1e-12
"""How much is left beyond a half-space, relative to the polyhedron's size: rounding may not take
away the faces of a flat one."""

THIN = 1e-9
"""Faces below this share of the polyhedron's size squared are not drawn."""


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
def cut_face(planes, face, middle, size, shell, room):
    """Cut out a face; return its row in the room and its number of corners, 0 if there is none."""
    start_square(planes[face], middle, size, room.points[0])
    row, count = 0, 4
    for other in range(len(planes)):
        if other != face:
            row, count = cut_polygon(planes[other], shell, room, row, count)
            if count == 0:
                break
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
def measure_range(planes, middles, sizes, shells, room, areas, contents):
    """Write areas and volumes; pyramids over the faces, from the middle, make up the volume."""
    for i in range(len(planes)):
        areas[i], contents[i] = 0.0, 0.0
        for face in range(planes.shape[1]):
            row, count = cut_face(planes[i], face, middles[i], sizes[i], shells[i], room)
            if count == 0:
                continue
            area, height = polygon_area(room.points[row], count), planes[i, face, 3]
            for k in range(3):
                height -= planes[i, face, k] * middles[i, k]
            areas[i] += area
            contents[i] += area * height / 3.0


@kernel
def write_faces(planes, middles, sizes, shells, room, points, sizes_out, owners):
    """Write the corners of all faces that are seen; return the number of corners and of faces."""
    n_points, n_faces = 0, 0
    for i in range(len(planes)):
        for face in range(planes.shape[1]):
            row, count = cut_face(planes[i], face, middles[i], sizes[i], shells[i], room)
            if count < 3 or polygon_area(room.points[row], count) <= THIN * sizes[i] * sizes[i]:
                continue
            for corner in range(count):
                for k in range(3):
                    points[n_points + corner, k] = room.points[row, corner, k]
            n_points += count
            sizes_out[n_faces], owners[n_faces] = count, i
            n_faces += 1
    return n_points, n_faces


def prepared(planes: np.ndarray, boxes: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return planes with normals of unit length, and middle, size and shell of each polyhedron."""
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    sizes = np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)
    shells = SHELL * sizes + 16 * np.finfo(float).eps * np.abs(boxes).max(axis=1)
    planes = planes / np.linalg.norm(planes[:, :, :3], axis=2, keepdims=True)
    return planes, middles, sizes, shells


def measured(volumes, progress=SILENT) -> tuple[np.ndarray, np.ndarray]:
    """Return surface areas and volumes of convex polyhedra, (n,) each.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        With methods ``boxes()`` and ``half_spaces(numbers)``.
    """
    boxes = volumes.boxes()
    areas, contents = np.empty(len(boxes)), np.empty(len(boxes))

    def work(first: int, last: int) -> None:
        numbers = np.arange(first, last)
        planes = volumes.half_spaces(numbers)
        room = make_room(planes.shape[1])
        out = areas[first:last], contents[first:last]
        call(measure_range, *prepared(planes, boxes[numbers]), room, *out)

    for_chunks(work, len(boxes), 0, progress, "Measuring volumes")
    return areas, contents


def faces_of(volumes, numbers: np.ndarray) -> Polygons:
    """Return the faces of some polyhedra; the owner of a face is its place in `numbers`.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        With methods ``boxes()`` and ``half_spaces(numbers)``.
    """
    planes = volumes.half_spaces(numbers)
    n, m = planes.shape[:2]
    # Of a polyhedron with m faces: at most 3 m - 6 edges, each in two faces; and some double ones.
    points, sizes = np.empty((n * 8 * m, 3)), np.empty(n * m, np.int64)
    owners = np.empty(n * m, np.int64)
    n_points, n_faces = call(
        write_faces, *prepared(planes, volumes.boxes()[numbers]), make_room(m),
        points, sizes, owners,
    )  # fmt: skip
    offsets = np.concatenate([[0], np.cumsum(sizes[:n_faces])])
    return Polygons(points[:n_points].copy(), offsets, owners[:n_faces].copy())
