"""Lesson "axis_choice": axes in turn against the best axis, two trees side by side.

The left tree cuts across x, y and z in turn ("round-robin"), the right one across whichever axis
has the cheapest plane. Both are built over the same triangles by the same builder, and drawn level
by level with the planes of their build logs.

Blue and orange: nodes of the level that are left and right children. Red: the planes that divide
them. Grey: the object, and leaves above. Lecture, slide "Top-down SAH construction": plane
orientation is deterministic ("round-robin") or optimised as well.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.build_log import SPLIT
from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Faces,
    Lines,
    coloured,
    counted,
    extent_of,
    faint,
    outlines,
    picture_of,
    quads,
    shifted,
    some_of,
)
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row
from .splits import was_split_by_cost

MOST_LEVELS = 6
"""Levels that are shown: the last has up to 32 nodes."""

MOST_ITEMS = 700
"""Items whose outlines stand for the object in the second copy."""

FEW = 4
"""Planes of a level up to which each has the name of its axis."""

GAP = 1.45
"""Distance of the copies, in sizes of the scene along x."""

NAMES = {"round_robin": "Round-robin", "best": "Best axis"}


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(1, "Level", "Level of both trees; the root has 0", minimum=0)


class LevelsOfTree:
    """The upper levels of one tree, with the planes that divide their nodes."""

    def __init__(self, bvh: BVH, progress: Progress) -> None:
        progress.report(0, 2, "Reading the splits")
        log = bvh.build_log
        assert log is not None
        n_nodes = len(bvh.arrays.size)
        self.depths, self.is_leaf = bvh.depths(), bvh.arrays.size > 0
        self.boxes = bvh.arrays.volumes.boxes()
        self.is_right = np.zeros(n_nodes, bool)
        self.axis, self.position = np.full(n_nodes, -1), np.zeros(n_nodes)
        events = np.flatnonzero(log.kind == SPLIT)
        nodes = log.cells[log.node[events]]
        self.axis[nodes], self.position[nodes] = log.axis[events], log.position[events]
        self.is_right[log.cells[log.children[events, 1]]] = True
        progress.report(1, 2, "Reckoning the cost")
        self.cost = bvh.statistics(progress).sah
        self.name = NAMES[bvh.settings.axis]

    def parts(self, level: int) -> tuple[list[Lines | Faces], np.ndarray]:
        """Return a level's nodes and planes, and the nodes that are divided."""
        on_level = self.depths == level
        above = np.flatnonzero(self.is_leaf & (self.depths < level))
        parts: list[Lines | Faces] = [coloured(box_segments(self.boxes[above]), faint(GREY))]
        for side, colour in ((on_level & ~self.is_right, BLUE), (on_level & self.is_right, ORANGE)):
            parts.append(coloured(box_segments(self.boxes[side]), colour))
        divided = np.flatnonzero(on_level & (self.axis >= 0))
        for axis in range(3):
            here = divided[self.axis[divided] == axis]
            cuts = planes_across(self.boxes[here], axis, self.position[here])
            parts += [coloured(outlines(cuts), RED), quads(cuts, RED, 0.3)]
        return parts, divided


class AxisChoice(Play):
    """Two trees over the same triangles."""

    def __init__(self, trees: tuple[BVH, BVH], progress: Progress) -> None:
        self.scene = trees[0].scene
        self.trees = [LevelsOfTree(bvh, progress) for bvh in trees]
        deepest = max(int(tree.depths.max()) for tree in self.trees)
        self.ends = {"level": min(deepest, MOST_LEVELS - 1)}
        items = some_of(np.arange(len(self.scene)), MOST_ITEMS)
        self.lines = lines_of_items(self.scene.geometry, items)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a level of both."""
        level, size = settings.level, extent_of(self.scene)
        low, high = self.scene.lower, self.scene.upper
        step = np.array([GAP * max(high[0] - low[0], 0.4 * size), 0.0, 0.0])
        parts: list[Lines | Faces] = [coloured(self.lines + step, faint(GREY, 0.25))]
        marks, texts, rows = [], [], []
        for place, tree in enumerate(self.trees):
            found, divided = tree.parts(level)
            parts += [shifted(part, place * step) for part in found]
            title = np.array([low[0], low[1], high[2] + 0.12 * size]) + place * step
            marks.append(Mark(title, f"{tree.name}: SAH {tree.cost:.2f}"))
            if len(divided) <= FEW:
                marks += [self._axis_of(tree, node, place * step) for node in divided.tolist()]
            counts = np.bincount(tree.axis[divided], minlength=3).tolist()
            across = ", ".join(
                f"{count} across {axis}" for axis, count in zip("xyz", counts, strict=True) if count
            )
            texts.append(f"{tree.name} {across or 'no plane'}")
            meaning = "Cost of the whole tree by the surface area heuristic"
            rows.append(Row(f"SAH, {tree.name}", f"{tree.cost:.3f}", meaning))
        ratio = self.trees[0].cost / self.trees[1].cost if self.trees[1].cost > 0.0 else 1.0
        rows.append(Row("Ratio", f"{ratio:.3f}", "What the first costs over what the second does"))
        n_nodes = [int((tree.depths == level).sum()) for tree in self.trees]
        caption = (
            f"Level {level}: {counted(n_nodes[0], 'node', 'nodes')} and {n_nodes[1]}; "
            f"{'; '.join(texts)}; the trees cost {self.trees[0].cost:.2f} and "
            f"{self.trees[1].cost:.2f}"
        )
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first levels."""
        return [Settings(level) for level in range(min(4, self.ends["level"] + 1))]

    def _axis_of(self, tree: LevelsOfTree, node: int, shift: np.ndarray) -> Mark:
        """Return the name of the axis that a plane lies across, at its upper corner."""
        axis, box = int(tree.axis[node]), tree.boxes[node]
        place = box[3:].copy()
        place[axis] = tree.position[node]
        return Mark(place + shift, "xyz"[axis], RED[:3])


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the planes of both trees."""
    first, second = subject.structures
    assert isinstance(first, BVH)
    assert isinstance(second, BVH)
    return AxisChoice((first, second), progress)


LESSONS = (
    Lesson(
        name="axis_choice",
        label="Round-Robin or the Best Axis",
        slide="Top-down SAH construction",
        begin="A builder may cut across x, y and z in turn, or look at all three axes at each node",
        look_for="The same triangles with the same builder: where the turn is wrong for a node, "
        "its children are long or overlap, and the tree costs more",
        question="Round-robin looks at a third of the candidates. When does it lose little?",
        answer="Where nodes are about as long along every axis and their triangles spread evenly. "
        "The longest side then changes after each cut anyway, so that the turn is often right",
        source="structures.bvh.builders.top_down.recursion",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=sweep_sah,axis=round_robin", "bvh:builder=sweep_sah,axis=best"),
        suits=was_split_by_cost,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
