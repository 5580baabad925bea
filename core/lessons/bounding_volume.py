"""Lesson "bounding_volume": how quick volumes of each kind are to test, and how tight.

The slide "Bounding volume". In the chart each kind is a star: to the right goes B, how long one ray
takes to be tested against it, measured on this machine; upwards its surface in that of the object's
convex hull, which is 1 for the tightest of all convex volumes. The chosen kind is red there, and
blue around the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.kinds import KINDS
from ..kernels import announcing
from ..progress import Progress
from ..sah.line_sample import Ball, random_lines_through
from ..sah.timing import time_of_volume
from ..sah.volume_around import volume_around
from ..scene import Scene
from ..settings import setting
from .around import edges_of, hull_surface, surface_of
from .drawing import BLUE, GREY, RED, Chart, coloured, picture_of, tinted
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

SHOWN = {
    "sphere": "Sphere", "smallest_sphere": "Smallest sphere", "aabb": "AABB", "obb": "OBB",
    "kdop14": "14-DOP", "kdop18": "18-DOP", "kdop26": "26-DOP",
}  # fmt: skip
"""Kinds that are compared, and what they are called in the chart."""

RAYS = 20_000
"""That are tested for a timing."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    volume: str = setting(
        "aabb", "Volume", "What is put around the object",
        choices={kind: KINDS[kind][0] for kind in SHOWN},
    )  # fmt: skip


class Volumes(Play):
    """All kinds around one object, each with its time and its surface."""

    def __init__(self, scene: Scene, progress: Progress) -> None:
        self.scene = scene
        self.hull = hull_surface(scene, progress)
        rays = random_lines_through(Ball.around(scene.lower, scene.upper, 1.0), RAYS, seed=1)
        reach = scene.geometry.reach
        self.volumes, self.times = {}, {}
        for done, kind in enumerate(SHOWN):
            progress.report(done, len(SHOWN), "Timing volumes")
            with announcing(progress, f"the test of {kind}"):
                volume = self.volumes[kind] = volume_around(scene, kind, progress)
                self.times[kind] = time_of_volume(volume, rays.arrays(), reach, progress)
        shapes = (
            (kind, edges_of(each)[0], surface_of(each)) for kind, each in self.volumes.items()
        )
        self.shapes = {kind: (edges, surface) for kind, edges, surface in shapes}
        self.areas = {kind: float(each.areas(progress)[0]) for kind, each in self.volumes.items()}

    def ratio(self, kind: str) -> float:
        """Return the surface of a volume in that of the hull."""
        return self.areas[kind] / self.hull if self.hull > 0.0 else 1.0

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one kind."""
        chosen, volume = settings.volume, self.volumes[settings.volume]
        most = max(self.times.values())
        top = max(self.ratio(kind) for kind in SHOWN)
        chart = Chart.beside(self.scene, 0.0, 1.15 * most, 1.15 * top, 0.6)
        others = [kind for kind in SHOWN if kind != chosen]
        x, y = np.array([(self.times[kind], self.ratio(kind)) for kind in others]).T
        edges, surface = self.shapes[chosen]
        parts: list[Any] = [
            tinted(surface, BLUE, 0.2),
            coloured(edges, BLUE),
            chart.axes(),
            chart.level(1.0, (*GREY[:3], 0.5)),
            chart.stars(x, y, BLUE),
            chart.mark(self.times[chosen], self.ratio(chosen), RED),
        ]
        marks = [
            Mark(chart.points(np.array([t]), np.array([self.ratio(kind)]))[0], SHOWN[kind],
                 RED[:3] if kind == chosen else None)
            for kind, t in sorted(self.times.items(), key=lambda each: each[0] != chosen)
        ]  # fmt: skip
        marks += chart.named("B: time of a test", "surface / that of the hull")
        B, ratio = self.times[chosen], self.ratio(chosen)
        caption = (
            f"{SHOWN[chosen]}: its test takes B = {B:.1f} ns on this machine, its surface is "
            f"{ratio:.2f} times that of the convex hull"
        )
        rows = (
            Row("B", f"{B:.1f} ns", "Measured here: testing one ray against this volume"),
            Row("Surface", f"{self.areas[chosen]:.4g}", "Of the volume, in square scene units"),
            Row("Surface of the Hull", f"{self.hull:.4g}", "Of the object's convex hull"),
            Row(
                "Hull / Volume", f"{1.0 / ratio if ratio else 1.0:.3f}",
                "Share of the lines through the volume that hit the hull",
            ),
            Row("Content", f"{float(volume.contents()[0]):.4g}", "In cubic scene units"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit and time all kinds."""
    return Volumes(subject.scene.flat(), progress)


LESSONS = (
    Lesson(
        name="bounding_volume",
        label="Kinds of Bounding Volumes",
        slide="Bounding volume",
        begin="A bounding volume is a simple shape around a complicated one: a ray that misses it "
        "misses everything in it",
        look_for="Stars on the left are tested fast, stars at the bottom are tight; of this "
        "object none is both, and which is best depends on what is inside",
        question="Every object now has a volume around it, and the volume's test is fast. Is a "
        "ray still O(N)?",
        answer="Yes. Each ray is tested against every volume, only the constant is smaller. What "
        "is new is needed: volumes of volumes, a hierarchy",
        source="geometry.volume",
        sample="bunny",
        Settings=Settings,
        play=play,
        film="volume",
    ),
)
