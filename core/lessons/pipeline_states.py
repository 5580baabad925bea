"""Lesson "pipeline_states": the stages of the pipeline light up, as a ray goes through them.

Lecture, slide "DirectX Raytracing (DXR)": ray generation, intersection, any hit, closest hit, miss,
and when each of them is called. Beside the model stand the stages; the one that the ray is in is
orange, arrows lead from the one before. A program that comes with AccelScope is run for one ray of
the lesson's own, in plain Python, by the functions that are compiled for pictures; they note every
state (:func:`..pipeline.stage.tell`), and so the figures are what the program's counters count.

Primary rays are violet, rays that a closest hit shader sends on are blue. What was ignored is red,
what counts is green, the candidate of the moment is magenta.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import InputError
from ..geometry.geometry import lines_of
from ..geometry.marks import arrows, stars
from ..geometry.rays import Rays
from ..pipeline.launch import Pipeline, State, refuse_structure
from ..pipeline.loading import program_named
from ..pipeline.stage import STAGE_NAMES
from ..progress import Progress
from ..settings import setting
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Chart,
    Colour,
    Faces,
    Lines,
    coloured,
    extent_of,
    faint,
    outlines,
    picture_of,
    quads,
)
from .lesson import Lesson, Play, Subject
from .one_ray import RAY
from .picture import Mark, Picture, Row
from .ray import MAGENTA, own_rays

TRIED = 24
"""Rays of which those that go through most states are shown."""

SHOWN = 8

REACH = 0.5
"""How much of a ray that hits nothing is drawn, in the scene's diagonal."""

BOXES = {
    "Ray generation": (0.0, 1.35, 5.0, 5.6),
    "TraceRay": (1.75, 3.1, 5.0, 5.6),
    "Traversal": (1.75, 3.1, 3.9, 4.5),
    "Intersection": (0.0, 1.35, 2.8, 3.4),
    "Any hit": (1.75, 3.1, 2.8, 3.4),
    "Commit: TMax = t": (1.75, 3.1, 1.7, 2.3),
    "Closest hit": (0.0, 1.35, 0.6, 1.2),
    "Miss": (1.75, 3.1, 0.6, 1.2),
}
"""Left, right, bottom and top of the stages."""

BOX_OF = {
    "ray_generation": "Ray generation", "trace_ray": "TraceRay", "candidate": "Traversal",
    "outside_interval": "Traversal", "culled": "Traversal", "intersection": "Intersection",
    "report_hit": "Intersection", "any_hit": "Any hit", "ignored": "Any hit",
    "accepted": "Commit: TMax = t", "search_ended": "Commit: TMax = t", "hit": "Traversal",
    "no_hit": "Traversal", "closest_hit": "Closest hit", "closest_hit_skipped": "Traversal",
    "miss": "Miss", "returned": "TraceRay",
}  # fmt: skip
"""The stage of each state."""

FLOW = (
    ((1.35, 5.3), (1.75, 5.3)), ((2.42, 5.0), (2.42, 4.5)), ((2.42, 3.9), (2.42, 3.4)),
    ((1.75, 4.1), (1.1, 3.4)), ((1.35, 3.1), (1.75, 3.1)), ((2.42, 2.8), (2.42, 2.3)),
    ((3.1, 2.0), (3.35, 2.6)), ((3.35, 3.6), (3.1, 4.1)), ((3.1, 3.1), (3.35, 3.5)),
    ((1.85, 3.9), (1.55, 3.5)), ((1.55, 1.3), (1.35, 1.0)), ((1.55, 1.3), (1.75, 1.0)),
)  # fmt: skip
"""Arrows between the stages."""

STEMS = (((3.35, 2.6), (3.35, 3.6)), ((1.55, 3.5), (1.55, 1.3)))
"""Lines that join them: an accepted or ignored hit leads back, and the last candidate down."""

CALLS = {
    "Ray generation": "ray_generation", "TraceRay": "trace_ray", "Intersection": "intersection",
    "Any hit": "any_hit", "Closest hit": "closest_hit", "Miss": "miss",
}  # fmt: skip
"""What is counted of a stage."""

WORDS = {
    "ray_generation": "the shader of the pixel begins",
    "trace_ray": "a ray is sent, and whoever sent it waits",
    "candidate": "the walk meets a primitive; in which order is not promised",
    "outside_interval": "it lies where the ray's interval has ended by now",
    "culled": "the ray's flags leave it out",
    "intersection": "the ray is in the box of a procedural primitive, whose shader looks for hits",
    "report_hit": "the shader has found one",
    "any_hit": "the primitive is not opaque: its shader is asked, whatever lies nearer",
    "ignored": "IgnoreHit: as if nothing had been there",
    "accepted": "the hit counts until a nearer one is found; the interval ends here from now on",
    "search_ended": "one hit is enough: nothing else is searched for",
    "hit": "all candidates are done, and the nearest accepted one is the hit",
    "no_hit": "all candidates are done, and none was accepted",
    "closest_hit": "once, after all any hit shaders; it may trace rays itself",
    "closest_hit_skipped": "the ray's flags ask for no shader",
    "miss": "nothing was hit",
    "returned": "whoever sent the ray goes on with what is in the payload",
}
"""What a state means."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    state: int = setting(4, "State", "State of the ray; the first is 0", minimum=0)
    ray: int = setting(
        0, "Ray", "Which of the lesson's own rays; the one with most states comes first", minimum=0
    )
    program: str = setting(
        "leaves", "Program", "What the shaders do",
        choices={
            "leaves": "Any hit shaders cut leaves out of triangles; shadow rays end at the first",
            "shadows": "Closest hit sends a shadow ray, and skips its closest hit shader",
            "mirror": "Closest hit sends reflected rays, six deep",
            "lecture": "Closest hit writes barycentric coordinates; there is no miss shader",
        },
    )  # fmt: skip


@dataclass(frozen=True)
class Sent:
    """A ray of the program: where it goes, and in which of the states it is under way.

    Attributes
    ----------
    origin, direction : (3,) float64
    depth, ray_type, begin : int
        The state in which it is sent.
    """

    origin: np.ndarray
    direction: np.ndarray
    depth: int
    ray_type: int
    begin: int


class PipelineStates(Play):
    """The states of some rays of a program."""

    def __init__(self, subject: Subject, settings: Settings, progress: Progress) -> None:
        structure = subject.structures[0]
        self.scene = subject.scene
        self.program = program_named(settings.program)
        pipeline = Pipeline(structure, self.program)
        rays = own_rays(self.scene)
        hits, _ = structure.trace(rays, progress=progress)
        hit = np.flatnonzero(hits.primitive >= 0)
        tried = hit if len(hit) else np.arange(len(rays))
        tried = tried[np.linspace(0, len(tried) - 1, min(TRIED, len(tried))).astype(int)]
        found: list[tuple[list[State], int]] = []
        for done, number in enumerate(tried.tolist()):
            progress.report(done, len(tried), "Running the program")
            states, _ = pipeline.record(rays, len(rays), 1, number)
            found.append((states, number))
        found.sort(key=lambda each: -len(each[0]))
        self.found = found[:SHOWN]
        self.rays = rays
        self.ends = {
            "state": max(len(states) for states, _ in self.found) - 1,
            "ray": len(self.found) - 1,
        }

    def _chart(self) -> Chart:
        """Return where the stages stand: right of the model."""
        size = extent_of(self.scene)
        middle = 0.5 * (self.scene.lower + self.scene.upper)
        corner = np.array([self.scene.upper[0] + 0.45 * size, middle[1], middle[2] - 0.65 * size])
        across, upwards = np.array([1.5 * size, 0.0, 0.0]), np.array([0.0, 0.0, 1.3 * size])
        return Chart(corner, across, upwards, 0.0, 3.1, 6.0)

    def picture(self, settings: Settings) -> Picture:
        """Return the stages and the scene in one state."""
        states, _ = self.found[settings.ray]
        now = min(settings.state, len(states) - 1)
        state = states[now]
        parts, marks = self._stages(states, now)
        parts += self._rays(states, now)
        calls = dict.fromkeys(STAGE_NAMES, 0)
        for each in states[: now + 1]:
            if each.name in calls:
                calls[each.name] += 1
        types = self.program.ray_types
        kind = types[state.ray_type] if state.ray_type < len(types) else f"type {state.ray_type}"
        rows = [
            Row("Program", settings.program, self.program.label),
            Row("State", state.name.replace("_", " "), WORDS[state.name]),
            Row("Ray", f"{kind}, depth {state.depth}", "The class of the ray, and how deep it is"),
            *(Row(label, str(calls[name]), f"Calls of {label} so far")
              for label, name in CALLS.items()),
        ]  # fmt: skip
        return picture_of(parts, self._caption(states, now), marks=marks, rows=rows)

    def _caption(self, states: list[State], now: int) -> str:
        state = states[now]
        text = f"State {now} of {len(states) - 1}, {state.name.replace('_', ' ')}"
        if state.primitive >= 0:
            text += f", {self.scene.primitive_name} {state.primitive} at t = {state.t:.4g}"
        return f"{text}: {WORDS[state.name]}"

    def ray_shown(self, settings: Settings) -> Rays | None:
        """Return the primary ray."""
        return self.rays.select(np.array([self.found[settings.ray][1]]))

    def _stages(self, states: list[State], now: int) -> tuple[list[Lines | Faces], list[Mark]]:
        """Return the boxes of the stages, with calls so far; the current one is lit."""
        chart = self._chart()
        parts: list[Lines | Faces] = []
        marks: list[Mark] = []
        calls = {label: sum(s.name == name for s in states[: now + 1])
                 for label, name in CALLS.items()}  # fmt: skip
        here = BOX_OF[states[now].name]
        for label, (left, right, low, high) in BOXES.items():
            box = chart.rectangles(*np.array([[left], [right], [low], [high]]))
            is_here = label == here
            been = any(BOX_OF[each.name] == label for each in states[:now])
            colour = ORANGE if is_here else GREY if been else faint(GREY, 0.45)
            parts.append(coloured(outlines(box), colour))
            if is_here:
                parts.append(quads(box, ORANGE, 0.55))
            text = f"{label} {calls[label]}" if calls.get(label) else label
            marks.append(Mark(chart.place(left + 0.08, low + 0.2), text))
        ends = np.array(FLOW)
        flow = chart.points(ends[..., 0].ravel(), ends[..., 1].ravel()).reshape(-1, 2, 3)
        stems = np.array(STEMS)
        stem = chart.points(stems[..., 0].ravel(), stems[..., 1].ravel()).reshape(-1, 2, 3)
        parts.append(coloured(np.concatenate([arrows(flow), stem]), faint(GREY, 0.6)))
        if now:
            before = BOX_OF[states[now - 1].name]
            if before != here:
                step = np.array([[self._middle(chart, before), self._middle(chart, here)]])
                parts.append(coloured(arrows(step), ORANGE))
        return parts, marks

    def _middle(self, chart: Chart, label: str) -> np.ndarray:
        left, right, low, high = BOXES[label]
        return chart.place(0.5 * (left + right), 0.5 * (low + high))

    def _rays(self, states: list[State], now: int) -> list[Lines | Faces]:
        """Return the rays so far, and the primitives that they met."""
        parts: list[Lines | Faces] = []
        active = sent_until(states, now)
        under_way = {each.begin for each in active}
        finished = [
            number
            for number, state in enumerate(states[: now + 1])
            if state.name == "trace_ray" and number not in under_way
        ]
        for number in finished:
            parts += self._ray(states, sent_at(states, number), now, False)
        for sent in active:
            parts += self._ray(states, sent, now, sent is active[-1])
        return parts

    def _ray(
        self, states: list[State], sent: Sent, now: int, is_current: bool
    ) -> list[Lines | Faces]:
        """Return one ray up to where it is known to go, and what it met."""
        own = own_states(states, sent, now)
        colour: Colour = RAY if sent.depth == 1 else BLUE
        counts = [each for each in own if each.name == "accepted"]
        length = float(np.linalg.norm(sent.direction))
        far = REACH * self.scene.diagonal / length
        end = counts[-1].t if counts else min(far, own[0].t)
        points = sent.origin + np.array([[0.0], [end]]) * sent.direction
        parts: list[Lines | Faces] = [
            coloured(points[None], colour if is_current else faint(colour, 0.5))
        ]
        size = 0.035 * self.scene.diagonal
        if counts:
            parts.append(coloured(stars(points[1:], np.array([size])), GREEN))
        if not is_current:
            return parts
        last = states[now]
        for name, shade in (("candidate", GREY), ("ignored", RED), ("accepted", GREEN)):
            numbers = [each.primitive for each in own if each.name == name]
            parts.append(self._outlines(numbers[-200:], shade))
        if last.primitive >= 0:
            parts.append(self._outlines([last.primitive], MAGENTA))
            place = sent.origin + last.t * sent.direction
            parts.append(coloured(stars(place[None], np.array([size])), MAGENTA))
        return parts

    def _outlines(self, primitives: list[int], colour: Colour) -> Lines:
        numbers = np.array(sorted(set(primitives)), dtype=np.int64)
        return coloured(lines_of(self.scene.geometry, numbers)[0], colour)


def sent_at(states: list[State], number: int) -> Sent:
    """Return the ray that a state sends."""
    state = states[number]
    return Sent(
        np.array(state.origin), np.array(state.direction), state.depth, state.ray_type, number
    )


def sent_until(states: list[State], now: int) -> list[Sent]:
    """Return the rays that are under way in a state, the last sent last."""
    under_way: list[Sent] = []
    for number, state in enumerate(states[: now + 1]):
        if state.name == "trace_ray":
            under_way.append(sent_at(states, number))
        elif state.name == "returned" and number < now:
            under_way.pop()
    return under_way


def own_states(states: list[State], sent: Sent, now: int) -> list[State]:
    """Return the states of one ray up to one of them, without those of rays sent meanwhile."""
    found = []
    for state in states[sent.begin : now + 1]:
        if state.depth == sent.depth:
            found.append(state)
            if state.name == "returned":
                break
    return found


def suits(structure: object) -> str:
    """Accept what a program can trace against, see :attr:`.Lesson.suits`."""
    try:
        refuse_structure(structure)  # type: ignore[arg-type]
    except InputError as error:
        return str(error)
    return ""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Run the program for some rays."""
    return PipelineStates(subject, settings, progress)


LESSONS = (
    Lesson(
        name="pipeline_states",
        label="Five Shaders, State by State",
        slide="DirectX Raytracing (DXR)",
        begin="A program is five kinds of shaders, and the system decides when each is called",
        look_for="Any hit is asked for every candidate that is not opaque, near or far; closest "
        "hit or miss comes once, when all candidates are done, and may send rays on",
        question="Why may an any hit shader not trace rays?",
        answer="It is called in the middle of a walk, for candidates that may not even count in "
        "the end, in no promised order. Each such ray would have candidates of its own, whose any "
        "hit shaders trace rays, and so on; and the walk would have to be put aside each time. "
        "Closest hit and miss are called when the walk is over",
        source="pipeline.candidates",
        sample="soup:count=60,edge=0.35",
        structures=("bvh",),
        suits=suits,
        Settings=Settings,
        play=play,
        film="state",
        replays=("program",),
    ),
)
