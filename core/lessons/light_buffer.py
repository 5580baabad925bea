"""Lesson "light buffer": one shadow ray, and which objects of its cell are tested.

As on the lecture's slide "Light buffer": a directional cube is in the light, "for a shadow ray only
objects projected in the relevant cell are considered", and some cells "might be covered completely
by one object" (:mod:`..structures.light_buffer`; Haines and Greenberg 1986; REFERENCE.md A23).

What is shown of the ray is its recorded walk. Green is the object that blocks it, orange those that
were tested and missed, grey those that the cell lists and that were not tested: they begin beyond
the point, or the ray was blocked before. Numbers are places in the list. Below is the list as a
ruler: a line for each object at its least distance from the light, violet the point, red how far
away the object is at most that covers the cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.counters import Counts
from ..contract.events import COVER, HIT, STRANGER, TEST
from ..errors import InputError
from ..geometry.marks import stars
from ..geometry.rays import ANY, Rays
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from ..structures.light_buffer import LightBuffer, LightBufferSettings
from .directions import (
    MOST_NUMBERED,
    Listing,
    corners_at,
    cube_edges,
    drawn_cells,
    lengths_of,
    list_of,
    lit,
    pyramid,
    shadow_rays_seen,
    tinted_cells,
)
from .drawing import (
    GREEN,
    GREY,
    ORANGE,
    RED,
    Chart,
    Colour,
    Faces,
    Lines,
    coloured,
    counted,
    items_in,
    outlines,
    picture_of,
)
from .lesson import Lesson, Play, Subject, build, only_its_own
from .one_ray import RAY
from .picture import Mark, Picture, Row

MAX_LIST_SIZE = 8

MOST_RAYS = 400
"""Shadow rays that can be looked at, the most telling first."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    ray: int = setting(
        0, "Shadow Ray", "Which one; those in whose cells most is decided come first", minimum=0
    )
    full_occlusion: bool = setting(
        True, "Full Occlusion", "A cell that one object covers is cut off behind it"
    )


class Walked(NamedTuple):
    """What one ray has done.

    Attributes
    ----------
    cell : int
    listing : Listing
        Of its cell.
    tested : tuple of int
        Items, in order.
    blocker : int
        The item that blocks the ray, NONE for a ray that reaches the light.
    is_covered : bool
        Whether what covers the cell was asked first.
    is_stranger : bool
        Whether all items had to be tested.
    distance : float
        Of the point from the light.
    """

    cell: int
    listing: Listing
    tested: tuple[int, ...]
    blocker: int
    is_covered: bool
    is_stranger: bool
    distance: float

    @property
    def beyond(self) -> np.ndarray:
        """Which listed items begin beyond the point, (n,) bool."""
        return self.listing.nearest > self.distance


class Traced(NamedTuple):
    """What all rays have done.

    Attributes
    ----------
    counts : dict of bool to Counts
        In the buffers whose cells are cut off (True), and are not.
    of_bvh : Counts
    is_blocked : (n,) bool
    """

    counts: dict[bool, Counts]
    of_bvh: Counts
    is_blocked: np.ndarray


class ShadowRays(Play):
    """Shadow rays to one light, through cells that are cut off and through cells that are not."""

    def __init__(
        self, buffers: dict[bool, LightBuffer], light: str, rays: Rays, traced: Traced
    ) -> None:  # fmt: skip
        self.buffers, self.light, self.rays, self.traced = buffers, light, rays, traced
        self.scene = buffers[True].scene
        lengths = lengths_of(buffers[True])
        listed = lengths[[buffers[True].cell_of(0, -way) for way in rays.directions]]
        order = most_telling(traced.counts[True], listed)
        # A ray through an empty cell shows nothing, unless all are.
        self.order = order[listed[order] > 0] if listed.any() else order[:1]
        self.ends = {"ray": len(self.order) - 1}
        self.half = buffers[True].drawn_size
        self.cubes: dict[bool, list[Lines | Faces]] = {}
        for key, buffer in buffers.items():
            cells, lengths = drawn_cells(buffer)
            longest = int(lengths_of(buffer).max())
            self.cubes[key] = [
                cube_edges(buffer, self.half),
                *tinted_cells(corners_at(buffer, cells, self.half), lengths, longest, 0.16),
            ]

    def walked(self, settings: Settings) -> Walked:
        """Record a ray."""
        buffer, number = self.buffers[settings.full_occlusion], int(self.order[settings.ray])
        steps = buffer.record(self.rays, number, ANY)
        cell = buffer.cell_of(0, -self.rays.directions[number])
        hits = steps.primitive[steps.kind == HIT]
        return Walked(
            cell, list_of(buffer, cell), tuple(steps.primitive[steps.kind == TEST].tolist()),
            int(hits[-1]) if len(hits) else -1, bool((steps.kind == COVER).any()),
            bool((steps.kind == STRANGER).any()),
            float(np.linalg.norm(self.rays.directions[number])),
        )  # fmt: skip

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one ray."""
        buffer, walked = self.buffers[settings.full_occlusion], self.walked(settings)
        number, item = int(self.order[settings.ray]), self.scene.item_name
        point, light = self.rays.origins[number], buffer.faces.origins[0]
        parts = [*self.cubes[settings.full_occlusion]]
        near = corners_at(buffer, np.array([walked.cell]), 1.004 * self.half)
        parts.append(coloured(outlines(near), ORANGE))
        face = int(buffer.squares.face[walked.cell])
        depth = float((point - light) @ buffer.faces.axes[face, 2])
        parts += pyramid(buffer, walked.cell, self.half, max(depth, 1.1 * self.half), ORANGE)
        states = self.states(walked)
        for colour, opacity in ((GREY, 0.35), (ORANGE, 0.5), (GREEN, 0.7)):
            own = walked.listing.items[[state == colour for state in states]]
            parts.append(items_in(self.scene, own, colour, opacity))
        parts.append(coloured(np.array([[point, light]]), RAY))
        parts.append(coloured(stars(point[None], np.array([0.05 * self.scene.diagonal])), RAY))
        marks = self.numbers(buffer, walked, states)
        marks += [
            Mark(point, "point", RAY[:3]),
            Mark(light + np.array([0.0, 0.0, 1.25 * self.half]), "light"),
        ]
        ruler, names = self.ruler(buffer, walked, states)
        n_listed, n_tested = len(walked.listing.items), len(walked.tested)
        rows = (
            Row("Listed", str(n_listed), f"{item}s of the cell, of {len(self.scene)} in all"),
            Row("Tested", str(n_tested), "N_IT of this ray"),
            Row("Begin Beyond the Point", str(int(walked.beyond.sum())),
                "Listed, and farther from the light than the point: not tested"),
            Row("Shadow Rays", show_integer(len(self.rays)), "Of a small picture from the front"),
            *(Row(name, f"{counts['N_IT'].mean():.3g}", "N_IT a shadow ray, over the same rays")
              for name, counts in self.compared()),
            Row("Light", self.light, "Where the shadow rays end"),
        )  # fmt: skip
        caption = self.words(settings, walked)
        return picture_of([*parts, *ruler], caption, marks=[*marks, *names], rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return a ray to a lit point, a blocked one, and one behind what covers its cell."""
        counts, is_blocked = self.traced.counts[True], self.traced.is_blocked[self.order]
        is_covered, tests = (counts[name][self.order] > 0 for name in ("covered", "N_IT"))
        lit_ones = np.flatnonzero(~is_blocked & tests)
        stopped, covered = np.flatnonzero(is_blocked & ~is_covered), np.flatnonzero(is_covered)
        chosen = [int(each[0]) for each in (lit_ones, stopped, covered) if len(each)] or [0]
        last = [Settings(chosen[-1], full_occlusion=False)]
        return [Settings(n) for n in chosen] + last

    def compared(self) -> list[tuple[str, Counts]]:
        """Return what the same rays have counted elsewhere, by name."""
        counts = self.traced.counts
        return [
            ("Light Buffer", counts[True]),
            ("Without Full Occlusion", counts[False]),
            ("BVH", self.traced.of_bvh),
        ]

    def states(self, walked: Walked) -> list[Colour]:
        """Return the colours of what the cell lists."""
        colour_of = dict.fromkeys(walked.tested, ORANGE) | {walked.blocker: GREEN}
        return [colour_of.get(item, GREY) for item in walked.listing.items.tolist()]

    def numbers(
        self, buffer: LightBuffer, walked: Walked, states: Sequence[Colour]
    ) -> list[Mark]:  # fmt: skip
        """Return places in the list beside those objects."""
        boxes = buffer.insertion.items.boxes[walked.listing.places]
        middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
        return [
            Mark(middle, str(n), colour[:3])
            for n, (middle, colour) in enumerate(zip(middles, states, strict=True), 1)
            if n <= MOST_NUMBERED
        ]

    def ruler(
        self, buffer: LightBuffer, walked: Walked, states: Sequence[Colour]
    ) -> tuple[list[Lines | Faces], list[Mark]]:
        """Return the list along the distance from the light, and its texts."""
        nearest, far = walked.listing.nearest, float(buffer.lists.far[walked.cell])
        ends = [walked.distance, *nearest.tolist(), *([far] if np.isfinite(far) else [])]
        low, high = max(min(ends), 0.0), max(ends)
        room = 0.08 * ((high - low) or high)
        lower, upper = self.scene.lower, self.scene.upper
        size = self.scene.diagonal
        across, towards = np.array([0.81, 0.59, 0.0]), np.array([0.59, -0.81, 0.0])
        # Before the scene, as it is seen: under it, what it stands on would be in the way.
        corner = 0.5 * (lower + upper) - 0.5 * size * across
        corner += 0.5 * (np.abs(towards) @ (upper - lower)) * towards
        corner[2] = lower[2] - 0.13 * size
        chart = Chart(
            corner, size * across, np.array([0.0, 0.0, 0.12 * size]), low - room, high + room, 1.0
        )  # fmt: skip
        parts: list[Lines | Faces] = [chart.level(0.0, GREY)]
        marks = [Mark(chart.at(0.0, -0.45), "distance from the light")]
        last, height = -np.inf, 1.25
        for n, (x, colour) in enumerate(zip(nearest.tolist(), states, strict=True), 1):
            parts.append(coloured(chart.points([x, x], [0.0, 1.0])[None], colour))
            if n <= MOST_NUMBERED:
                # Above the one before, where they would cover each other.
                height = height + 0.42 if x - last < 0.035 * chart.span else 1.25
                marks.append(Mark(chart.place(x, height), str(n), colour[:3]))
                last = x
        here = chart.points([walked.distance] * 2, [-0.9, 1.0])
        parts.append(coloured(here[None], RAY))
        marks.append(Mark(here[0], "point", RAY[:3]))
        if np.isfinite(far):
            end = chart.points([far, far], [-0.45, 1.0])
            parts.append(coloured(end[None], RED))
            marks.append(Mark(end[0], "covered", RED[:3]))
        return parts, marks

    def words(self, settings: Settings, walked: Walked) -> str:
        """Say what the ray does."""
        item, n = self.scene.item_name, len(walked.tested)
        text = f"Shadow ray {settings.ray}: its cell lists "
        text += counted(len(walked.listing.items), item, f"{item}s")
        if walked.is_stranger:
            return f"{text}; it goes on behind what covers the cell, and all are tested"
        if walked.is_covered:
            covering = f"{item} {walked.tested[0]}, which covers the cell"
            return f"{text}; the point is behind {covering}: one test"
        tested = f"{n} {'is' if n == 1 else 'are'} tested"
        if walked.blocker >= 0:
            return f"{text}, {tested}, and {item} {walked.blocker} blocks it"
        beyond = int(walked.beyond.sum())
        rest = f"; {beyond} begin{'s' * (beyond == 1)} beyond the point" if beyond else ""
        return f"{text}, {tested}, and none blocks it{rest}"


def most_telling(counts: Counts, listed: np.ndarray) -> np.ndarray:
    """Return the numbers of rays: first those that test some of a list, and not all of it.

    Parameters
    ----------
    counts : Counts
        Of the rays.
    listed : (n,) int
        How many items their cells list.
    """
    tests = counts["N_IT"]
    worth = np.minimum(tests, 3) + np.minimum(np.maximum(listed - tests, 0), 4)
    worth = worth - 0.2 * listed - 100.0 * counts["strangers"]
    return np.argsort(-worth, kind="stable")[:MOST_RAYS]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fill both buffers, and trace the shadow rays of a small picture through them and a BVH."""
    progress.report(0, 4, "Filling the light buffer")
    scene, light = lit(subject.scene)
    buffers = {
        cuts: LightBuffer.build(
            scene, LightBufferSettings(max_list_size=MAX_LIST_SIZE, full_occlusion=cuts), progress
        )
        for cuts in (True, False)
    }
    progress.report(1, 4, "Building a BVH")
    bvh = build(scene, "bvh", progress)
    progress.report(2, 4, "Tracing shadow rays")
    rays = shadow_rays_seen(scene, bvh, progress)
    if rays is None:
        raise InputError("nothing that is seen from the front faces the light; move the light")
    traced = {cuts: buffer.trace(rays, progress=progress) for cuts, buffer in buffers.items()}
    _, of_bvh = bvh.trace(rays, progress=progress)
    progress.report(3, 4, "Choosing rays")
    counts = {cuts: counted_rays for cuts, (_, counted_rays) in traced.items()}
    is_blocked = traced[True][0].primitive >= 0
    # What is recorded first is compiled now, and not at the first picture.
    buffers[True].record(rays, 0, ANY)
    return ShadowRays(buffers, light, rays, Traced(counts, of_bvh, is_blocked))


LESSONS = (
    Lesson(
        name="light_buffer",
        label="A Shadow Ray in the Light Buffer",
        slide="Light buffer",
        begin="A cube around the light lists for each direction what may throw a shadow there, so "
        "a shadow ray asks one cell, and of that only what is nearer than its point",
        look_for="The list is in order of distance: the walk ends at the first object that begins "
        "beyond the point, and at the first that blocks the ray",
        question="A shadow ray may stop at any hit. Why is the list sorted all the same?",
        answer="Not to find the nearest hit, but to know when to stop: what begins farther from "
        "the light than the point cannot be in between, nor can anything that follows",
        source="structures.light_buffer",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="ray",
    ),
)
