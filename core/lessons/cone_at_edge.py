"""Lesson "cone_at_edge": a cone and a pyramid at an edge, and the share that is covered.

The slide "Generalized rays": to know more than a point of f(x, y), "for anti-aliasing". A ray says
of a pixel what lies at its middle; a cone or a pyramid says how much of it is covered, and by what
(:mod:`..probes.coverage`). Orange is what the probe of one pixel sees, grey what it meets and does
not see. Beside the model are its cross section, with what is seen in each place, and the picture of
all pixels by shares. Pixels in the middle of edges come first.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.cones import ROUND, SQUARE, Spread
from ..geometry.marks import cone_lines
from ..probes.beam_picture import coverage
from ..probes.coverage import Coverage, Covering, beam_around
from ..probes.visible import MISS, Pieces
from ..progress import Progress
from ..scene.as_triangles import as_triangles
from ..scene.camera_rays import Window, camera_axes, camera_rays, window_of
from ..settings import setting
from .beams import own_camera
from .drawing import BLUE, GREY, ORANGE, Faces, Lines, coloured, counted, items_in, picture_of
from .heat_map import viridis
from .lesson import Lesson, Play, Subject, build
from .picture import Image, Mark, Picture, Row

WIDTH, HEIGHT = 32, 24
"""Pixels of the picture."""

SIDE = 16
"""Rays of a pixel in a row and in a column, to compare with."""

SECTION = 240
"""Pixels of the picture of a cross section."""

MOST_PIXELS = 200
PAPER = 0.93


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    pixel: int = setting(
        0, "Pixel", "Which one; those that are covered by about a half come first", minimum=0
    )
    shape: str = setting(
        ROUND, "Shape", "What is cast for a pixel",
        choices={ROUND: "A round cone, as large as the pixel", SQUARE: "A pyramid around it"},
    )  # fmt: skip


class Edge(Play):
    """The probes of a small picture."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        self.scene = as_triangles(subject.scene, "cones meet triangles only")
        progress.report(0, 3, "Building a BVH")
        self.covering = Covering(build(self.scene, "bvh", progress))
        self.camera = own_camera(self.scene)
        self.rays = camera_rays(self.camera, WIDTH, HEIGHT)
        self.window = window_of(self.camera, WIDTH, HEIGHT)
        self.right = camera_axes(self.camera)[1]
        fine, _ = self.covering.structure.trace(
            camera_rays(self.camera, SIDE * WIDTH, SIDE * HEIGHT), progress=progress
        )
        hits = (fine.primitive >= 0).reshape(HEIGHT, SIDE, WIDTH, SIDE)
        self.sampled = hits.mean(axis=(1, 3))
        self.shares: dict[str, np.ndarray] = {}
        for done, shape in enumerate((ROUND, SQUARE)):
            shares = np.round(self.sampled).ravel()
            # Where all rays of a pixel and of those around agree, it is not at an edge.
            for pixel in self.near_edges():
                if pixel % 32 == 0:
                    progress.report(done, 2, "Casting cones and pyramids")
                shares[pixel] = self.covered(int(pixel), shape).shares.sum()
            self.shares[shape] = shares.reshape(HEIGHT, WIDTH)
        shares = self.shares[SQUARE].ravel()
        order = np.argsort(np.abs(shares - 0.5), kind="stable")
        order = order[(shares[order] > 1e-9) & (shares[order] < 1.0 - 1e-9)][:MOST_PIXELS]
        if not len(order):
            raise InputError(f"no edge of {self.scene.name} is seen from the front")
        self.order = order
        self.ends = {"pixel": len(order) - 1}

    def near_edges(self) -> np.ndarray:
        """Return the numbers of pixels that are not all covered, nor not at all, or beside one."""
        partly = (self.sampled > 0.0) & (self.sampled < 1.0)
        padded = np.pad(self.sampled, 1, mode="edge")
        for dy in range(3):
            for dx in range(3):
                beside = padded[dy : dy + HEIGHT, dx : dx + WIDTH]
                partly |= beside != np.round(self.sampled)
        return np.flatnonzero(partly)

    def spread(self, pixel: int, shape: str) -> Spread:
        """Return what is around the ray of a pixel, with the solid angle of the pixel."""
        length = float(np.linalg.norm(self.rays.directions[pixel]))
        scale = (1.0 if shape == SQUARE else 2.0 / math.sqrt(math.pi)) / length**1.5
        wide = scale * self.window.half_width / WIDTH
        high = scale * self.window.half_height / HEIGHT
        return Spread(math.atan(wide), math.atan(high), shape, self.right)

    def covered(self, pixel: int, shape: str) -> Coverage:
        """Return what covers the probe of a pixel."""
        return self.covering.coverage(self.rays, pixel, self.spread(pixel, shape))

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one pixel's probe."""
        pixel, shape = int(self.order[settings.pixel]), settings.shape
        spread = self.spread(pixel, shape)
        met, steps = self.covering.structure.cover(self.rays, pixel, spread)
        pieces = self.covering.pieces(met, beam_around(self.rays, pixel, spread))
        seen = self.covered(pixel, shape)
        share, row, column = float(seen.shares.sum()), *divmod(pixel, WIDTH)
        hidden = np.setdiff1d(met, seen.items)
        parts: list[Lines | Faces] = [
            items_in(self.scene, hidden, GREY, 0.5), items_in(self.scene, seen.items, ORANGE, 0.6),
            coloured(self.outline(pixel, spread), BLUE),
        ]  # fmt: skip
        origin = self.rays.origins[pixel]
        marks = [Mark(origin, "eye")]
        sampled = float(self.sampled[row, column])
        caption = (
            f"The {shape} of pixel {column}, {row} meets "
            f"{counted(len(met), 'triangle', 'triangles')} and sees {len(seen.items)}, which cover "
            f"{share:.1%} of it; of {SIDE * SIDE} rays through the pixel {sampled:.1%} hit"
        )
        rows = (
            Row("Covered", f"{share:.4%}", "Of the cross section, by exact areas"),
            Row("Of Rays", f"{sampled:.4%}", f"{SIDE} x {SIDE} through the square pixel"),
            Row("Met", str(len(met)), "Triangles with a part in the probe"),
            Row("Seen", str(len(seen.items)), "Those that no other hides"),
            Row("Triangle Tests", str(steps.tally()["N_IT"]), "N_IT of its walk through a BVH"),
            Row("Pixels at Edges", str(len(self.order)), "Those that are covered in part"),
        )  # fmt: skip
        images = [self.section(pieces, shape), self.image(shape, row, column)]
        return picture_of(parts, caption, marks=marks, rows=rows, images=images)

    def outline(self, pixel: int, spread: Spread) -> np.ndarray:
        """Return the probe as segments, (k, 2, 3), to behind the scene."""
        origin, way = self.rays.origins[pixel], self.rays.directions[pixel]
        unit = way / np.linalg.norm(way)
        middle = 0.5 * (self.scene.lower + self.scene.upper)
        end = float(np.linalg.norm(middle - origin)) + 0.4 * self.scene.diagonal
        if spread.shape == ROUND:
            return cone_lines(origin, unit, spread.half_angle, 0.0, end)
        (across,), (above,) = spread.axes(way[None])
        wide, high = spread.half_widths()
        signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
        rim = origin + end * (unit + signs[:, :1] * wide * across + signs[:, 1:] * high * above)
        sides = np.stack([np.broadcast_to(origin, rim.shape), rim], axis=1)
        return np.concatenate([sides, np.stack([rim, np.roll(rim, -1, axis=0)], axis=1)])

    def section(self, pieces: Pieces, shape: str) -> Image:
        """Return the cross section: a shade for each triangle, paper where nothing is seen."""
        items = np.unique(pieces.items)
        place = np.searchsorted(items, pieces.items)
        colours = viridis((place + 1.0) / (len(items) + 1.0))
        colours[pieces.items == MISS] = PAPER
        frame = Window(0.0, 0.0, 1.05, 1.05)
        pixels = coverage(pieces, colours - 1.0, frame, SECTION, SECTION) + 1.0
        x = 1.05 * (2.0 * (np.arange(SECTION) + 0.5) / SECTION - 1.0)
        far = np.hypot(x[None], x[:, None])
        if shape == ROUND:
            pixels[far > 1.0] = 1.0 - 0.3 * (1.0 - pixels[far > 1.0])
        return Image("cross section", np.clip(pixels, 0.0, 1.0))

    def image(self, shape: str, row: int, column: int) -> Image:
        """Return the picture by shares, the pixel that is looked at framed."""
        shares = self.shares[shape]
        size = 12
        grey = np.repeat(np.repeat(PAPER - 0.75 * shares, size, axis=0), size, axis=1)
        pixels = np.repeat(grey[:, :, None], 3, axis=2)
        top, left = size * row, size * column
        for part in (
            (slice(top, top + size), slice(left, left + 2)),
            (slice(top, top + size), slice(left + size - 2, left + size)),
            (slice(top, top + 2), slice(left, left + size)),
            (slice(top + size - 2, top + size), slice(left, left + size)),
        ):
            pixels[part] = ORANGE[:3]
        return Image("covered", np.clip(pixels, 0.0, 1.0), shares)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return two pixels by either shape."""
        last = self.ends["pixel"]
        numbers = sorted({0, last // 2})
        return [Settings(number, shape) for number in numbers for shape in (ROUND, SQUARE)]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Cast a probe for every pixel near an edge."""
    return Edge(subject, progress)


LESSONS = (
    Lesson(
        name="cone_at_edge",
        label="A Cone at an Edge",
        slide="Generalized rays",
        begin="A ray sees one point of its pixel, so edges have steps; a cone or a pyramid knows "
        "how much of the pixel is covered, and the edge gets a grey of its own",
        look_for="The share of the cross section is exact, and 256 rays come near it; the cone is "
        "cut off at the corners of the pixel that the pyramid has",
        question="What does a scene have to be like for this, and what does a ray not care about?",
        answer="A probe must know how much of itself an object covers, not only whether it is "
        "hit: easy for polygons and spheres, hard for anything curved; a ray takes all that it "
        "can be intersected with",
        source="probes.coverage",
        sample="suzanne:subdivisions=0",
        Settings=Settings,
        play=play,
        film="pixel",
    ),
)
