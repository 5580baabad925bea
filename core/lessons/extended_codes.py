"""Lesson "extended_codes": the same number of bits, spent on long sides and on sizes.

Two copies of the scene, divided by the first bits of standard codes, on the left, and of extended
ones. Triangles whose codes begin alike are a group, and around each is its box: grey where the
triangles are small, orange where a bit has said that they are large. Above stands what each bit is
of: x, y, z, or S, the size. Codes are the builder's. Lecture, slide "Morton code based BVH tree";
M. Vinkler, J. Bittner, V. Havran: Extended Morton Codes for High Performance Bounding Volume
Hierarchy Construction, HPG 2017.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.box_shape import box_segments, surface_area
from ..parallel import Team
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.builders.morton.codes import SIZE, coding_over, sort_by_code
from ..structures.bvh.builders.morton.hlbvh import boxes_around
from ..structures.bvh.hierarchy import BVH
from .around import beside_each_other
from .drawing import BLUE, GREY, ORANGE, coloured, counted, items_in, picture_of, shifted
from .lesson import Lesson, Play, Subject
from .morton_intervals import sorts_by_code
from .picture import Mark, Picture, Row

MOST_BITS = 21
"""Bits by which the triangles are told apart: three of them say something about size."""

MOST_BOXES = 300
"""Boxes of groups that are drawn in a copy: the largest ones."""

LETTERS = "xyzS"
"""What a bit is of, by its kind."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    bits: int = setting(
        7, "Bits", "How many leading bits of the codes", minimum=0, maximum=MOST_BITS
    )


class Coded:
    """The triangles of one structure in the order of its codes.

    Attributes
    ----------
    codes : (n,) int64
    boxes : (n, 6) float64
    kinds : (bits,) int64
        Of what each bit is, the highest first.
    tests : (MOST_BITS + 1,) float64
        By the bits that are read: tests of a line through the root if the groups were leaves.
    """

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        boxes = bvh.scene.boxes()
        with Team(progress, "Sorting along the curve") as team:
            self.codes, order = sort_by_code(boxes, bvh.settings, team)
            self.kinds = coding_over(boxes, bvh.settings, team).kinds
        self.boxes = boxes[order]
        self.groups = []
        for bits in range(MOST_BITS + 1):
            progress.report(bits, MOST_BITS, "Reading the codes")
            starts = np.flatnonzero(np.diff(self.leading(self.codes, bits), prepend=-1))
            self.groups.append((starts, boxes_around(self.boxes, starts)))
        root = float(surface_area(self.groups[0][1])[0]) or 1.0
        self.tests = np.array(
            [
                float(surface_area(around) @ np.diff(starts, append=len(boxes))) / root
                for starts, around in self.groups
            ]
        )

    def leading(self, codes: np.ndarray, bits: int) -> np.ndarray:
        """Return the leading bits of codes, (k,)."""
        return codes >> len(self.kinds) - bits

    def is_large(self, bits: int) -> np.ndarray:
        """Say of each group whether one of its bits that are of the size is set, (k,) bool."""
        leading = self.leading(self.codes[self.groups[bits][0]], bits)
        is_large = np.zeros(len(leading), bool)
        for place in np.flatnonzero(self.kinds[:bits] == SIZE).tolist():
            is_large |= (leading >> bits - 1 - place & 1).astype(bool)
        return is_large

    def letters(self, bits: int) -> str:
        """Return of what the leading bits are."""
        return " ".join(LETTERS[kind] for kind in self.kinds[:bits])


class Extended(Play):
    """One scene by codes of both kinds."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        self.scene = subject.scene
        extended, standard = (Coded(_tree(each), progress) for each in subject.structures)
        self.coded = {"Standard": standard, "Extended": extended}
        self.body = items_in(self.scene, np.arange(len(self.scene)), GREY, 0.2)

    def picture(self, settings: Settings) -> Picture:
        """Return both copies after some bits."""
        size, bits = self.scene.upper - self.scene.lower, settings.bits
        above = self.scene.upper - np.array([size[0], 0.5 * size[1], -0.12 * size.max()])
        parts: list[Any] = []
        marks, rows, texts = [], [], []
        places = beside_each_other(self.scene, 2)
        for (name, coded), place in zip(self.coded.items(), places, strict=True):
            if place.any():  # the scene itself is there once
                parts.append(shifted(self.body, place))
            starts, boxes = coded.groups[bits]
            is_large = coded.is_large(bits)
            largest = np.argsort(-surface_area(boxes), kind="stable")[:MOST_BOXES]
            for which, colour in ((~is_large, BLUE), (is_large, ORANGE)):
                drawn = boxes[largest[which[largest]]]
                parts.append(shifted(coloured(box_segments(drawn), colour), place))
            groups = counted(len(starts), "group", "groups")
            marks.append(Mark(above + place, f"{name}: {coded.letters(bits) or 'no bits'}"))
            texts.append(f"{name.lower()}: {groups}, {coded.tests[bits]:.1f} tests")
            rows += [
                Row(name, groups, "Triangles whose codes begin alike"),
                Row(f"Tests, {name}", f"{coded.tests[bits]:.2f}",
                    "Of a line through the root, if the groups were leaves: less is better"),
            ]  # fmt: skip
        caption = f"The first {counted(bits, 'bit', 'bits')}; {'; '.join(texts)}"
        n_large = int(self.coded["Extended"].is_large(bits).sum())
        if n_large:
            caption += f"; orange: {counted(n_large, 'group', 'groups')} of large triangles"
        if max(len(coded.groups[bits][0]) for coded in self.coded.values()) > MOST_BOXES:
            caption += f"; drawn: the {MOST_BOXES} largest boxes of each"
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return a few bits of the place, those up to the first of the size, and more."""
        return [Settings(bits) for bits in (3, 6, 7, 14)]


def _tree(structure: Any) -> BVH:
    assert isinstance(structure, BVH)
    return structure


def has_extended_codes(structure: Any) -> str:
    """Accept trees that were built by extended codes, see :attr:`.Lesson.suits`."""
    if reason := sorts_by_code(structure):
        return reason
    if structure.settings.morton_codes != "extended":
        return "its Morton codes are the standard ones; take morton_codes=extended"
    return ""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Sort by codes of both kinds."""
    return Extended(subject, progress)


LESSONS = (
    Lesson(
        name="extended_codes",
        label="Codes That Heed Sizes and Long Sides",
        slide="Morton code based BVH tree",
        begin="A code has so many bits; extended codes spend them where cells are long, and on how "
        "large a triangle is",
        look_for="The first bits go to the long sides, here x and y alone, and the seventh takes "
        "the large triangles away from the small ones around them, whose boxes become small",
        question="A bit of the size tells triangles apart that lie beside each other. How can that "
        "make boxes smaller?",
        answer="The box of a group is as large as its largest triangle makes it. One wall among a "
        "thousand leaves gives them all a box like a wall; apart from it they have a small one, "
        "and only the wall's own is large",
        source="structures.bvh.builders.morton.codes",
        sample="teapot_in_stadium:size_ratio=6,teapot_resolution=5",
        structures=("bvh:builder=lbvh,morton_codes=extended", "bvh:builder=lbvh"),
        suits=has_extended_codes,
        Settings=Settings,
        play=play,
        film="bits",
    ),
)
