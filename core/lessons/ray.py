"""Lesson "ray": what one ray does in a structure, event by event, as the kernel has logged it.

The kernel that counts writes the log that is shown (:mod:`..contract.events`), so that the
counters beside the picture are tallies of the very events one has stepped through.

Orange: leaves entered. Blue: empty ones. Grey: inner nodes. Green: the hit. The cell or item that
the event is about is magenta; a volume that is tested is green if it is hit and red if it is
missed; dashed yellow volumes were hit and wait on the stack.
"""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from ..contract.events import HIT, SKIP, TEST, VISIT_EMPTY, VISIT_INNER, VISIT_LEAF, VOLUME_TEST
from ..contract.outlines import dashes_of, wires_of
from ..contract.steps import Steps
from ..geometry.cones import Spread
from ..geometry.rays import Rays
from ..progress import Progress
from ..scene import ORTHOGRAPHIC, Camera, Scene
from ..scene.camera_rays import camera_axes, camera_rays, framing_camera
from ..settings import setting
from .drawing import GREEN, GREY, ORANGE, RED, Lines, coloured, picture_of
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .ray_path import MOST_VISITED, VISITS, Palette, Walk, segments_of
from .walk_in_words import event_text

COLUMNS, ROWS = 32, 24
"""Rays of the lesson's own picture; one of them is stepped through."""

MAGENTA, YELLOW = (0.93, 0.20, 0.85, 1.0), (0.85, 0.68, 0.05, 1.0)

FEW_LEAVES = 3
"""A walk through fewer leaves shows little."""

NEAR = 0.75
"""Diagonals of the scene before its middle where a ray that comes from afar begins to be drawn."""

MOST_WAITING = 200
"""Volumes on the stack that are drawn."""

PALETTE = Palette(
    hitting=ORANGE, missing=(0.95, 0.65, 0.2, 1.0), ahead=(*GREY[:3], 0.45),
    inner=(*GREY[:3], 0.3), leaf=(1.0, 0.52, 0.1, 0.9), empty=(0.15, 0.5, 0.95, 0.6),
    skipped=(0.55, 0.35, 0.95, 0.7), tested=(0.85, 0.3, 0.55, 0.9),
    postponed=(0.95, 0.15, 0.1, 1.0), found=GREEN, current=MAGENTA,
    link=(0.0, 0.65, 0.65, 1.0), linked=(0.0, 0.65, 0.65, 0.4),
)  # fmt: skip
"""Colours that stand out from a dark viewport and from paper."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    event: int = setting(0, "Event", "Event of the walk; the first is 0", minimum=0)
    ray: int = setting(
        0,
        "Ray",
        "Which ray; of the lesson's own, those that hit after a short walk come first",
        minimum=0,
    )
    whole: bool = setting(
        False, "Whole Walk", "Show all that the ray does, not the events up to one"
    )
    cone: float = setting(
        0.0, "Cone", "Step a cone around the ray, with this angle between axis and side; 0 is the "
        "ray itself", unit="degrees", minimum=0.0, maximum=60.0,
    )  # fmt: skip


def own_rays(scene: Scene) -> Rays:
    """Return parallel rays across the view from the front right, so that they are seen whole."""
    forward, right, up = camera_axes(framing_camera(scene, COLUMNS / ROWS))
    direction = right - 0.35 * up + 0.45 * forward
    direction /= np.linalg.norm(direction)
    centre = 0.5 * (scene.lower + scene.upper)
    start = centre - 0.55 * scene.diagonal * direction
    across = Camera(start, centre, up, 0.0, kind=ORTHOGRAPHIC, scale=0.9 * scene.diagonal)
    return camera_rays(across, COLUMNS, ROWS)


def waiting(steps: Steps, event: int) -> np.ndarray:
    """Return the numbers of nodes whose volumes were hit, and that are neither entered nor skipped.

    Those of the structure itself, up to an event; ascending.
    """
    own = np.arange(len(steps)) <= event
    own &= steps.level == 0
    hit = own & (steps.kind == VOLUME_TEST) & np.isfinite(steps.t_enter) & (steps.cell >= 0)
    done = own & np.isin(steps.kind, (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY, SKIP))
    # By the numbers themselves: there is no need to sort the events.
    is_waiting = np.zeros(int(steps.cell.max(initial=-1)) + 1, dtype=bool)
    is_waiting[steps.cell[hit]] = True
    is_waiting[steps.cell[done & (steps.cell >= 0)]] = False
    return np.flatnonzero(is_waiting)


def up_to(steps: Steps, event: int) -> Steps:
    """Return the steps up to an event."""
    columns = ("kind", "cell", "primitive", "t_enter", "t_exit", "level")
    return dataclasses.replace(
        steps, **{name: getattr(steps, name)[: event + 1] for name in columns}
    )


class RayWalk(Play):
    """The walk of one ray, or of a cone around it."""

    def __init__(self, subject: Subject, settings: Settings, progress: Progress) -> None:
        structure = subject.structures[0]
        progress.report(0, 3, "Tracing the rays")
        rays = subject.rays or own_rays(subject.scene)
        hits, counts = structure.trace(rays, progress=progress)
        order = np.arange(len(rays))
        if subject.rays is None:
            leaves = counts["N_ETS"]
            order = np.lexsort([counts["N_TS"], leaves < FEW_LEAVES, ~np.isfinite(hits.t)])
        progress.report(1, 3, "Recording the ray")
        number = int(order[min(settings.ray, len(rays) - 1)])
        angle, t_hit = math.radians(settings.cone), float(hits.t[number])
        self.primitive = int(hits.primitive[number])
        if angle:
            _, steps = structure.cover(rays, number, angle)
        else:
            steps = structure.record(rays, number)
        progress.report(2, 3, "Looking at the cells")
        cells = structure.cells(progress)
        self.walk = Walk(structure, cells, rays, number, t_hit, steps, angle)
        self.ends = {"event": len(steps) - 1, "ray": len(rays) - 1}
        self.start = self._start(subject.scene)

    def _start(self, scene: Scene) -> np.ndarray:
        """Return where the ray is drawn from: its origin, or a place nearer to the scene, (3,)."""
        rays, ray = self.walk.rays, self.walk.ray
        direction = rays.directions[ray]
        to_centre = 0.5 * (scene.lower + scene.upper) - rays.origins[ray]
        length = float(np.linalg.norm(direction))
        way = float(to_centre @ direction) / length - NEAR * scene.diagonal
        return self.walk.at(np.array([max(way, 0.0) / length]))[0]

    def picture(self, settings: Settings) -> Picture:
        """Return the walk up to an event, or all of it."""
        walk, steps = self.walk, self.walk.steps
        event = len(steps) - 1 if settings.whole else settings.event
        segments, colours = segments_of(walk, None if settings.whole else event, PALETTE)
        segments[(segments == walk.rays.origins[walk.ray]).all(axis=2)] = self.start
        parts = [Lines(segments, colours)]
        on_stack = waiting(steps, event)
        marks = []
        if not settings.whole:
            places = walk.cells.places_of(on_stack[:MOST_WAITING])
            parts.append(coloured(dashes_of(wires_of(walk.cells, places).segments()), YELLOW))
            parts.append(self._tested(event))
            marks = self._marks(event)
        name = walk.structure.scene.primitive_name
        what = f"Event {event} of {len(steps) - 1}: {event_text(steps, event, name)}"
        if settings.whole:
            what = f"The whole walk, {len(steps)} events"
        if any(len(steps.events_of(kind, event)) > MOST_VISITED for kind in VISITS):
            what += f"; drawn: the last {MOST_VISITED} cells of a kind"
        if walk.half_angle:
            what += f"; a cone of {settings.cone:g} degrees around the ray"
        so_far = up_to(steps, event).tally()
        rows = [
            Row(counter.label, str(so_far[counter.name]), f"so far: {counter.meaning}")
            for counter in steps.counters
        ]
        rows.append(
            Row(
                "Waiting",
                str(len(on_stack)),
                "nodes whose volumes were hit and that wait their turn",
            )
        )
        if not walk.half_angle:
            rows.append(Row("Hit", self._hit_text(), "what the ray hits in the end"))
        return picture_of(parts, what, marks=marks, rows=rows)

    def _hit_text(self) -> str:
        """Say what the ray hits in the end."""
        if not np.isfinite(self.walk.t_hit):
            return "nothing"
        scene = self.walk.structure.scene
        name, within = scene.object_of(self.primitive)
        return f"{scene.primitive_name} {within} of {name} at t = {self.walk.t_hit:.6g}"

    def _tested(self, event: int) -> Lines:
        """Return the volume that an event tests: green if it is hit, red if it is missed."""
        steps, cells = self.walk.steps, self.walk.cells
        cell = int(steps.cell[event])
        is_test = steps.kind[event] == VOLUME_TEST and steps.level[event] == 0 and cell >= 0
        numbers = np.array([cell] if is_test else [], dtype=np.int64)
        colour = GREEN if np.isfinite(steps.t_enter[event]) else RED
        return coloured(wires_of(cells, cells.places_of(numbers)).segments(), colour)

    def _marks(self, event: int) -> list[Mark]:
        """Return where the ray is: t at the event, and the hit that is the nearest so far."""
        walk, steps = self.walk, self.walk.steps
        marks = [Mark(self.start, "ray")]
        t = float(steps.t_enter[event])
        if np.isfinite(t) and int(steps.kind[event]) not in (TEST, HIT):
            marks.append(Mark(walk.at(np.array([t]))[0], f"t = {t:.4g}", MAGENTA[:3]))
        hits = steps.events_of(HIT, event)
        hits = hits[steps.level[hits] == 0]
        if len(hits):
            nearest = float(steps.t_enter[hits[-1]])
            place = walk.at(np.array([nearest]))[0]
            marks.append(Mark(place, f"nearest hit, t = {nearest:.4g}", GREEN[:3]))
        return marks


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record the ray, or refuse the cone."""
    structure = subject.structures[0]
    if settings.cone:
        structure.refuse_cones(Spread(math.radians(settings.cone)))
    return RayWalk(subject, settings, progress)


LESSONS = (
    Lesson(
        name="ray",
        label="A Ray, Event by Event",
        slide="An efficient algorithm",
        begin="A ray walks through the structure: it enters cells, tests what lies in them, and "
        "stops as soon as nothing nearer can come",
        look_for="Each event is one line of the log that the kernel writes; the counters are "
        "tallies of these lines. Watch which volumes wait, and which are thrown away after a hit",
        question="When may the walk stop, although volumes are still waiting?",
        answer="When the nearest hit so far lies before the point where the ray enters each of "
        "them: whatever is in there is hit later",
        source="contract.walk",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="event",
        replays=("ray", "cone"),
        takes_ray=True,
    ),
)
