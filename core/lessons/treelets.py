"""Lessons "treelets" and "rotations": a few nodes get another tree over the same leaves.

Before and after, for those with the greatest gains. Grey: the leaves, which stay as they are. Blue:
the root, whose box stays, too. Red: inner nodes before. Green: inner nodes after. Beside the model
everything once more enlarged, and the tree itself; the height of a node there is its surface area.

A rotation is the smallest such move: a child and a grandchild change places, or two grandchildren.
Moves and gains are those of the build log, boxes those of its replay (:mod:`.moves`). T. Karras, T.
Aila: Fast Parallel Construction of High-Quality Bounding Volume Hierarchies, HPG 2013; A. Kensler:
Tree Rotations for Improving Bounding Volume Hierarchies, RT 2008.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.build_log import BuildLog
from ..geometry.box_shape import box_segments, surface_area
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers.replay import Replay
from .drawing import (
    BLUE,
    GREEN,
    GREY,
    RED,
    Chart,
    Colour,
    Lines,
    coloured,
    column,
    counted,
    extent_of,
    picture_of,
)
from .hierarchy import tree_and_log
from .lesson import Lesson, Play, Subject
from .magnifier import enlarged_beside
from .moves import around, moves_made, replayed, union, was_rearranged
from .picture import Picture, Row


@dataclass(frozen=True)
class Settings:
    """The knobs of both lessons."""

    move: int = setting(0, "Move", "Which move; 0 has gained most", minimum=0)
    after: bool = setting(False, "After", "Whether it has been made")


class Restructured(NamedTuple):
    """A treelet that was given another tree; leaves are numbered first, then inner nodes.

    Attributes
    ----------
    number : int
        Moves that were made before.
    gain : float
    leaves : (k, 6) float64
        Boxes.
    children : (2, k - 1, 2) int64
        Of each inner node, the root first, before and after.
    """

    number: int
    gain: float
    leaves: np.ndarray
    children: np.ndarray


def look_at_treelet(replay: Replay, number: int, progress: Progress) -> Restructured:
    """Return what becomes of a treelet."""
    tree, (first, behind) = replay.tree, replay.moves[number].tolist()
    inner, after = replay.node[first:behind].copy(), replay.children[first:behind].copy()
    before = np.stack([tree.left[inner], tree.right[inner]], axis=1)
    is_top = ~np.isin(inner, before)
    if is_top.sum() > 1:  # two grandchildren changed places: the node above stays as it is
        root = tree.parent[inner[0]]
        pair = np.array([[tree.left[root], tree.right[root]]])
        inner = np.concatenate([[root], inner])
        before, after = np.concatenate([pair, before]), np.concatenate([pair, after])
    elif not is_top[0]:  # parents come first
        order = np.argsort(~is_top, kind="stable")
        inner, before, after = inner[order], before[order], after[order]
    leaves = np.setdiff1d(before, inner)
    names = np.concatenate([leaves, inner])
    order = np.argsort(names)
    children = order[np.searchsorted(names[order], np.stack([before, after]))]
    return Restructured(number, float(replay.gains[number]), tree.boxes[leaves].copy(), children)


def boxes_of_treelet(leaves: np.ndarray, children: np.ndarray) -> np.ndarray:
    """Return the boxes of all nodes of a treelet, (2k - 1, 6), by their numbers.

    Parameters
    ----------
    leaves : (k, 6) float64
    children : (k - 1, 2) int64
        Of each inner node; parents come first.
    """
    boxes = np.concatenate([leaves, np.empty((len(children), 6))])
    for k in range(len(children) - 1, -1, -1):
        boxes[len(leaves) + k] = union(*boxes[children[k]])
    return boxes


class Treelets(Play):
    """The moves that gained most.

    Parameters
    ----------
    noun : str
        What such a move is called.
    """

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress, noun: str) -> None:
        self.bvh, self.noun, self.made = bvh, noun, moves_made(log)
        self.moves = replayed(bvh, log, look_at_treelet, progress)
        self.ends = {"move": len(self.moves) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return a move before or after it was made."""
        move, is_new = self.moves[settings.move], settings.after
        leaves, children = move.leaves, move.children[int(is_new)]
        scene, count, colour = self.bvh.scene, len(leaves), GREEN if is_new else RED
        boxes = boxes_of_treelet(leaves, children)
        inner = boxes[count + 1 :]
        parts = [coloured(box_segments(leaves), GREY), around(boxes[count], BLUE)]
        parts.append(coloured(box_segments(inner), colour))
        root = float(surface_area(self.bvh.arrays.volumes.boxes()[0])) or 1.0
        sums = [
            surface_area(boxes_of_treelet(leaves, each)[count + 1 :]).sum() / root
            for each in move.children
        ]
        caption = (
            f"{self.noun} {move.number + 1} of {self.made}, {'after' if is_new else 'before'}: "
            f"{count} leaves (grey), root (blue), {counted(count - 2, 'inner node', 'inner nodes')}"
            f" ({'green' if is_new else 'red'}) with {sums[int(is_new)]:.4g} times the area of the "
            f"scene's box. The cost {'fell' if is_new else 'will fall'} by {move.gain:.3g}; "
            "right: the tree, the height of a node is its area"
        )
        texts = [
            ("leaves", GREY),
            ("root", BLUE),
            (f"inner nodes {'after' if is_new else 'before'}", colour),
        ]
        rows = [
            Row("Moves", str(self.made), "That the optimiser made"),
            Row("Gain", f"{move.gain:.4g}", "By how much this one lowered the SAH cost"),
            Row(
                "Area Before", f"{sums[0]:.4g}", "Of the inner nodes below the root, in the scene's"
            ),
            Row("Area After", f"{sums[1]:.4g}", "The same, after the move"),
        ]
        copy = enlarged_beside(parts, boxes[count], scene)
        diagram = topology(scene, boxes, children, colour)
        marks = column(scene, texts)
        return picture_of([*parts, *copy, *diagram], caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the two greatest, before and after."""
        moves = range(min(2, len(self.moves)))
        return [Settings(move, is_after) for move in moves for is_after in (False, True)]


def topology(scene: Scene, boxes: np.ndarray, children: np.ndarray, colour: Colour) -> list[Lines]:
    """Return a treelet as a tree drawn beside the model; the height of a node is its area."""
    count = len(children) + 1
    areas = surface_area(boxes)
    heights = areas / (areas[count] or 1.0)
    # Leaves from left to right as the tree has them.
    order, todo = [], [count]
    while todo:
        number = todo.pop()
        if number < count:
            order.append(number)
        else:
            todo += children[number - count][::-1].tolist()
    x = np.empty(len(boxes))
    x[order] = np.arange(count) / (count - 1)
    for k in range(count - 2, -1, -1):
        x[count + k] = x[children[k]].mean()
    size = extent_of(scene)
    middle = 0.5 * (scene.lower + scene.upper)
    corner = np.array([scene.upper[0] + 1.1 * size, middle[1], middle[2] - 0.3 * size])
    across, upwards = np.array([0.6 * size, 0.0, 0.0]), np.array([0.0, 0.0, 0.6 * size])
    chart = Chart(corner, across, upwards, 0.0, 1.0, 1.0)
    links = []
    for k, pair in enumerate(children.tolist()):
        for child in pair:
            corners = chart.points(
                x[[count + k, child, child]], heights[[count + k, count + k, child]]
            )
            links += [corners[:2], corners[1:]]
    marks = [chart.mark(x[n], heights[n], GREY) for n in range(count)]
    return [chart.axes(), *marks, coloured(np.array(links), colour)]


TREELET = "treelet", "treelet_agglomerative"


def suits_treelets(structure: Any) -> str:
    """Accept trees whose treelets were restructured, see :attr:`.Lesson.suits`."""
    return was_rearranged(structure, TREELET)


def suits_rotations(structure: Any) -> str:
    """Accept trees that were rotated, see :attr:`.Lesson.suits`."""
    return was_rearranged(structure, ("rotate",))


def play_treelets(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Make the moves of the log again, up to the greatest."""
    return played(subject, progress, "Treelet")


def play_rotations(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Make the moves of the log again, up to the greatest."""
    return played(subject, progress, "Rotation")


def played(subject: Subject, progress: Progress, noun: str) -> Play:
    """Return the play of either lesson."""
    bvh, log = tree_and_log(subject, progress)
    return Treelets(bvh, log, progress, noun)


LESSONS = (
    Lesson(
        name="rotations",
        label="Tree Rotations",
        slide="Contemporary methods",
        begin="A child and a grandchild change places where that makes a node smaller",
        look_for="Only the boxes of the node's children change: nothing above it, so that the gain "
        "is known at once",
        question="Every rotation lowers the cost. Why does the best tree not come of it?",
        answer="It is hill climbing: it stops where no single exchange helps, although several "
        "together would. Treelets look at more nodes at once, reinsertion at the whole tree",
        source="structures.bvh.optimisers.rotate",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh,optimise=rotate",),
        suits=suits_rotations,
        Settings=Settings,
        play=play_rotations,
        film="move",
    ),
    Lesson(
        name="treelets",
        label="Treelet Restructuring",
        slide="Contemporary methods",
        begin="A few nodes are taken out of the tree and joined in a better way: the best there "
        "is, or a good one found faster, pair by pair",
        look_for="The leaves and the root keep their boxes; the nodes between become smaller "
        "together",
        question="Of the optimiser treelet: seven leaves can be joined in 10 395 ways. How is the "
        "best one found quickly?",
        answer="By dynamic programming: the best tree over a set of leaves is made of the best "
        "trees over two parts of it. There are only 127 sets of seven leaves, and each is solved "
        "once",
        source="structures.bvh.optimisers.treelet",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh,optimise=treelet",),
        suits=suits_treelets,
        Settings=Settings,
        play=play_treelets,
        film="move",
    ),
)
