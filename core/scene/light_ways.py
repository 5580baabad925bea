"""Ways from surfaces to the lights: where shadow rays go.

To an area light they may go to points on it. Which point follows from where the ray starts, from a
seed, and from nothing else: it does not matter which rays are made before, together or at all. The
numbers that look random are those of splitmix64 (G. Steele, D. Lea, C. Flood: Fast splittable
pseudorandom number generators, OOPSLA 2014) over the bits of the coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from . import POINT, SUN, Light
from .surfaces import Surfaces


class Ways(NamedTuple):
    """Ways from surfaces to lights that shine on them, ordered by the surface, then by the light.

    Attributes
    ----------
    surfaces, lights : (n,) int64
        Numbers of the surface, and of the light.
    origins, directions : (n, 3) float64
    ends : (n,) float64
        The t at which a way ends: 1 at a light, none at a sun.
    shares : (n,) float64
        Which part of the light comes this way: all, or one of several samples of it.
    """

    surfaces: np.ndarray
    lights: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    ends: np.ndarray
    shares: np.ndarray


class Sampling(NamedTuple):
    """How area lights are sampled.

    Attributes
    ----------
    points : int
        How many of each of them a surface is joined with; 0 for the centre alone.
    seed : int
    """

    points: int = 0
    seed: int = 1


CENTRES = Sampling()


def ways_to_lights(
    surfaces: Surfaces, lights: Sequence[Light], sampling: Sampling = CENTRES
) -> Ways:
    """Return the ways from surfaces to each light that is on the side they are seen from.

    One goes to a point or spot light, to the centre of an area light or several to points on it, or
    one against the direction of a sun. It starts a little off the face, so as not to hit it again.
    """
    origins = surfaces.points + surfaces.offsets[:, None] * surfaces.normals
    numbers, samples, shares = _aims(lights, sampling.points)
    to_light = np.stack(
        [
            ways_to(lights[number], origins)
            if sample < 0
            else points_on(lights[number], origins, (sampling.seed, number, sample)) - origins
            for number, sample in zip(numbers, samples, strict=True)
        ],
        axis=1,
    )
    lit = (to_light * surfaces.normals[:, None]).sum(axis=2) > 0.0
    lit &= np.stack(
        [shines_along(lights[number], to_light[:, n]) for n, number in enumerate(numbers)], axis=1
    )
    owner, aim = np.nonzero(lit)
    ends = np.array([np.inf if lights[number].kind == SUN else 1.0 for number in numbers])
    return Ways(
        owner, np.array(numbers)[aim], origins[owner], to_light[lit], ends[aim],
        np.array(shares)[aim],
    )  # fmt: skip


def _aims(lights: Sequence[Light], count: int) -> tuple[list[int], list[int], list[float]]:
    """Return of each aim the number of the light, of the sample of it, -1 for its centre, and its
    share.
    """
    numbers: list[int] = []
    samples: list[int] = []
    shares: list[float] = []
    for number, light in enumerate(lights):
        own = range(count) if count and light.half_axes is not None else (-1,)
        numbers += [number] * len(own)
        samples += own
        shares += [1.0 / len(own)] * len(own)
    return numbers, samples, shares


TRIES = 12
"""Points of a rectangle of which the first in its ellipse is taken: one of 10^8 has none there."""


def points_on(light: Light, origins: np.ndarray, salt: tuple[int, ...]) -> np.ndarray:
    """Return a point of an area light for each of some origins, (n, 3), uniform on it.

    Parameters
    ----------
    salt : tuple of int
        With other numbers other points.
    """
    u = v = np.zeros(len(origins))
    is_missing = np.ones(len(origins), dtype=bool)
    for number in range(TRIES if light.is_round else 1):
        x, y = (2.0 * chances(origins, (*salt, number, side)) - 1.0 for side in (0, 1))
        takes = is_missing & (x * x + y * y < 1.0) if light.is_round else is_missing
        u, v = np.where(takes, x, u), np.where(takes, y, v)
        is_missing = is_missing & ~takes
    across, up = np.asarray(light.half_axes, float)
    return np.asarray(light.position, float) + u[:, None] * across + v[:, None] * up


def chances(points: np.ndarray, salt: tuple[int, ...]) -> np.ndarray:
    """Return numbers from 0 to below 1, (n,), that follow from points, (n, 3), and some numbers."""
    bits = np.ascontiguousarray(points + 0.0).view(np.uint64)  # -0 is where 0 is
    state = np.zeros(len(points), dtype=np.uint64)
    with np.errstate(over="ignore"):
        for number in salt:
            state = _mixed(state + np.uint64(number))
        for column in bits.T:
            state = _mixed(state ^ column)
    return (state >> np.uint64(11)) * 2.0**-53


def _mixed(state: np.ndarray) -> np.ndarray:
    """Return the next numbers of splitmix64, (n,) uint64."""
    state = state + np.uint64(0x9E3779B97F4A7C15)
    state = (state ^ (state >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    state = (state ^ (state >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return state ^ (state >> np.uint64(31))


def ways_to(light: Light, points: np.ndarray) -> np.ndarray:
    """Return the vectors from points (n, 3) to a light; unit vectors to a sun."""
    if light.kind == SUN:
        return np.broadcast_to(-np.asarray(light.direction, float), points.shape)
    return np.asarray(light.position, float) - points


def shines_along(light: Light, to_light: np.ndarray) -> np.ndarray:
    """Say where a light shines against the vectors (n, 3) that lead to it."""
    if light.kind in (POINT, SUN):
        return np.ones(len(to_light), dtype=bool)
    # Not as a product of matrices, whose last digits depend on the machine.
    along = -(to_light * np.asarray(light.direction, float)).sum(axis=1)
    distance = np.sqrt((to_light * to_light).sum(axis=1))
    return along > np.cos(np.radians(light.angle) / 2.0) * distance
