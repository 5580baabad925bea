"""Lesson "neighbour links": the six links of a leaf, and the one that a ray takes.

The slide's "additional support data": a pointer to the neighbour behind each face of a leaf
(:mod:`..structures.subdivision.ropes`). A link leads to the smallest node that covers the whole
face: a leaf as large or larger (blue), or an inner node where the other side is divided more finely
(yellow, with its leaves at the face). The leaf is orange; red is the link that the ray takes, as
the log of the walk has it.

Beside the model the leaf stands enlarged, its neighbours pulled away from its faces. Of large
neighbours, dashed, only what is near the face is drawn.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.outlines import dashes_of
from ..geometry.box_shape import EDGES, SIDES, box_segments, corners_of
from ..geometry.marks import arrows
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.subdivision.structure import LinkedSubdivision
from .adaptive_traversal import ENOUGH, ENTERING, has_linked_leaves
from .column import YELLOW
from .drawing import BLUE, ORANGE, RED, Colour, Faces, Lines, coloured, counted, picture_of, quads
from .lesson import Lesson, Play, Subject
from .magnifier import Magnifier
from .one_ray import RAY, Walked, near, ray_of
from .picture import Mark, Picture, Row
from .section import place_beside

FACES = "-x", "-y", "-z", "+x", "+y", "+z"


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    which: str = setting(
        "ray",
        "Leaf",
        "Whose links are shown",
        choices={"ray": "A leaf that the ray enters", "any": "Any leaf, by its number"},
    )
    entered: int = setting(
        2, "Leaf of the Ray", "Which of the leaves that it enters; the first is 0", minimum=0,
        only_for={"which": ("ray",)},
    )  # fmt: skip
    number: int = setting(
        0, "Number", "Which of all leaves, in the order of the tree", minimum=0,
        only_for={"which": ("any",)},
    )  # fmt: skip


AWAY, REACH, ASIDE = 0.8, 1.5, 0.4
"""How far neighbours are pulled away, how much of them is drawn, and how much beside the face; in
sizes of the leaf."""

MOST_BELOW = 200
"""Leaves of an inner node that are drawn."""


class Lens:
    """What enlarges the surroundings of a leaf, beside the model.

    Parameters
    ----------
    box : (6,) float64
        The leaf's cell.
    """

    def __init__(self, scene: Scene, box: np.ndarray) -> None:
        self.box, self.size = box, box[3:] - box[:3]
        self.middle = 0.5 * (box[:3] + box[3:])
        whole = float((scene.upper - scene.lower).max())
        scale = whole / ((1.0 + 2.0 * (AWAY + REACH)) * float(self.size.max()))
        place = 0.5 * (scene.lower + scene.upper) + place_beside(scene, 0)
        self.glass = Magnifier(self.middle, place, scale)

    def enlarged(self, points: np.ndarray, face: int | None = None) -> np.ndarray:
        """Return where points (..., 3) are drawn; what is behind a face is pulled away."""
        away = np.zeros(3)
        if face is not None:
            away[face % 3] = (AWAY if face > 2 else -AWAY) * self.size[face % 3]
        return self.glass.at(points + away)

    def near(self, face: int, box: np.ndarray) -> np.ndarray:
        """Return the part of a box (6,) that is near a face."""
        aside = np.full(3, ASIDE)
        aside[face % 3] = REACH
        low, high = self.box[:3] - aside * self.size, self.box[3:] + aside * self.size
        return np.concatenate([np.maximum(box[:3], low), np.minimum(box[3:], high)])

    def link(self, face: int) -> np.ndarray:
        """Return the way from the middle of a face to the neighbour pulled away, (1, 2, 3)."""
        gate = self.middle.copy()
        gate[face % 3] = self.box[face]
        return np.stack([self.enlarged(gate), self.enlarged(gate, face)])[None]

    def far(self, face: int) -> np.ndarray:
        """Return a point behind a neighbour, (3,)."""
        point = self.middle.copy()
        point[face % 3] = self.box[face] + (0.6 if face > 2 else -0.6) * self.size[face % 3]
        return self.enlarged(point, face)


class NeighbourLinks(Play):
    """The links of a tree, and a walk along some of them."""

    def __init__(self, tree: LinkedSubdivision, walked: Walked) -> None:
        self.tree, self.walked, self.cells = tree, walked, walked.cells
        self.ropes, self.leaves = tree.ropes, tree.topology().leaves
        self.ends = {
            "entered": max(len(walked.visits) - 1, 0), "number": len(self.leaves) - 1
        }  # fmt: skip

    def picture(self, settings: Settings) -> Picture:
        """Return the links of one leaf."""
        entered = settings.entered if settings.which == "ray" else None
        index = settings.number
        if entered is not None and len(self.walked.visits):
            node = int(self.walked.steps.cell[self.walked.visits[entered]])
            index = int(np.flatnonzero(self.leaves == node)[0])
        ropes, leaf = self.ropes[index], int(self.leaves[index])
        taken = self.taken(entered, ropes) if entered is not None else -1
        box = self.box(leaf)
        parts: list[Lines | Faces] = [
            coloured(box_segments(box[None]), ORANGE), *self.walked.ray_lines()
        ]  # fmt: skip
        lens = Lens(self.tree.scene, box)
        parts += self.enlarged_leaf(lens, box, entered)
        marks, rows = [], []
        for face, rope in enumerate(ropes.tolist()):
            label = f"Face {FACES[face]}"
            if rope < 0:
                rows.append(Row(label, "none", "It lies in the border of the root"))
                continue
            is_leaf = bool(self.cells.is_leaf[self.place(rope)])
            colour = RED if face == taken else BLUE if is_leaf else YELLOW
            parts += self.neighbour(lens, face, rope, colour, is_leaf)
            kind = "leaf" if is_leaf else "inner node"
            depth = int(self.cells.depth[self.place(leaf)] - self.cells.depth[self.place(rope)])
            larger = f", {counted(depth, 'level', 'levels')} above" if depth else ", the same level"
            followed = ", taken by the ray" if face == taken else ""
            rows.append(
                Row(label, f"{kind} {rope}{larger}{followed}",
                    "The smallest node that covers the whole face")
            )  # fmt: skip
            marks.append(Mark(lens.far(face), f"{FACES[face]}: {rope}", colour[:3]))
        linked = int((ropes >= 0).sum())
        caption = f"Leaf {leaf} has {counted(linked, 'link', 'links')}"
        if taken >= 0:
            caption += f"; the ray leaves it by face {FACES[taken]} and goes on at {ropes[taken]}"
        elif entered is not None:
            caption += "; here the walk of the ray ends"
        rows.append(Row("Links in All", f"{int((self.ropes >= 0).sum())}", "Of all leaves"))
        return picture_of(parts, caption, marks=marks, rows=rows)

    def enlarged_leaf(
        self, lens: Lens, box: np.ndarray, entered: int | None
    ) -> list[Lines | Faces]:
        """Return the leaf, and the piece of the ray in it."""
        around = lens.enlarged(corners_of(box[None]))
        sides = around[:, SIDES].reshape(-1, 4, 3)
        parts: list[Lines | Faces] = [
            quads(sides, ORANGE, 0.3),
            coloured(around[:, EDGES].reshape(-1, 2, 3), ORANGE),
        ]
        if entered is not None and len(self.walked.visits):
            event = self.walked.visits[entered]
            ends = np.array([self.walked.steps.t_enter[event], self.walked.steps.t_exit[event]])
            piece = lens.enlarged(self.walked.at(np.minimum(ends, self.walked.end)))
            parts.append(coloured(piece[None], RAY))
        return parts

    def neighbour(
        self, lens: Lens, face: int, rope: int, colour: Colour, is_leaf: bool
    ) -> list[Lines | Faces]:
        """Return what is behind a face, pulled away from it, and the link that leads there."""
        there = self.box(rope)
        near = lens.near(face, there)
        edges = lens.enlarged(corners_of(near[None]), face)[:, EDGES].reshape(-1, 2, 3)
        if (near != there).any():
            edges = dashes_of(edges)
        parts: list[Lines | Faces] = [
            coloured(edges, colour), coloured(arrows(lens.link(face)), colour)
        ]  # fmt: skip
        if not is_leaf:
            # The leaves below it that lie at the face.
            boxes = self.cells.boxes[self.cells.is_leaf]
            below = ((boxes[:, :3] >= there[:3]) & (boxes[:, 3:] <= there[3:])).all(axis=1)
            below &= boxes[:, (face + 3) % 6] == there[(face + 3) % 6]
            boxes = boxes[below][:MOST_BELOW]
            boxes[:, :3] = np.maximum(boxes[:, :3], near[:3])
            boxes[:, 3:] = np.minimum(boxes[:, 3:], near[3:])
            boxes = boxes[(boxes[:, :3] < boxes[:, 3:]).all(axis=1)]
            corners = lens.enlarged(corners_of(boxes), face)
            parts.append(coloured(corners[:, EDGES].reshape(-1, 2, 3), (*YELLOW[:3], 0.4)))
        return parts

    def taken(self, entered: int, ropes: np.ndarray) -> int:
        """Return the face by whose link the walk goes on, -1 if it ends: the log has the node."""
        if entered + 1 >= len(self.walked.visits):
            return -1
        steps = self.walked.steps
        after = np.arange(self.walked.visits[entered] + 1, self.walked.visits[entered + 1] + 1)
        # Tests of the leaf's items carry its own number.
        nodes = steps.cell[after][np.isin(steps.kind[after], ENTERING)]
        (faces,) = np.nonzero(ropes == nodes[0])
        return int(faces[0]) if len(faces) else -1

    def place(self, node: int) -> int:
        """Return the place of a node among the cells."""
        return int(self.cells.places_of(np.array([node]))[0])

    def box(self, node: int) -> np.ndarray:
        """Return the cell of a node, (6,)."""
        return self.cells.boxes[self.place(node)]

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first leaves of the ray."""
        return [Settings("ray", k) for k in range(min(self.ends["entered"] + 1, 4))]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Make the links, and walk along them."""
    tree = subject.structures[0]
    assert isinstance(tree, LinkedSubdivision)
    progress.report(0, 2, "Making links")
    linked = tree.walked_by("neighbours", "stored")
    progress.report(1, 2, "Following a ray")
    rays = ray_of(subject, [linked], near(ENOUGH), progress)
    return NeighbourLinks(linked, Walked.of(linked, rays, progress, tree.cells(progress)))


LESSONS = (
    Lesson(
        name="neighbour_links",
        label="Links to the Neighbours of a Leaf",
        slide="Traversing adaptive subdivision",
        begin="A leaf that knows what lies behind each of its faces needs no search from the root",
        look_for="A link to a larger leaf leads right there; where the other side is divided more "
        "finely it leads to an inner node, and the walk goes down from that",
        question="What do the links cost, and when are they not worth it?",
        answer="Six numbers for every leaf, and work whenever the tree changes; a stack of a few "
        "nodes does the same for nothing, if rays start outside",
        source="structures.subdivision.ropes",
        sample="suzanne:subdivisions=1",
        structures=("octree:max_depth=4,max_leaf_size=64",),
        suits=has_linked_leaves,
        Settings=Settings,
        play=play,
        film="entered",
        takes_ray=True,
    ),
)
