"""Lesson "heat map": what each pixel of a picture costs, in any counter of the structure.

The colours are those of viridis, whose lightness grows evenly (S. van der Walt, N. Smith, 2015, in
the public domain). They go from the least value to that which 995 of 1000 pixels do
not exceed; a few silhouettes would leave no colours for the rest otherwise. The scale below the map
is a histogram as well: a bar for every 64th of that range, as high as the logarithm of how many
pixels lie in it, since most of them lie in the first; pixels whose counter is 0 are in none.

The map comes coarse first, every eighth pixel of every eighth row, then finer; no ray is traced
twice for that.

With *Stop at First Hit* rays end at the nearest hit; without they go on through all of the scene,
as the lines do that the surface area heuristic is derived from.
"""

from __future__ import annotations

import copy
import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.counters import (
    CELLS_SKIPPED,
    ENTERED,
    ENTERED_IN_VAIN,
    MAILBOX_HITS,
    N_EETS,
    N_ETS,
    N_IT,
    N_TS,
    POSTPONED_HITS,
    VOLUME_TESTS,
    counters_within,
)
from ..contract.structure import Structure
from ..geometry.rays import ALL, CLOSEST, Rays
from ..progress import Progress
from ..scene import Camera, Scene
from ..scene.camera_rays import camera_rays, framing_camera
from ..settings import setting
from .lesson import Lesson, Play, Subject
from .picture import Image, Picture, Row
from .ray import PALETTE
from .ray_path import Walk, segments_of

VIRIDIS = np.array([
    (68, 1, 84), (72, 40, 120), (62, 73, 137), (49, 104, 142), (38, 130, 142), (31, 158, 137),
    (53, 183, 121), (110, 206, 88), (181, 222, 43), (253, 231, 37),
]) / 255.0  # fmt: skip

ASPECT = 4, 3

QUERIES = {True: CLOSEST, False: ALL}
"""How rays are traced that stop at the first hit, and those that do not."""

BRIGHTEST = 0.995
"""Share of the pixels that the colours tell apart."""

BARS, STRIP = 64, 0.12
"""Bars of the histogram, and its height in that of the map."""

COARSE = 8, 4, 2, 1
"""Of how many pixels in a row, and in a column, one is traced: at first, and at last."""

CROSS = np.array((1.0, 0.2, 0.3))
"""Colour of the cross around the chosen pixel."""

COUNTERS = (
    N_TS, N_IT, N_ETS, N_EETS, VOLUME_TESTS, MAILBOX_HITS, POSTPONED_HITS, CELLS_SKIPPED, ENTERED,
    ENTERED_IN_VAIN, *(each for each in counters_within(1) if each.name in ("N_TS_1", "N_IT_1")),
)  # fmt: skip
"""What can be looked at, where the structure counts it."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    counter: str = setting(
        "N_TS", "Counter", "What is counted per pixel",
        choices={counter.name: counter.meaning for counter in COUNTERS},
    )  # fmt: skip
    stop: bool = setting(
        True, "Stop at First Hit", "Rays end at the nearest hit; otherwise they cross the scene"
    )
    column: int = setting(120, "Column", "Column of the chosen pixel, from the left", minimum=0)
    row: int = setting(90, "Row", "Row of the chosen pixel, from the top", minimum=0)
    width: int = setting(
        240, "Width", "Pixels in a row; there are three rows for four of them", minimum=16,
        maximum=1280,
    )  # fmt: skip


def viridis(fractions: np.ndarray) -> np.ndarray:
    """Return colours, (..., 3) in sRGB, of fractions (...)."""
    places = np.clip(fractions, 0.0, 1.0) * (len(VIRIDIS) - 1)
    numbers = np.arange(len(VIRIDIS))
    return np.stack([np.interp(places, numbers, channel) for channel in VIRIDIS.T], axis=-1)


def camera_of(scene: Scene) -> Camera:
    """Return the scene's own camera, or one that frames the scene."""
    if scene.camera is not None and scene.camera.has_rays:
        return scene.camera
    return framing_camera(scene, ASPECT[0] / ASPECT[1])


class HeatMap(Play):
    """Counters of all pixels, with and without stopping at the first hit.

    Attributes
    ----------
    apart : int
        How far from each other pixels are whose rays have been traced, in rows and in columns. The
        colour of each is that of all pixels up to the next; when all are traced, `apart` is 1.
    counts : dict of bool to (height, width, number of counters) int32
        Of rays that stop, and of those that do not.
    """

    def __init__(self, subject: Subject, settings: Settings, progress: Progress) -> None:
        self.structure: Structure = subject.structures[0]
        self.width = settings.width
        self.height = max(self.width * ASPECT[1] // ASPECT[0], 1)
        self.rays: Rays = camera_rays(camera_of(subject.scene), self.width, self.height)
        self.cells = self.structure.cells(progress)
        self.ends = {"column": self.width - 1, "row": self.height - 1}
        shape = self.height, self.width, len(self.structure.counters)
        self.counts = {stop: np.zeros(shape, np.int32) for stop in QUERIES}
        is_traced = np.zeros(shape[:2], dtype=bool)
        for apart in COARSE:
            is_next = np.zeros_like(is_traced)
            is_next[::apart, ::apart] = True
            is_next &= ~is_traced
            is_traced |= is_next
            some = self.rays.select(is_next.ravel())
            for stop, query in QUERIES.items():
                _, counts = self.structure.trace(some, query, progress=progress)
                self.counts[stop][is_next] = counts.values
            self.apart = apart
            if apart > 1:
                progress.offer(self.as_it_is())

    def as_it_is(self) -> HeatMap:
        """Return this map as a draft: rays that are traced later do not change it."""
        draft = copy.copy(self)
        draft.counts = {stop: counts.copy() for stop, counts in self.counts.items()}
        return draft

    def film(self, lesson: Lesson) -> Sequence[Any]:
        """Return the counters that the structure has."""
        return [each.name for each in COUNTERS if each in self.structure.counters]

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return steps and tests, and the steps of rays that do not stop."""
        asked = (("N_TS", True), ("N_IT", True), ("N_TS", False), ("N_IT", False))
        if self.structure.levels:
            asked = (("N_TS", True), (ENTERED.name, True), ("N_TS_1", True), ("N_IT_1", True))
        return [dataclasses.replace(settings, counter=name, stop=stop) for name, stop in asked]

    def values(self, settings: Settings) -> np.ndarray | None:
        """Return the counter of every pixel, (height, width); None if it is not counted."""
        names = [each.name for each in self.structure.counters]
        if settings.counter not in names:
            return None
        counts = self.counts[settings.stop][:: self.apart, :: self.apart]
        values = counts[..., names.index(settings.counter)]
        whole = values.repeat(self.apart, axis=0).repeat(self.apart, axis=1)
        return whole[: self.height, : self.width]

    def ray_shown(self, settings: Settings) -> Rays:
        """Return the ray of the chosen pixel."""
        return self.rays.select(np.array([settings.row * self.width + settings.column]))

    def so_far(self) -> str:
        """Return how many of them have been traced, in words; nothing if it is all."""
        return f", so far one of {self.apart**2}" if self.apart > 1 else ""

    def picture(self, settings: Settings) -> Picture:
        """Return the map of a counter, and the ray of the chosen pixel in the scene."""
        pixel = settings.row * self.width + settings.column
        query = QUERIES[settings.stop]
        steps = self.structure.record(self.rays, pixel, query)
        # Its own ray, even if the colour of its pixel is still that of a neighbour.
        hits, counts = self.structure.trace(self.ray_shown(settings), query, threads=1)
        walk = Walk(self.structure, self.cells, self.rays, pixel, float(hits.t[0]), steps)
        segments, colours = segments_of(walk, palette=PALETTE)
        values = self.values(settings)
        until = "up to the first hit" if settings.stop else "through the whole scene"
        (counter,) = (each for each in COUNTERS if each.name == settings.counter)
        if values is None:
            caption = f"{self.structure.label} does not count {counter.label}"
            return Picture(caption, segments, colours)
        tally = Tally.of(values)
        spread = [f"{tally.quantile(share):g}" for share in (0.0, 0.5, 0.95, 1.0)]
        rows = [
            Row(label, text, f"{counter.label}: {meaning}")
            for label, text, meaning in (
                ("Least", spread[0], "the darkest pixels"),
                ("Median", spread[1], "half of the pixels have no more"),
                ("Mean", f"{tally.mean:.2f}", "per ray, as in the record"),
                ("95%", spread[2], "19 of 20 pixels have no more"),
                ("Most", spread[3], "the dearest pixel"),
                ("Chosen Pixel", str(counts[counter.name][0]), "that of the cross"),
            )
        ]
        caption = (
            f"{counter.label} of {self.width} x {self.height} rays {until}{self.so_far()}: "
            f"{spread[0]} to {spread[3]}, bright from {tally.brightest:g} on, "
            f"{tally.mean:.2f} per ray"
        )
        image = Image("heat", map_of(values, settings.column, settings.row), values)
        return Picture(caption, segments, colours, rows=tuple(rows), images=(image,))


class Tally(NamedTuple):
    """How many pixels have each value; there are far fewer values than pixels.

    Attributes
    ----------
    counts : (most + 1,) int64
        Of 0, 1, ... up to the largest value.
    """

    counts: np.ndarray

    @classmethod
    def of(cls, values: np.ndarray) -> Tally:
        """Count values, which are no less than 0, of any shape."""
        return cls(np.bincount(values.ravel()))

    def _ranked(self, rank: int) -> int:
        """Return the value of a rank, of which 0 is the lowest."""
        return int(np.searchsorted(np.cumsum(self.counts), rank, side="right"))

    def quantile(self, share: float) -> float:
        """Return the value below which a share of the pixels lies, between two if need be."""
        place = share * (int(self.counts.sum()) - 1)
        below, above = self._ranked(math.floor(place)), self._ranked(math.ceil(place))
        return below + (place - math.floor(place)) * (above - below)

    @property
    def mean(self) -> float:
        """The mean value of a pixel."""
        return float(self.counts @ np.arange(len(self.counts)) / self.counts.sum())

    @property
    def brightest(self) -> int:
        """The value that the brightest colour begins with."""
        return self._ranked(math.ceil(BRIGHTEST * (int(self.counts.sum()) - 1)))


def map_of(values: np.ndarray, column: int, row: int) -> np.ndarray:
    """Return a map with a cross at a pixel, and its scale below, (rows, columns, 3)."""
    height, width = values.shape
    tally = Tally.of(values)
    low, high = float(values.min()), tally.brightest
    fractions = np.minimum((np.arange(len(tally.counts)) - low) / ((high - low) or 1.0), 1.0)
    pixels = viridis(fractions)[values]
    reach = max(width // 40, 3)
    for step in range(2, reach + 2):
        for x, y in ((step, 0), (-step, 0), (0, step), (0, -step)):
            if 0 <= column + x < width and 0 <= row + y < height:
                pixels[row + y, column + x] = CROSS
    strip = scale(fractions[1:], tally.counts[1:], width, max(round(STRIP * height), 4))
    return np.concatenate([pixels, strip])


def scale(fractions: np.ndarray, pixels: np.ndarray, width: int, height: int) -> np.ndarray:
    """Return the colours in their order, the higher the more pixels have them, (height, width, 3).

    Heights are logarithmic: one pixel more than none is seen.

    Parameters
    ----------
    fractions : (n,) float64
        Of the way through the colours.
    pixels : (n,) int64
        How many have each.
    """
    counts, _ = np.histogram(fractions, bins=BARS, range=(0.0, 1.0), weights=pixels)
    places = np.arange(width) / max(width - 1, 1)
    bar = np.minimum((places * BARS).astype(np.int64), BARS - 1)
    shares = np.log1p(counts) / np.log1p(max(counts.max(), 1))
    high = np.ceil(shares * (height - 1)).astype(np.int64)[bar]
    is_bar = np.arange(height)[::-1, None] < high
    return np.where(is_bar[..., None], viridis(places)[None], 0.25)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Trace the rays of the picture, twice; what is there so far can be shown meanwhile."""
    return HeatMap(subject, settings, progress)


def over_instances(structure: Structure) -> str:
    """Accept what is built over instances, see :attr:`.lesson.Lesson.suits`."""
    return "" if structure.levels else "the scene holds no instances"


LESSONS = (
    Lesson(
        name="heat_map",
        label="Heat Map",
        slide="BVH in action",
        begin="Every pixel of a picture has its price: so many nodes were entered, so many "
        "triangles tested for it",
        look_for="Bright are silhouettes, where a ray passes close to much and hits nothing, and "
        "places where volumes overlap; the background costs next to nothing",
        question="Why are pixels beside the object often dearer than those on it?",
        answer="A ray that misses narrowly enters many volumes and finds no hit that would let it "
        "stop",
        source="structures.bvh.walks.binary_walk",
        sample="suzanne:subdivisions=3",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="counter",
        replays=("width",),
    ),
    Lesson(
        name="heat_map_of_levels",
        label="Heat Map of Two Levels",
        slide="BVH in action",
        begin="Over instances every pixel has two prices: what its ray does in the top level, and "
        "what it does in the meshes that it enters",
        look_for="The top level costs where boxes of instances lie behind each other, whether "
        "anything is hit or not. The bottom level costs on the figures, most along their outlines",
        question="What does a pixel cost that shows the ground between two figures?",
        answer="The ray enters the boxes of those it passes, is moved into their spaces, and comes "
        "back without a hit: these are the instances entered in vain",
        source="contract.instances",
        sample="crowd:figures=25,triangles=4000",
        structures=("two_level",),
        suits=over_instances,
        Settings=Settings,
        play=play,
        film="counter",
        replays=("width",),
    ),
)
