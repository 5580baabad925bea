"""Convex polyhedra given as intersections of half-spaces: their faces, areas and volumes.

A face is what all other half-spaces leave of a plane: a large square in the plane is cut by each of
them (Sutherland and Hodgman 1974). Faces know nothing of each other, so flat polyhedra, redundant
half-spaces and those that touch in a corner only need no care: they make faces without area.

All is reckoned from the middle of a polyhedron and in units of its size, so that it matters neither
how large it is nor how far from the origin. Not every other half-space can cut a face; see
:func:`tight_neighbours`.

I. Sutherland, G. Hodgman: Reentrant Polygon Clipping, CACM 17(1), 1974.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from .length import polygon_area
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


def most_corners(planes: int) -> int:
    """Return the most corners of a face of a polyhedron with so many half-spaces.

    Four, and one more for every cut: :func:`cut_polygon` sees to that.
    """
    return planes + 4


def make_room(planes: int) -> Room:
    """Return room for the faces of polyhedra with so many half-spaces."""
    most = most_corners(planes)
    return Room(np.zeros((2, most, 3)), np.zeros(most))


class Local(NamedTuple):
    """Polyhedra, each seen from its own middle and in units of its own.

    Attributes
    ----------
    planes : (n, m, 4) float64
        Half-spaces ``n . p <= h``, each [nx, ny, nz, h] with n of unit length.
    sizes, shells : (n,) float64
        Diagonal of the box around, and how much is left beyond a half-space.
    middles : (n, 3) float64
    units : (n,) float64
        Powers of two.
    """

    planes: np.ndarray
    sizes: np.ndarray
    shells: np.ndarray
    middles: np.ndarray
    units: np.ndarray


@inner
def start_square(plane, size, points):
    """Write the corners of a square in a plane around the origin's foot, half a side `size`."""
    axis = 0
    for other in range(1, 3):
        if abs(plane[other]) < abs(plane[axis]):
            axis = other
    # The axis farthest from the normal n: u = n x e, v = n x u.
    b, c = (axis + 1) % 3, (axis + 2) % 3
    norm = (plane[b] * plane[b] + plane[c] * plane[c]) ** 0.5
    for corner in range(4):
        along = size if corner == 1 or corner == 2 else -size
        across = size if corner > 1 else -size
        # n x e_axis has only the components b and c.
        ub, uc = plane[c] / norm, -plane[b] / norm
        points[corner, axis] = across * (plane[b] * uc - plane[c] * ub)
        points[corner, b] = along * ub - across * plane[axis] * uc
        points[corner, c] = along * uc + across * plane[axis] * ub
        for k in range(3):
            points[corner, k] += plane[3] * plane[k]


@inner
def cut_polygon(plane, shell, room, row, count):
    """Cut what is above a plane off a polygon; return its row and number of corners then.

    That is one more at most: a plane crosses the border of a convex polygon twice, one with
    rounding as well, since what is within half a shell counts as on the plane.
    """
    points, heights = room.points[row], room.heights
    low, high = np.inf, -np.inf
    for i in range(count):
        h = plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2]
        h -= plane[3] + shell
        h = h if abs(h) > 0.5 * abs(shell) else 0.0
        heights[i] = h
        low = h if h < low else low
        high = h if h > high else high
    if high <= 0.0:
        return row, count
    if low > 0.0:
        return row, 0
    out = room.points[1 - row]
    kept, last, crossings = 0, count - 1, 0
    for i in range(count):
        if (heights[i] > 0.0) != (heights[last] > 0.0) and crossings < 2:
            crossings += 1
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
def cut_face(planes, face, neighbours, size, shell, room):
    """Cut out a face; return its row in the room and its number of corners, 0 if there is none."""
    start_square(planes[face], size, room.points[0])
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


@kernel
def measure_range(local, neighbours, room, areas, contents):
    """Write areas and volumes; pyramids over the faces, from the middle, make up the volume."""
    planes = local.planes
    for i in range(len(planes)):
        total, content, unit = 0.0, 0.0, local.units[i]
        for face in range(planes.shape[1]):
            row, count = cut_face(
                planes[i], face, neighbours[face], local.sizes[i], local.shells[i], room
            )
            if count == 0:
                continue
            area = polygon_area(room.points[row], 0, count)
            total += area
            content += area * planes[i, face, 3] / 3.0
        areas[i], contents[i] = total * unit * unit, content * unit * unit * unit


@kernel
def write_faces(local, neighbours, room, thin, points, corner_counts, owners):
    """Write the corners of faces that are not too thin; return the number of these and of those.

    There must be room for all faces, each with as many corners as :func:`most_corners` says.
    """
    n_points, n_faces = 0, 0
    planes, sizes = local.planes, local.sizes
    for i in range(len(planes)):
        for face in range(planes.shape[1]):
            row, count = cut_face(
                planes[i], face, neighbours[face], sizes[i], local.shells[i], room
            )
            if count < 3 or polygon_area(room.points[row], 0, count) < thin * sizes[i] * sizes[i]:
                continue
            for corner in range(count):
                for k in range(3):
                    points[n_points + corner, k] = (
                        local.middles[i, k] + local.units[i] * room.points[row, corner, k]
                    )
            n_points += count
            corner_counts[n_faces], owners[n_faces] = count, i
            n_faces += 1
    return n_points, n_faces


def every_other(count: int) -> np.ndarray:
    """Return the half-spaces that may cut each face, (m, m - 1) int64: all others."""
    faces = np.arange(count)
    return np.where(faces[:-1] < faces[:, None], faces[:-1], faces[:-1] + 1)


def tight_neighbours(normals: np.ndarray) -> np.ndarray:
    """Return the half-spaces that may cut each face of a polyhedron that fits tightly.

    All half-spaces touch the same object: h is the largest n . p over its points. Where the normal
    n of a third lies between the normals a and b of two, ``n = s a + t b`` with positive s and t,
    the second cannot cut the first one's face: on that, ``t b . p = n . p - s a . p <= h(n) -
    s h(a)``, and the object's point that touches the third half-space says ``h(n) <= s h(a) +
    t h(b)``. Nor can its opposite. Of the 25 others of a 26-DOP that leaves eight to twelve.

    Parameters
    ----------
    normals : (m, 3) float64

    Returns
    -------
    (m, c) int64
        The end of a list is filled with -1.
    """
    units = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    cosines = units @ units.T
    may_cut = np.abs(cosines) < SAME
    for a, b in zip(*np.nonzero(may_cut)):
        # Of each normal what is across b and across a: both positive, and nothing is beside them.
        parts = units @ np.linalg.pinv(units[[a, b]])
        beside = np.linalg.norm(units - parts @ units[[a, b]], axis=1)
        may_cut[a, b] = not ((parts > 1e-9).all(axis=1) & (beside < 1e-9)).any()
    lists = np.full((len(normals), may_cut.sum(axis=1).max()), -1)
    for face, row in enumerate(may_cut):
        lists[face, : row.sum()] = np.flatnonzero(row)
    return lists


def localised(planes: np.ndarray, boxes: np.ndarray) -> Local:
    """Return polyhedra seen from their middles.

    Parameters
    ----------
    planes : (n, m, 4) float64
        Half-spaces; normals of any length.
    boxes : (n, 6) float64
        Around the polyhedra.
    """
    middles = 0.5 * boxes[:, :3] + 0.5 * boxes[:, 3:]
    units = np.ldexp(1.0, np.frexp((boxes[:, 3:] - boxes[:, :3]).max(axis=1))[1])
    sizes = np.linalg.norm((boxes[:, 3:] - boxes[:, :3]) / units[:, None], axis=1)
    shells = SHELL * sizes + 16 * np.finfo(float).eps * (np.abs(boxes).max(axis=1) / units)
    normals = planes[:, :, :3]
    heights = (planes[:, :, 3] - np.einsum("nmk,nk->nm", normals, middles)) / units[:, None]
    local = np.concatenate([normals, heights[:, :, None]], axis=2)
    return Local(local / np.linalg.norm(normals, axis=2)[:, :, None], sizes, shells, middles, units)


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
            local = localised(volumes.half_spaces(numbers), boxes[numbers])
            out = areas[numbers[0] : numbers[-1] + 1], contents[numbers[0] : numbers[-1] + 1]
            call(measure_range, local, neighbours, make_room(local.planes.shape[1]), *out)

    for_chunks(work, len(boxes), 0, progress, "Measuring volumes")
    return areas, contents


def faces_of(volumes: Any, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
    """Return the faces of some polyhedra; the owner of a face is its place in `numbers`.

    Parameters
    ----------
    volumes : NamedTuple of arrays
        With methods ``boxes()``, ``half_spaces(numbers)`` and ``neighbours()``.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    boxes, neighbours = volumes.boxes(), volumes.neighbours()
    lists = []
    for begin in range(0, max(len(numbers), 1), AT_ONCE):
        progress.report(begin, len(numbers), "Finding faces")
        some = numbers[begin : begin + AT_ONCE]
        local = localised(volumes.half_spaces(some), boxes[some])
        n, m = local.planes.shape[:2]
        # Hardly a tenth of it is written to, and so ever taken.
        points = np.empty((n * m * most_corners(m), 3))
        sizes, owners = np.empty(n * m, np.int64), np.empty(n * m, np.int64)
        n_points, n_faces = call(
            write_faces, local, neighbours, make_room(m), THIN, points, sizes, owners
        )
        lists.append((points[:n_points].copy(), sizes[:n_faces].copy(), owners[:n_faces] + begin))
    points, sizes, owners = (np.concatenate(parts) for parts in zip(*lists))
    return Polygons(points, np.concatenate([[0], np.cumsum(sizes)]), owners)
