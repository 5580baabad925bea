"""Lesson "rearranging": how the cost of a finished tree falls while it is rearranged.

Three optimisers begin with the same tree: reinsertion, treelets, rotations. To the right of the
model stands the cost of each after every step; the axis begins at 0. In the model are the nodes
that the chosen one has moved in the step that is shown, those with the greatest gains.

Blue, orange, green: the three optimisers, in the chart. Red: the step that is shown, and the nodes
that were moved in it. Grey: the cost as built. Costs are those the optimisers noted, moves those of
the build log, boxes those of its replay (:mod:`.moves`). Lecture, slide "Contemporary methods":
rearranging the BVH.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.build_log import FIT, MOVE, REINSERT, BuildLog
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers import OPTIMISERS
from ..structures.bvh.optimisers.replay import Replay
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    Chart,
    coloured,
    column,
    counted,
    faint,
    picture_of,
)
from .lesson import Lesson, Play, Subject
from .moves import TEXT, moves_made, was_rearranged
from .picture import Picture, Row

MOST_NODES = 60
"""Moved nodes of a step that are drawn."""

COLOURS = BLUE, ORANGE, GREEN

WHICH = {
    "reinsertion": "Of the first tree: reinsertion",
    "treelets": "Of the second tree: treelets",
    "rotations": "Of the third tree: rotations",
}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    step: int = setting(1, "Step", "Steps that are done; 0 has the tree as built", minimum=0)
    moves_of: str = setting(
        "reinsertion", "Moves of", "Whose moves are shown in the model", choices=WHICH
    )


class Course:
    """What one optimiser did.

    Attributes
    ----------
    name : str
    costs : (k + 1,) float64
        Before the first step and after each.
    moves : (k + 1,) int64
        Made in every step.
    boxes : list of (m, 6) float64
        Of nodes that were moved in every step, after it.
    is_kept : bool
        Whether the rearranged tree was kept.
    """

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        done = bvh.rearrangement
        assert done is not None
        self.name, self.costs = bvh.settings.optimise, np.array(done.costs)
        self.is_kept = bool(bvh.figures["optimise_pays"])
        n_steps = len(self.costs) - 1
        self.moves = np.zeros(n_steps + 1, np.int64)
        self.boxes = [np.empty((0, 6)) for _ in range(n_steps + 1)]
        progress.report(0, 1, TEXT)
        if not moves_made(log):
            return
        replay = Replay(log, bvh.reference_boxes())
        progress.report(0, 1, TEXT)
        steps = steps_of_moves(log, replay)
        self.moves += np.bincount(steps, minlength=n_steps + 1)
        for step in range(1, n_steps + 1):
            these = np.flatnonzero(steps == step)
            if len(these):
                replay.go_on(int(replay.moves[these[-1], 1]), progress, TEXT)
                greatest = these[np.argsort(-replay.gains[these], kind="stable")[:MOST_NODES]]
                nodes = replay.node[replay.moves[greatest, 0]]
                self.boxes[step] = replay.tree.boxes[nodes].copy()


def steps_of_moves(log: BuildLog, replay: Replay) -> np.ndarray:
    """Return the step of the optimiser in which every move was made, (j,); the first is 1."""
    of_builder = ~np.isin(log.kind, (MOVE, REINSERT, FIT))
    built = int(log.step[of_builder].max(initial=0))
    events = np.flatnonzero(np.isin(log.kind, (MOVE, REINSERT)))
    return log.step[events[replay.moves[:, 0]]] - built


class Rearranging(Play):
    """The costs of several optimisers, step by step."""

    def __init__(self, scene: Scene, courses: list[Course]) -> None:
        self.scene, self.courses = scene, courses
        self.ends = {"step": max(len(course.costs) for course in courses) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the costs up to a step, and what was moved in it."""
        chosen = self.courses[list(WHICH).index(settings.moves_of) % len(self.courses)]
        last, step = self.ends["step"], settings.step
        # One that has ended stays as it is.
        own = min(step, len(chosen.costs) - 1)
        built, now = float(chosen.costs[0]), float(chosen.costs[own])
        top = 1.1 * max(float(course.costs.max()) for course in self.courses)
        chart = Chart.beside(self.scene, 0.0, float(last), top)
        parts = [chart.axes(), chart.level(built, GREY)]
        texts = []
        for course, colour in zip(self.courses, COLOURS, strict=False):
            steps = np.arange(len(course.costs))
            parts.append(chart.curve(steps, course.costs, faint(colour, 0.35)))
            done = min(step, len(course.costs) - 1) + 1
            parts.append(chart.curve(steps[:done], course.costs[:done], colour))
            text = f"{course.name} {course.costs[done - 1]:.2f}"
            texts.append((text, colour))
        marks = [*column(self.scene, texts), *chart.named("steps", "SAH cost")]
        parts.append(chart.mark(own, now, RED))
        boxes = chosen.boxes[step] if step < len(chosen.boxes) else np.empty((0, 6))
        parts.append(coloured(box_segments(boxes), RED))
        fallen = 1.0 - now / built if built > 0.0 else 0.0
        moves = int(chosen.moves[step]) if step < len(chosen.moves) else 0
        caption = (
            f"{chosen.name}, step {own} of {len(chosen.costs) - 1}: SAH cost {now:.2f}, "
            f"{100.0 * fallen:.1f}% less than the {built:.2f} as built (grey); "
            f"{counted(moves, 'move', 'moves')} in this step; one triangle a leaf"
        )
        if not chosen.is_kept:
            caption += "; with its leaves the tree as built costs less, and was kept"
        rows = [Row("As Built", f"{built:.3f}", "SAH cost before the first step")]
        for course in self.courses:
            text = f"{course.costs[-1]:.3f}, {len(course.costs) - 1} steps"
            meaning = "SAH cost in the end, with one triangle a leaf"
            rows.append(Row(OPTIMISERS[course.name].summary, text, meaning))
        return picture_of(parts, caption, marks=marks, rows=rows)


def suits(structure: Any) -> str:
    """Accept trees that were rearranged, see :attr:`.Lesson.suits`."""
    return was_rearranged(structure, [name for name in OPTIMISERS if name != "none"])


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the costs, and make the moves again."""
    courses: list[Course] = []
    for bvh in subject.structures:
        assert isinstance(bvh, BVH)
        progress.report(len(courses), len(subject.structures), "Reading the log")
        assert bvh.build_log is not None
        courses.append(Course(bvh, bvh.build_log, progress))
    return Rearranging(subject.scene, courses)


LESSONS = (
    Lesson(
        name="rearranging",
        label="Rearranging the Tree",
        slide="Contemporary methods",
        begin="A tree that was built quickly is rearranged, and its cost falls move by move",
        look_for="Most is gained in the first steps; rotations stop first, reinsertion, which may "
        "move a node anywhere, goes deepest",
        question="When is it worth to rearrange a tree, and when is it not?",
        answer="When it is traced by so many rays that what each saves adds up to more than the "
        "time for rearranging. For a scene that moves, and whose tree lives for one frame, a quick "
        "build is often better",
        source="structures.bvh.optimisers.rearranging",
        sample="suzanne:subdivisions=0",
        structures=(
            "bvh:builder=lbvh,optimise=reinsert",
            "bvh:builder=lbvh,optimise=treelet",
            "bvh:builder=lbvh,optimise=rotate",
        ),
        suits=suits,
        Settings=Settings,
        play=play,
        film="step",
    ),
)
