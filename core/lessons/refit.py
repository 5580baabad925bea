"""Lesson "refit": the tree of the first frame follows the moving triangles, beside a new one.

Beside the mesh stands the tree of the first frame, refitted to the frame that is shown: who is
below which node stays, boxes grow with what is in them (orange); to its right a tree built anew for
that frame (blue). Both are drawn level by level; below stands what both cost over the frames.

The animation is one of Blender's timeline or of several files, if the lesson is given one;
otherwise the mesh is deformed here, frame by frame. Boxes and costs are those of real trees.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.protocols import Refittable
from ..contract.structure import Structure
from ..geometry.box_shape import box_segments
from ..geometry.instances import lines_of_items
from ..geometry.triangles import Triangles
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import setting
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Chart,
    Faces,
    Lines,
    coloured,
    faint,
    picture_of,
    some_of,
)
from .lesson import Lesson, Play, Subject
from .moment import Moment, Upper
from .picture import Mark, Picture, Row

LEVELS = 5
"""Levels that are kept of every frame."""

FRAMES = 9
"""Frames of a deformation that is made here."""

MOST_ITEMS = 600
"""Items whose outlines stand for the object in every frame."""

GAP = 1.25
"""Distance of the copies, in widths of all that the animation reaches."""

DEFORMATIONS = {
    "twist": "Twisted about z, by three quarters of a turn",
    "wave": "Bent along x into a wave",
    "scatter": "Every triangle flies its own way",
}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    frame: int = setting(FRAMES - 1, "Frame", "Which frame; the first is 0", minimum=0)
    level: int = setting(2, "Level", "Level of both trees that is drawn", minimum=0)
    deformation: str = setting(
        "twist",
        "Deformation",
        "How the mesh is deformed, where it is given no animation",
        choices=DEFORMATIONS,
    )


def moment_of(frame: int, refitted: Any, rebuilt: Any, refit: float, rebuild: float) -> Moment:
    """Return what is kept of one frame.

    Parameters
    ----------
    refitted, rebuilt : Refittable structures
        Over the scene of this frame.
    """
    scene = refitted.scene
    items = some_of(np.arange(len(scene)), MOST_ITEMS)
    lines = lines_of_items(scene.geometry, items)
    both = Upper(*refitted.upper_boxes(LEVELS)), Upper(*rebuilt.upper_boxes(LEVELS))
    return Moment(frame, refit, rebuild, *both, lines)


def history_of(
    frames: Iterable[tuple[int, Scene]], original: Structure, progress: Progress = SILENT
) -> list[Moment]:
    """Return the history of an animation: refit and rebuild a structure in every frame.

    Parameters
    ----------
    frames : iterable of (int, Scene)
    original : Structure
        Over the first of them; a Refittable one.

    Raises
    ------
    InputError
        If a frame has other triangles than the first, or the tree cannot follow them.
    Cancelled
        From `progress`.
    """
    assert isinstance(original, Refittable)
    history = []
    for number, scene in frames:
        refitted = original.refitted(scene, progress)
        rebuilt = type(original).build(scene, original.settings, progress)
        progress.report(0, 3, "Comparing both trees")
        costs = [refitted.statistics(progress).sah]
        progress.report(1, 3, "Comparing both trees")
        costs.append(rebuilt.statistics(progress).sah)
        progress.report(2, 3, "Comparing both trees")
        history.append(moment_of(number, refitted, rebuilt, *costs))
    return history


def deformed(scene: Scene, deformation: str, share: float) -> Scene:
    """Return a scene of triangles deformed, the more the larger `share` is; 0 leaves it alone.

    Raises
    ------
    InputError
        For a scene with other items.
    """
    if not isinstance(scene.geometry, Triangles):
        scene.refuse_other_items("meshes are deformed")
    if share == 0.0:
        return scene
    low, size = scene.lower, np.maximum(scene.upper - scene.lower, 1e-300)
    corners = scene.triangles - 0.5 * (scene.lower + scene.upper)
    height = (scene.triangles[..., 2] - low[2]) / size[2]
    if deformation == "twist":
        angle = 1.5 * np.pi * share * height
        x = np.cos(angle) * corners[..., 0] - np.sin(angle) * corners[..., 1]
        y = np.sin(angle) * corners[..., 0] + np.cos(angle) * corners[..., 1]
        moved = np.stack([x, y, corners[..., 2]], axis=-1)
    elif deformation == "wave":
        moved = corners.copy()
        moved[..., 2] += (
            0.4
            * share
            * size.max()
            * np.sin(2.0 * np.pi * (scene.triangles[..., 0] - low[0]) / size[0])
        )
    else:
        ways = np.random.default_rng(1).normal(size=(len(corners), 1, 3))
        moved = corners + 0.15 * share * size.max() * ways
    moved += 0.5 * (scene.lower + scene.upper)
    changed = Scene.from_triangles(moved, scene.name, scene.source)
    if len(changed) != len(scene):
        return changed  # some went beyond all numbers: a refit refuses that
    return dataclasses.replace(changed, primitive_ids=scene.primitive_ids)


class Refit(Play):
    """An animation, refitted and built anew in every frame."""

    def __init__(self, history: Sequence[Moment]) -> None:
        self.history = history
        self.numbers = np.array([moment.frame for moment in history], dtype=np.float64)
        self.refit = np.array([moment.refit for moment in history])
        self.rebuild = np.array([moment.rebuild for moment in history])
        # Nothing jumps: everything stands beside and below whatever the animation reaches.
        roots = np.array([moment.refitted.boxes[0] for moment in history])
        self.low, self.high = roots[:, :3].min(axis=0), roots[:, 3:].max(axis=0)
        deepest = max(int(tree.depths.max()) for moment in history for tree in moment[3:5])
        self.ends = {"frame": len(history) - 1, "level": deepest}

    def picture(self, settings: Settings) -> Picture:
        """Return both trees in a frame, and the costs of all."""
        moment, level = self.history[settings.frame], settings.level
        size = float((self.high - self.low).max()) or 1.0
        step = np.array([GAP * max(float(self.high[0] - self.low[0]), 0.4 * size), 0.0, 0.0])
        title = np.array([self.low[0], self.low[1], self.high[2] + 0.12 * size])
        parts: list[Lines | Faces] = []
        marks = []
        # Beside the mesh itself, which need not be the one of this frame.
        for place, (tree, name, cost, colour) in enumerate(
            (
                (moment.refitted, "refitted", moment.refit, ORANGE),
                (moment.rebuilt, "built anew", moment.rebuild, BLUE),
            ),
            1,
        ):
            parts.append(coloured(moment.lines + place * step, faint(GREY, 0.3)))
            boxes = box_segments(tree.boxes[tree.depths == level])
            parts.append(coloured(boxes + place * step, colour))
            marks.append(Mark(title + place * step, f"{name}: SAH {cost:.2f}", colour[:3]))
        chart = Chart(
            self.low + step - np.array([0.0, 0.0, 0.55 * size]),
            step + np.array([0.5 * size, 0.0, 0.0]),
            np.array([0.0, 0.0, 0.4 * size]),
            self.numbers[0],
            self.numbers[-1],
            1.1 * float(max(self.refit.max(), self.rebuild.max(), 1e-300)),
        )
        parts += [
            chart.axes(),
            chart.curve(self.numbers, self.rebuild, BLUE),
            chart.curve(self.numbers, self.refit, ORANGE),
            chart.mark(moment.frame, moment.refit, RED),
        ]
        marks += [Mark(chart.at(0.45, -0.25), "frames"), Mark(chart.at(0.0, 1.1), "SAH cost")]
        more = 100.0 * (moment.refit / moment.rebuild - 1.0) if moment.rebuild > 0.0 else 0.0
        caption = (
            f"Frame {moment.frame}: SAH {moment.refit:.2f} refitted, {moment.rebuild:.2f} built "
            f"anew: {more:+.1f}%; drawn: level {level} of both trees"
        )
        rows = [
            Row("Frame", str(moment.frame), "Of the animation"),
            Row("SAH, Refitted", f"{moment.refit:.3f}", "Of the first frame's tree"),
            Row("SAH, Built Anew", f"{moment.rebuild:.3f}", "Of a tree built for this frame"),
            Row("Growth", f"{more:+.1f}%", "What the refitted tree costs more"),
        ]
        return picture_of(parts, caption, marks=marks, rows=rows)


def can_follow(structure: Any) -> str:
    """Accept structures that can be refitted, see :attr:`.Lesson.suits`."""
    if not isinstance(structure, Refittable):
        return f"a {structure.label} cannot follow what moves; it is always built anew"
    return ""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Refit and rebuild frame by frame, unless the animation was compared already."""
    if subject.history:
        return Refit(subject.history)
    scene = subject.scene
    shares = np.linspace(0.0, 1.0, FRAMES)

    def frames() -> Iterator[tuple[int, Scene]]:
        for number, share in enumerate(shares.tolist()):
            progress.report(number, FRAMES, "Deforming the scene")
            yield number, deformed(scene, settings.deformation, share)

    return Refit(history_of(frames(), subject.structures[0], progress))


LESSONS = (
    Lesson(
        name="refit",
        label="Refit over the Timeline",
        slide="Contemporary methods",
        begin="When triangles move, a tree can keep its nodes and only fit their boxes again",
        look_for="In the first frame both trees are the same; then boxes of the refitted one grow "
        "and overlap, since what was together once is not any more, and its cost grows",
        question="Which motion harms a refitted tree most, and which not at all?",
        answer="Moving the whole does none, nor does scaling it alike along all axes: all boxes go "
        "with it. Most is done when neighbours part, as in an explosion, since a node then has to "
        "enclose triangles that are far from each other",
        source="structures.bvh.topology.refit",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        suits=can_follow,
        Settings=Settings,
        play=play,
        film="frame",
        replays=("deformation",),
        takes_frames=True,
    ),
)
