"""Convex polyhedra, the cells of a BSP tree: how a plane cuts them, their areas and volumes.

A polyhedron is a list of faces, each a loop of corners, counter-clockwise seen from outside. A
plane cuts it by cutting each loop (Sutherland and Hodgman); the corners on the plane, put in order
around their middle, are the new face. Nothing links faces or corners to each other, so rounding can
at worst leave a face with two corners at nearly the same place.

Corners within `shell` of a plane count as on it and stay where they are. Cells may overlap, or
leave gaps, by so much and no more.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ...geometry.length import length
from ...kernels import inner

MOST_FACES = 72
"""Six of the root, one more per level, and room."""

MOST_CORNERS = 512
"""Corners in all loops: of f faces at most 6 f - 12, with room for double ones. Half of it is for
what a plane leaves of the faces, half for the new face. Who would need more is not cut."""


WHOLE, LEAST, MOST = 3, 4, 5
"""Columns of `Polyhedra.faces`, after the normal."""


class Polyhedra(NamedTuple):
    """Room for a few convex polyhedra, and scratch.

    Attributes
    ----------
    points : (k, MOST_CORNERS, 3) float64
        Loop after loop.
    starts : (k, MOST_FACES + 1) int64
        Face i has the corners ``starts[i] ... starts[i + 1] - 1``.
    n_faces : (k,) int64
    heights : (MOST_CORNERS,) float64
        Signed distances from a plane.
    angles : (MOST_CORNERS,) float64
        Which corners are on the plane, and what those of the new face are sorted by.
    faces : (MOST_FACES, 6) float64
        Of the polyhedron that was measured last: normals, twice the areas long; columns WHOLE, the
        areas, LEAST and MOST, the heights of the lowest and of the highest corner.
    """

    points: np.ndarray
    starts: np.ndarray
    n_faces: np.ndarray
    heights: np.ndarray
    angles: np.ndarray
    faces: np.ndarray


def make_polyhedra(count: int, box: np.ndarray) -> Polyhedra:
    """Return room for `count` polyhedra, of which the first is a box, (6,)."""
    room = Polyhedra(
        np.zeros((count, MOST_CORNERS, 3)), np.zeros((count, MOST_FACES + 1), np.int64),
        np.zeros(count, np.int64), np.zeros(MOST_CORNERS), np.zeros(MOST_CORNERS),
        np.zeros((MOST_FACES, 6)),
    )  # fmt: skip
    corners = np.array([[box[3 * (i >> a & 1) + a] for a in range(3)] for i in range(8)])
    loops = [0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6]
    room.points[0, :24] = corners[loops]
    room.starts[0, :7] = 4 * np.arange(7)
    room.n_faces[0] = 6
    return room


@inner
def measure_heights(room, row, plane):
    """Write the signed distances of all corners from a plane (4,); return the least and largest.

    Those of each face go to `room.faces`.
    """
    low, high = np.inf, -np.inf
    points, starts, heights, faces = room.points[row], room.starts[row], room.heights, room.faces
    a, b, c, position = plane[0], plane[1], plane[2], plane[3]
    for face in range(room.n_faces[row]):
        least, most = np.inf, -np.inf
        for i in range(starts[face], starts[face + 1]):
            h = a * points[i, 0] + b * points[i, 1] + c * points[i, 2] - position
            heights[i] = h
            least = h if h < least else least
            most = h if h > most else most
        faces[face, LEAST], faces[face, MOST] = least, most
        low = least if least < low else low
        high = most if most > high else high
    return low, high


@inner
def measure_faces(room, row):
    """Write the normals of all faces, twice their areas long, and their areas to `room.faces`."""
    points, starts, faces = room.points[row], room.starts[row], room.faces
    for face in range(room.n_faces[row]):
        begin, end = starts[face], starts[face + 1]
        # As a fan from a first corner.
        ox, oy, oz = points[begin, 0], points[begin, 1], points[begin, 2]
        wx, wy, wz = 0.0, 0.0, 0.0
        lx, ly, lz = 0.0, 0.0, 0.0
        for i in range(begin + 1, end):
            x, y, z = points[i, 0] - ox, points[i, 1] - oy, points[i, 2] - oz
            wx, wy, wz = wx + ly * z - lz * y, wy + lz * x - lx * z, wz + lx * y - ly * x
            lx, ly, lz = x, y, z
        faces[face, 0], faces[face, 1], faces[face, 2] = wx, wy, wz
        faces[face, WHOLE] = 0.5 * length(wx, wy, wz)


@inner
def clip(room, source, target, plane, sign, shell):
    """Write what a polyhedron has on one side of a plane (1: above, -1: below) to another row.

    The new face is the last. Returns False if it has too many corners, or nothing is left.
    """
    measure_heights(room, source, plane)
    heights, points, starts = room.heights, room.points[source], room.starts[source]
    most = len(room.heights)
    out, out_starts, marks = room.points[target], room.starts[target], room.angles
    n_faces = room.n_faces[source]
    kept, place = n_faces - n_faces, starts[0]  # zero; the number 0 would be a type of its own
    for face in range(n_faces):
        # A plane crosses the border of a convex face twice, rounding or not, since what is within
        # the shell counts as on the plane. So a face gets one corner more at most.
        if place + starts[face + 1] - starts[face] + 1 > most:
            return False
        last, first, is_kept, crossings = starts[face + 1] - 1, place, False, 0
        before = sign * heights[last]
        before = before if abs(before) > shell else 0.0
        for i in range(starts[face], starts[face + 1]):
            here = sign * heights[i]
            here = here if abs(here) > shell else 0.0
            is_kept = is_kept or here > 0.0
            if (here < 0.0 < before or before < 0.0 < here) and crossings < 2:
                crossings += 1
                # From the corner above to that below, whichever face asks: the same point.
                a, b = (i, last) if here > 0.0 else (last, i)
                share = heights[a] / (heights[a] - heights[b])
                for axis in range(3):
                    start = points[a, axis]
                    out[place, axis] = start + share * (points[b, axis] - start)
                marks[place] = 0.0
                place += 1
            if here >= 0.0:
                for axis in range(3):
                    out[place, axis] = points[i, axis]
                marks[place] = here
                place += 1
            last, before = i, here
        # A face in the plane is replaced by the new one.
        if is_kept:
            out_starts[kept] = first
            kept += 1
        else:
            place = first
        if place > most // 2:
            return False
    out_starts[kept] = place
    end = add_cap(out, marks, place, plane, sign)
    out_starts[kept + 1] = end
    room.n_faces[target] = kept + 1
    return kept > 2 and end > place and kept < MOST_FACES - 2


@inner
def add_cap(out, marks, place, plane, sign):
    """Put the corners with mark 0, those on the plane, in order around their middle.

    They become a loop from `place` on, whose end is returned. Their angles replace the marks.
    """
    # Look along the axis to which the plane is most nearly perpendicular.
    axis = 0
    for other in range(1, 3):
        if abs(plane[other]) > abs(plane[axis]):
            axis = other
    u, v = (axis + 1) % 3, (axis + 2) % 3
    # The face looks away from what is kept.
    turn = -sign if plane[axis] > 0.0 else sign
    n, middle_u, middle_v = 0, 0.0, 0.0
    for i in range(place):
        if marks[i] == 0.0:
            n += 1
            middle_u += out[i, u]
            middle_v += out[i, v]
    end = place
    for i in range(place):
        if marks[i] != 0.0:
            continue
        angle = turn * math.atan2(out[i, v] - middle_v / n, out[i, u] - middle_u / n)
        # Every corner comes from two faces or more.
        is_new, j = True, end
        for k in range(place, end):
            is_new = is_new and not (
                out[k, 0] == out[i, 0] and out[k, 1] == out[i, 1] and out[k, 2] == out[i, 2]
            )
        if not is_new:
            continue
        while j > place and marks[j - 1] > angle:
            marks[j] = marks[j - 1]
            for a in range(3):
                out[j, a] = out[j - 1, a]
            j -= 1
        marks[j] = angle
        for a in range(3):
            out[j, a] = out[i, a]
        end += 1
    return end if end - place > 2 else place


@inner
def side_areas(room, row, plane, position):
    """Return the surface areas of the parts below and above a plane, the cut included.

    The plane is at `position` of that from which :func:`measure_heights` has measured; faces that
    it does not cross are taken from :func:`measure_faces`. The outward normals of a closed surface,
    each as long as its face's area, sum up to zero: so those of the faces below give the cut's.
    """
    points, starts = room.points[row], room.starts[row]
    heights, faces = room.heights, room.faces
    below, above, cut = 0.0, 0.0, 0.0
    for face in range(room.n_faces[row]):
        whole = faces[face, WHOLE]
        if faces[face, LEAST] > position:
            above += whole
            continue
        # Twice the normal of the part below.
        px, py, pz = faces[face, 0], faces[face, 1], faces[face, 2]
        part = whole
        if faces[face, MOST] > position:
            begin, end = starts[face], starts[face + 1]
            ox, oy, oz = points[begin, 0], points[begin, 1], points[begin, 2]
            px, py, pz = 0.0, 0.0, 0.0
            qx, qy, qz = 0.0, 0.0, 0.0  # the last corner of the part below
            fx, fy, fz = 0.0, 0.0, 0.0  # and the first
            is_empty = True
            last = end - 1
            before = heights[last] - position
            lx, ly, lz = points[last, 0] - ox, points[last, 1] - oy, points[last, 2] - oz
            for i in range(begin, end):
                x, y, z = points[i, 0] - ox, points[i, 1] - oy, points[i, 2] - oz
                here = heights[i] - position
                # First where the edge crosses the plane, then its end.
                for step in range(2):
                    ex, ey, ez = x, y, z
                    if step == 0:
                        if not here * before < 0.0:
                            continue
                        share = before / (before - here)
                        ex, ey, ez = (
                            lx + share * (x - lx),
                            ly + share * (y - ly),
                            lz + share * (z - lz),
                        )
                    elif here > 0.0:
                        continue
                    if is_empty:
                        fx, fy, fz = ex, ey, ez
                        is_empty = False
                    else:
                        ax, ay, az = qx - fx, qy - fy, qz - fz
                        bx, by, bz = ex - fx, ey - fy, ez - fz
                        px, py, pz = (
                            px + ay * bz - az * by,
                            py + az * bx - ax * bz,
                            pz + ax * by - ay * bx,
                        )
                    qx, qy, qz = ex, ey, ez
                before, lx, ly, lz = here, x, y, z
            part = 0.5 * length(px, py, pz)
        below += part
        above += max(whole - part, 0.0)
        cut -= 0.5 * (px * plane[0] + py * plane[1] + pz * plane[2])
    return below + abs(cut), above + abs(cut)


@inner
def measure(room, row, box):
    """Return the area and the volume of a polyhedron, and write its bounding box, (6,)."""
    points, starts = room.points[row], room.starts[row]
    n_faces = room.n_faces[row]
    end = starts[n_faces]
    for axis in range(3):
        box[axis], box[3 + axis] = np.inf, -np.inf
    for i in range(end):
        for axis in range(3):
            box[axis] = min(box[axis], points[i, axis])
            box[3 + axis] = max(box[3 + axis], points[i, axis])
    ox, oy, oz = 0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), 0.5 * (box[2] + box[5])
    area, volume = 0.0, 0.0
    for face in range(n_faces):
        begin = starts[face]
        fx, fy, fz = points[begin, 0], points[begin, 1], points[begin, 2]
        nx, ny, nz = 0.0, 0.0, 0.0
        for i in range(begin + 1, starts[face + 1] - 1):
            ax, ay, az = points[i, 0] - fx, points[i, 1] - fy, points[i, 2] - fz
            bx, by, bz = points[i + 1, 0] - fx, points[i + 1, 1] - fy, points[i + 1, 2] - fz
            nx, ny, nz = nx + ay * bz - az * by, ny + az * bx - ax * bz, nz + ax * by - ay * bx
        area += 0.5 * length(nx, ny, nz)
        # Pyramids over the faces, from the middle of the box.
        volume += (nx * (fx - ox) + ny * (fy - oy) + nz * (fz - oz)) / 6.0
    return area, volume
