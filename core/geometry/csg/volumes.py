"""What cutting has to know of a kind of volume: the bounds of leaves, of what two nodes have
together, and of what they share.

Of boxes and k-DOPs the last is exact: strip by strip, the wider or the narrower of both. Two balls
share a lens, around which there is a smallest ball. Of two oriented boxes the smaller one stays,
unless one of their axes separates them.

Bounds are exact as far as they are written here. Rays are tested with what is larger by a *margin*,
a ten-millionth of the largest coordinate; and only what is further apart than that shares nothing.
So whatever is rounded on the way of a ray from up to a million scene sizes away, cutting changes
no hit.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...kernels import call, kernel
from ...progress import SILENT, Progress
from ..box import Boxes
from ..fit import fit_all
from ..geometry import hulls_of, support
from ..half_spaces import every_other, faces_of, measured
from ..kdop import DIRECTIONS, KDOPs
from ..obb import HIGH, LOW, OBBs
from ..polygons import Polygons, sides_of
from ..solids.mixed import SPHERE, Mixed
from ..sphere import Spheres
from .trees import HALF_SPACE, MESH, SOLID, UNION, Csg

MARGIN = 2.0**-23
"""By how much bounds are enlarged, relative to the largest coordinate: 64 eps, the slack of rays,
times three coordinates of two million scene sizes."""


def margin_of(geometry: Csg) -> float:
    """Return by how much the bounds of a geometry's nodes are enlarged."""
    largest = [np.abs(geometry.solids.boxes).max(initial=0.0)]
    largest += [np.abs(geometry.corners).max(initial=0.0), geometry.reach.max()]
    return MARGIN * float(max(largest))


@kernel
def write_supports(solids, directions, out):
    """Write how far every solid extends along directions: the least and the largest n . p."""
    for i in range(out.shape[0]):
        for strip in range(out.shape[2]):
            x, y, z = directions[strip, 0], directions[strip, 1], directions[strip, 2]
            px, py, pz = support(solids, i, -x, -y, -z)
            qx, qy, qz = support(solids, i, x, y, z)
            out[i, 0, strip] = px * x + py * y + pz * z
            out[i, 1, strip] = qx * x + qy * y + qz * z


class Strips:
    """Boxes and k-DOPs: rows are (2, k / 2), the low and the high bound of every strip."""

    is_exact = True
    """Whether what two bounds share is written down exactly."""

    def __init__(self, k: int) -> None:
        self.directions = np.array(DIRECTIONS[k], dtype=np.float64)
        self._steps = np.abs(self.directions).sum(axis=1)

    def of_leaves(self, geometry: Csg) -> np.ndarray:
        """Return the rows of all nodes; only those of leaves are meant."""
        nodes, directions = geometry.nodes, self.directions
        rows = np.full((len(nodes.kind), 2, len(directions)), np.nan)
        rows[:, 0], rows[:, 1] = -np.inf, np.inf
        which = nodes.kind == SOLID
        rows[which] = self._of_solids(geometry.solids)[nodes.leaf[which]]
        for node in np.flatnonzero(nodes.kind == MESH):
            first, last = geometry.mesh_first[nodes.leaf[node] :][:2]
            along = geometry.corners[first:last].reshape(-1, 3) @ directions.T
            rows[node] = along.min(axis=0), along.max(axis=0)
        for node in np.flatnonzero(nodes.kind == HALF_SPACE):
            *normal, height = geometry.half_spaces[nodes.leaf[node]]
            for strip, direction in enumerate(directions):
                length = float(direction @ direction) ** 0.5
                cosine = float(direction @ normal) / length
                if abs(cosine) >= 1.0 - 1e-15:  # an axis has no rounding at all
                    rows[node, int(cosine > 0.0), strip] = np.sign(cosine) * height * length
        return rows

    def _of_solids(self, solids: Mixed) -> np.ndarray:
        rows = np.empty((len(solids.ids), 2, len(self.directions)))
        # Along the axes the boxes are there, rounded outward.
        rows[:, :, :3] = solids.boxes.reshape(-1, 2, 3)
        if len(self.directions) > 3 and len(rows):
            strips = np.empty((len(rows), 2, len(self.directions) - 3))
            call(write_supports, solids, np.ascontiguousarray(self.directions[3:]), strips)
            rows[:, :, 3:] = strips
        return rows

    def together(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return rows around pairs."""
        return np.stack([np.minimum(a[:, 0], b[:, 0]), np.maximum(a[:, 1], b[:, 1])], axis=1)

    def shared(self, a: np.ndarray, b: np.ndarray, margin: float) -> np.ndarray:
        """Return rows around what pairs share."""
        return np.stack([np.maximum(a[:, 0], b[:, 0]), np.minimum(a[:, 1], b[:, 1])], axis=1)

    def is_empty(self, rows: np.ndarray, margin: float) -> np.ndarray:
        """Say which rows have nothing inside, (n,) bool."""
        return (rows[:, 0] > rows[:, 1] + 2.0 * margin * self._steps).any(axis=1)

    def is_finite(self, rows: np.ndarray) -> np.ndarray:
        """Say which rows bound something, (n,) bool."""
        return np.isfinite(rows).any(axis=(1, 2))

    def holds(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Say of pairs whether the one surely holds the other, (n,) bool."""
        return ((a[:, 0] <= b[:, 0]) & (a[:, 1] >= b[:, 1])).all(axis=1)

    def volumes(self, rows: np.ndarray, margin: float) -> Any:
        """Return rows as volumes, each enlarged by a margin."""
        low, high = rows[:, 0] - margin * self._steps, rows[:, 1] + margin * self._steps
        if len(self.directions) == 3:
            return Boxes(np.ascontiguousarray(np.hstack([low, high])))
        both = np.stack([low, high], axis=2).reshape(len(rows), -1)
        return KDOPs(np.ascontiguousarray(both), self.directions)

    def exactly(self, rows: np.ndarray) -> Any:
        """Return finite rows as volumes to be measured and drawn."""
        volumes = self.volumes(rows, 0.0)
        return volumes if isinstance(volumes, Boxes) else CutKDOPs(volumes)


class CutKDOPs(NamedTuple):
    """k-DOPs of which some half-spaces may have no face, as those have that were cut.

    What :class:`..kdop.KDOPs` measures and draws are such as fit tightly around something.
    """

    volumes: KDOPs

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6)."""
        return self.volumes.boxes()

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return some as half-spaces, (m, k, 4)."""
        return self.volumes.half_spaces(numbers)

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face: all others."""
        return every_other(self.volumes.k)

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,)."""
        return measured(self, progress)[0]

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,)."""
        return measured(self)[1]

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the faces of some; the owner of a face is its place in `numbers`."""
        return faces_of(self, numbers, progress)


class Balls:
    """Spheres: rows are centre and radius; of what is empty the radius is negative."""

    is_exact = False

    def of_leaves(self, geometry: Csg) -> np.ndarray:
        """Return the rows of all nodes; only those of leaves are meant."""
        nodes, solids = geometry.nodes, geometry.solids
        rows = np.tile([0.0, 0.0, 0.0, np.inf], (len(nodes.kind), 1))
        leaves, corners, offsets = hulls_of_leaves(geometry)
        rows[leaves] = fit_all("smallest_sphere", corners, offsets[:-1], offsets[1:], SILENT).rows
        for node in leaves[nodes.kind[leaves] == SOLID]:
            i = nodes.leaf[node]
            if solids.kinds[i] == SPHERE:  # tighter than its hull, if no matrix has stretched it
                middle = solids.boxes[i].reshape(2, 3).mean(axis=0)
                half_axes = solids.points[solids.first[i] : solids.first[i] + 3]
                radius = float(np.linalg.norm(half_axes, 2)) * (1.0 + 1e-12)
                if radius < rows[node, 3]:
                    rows[node] = *middle, radius
        return rows

    def together(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return rows around pairs."""
        a, b = np.where((a[:, 3] >= b[:, 3])[:, None], (a, b), (b, a))
        distance = np.linalg.norm(b[:, :3] - a[:, :3], axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            radius = 0.5 * (distance + a[:, 3] + b[:, 3])
            step = (radius - a[:, 3]) / distance
            both = np.column_stack([a[:, :3] + step[:, None] * (b[:, :3] - a[:, :3]), radius])
            is_within = ~(distance + b[:, 3] > a[:, 3])
        return np.where((is_within | np.isinf(a[:, 3]))[:, None], a, both)

    def shared(self, a: np.ndarray, b: np.ndarray, margin: float) -> np.ndarray:
        """Return rows around what pairs share."""
        small, large = np.where((a[:, 3] <= b[:, 3])[:, None], (a, b), (b, a))
        away = large[:, :3] - small[:, :3]
        distance = np.linalg.norm(away, axis=1)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            # From the centre of the smaller one to the plane of the circle that both have.
            to_plane = 0.5 * (distance + (small[:, 3] ** 2 - large[:, 3] ** 2) / distance)
            radius = np.sqrt(np.maximum(small[:, 3] ** 2 - to_plane**2, 0.0))
            centre = small[:, :3] + (to_plane / distance)[:, None] * away
            is_lens = (to_plane > 0.0) & (to_plane < distance)
        rows = np.where(is_lens[:, None], np.column_stack([centre, radius]), small)
        is_apart = distance > small[:, 3] + large[:, 3] + 2.0 * margin
        rows[is_apart | (small[:, 3] < 0.0), 3] = -1.0
        return rows

    def is_empty(self, rows: np.ndarray, margin: float) -> np.ndarray:
        """Say which rows have nothing inside, (n,) bool."""
        return rows[:, 3] < 0.0

    def is_finite(self, rows: np.ndarray) -> np.ndarray:
        """Say which rows bound something, (n,) bool."""
        return np.isfinite(rows[:, 3])

    def holds(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Say of pairs whether the one surely holds the other, (n,) bool."""
        return (a == b).all(axis=1)

    def volumes(self, rows: np.ndarray, margin: float) -> Any:
        """Return rows as volumes, each enlarged by a margin."""
        rows = rows.copy()
        rows[:, 3] += margin
        return Spheres(rows)

    def exactly(self, rows: np.ndarray) -> Any:
        """Return finite rows as volumes to be measured and drawn."""
        return Spheres(rows)


class Oriented:
    """Oriented boxes: rows are those of :class:`..obb.OBBs`."""

    is_exact = False

    def of_leaves(self, geometry: Csg) -> np.ndarray:
        """Return the rows of all nodes; only those of leaves are meant."""
        everything = np.hstack([np.eye(3).ravel(), np.full(3, -np.inf), np.full(3, np.inf)])
        rows = np.tile(everything, (len(geometry.nodes.kind), 1))
        leaves, corners, offsets = hulls_of_leaves(geometry)
        rows[leaves] = fit_all("obb", corners, offsets[:-1], offsets[1:], SILENT).rows
        return rows

    def together(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Return rows around pairs."""
        rows = np.where(self.is_finite(a)[:, None], b, a)
        both = np.flatnonzero(self.is_finite(a) & self.is_finite(b))
        if len(both):
            sides = [sides_of(OBBs(each[both]).corners()).points for each in (a, b)]
            quads = np.concatenate([each.reshape(len(both), 6, 4, 3) for each in sides], axis=1)
            corners = np.concatenate([quads[:, :, [0, 1, 2]], quads[:, :, [2, 3, 0]]], axis=1)
            begin = 24 * np.arange(len(both))
            flat = np.ascontiguousarray(corners.reshape(-1, 3, 3))
            rows[both] = fit_all("obb", flat, begin, begin + 24, SILENT).rows
        return rows

    def shared(self, a: np.ndarray, b: np.ndarray, margin: float) -> np.ndarray:
        """Return rows around what pairs share."""
        finite = [self.is_finite(each) for each in (a, b)]
        with np.errstate(invalid="ignore"):
            sizes = [
                np.where(is_there, OBBs(each).contents(), np.inf)
                for is_there, each in zip(finite, (a, b), strict=True)
            ]
        rows = np.where((sizes[0] <= sizes[1])[:, None], a, b)
        both = finite[0] & finite[1]
        corners = [OBBs(np.where(both[:, None], each, 0.0)).corners() for each in (a, b)]
        for one, other in ((a, corners[1]), (b, corners[0])):
            along = np.einsum("nad,ncd->nca", OBBs(one).axes(), other)
            gap = np.maximum(
                along.min(axis=1) - one[:, HIGH:], one[:, LOW:HIGH] - along.max(axis=1)
            )
            rows[both & (gap > 4.0 * margin).any(axis=1), HIGH:] = -np.inf
        is_empty = self.is_empty(a, margin) | self.is_empty(b, margin)
        rows[is_empty, HIGH:] = -np.inf
        return rows

    def is_empty(self, rows: np.ndarray, margin: float) -> np.ndarray:
        """Say which rows have nothing inside, (n,) bool."""
        return np.isneginf(rows[:, HIGH])

    def is_finite(self, rows: np.ndarray) -> np.ndarray:
        """Say which rows bound something, (n,) bool."""
        return np.isfinite(rows).all(axis=1)

    def holds(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Say of pairs whether the one surely holds the other, (n,) bool."""
        return (a == b).all(axis=1)

    def volumes(self, rows: np.ndarray, margin: float) -> Any:
        """Return rows as volumes, each enlarged by a margin."""
        rows = rows.copy()
        rows[:, LOW:HIGH] -= margin
        rows[:, HIGH:] += margin
        return OBBs(rows)

    def exactly(self, rows: np.ndarray) -> Any:
        """Return finite rows as volumes to be measured and drawn."""
        return OBBs(rows)


def hulls_of_leaves(geometry: Csg) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the bounded leaves of trees, (k,), and triangles around each, as ``hulls_of`` does."""
    nodes = geometry.nodes
    is_leaf = (nodes.kind < UNION) & (nodes.kind != HALF_SPACE)
    is_leaf[geometry.roots[~geometry.is_tree]] = False
    leaves = np.flatnonzero(is_leaf)
    hulls, starts = hulls_of(geometry.solids)
    parts = []
    for node in leaves.tolist():
        i = nodes.leaf[node]
        if nodes.kind[node] == SOLID:
            parts.append(hulls[starts[i] : starts[i + 1]])
        else:
            parts.append(geometry.corners[geometry.mesh_first[i] : geometry.mesh_first[i + 1]])
    offsets = np.cumsum([0] + [len(part) for part in parts])
    return leaves, np.ascontiguousarray(np.concatenate([np.empty((0, 3, 3)), *parts])), offsets


def kind_of(name: str) -> Strips | Balls | Oriented:
    """Return what is known of a kind of volume."""
    if name == "sphere":
        return Balls()
    if name == "obb":
        return Oriented()
    return Strips(6 if name == "aabb" else int(name.removeprefix("kdop")))
