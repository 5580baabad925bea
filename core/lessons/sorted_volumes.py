"""Lessons "volumes_along_a_ray" and "sorted_volumes": what a ray does with a list of volumes.

The slides "Intersection using bounding volumes", in three stages, and "An efficient algorithm",
event by event, both as the walk of a ray was recorded.

Blue volumes are hit, faint grey ones missed; numbers stand where the ray enters, in order. Orange
objects were tested in vain, in the green one is the hit. Grey objects in grey volumes were never
tested though those are hit: when their turn came, the hit lay before them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.events import TEST, VISIT_LEAF, VOLUME_TEST
from ..contract.steps import Steps
from ..geometry.instances import owners_of
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from ..structures.sorted_volumes import SortedVolumes
from .around import edges_of
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, coloured, counted, items_in, picture_of
from .lesson import Lesson, Play, Subject
from .one_ray import RAY, point_at, rays_from_the_front
from .picture import Mark, Picture, Row

MOST_MISSED, MOST_HIT = 100, 60
"""Volumes that are drawn."""

MOST_NUMBERS = 12
"""Numbers along the ray."""

STAGES = {
    "volumes": "The ray is tested with all volumes",
    "order": "Those that it hits are sorted by where it enters them",
    "objects": "Objects are tested in that order, until a hit lies before the next volume",
}


@dataclass(frozen=True)
class StageSettings:
    """The knob of the first lesson."""

    stage: str = setting("objects", "Stage", "Which of the three stages", choices=STAGES)


@dataclass(frozen=True)
class EventSettings:
    """The knob of the second lesson."""

    event: int = setting(
        0, "Event", "Tests of volumes, then visits of objects, then the end", minimum=0
    )


class Walk:
    """The recorded walk of one ray through a list of volumes.

    Attributes
    ----------
    tested : (n,) int
        Objects in the order in which their volumes are tested: all of them.
    order : (k,) int
        Those whose volumes are hit, in the order in which the ray enters them.
    enters : (k,) float64
        Where that is.
    visited : (m,) int
        Those that are looked into, the first m of `order`.
    visits : (m,) int
        The events in which they are.
    """

    def __init__(self, structure: SortedVolumes, subject: Subject, progress: Progress) -> None:
        self.structure, self.scene = structure, structure.scene
        progress.report(0, 2, "Choosing a ray")
        self.rays = chosen_ray(structure, subject)
        self.steps: Steps = structure.record(self.rays, 0)
        hits, _ = structure.trace(self.rays)
        self.t_hit, self.primitive = float(hits.t[0]), int(hits.primitive[0])
        steps = self.steps
        tests = steps.events_of(VOLUME_TEST)
        tests = tests[steps.level[tests] == 0]
        self.tests, self.tested = tests, steps.cell[tests]
        is_hit = np.isfinite(steps.t_enter[tests])
        cells, enters = self.tested[is_hit], steps.t_enter[tests][is_hit]
        order = np.lexsort([cells, enters])
        self.order, self.enters = cells[order], enters[order]
        visits = steps.events_of(VISIT_LEAF)
        self.visits = visits[steps.level[visits] == 0]
        self.visited = steps.cell[self.visits]
        progress.report(1, 2, "Drawing volumes")
        drawn = np.concatenate([self.order[:MOST_HIT], self.missed()[:MOST_MISSED]])
        segments, owners = edges_of(structure.arrays.volumes, drawn, progress)
        self.edges = {int(cell): segments[owners == place] for place, cell in enumerate(drawn)}

    def missed(self) -> np.ndarray:
        """Return the objects whose volumes are missed, in the order of the tests."""
        return self.tested[~np.isin(self.tested, self.order)]

    @property
    def skipped(self) -> np.ndarray:
        """Objects whose volumes are hit and that are never tested."""
        return self.order[len(self.visited) :]

    def items_of(self, cells: np.ndarray) -> np.ndarray:
        """Return the items of objects."""
        offsets, ids = self.structure.arrays.offsets, self.structure.geometry.ids
        parts = [ids[offsets[cell] : offsets[cell + 1]] for cell in cells]
        return np.concatenate([np.empty(0, ids.dtype), *parts])

    def object_of_hit(self) -> int:
        """Return the object that the hit is in, -1 for a miss."""
        tests = self.steps.events_of(TEST)
        tests = tests[self.steps.level[tests] == 0]
        if self.primitive < 0:
            return -1
        owner, _ = owners_of(self.scene.geometry, np.array([self.primitive]))
        item = self.primitive if owner[0] < 0 else int(owner[0])
        found = tests[self.steps.primitive[tests] == item]
        return int(self.visited[np.searchsorted(self.visits, found[0]) - 1])

    def wires(self, cells: np.ndarray) -> np.ndarray:
        """Return the edges of the volumes of some objects, those that are drawn."""
        known = [self.edges[int(cell)] for cell in cells if int(cell) in self.edges]
        return np.concatenate([np.empty((0, 2, 3)), *known])

    def ray(self, until: float = np.inf) -> list[Any]:
        """Return the ray, bright up to some t."""
        direction = self.rays.directions[0]
        length = float(np.linalg.norm(direction))
        middle = 0.5 * (self.scene.lower + self.scene.upper) - self.rays.origins[0]
        t, reach = float(middle @ direction) / length**2, 0.8 * self.scene.diagonal / length
        start, far = np.clip([t - reach, t + reach], self.rays.t_min[0], self.rays.t_max[0])
        here = float(np.clip(until, start, far))
        points = point_at(self.rays, np.array([start, here, far]))
        parts = [
            coloured(points[None, 1:], (*RAY[:3], 0.35)), coloured(points[None, :2], RAY)
        ]  # fmt: skip
        if np.isfinite(self.t_hit) and until >= self.t_hit:
            size = 0.05 * self.scene.diagonal
            end = point_at(self.rays, np.array([self.t_hit]))
            parts.append(coloured(stars(end, np.array([size])), GREEN))
        return parts

    def numbers(self) -> list[Mark]:
        """Return the numbers of the volumes along the ray."""
        places = point_at(self.rays, self.enters[:MOST_NUMBERS])
        return [Mark(place, str(number + 1)) for number, place in enumerate(places)]

    def objects(self, visited: np.ndarray, never: np.ndarray) -> list[Any]:
        """Return objects that were tested, and such that never are."""
        hit = self.object_of_hit()
        return [
            items_in(self.scene, self.items_of(never), GREY, 0.6, most=3000),
            items_in(self.scene, self.items_of(visited[visited != hit]), ORANGE, 0.6, most=3000),
            items_in(self.scene, self.items_of(visited[visited == hit]), GREEN, 0.6, most=3000),
            coloured(self.wires(visited[visited != hit]), ORANGE),
            coloured(self.wires(visited[visited == hit]), GREEN),
        ]

    def rows(self, event: int | None = None) -> tuple[Row, ...]:
        """Return the counters, up to an event."""
        steps = self.steps
        tests = steps.events_of(VOLUME_TEST, event)
        visits = steps.events_of(VISIT_LEAF, event)
        hit = int(np.isfinite(steps.t_enter[tests]).sum())
        n = len(self.scene)
        return (
            Row("Volume Tests", f"{len(tests)} of {len(self.tested)}", "All volumes: it is O(N)"),
            Row("Volumes Hit", str(hit), "They are sorted by where the ray enters them"),
            Row("Objects Tested", str(len(visits)), "N_TS: they are looked into in that order"),
            Row("Never Tested", str(len(self.skipped)), "Hit, but behind the nearest hit"),
            Row("N_IT", f"{show_integer(len(steps.events_of(TEST, event)))} of {show_integer(n)}",
                "Tests of what is in the objects, of all that the naive algorithm tests"),
        )  # fmt: skip


def chosen_ray(structure: SortedVolumes, subject: Subject) -> Rays:
    """Return the ray that the lesson is given, or one from the front that leaves most out."""
    if subject.rays is not None:
        return subject.rays.select(np.array([subject.ray]))
    rays = rays_from_the_front(structure.scene)
    hits, counts = structure.trace(rays)
    # Some objects tested, and some not.
    score = np.minimum(counts["cells_skipped"], 5) + 3.0 * np.minimum(counts["N_TS"], 3)
    best = int(np.argmax(np.where(hits.primitive >= 0, score, -1.0)))
    return rays.select(np.array([best]))


class Stages(Play):
    """The three stages of the first slide."""

    def __init__(self, walk: Walk) -> None:
        self.walk = walk

    def picture(self, settings: StageSettings) -> Picture:
        """Return the picture of a stage."""
        walk, stage = self.walk, settings.stage
        k, m = len(walk.order), len(walk.visited)
        parts: list[Any] = [coloured(walk.wires(walk.missed()), (*GREY[:3], 0.3))]
        texts = {
            "volumes": f"All {len(walk.tested)} volumes are tested: {k} are hit",
            "order": f"The {k} volumes that are hit, in the order in which the ray enters them",
            "objects": f"{counted(m, 'object', 'objects')} of {k} tested in this order; "
            f"{len(walk.skipped)} never",
        }
        if stage == "objects":
            parts += walk.objects(walk.visited, walk.skipped)
            parts.append(coloured(walk.wires(walk.skipped), GREY))
        else:
            parts.append(coloured(walk.wires(walk.order), BLUE))
        parts += walk.ray(np.inf if stage == "objects" else -np.inf)
        marks = walk.numbers() if stage != "volumes" else []
        return picture_of(parts, texts[stage], marks=marks, rows=walk.rows())


class Events(Play):
    """The walk of the second slide, event by event: volumes, objects, the end."""

    def __init__(self, walk: Walk) -> None:
        self.walk = walk
        self.events = np.concatenate([walk.tests, walk.visits, [len(walk.steps) - 1]])
        self.ends = {"event": len(self.events) - 1}

    def picture(self, settings: EventSettings) -> Picture:
        """Return the picture of an event."""
        walk, number = self.walk, settings.event
        steps, event = walk.steps, int(self.events[number])
        n_tests, is_end = len(walk.tests), number == self.ends["event"]
        if number < n_tests:
            tested = walk.tested[: number + 1]
            hit = tested[np.isin(tested, walk.order)]
            cell = int(walk.tested[number])
            t = float(steps.t_enter[event])
            verdict = f"hit, entered at t = {t:.4g}" if np.isfinite(t) else "missed"
            parts: list[Any] = [
                coloured(walk.wires(tested[~np.isin(tested, hit)]), (*GREY[:3], 0.3)),
                coloured(walk.wires(hit), BLUE),
                coloured(walk.wires(np.array([cell])), GREEN if np.isfinite(t) else RED),
                *walk.ray(-np.inf),
            ]
            caption = f"Volume {number + 1} of {n_tests}: {verdict}"
            return picture_of(parts, caption, rows=walk.rows(event))
        done = min(number - n_tests + 1, len(walk.visited))
        visited = walk.visited[:done]
        waiting = walk.order[done:]
        last = int(self.events[number + 1]) - 1 if not is_end else event
        found = steps.t_enter[steps.events_of(TEST, last)].min(initial=np.inf)
        text = f"t = {found:.4g}" if np.isfinite(found) else "none"
        parts = [
            *walk.objects(visited, waiting if is_end else waiting[:0]),
            coloured(walk.wires(waiting), GREY if is_end else (*BLUE[:3], 0.5)),
        ]
        if is_end:
            parts += walk.ray()
            caption = (
                f"The end: {counted(len(walk.skipped), 'object', 'objects')} never tested, "
                + ("the hit lies before them" if len(walk.skipped) else "no volume is left")
            )
        else:
            parts.append(coloured(walk.wires(visited[-1:]), RED))
            parts += walk.ray(float(walk.enters[done - 1]))
            caption = (
                f"Object {done} in the order, entered at t = {walk.enters[done - 1]:.4g}, is "
                f"tested; nearest hit so far: {text}"
            )
            if len(waiting):
                caption += f"; the next volume begins at t = {walk.enters[done]:.4g}"
        return picture_of(parts, caption, marks=walk.numbers(), rows=walk.rows(last))

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return a test, the first object and the end."""
        n_tests = len(self.walk.tests)
        chosen = sorted({n_tests // 2, n_tests - 1, n_tests, self.ends["event"]})
        return [EventSettings(min(event, self.ends["event"])) for event in chosen]


def is_list(structure: Any) -> str:
    """Accept lists of volumes, see :attr:`.lesson.Lesson.suits`."""
    if isinstance(structure, SortedVolumes):
        return ""
    return f"{structure.label} is no list of volumes"


def walk_of(subject: Subject, progress: Progress) -> Walk:
    """Record the ray of a lesson."""
    structure = subject.structures[0]
    assert isinstance(structure, SortedVolumes)
    return Walk(structure, subject, progress)


def play_stages(subject: Subject, settings: StageSettings, progress: Progress) -> Play:
    """Record a ray."""
    return Stages(walk_of(subject, progress))


def play_events(subject: Subject, settings: EventSettings, progress: Progress) -> Play:
    """Record a ray."""
    return Events(walk_of(subject, progress))


LESSONS = (
    Lesson(
        name="volumes_along_a_ray",
        label="Volumes along a Ray",
        slide="Intersection using bounding volumes",
        begin="Every object has a volume: those that the ray hits are sorted, and their objects "
        "are tested in that order",
        look_for="The numbers stand where the ray enters each volume; the objects behind the hit "
        "are grey, since nobody has tested them",
        question="The ray has hit something in volume 1. Why may the object in volume 2 have to "
        "be tested all the same?",
        answer="Volumes may overlap: the hit may lie behind the place where volume 2 begins, and "
        "what is in there be nearer. Only if the hit lies before it, the hit is the nearest",
        source="structures.sorted_volumes",
        sample="suzanne:subdivisions=2",
        structures=("sorted_volumes:parts=32",),
        suits=is_list,
        Settings=StageSettings,
        play=play_stages,
        film="stage",
        takes_ray=True,
    ),
    Lesson(
        name="sorted_volumes",
        label="An Efficient Algorithm, Event by Event",
        slide="An efficient algorithm",
        begin="All volumes are tested and put into a heap; then one object after the other, until "
        "the hit lies before the next volume",
        look_for="The walk ends although volumes are waiting: theirs are the grey objects",
        question="Why is it still O(N), though only a few objects are tested?",
        answer="Every ray is tested against the volumes of all N objects. It is the constant that "
        "is small; to leave out volumes as well, they need volumes of their own: a hierarchy",
        source="structures.sorted_volumes",
        sample="suzanne:subdivisions=2",
        structures=("sorted_volumes:parts=32",),
        suits=is_list,
        Settings=EventSettings,
        play=play_events,
        film="event",
        takes_ray=True,
    ),
)
