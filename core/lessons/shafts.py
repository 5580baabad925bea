"""Lesson "shafts": the start nodes of one class of rays, beside the walk from the root.

Rays that begin in one cell of a grid and go through one square of a cube are a class
(:mod:`..structures.shafts`; REFERENCE.md A28). On the left stands its shaft, orange, which all of
its rays fill together; green are the nodes at which they start, with numbers in the order in which
they may be entered, and blue those that one ray enters from there on. On the right the same ray
comes from the root: grey are the nodes that it enters there and not on the left.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.events import VISIT_INNER, VISIT_LEAF
from ..contract.steps import Steps
from ..geometry.box_shape import box_segments
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from ..structures.shafts import Shafts, ShaftsSettings
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    Faces,
    Lines,
    coloured,
    counted,
    extent_of,
    faint,
    items_in,
    picture_of,
    shifted,
    tinted,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .one_ray import RAY
from .picture import Mark, Picture, Row
from .ray_classification import beam_until, rays_within, sharp_edges

CELLS, SQUARES = 8, 4
"""Of the grid of origins along its longest side, and along the edge of a face of directions."""

MOST_NUMBERED = 9
"""Starts with numbers."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    max_starts: int = setting(
        16, "Max Starts", "Length of the start arrays", unit="nodes", minimum=1, maximum=64
    )
    number: int = setting(
        0, "Class", "Which class: that with the most rays is the first", minimum=0
    )


class ShaftOfClass(Play):
    """Classes to which rays have come, and both walks of one ray of each."""

    def __init__(self, structure: Shafts, rays: Rays, progress: Progress) -> None:
        self.structure, self.rays, self.scene = structure, rays, structure.scene
        self.hits, counts = structure.trace(rays, progress=progress)
        _, from_root = structure.bvh.trace(rays, progress=progress)
        self.work, self.work_from_root = (
            each["N_TS"] + each["volume_tests"] for each in (counts, from_root)
        )
        self.classes = structure.classes_of(rays)
        numbers, in_each = np.unique(self.classes, return_counts=True)
        has_starts = np.array([n >= 0 and len(structure.starts_of(n)) > 0 for n in numbers])
        # Of equally many rays the class with the lower number.
        order = np.lexsort((numbers, -in_each))
        self.order = numbers[order[has_starts[order]]]
        self.ends = {"number": len(self.order) - 1}
        self.figures = structure.statistics().extra
        self.boxes = structure.arrays.boxes
        self.walks(self.ray_of(int(self.order[0])))  # compiled once, for all pictures

    def ray_of(self, number: int) -> int:
        """Return the ray of a class that is shown: that which saves as much as half of them."""
        mine = np.flatnonzero(self.classes == number)
        saved = self.work_from_root[mine] - self.work[mine]
        return int(mine[np.argsort(saved, kind="stable")[len(mine) // 2]])

    def walks(self, ray: int) -> tuple[Steps, Steps]:
        """Return the walk of a ray from its starts, and that from the root."""
        return self.structure.record(self.rays, ray), self.structure.bvh.record(self.rays, ray)

    def shaft(self, number: int) -> np.ndarray:
        """Return the shaft of a class, as far as its starts reach: its faces, (k, 3, 3)."""
        bounds, roots = self.structure.bounds_of(np.array([number]))
        root, boxes = int(roots[0]), self.boxes[self.structure.starts_of(number)]
        ends = boxes[:, 3 + root // 2] if root % 2 == 0 else -boxes[:, root // 2]
        return beam_until(bounds[0], root, float(ends.max()))

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one class."""
        number = int(self.order[settings.number])
        starts, shaft, ray = (
            self.structure.starts_of(number),
            self.shaft(number),
            self.ray_of(number),
        )
        bounds, roots = self.structure.bounds_of(np.array([number]))
        begin = np.concatenate([bounds[0, 0, :3], bounds[0, 1, :3]])
        here, from_root = self.walks(ray)
        entered, entered_from_root = nodes_of(here), nodes_of(from_root)
        is_spared = ~np.isin(entered_from_root, entered)
        spared, shared = entered_from_root[is_spared], entered_from_root[~is_spared]
        boxes, line = self.boxes, self._line(ray)
        apart = 1.6 * extent_of(self.scene) * np.array([1.0, 0.0, 0.0])
        parts: list[Lines | Faces] = [
            tinted(shaft, ORANGE, 0.05),
            coloured(sharp_edges(shaft), faint(ORANGE, 0.5)),
            coloured(box_segments(begin[None]), ORANGE),
            coloured(box_segments(boxes[starts]), faint(GREEN, 0.7)),
            coloured(box_segments(boxes[entered]), BLUE),
            *line,
            shifted(coloured(box_segments(boxes[spared]), faint(GREY, 0.8)), apart),
            shifted(coloured(box_segments(boxes[shared]), BLUE), apart),
            *(shifted(part, apart) for part in line),
            shifted(items_in(self.scene, np.arange(len(self.scene)), GREY, 0.15), apart),
        ]
        middles = boxes[starts[:MOST_NUMBERED]].reshape(-1, 2, 3).mean(axis=1)
        marks = [Mark(middle, str(n + 1), GREEN[:3]) for n, middle in enumerate(middles)]
        above = self.scene.upper + 0.08 * extent_of(self.scene)
        place = np.array([self.scene.lower[0], above[1], above[2]])
        tests, tests_from_root = (each.tally()["volume_tests"] for each in (here, from_root))
        marks += [
            Mark(place, f"from {counted(len(starts), 'start', 'starts')}: "
                 f"{len(entered)} steps, {tests} tests", BLUE[:3]),
            Mark(place + apart, f"from the root: {len(entered_from_root)} steps, "
                 f"{tests_from_root} tests", GREY[:3]),
        ]  # fmt: skip
        root = int(roots[0])
        mine = self.classes == number
        work, work_from_root = self.work.mean(), self.work_from_root.mean()
        own, own_from_root = self.work[mine].mean(), self.work_from_root[mine].mean()
        caption = (
            f"A class of {counted(int(mine.sum()), 'ray', 'rays')} towards "
            f"{'+-'[root % 2]}{'xyz'[root // 2]}: all that its shaft meets lies below "
            f"{counted(len(starts), 'node', 'nodes')}, at which its rays start"
        )
        depths = self.structure.bvh.depths()[starts]
        rows = (
            Row("Starts", f"{len(starts)} of {settings.max_starts}",
                "Nodes in the array of this class"),
            Row("Depth", f"{depths.min()} to {depths.max()}", "Of these nodes; the root has 0"),
            Row("This Ray", f"{self.work[ray]} of {self.work_from_root[ray]}",
                "Steps and volume tests from the starts, of those from the root"),
            Row("This Class", f"{own:.3g} of {own_from_root:.3g}",
                "The same, per ray of this class"),
            Row("All Rays", f"{work:.3g} of {work_from_root:.3g}", "The same, per ray of all"),
            Row("Saved", f"{1.0 - work / work_from_root:.0%}", "Of steps and tests, of all rays"),
            Row("Classes", show_integer(self.figures["classes"]),
                f"{CELLS} cells along the longest side of the scene, six faces of {SQUARES} x "
                f"{SQUARES} squares"),
            Row("Share Made", f"{self.figures['made_share']:.1%}",
                "Classes that rays have come to / classes there are"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)

    def _line(self, ray: int) -> list[Lines]:
        """Return a ray up to its hit, with a star there, or to the end of what it was sent to."""
        origin, way, t = self.rays.origins[ray], self.rays.directions[ray], float(self.hits.t[ray])
        end = origin + min(t, 1.0) * way
        parts = [coloured(np.stack([origin, end])[None], RAY)]
        if t <= 1.0:
            size = np.array([0.05 * self.scene.diagonal])
            parts.append(coloured(stars(end[None], size), GREEN))
        return parts


def nodes_of(steps: Steps) -> np.ndarray:
    """Return the nodes that a walk enters, in order."""
    visits = np.isin(steps.kind, (VISIT_INNER, VISIT_LEAF)) & (steps.level == 0)
    return steps.cell[visits]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Send rays through the scene, for whose classes the tree is cut."""
    chosen = ShaftsSettings(
        max_starts=settings.max_starts, origin_cells=CELLS, direction_cells=SQUARES
    )
    structure = Shafts.build(subject.scene, chosen, progress)
    return ShaftOfClass(structure, rays_within(subject.scene), progress)


LESSONS = (
    Lesson(
        name="shafts",
        label="5D Shafts",
        slide="Contemporary methods",
        begin="Rays that begin near each other and go similar ways take the same first steps from "
        "the root; so each class of such rays keeps a short array of nodes at which it starts",
        look_for="Green boxes are where the rays of the orange shaft start, and all that it meets "
        "lies in them. Grey ones on the right are the nodes that the same ray enters from the root "
        "before it gets there",
        question="Why is a node not opened as soon as there is room for both its children?",
        answer="Both are tested by every ray then. Closed it costs one test, and a step and two "
        "more tests only if the ray meets it: opening pays if more than a third of the rays do",
        source="structures.shafts.cut",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="number",
        replays=("max_starts",),
    ),
)
