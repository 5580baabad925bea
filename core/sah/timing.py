"""How long a ray's test of a bounding volume and of an object takes, on this machine; does it pay?

A test takes some nanoseconds, so many rays are tested in one kernel, and what making the rays takes
is subtracted. The shortest of several timings counts: the others have been disturbed.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

from ..geometry.combined import Intersection, Union
from ..geometry.geometry import intersect
from ..geometry.rays import RayArrays, make_ray
from ..geometry.triangles import Triangles
from ..geometry.volume import MOST_STRIPS
from ..kernels import call, has_numba, is_plain, kernel
from ..progress import SILENT, Progress
from .line_sample import enter_lines, use

COPIES = 17
"""Volumes tested per ray in the second of two timings: their difference is that of 16 tests."""

TIMED_RAYS = 20_000, 200
"""Rays in a timing, and where kernels run as plain Python."""

TRIANGLE_TESTS = 4_000_000, 20_000
"""Per timing of the object: some 20 ms, and where kernels run as plain Python."""

REPEATS = 5, 1
"""Timings of which the shortest counts: others have been disturbed."""


def affordable(compiled: int, plain: int) -> int:
    """Return how much is done: another number where kernels run as plain Python, a hundredth."""
    return compiled if has_numba() and not is_plain() else plain


@kernel
def make_rays(rays, reach, count):
    """Make each ray: what all timings below have in common."""
    total = 0.0
    for i in range(count):
        total += use(make_ray(rays, i, reach))
    return total


@kernel
def meet_triangles(triangles, rays, count):
    """Make each ray and test all triangles with it."""
    total = 0.0
    for i in range(count):
        ray = make_ray(rays, i, triangles.reach)
        total += use(ray)
        best = np.inf
        for k in range(len(triangles.ids)):
            # Of a triangle alone, what comes after the ray is not looked at.
            t, _ = intersect(triangles, k, ray, np.inf, 0, 0, 0)
            best = t if t < best else best
        if best < total:
            total += best
    return total


def nanoseconds(
    count: int, progress: Progress, text: str, function: Callable, *arguments: Any
) -> float:
    """Return the shortest time of a kernel call, divided by `count`.

    Raises
    ------
    Cancelled
        From `progress`, which hears of the work called `text` between two calls.
    """
    repeats = affordable(*REPEATS)
    if affordable(True, False):
        progress.report(0, repeats, text)
        call(function, *arguments)  # compiles
    best = np.inf
    for done in range(repeats):
        progress.report(done, repeats, text)
        start = time.perf_counter_ns()
        call(function, *arguments)
        best = min(best, time.perf_counter_ns() - start)
    return best / count


def time_of_ray(rays: RayArrays, reach: np.ndarray, progress: Progress = SILENT) -> float:
    """Return the nanoseconds of making a ray, which no test is to blame for.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    count = min(affordable(*TIMED_RAYS), len(rays.t_max))
    return nanoseconds(count, progress, "Timing the rays", make_rays, rays, reach, count)


def time_of_volume(
    volume: Any, rays: RayArrays, reach: np.ndarray, progress: Progress = SILENT
) -> float:
    """Return B: the nanoseconds of preparing a ray for a volume and of testing it.

    A single test takes little more than the clock's noise, so many copies are tested as well.

    Parameters
    ----------
    volume : NamedTuple of arrays
        A list of one.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    text, volumes = "Timing the volume", copies_of(volume)
    t, strips = np.empty(min(affordable(*TIMED_RAYS), len(rays.t_max))), np.empty((MOST_STRIPS, 3))
    one, many = (
        nanoseconds(len(t), progress, text, enter_lines, volumes, copies, rays, reach, strips, t)
        for copies in (1, COPIES)
    )
    test = max((many - one) / (COPIES - 1), 1e-3)
    return test + max(one - test - time_of_ray(rays, reach, progress), 0.0)


def copies_of(volumes: Any) -> Any:
    """Return COPIES of a single volume, which may be a combined one."""
    if isinstance(volumes, Intersection | Union):
        return type(volumes)(copies_of(volumes.first), copies_of(volumes.second))
    return volumes._replace(rows=np.repeat(volumes.rows, COPIES, axis=0))


def time_of_object(triangles: Triangles, rays: RayArrays, progress: Progress = SILENT) -> float:
    """Return I: the nanoseconds of testing all triangles with one ray.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    wanted = max(affordable(*TRIANGLE_TESTS) // len(triangles.ids), 8)
    count = min(affordable(*TIMED_RAYS), len(rays.t_max), wanted)
    text = "Timing the object"
    whole = nanoseconds(count, progress, text, meet_triangles, triangles, rays, count)
    return max(whole - time_of_ray(rays, triangles.reach, progress), 1e-3)


def verdict(B: float, I: float, p: float) -> dict[str, Any]:  # noqa: E741  the lecture's I
    """Return the lecture's inequality B + p I < I with what follows from it.

    Parameters
    ----------
    B, I : float
        Times per ray of the volume and of the object.
    p : float
        Share of the rays that hit the volume.
    """
    return {
        "time_with": B + p * I,
        "pays": bool(B + p * I < I),
        "break_even": 1.0 - B / I,
        "speed_up": I / (B + p * I),
    }
