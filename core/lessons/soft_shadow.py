"""Lesson "soft_shadow": the share of a light that is seen, by one cone and by many rays.

The slide "Generalized rays": computing more than a point, "soft shadows (shadow ratio)". A light of
some size stands above the scene. From a point below, blue is the cone to it, orange what is in the
way; the chart has the share of the light that is seen along a line through the shadow: green by
cones, exactly (:mod:`..probes.soft_shadow`), grey stars by shadow rays to points of the light.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..probes.beam import area_of
from ..probes.coverage import UNIT_SQUARE, Covering
from ..probes.soft_shadow import Lamp, blockers, lamp_of, shares_seen
from ..progress import Progress
from ..scene import AREA, Light
from ..scene.as_triangles import as_triangles
from ..settings import setting
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    Chart,
    Faces,
    Lines,
    coloured,
    faint,
    items_in,
    outlines,
    picture_of,
    tinted,
)
from .lesson import Lesson, Play, Subject, build
from .picture import Mark, Picture, Row

POINTS = 97
"""Along the line."""

CIRCLE = 40
"""Corners of a round light as it is drawn."""

MOST_RAYS = 256

ABOVE = np.array([-0.15, -0.25, 0.4])
"""Where the light is: from the middle of the scene's ceiling, in its diagonals."""

HALF = 0.12
"""Half the size of the light, in the scene's diagonals."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    point: int = setting(
        POINTS // 3, "Point", "Which one of the line", minimum=0, maximum=POINTS - 1
    )
    rays: int = setting(
        16, "Rays", "Shadow rays from each point to compare with", unit="rays", minimum=1,
        maximum=MOST_RAYS,
    )  # fmt: skip
    light: str = setting(
        "disc", "Light", "Its shape",
        choices={
            "disc": "A disc, seen by a cone",
            "square": "A square, seen by a pyramid",
            "star": "A star, seen by a beam",
        },
    )  # fmt: skip


def circle() -> np.ndarray:
    """Return points around the unit circle, (CIRCLE, 2)."""
    angle = 2.0 * np.pi * np.arange(CIRCLE) / CIRCLE
    return np.column_stack([np.cos(angle), np.sin(angle)])


def star() -> np.ndarray:
    """Return the corners of a star of five points in the unit circle, (10, 2)."""
    angle = 0.5 * np.pi + 2.0 * np.pi * np.arange(10) / 10
    radius = np.where(np.arange(10) % 2, 0.382, 1.0)
    return radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])


def points_on(lamp: Lamp, count: int, rng: np.random.Generator) -> np.ndarray:
    """Return points that are evenly spread over a light, (count, 3)."""
    x, y = rng.random((2, count))
    if lamp.is_round:
        angle, radius = 2.0 * np.pi * x, np.sqrt(y)
        on = radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        return lamp.middle + on @ lamp.half_axes
    # Fans of triangles, each taken as often as its area has it.
    fans = [np.stack([part[[0, n, n + 1]] for n in range(1, len(part) - 1)]) for part in lamp.parts]
    triangles = np.concatenate(fans)
    areas = np.array([area_of(each) for each in triangles])
    a, b, c = triangles[rng.choice(len(triangles), count, p=areas / areas.sum())].swapaxes(0, 1)
    root = np.sqrt(x)[:, None]
    on = (1.0 - root) * a + root * (1.0 - y[:, None]) * b + root * y[:, None] * c
    return lamp.middle + on @ lamp.half_axes


class Shadow(Play):
    """A line through a soft shadow."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        scene = self.scene = as_triangles(subject.scene, "cones meet triangles only")
        progress.report(0, 5, "Building a BVH")
        self.covering = Covering(build(scene, "bvh", progress))
        size, lower, upper = scene.diagonal, scene.lower, scene.upper
        middle = 0.5 * (lower + upper)
        place = np.array([middle[0], middle[1], upper[2]]) + ABOVE * size
        half = HALF * size
        axes = np.array([(half, 0.0, 0.0), (0.0, half, 0.0)])
        down = np.array([0.0, 0.0, -1.0])
        square = Light(AREA, place, down, 180.0, "light", axes)
        self.lights = {
            "disc": lamp_of(dataclasses.replace(square, is_round=True)),
            "square": lamp_of(square),
            "star": lamp_of(place + star() @ axes),
        }
        begin = np.array([lower[0] - 0.15 * size, middle[1], lower[2]])
        end = np.array([upper[0] + 0.15 * size, middle[1], lower[2]])
        self.share = np.linspace(0.0, 1.0, POINTS)
        self.points = begin + self.share[:, None] * (end - begin)
        self.exact, self.sampled, self.samples = {}, {}, {}
        rng = np.random.default_rng(1)
        for done, (kind, light) in enumerate(self.lights.items(), 1):
            progress.report(done, 5, "Asking how much of the light is seen")
            self.exact[kind] = shares_seen(self.covering, self.points, light, progress)
            there = points_on(light, MOST_RAYS, rng)
            ways = there[None] - self.points[:, None]
            rays = Rays.from_arrays(
                np.repeat(self.points, MOST_RAYS, axis=0), ways.reshape(-1, 3), 1.0 - 1e-9,
                t_min=1e-9,
            )  # fmt: skip
            hits, _ = self.covering.structure.trace(rays, progress=progress)
            is_free = (hits.primitive < 0).reshape(POINTS, MOST_RAYS)
            self.samples[kind] = there
            self.sampled[kind] = np.cumsum(is_free, axis=1) / np.arange(1, MOST_RAYS + 1)
        blockers(self.covering, self.points[0], self.lights["disc"])

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one point."""
        light, kind = self.lights[settings.light], settings.light
        point, n = self.points[settings.point], settings.rays
        exact, by_rays = self.exact[kind], self.sampled[kind][:, n - 1]
        items = blockers(self.covering, point, light)
        rim = self.rim(kind)
        cone = np.stack([np.broadcast_to(point, rim.shape), rim], axis=1)
        middle = np.broadcast_to(light.middle, rim.shape)
        lamp = np.stack([middle, rim, np.roll(rim, -1, axis=0)], axis=1)
        size = self.scene.diagonal
        parts: list[Lines | Faces] = [
            tinted(lamp, GREEN, 0.5),
            coloured(outlines(rim[None]), GREEN),
            tinted(np.concatenate([cone, np.roll(rim, -1, axis=0)[:, None]], axis=1), BLUE, 0.08),
            coloured(cone[:: max(len(cone) // 8, 1)], faint(BLUE, 0.8)),
            items_in(self.scene, items, ORANGE, 0.6),
            coloured(self.points[[0, -1]][None], faint(GREY, 0.8)),
            coloured(stars(point[None], np.array([0.06 * size])), BLUE),
        ]
        ends = self.samples[kind][:n]
        rays = np.stack([np.broadcast_to(point, ends.shape), ends], axis=1)
        parts.append(coloured(rays, faint(GREY, 0.35)))
        chart = Chart.beside(self.scene, 0.0, 1.0, 1.1)
        parts += [
            chart.axes(),
            chart.curve(self.share, exact, GREEN),
            chart.stars(self.share, by_rays, GREY),
            chart.mark(float(self.share[settings.point]), float(exact[settings.point]), BLUE),
        ]
        marks = [
            Mark(light.middle, "light", GREEN[:3]), Mark(point, "point", BLUE[:3]),
            *chart.named("place on the line", "share of the light that is seen"),
        ]  # fmt: skip
        here, there = float(exact[settings.point]), float(by_rays[settings.point])
        error = float(np.sqrt(np.mean((by_rays - exact) ** 2)))
        rays_word = "ray" if n == 1 else "rays"
        probe = {"disc": "cone", "square": "pyramid", "star": "beam"}[kind]
        caption = (
            f"From the point {here:.1%} of the light is seen, says one {probe}; {n} shadow "
            f"{rays_word} say {there:.1%}. Along the line they are off by {error:.2g} RMS"
        )
        partly = float(np.mean((exact > 1e-9) & (exact < 1.0 - 1e-9)))
        rows = (
            Row("Seen", f"{here:.4%}", f"Share of the light, by one {probe}, exact"),
            Row("By Rays", f"{there:.4%}", f"Of {n} shadow {rays_word} that are free"),
            Row("Error, RMS", f"{error:.2g}", f"Of {n} {rays_word}, over the line"),
            Row("In the Way", str(len(items)), f"Triangles that the {probe} meets"),
            Row("Penumbra", f"{partly:.0%}", "Share of the line that sees it in part"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def rim(self, kind: str) -> np.ndarray:
        """Return the border of a light, (k, 3)."""
        turn = {"disc": circle(), "square": UNIT_SQUARE, "star": star()}[kind]
        # The star's own axes are others; its corners are those of the square's.
        axes = self.lights["square"].half_axes
        border: np.ndarray = self.lights["square"].middle + turn @ axes
        return border

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return a point of the penumbra by few rays and by many, for each light."""
        exact = self.exact["disc"]
        half = int(np.abs(exact - 0.5).argmin())
        dark = int(exact.argmin())
        return [
            Settings(half, 4), Settings(half, MOST_RAYS), Settings(half, 16, "square"),
            Settings(half, 16, "star"), Settings(dark, 16),
        ]  # fmt: skip


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Ask from all points of the line."""
    return Shadow(subject, progress)


LESSONS = (
    Lesson(
        name="soft_shadow",
        label="A Soft Shadow by Cones",
        slide="Generalized rays",
        begin="A shadow ray says of one point of a light whether it is hidden; one cone says how "
        "much of the light is",
        look_for="The shares of few rays jump in steps and scatter around the curve of the cones; "
        "only in the penumbra do they disagree",
        question="How many rays does it take to be off by half as much?",
        answer="Four times as many: the error of a mean goes down with the root of their number. "
        "The cone has none, whatever the light's size",
        source="probes.soft_shadow",
        sample="room:open=true,mirrors=0",
        Settings=Settings,
        play=play,
        film="point",
    ),
)
