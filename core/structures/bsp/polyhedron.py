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

from ...kernels import inner

MOST_FACES = 72
"""Six of the root, one more per level, and room."""

MOST_CORNERS = 512
"""Corners in all loops: of f faces at most 6 f - 12, with room for double ones."""


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
        What the corners of a new face are sorted by.
    """

    points: np.ndarray
    starts: np.ndarray
    n_faces: np.ndarray
    heights: np.ndarray
    angles: np.ndarray


def make_polyhedra(count: int, box: np.ndarray) -> Polyhedra:
    """Return room for `count` polyhedra, of which the first is a box, (6,)."""
    room = Polyhedra(
        np.zeros((count, MOST_CORNERS, 3)), np.zeros((count, MOST_FACES + 1), np.int64),
        np.zeros(count, np.int64), np.zeros(MOST_CORNERS), np.zeros(MOST_CORNERS),
    )  # fmt: skip
    corners = np.array([[box[3 * (i >> a & 1) + a] for a in range(3)] for i in range(8)])
    loops = [0, 4, 6, 2, 1, 3, 7, 5, 0, 1, 5, 4, 2, 6, 7, 3, 0, 2, 3, 1, 4, 5, 7, 6]
    room.points[0, :24] = corners[loops]
    room.starts[0, :7] = 4 * np.arange(7)
    room.n_faces[0] = 6
    return room


@inner
def measure_heights(room, row, plane):
    """Write the signed distances of all corners from a plane (4,); return the least and largest."""
    low, high = np.inf, -np.inf
    points, heights = room.points[row], room.heights
    for i in range(room.starts[row, room.n_faces[row]]):
        h = plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2] - plane[3]
        heights[i] = h
        low = h if h < low else low
        high = h if h > high else high
    return low, high


@inner
def clip(room, source, target, plane, sign, shell):
    """Write what a polyhedron has on one side of a plane (1: above, -1: below) to another row.

    The new face is the last. Returns False if it has too many corners, or nothing is left.
    """
    measure_heights(room, source, plane)
    heights, points, starts = room.heights, room.points[source], room.starts[source]
    out, out_starts = room.points[target], room.starts[target]
    n_faces = room.n_faces[source]
    # The new face is collected at the end of the room, then moved behind the others.
    kept, place, cap = 0, 0, MOST_CORNERS
    for face in range(n_faces):
        begin, end = starts[face], starts[face + 1]
        first, is_kept = place, False
        before = sign * heights[end - 1]
        before = 0.0 if abs(before) <= shell else before
        for i in range(begin, end):
            here = sign * heights[i]
            here = 0.0 if abs(here) <= shell else here
            is_kept = is_kept or here > 0.0
            if place + 2 > cap - 2:
                return False
            # The same two corners in the same order, whichever face asks: the same point.
            if here * before < 0.0:
                j = i - 1 if i > begin else end - 1
                a, b = (i, j) if here > 0.0 else (j, i)
                share = heights[a] / (heights[a] - heights[b])
                cap -= 1
                for axis in range(3):
                    x = points[a, axis] + share * (points[b, axis] - points[a, axis])
                    out[place, axis] = x
                    out[cap, axis] = x
                place += 1
            if here >= 0.0:
                for axis in range(3):
                    out[place, axis] = points[i, axis]
                place += 1
            if here == 0.0:
                cap -= 1
                for axis in range(3):
                    out[cap, axis] = points[i, axis]
            before = here
        # A face in the plane is replaced by the new one.
        if is_kept:
            out_starts[kept] = first
            kept += 1
        else:
            place = first
    out_starts[kept] = place
    if kept == 0:
        return False
    place = add_cap(out, place, cap, plane, sign, room.angles)
    if place > out_starts[kept]:
        kept += 1
        out_starts[kept] = place
    room.n_faces[target] = kept
    return kept < MOST_FACES - 1


@inner
def add_cap(out, place, cap, plane, sign, angles):
    """Put the corners from `cap` on in order around their middle; return the end of the loop."""
    # Look along the axis to which the plane is most nearly perpendicular.
    axis = 0
    for other in range(1, 3):
        if abs(plane[other]) > abs(plane[axis]):
            axis = other
    u, v = (axis + 1) % 3, (axis + 2) % 3
    # The face looks away from what is kept.
    turn = -sign if plane[axis] > 0.0 else sign
    n = MOST_CORNERS - cap
    middle_u, middle_v = 0.0, 0.0
    for i in range(cap, MOST_CORNERS):
        middle_u += out[i, u] / n
        middle_v += out[i, v] / n
    begin = place
    for i in range(cap, MOST_CORNERS):
        x, y, z = out[i, 0], out[i, 1], out[i, 2]
        angle = turn * math.atan2(out[i, v] - middle_v, out[i, u] - middle_u)
        # Every corner comes from two faces or more.
        is_new = True
        for j in range(begin, place):
            is_new = is_new and not (out[j, 0] == x and out[j, 1] == y and out[j, 2] == z)
        if is_new:
            j = place
            while j > begin and angles[j - 1] > angle:
                angles[j] = angles[j - 1]
                for a in range(3):
                    out[j, a] = out[j - 1, a]
                j -= 1
            angles[j] = angle
            out[j, 0], out[j, 1], out[j, 2] = x, y, z
            place += 1
    return place if place - begin > 2 else begin


@inner
def side_areas(room, row, plane, position):
    """Return the surface areas of the parts below and above a plane, the cut included.

    The corners' heights must have been measured from the parallel plane at position 0. The outward normals of a closed surface,
    each as long as its face's area, sum up to zero: so those of the faces below give the cut's.
    """
    points, starts, heights = room.points[row], room.starts[row], room.heights
    below, above, cut = 0.0, 0.0, 0.0
    for face in range(room.n_faces[row]):
        begin, end = starts[face], starts[face + 1]
        # Twice the normals of the whole face and of its part below, as fans from a first corner.
        ox, oy, oz = points[begin, 0], points[begin, 1], points[begin, 2]
        wx, wy, wz, px, py, pz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        qx, qy, qz = 0.0, 0.0, 0.0  # the last corner of the part below
        fx, fy, fz = 0.0, 0.0, 0.0  # and the first
        is_empty = True
        last = end - 1
        for i in range(begin, end):
            x, y, z = points[i, 0] - ox, points[i, 1] - oy, points[i, 2] - oz
            lx, ly, lz = points[last, 0] - ox, points[last, 1] - oy, points[last, 2] - oz
            wx, wy, wz = wx + ly * z - lz * y, wy + lz * x - lx * z, wz + lx * y - ly * x
            here, before = heights[i] - position, heights[last] - position
            # First where the edge crosses the plane, then its end.
            for step in range(2):
                ex, ey, ez = x, y, z
                if step == 0:
                    if not here * before < 0.0:
                        continue
                    share = before / (before - here)
                    ex, ey, ez = lx + share * (x - lx), ly + share * (y - ly), lz + share * (z - lz)
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
            last = i
        whole = 0.5 * (wx * wx + wy * wy + wz * wz) ** 0.5
        part = 0.5 * (px * px + py * py + pz * pz) ** 0.5
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
        area += 0.5 * (nx * nx + ny * ny + nz * nz) ** 0.5
        # Pyramids over the faces, from the middle of the box.
        volume += (nx * (fx - ox) + ny * (fy - oy) + nz * (fz - oz)) / 6.0
    return area, volume
