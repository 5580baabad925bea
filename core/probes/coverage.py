"""How much of a cone or a pyramid each triangle covers.

Which items it meets is asked of a structure, by the one walk that rays take; what they cover of it
is then a matter of a plane: seen along its axis and scaled by its half-widths, a cone is the unit
circle, elliptic or not, and a pyramid the square around that. The triangles are taken out of the
square from front to back, as out of a beam's cross section (:mod:`.visible`), and what of a piece
lies in the circle has a closed form. So shares are exact: nothing is counted twice where triangles
lie behind each other, nor lost where they meet.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contract.structure import Structure
from ..geometry.cones import SQUARE, Spread
from ..geometry.rays import Rays
from ..structures.bsp import SHELL
from ..structures.bsp.storage import BspArrays
from .beam import EVERYWHERE, Beam, with_apex
from .polygonal import Convex, planes_of
from .visible import MISS, Pieces, seen_in

UNIT_SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


class Coverage(NamedTuple):
    """What a cone or a pyramid sees.

    Attributes
    ----------
    items : (k,) int64
        Ascending, only those that are seen.
    shares : (k,) float64
        Share of the cross section that each covers; all together 1 at most.
    """

    items: np.ndarray
    shares: np.ndarray


class Triangular:
    """The triangles of a structure, some of which are to be looked at.

    Parameters
    ----------
    structure : Structure
        Over triangles, that cones go through.

    Raises
    ------
    InputError
        If there are other items.
    """

    def __init__(self, structure: Structure) -> None:
        self.structure, self.corners = structure, structure.scene.triangles
        count = len(self.corners)
        self.planes = planes_of(
            self.corners.reshape(-1, 3), 3 * np.arange(count), np.full(count, 3)
        )
        self.reach = float(np.abs([structure.scene.lower, structure.scene.upper]).max())

    def pieces(self, items: np.ndarray, beam: Beam) -> Pieces:
        """Return what a beam sees of some triangles, (k,) int, in no order."""
        count, corners = len(items), np.ascontiguousarray(self.corners[items])
        # A tree of one leaf.
        tree = BspArrays(
            np.zeros(6), np.zeros((1, 4)), np.full(1, -1, np.int32), SHELL * self.reach,
            np.array([0, count]), np.arange(count, dtype=np.int32),
        )  # fmt: skip
        convex = Convex(
            self.planes[items], corners, np.asarray(items, np.int64), corners.reshape(-1, 3),
            3 * np.arange(count + 1),
        )  # fmt: skip
        return seen_in(tree, 0, convex, beam, self.reach)

    def coverage(self, rays: Rays, index: int, spread: Spread) -> Coverage:
        """Return how much each triangle covers of the cone, or pyramid, around a ray.

        Raises
        ------
        InputError
            If the spread is none, or the structure takes no cones.
        """
        items, _ = self.structure.cover(rays, index, spread)
        if not len(items):
            return Coverage(np.empty(0, np.int64), np.empty(0))
        pieces = self.pieces(items, beam_around(rays, index, spread))
        areas = pieces.areas if spread.shape == SQUARE else areas_in_circle(pieces)
        seen = pieces.items != MISS
        found, places = np.unique(pieces.items[seen], return_inverse=True)
        whole = 4.0 if spread.shape == SQUARE else np.pi
        shares = np.bincount(places, weights=areas[seen], minlength=len(found)) / whole
        return Coverage(found[shares > 0.0], shares[shares > 0.0])


def beam_around(rays: Rays, index: int, spread: Spread) -> Beam:
    """Return the beam of a pyramid, or of that around a cone: its cross section is the square."""
    directions = rays.directions[index : index + 1]
    (across,), (above,) = spread.axes(directions)
    wide, high = spread.half_widths()
    length = float(np.linalg.norm(directions[0]))
    axis, apex = directions[0] / length, rays.origins[index]
    bounds = [EVERYWHERE]
    for t, sign in ((rays.t_min[index], 1.0), (rays.t_max[index], -1.0)):
        if 0.0 < t < np.inf:
            bounds.append(sign * np.append(axis, axis @ apex + t * length)[None])
    linear = np.array([across / wide, above / high, axis])
    return Beam(with_apex(linear, apex), (UNIT_SQUARE,), np.concatenate(bounds))


def areas_in_circle(pieces: Pieces) -> np.ndarray:
    """Return the areas of what of pieces lies in the unit circle, (k,).

    Summed over their edges: of the triangle from the centre to an edge, what is in the circle is a
    triangle where the edge is inside, and a sector where it is not.
    """
    points, offsets = pieces.points, pieces.offsets
    after = np.arange(1, len(points) + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    a, b = points, points[after]
    d = b - a
    # Where the line of an edge is in the circle: |a + s d| <= 1.
    square = np.maximum((d * d).sum(axis=1), 1e-300)
    along = (a * d).sum(axis=1)
    room = along * along - square * ((a * a).sum(axis=1) - 1.0)
    root = np.sqrt(np.maximum(room, 0.0))
    begin = np.clip((-along - root) / square, 0.0, 1.0)
    end = np.clip((-along + root) / square, 0.0, 1.0)
    p, q = a + begin[:, None] * d, a + end[:, None] * d
    is_in = (room > 0.0) & (begin < end)
    inside = 0.5 * cross(p, q)
    parts = np.where(is_in, sector(a, p) + inside + sector(q, b), sector(a, b))
    areas: np.ndarray = np.add.reduceat(parts, offsets[:-1])
    return areas


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross products of vectors in the plane, (n, 2) to (n,)."""
    product: np.ndarray = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return product


def sector(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the areas of the unit circle's sectors from one direction to another."""
    angle: np.ndarray = np.arctan2(cross(a, b), (a * b).sum(axis=1))
    return 0.5 * angle
