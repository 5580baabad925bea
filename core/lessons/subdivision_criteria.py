"""Lesson "subdivision criteria": M objects, K levels, and a budget spent in three orders.

As on the slide "Adaptive subdivision criteria": a cell with more than M objects above level K is a
candidate, and waits. Where a budget of cells ends the building, the order decides what it was spent
on: from a FIFO queue breadth-first, as on the slide, by priority (surface times objects), or
depth-first (:mod:`..structures.subdivision.frontier`). The same kd-tree is built in each order.

Beside the model stands what a plane across y sees of each after so many cuts: orange are cells that
wait, red the two that were made last.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.build_log import SPLIT
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.kdtree import KdTree
from .drawing import GREY, ORANGE, RED, Faces, Lines, counted, picture_of
from .lesson import Lesson, Play, Subject, build
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    Plane,
    Section,
    contour,
    left_out_text,
    model_with,
    outline_beside,
    place_beside,
    section_of,
    title_place,
)

ORDERS = {"fifo": "Breadth-First", "priority": "By Priority", "depth_first": "Depth-First"}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    step: int = setting(1_000_000, "Cuts", "How many cells have been cut", minimum=0)
    max_leaf_size: int = setting(
        8, "M, Objects", "A cell with at most so many objects is not cut", minimum=1, maximum=64
    )
    max_depth: int = setting(
        16, "K, Levels", "Level at which subdivision ends", minimum=1, maximum=25
    )
    budget: int = setting(
        400, "Budget of Cells", "Cells, inner ones included, at which building ends",
        minimum=3, maximum=5000,
    )  # fmt: skip


class Built:
    """A tree, and when its cells were made."""

    def __init__(self, tree: KdTree, settings: Settings, progress: Progress) -> None:
        self.tree, self.cells = tree, tree.cells(progress).own()
        log = tree.build_log
        assert log is not None
        assert self.cells.replaced is not None
        self.made, self.replaced, self.cuts = (
            self.cells.extra["order"],
            self.cells.replaced,
            len(log),
        )
        # References of every cell, inner ones included: the log has those of what a cut makes.
        by_number = np.full(len(self.cells), len(tree.scene), np.int64)
        splits = log.kind == SPLIT
        for side in range(2):
            by_number[log.cells[log.children[splits, side]]] = log.counts[splits, side]
        self.count = by_number[self.cells.numbers]
        figures = tree.statistics(progress)
        self.sah, self.tests = figures.sah, figures.expected_tests
        self.is_candidate = (self.count > settings.max_leaf_size) & (
            self.cells.depth < settings.max_depth
        )

    def there(self, step: int) -> np.ndarray:
        """Return which cells are the leaves after so many cuts, (n,) bool."""
        return (self.made <= step) & (step < self.replaced)


class SubdivisionCriteria(Play):
    """The same budget in three orders."""

    def __init__(self, scene: Scene, trees: dict[str, Built]) -> None:
        self.scene, self.trees = scene, trees
        self.ends = {"step": max(each.cuts for each in trees.values())}
        # Where the depth-first tree has spent its cells, or none of them might be seen.
        cells = trees["depth_first"].cells
        boxes = cells.boxes[cells.is_leaf]
        middle = float(np.median(0.5 * (boxes[:, 1] + boxes[:, 4])))
        self.plane = Plane(np.array([0.0, middle, 0.0]), np.array([0.0, 1.0, 0.0]))
        self.contour = contour(scene, self.plane, len(trees))

    def picture(self, settings: Settings) -> Picture:
        """Return the three trees after so many cuts."""
        parts: list[Lines | Faces] = list(model_with(self.scene, self.plane))
        marks, rows, told, sections = [], [], [], list[Section]()
        for number, (name, each) in enumerate(self.trees.items()):
            step, cells = min(settings.step, each.cuts), each.cells
            there = each.there(step)
            waiting = there & each.is_candidate
            shift = place_beside(self.scene, number)
            section = section_of(cells, np.flatnonzero(there), self.plane, len(ORDERS))
            sections.append(section)
            section = section.moved(shift)
            colours = np.tile((*GREY[:3], FAINT), (len(cells), 1))
            newest = there & (each.made == step) & (step > 0)
            colours[newest] = RED
            fills = np.tile((*ORANGE[:3], 0.35), (len(cells), 1))
            parts += [section.of(np.flatnonzero(waiting)).faces(fills), section.lines(colours)]
            parts.append(section.of(np.flatnonzero(newest)).raised(self.scene).lines(colours))
            parts.append(outline_beside(self.contour, shift))
            marks.append(Mark(title_place(self.scene, self.plane, shift), ORDERS[name]))
            depth = int(cells.depth[there].max())
            largest = int(each.count[there].max())
            rows.append(
                Row(f"{ORDERS[name]}: Now",
                    f"{int(there.sum())} leaves, {int(waiting.sum())} wait, deepest level {depth}, "
                    f"up to {largest} objects",
                    "Leaves after these cuts; those that wait have more than M objects")
            )  # fmt: skip
            rows.append(
                Row(f"{ORDERS[name]}: at the End",
                    f"SAH cost {each.sah:.1f}, {each.tests:.1f} tests",
                    "Of the finished tree, and what an endless random line is tested against")
            )  # fmt: skip
            told.append(f"{ORDERS[name]} {int(waiting.sum())}")
        caption = (
            f"After {counted(min(settings.step, self.ends['step']), 'cut', 'cuts')} within a "
            f"budget of {counted(settings.budget, 'cell', 'cells')}, M = {settings.max_leaf_size}, "
            f"K = {settings.max_depth}; cells that wait: {', '.join(told)}"
        )
        return picture_of(parts, caption + left_out_text(sections), marks=marks, rows=rows)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build the tree in three orders."""
    trees = {}
    for number, order in enumerate(ORDERS):
        progress.report(number, len(ORDERS), f"Building {ORDERS[order]}")
        spec = (
            f"kdtree:planes=longest,order={order},budget={settings.budget},"
            f"max_leaf_size={settings.max_leaf_size},max_depth={settings.max_depth}"
        )
        tree = build(subject.scene, spec, progress)
        assert isinstance(tree, KdTree)
        trees[order] = Built(tree, settings, progress)
    return SubdivisionCriteria(subject.scene, trees)


LESSONS = (
    Lesson(
        name="subdivision_criteria",
        label="When to Stop: M, K, or a Budget",
        slide="Adaptive subdivision criteria",
        begin="A cell is cut while it has more than M objects and lies above level K; or until "
        "the reserved memory is full",
        look_for="Breadth-first, the budget refines the whole object evenly; depth-first, it all "
        "goes into one corner and the rest stays coarse",
        question="Why is breadth-first the right order if memory may run out, and irrelevant if "
        "it does not?",
        answer="Whether a cell is cut depends on M and K alone, so without a limit every order "
        "ends with the same tree; with one, a FIFO queue has spent it evenly at any moment",
        source="structures.subdivision.frontier",
        sample="suzanne:subdivisions=1",
        Settings=Settings,
        play=play,
        film="step",
        replays=("max_leaf_size", "max_depth", "budget"),
    ),
)
