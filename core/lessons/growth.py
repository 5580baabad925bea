"""What a scene costs as it grows: parts of it, each traced by the naive algorithm and by a BVH.

A part is the first so many of the scene's items in a random order, so that small parts lie all over
the scene, as thin as large ones are dense. Every part is met by the same lines.
"""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..contract.counters import Counts
from ..contract.structure import Structure
from ..geometry.geometry import in_order
from ..geometry.rays import CLOSEST, Rays
from ..progress import Progress
from ..sah.line_sample import random_lines
from ..sah.timing import affordable
from ..scene import Scene
from ..structures.bvh.hierarchy import BVH
from ..structures.naive import Naive

TESTS = 400_000, 20_000
"""Tests of the naive algorithm in the whole scene, and where kernels run as plain Python: the
number of lines follows from it."""

FEWEST, MOST = 12, 256
"""Lines."""

AGAIN = 30, 1
"""How often at most they are traced for a timing."""


class Growth(NamedTuple):
    """Figures of growing parts; k of them, met by r lines.

    Attributes
    ----------
    counts : (k,) int64
        N, the items of each part; ascending.
    order : (n,) int64
        The items of the scene; a part has the first so many.
    rays : Rays
    naive : (k, r) int32
        N_IT of each line, tested naively.
    steps, tests : (k, r) int32
        N_TS and N_IT of each line in a BVH over the part.
    seconds : (k,) float64
        Measured here: what the naive algorithm takes for a line, with one thread.
    seconds_bvh : (k,) float64
        What the BVH takes.
    trees : tuple of BVH
    middle : int
        The line that passes nearest to the middle of the scene.
    """

    counts: np.ndarray
    order: np.ndarray
    rays: Rays
    naive: np.ndarray
    steps: np.ndarray
    tests: np.ndarray
    seconds: np.ndarray
    seconds_bvh: np.ndarray
    trees: tuple[BVH, ...]
    middle: int

    def chord(self, scene: Scene) -> np.ndarray:
        """Return the line through the middle as far as it is drawn, (2, 3)."""
        direction = self.rays.directions[self.middle]
        centre = 0.5 * (scene.lower + scene.upper)
        foot = centre - nearest_to(self.rays, centre)[self.middle]
        reach = 0.6 * scene.diagonal * direction
        return np.stack([foot - reach, foot + reach])


def number_of_lines(scene: Scene) -> int:
    """Return how many lines are traced naively: as many as make no more than TESTS."""
    return min(max(affordable(*TESTS) // len(scene), FEWEST), MOST)


def growth_of(scene: Scene, counts: Sequence[int], progress: Progress) -> Growth:
    """Trace parts of a scene.

    Parameters
    ----------
    scene : Scene
        Without instances, see :meth:`..scene.Scene.flat`.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    # Only uniform numbers: every NumPy has drawn the same ones.
    order = np.argsort(np.random.default_rng(1).random(len(scene)), kind="stable")
    lines = random_lines(scene.lower, scene.upper, number_of_lines(scene), seed=1)
    rays = Rays.from_arrays(*lines)
    # What is compiled is not timed.
    first = part_of(scene, order[:1])
    for structure in (Naive.build(first, Naive.Settings()), BVH.build(first, BVH.Settings())):
        structure.trace(rays, CLOSEST, threads=1, progress=progress)
    found, trees = [], []
    for done, count in enumerate(counts):
        progress.report(done, len(counts), "Tracing parts of the scene")
        part = part_of(scene, order[:count])
        most = affordable(*AGAIN)
        again = min(len(scene) // count, most)
        naive, own_time = timed(Naive.build(part, Naive.Settings()), rays, again, progress)
        trees.append(BVH.build(part, BVH.Settings(), progress))
        bvh, bvh_time = timed(trees[-1], rays, most, progress)
        found.append((naive["N_IT"], bvh["N_TS"], bvh["N_IT"], own_time, bvh_time))
    tests_naive, steps, tests, seconds, faster = (
        np.array(column) for column in zip(*found, strict=True)
    )
    away = np.linalg.norm(nearest_to(rays, 0.5 * (scene.lower + scene.upper)), axis=1)
    return Growth(
        np.array(counts), order, rays, tests_naive, steps, tests, seconds, faster, tuple(trees),
        int(away.argmin()),
    )  # fmt: skip


def nearest_to(rays: Rays, point: np.ndarray) -> np.ndarray:
    """Return the vectors from lines of unit direction to a point, at right angles, (n, 3)."""
    away = point - rays.origins
    return away - (away * rays.directions).sum(axis=1, keepdims=True) * rays.directions


def timed(structure: Structure, rays: Rays, again: int, progress: Progress) -> tuple[Counts, float]:
    """Return the counters of rays, and the seconds that each took, all traced `again` times.

    A batch has a cost of its own, which is not to be that of a few rays.
    """
    batch = rays.select(np.tile(np.arange(len(rays)), again))
    start = time.perf_counter()
    _, counts = structure.trace(batch, CLOSEST, threads=1, progress=progress)
    seconds = (time.perf_counter() - start) / len(batch)
    return dataclasses.replace(counts, values=counts.values[: len(rays)]), seconds


def part_of(scene: Scene, items: np.ndarray) -> Scene:
    """Return a scene that has only some items, in the box of the whole one."""
    geometry = in_order(scene.geometry, items)
    return dataclasses.replace(
        scene,
        geometry=geometry._replace(ids=np.arange(len(items), dtype=np.int32)),
        primitive_ids=np.arange(len(items), dtype=np.int32),
        object_ids=scene.object_ids[items],
        material_ids=None,
    )


def slope_through_zero(x: np.ndarray, y: np.ndarray) -> float:
    """Return c of the line y = c x with the least squares to points (k,)."""
    return float(x @ y / (x @ x))


def fitted_line(x: np.ndarray, y: np.ndarray) -> tuple[float, float]:
    """Return a, b of the line y = a + b x with the least squares to points; b = 0 for one x."""
    away = x - x.mean()
    b = float(away @ y / (away @ away)) if (away != 0.0).any() else 0.0
    return float(y.mean() - b * x.mean()), b
