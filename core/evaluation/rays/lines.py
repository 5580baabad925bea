"""The workload ``random_lines``: the SAH's own assumption."""

from __future__ import annotations

from dataclasses import dataclass

from ...geometry.rays import Rays
from ...memory import refuse_if_too_large
from ...sah.line_sample import random_lines
from ...scene import Scene
from ...settings import setting
from .ray_files import BYTES_PER_RAY
from .workload import Workload, ray_order


@dataclass(frozen=True)
class RandomLinesSettings:
    """Settings of the random lines."""

    count: int = setting(100_000, "Count", "How many lines", unit="rays", minimum=1)
    seed: int = setting(1, "Seed", "Start of the random numbers", minimum=0)
    order: str = ray_order()


class RandomLinesWorkload(Workload):
    """Isotropic uniform lines through the scene's box: the SAH's own assumption.

    A point uniform on the box's surface, then a direction into the box with a density proportional
    to the cosine of its angle with the surface. Every line through the box enters it just once, so
    no line is drawn in vain. Under this distribution a convex body inside another is hit with
    probability S_i / S.
    """

    name = "random_lines"
    label = "Random Lines"
    summary = "Isotropic uniform lines through the scene's box: the SAH's own assumption"
    Settings = RandomLinesSettings

    @staticmethod
    def refuse_impossible(settings: RandomLinesSettings) -> None:
        """Refuse more rays than fit into memory."""
        refuse_if_too_large(
            settings.count * BYTES_PER_RAY, f"{settings.count} random lines", "lower the count"
        )

    @staticmethod
    def make(scene: Scene, settings: RandomLinesSettings) -> Rays:
        """Return lines that start outside the scene's bounding sphere."""
        RandomLinesWorkload.refuse_impossible(settings)
        origins, directions = random_lines(scene.lower, scene.upper, settings.count, settings.seed)
        return Rays.from_arrays(origins, directions, class_names=("random line",))
