"""Lines at an object in a bounding volume: who hits what.

The lecture's figures of a volume's efficiency are shares of such lines. Two samples:

- random: isotropic and uniform through a ball around everything, so that a line hits a convex body
  of area S in the ball with probability S / (4 pi R^2). A direction is drawn, and a point uniform
  in the ball's disc across it. Or all of them hit a box, where nothing else matters.
- parallel: along one direction, as on the slide. There shares of lines are ratios of projected
  areas.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..contract.structure import Structure
from ..geometry.rays import CLOSEST, Rays, make_ray
from ..geometry.volume import MISS, MOST_STRIPS, enter, prepare
from ..kernels import call, inner, kernel
from ..progress import SILENT, Progress

LINES_AT_ONCE = 1 << 14
"""Lines made at a time, so that what they are made of stays in the processor's cache."""


class Ball(NamedTuple):
    """What lines are drawn through: centre (3,) and radius."""

    centre: np.ndarray
    radius: float

    @classmethod
    def around(cls, lower: np.ndarray, upper: np.ndarray, spread: float) -> Ball:
        """Return a ball `spread` times as large as the one through the corners of a box."""
        radius = 0.5 * spread * float(np.linalg.norm(upper - lower))
        return cls(0.5 * (lower + upper), radius)

    def area(self) -> float:
        """Return the surface area."""
        return 4.0 * np.pi * self.radius**2


def random_lines_through(ball: Ball, count: int, seed: int) -> Rays:
    """Return isotropic uniform lines through a ball; they start on its surface."""
    rng = np.random.default_rng(seed)
    z, angle = 2.0 * rng.random(count) - 1.0, 2.0 * np.pi * rng.random(count)
    sine = np.sqrt(1.0 - z**2)
    directions = np.stack([sine * np.cos(angle), sine * np.sin(angle), z], axis=1)
    distance, turn = np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    u, v = across(directions)
    point = distance[:, None] * (np.cos(turn)[:, None] * u + np.sin(turn)[:, None] * v)
    return _entering(ball, point, directions)


def random_lines(
    lower: np.ndarray, upper: np.ndarray, count: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and unit directions, (count, 3) each, of lines through the box.

    The origins lie outside the box's bounding sphere.
    """
    rng = np.random.default_rng(seed)
    size = upper - lower
    across = np.array([[1, 2], [2, 0], [0, 1]])  # the two axes of the faces that an axis pierces
    areas = size[across].prod(axis=1)
    axis = rng.choice(3, size=count, p=areas / areas.sum())
    # Where the line enters: on one of the two faces, with its inward normal along +-axis.
    inward = rng.choice([-1.0, 1.0], size=count)
    origins = rng.random((count, 3))
    # Cosine-distributed around the normal: uniform on the disc below the hemisphere.
    squared = rng.random(count)  # of the distance from the disc's centre
    turn = rng.random(count)
    directions = np.empty((count, 3))
    for first in range(0, count, LINES_AT_ONCE):
        some = slice(first, first + LINES_AT_ONCE)
        along, sign = axis[some], inward[some]
        angle, radius = 2.0 * np.pi * turn[some], np.sqrt(squared[some])
        direction = directions[some]
        # Places in all numbers of the lines: one index each is found in half the time of two.
        begin, numbers = 3 * np.arange(len(along)), direction.reshape(-1)
        numbers[begin + along] = sign * np.sqrt(1.0 - squared[some])
        numbers[begin + across[:, 0][along]] = radius * np.cos(angle)
        numbers[begin + across[:, 1][along]] = radius * np.sin(angle)
        entry = lower + origins[some] * size
        entry.reshape(-1)[begin + along] = np.where(sign > 0.0, lower[along], upper[along])
        origins[some] = entry - 2.0 * np.linalg.norm(size) * direction
    return origins, directions


def parallel_lines_through(ball: Ball, direction: np.ndarray, count: int) -> Rays:
    """Return lines along a direction (3,) that hit a ball, spread evenly over its disc.

    They lie like the seeds of a sunflower: unlike in a square grid, no row of them coincides with
    a side of what is measured.
    """
    direction = direction / np.linalg.norm(direction)
    number = np.arange(count)
    distance, angle = np.sqrt((number + 0.5) / count), np.pi * (3.0 - np.sqrt(5.0)) * number
    u, v = across(direction[None])
    point = distance[:, None] * (np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v)
    return _entering(ball, point, np.tile(direction, (count, 1)))


def across(directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two unit vectors (n, 3) at right angles to unit directions (n, 3) and each other."""
    least = np.eye(3)[np.abs(directions).argmin(axis=1)]
    u = np.cross(directions, least)
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    return u, np.cross(directions, u)


def _entering(ball: Ball, point: np.ndarray, directions: np.ndarray) -> Rays:
    """Return the lines through points of the unit disc across each direction, in a ball."""
    chord = np.sqrt(np.maximum(1.0 - (point**2).sum(axis=1, keepdims=True), 0.0))
    origins = ball.centre + ball.radius * (point - chord * directions)
    return Rays.from_arrays(origins, directions, 2.0 * ball.radius * chord[:, 0])


def chords(rays: Rays) -> np.ndarray:
    """Return the lines from where they enter the ball to where they leave it, (n, 2, 3)."""
    ends = rays.origins + rays.t_max[:, None] * rays.directions
    return np.stack([rays.origins, ends], axis=1)


@kernel
def enter_lines(volumes, copies, rays, reach, strips, t):
    """Write where each ray first enters one of the first few volumes, MISS if it does not.

    Return a number for which all of each ray has to be computed, for timings.
    """
    total = 0.0
    for i in range(len(t)):
        ray = make_ray(rays, i, reach)
        total += use(ray)
        prepare(volumes, ray, strips)
        t[i] = MISS
        for index in range(copies):
            t_volume = enter(volumes, index, ray, strips, ray.t_max)
            if t_volume < t[i]:
                t[i] = t_volume
    return total


@inner
def use(ray):
    """Return a number that depends on all of a ray: compilers leave out what nobody uses."""
    return ray.shear_x + ray.shear_y + ray.shear_z + ray.low_x + ray.high_y + ray.okz


class LineSample(NamedTuple):
    """Lines, and what they hit.

    Attributes
    ----------
    rays : Rays
    hits_volume, hits_object : (n,) bool
        Lines that hit the object hit the volume, too.
    """

    rays: Rays
    hits_volume: np.ndarray
    hits_object: np.ndarray

    @property
    def ratio(self) -> float:
        """Share of the lines through the volume that hit the object: pA / pB; 0 without any."""
        return float(self.hits_object.sum() / max(int(self.hits_volume.sum()), 1))


def sample_of(
    rays: Rays, structure: Structure, volumes: Any, progress: Progress = SILENT
) -> LineSample:
    """Return what lines hit of an object and of the first of `volumes`, which is around it.

    Parameters
    ----------
    structure : Structure
        Any structure over the object; it only answers which lines hit.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    hits, _ = structure.trace(rays, CLOSEST, progress=progress)
    return LineSample(rays, volume_hits(rays, structure, volumes), hits.primitive >= 0)


def volume_hits(rays: Rays, structure: Structure, volumes: Any) -> np.ndarray:
    """Return which lines hit the first of `volumes`, (n,) bool."""
    t = np.empty(len(rays))
    reach, strips = structure.geometry.reach, np.empty((MOST_STRIPS, 3))
    call(enter_lines, volumes, 1, rays.arrays(), reach, strips, t)
    return t != MISS
