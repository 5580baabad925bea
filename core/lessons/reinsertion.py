"""Lesson "reinsertion": a node is cut off and hung where it makes the tree cheapest.

The reinsertions with the greatest gains, before and after. Orange: the node. Red: its old parent.
Green: its new one. Grey: its old sibling, which takes the parent's place. Blue: its new sibling.
Everything is shown once more enlarged beside the model. Moves and gains are those of the build log,
boxes those of its replay (:mod:`.moves`). J. Bittner, M. Hapala, V. Havran: Fast Insertion-Based
Optimization of Bounding Volume Hierarchies, CGF 2013.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.build_log import BuildLog
from ..geometry.box_shape import box_segments
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers.replay import Replay
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Lines, coloured, column, faint, picture_of
from .hierarchy import tree_and_log
from .lesson import Lesson, Play, Subject
from .magnifier import enlarged_beside
from .moves import TEXT, around, moves_made, replayed, share_of, union, was_rearranged
from .picture import Picture, Row

OUTWARDS = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
"""Added to a box, moves all its sides outwards."""

OPTIMISERS = "reinsert", "reinsert_parallel", "reinsert_batches"


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    move: int = setting(0, "Move", "Which reinsertion; 0 has gained most", minimum=0)
    after: bool = setting(False, "After", "Whether the node has been moved")


class Reinsertion(NamedTuple):
    """A node that was cut off and hung elsewhere.

    Attributes
    ----------
    number : int
        Moves that were made before.
    gain : float
    node, old_parent, old_sibling : (6,) float64
        Boxes before it was cut off.
    new_sibling : (6,) float64
        The box while it was cut off: that of a node above it has shrunk.
    """

    number: int
    gain: float
    node: np.ndarray
    old_parent: np.ndarray
    old_sibling: np.ndarray
    new_sibling: np.ndarray


def look_at_reinsertion(replay: Replay, number: int, progress: Progress) -> Reinsertion:
    """Make a reinsertion, and return what it was."""
    tree, (first, behind) = replay.tree, replay.moves[number].tolist()
    node, (place, old_sibling) = replay.node[first], replay.children[first]
    own, above, beside = tree.boxes[[node, tree.parent[node], old_sibling]]
    replay.go_on(behind, progress, TEXT)
    gain, new_sibling = float(replay.gains[number]), tree.boxes[place].copy()
    return Reinsertion(number, gain, own, above, beside, new_sibling)


class Reinsertions(Play):
    """The reinsertions that gained most."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.bvh, self.made = bvh, moves_made(log)
        self.moves = replayed(bvh, log, look_at_reinsertion, progress)
        self.root = coloured(box_segments(bvh.arrays.volumes.boxes()[:1]), faint(GREY))
        self.ends = {"move": len(self.moves) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return a reinsertion before or after it was made."""
        move, is_after = self.moves[settings.move], settings.after
        new_parent = union(move.node, move.new_sibling)
        parent, colour = (new_parent, GREEN) if is_after else (move.old_parent, RED)
        whole = union(move.old_parent, new_parent)

        def parts(margin: float) -> list[Lines]:
            # Around the others by a margin, a parent is not hidden by them.
            return [
                around(parent + margin * OUTWARDS, colour), around(move.old_sibling, GREY),
                around(move.new_sibling, BLUE), around(move.node, ORANGE),
            ]  # fmt: skip

        size = float((whole[3:] - whole[:3]).max())
        copy = enlarged_beside(parts(0.02 * size), whole, self.bvh.scene)
        verb, share = "fell" if is_after else "will fall", share_of(self.bvh, parent)
        caption = (
            f"Reinsertion {move.number + 1} of {self.made}, {'after' if is_after else 'before'}: "
            f"the node (orange) and its {'new' if is_after else 'old'} parent "
            f"({'green' if is_after else 'red'}), {100.0 * share:.3g}% of the root's area; its old "
            f"sibling (grey) and its new one (blue). The cost {verb} by {move.gain:.3g}"
        )
        texts = [
            ("node", ORANGE), ("new sibling", BLUE), ("old sibling", GREY),
            (f"{'new' if is_after else 'old'} parent, {100.0 * share:.3g}% of the root", colour),
        ]  # fmt: skip
        rows = [
            Row("Moves", str(self.made), "Reinsertions that the optimiser made"),
            Row("Gain", f"{move.gain:.4g}", "By how much this one lowered the SAH cost"),
            Row("Old Parent", f"{100.0 * share_of(self.bvh, move.old_parent):.3g}%",
                "Its area, of the root's"),
            Row("New Parent", f"{100.0 * share_of(self.bvh, new_parent):.3g}%",
                "Its area, of the root's"),
        ]  # fmt: skip
        marks = column(self.bvh.scene, texts)
        return picture_of([self.root, *parts(0.0), *copy], caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the two greatest, before and after."""
        moves = range(min(2, len(self.moves)))
        return [Settings(move, is_after) for move in moves for is_after in (False, True)]


def suits(structure: Any) -> str:
    """Accept trees with reinsertions, see :attr:`.Lesson.suits`."""
    return was_rearranged(structure, OPTIMISERS)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Make the moves of the log again, up to the greatest."""
    bvh, log = tree_and_log(subject, progress)
    return Reinsertions(bvh, log, progress)


LESSONS = (
    Lesson(
        name="reinsertion",
        label="Reinsertion",
        slide="Contemporary methods",
        begin="A node that sits in the wrong place is cut off and hung beside a better sibling",
        look_for="The old parent is large because it encloses two nodes that have nothing to do "
        "with each other; beside its new sibling the node needs far less surface",
        question="The new parent alone would be smallest right beside the nearest leaf. Why is the "
        "node often hung higher up?",
        answer="Every node from there up to the root must enclose it, too, and grows if it does "
        "not already. The search adds up that growth on the way and takes the place where the "
        "whole sum is least",
        source="structures.bvh.optimisers.reinsert",
        sample="suzanne:subdivisions=1",
        structures=("bvh:builder=lbvh,optimise=reinsert",),
        suits=suits,
        Settings=Settings,
        play=play,
        film="move",
    ),
)
