"""Lesson "volume_efficiency": does a volume pay? B + p I < I, with the times measured or set.

The slide "Bounding volume efficiency". Of the lines at the object grey ones miss the volume: they
cost B. Orange ones hit it in vain and green ones hit the object, too: they cost B + I. The bars
beside are the expected time of a ray: on the left without the volume, on the right with it, B blue
and p I orange.

p belongs to the rays, so the lines come isotropic and uniform through a ball around the object. It
is `spread` times as large as the one through the corners of its box: the larger, the more lines
miss. B and I are measured on this machine where they are not set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.kinds import KINDS
from ..geometry.triangles import Triangles
from ..kernels import announcing
from ..progress import Progress
from ..sah.line_sample import Ball, random_lines_through, sample_of
from ..sah.timing import affordable, time_of_object, time_of_volume, verdict
from ..sah.volume_around import volume_around
from ..scene import Scene
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .around import edges_of
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Chart, coloured, picture_of
from .lesson import FILM, Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .solid_efficiency import COUNTED, coloured_lines

DRAWN = 60
"""Lines that are drawn."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    volume: str = setting(
        "aabb", "Volume", "What is put around the object",
        choices={name: text for name, (text, _) in KINDS.items()},
    )  # fmt: skip
    spread: float = setting(
        1.3, "Spread", "Size of the ball that the lines come through, in the smallest one",
        minimum=1.0, maximum=4.0,
    )  # fmt: skip
    B: float = setting(
        0.0, "B", "Time of testing the volume; 0 takes what was measured here",
        unit="ns", minimum=0.0, maximum=1e4, unset="measured",
    )  # fmt: skip
    I: float = setting(  # noqa: E741  the lecture's
        0.0, "I", "Time of testing all of the object; 0 takes what was measured here",
        unit="ns", minimum=0.0, maximum=1e6, unset="measured",
    )  # fmt: skip


class Efficiency(Play):
    """A volume around an object: its times, and lines at it."""

    def __init__(self, scene: Scene, settings: Settings, progress: Progress) -> None:
        self.scene = scene
        structure = BVH.build(scene, BVH.Settings(), progress)
        self.volume = volume_around(scene, settings.volume, progress)
        self.edges, _ = edges_of(self.volume)
        ball = Ball.around(scene.lower, scene.upper, settings.spread)
        rays = random_lines_through(ball, affordable(*COUNTED), seed=1)
        with announcing(progress, f"the test of {settings.volume}"):
            self.counted = sample_of(rays, structure, self.volume, progress)
            few = rays.select(np.arange(DRAWN))
            self.drawn = sample_of(few, structure, self.volume, progress)
            triangles = scene.items()
            self.I = time_of_object(triangles, rays.arrays(), progress)
            self.B = time_of_volume(self.volume, rays.arrays(), triangles.reach, progress)
        self.p = float(self.counted.hits_volume.mean())
        self.error = float(np.sqrt(self.p * (1.0 - self.p) / len(rays)))

    def picture(self, settings: Settings) -> Picture:
        """Return the picture with these times."""
        B, I, p = settings.B or self.B, settings.I or self.I, self.p  # noqa: E741
        found = verdict(B, I, p)
        with_volume, pays = found["time_with"], found["pays"]
        chart = Chart.beside(
            self.scene, 0.0, 3.2, 1.15 * max(with_volume, I), settings.spread - 0.4
        )
        parts: list[Any] = [
            *coloured_lines(self.drawn),
            coloured(self.edges, BLUE),
            chart.axes(),
            chart.bar(0.4, 1.3, 0.0, I, ORANGE),
            chart.bar(1.9, 2.8, 0.0, B, BLUE),
            chart.bar(1.9, 2.8, B, with_volume, ORANGE),
            chart.level(I, (*GREY[:3], 0.8)),
        ]
        marks = [
            Mark(chart.at(0.5, 1.2), "it pays" if pays else "it does not pay",
                 GREEN[:3] if pays else RED[:3]),
            Mark(chart.points([0.5], [0.5 * I])[0], "I"),
            Mark(chart.points([2.0], [B + 0.5 * p * I])[0], "p I"),
            Mark(chart.points([2.85], [0.5 * B])[0], "B", BLUE[:3]),
        ]  # fmt: skip
        sign = "<" if pays else ">="
        caption = (
            f"B + p I = {B:.4g} + {p:.3f} × {I:.4g} = {with_volume:.4g} ns {sign} I = {I:.4g} ns: "
            f"the {settings.volume} {'pays' if pays else 'does not pay'}"
        )
        rows = (
            Row("B", f"{B:.4g} ns", f"Testing the volume: {origin_of(settings.B)}"),
            Row("I", f"{I:.4g} ns", f"Testing the object's triangles: {origin_of(settings.I)}"),
            Row(
                "p", f"{p:.4f} ± {self.error:.4f}",
                f"Share of {len(self.counted.rays)} lines that hit the volume; counted",
            ),
            Row("B + p I", f"{with_volume:.4g} ns", "Expected time of a ray with the volume"),
            Row("Break-Even p", f"{found['break_even']:.4f}", "1 - B / I: below it, it pays"),
            Row("Speed-Up", f"{found['speed_up']:.2f}", "I / (B + p I)"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Any]:
        """Return the measured times, and two volumes that are too dear."""
        return [settings, *(settings_with(settings, share * self.I) for share in (0.3, 0.9))]

    def film(self, lesson: Lesson) -> Sequence[float]:
        """Return B from what was measured up to a volume that is dearer than the object."""
        last = min(1.1 * self.I, 1e4)
        return [self.B + (last - self.B) * i / (FILM - 1) for i in range(FILM)]


def settings_with(settings: Settings, B: float) -> Settings:
    """Return settings with another B, as far as it goes."""
    return Settings(settings.volume, settings.spread, min(B, 1e4), settings.I)


def origin_of(given: float) -> str:
    """Say where a time comes from."""
    return "set by hand" if given else "measured here"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the volume, count lines and measure times."""
    scene = subject.scene.flat()
    if not isinstance(scene.geometry, Triangles):
        scene.refuse_other_items("the test of an object is timed")
    return Efficiency(scene, settings, progress)


LESSONS = (
    Lesson(
        name="volume_efficiency",
        label="Does a Bounding Volume Pay?",
        slide="Bounding volume efficiency",
        begin="With a volume every ray pays B for its test, and only those that hit it pay I for "
        "what is inside",
        look_for="The right bar is lower than the left one as long as p is below 1 - B / I: raise "
        "B until the verdict turns, or let the lines come from a larger ball",
        question="All rays hit the volume, such as those of a camera that looks at nothing else. "
        "Does it pay?",
        answer="No: p = 1, and B + I is more than I. A volume pays by the rays that miss it, and "
        "p belongs to the rays as much as to the volume",
        source="sah.timing",
        sample="sah_example",
        Settings=Settings,
        play=play,
        film="B",
        replays=("volume", "spread"),
    ),
)
