"""What a beam sees: its cross section in pieces, found from front to back.

The leaves of the BSP tree are visited in the order in which a ray from the apex would pass them:
at each plane first the side of the apex, then the other one, if the beam reaches it. In a leaf,
what each polygon covers is taken out of what is still free of the cross section (:mod:`.clipping`);
where nothing is free any more, the beam ends. So every piece is computed once, and nothing that is
hidden is clipped at all.

Most leaves hold one polygon. Where there are several, which no plane parted, the nearer one is seen
at every point: along a line from the apex, 1 / z of a plane is linear in x and y, so two of them
are equally far along a line in the cross section, and that is one more line to cut at. Of two
in one plane the one with the lower number is seen, as among rays that hit both at equal t.

A polygon whose plane passes through the apex is seen edge-on and covers nothing.

P. Heckbert, P. Hanrahan: Beam Tracing Polygonal Objects, SIGGRAPH 1984. K. Weiler, P. Atherton:
Hidden Surface Removal Using Polygon Area Sorting, SIGGRAPH 1977.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel, whole
from ..memory import refuse_if_too_large
from ..structures.bsp.storage import BspArrays
from .beam import Beam
from .clipping import CLOSED, FREE, OPEN, Room, make_room, take
from .polygonal import Convex, Polygonal

MISS = -1
"""Item of a piece in which nothing is seen."""

SHARP = 2.0**-46
"""Width below which nothing is cut off a region, relative to the coordinates of the cross section:
some units in the last place."""

EDGE_ON = 2.0**-44
"""Distance from a plane within which an apex lies in it, relative to the coordinates."""

PARALLEL = 1e-12
"""How much of a beam may seem to lie beyond a plane that it does not reach."""

DONE, LACKING = 0, 1


class Looking(NamedTuple):
    """A beam inside kernels.

    Attributes
    ----------
    matrix : (3, 4) float64
    apex : (3,) float64
    directions : (d, 3) float64
        Of the corners of the cross section, in the scene; of unit length.
    bounds : (k, 4) float64
        Half-spaces in which the beam is.
    planes : (n, 4) float64
        Those of all polygons, in the beam's space; at position 0 what is seen edge-on.
    shell : float
        Distance in the scene within which a point counts as on a plane.
    width : float
        The same in the cross section.
    """

    matrix: np.ndarray
    apex: np.ndarray
    directions: np.ndarray
    bounds: np.ndarray
    planes: np.ndarray
    shell: float
    width: float


class Pieces(NamedTuple):
    """The pieces of a beam's cross section.

    Attributes
    ----------
    points : (m, 2) float64
    offsets : (k + 1,) int64
        Piece i has ``points[offsets[i]:offsets[i + 1]]``, once around; all are convex.
    items : (k,) int64
        What is seen in each, as the scene numbers it; MISS for nothing.
    polygons : (k,) int64
        The convex polygon that it is, FREE for none.
    areas : (k,) float64
        They add up to that of the cross section.
    """

    points: np.ndarray
    offsets: np.ndarray
    items: np.ndarray
    polygons: np.ndarray
    areas: np.ndarray

    def corners(self, piece: int) -> np.ndarray:
        """Return the corners of a piece, (n, 2)."""
        corners: np.ndarray = self.points[self.offsets[piece] : self.offsets[piece + 1]]
        return corners

    def of(self, items: np.ndarray | int) -> np.ndarray:
        """Return the numbers of the pieces in which some items are seen."""
        return np.flatnonzero(np.isin(self.items, items))


@inner
def cut_off(corners, row, size, bound, shell):
    """Cut what is below a plane off a polygon; return how many corners are left in the other row.

    Of what lies in the plane, or touches it from below, nothing is left.
    """
    kept, crossings, is_above, last = 0, 0, False, size - 1
    h = 0.0
    for axis in range(3):
        h += bound[axis] * corners[row, last, axis]
    before = h - bound[3] if abs(h - bound[3]) > shell else 0.0
    for i in range(size):
        h = 0.0
        for axis in range(3):
            h += bound[axis] * corners[row, i, axis]
        here = h - bound[3] if abs(h - bound[3]) > shell else 0.0
        is_above = is_above or here > 0.0
        if (here < 0.0 < before or before < 0.0 < here) and crossings < 2:
            crossings += 1
            share = before / (before - here)
            for axis in range(3):
                start = corners[row, last, axis]
                corners[1 - row, kept, axis] = start + share * (corners[row, i, axis] - start)
            kept += 1
        if here >= 0.0:
            for axis in range(3):
                corners[1 - row, kept, axis] = corners[row, i, axis]
            kept += 1
        last, before = i, here
    return kept if is_above else 0


@inner
def fetch(convex, entry, looking, room):
    """Write the part of a polygon that is where the beam is, in its space; return row and size."""
    corners, first = room.corners, convex.offsets[entry]
    row, size = 0, convex.offsets[entry + 1] - first
    for i in range(size):
        for axis in range(3):
            corners[0, i, axis] = convex.points[first + i, axis]
    for n in range(len(looking.bounds)):
        if size > 0:
            size = cut_off(corners, row, size, looking.bounds[n], looking.shell)
            row = 1 - row
    m = looking.matrix
    for i in range(size):
        x, y, z = corners[row, i, 0], corners[row, i, 1], corners[row, i, 2]
        for axis in range(3):
            moved = m[axis, 0] * x + m[axis, 1] * y + m[axis, 2] * z + m[axis, 3]
            corners[row, i, axis] = moved
    return row, size


@inner
def write_line(lines, place, x, y, z):
    """Write a line of the cross section, seen from the apex; False if it is none."""
    norm = (x * x + y * y) ** 0.5
    if norm > 1e-200 * abs(z):
        lines[place, 0], lines[place, 1], lines[place, 2] = x / norm, y / norm, z / norm
        return True
    # It is infinitely far away: all that is seen is on one side of it.
    lines[place, 0], lines[place, 1] = 0.0, 0.0
    lines[place, 2] = 1.0 if z > 0.0 else -1.0
    return z != 0.0


@inner
def outline(room, row, size, plane):
    """Write the lines around what a polygon covers; return how many.

    Each is a plane through the apex and an edge. They bound the cone of all directions in which
    the polygon lies, wherever its corners are, if the apex is not in its plane.
    """
    corners, count = room.corners, 0
    turn = 1.0 if plane[3] > 0.0 else -1.0
    ax, ay, az = corners[row, size - 1, 0], corners[row, size - 1, 1], corners[row, size - 1, 2]
    for i in range(size):
        bx, by, bz = corners[row, i, 0], corners[row, i, 1], corners[row, i, 2]
        x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
        if write_line(room.lines, count, turn * x, turn * y, turn * z):
            count += 1
        ax, ay, az = bx, by, bz
    return count


@inner
def are_in_one_plane(convex, first, second, shell):
    """Say whether two polygons lie in one plane."""
    of_first, of_second = True, True
    a, b = convex.planes[first], convex.planes[second]
    for k in range(3):
        p, q = convex.facets[first, k], convex.facets[second, k]
        h = b[0] * p[0] + b[1] * p[1] + b[2] * p[2] - b[3]
        of_second = of_second and abs(h) <= shell
        h = a[0] * q[0] + a[1] * q[1] + a[2] * q[2] - a[3]
        of_first = of_first and abs(h) <= shell
    # The plane of the larger one is known better.
    return of_first or of_second


@inner
def show(convex, polygon, entry, looking, room):
    """Give a polygon what it covers of the regions that are open; False if room is lacking."""
    plane = looking.planes[polygon]
    if plane[3] == 0.0:
        return True
    row, size = fetch(convex, entry, looking, room)
    if size < 3:
        return True
    n_lines = outline(room, row, size, plane)
    for place in range(room.used[OPEN]):
        region = room.open[place]
        other, lines = room.owner[region], n_lines
        if other == polygon:
            continue
        if other != FREE:
            if are_in_one_plane(convex, polygon, other, looking.shell):
                if convex.items[other] <= convex.items[polygon]:
                    continue
            else:
                # Where 1 / z of this plane is larger than that of the other.
                beyond = looking.planes[other]
                if not write_line(
                    room.lines, n_lines,
                    plane[0] / plane[3] - beyond[0] / beyond[3],
                    plane[1] / plane[3] - beyond[1] / beyond[3],
                    plane[2] / plane[3] - beyond[2] / beyond[3],
                ):  # fmt: skip
                    continue
                lines = n_lines + 1
        if not take(room, region, lines, polygon, looking.width):
            return False
    return True


@inner
def close(room):
    """Close the regions in which something is seen: what comes later is behind it."""
    used, kept = room.used, 0
    for place in range(used[OPEN]):
        region = room.open[place]
        if room.owner[region] == FREE:
            room.open[kept] = region
            kept += 1
        else:
            room.closed[used[CLOSED]] = region
            used[CLOSED] += 1
    used[OPEN] = kept


@inner
def reaches(looking, plane, sign):
    """Say whether some of a beam goes up through a plane, or down with sign -1."""
    for i in range(len(looking.directions)):
        d = looking.directions[i]
        if sign * (plane[0] * d[0] + plane[1] * d[1] + plane[2] * d[2]) > -PARALLEL:
            return True
    return False


@kernel
def look(tree, convex, looking, room):
    """Visit the leaves from front to back; return DONE, or LACKING if there is no room.

    Parameters
    ----------
    tree : BspArrays
    convex : Convex
    looking : Looking
    room : Room
        All that is open is free.
    """
    stack, apex = room.stack, looking.apex
    stack[0], height = 0, 1
    while height > 0 and room.used[OPEN] > 0:
        height -= 1
        node = stack[height]
        left = whole(tree.link[node])
        if left < 0:
            leaf = -1 - left
            for entry in range(tree.offsets[leaf], tree.offsets[leaf + 1]):
                polygon = whole(tree.references[entry])
                if not show(convex, polygon, entry, looking, room):
                    return LACKING
            if tree.offsets[leaf] < tree.offsets[leaf + 1]:
                close(room)
            continue
        plane = tree.planes[node]
        above = plane[0] * apex[0] + plane[1] * apex[1] + plane[2] * apex[2] > plane[3]
        near, far = (left + 1, left) if above else (left, left + 1)
        if reaches(looking, plane, -1.0 if above else 1.0):
            stack[height] = far
            height += 1
        stack[height] = near
        height += 1
    return DONE


def visible(scene: Polygonal, beam: Beam) -> Pieces:
    """Return what a beam sees: the pieces of its cross section.

    Those in which nothing is seen come last; the others in the order from front to back.

    Raises
    ------
    InputError
        If there are more pieces than fit into memory.
    """
    tree = scene.tree.arrays.tree
    reach = float(np.abs([scene.scene.lower, scene.scene.upper]).max())
    return seen_in(tree, int(scene.tree.grown.depth.max()), scene.convex, beam, reach)


def seen_in(tree: BspArrays, levels: int, convex: Convex, beam: Beam, reach: float) -> Pieces:
    """Return the pieces of a beam; parameters beside those of :func:`visible`.

    Parameters
    ----------
    levels : int
        Of the tree.
    reach : float
        The largest coordinate of what it holds.
    """
    corners = np.concatenate(beam.windows)
    directions = beam.directions(corners)
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    apex, planes = beam.apex, beam.plane_seen(convex.planes)
    heights = convex.planes[:, :3] @ apex - convex.planes[:, 3]
    planes[np.abs(heights) <= EDGE_ON * max(reach, float(np.abs(apex).max())), 3] = 0.0
    looking = Looking(
        np.ascontiguousarray(beam.matrix), apex, directions, np.array(beam.bounds), planes,
        tree.shell, SHARP * max(1.0, float(np.abs(corners).max())),
    )  # fmt: skip
    largest = int(np.diff(convex.offsets).max(initial=0)) + len(beam.bounds) + 2
    n_regions = 4 * len(convex.items) + 4 * len(beam.windows)
    while True:
        refuse_if_too_large(
            n_regions * 300, "the pieces of a beam", "choose a narrower beam or a smaller scene"
        )
        room = make_room(n_regions, 16 * n_regions, largest, levels, list(beam.windows))
        if call(look, tree, convex, looking, room) == DONE:
            return pieces_of(room, convex.items)
        n_regions *= 4


def pieces_of(room: Room, items: np.ndarray) -> Pieces:
    """Return the regions that are left when a beam has ended."""
    regions = np.concatenate([room.closed[: room.used[CLOSED]], room.open[: room.used[OPEN]]])
    polygons, sizes = room.owner[regions], room.size[regions]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    place = np.repeat(room.start[regions] - offsets[:-1], sizes) + np.arange(offsets[-1])
    points = room.points[place]
    seen = np.full(len(polygons), MISS, np.int64)
    seen[polygons != FREE] = items[polygons[polygons != FREE]]
    return Pieces(points, offsets, seen, polygons, areas_of(points, offsets))


def areas_of(points: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Return the areas of polygons, (k,), each reckoned from its first corner."""
    sizes = np.diff(offsets)
    begins = np.repeat(offsets[:-1], sizes)
    after = np.arange(1, len(points) + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    here, there = points - points[begins], points[after] - points[begins]
    crossed = here[:, 0] * there[:, 1] - here[:, 1] * there[:, 0]
    return 0.5 * np.add.reduceat(crossed, offsets[:-1]) if len(sizes) else np.zeros(0)
