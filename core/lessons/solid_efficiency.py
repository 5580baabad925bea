"""Lesson "solid_efficiency": how tight a bounding volume is, by lines in three colours.

The slide "Bounding solid efficiency". Grey lines miss the volume and cost its test only, orange
ones hit it but not the object, in vain; green ones hit both. pA / pB is the share of green ones
among those that hit the volume. Along one direction it is a ratio of projected areas.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.structure import Structure
from ..geometry.kinds import COMBINED, KINDS
from ..progress import Progress
from ..sah.line_sample import (
    Ball,
    LineSample,
    chords,
    parallel_lines_through,
    random_lines_through,
    sample_of,
)
from ..sah.timing import affordable
from ..sah.volume_around import volume_around
from ..settings import setting
from .around import edges_of, hull_surface, kind_in_words
from .drawing import BLUE, GREEN, GREY, ORANGE, Lines, coloured, picture_of
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

SPREAD = 1.3
"""Size of the ball that lines are drawn through, in that around the scene's box."""

COUNTED = 20_000, 1000
"""Lines that are counted, and where kernels run as plain Python."""

DRAWN = 160
"""Lines that are drawn."""

DIRECTIONS = {
    "all": ("random lines", None),
    "x": ("lines along x", np.array([1.0, 0.0, 0.0])),
    "y": ("lines along y", np.array([0.0, 1.0, 0.0])),
    "z": ("lines along z", np.array([0.0, 0.0, 1.0])),
    "diagonal": ("lines along a diagonal", np.array([1.0, 1.0, 1.0])),
}
"""What lines are called, and their direction."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    volume: str = setting(
        "aabb", "Volume", "What is put around the object",
        choices={name: text for name, (text, _) in (KINDS | COMBINED).items()},
    )  # fmt: skip
    direction: str = setting(
        "y", "Direction", "Where the lines go",
        choices={name: text.capitalize() for name, (text, _) in DIRECTIONS.items()},
    )  # fmt: skip


class Shares(Play):
    """A volume around an object, and who hits what of both.

    Parameters
    ----------
    structure : Structure
        Any structure over the object; it only answers which lines hit.
    directions : sequence of str
        Of DIRECTIONS.
    """

    def __init__(
        self, structure: Structure, kind: str, directions: Sequence[str], progress: Progress
    ) -> None:
        scene = structure.scene
        ball = Ball.around(scene.lower, scene.upper, SPREAD)
        self.kind = kind
        self.volume = volume_around(scene, kind, progress)
        self.hull = hull_surface(scene, progress)
        self.edges, _ = edges_of(self.volume)
        self.area = float(self.volume.areas(progress)[0])
        self.above = ball.centre + np.array([0.0, 0.0, 1.05 * ball.radius])
        self.counted: dict[str, LineSample] = {}
        self.drawn: dict[str, LineSample] = {}
        for name in directions:
            for samples, count in ((self.counted, affordable(*COUNTED)), (self.drawn, DRAWN)):
                _, direction = DIRECTIONS[name]
                if direction is None:
                    rays = random_lines_through(ball, count, seed=1)
                else:
                    rays = parallel_lines_through(ball, direction, count)
                samples[name] = sample_of(rays, structure, self.volume, progress)

    def parts(self, direction: str) -> list[Lines]:
        """Return the lines of a picture."""
        return [*coloured_lines(self.drawn[direction]), coloured(self.edges, BLUE)]

    def caption(self, direction: str) -> str:
        """Return the figures in words."""
        counted = self.counted[direction]
        name, along = DIRECTIONS[direction]
        sign = "=" if along is None else "along this direction ="
        return (
            f"{kind_in_words(self.kind)}, {name}: pA/pB {sign} {counted.ratio:.2f}; of all lines "
            f"{100.0 * counted.hits_volume.mean():.0f}% hit the volume (not grey), "
            f"{100.0 * counted.hits_object.mean():.0f}% the object (green)"
        )

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of lines in one direction."""
        counted = self.counted[settings.direction]
        ratio, n = counted.ratio, int(counted.hits_volume.sum())
        error = float(np.sqrt(ratio * (1.0 - ratio) / max(n, 1)))
        deviation = f" ± {error:.3f}" if settings.direction == "all" else ""
        rows = (
            Row(
                "pA/pB", f"{ratio:.3f}{deviation}",
                "Share of the lines through the volume that hit the object",
            ),
            Row("Lines", f"{len(counted.rays)}", "Counted; fewer are drawn"),
            Row("Hit the Volume", str(n), "Orange and green ones"),
            Row("Hit the Object", str(int(counted.hits_object.sum())), "Green ones"),
            Row(
                "Hull / Volume", f"{self.hull / self.area if self.area > 0.0 else 1.0:.3f}",
                "Ratio of surfaces: what pA/pB of all directions is for a convex object",
            ),
        )  # fmt: skip
        direction = settings.direction
        marks = [Mark(self.above, f"pA/pB = {ratio:.2f}")]
        return picture_of(self.parts(direction), self.caption(direction), marks=marks, rows=rows)


def coloured_lines(sample: LineSample) -> list[Lines]:
    """Return the lines of a sample in three colours."""
    segments = chords(sample.rays)
    volume, both = sample.hits_volume, sample.hits_object
    return [
        coloured(segments[~volume], (*GREY[:3], 0.35)),
        coloured(segments[volume & ~both], ORANGE),
        coloured(segments[both], GREEN),
    ]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the volume, and count lines."""
    return Shares(subject.structures[0], settings.volume, tuple(DIRECTIONS), progress)


LESSONS = (
    Lesson(
        name="solid_efficiency",
        label="How Tight Is a Bounding Volume?",
        slide="Bounding solid efficiency",
        begin="Of the rays that hit the volume, only some hit the object: the others were tested "
        "in vain",
        look_for="Orange lines are the empty corners of the volume; a tighter kind turns them grey",
        question="Which convex volume has the largest pA/pB, and when is it 1?",
        answer="The convex hull: every convex volume contains it, and whoever hits the object hits "
        "the hull. It is 1 if no line passes through the hull without hitting, so for every convex "
        "object, but not for one with a hole",
        source="sah.line_sample",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="direction",
        replays=("volume",),
    ),
)
