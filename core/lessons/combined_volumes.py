"""Lesson "combined_volumes": unions and intersections of simple volumes follow a shape better.

The slide "Combined bounding solids". Grey are the simple volumes around the whole object, blue is
what the combination makes of them: what all members share, or a member around each half of the
object. Blue lines hit the tightest of the simple volumes, but not the combination: they are what it
saves. Orange ones hit it and not the object, green ones hit the object.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.structure import Structure
from ..geometry.combined import Intersection, is_polyhedral
from ..geometry.kinds import COMBINED
from ..progress import Progress
from ..sah.line_sample import Ball, chords, random_lines_through, sample_of, volume_hits
from ..sah.timing import affordable
from ..sah.volume_around import volume_around
from ..settings import setting
from .around import edges_of, kind_in_words, surface_of
from .drawing import BLUE, GREEN, GREY, ORANGE, coloured, picture_of, tinted
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .solid_efficiency import COUNTED, SPREAD

MADE_OF = {
    "box_and_sphere": ("aabb", "smallest_sphere"),
    "obb_and_kdop14": ("obb", "kdop14"),
    "two_boxes": ("aabb",),
    "two_spheres": ("smallest_sphere",),
}
"""The simple kinds that each combination is compared with."""

DRAWN = 160
"""Lines that are drawn."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    volume: str = setting(
        "box_and_sphere", "Volume", "What is put around the object",
        choices={name: text for name, (text, _) in COMBINED.items()},
    )  # fmt: skip
    with_lines: bool = setting(True, "Lines", "Draw lines at the object, by what they hit")


class Combination(Play):
    """A combined volume, the simple ones it is compared with, and lines at all of them."""

    def __init__(self, structure: Structure, kind: str, progress: Progress) -> None:
        scene = structure.scene
        self.kind, self.plain = kind, MADE_OF[kind]
        ball = Ball.around(scene.lower, scene.upper, SPREAD)
        self.above = ball.centre + np.array([0.0, 0.0, 1.05 * ball.radius])
        rays = random_lines_through(ball, affordable(*COUNTED), seed=1)
        self.volume = volume_around(scene, kind, progress)
        self.sample = sample_of(rays, structure, self.volume, progress)
        self.simple = [volume_around(scene, each, progress) for each in self.plain]
        self.surface = surface_of(self.volume)
        self.edges = np.concatenate([edges_of(each)[0] for each in self.simple])
        # With a sphere in it, an intersection has no edges but those of its members.
        is_round = isinstance(self.volume, Intersection) and not is_polyhedral(self.volume)
        self.own_edges = np.empty((0, 2, 3)) if is_round else edges_of(self.volume)[0]
        self.hits = [volume_hits(rays, structure, each) for each in self.simple]
        self.best = int(np.argmin([hits.sum() for hits in self.hits]))
        self.areas = [float(each.areas(progress)[0]) for each in (*self.simple, self.volume)]
        self.contents = [float(each.contents()[0]) for each in (*self.simple, self.volume)]

    def saved(self) -> np.ndarray:
        """Return which lines hit the tightest simple volume and not the combination, (n,) bool."""
        return self.hits[self.best] & ~self.sample.hits_volume

    def picture(self, settings: Settings) -> Picture:
        """Return the picture, with lines or without."""
        parts: list[Any] = [
            tinted(self.surface, BLUE, 0.3),
            coloured(self.edges, (*GREY[:3], 0.7)),
            coloured(self.own_edges, BLUE),
        ]
        if settings.with_lines:
            segments = chords(self.sample.rays)[:DRAWN]
            both, within = self.sample.hits_object[:DRAWN], self.sample.hits_volume[:DRAWN]
            saved = self.saved()[:DRAWN]
            parts.append(coloured(segments[within & ~both], (*ORANGE[:3], 0.8)))
            parts.append(coloured(segments[both], (*GREEN[:3], 0.8)))
            parts.append(coloured(segments[saved], BLUE))
        n, saved_lines = len(self.sample.rays), int(self.saved().sum())
        tightest = self.plain[self.best]
        p, p_simple = self.sample.hits_volume.mean(), self.hits[self.best].mean()
        caption = (
            f"{kind_in_words(self.kind)}: {100.0 * p:.1f}% of the lines hit it, of the tightest "
            f"simple volume, {kind_in_words(tightest)}, {100.0 * p_simple:.1f}%: "
            f"pA/pB = {self.sample.ratio:.2f} instead of "
            f"{self.sample.hits_object.sum() / max(int(self.hits[self.best].sum()), 1):.2f}"
        )
        rows = [
            Row(
                f"p, {kind_in_words(kind)}", f"{hits.mean():.4f}",
                f"Share of the lines that hit it; surface {area:.4g}, content {content:.4g}",
            )
            for kind, hits, area, content in zip(
                self.plain, self.hits, self.areas, self.contents, strict=False
            )
        ]  # fmt: skip
        rows += [
            Row(
                f"p, {kind_in_words(self.kind)}", f"{p:.4f}",
                f"Four mean shadows {self.areas[-1]:.4g}, content {self.contents[-1]:.4g}",
            ),
            Row("p, Object", f"{self.sample.hits_object.mean():.4f}", "What cannot be saved"),
            Row("Saved", f"{saved_lines} of {n} lines", "Blue: they hit the simple volume only"),
        ]  # fmt: skip
        marks = [Mark(self.above, f"pA/pB = {self.sample.ratio:.2f}")]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Any]:
        """Return it without lines and with them."""
        return [Settings(self.kind, False), Settings(self.kind, True)]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the volumes, and count lines."""
    return Combination(subject.structures[0], settings.volume, progress)


LESSONS = (
    Lesson(
        name="combined_volumes",
        label="Unions and Intersections of Volumes",
        slide="Combined bounding solids",
        begin="Simple volumes can be combined: a ray must be within all members of an "
        "intersection at once, or hit one member of a union",
        look_for="The corners of the box and the caps of the sphere are gone where both are asked; "
        "a union leaves out the gap between two halves",
        question="An intersection tests two volumes, so B is larger. Which of its members is to be "
        "tested first?",
        answer="The one that is fast and missed by most rays: whoever misses it needs no second "
        "test. The expected time is B1 + p1 B2, so the order matters, as with any and",
        source="geometry.combined",
        sample="bunny",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="with_lines",
        replays=("volume",),
    ),
)
