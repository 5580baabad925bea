"""Combined bounding volumes: intersections and unions, which follow a shape more closely.

- Intersection: every member is fitted to the whole object. A ray is inside where it is inside all
  members: it enters with the last of them and leaves with the first.
- Union: each member is fitted to a half of the items, in their order (:mod:`.fit`). A ray enters
  with the first member it meets.

Members are of any kinds, combined ones too: three make an intersection of one and of an
intersection of two.

An intersection of polyhedra is a polyhedron, with an area. With a sphere there is no simple
formula, and the share p of rays that hit a union is not its area's: what rays see is the area of
its shadow, averaged over all directions. That can be measured for any shape: of random lines
through a ball around it, the share p hits, and its mean shadow is p times that of the ball. Four
mean shadows are the surface area of a convex body (Cauchy), and what :meth:`areas` returns. The
lines' lengths inside give the volume.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..kernels import call, implements, inner, kernel
from ..progress import SILENT, Progress
from .box import Boxes
from .half_spaces import every_other, faces_of, measured
from .kdop import KDOPs
from .obb import OBBs
from .polygons import Polygons, merged
from .rays import Rays, make_ray
from .volume import MOST_STRIPS, STRIPS, fit, outside, prepare, span

LINES = 4096
"""Random lines for a measured area: its standard error is below 1% of that of the ball."""


class Intersection(NamedTuple):
    """Intersections of volumes, member by member with the same number.

    Attributes
    ----------
    first, second : NamedTuple of arrays
        Volumes of any kind, as many of the one as of the other.
    """

    first: Any
    second: Any

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return the surface areas, (n,); measured with a sphere among the members."""
        return (measured if is_polyhedral(self) else measured_by_lines)(self, progress)[0]

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,); measured with a sphere among the members."""
        return (measured if is_polyhedral(self) else measured_by_lines)(self)[1]

    def boxes(self) -> np.ndarray:
        """Return axis-aligned boxes around them, (n, 6)."""
        a, b = self.first.boxes(), self.second.boxes()
        return np.hstack([np.maximum(a[:, :3], b[:, :3]), np.minimum(a[:, 3:], b[:, 3:])])

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the faces of some polyhedra; with a sphere among them, those of all members."""
        if is_polyhedral(self):
            return faces_of(self, numbers, progress)
        return merged(
            self.first.polygons(numbers, progress), self.second.polygons(numbers, progress)
        )

    def half_spaces(self, numbers: np.ndarray) -> np.ndarray:
        """Return some polyhedra as half-spaces ``n . p <= h``: (k, m, 4), each [nx, ny, nz, h]."""
        members = self.first.half_spaces(numbers), self.second.half_spaces(numbers)
        return np.concatenate(members, axis=1)

    def neighbours(self) -> np.ndarray:
        """Return the half-spaces that may cut each face, (m, m - 1) int64: all others."""
        return every_other(self.half_spaces(np.arange(1)).shape[1])


class Union(NamedTuple):
    """Unions of volumes, member by member with the same number.

    Attributes
    ----------
    first, second : NamedTuple of arrays
        Volumes of any kind, as many of the one as of the other.
    """

    first: Any
    second: Any

    def areas(self, progress: Progress = SILENT) -> np.ndarray:
        """Return four times the mean shadows, (n,), measured."""
        return measured_by_lines(self, progress)[0]

    def contents(self) -> np.ndarray:
        """Return the volumes, (n,), of unions of convex members: what both have counts once."""
        both = Intersection(self.first, self.second).contents()
        return self.first.contents() + self.second.contents() - both

    def boxes(self) -> np.ndarray:
        """Return the axis-aligned boxes around them, (n, 6)."""
        a, b = self.first.boxes(), self.second.boxes()
        return np.hstack([np.minimum(a[:, :3], b[:, :3]), np.maximum(a[:, 3:], b[:, 3:])])

    def polygons(self, numbers: np.ndarray, progress: Progress = SILENT) -> Polygons:
        """Return the faces of all members of some unions."""
        return merged(
            self.first.polygons(numbers, progress), self.second.polygons(numbers, progress)
        )


def is_polyhedral(volumes: Any) -> bool:
    """Say whether volumes are convex polyhedra."""
    if isinstance(volumes, Intersection):
        return is_polyhedral(volumes.first) and is_polyhedral(volumes.second)
    return isinstance(volumes, Boxes | OBBs | KDOPs)


# --------------------------------------------------------------------------------------- measuring


@kernel
def cross_lines(volumes, index, rays, reach, strips, lengths):
    """Write how long each line is inside a volume, -1 for those that miss it."""
    for i in range(len(lengths)):
        ray = make_ray(rays, i, reach)
        prepare(volumes, ray, strips)
        t_enter, t_leave = span(volumes, index, ray, strips, ray.t_max)
        lengths[i] = t_leave - t_enter if t_enter <= t_leave else -1.0


def measured_by_lines(volumes: Any, progress: Progress = SILENT) -> tuple[np.ndarray, np.ndarray]:
    """Return areas and contents of volumes of any kind, (n,) each, measured with random lines.

    The same LINES for all, so that equal shapes have equal areas.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(LINES, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # Perpendicular to a direction: even over the unit disc. Lines start at the ball.
    across = np.cross(directions, rng.normal(size=(LINES, 3)))
    across *= (np.sqrt(rng.random(LINES)) / np.linalg.norm(across, axis=1))[:, None]
    boxes = volumes.boxes()
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    radii = 0.5 * np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)
    areas, contents = np.zeros(len(boxes)), np.zeros(len(boxes))
    lengths, strips = np.empty(LINES), np.empty((MOST_STRIPS, 3))
    for index in np.flatnonzero(radii > 0.0):
        progress.report(float(index), len(boxes), "Measuring volumes")
        origins = middles[index] + radii[index] * (across - 2.0 * directions)
        rays = Rays.from_arrays(origins, directions).arrays()
        call(cross_lines, volumes, index, rays, np.abs(middles[index]), strips, lengths)
        shadow = np.pi * radii[index] ** 2
        areas[index] = 4.0 * shadow * (lengths >= 0.0).mean()
        contents[index] = shadow * lengths.clip(min=0.0).mean()
    return areas, contents


# ------------------------------------------------------------------------------- fit and ray test


@implements(fit, Intersection)
def fit_intersection(volumes, index, corners, first, last):
    """Fit every member to all triangles."""
    fit(volumes.first, index, corners, first, last)
    fit(volumes.second, index, corners, first, last)


@implements(outside, Intersection)
def outside_intersection(volumes, index, x, y, z):
    """Ask the member that the point is farthest outside of."""
    return max(outside(volumes.first, index, x, y, z), outside(volumes.second, index, x, y, z))


@implements(outside, Union)
def outside_union(volumes, index, x, y, z):
    """Ask the nearest member."""
    return min(outside(volumes.first, index, x, y, z), outside(volumes.second, index, x, y, z))


@inner
def prepare_both(volumes, ray, strips):
    """Give each member rows of its own: the second has those behind the first's."""
    prepare(volumes.first, ray, strips)
    prepare(volumes.second, ray, strips[STRIPS:])


@implements(prepare, Intersection)
def prepare_intersection(volumes, ray, strips):
    """Prepare both members."""
    prepare_both(volumes, ray, strips)


@implements(prepare, Union)
def prepare_union(volumes, ray, strips):
    """Prepare both members."""
    prepare_both(volumes, ray, strips)


@implements(span, Intersection)
def span_intersection(volumes, index, ray, strips, limit):
    """Enter with the last member, leave with the first."""
    enter, leave = span(volumes.first, index, ray, strips, limit)
    if enter > leave:
        return enter, leave
    other, leave = span(volumes.second, index, ray, strips[STRIPS:], leave)
    return other if other > enter else enter, leave


@implements(span, Union)
def span_union(volumes, index, ray, strips, limit):
    """Enter with the first member, leave with the last; a gap in between is not noticed."""
    a, a_leave = span(volumes.first, index, ray, strips, limit)
    b, b_leave = span(volumes.second, index, ray, strips[STRIPS:], limit)
    if a > a_leave:
        return b, b_leave
    if b > b_leave:
        return a, a_leave
    return b if b < a else a, b_leave if b_leave > a_leave else a_leave
