"""One ray through structures: which one a lesson shows, and how its walk is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.cells import Cells
from ..contract.events import VISIT_EMPTY, VISIT_LEAF
from ..contract.steps import Steps
from ..contract.structure import Structure
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..progress import Progress
from ..scene import Scene
from .drawing import GREEN, Colour, Lines, coloured
from .lesson import Subject

RAY: Colour = (0.66, 0.36, 0.95, 1.0)
"""Colour of a ray, in light and in dark."""

FROM, TO = np.array([-4.85, 6.1, 4.9]) / 16.0, np.array([9.7, 6.1, 16.0]) / 16.0
"""The ray of the slide "Nonuniform subdivision of space", in shares of the scene's box."""

FANS = 6
"""Along each of y, the height on the left and that on the right there are as many other rays."""

Counted = dict[str, np.ndarray]
"""Counters of rays, by name."""

WORTH_OF_HIT = 4.0
"""What a hit is worth, in leaves or cells more or fewer than are wanted."""

TURN = 0.3
"""How far oblique rays begin before and end behind their middle along y, in depths of the box."""

STEEP = 0.3
"""How far oblique rays rise or fall at least, in heights of the box."""


def candidates(scene: Scene, is_oblique: bool = False) -> Rays:
    """Return rays from the left to the right of a scene.

    Each lies in a plane across y, and the first is the slide's; or they go from the front to the
    back as well. Directions have unit length, so t is the distance. Flat scenes are passed, too, by
    rays that come from above.
    """
    size = scene.upper - scene.lower
    half = np.maximum(0.5 * size, [0.0, 0.0, 0.1 * size.max()])
    lower = 0.5 * (scene.lower + scene.upper) - half
    share = (np.arange(FANS) + 0.5) / FANS
    # From the middle to the front and to the back.
    y = 0.5 + np.array([0.02, -0.06, 0.11, -0.17, 0.24, -0.31])
    y, begin, end = (each.ravel() for each in np.meshgrid(y, share[::-1], share, indexing="ij"))
    if is_oblique:
        steep = np.abs(begin - end) > STEEP
        y, begin, end = y[steep], begin[steep], end[steep]
    left = np.stack([np.full(len(y), -0.25), y, begin], axis=1)
    right = np.stack([np.full(len(y), 1.02), y, end], axis=1)
    left, right = np.concatenate([FROM[None], left]), np.concatenate([TO[None], right])
    if is_oblique:
        left[:, 1] -= TURN
        right[:, 1] += TURN
    origins, ways = lower + left * 2.0 * half, (right - left) * 2.0 * half
    if not size[0] > 0.0:  # a wall across x
        ways[:, 0] = size.max()
    return Rays.from_arrays(origins, ways / np.linalg.norm(ways, axis=1, keepdims=True))


def ray_of(
    subject: Subject,
    structures: Sequence[Structure],
    telling: Callable[[Sequence[Counted], np.ndarray], np.ndarray],
    progress: Progress,
    *,
    is_oblique: bool = False,
) -> Rays:
    """Return the ray that a lesson is given, or of some through the scene the most telling one.

    Parameters
    ----------
    telling : callable
        Gets the counters of the rays in each structure, and whether they hit; returns a figure for
        each ray. Of equals the first is taken.
    is_oblique : bool
        Whether it shall cross walls across y, too.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    if subject.rays is not None:
        return subject.rays.select(np.array([subject.ray]))
    rays = candidates(subject.scene, is_oblique)
    traced = [structure.trace(rays, progress=progress) for structure in structures]
    counted = [counts.by_name() for _, counts in traced]
    best = int(np.argmax(telling(counted, traced[0][0].primitive >= 0)))
    return rays.select(np.array([best]))


def near(count: int) -> Callable[[Sequence[Counted], np.ndarray], np.ndarray]:
    """Return what prefers rays that enter about so many leaves or cells, and hit, for `ray_of`."""

    def telling(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
        entered = counted_in[0]["N_ETS"]
        return WORTH_OF_HIT * hits - np.abs(entered - count) - count * (entered == 0)

    return telling


@dataclass(frozen=True)
class Walked:
    """The recorded walk of one ray through one structure.

    Attributes
    ----------
    structure : Structure
    cells : Cells
    rays : Rays
        The ray alone.
    steps : Steps
    visits : (n,) int
        Events in which leaves or cells are entered, in order.
    places : (n,) int
        Place in `cells` of each of those.
    t_hit : float
        inf for a miss.
    """

    structure: Structure
    cells: Cells
    rays: Rays
    steps: Steps
    visits: np.ndarray
    places: np.ndarray
    t_hit: float

    @classmethod
    def of(
        cls, structure: Structure, rays: Rays, progress: Progress, cells: Cells | None = None
    ) -> Walked:
        """Record a walk.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        cells = (structure.cells(progress) if cells is None else cells).own()
        steps = structure.record(rays, 0)
        hits, _ = structure.trace(rays, progress=progress)
        visits = np.flatnonzero(np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY)) & (steps.level == 0))
        places = places_of(cells, steps.cell[visits])
        return cls(structure, cells, rays, steps, visits, places, float(hits.t[0]))

    @property
    def is_empty(self) -> np.ndarray:
        """Which of the leaves or cells that are entered are empty, (n,) bool."""
        return self.steps.kind[self.visits] == VISIT_EMPTY

    @property
    def counts(self) -> dict[str, int]:
        """What the walk has counted."""
        return self.steps.tally()

    def at(self, t: np.ndarray | float) -> np.ndarray:
        """Return points on the ray, (..., 3)."""
        return point_at(self.rays, t)

    @property
    def end(self) -> float:
        """The t of the hit, or of a little after the last cell, or of nearest approach."""
        if np.isfinite(self.t_hit):
            return self.t_hit
        exits = self.steps.t_exit[self.visits]
        exits = exits[np.isfinite(exits)]
        scene = self.structure.scene
        direction = self.rays.directions[0]
        past = 0.04 * scene.diagonal / float(np.linalg.norm(direction))
        if len(exits):
            return min(float(exits.max()) + past, float(self.rays.t_max[0]))
        to_centre = 0.5 * (scene.lower + scene.upper) - self.rays.origins[0]
        nearest = max(float(to_centre @ direction) / float(direction @ direction), 0.0)
        return min(nearest + 10 * past, float(self.rays.t_max[0]))

    def begin(self) -> float:
        """Return the t from which on the ray is drawn: a little before it enters."""
        scene = self.structure.scene
        before = 0.12 * scene.diagonal / float(np.linalg.norm(self.rays.directions[0]))
        first = float(self.steps.t_enter[self.visits[0]]) if len(self.visits) else self.end
        return max(first - before, float(self.rays.t_min[0]))

    def ray_lines(self, shift: np.ndarray | float = 0.0, until: float = np.inf) -> list[Lines]:
        """Return the ray, faint behind `until`, and a star where it has hit by then."""
        begin, end = self.begin(), self.end
        here = min(max(until, begin), end)
        points = self.at(np.array([begin, here, end])) + shift
        parts = [coloured(points[None, :2], RAY)]
        if here < end:
            parts.append(coloured(points[None, 1:], (*RAY[:3], 0.3)))
        elif np.isfinite(self.t_hit):
            size = 0.05 * self.structure.scene.diagonal
            parts.append(coloured(stars(points[2:], np.array([size])), GREEN))
        return parts


def point_at(rays: Rays, t: np.ndarray | float) -> np.ndarray:
    """Return points on the first ray, (..., 3)."""
    return rays.origins[0] + np.asarray(t)[..., None] * rays.directions[0]


def places_of(cells: Cells, numbers: np.ndarray) -> np.ndarray:
    """Return the place of the cell of each number, (n,), in the order of the numbers."""
    order = np.argsort(cells.numbers, kind="stable")
    return order[np.searchsorted(cells.numbers[order], numbers)]


FAN = 8
"""Rays from the front in a row and in a column."""

FROM_THE_FRONT = np.array([0.75, 0.63, -0.2])
"""Direction of rays that come from the left before the model: what they hit first is seen."""


def rays_from_the_front(scene: Scene) -> Rays:
    """Return FAN x FAN parallel rays that meet the box of a scene where it is seen."""
    share = (np.arange(FAN) + 0.5) / FAN
    u, v = (each.ravel() for each in np.meshgrid(share, share))
    size = scene.upper - scene.lower
    targets = scene.lower + np.stack([u, np.full(len(u), 0.5), v], axis=1) * size
    origins = targets - 1.2 * scene.diagonal * FROM_THE_FRONT
    return Rays.from_arrays(origins, np.tile(FROM_THE_FRONT, (len(u), 1)))
