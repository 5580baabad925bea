"""Lesson "sah": the terms of the cost of one split, each in its place.

    Cost(V -> {L, R}) = t_tra + t_tri (SA(V_L) / SA(V) N_L + SA(V_R) / SA(V) N_R)

Everything is read from a split of the build log and from the tree that came of it: the volumes are
the boxes of the node and of its children, as the builder drew them around the triangles, and the
terms add up to the cost that the log has. Beside the model the terms stand on each other as a bar,
and next to it what the node costs undivided, t_tri N.

Grey: V. Blue: the left child. Orange: the right one. Red: the plane. Lecture, slide "Surface Area
Heuristics (SAH)"; the builder's t_tra and t_tri are its settings C_trav and C_isect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.box_shape import box_segments, surface_area
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    Chart,
    Colour,
    Faces,
    Lines,
    coloured,
    column,
    cut_across,
    faint,
    picture_of,
    solid,
    some_of,
)
from .hierarchy import tree_of
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .splits import Split, splits_by_cost, was_split_by_cost

MOST_ITEMS = 1200
"""Items of either side that are drawn, evenly chosen."""

TERMS = {
    "volumes": "V and its children",
    "traversal": "t_tra",
    "left": "The left child",
    "right": "The right child",
    "cost": "The whole cost, and that without a split",
}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    node: int = setting(0, "Split", "Which split, level by level; the root's is 0", minimum=0)
    term: str = setting("cost", "Term", "Up to which term of the cost", choices=TERMS)


class Terms(NamedTuple):
    """The figures of a split, by the names of the slide."""

    N: int
    N_L: int
    N_R: int
    p_L: float
    p_R: float
    t_tra: float
    t_tri: float

    @property
    def left(self) -> float:
        """What the left child is expected to cost."""
        return self.t_tri * self.p_L * self.N_L

    @property
    def right(self) -> float:
        """What the right child is expected to cost."""
        return self.t_tri * self.p_R * self.N_R

    @property
    def cost(self) -> float:
        """The cost of the split."""
        return self.t_tra + self.left + self.right

    @property
    def unsplit(self) -> float:
        """The cost without a split."""
        return self.t_tri * self.N


def terms_of(bvh: BVH, split: Split) -> Terms:
    """Return the figures of a split."""
    shares = surface_area(split.sides) / surface_area(split.box)
    n_left, n_right = (len(ids) for ids in split.ids)
    return Terms(
        n_left + n_right, n_left, n_right, float(shares[0]), float(shares[1]),
        bvh.settings.C_trav, bvh.settings.C_isect,
    )  # fmt: skip


class Sah(Play):
    """Splits of one tree."""

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        self.splits = splits_by_cost(bvh, progress)
        if not self.splits:
            raise InputError(
                "no node of this tree was divided by its cost; choose a mesh of more triangles"
            )
        self.terms = [terms_of(bvh, split) for split in self.splits]
        geometry = bvh.scene.geometry
        self.lines = [
            [lines_of_items(geometry, some_of(ids, MOST_ITEMS)) for ids in split.ids]
            for split in self.splits
        ]
        self.scene, self.ends = bvh.scene, {"node": len(self.splits) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a split up to one of its terms."""
        split, terms = self.splits[settings.node], self.terms[settings.node]
        shown = list(TERMS).index(settings.term)
        sides = (("L", BLUE, "left"), ("R", ORANGE, "right"))
        parts: list[Lines | Faces] = [coloured(box_segments(split.box[None]), GREY)]
        for place, (_, colour, name) in enumerate(sides):
            is_subject = settings.term in ("volumes", name, "cost")
            lines = self.lines[settings.node][place]
            parts.append(coloured(lines, colour if is_subject else faint(colour, 0.25)))
            parts += solid(split.sides[place : place + 1], colour, 0.16 if is_subject else 0.04)
        parts += cut_across(split.box, split.axis, split.position)
        bars, beside = self._bars(terms, shown)
        return picture_of(
            [*parts, *bars],
            caption_of(split, terms, settings.term),
            marks=[*self._marks(terms, shown), *beside],
            rows=rows_of(split, terms),
        )

    def _marks(self, terms: Terms, shown: int) -> list[Mark]:
        """Return the figures of the children, above the model."""
        texts = [(f"V_L: N_L = {terms.N_L}", BLUE), (f"V_R: N_R = {terms.N_R}", ORANGE)]
        if shown >= 2:
            texts.insert(1, (f"SA(V_L) / SA(V) = {terms.p_L:.2f}", BLUE))
        if shown >= 3:
            texts.append((f"SA(V_R) / SA(V) = {terms.p_R:.2f}", ORANGE))
        return column(self.scene, texts)

    def _bars(self, terms: Terms, shown: int) -> tuple[list[Lines | Faces], list[Mark]]:
        """Return the terms on each other, to the right of the model, and their figures."""
        top = max(terms.cost, terms.unsplit)
        chart = Chart.beside(self.scene, 0.0, 1.0, top)
        pieces: list[tuple[float, Colour, str]] = [
            (terms.t_tra, GREY, f"t_tra = {terms.t_tra:g}"),
            (terms.left, BLUE, f"{terms.p_L:.2f} · {terms.N_L} = {terms.left:.2f}"),
            (terms.right, ORANGE, f"{terms.p_R:.2f} · {terms.N_R} = {terms.right:.2f}"),
        ]
        parts: list[Lines | Faces] = [chart.axes()] if shown else []
        marks, low, last = [], 0.0, -np.inf

        def bar(left: float, low: float, high: float, colour: Colour) -> None:
            begin, end = np.array([left]), np.array([left + 0.18])
            parts.extend(chart.blocks(begin, end, np.array([low]), np.array([high]), colour))

        for value, colour, text in pieces[:shown]:
            bar(0.02, low, low + value, colour)
            last = max(low + 0.5 * value, last + 0.09 * top)
            marks.append(Mark(chart.place(0.22, last), text, colour[:3]))
            low += value
        if shown == len(TERMS) - 1:
            bar(0.8, 0.0, terms.unsplit, GREY)
            marks.append(
                Mark(chart.place(0.65, terms.unsplit + 0.07 * top), f"t_tri N = {terms.unsplit:g}")
            )
            above = max(low, last) + 0.1 * top
            marks.append(Mark(chart.place(0.02, above), f"Cost = {low:.2f}"))
        return parts, marks


def caption_of(split: Split, terms: Terms, term: str) -> str:
    """Return the terms in words."""
    text = f"Split of node {split.node} at depth {split.depth}, N = {terms.N}: "
    if term == "volumes":
        return f"{text}{'xyz'[split.axis]} = {split.position:.4g} parts V into V_L and V_R"
    if term == "traversal":
        return f"{text}whoever enters V pays t_tra = {terms.t_tra:g} for the tests of both children"
    if term in ("left", "right"):
        side, share, count, cost = (
            ("L", terms.p_L, terms.N_L, terms.left)
            if term == "left"
            else ("R", terms.p_R, terms.N_R, terms.right)
        )
        return (
            f"{text}of the rays that hit V a share of SA(V_{side}) / SA(V) = {share:.3f} hits "
            f"V_{side} and tests N_{side} = {count} there: {cost:.2f}"
        )
    verdict = "less" if terms.cost < terms.unsplit else "no less"
    return (
        f"{text}Cost(V -> {{L, R}}) = {terms.t_tra:g} + {terms.t_tri:g} ({terms.p_L:.3f} · "
        f"{terms.N_L} + {terms.p_R:.3f} · {terms.N_R}) = {terms.cost:.2f}, {verdict} than "
        f"t_tri N = {terms.unsplit:g}"
    )


def rows_of(split: Split, terms: Terms) -> list[Row]:
    """Return the figures of the slide."""
    return [
        Row(
            "t_tra", f"{terms.t_tra:g}", "Traversal cost: tests of both volumes, and the recursion"
        ),
        Row("t_tri", f"{terms.t_tri:g}", "Cost of one intersection with an object"),
        Row("SA(V)", f"{float(surface_area(split.box)):.5g}", "Surface area of the parent volume"),
        Row("SA(V_L) / SA(V)", f"{terms.p_L:.4f}", "Share of the rays through V that hit V_L"),
        Row("N_L", str(terms.N_L), "Objects in the left child"),
        Row("SA(V_R) / SA(V)", f"{terms.p_R:.4f}", "Share of the rays through V that hit V_R"),
        Row("N_R", str(terms.N_R), "Objects in the right child"),
        Row("Cost(V -> {L, R})", f"{terms.cost:.2f}", "Expected cost of a ray that hits V"),
        Row("Cost(V)", f"{terms.unsplit:g}", "The same without a split: t_tri N"),
    ]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the splits of a tree."""
    return Sah(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="sah",
        label="The Surface Area Heuristic",
        slide="Surface Area Heuristics (SAH)",
        begin="What a division of a volume costs a ray is estimated from two areas and two counts",
        look_for="Each child counts with the share of the rays that reach it, which is its surface "
        "over that of V, times the objects that wait there",
        question="The two shares may be more than 1 together. Why is not every such split a loss?",
        answer="A ray can hit both children, so their shares may add up to as much as 2. But a "
        "share multiplies only the objects of its own child: a split pays if many objects are "
        "behind little surface",
        source="structures.bvh.builders.top_down.sweep_sah",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=sweep_sah",),
        suits=was_split_by_cost,
        Settings=Settings,
        play=play,
        film="term",
    ),
)
