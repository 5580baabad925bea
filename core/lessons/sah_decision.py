"""Lessons "sah_decision" and "one_more_level": planes I, II, III, then X and III + X.

The slides' worked example: 76 triangles, t_tra = 3, t_tri = 1. Its figures are computed from the
triangles of the sample (:mod:`..sah.worked_example`) and come out as the slides print them. On any
other mesh the planes lie at the same shares of its box: I, II and III across the longest side, and
X across the longer other side of what III leaves on the right.

As on the slides, the children are the halves of the *space*, not boxes drawn tight around their
triangles. Below the model stands the cost of every plane across that side, right under the plane.

Blue: left of the plane. Orange: right of it. Red: the plane, and its cost. Grey: what is not
concerned, and in the chart what V costs undivided.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..sah.split_plane import SplitPlane, halves_of, sort_along
from ..sah.worked_example import PRINTED, T_TRA, T_TRI, cases_of, is_worked_example
from ..scene import Scene
from ..settings import setting
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Faces,
    Lines,
    coloured,
    column,
    cut_across,
    extent_of,
    faint,
    outlines,
    picture_of,
    solid,
)
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .split_plane import (
    ItemLines,
    drawn_curve,
    drawn_halves,
    rows_of,
    texts_of,
)

FIRST = "I", "II", "III"

PLANES = {"V": "No plane", "I": "Plane I", "II": "Plane II", "III": "Plane III"}

LEVELS = {
    "III": "Plane III alone",
    "X": "Plane X in its right half",
    "III+X": "Both, one after the other",
}


@dataclass(frozen=True)
class DecisionSettings:
    """The knob of the lesson "sah_decision"."""

    plane: str = setting("III", "Plane", "Which of the slide's planes", choices=PLANES)


@dataclass(frozen=True)
class LevelSettings:
    """The knob of the lesson "one_more_level"."""

    planes: str = setting("III+X", "Planes", "Which of the slide's planes", choices=LEVELS)


class Decision(Play):
    """The six cases of the example, over the items of a scene."""

    def __init__(self, scene: Scene, progress: Progress) -> None:
        progress.report(0, 2, "Counting on both sides of the planes")
        self.scene, boxes = scene, scene.boxes()
        self.box = np.concatenate([scene.lower, scene.upper])
        self.cases = {case.name: case for case in cases_of(boxes, self.box, progress)}
        self.is_printed = is_worked_example(len(scene), self.box)
        self.lines = ItemLines.of(scene)
        progress.report(1, 2, "Counting on both sides of the planes")
        self.along = {}
        for name in ("III", "X"):  # I and II lie across the same axis as III
            box, (plane,) = self.cases[name].box, self.cases[name].planes
            self.along[name] = sort_along(boxes[inside(boxes, box)], plane.axis, progress)

    def picture(self, settings: DecisionSettings | LevelSettings) -> Picture:
        """Return the picture of one case."""
        name = settings.plane if isinstance(settings, DecisionSettings) else settings.planes
        case = self.cases[name]
        parts: list[Lines | Faces] = [coloured(box_segments(self.box[None]), GREY)]
        marks: list[Mark] = []
        if len(case.planes) == 1:
            (plane,) = case.planes
            there = self.lines.inside(case.box)
            parts.append(coloured(self.lines.segments[~there], faint(GREY)))
            parts += drawn_halves(self.lines, case.box, plane)
            along = self.along["X" if name == "X" else "III"]
            curve, beside = drawn_curve(along, case.box, plane, T_TRA, T_TRI)
            parts, marks = [*parts, *curve], [*marks, *beside]
        elif case.planes:
            parts += self._both(*case.planes)
        else:
            parts.append(coloured(self.lines.segments, GREY))
        if isinstance(settings, DecisionSettings):
            parts += self._other_planes(name)
            marks += [self._name_of(each, self.box) for each in FIRST]
        else:
            marks.append(self._name_of("III", self.box))
            if name != "III":
                marks.append(self._name_of("X", self.cases["X"].box))
        return picture_of(
            parts, self._caption(name), marks=[*self._figures(name), *marks], rows=self._rows(name)
        )

    def _both(self, third: SplitPlane, x: SplitPlane) -> list[Lines | Faces]:
        """Return the three parts that III and X make of V."""
        left, right = halves_of(self.box, third.axis, third.position)
        there = self.lines.inside(left)
        parts: list[Lines | Faces] = [
            *solid(left[None], BLUE, 0.1),
            coloured(self.lines.segments[there], BLUE),
        ]
        parts += drawn_halves(self.lines, right, x)
        return [*parts, *cut_across(self.box, third.axis, third.position)]

    def _other_planes(self, name: str) -> list[Lines | Faces]:
        """Return the outlines of those of the first planes that are not looked at."""
        others = [self.cases[each].planes[0] for each in FIRST if each != name]
        cuts = [planes_across(self.box[None], p.axis, np.array([p.position])) for p in others]
        return [coloured(outlines(cut), faint(RED, 0.5)) for cut in cuts]

    def _name_of(self, name: str, box: np.ndarray) -> Mark:
        """Return the name of a plane, above it or to its right."""
        plane = self.cases[name].planes[0]
        place = box[3:].copy()
        if plane.axis == 2:  # to the right of the front edge
            place = box[[3, 1, 2]]
        place[plane.axis] = plane.position
        place[2 if plane.axis != 2 else 0] += 0.03 * extent_of(self.scene)
        return Mark(place, name, RED[:3])

    def _figures(self, name: str) -> list[Mark]:
        """Return the figures in their colours, above the model."""
        case = self.cases[name]
        texts = []
        if len(case.planes) == 1:
            (plane,) = case.planes
            return column(self.scene, texts_of(plane, f"({name})"))
        elif case.planes:
            third, x = case.planes
            texts = [
                (f"N_L = {third.N_L}   p_L = {third.p_L:.2f}", BLUE),
                (f"p_R = {third.p_R:.2f}   Cost(X) = {x.cost:.1f}", ORANGE),
            ]
        return column(self.scene, [*texts, (f"Cost({name}) = {case.cost:.1f}", RED)])

    def _caption(self, name: str) -> str:
        """Return the cost with its numbers, and what the slide prints."""
        case = self.cases[name]
        text = f"Cost({name}) = {case.formula} = {case.cost:.2f}; "
        if self.is_printed:
            text += f"the slide prints {PRINTED[name]:.1f} "
        else:
            text += f"V undivided costs {self.cases['V'].cost:g} "
        return f"{text}(t_tra {T_TRA:g}, t_tri {T_TRI:g})"

    def _rows(self, name: str) -> list[Row]:
        """Return the figures of the slide."""
        case = self.cases[name]
        rows = [
            Row("t_tra", f"{T_TRA:.1f}", "Traversal cost of the slide"),
            Row("t_tri", f"{T_TRI:.1f}", "Intersection cost of the slide"),
            Row("N", str(len(self.scene)), "Triangles in V"),
            Row("Cost(V)", f"{self.cases['V'].cost:g}", "Without a split: t_tri N"),
        ]
        if len(case.planes) == 1:
            rows += rows_of(case.planes[0])
        elif case.planes:
            rows += rows_of(case.planes[0])[:4]
            rows.append(Row("Cost(X)", f"{case.planes[1].cost:.1f}", "Of the right half"))
            rows.append(Row("Cost(III+X)", f"{case.cost:.1f}", "With Cost(X) in place of N_R"))
        return rows


def inside(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return which boxes (n, 6) have their centroid in a box, (n,) bool."""
    centroids = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    return ((centroids >= box[:3]) & (centroids <= box[3:])).all(axis=1)


def play(subject: Subject, settings: DecisionSettings | LevelSettings, progress: Progress) -> Play:
    """Count what lies on both sides of every plane."""
    return Decision(subject.scene, progress)


LESSONS = (
    Lesson(
        name="sah_decision",
        label="The SAH Decision",
        slide="SAH decision",
        begin="Three planes for the same volume: the surface area heuristic says which is best",
        look_for="Plane I leaves almost all in almost the whole of V and saves little; II divides "
        "the space, III the triangles from the empty space",
        question="II and III have the same counts, 12 and 64. Why is III so much cheaper?",
        answer="The 64 triangles on the right are tested by every ray that hits the right half. "
        "III makes that half small: 29 of 100 rays hit it, where with II it is 67. The large left "
        "half has little in it, so it does not matter that it is hit more often",
        source="sah.worked_example",
        sample="sah_example",
        Settings=DecisionSettings,
        play=play,
        film="plane",
    ),
    Lesson(
        name="one_more_level",
        label="One More Level",
        slide="One more level",
        begin="What a half costs was a guess: dividing it, too, puts a better cost in its place",
        look_for="Cost(X) takes the place of the 64 triangles of the right half, weighted with the "
        "same p_R",
        question="The heuristic chose III as if both halves became leaves. Is that choice safe?",
        answer="No, it is greedy: it compares costs in which every half counts all its triangles. "
        "Another plane might allow better divisions below. Looking further ahead at every node "
        "would cost far more than it gains, so builders do not",
        source="sah.worked_example",
        sample="sah_example",
        Settings=LevelSettings,
        play=play,
        film="planes",
    ),
)
