"""How much of a cone or a pyramid each triangle, or sphere, covers.

Which items it meets is asked of a structure, by the one walk that rays take; what they cover of it
is then a matter of a plane: seen along its axis and scaled by its half-widths, a cone is the unit
circle, elliptic or not, and a pyramid the square around that. The triangles are taken out of the
square from front to back, as out of a beam's cross section (:mod:`.visible`), and what of a piece
lies in the circle has a closed form. So shares are exact: nothing is counted twice where triangles
lie behind each other, nor lost where they meet.

What a sphere covers by itself has a closed form as well (:mod:`.lens`), but is no polygon to be
taken out of others. Spheres are *composited* with what is seen beside them, from front to back, as
Amanatides has it: each hides of all behind it the share that it covers of the cone, as if one lay
anywhere before the other. Of a sphere alone that is exact. One around the apex is seen from
inside: it covers all, behind what is within it. What of a sphere lies beyond the cone's ends
counts as well.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.cones import SQUARE, Spread
from ..geometry.cones.sphere import are_spheres
from ..geometry.rays import Rays
from ..geometry.solids.mixed import CENTRE, Mixed
from ..structures.bsp import SHELL
from ..structures.bsp.storage import BspArrays
from .beam import EVERYWHERE, Beam, with_apex
from .lens import share_of_sphere
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


class Covering:
    """The triangles and spheres of a structure, some of which are to be looked at.

    Parameters
    ----------
    structure : Structure
        Over triangles, or triangles and spheres, that cones go through.

    Attributes
    ----------
    planes : (n, 4) float64
        Of the triangles; 0 of spheres.
    centres : (n, 3) float64
    radii : (n,) float64
        0 of triangles.

    Raises
    ------
    InputError
        If there are other items.
    """

    def __init__(self, structure: Structure) -> None:
        self.structure, geometry = structure, structure.scene.geometry
        count = len(structure.scene)
        self.centres, self.radii = np.zeros((count, 3)), np.zeros(count)
        if isinstance(geometry, Mixed):
            structure.refuse_cones(Spread(0.5))
            self.corners = np.ascontiguousarray(geometry.rows[:, :3])
            spheres = are_spheres(geometry)
            self.corners[spheres] = 0.0
            self.centres[spheres] = geometry.rows[spheres, CENTRE]
            half_axes = geometry.points[geometry.first[spheres]]
            self.radii[spheres] = np.linalg.norm(half_axes, axis=1)
        else:
            self.corners = structure.scene.triangles
        self.planes = planes_of(
            self.corners.reshape(-1, 3), 3 * np.arange(count), np.full(count, 3)
        )
        self.reach = float(np.abs([structure.scene.lower, structure.scene.upper]).max())

    @property
    def middles(self) -> np.ndarray:
        """Points in the middle of the items, (n, 3)."""
        return np.where(self.radii[:, None] > 0.0, self.centres, self.corners.mean(axis=1))

    def facing(
        self, spheres: np.ndarray, apex: np.ndarray, direction: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return planes, (k, 4), and points, (k, 3), of spheres where a ray hits them.

        If it passes by, where it is nearest.
        """
        centres, radii = self.centres[spheres], self.radii[spheres]
        unit = direction / np.linalg.norm(direction)
        along = np.maximum((centres - apex) @ unit, 0.0)
        aside = apex + along[:, None] * unit - centres
        inward = np.maximum(radii**2 - (aside**2).sum(axis=1), 0.0)
        normals = aside - np.sqrt(inward)[:, None] * unit
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        points = centres + radii[:, None] * normals
        return np.column_stack([normals, (normals * points).sum(axis=1)]), points

    def pieces(self, items: np.ndarray, beam: Beam) -> Pieces:
        """Return what a beam sees of some triangles, (k,) int, in no order.

        Raises
        ------
        InputError
            If a sphere is among them.
        """
        if self.radii[items].any():
            raise InputError("beams meet polygons only, and there are spheres; make them triangles")
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
        """Return how much each item covers of the cone, or pyramid, around a ray.

        Raises
        ------
        InputError
            If the spread is none, or the structure takes no cones, or there are spheres and it is
            no round cone.
        """
        items, _ = self.structure.cover(rays, index, spread)
        if not len(items):
            return Coverage(np.empty(0, np.int64), np.empty(0))
        is_sphere = self.radii[items] > 0.0
        flat, spheres = items[~is_sphere], items[is_sphere]
        found, parts, depths = np.empty(0, np.int64), np.empty(0), np.empty(0)
        if len(flat):
            pieces = self.pieces(flat, beam_around(rays, index, spread))
            areas = pieces.areas if spread.shape == SQUARE else areas_in_circle(pieces)
            seen = pieces.items != MISS
            found = pieces.items[seen]
            parts = areas[seen] / (4.0 if spread.shape == SQUARE else np.pi)
            if len(spheres):
                depths = self.depths_of(pieces, rays, index, spread)[seen]
        if len(spheres):
            found, parts = self.composited(
                found, parts, depths, spheres, rays, index, spread.half_widths()[0]
            )
        found, places = np.unique(found, return_inverse=True)
        shares = np.bincount(places, weights=parts, minlength=len(found))
        return Coverage(found[shares > 0.0], shares[shares > 0.0])

    def depths_of(self, pieces: Pieces, rays: Rays, index: int, spread: Spread) -> np.ndarray:
        """Return how far along the axis the middles of pieces are, (k,); anything where none is."""
        ((across,), (above,)), (wide, high) = (
            spread.axes(rays.directions[index : index + 1]), spread.half_widths()
        )  # fmt: skip
        counts = np.diff(pieces.offsets)
        middles = np.add.reduceat(pieces.points, pieces.offsets[:-1]) / counts[:, None]
        axis = rays.directions[index] / np.linalg.norm(rays.directions[index])
        ways = axis + np.outer(middles[:, 0], wide * across) + np.outer(middles[:, 1], high * above)
        planes = self.planes[np.maximum(pieces.items, 0)]
        with np.errstate(divide="ignore", invalid="ignore"):
            depths: np.ndarray = (planes[:, 3] - planes[:, :3] @ rays.origins[index]) / (
                planes[:, :3] * ways
            ).sum(axis=1)
        return depths

    def composited(
        self, found: np.ndarray, parts: np.ndarray, depths: np.ndarray, spheres: np.ndarray,
        rays: Rays, index: int, slope: float,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Return items and their shares, from front to back, of pieces and spheres together.

        What of the pieces is nearer adds up, being beside each other; what of the spheres is
        nearer leaves the product of what each leaves free.

        Parameters
        ----------
        found, parts, depths : (k,)
            Of the pieces: their items, shares, and how far along the axis they are.
        spheres : (m,) int
        slope : float
            Of the cone.
        """
        axis = rays.directions[index] / np.linalg.norm(rays.directions[index])
        seen = self.centres[spheres] - rays.origins[index]
        along = seen @ axis
        across = np.linalg.norm(seen - along[:, None] * axis, axis=1)
        radii = self.radii[spheres]
        alone = np.array(
            [share_of_sphere(a, w, r, slope) for a, w, r in zip(along, across, radii, strict=True)]
        )
        items, shares = np.append(found, spheres), np.append(parts, alone)
        is_sphere = np.arange(len(items)) >= len(found)
        # From inside the far side is seen.
        is_within = (seen**2).sum(axis=1) <= radii**2
        fronts = along + np.where(is_within, radii, -radii)
        order = np.lexsort([items, np.append(depths, fronts)])
        items, shares, is_sphere = items[order], shares[order], is_sphere[order]
        left_by_spheres = np.cumprod(np.where(is_sphere, 1.0 - shares, 1.0))
        left_by_pieces = 1.0 - np.cumsum(np.where(is_sphere, 0.0, shares))
        before = np.append(1.0, left_by_spheres[:-1])
        return items, shares * before * np.where(is_sphere, left_by_pieces, 1.0)


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
