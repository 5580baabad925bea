"""Surface area of the convex hull of points, by quickhull.

A line that hits a convex volume of area S hits a convex object inside of area S_i with the
probability S_i / S. Of an object that is not convex, S_i is that of its hull, and it is the hull
that is hit.

Begin with a tetrahedron. Every point outside belongs to a face that it is beyond. Take the one
farthest away of all: the faces that it sees are replaced by a fan from their horizon to the point.

C. Barber, D. Dobkin, H. Huhdanpaa: The Quickhull Algorithm for Convex Hulls, ACM TOMS 22(4), 1996.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from ..progress import SILENT, Progress

BEYOND = 1e-11
"""How far beyond a face, relative to the size of all, a point is outside."""

MOST_CORNERS = 8000
"""Of a hull. The farthest points come first: of a million on a sphere, what is missed then makes
the area smaller by less than five in ten thousand."""

POINTS_PER_CALL = 16
"""Points taken in by one kernel call. The first of them share out all that are outside, of a
million those within a tenth of a second; one of the last looks at every face, which is soon."""

TEXT = "Finding the convex hull"

NOBODY = -1


def hull_area(points: np.ndarray, progress: Progress = SILENT) -> float:
    """Return the surface area of the convex hull; of a flat one that of both of its sides.

    Parameters
    ----------
    points : (n, 3) float64
        At least one.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    corners = hull_faces(points, progress)
    sides = corners[:, 1:] - corners[:, :1]
    return float(0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum())


def hull_faces(points: np.ndarray, progress: Progress = SILENT) -> np.ndarray:
    """Return the faces of the convex hull as triangles, (k, 3, 3), counter-clockwise from outside.

    Of points in a plane both sides of their hull; none of points on a line.

    Parameters
    ----------
    points : (n, 3) float64

    Raises
    ------
    Cancelled
        From `progress`.
    """
    low = points.min(axis=0)
    size = float((points.max(axis=0) - low).max())
    if not size > 0.0:
        return np.empty((0, 3, 3))
    relative = (points - low) / size
    first = first_tetrahedron(relative)
    if len(first) < 3:
        return np.empty((0, 3, 3))
    if len(first) == 4:
        return low + size * relative[quickhull(relative, first, progress)]
    # Points in a plane: a tip beside it makes a pyramid, whose base is one of the sides.
    a, b, c = relative[first]
    normal = np.cross(b - a, c - a)
    tip = relative.mean(axis=0) + normal / np.linalg.norm(normal)
    faces = quickhull(np.concatenate([relative, tip[None]]), [*first, len(relative)], progress)
    base = low + size * relative[faces[(faces < len(relative)).all(axis=1)]]
    return np.concatenate([base, base[:, ::-1]])


def first_tetrahedron(points: np.ndarray) -> list[int]:
    """Return four points that span a large tetrahedron; fewer if all lie in a plane or on a line.

    Parameters
    ----------
    points : (n, 3) float64
        In the unit cube.
    """
    axis = int(np.ptp(points, axis=0).argmax())
    a, b = int(points[:, axis].argmin()), int(points[:, axis].argmax())
    along = points[b] - points[a]
    across = np.linalg.norm(np.cross(points - points[a], along), axis=1)
    c = int(across.argmax())
    if not across[c] > BEYOND:
        return [a, b]
    normal = np.cross(along, points[c] - points[a])
    height = (points - points[a]) @ (normal / np.linalg.norm(normal))
    d = int(np.abs(height).argmax())
    return [a, b, c, d] if abs(height[d]) > BEYOND else [a, b, c]


class Hull(NamedTuple):
    """A hull that grows point by point; room for as many faces as there may be.

    Attributes
    ----------
    corners : (f, 3) int64
    planes : (f, 4) float64
        Unit normal of each face, and how far from the origin it is along that.
    heights : (f,) float64
        How far the farthest point beyond each face is away; 0 if there is none.
    farthest : (f,) int64
        That point.
    first : (f,) int64
        First of the points beyond each face, NOBODY if there is none.
    next : (n,) int64
        The point that follows in the same list, NOBODY at its end.
    edges : (e, 2) int64
        Scratch memory: the horizon.
    """

    corners: np.ndarray
    planes: np.ndarray
    heights: np.ndarray
    farthest: np.ndarray
    first: np.ndarray
    next: np.ndarray
    edges: np.ndarray


def quickhull(points: np.ndarray, first: list[int], progress: Progress = SILENT) -> np.ndarray:
    """Return the faces, (k, 3) int64, of the hull of points that begins with four of them.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    # A hull of c corners has 2 c - 4 faces, more only where rounding folds it.
    room = 2 * min(MOST_CORNERS, len(points)) + 64
    hull = Hull(
        np.empty((room, 3), np.int64), np.empty((room, 4)), np.empty(room),
        np.empty(room, np.int64), np.empty(room, np.int64), np.empty(len(points), np.int64),
        np.empty((3 * room, 2), np.int64),
    )  # fmt: skip
    a, b, c, d = first
    if np.cross(points[b] - points[a], points[c] - points[a]) @ (points[d] - points[a]) > 0.0:
        b, c = c, b
    progress.report(0, room, TEXT)
    count, taken = call(begin_hull, points, hull, a, b, c, d), POINTS_PER_CALL
    while taken == POINTS_PER_CALL:
        progress.report(count, room, TEXT)
        count, taken = call(grow_hull, points, hull, count, POINTS_PER_CALL)
    progress.report(room, room, TEXT)
    return hull.corners[:count]


@inner
def height_over(hull, face, points, i):
    """Return how far a point is beyond a face."""
    plane = hull.planes[face]
    return plane[0] * points[i, 0] + plane[1] * points[i, 1] + plane[2] * points[i, 2] - plane[3]


@inner
def add_face(points, hull, face, a, b, c):
    """Make a face without any points beyond; one without an area sees nothing."""
    ux, uy, uz = (
        points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
    )  # fmt: skip
    vx, vy, vz = (
        points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
    )  # fmt: skip
    x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = (x * x + y * y + z * z) ** 0.5
    scale = 1.0 / length if length > 0.0 else 0.0
    plane = hull.planes[face]
    plane[0], plane[1], plane[2] = scale * x, scale * y, scale * z
    plane[3] = plane[0] * points[a, 0] + plane[1] * points[a, 1] + plane[2] * points[a, 2]
    hull.corners[face, 0], hull.corners[face, 1], hull.corners[face, 2] = a, b, c
    hull.heights[face], hull.farthest[face], hull.first[face] = 0.0, NOBODY, NOBODY


@inner
def give_to_farthest(points, hull, begin, end, i):
    """Put a point into the list of the face it is farthest beyond, of those in a range."""
    best, owner = BEYOND, NOBODY
    for face in range(begin, end):
        height = height_over(hull, face, points, i)
        if height > best:
            best, owner = height, face
    if owner == NOBODY:
        return  # it is inside now
    hull.next[i], hull.first[owner] = hull.first[owner], i
    if best > hull.heights[owner]:
        hull.heights[owner], hull.farthest[owner] = best, i


@kernel
def begin_hull(points, hull, a, b, c, d):
    """Make the tetrahedron, and share out all points; return the number of faces."""
    add_face(points, hull, 0, a, b, c)
    add_face(points, hull, 1, a, c, d)
    add_face(points, hull, 2, c, b, d)
    add_face(points, hull, 3, b, a, d)
    for i in range(len(points)):
        give_to_farthest(points, hull, 0, 4, i)
    return 4


@kernel
def grow_hull(points, hull, count, most):
    """Take in the farthest point, `most` times at most.

    Return how many faces there are, and how many points were taken in: fewer if it is the hull.
    """
    taken = 0
    while taken < most and count + 64 <= len(hull.corners):
        face = 0
        for other in range(1, count):
            if hull.heights[other] > hull.heights[face]:
                face = other
        if not hull.heights[face] > 0.0:
            break
        count = take_in(points, hull, count, hull.farthest[face])
        taken += 1
    return count, taken


@inner
def take_in(points, hull, count, point):
    """Make the hull reach to a point; return the number of faces then."""
    n_edges, orphan = 0, NOBODY
    face = 0
    while face < count:
        if not height_over(hull, face, points, point) > BEYOND:
            face += 1
            continue
        # It is seen, and gone. An edge whose other side is seen as well is not on the horizon.
        for k in range(3):
            a, b = hull.corners[face, k], hull.corners[face, (k + 1) % 3]
            n_edges = toggle_edge(hull.edges, n_edges, a, b)
        i = hull.first[face]
        while i != NOBODY:
            after = hull.next[i]
            hull.next[i], orphan = orphan, i
            i = after
        count -= 1
        move_face(hull, count, face)
    n_edges = min(n_edges, len(hull.corners) - count)
    for k in range(n_edges):
        add_face(points, hull, count + k, hull.edges[k, 0], hull.edges[k, 1], point)
    while orphan != NOBODY:
        after = hull.next[orphan]
        give_to_farthest(points, hull, count, count + n_edges, orphan)
        orphan = after
    return count + n_edges


@inner
def toggle_edge(edges, n_edges, a, b):
    """Add the edge from a to b, or remove that from b to a; return how many there are then."""
    for k in range(n_edges):
        if edges[k, 0] == b and edges[k, 1] == a:
            edges[k, 0], edges[k, 1] = edges[n_edges - 1, 0], edges[n_edges - 1, 1]
            return n_edges - 1
    edges[n_edges, 0], edges[n_edges, 1] = a, b
    return n_edges + 1


@inner
def move_face(hull, old, new):
    """Give a face another number."""
    for k in range(3):
        hull.corners[new, k] = hull.corners[old, k]
    for k in range(4):
        hull.planes[new, k] = hull.planes[old, k]
    hull.heights[new], hull.farthest[new] = hull.heights[old], hull.farthest[old]
    hull.first[new] = hull.first[old]
