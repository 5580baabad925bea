"""Lesson "mailbox": an object in several cells is tested once, and a hit behind the cell waits.

As on the slide '"Mailbox" technique': the object remembers the last ray that met it, so the test is
not done again in its next cell. And a hit has to lie in the current cell: one behind it is
postponed, since something nearer may be listed in a cell before (:mod:`..contract.leaf`).

The ray goes through a grid event by event. Red is the object of the event, yellow those whose
mailbox has the ray, which the column lists. A green star is a hit that was accepted, a yellow one
waits. The same ray was recorded without a mailbox, too: what it tests stands in the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.events import HIT, MAILBOX, POSTPONE, TEST, VISIT_EMPTY, VISIT_LEAF
from ..errors import InputError
from ..geometry.instances import lines_of_items
from ..geometry.marks import stars
from ..progress import Progress
from ..settings import setting
from .column import YELLOW, column_beside
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Faces, Lines, coloured, counted, picture_of
from .lesson import Lesson, Play, Subject, only_its_own
from .one_ray import Counted, Walked, ray_of
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    MOST_PIECES,
    Plane,
    cut_items,
    model_with,
    place_beside,
    section_of,
    title_place,
)

SHOWN = VISIT_LEAF, VISIT_EMPTY, TEST, MAILBOX, HIT, POSTPONE


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    event: int = setting(12, "Event", "Events of the walk so far; the first is 0", minimum=0)


class Mailbox(Play):
    """One ray, with and without mailboxes."""

    def __init__(self, walked: Walked, without: Walked, plane: Plane) -> None:
        self.walked, self.without, self.plane = walked, without, plane
        steps, self.scene = walked.steps, walked.structure.scene
        self.events = np.flatnonzero(np.isin(steps.kind, SHOWN) & (steps.level == 0))
        self.ends = {"event": len(self.events) - 1}
        self.shift = place_beside(self.scene, 0)
        leaves = np.flatnonzero(walked.cells.is_leaf)
        self.section = section_of(walked.cells, leaves, plane).moved(self.shift)
        self.cut, self.items = cut_items(self.scene, plane)
        every = max(len(self.cut) // MOST_PIECES, 1)
        self.cut, self.items = self.cut[::every] + self.shift, self.items[::every]

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after an event."""
        walked, steps = self.walked, self.walked.steps
        event = int(self.events[settings.event])
        so_far = self.events[: settings.event + 1]
        kinds = steps.kind[so_far]
        entered = np.isin(kinds, (VISIT_LEAF, VISIT_EMPTY))
        parts: list[Lines | Faces] = [*model_with(self.scene, self.plane), *walked.ray_lines()]
        parts += self.cells_entered(so_far[entered])
        met = list(dict.fromkeys(steps.primitive[so_far[kinds == TEST]].tolist()))
        parts += self.objects(met, event)
        is_last = settings.event == self.ends["event"]
        reached = float(steps.t_exit[so_far[entered]].max(initial=-np.inf))
        parts += walked.ray_lines(self.shift, np.inf if is_last else reached)
        stars_of_hits, waiting = self.hits(so_far)
        parts += stars_of_hits
        saved, tested = int((kinds == MAILBOX).sum()), int((kinds == TEST).sum())
        entries = [f"{self.scene.item_name} {item}" for item in met[::-1]]
        column, marks = column_beside(
            self.scene, self.plane, walked.rays.directions[0], self.shift, "Have met the ray",
            entries, YELLOW,
        )  # fmt: skip
        title = f"{counted(tested, 'test', 'tests')}, {saved} saved"
        marks += waiting
        marks.append(Mark(title_place(self.scene, self.plane, self.shift), title))
        counts, others = walked.counts, self.without.counts
        rows = (
            Row("Tests with Mailbox", str(counts["N_IT"]), "N_IT of the whole ray"),
            Row("Tests without", str(others["N_IT"]), "N_IT of the same ray: every list is tested"),
            Row("Saved", str(counts["mailbox_hits"]), "Tests that the mailbox has answered"),
            Row("Postponed", str(counts["postponed_hits"]),
                "Hits that lay behind the cell in which they were found"),
            Row("Cells", str(counts["N_ETS"]), "Cells entered, the same with and without"),
        )  # fmt: skip
        caption = f"Event {settings.event}: {self.words(event)}; so far {title}"
        return picture_of([*parts, column], caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first test that is saved, the first hit that waits, and the end."""
        kinds = self.walked.steps.kind[self.events]
        firsts = [np.flatnonzero(kinds == kind)[:1] for kind in (TEST, MAILBOX, POSTPONE)]
        chosen = {int(n) for n in np.concatenate(firsts)} | {self.ends["event"]}
        return [Settings(number) for number in sorted(chosen)]

    def words(self, event: int) -> str:
        """Say what an event is."""
        steps = self.walked.steps
        kind, item, t = int(steps.kind[event]), int(steps.primitive[event]), steps.t_enter[event]
        name = f"{self.scene.item_name} {item}"
        if kind in (VISIT_LEAF, VISIT_EMPTY):
            return f"the ray enters {'an empty cell' if kind == VISIT_EMPTY else 'a cell'}"
        if kind == MAILBOX:
            return f"{name} has met this ray before and is not tested again"
        if kind == TEST:
            return f"{name} is tested: " + (f"t = {t:.4g}" if np.isfinite(t) else "missed")
        if kind == HIT:
            return f"the hit of {name} lies in the cell and is the nearest so far"
        return f"the hit of {name} lies behind the cell and is postponed"

    def cells_entered(self, visits: np.ndarray) -> list[Lines | Faces]:
        """Return the section, with the cells filled that were entered."""
        steps, cells = self.walked.steps, self.walked.cells
        colours = np.tile((*GREY[:3], FAINT), (len(cells), 1))
        parts: list[Lines | Faces] = [self.section.lines(colours)]
        fills = np.zeros((len(cells), 4))
        for kind, colour in ((VISIT_LEAF, ORANGE), (VISIT_EMPTY, BLUE)):
            fills[cells.places_of(steps.cell[visits[steps.kind[visits] == kind]])] = (
                *colour[:3], 0.22,
            )  # fmt: skip
        entered = cells.places_of(steps.cell[visits])
        parts.append(self.section.of(entered).faces(fills))
        if len(visits):
            now = cells.places_of(steps.cell[visits[-1:]])
            colours[now] = ORANGE if steps.kind[visits[-1]] == VISIT_LEAF else BLUE
            parts.append(self.section.of(now).raised(self.scene).lines(colours))
        return parts

    def objects(self, met: list[int], event: int) -> list[Lines | Faces]:
        """Return the objects, those that have met the ray, and that of the event."""
        current = int(self.walked.steps.primitive[event])
        has_met, is_now = np.isin(self.items, met), self.items == current
        parts: list[Lines | Faces] = [
            coloured(self.cut[~has_met & ~is_now], (*GREY[:3], 0.7)),
            coloured(self.cut[has_met & ~is_now], YELLOW),
        ]
        if current >= 0:
            # Not every object that is listed reaches up to the plane: whole outlines, too.
            outline = lines_of_items(self.scene.geometry, np.array([current]))[:MOST_PIECES]
            parts.append(coloured(outline + self.shift, (*RED[:3], 0.55)))
            parts.append(coloured(self.cut[is_now], RED))
        return parts

    def hits(self, so_far: np.ndarray) -> tuple[list[Lines], list[Mark]]:
        """Return a star at the nearest hit so far: green if it is accepted, yellow if it waits."""
        steps = self.walked.steps
        found = so_far[np.isin(steps.kind[so_far], (HIT, POSTPONE))]
        if not len(found):
            return [], []
        visits = so_far[np.isin(steps.kind[so_far], (VISIT_LEAF, VISIT_EMPTY))]
        waits = bool(steps.t_enter[found[-1]] > steps.t_exit[visits[-1]])
        size = np.array([0.06 * self.scene.diagonal])
        place = self.walked.at(steps.t_enter[found[-1:]]) + self.shift
        star = coloured(stars(place, size), YELLOW if waits else GREEN)
        return [star], [Mark(place[0], "waits", YELLOW[:3])] if waits else []


def saves_and_postpones(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
    """Prefer rays with a postponed hit and some tests saved, not too many."""
    counts = counted_in[0]
    saved = np.minimum(counts["mailbox_hits"], 4) + 6 * (counts["postponed_hits"] > 0)
    saved = saved + np.minimum(counts["N_ETS"], 5)
    return hits + saved - 0.05 * counts["N_IT"] - 100 * (counts["N_ETS"] == 0)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record the ray with and without mailboxes."""
    progress.report(0, 2, "Choosing a ray")
    rays = ray_of(subject, subject.structures[:1], saves_and_postpones, progress)
    progress.report(1, 2, "Following the ray")
    walked, without = (Walked.of(structure, rays, progress) for structure in subject.structures)
    if not len(walked.visits):
        raise InputError("this ray misses the grid; choose one that enters it")
    return Mailbox(walked, without, Plane.through_ray(rays.origins[0], rays.directions[0]))


LESSONS = (
    Lesson(
        name="mailbox",
        label="The Mailbox and the Postponed Hit",
        slide='"Mailbox" technique',
        begin="An object that reaches into several cells is listed in all of them, and remembers "
        "in its mailbox which ray has tested it last",
        look_for="In its second cell an object is not tested again; and a hit behind the current "
        "cell is kept until the ray gets there, as something nearer may come before",
        question="What would go wrong if the walk ended with the first hit it finds, in whichever "
        "cell that lies?",
        answer="A nearer object may be listed only in a cell between: the ray would return a "
        "farther hit, and the picture would show what is hidden",
        source="contract.leaf",
        sample="soup:count=120,edge=0.5",
        structures=("grid:resolution=5x5x5,mailbox=true", "grid:resolution=5x5x5,mailbox=false"),
        suits=only_its_own,
        Settings=Settings,
        play=play,
        takes_ray=True,
        film="event",
    ),
)
