"""Lesson "sub_volumes": a line through C hits C_i with the chance S_i / S, as thrown lines show.

The slide "Sub-volumes (basis for SAH)". C is the root's volume of a hierarchy, the C_i those of
nodes below. Lines fall, a bunch with every step of the knob: isotropic and uniform ones, or all
along one direction. Those that hit C count; green ones hit the chosen C_i as well, grey ones do
not. In the chart the counted shares of all C_i (one colour each) settle on their S_i / S, or along
one direction on the ratio of projected areas P_i(d) / P(d); around the chosen one stands its
standard error.

J. Goldsmith, J. Salmon: Automatic Creation of Object Hierarchies for Ray Tracing, IEEE CG&A 7(5),
1987. The mean projected area of a convex body is a quarter of its surface: Cauchy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import ramp
from ..geometry.rays import Rays
from ..geometry.sphere import Spheres
from ..progress import Progress
from ..sah.line_sample import (
    Ball,
    chords,
    parallel_lines_through,
    random_lines_through,
    volume_hits,
)
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .around import edges_of, surface_of
from .drawing import GREEN, GREY, Chart, Colour, coloured, picture_of, tinted
from .hierarchy import is_tree, tree_of
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .solid_efficiency import DIRECTIONS

BUNCH, BUNCHES = 64, 64
"""Lines that fall at once, and how often they do."""

SPREAD = 1.0
"""Size of the ball that lines fall through, in that around the scene's box."""

DRAWN = 64
"""Lines that are drawn: the last ones that hit C."""

PARTS = 4
"""Sub-volumes: those of two levels below the root."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    bunches: int = setting(
        8, "Bunches", f"How many bunches of {BUNCH} lines have fallen", minimum=1, maximum=BUNCHES
    )
    part: int = setting(3, "Sub-Volume", "Which C_i is looked at; the first is 0", minimum=0)
    direction: str = setting(
        "all", "Direction", "Where the lines go",
        choices={name: text.capitalize() for name, (text, _) in DIRECTIONS.items()},
    )  # fmt: skip


class SubVolumes(Play):
    """The volumes of some nodes, and lines at them.

    Attributes
    ----------
    nodes : (k,) int64
        Those of the C_i.
    expected : dict of str to (k,) float64
        By direction: S_i / S, or P_i(d) / P(d).
    lines : dict of str to (n, 2, 3) float64
        All that fall.
    hits : dict of str to (n,) bool
        Which of them hit C.
    parts_hit : dict of str to (n, k) bool
        Which hit each C_i, too.
    are_within : bool
        Whether volumes of this kind lie within those of their parents, which p_i = S_i / S takes
        for granted.
    """

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.scene = scene = bvh.scene
        self.nodes = nodes_below(bvh)
        self.ends = {"part": len(self.nodes) - 1}
        volumes = bvh.arrays.volumes
        self.volumes = [volumes._replace(rows=volumes.rows[[node]]) for node in (0, *self.nodes)]
        self.are_within = hasattr(volumes, "contain")
        self.edges = [edges_of(each)[0] for each in self.volumes]
        self.surfaces = [surface_of(each) for each in self.volumes]
        self.areas = np.array([float(each.areas()[0]) for each in self.volumes])
        ball = Ball.around(scene.lower, scene.upper, SPREAD)
        self.expected, self.lines, self.hits, self.parts_hit = {}, {}, {}, {}
        for done, (name, (_, direction)) in enumerate(DIRECTIONS.items()):
            progress.report(done, len(DIRECTIONS), "Throwing lines")
            rays = lines_through(ball, direction)
            hits = np.stack([volume_hits(rays, bvh, each) for each in self.volumes], axis=1)
            self.lines[name] = chords(rays)
            self.hits[name], self.parts_hit[name] = hits[:, 0], hits[:, 1:] & hits[:, :1]
            seen = self.areas if direction is None else self.shadows(direction)
            share = np.ones(len(self.nodes)) if not seen[0] > 0.0 else seen[1:] / seen[0]
            self.expected[name] = share

    def shadows(self, direction: np.ndarray) -> np.ndarray:
        """Return the areas of all volumes, that of C first, projected along a direction."""
        unit = direction / np.linalg.norm(direction)
        found = []
        for volume, surface in zip(self.volumes, self.surfaces, strict=True):
            if isinstance(volume, Spheres):
                found.append(np.pi * volume.rows[0, 3] ** 2)
                continue
            sides = surface[:, 1:] - surface[:, :1]
            found.append(0.25 * np.abs(np.cross(sides[:, 0], sides[:, 1]) @ unit).sum())
        return np.array(found)

    def counted(self, direction: str) -> tuple[np.ndarray, np.ndarray]:
        """Return after each bunch how many lines have hit C, (b,), and which share each C_i."""
        through = np.cumsum(self.hits[direction])
        both = np.cumsum(self.parts_hit[direction], axis=0)
        ends = BUNCH * np.arange(1, BUNCHES + 1) - 1
        n = through[ends]
        with np.errstate(invalid="ignore"):
            return n, np.where(n[:, None] > 0, both[ends] / n[:, None], np.nan)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after some bunches."""
        part, direction = settings.part, settings.direction
        fallen = BUNCH * settings.bunches
        counts, shares = self.counted(direction)
        n, p = int(counts[settings.bunches - 1]), shares[settings.bunches - 1]
        expected = self.expected[direction]
        error = float(np.sqrt(p[part] * (1.0 - p[part]) / n)) if n else np.nan

        through = np.flatnonzero(self.hits[direction][:fallen])[-DRAWN:]
        inside = self.parts_hit[direction][through, part]
        lines = self.lines[direction][through]
        colours = [colour_of(i, len(self.nodes)) for i in range(len(self.nodes))]
        top = min(1.3 * float(expected.max()), 1.0)
        chart = Chart.beside(self.scene, 0.0, float(max(counts[-1], 1)), top, 0.6)
        parts: list[Any] = [
            tinted(self.surfaces[1 + part], GREEN, 0.25),
            coloured(self.edges[0], GREY),
            coloured(lines[~inside], (*GREY[:3], 0.4)),
            coloured(lines[inside], (*GREEN[:3], 0.8)),
            chart.axes(),
        ]
        parts += [coloured(*each) for each in zip(self.edges[1:], colours, strict=True)]
        x = counts[: settings.bunches].astype(float)
        for i, colour in enumerate(colours):
            parts.append(chart.level(float(expected[i]), (*colour[:3], 0.45)))
            parts.append(chart.curve(x, np.minimum(shares[: settings.bunches, i], top), colour))
        own = shares[: settings.bunches, part]
        with np.errstate(invalid="ignore"):
            deviation = np.sqrt(own * (1.0 - own) / x)
        for side in (-1.0, 1.0):
            band = np.clip(own + side * deviation, 0.0, top)
            parts.append(chart.curve(x, band, (*colours[part][:3], 0.5)))
        symbol = "S_i / S" if direction == "all" else "P_i(d) / P(d)"
        marks = [
            Mark(
                chart.at(0.75, float(expected[i]) / top),
                f"C_{i}: {expected[i]:.3f}",
                colours[i][:3],
            )
            for i in np.argsort(-expected, kind="stable")
        ]
        marks += chart.named(f"{n} lines through C", f"share, and {symbol}")
        within = abs(p[part] - expected[part]) / error if error > 0.0 else 0.0
        caption = (
            f"{n} of {fallen} lines hit C, of these {100.0 * p[part]:.1f}% C_{part}: "
            f"p_{part} = {p[part]:.3f} ± {error:.3f}, {symbol} = {expected[part]:.3f}"
        )
        rows = [
            Row(f"p_{i}", f"{p[i]:.4f}, {symbol} = {expected[i]:.4f}",
                f"Counted, and as surfaces say: S_{i} = {self.areas[1 + i]:.4g}, "
                f"S = {self.areas[0]:.4g}")
            for i in range(len(self.nodes))
        ]  # fmt: skip
        rows.append(Row("Lines through C", str(n), f"Of {fallen} that have fallen"))
        rows.append(
            Row("Off by", f"{within:.2f} standard errors", f"p_{part}; beyond 2 once in 20 times")
        )
        if not self.are_within:
            rows.append(
                Row("Sticking Out", "possible", "Such volumes need not lie within that of the "
                    f"parent: {symbol} is not quite p_i")
            )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Any]:
        """Return few lines, some, many, and those of one direction."""
        chosen = [Settings(count, settings.part, settings.direction) for count in (1, 8, BUNCHES)]
        return [*chosen, Settings(BUNCHES, settings.part, "x")]

    def film(self, lesson: Lesson) -> Sequence[int]:
        """Return all bunches."""
        return range(1, BUNCHES + 1)


def colour_of(number: int, count: int) -> Colour:
    """Return the colour of a sub-volume."""
    red, green, blue = ramp(np.array([(number + 0.5) / count]))[0]
    return float(red), float(green), float(blue), 1.0


def nodes_below(bvh: BVH) -> np.ndarray:
    """Return nodes two levels below the root, and leaves above; all below it if they are none."""
    depths, is_leaf = bvh.depths(), bvh.arrays.size > 0
    below = np.flatnonzero((depths == 2) | (is_leaf & (depths < 2) & (depths > 0)))
    return below[:PARTS] if len(below) else np.zeros(1, np.int64)


def lines_through(ball: Ball, direction: np.ndarray | None) -> Rays:
    """Return all lines that fall, in an order of chance."""
    count = BUNCH * BUNCHES
    if direction is None:
        return random_lines_through(ball, count, seed=1)
    rays = parallel_lines_through(ball, direction, count)
    return rays.select(np.argsort(np.random.default_rng(1).random(count), kind="stable"))


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Throw all lines at the volumes."""
    return SubVolumes(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="sub_volumes",
        label="Lines through Sub-Volumes",
        slide="Sub-volumes (basis for SAH)",
        begin="A line that hits the volume hits a part of it with the probability p_i: the ratio "
        "of their surfaces, if both are convex and all lines are alike",
        look_for="The counted shares swing, and settle on the ratios of surfaces; along a single "
        "direction they settle elsewhere, on ratios of shadows",
        question="How many lines does it take for one more decimal of p_i?",
        answer="A hundred times as many: the standard error is the root of p (1 - p) / n. That is "
        "why the heuristic takes surfaces, which cost nothing, and no lines",
        source="sah.line_sample",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        suits=is_tree,
        Settings=Settings,
        play=play,
        film="bunches",
    ),
)
