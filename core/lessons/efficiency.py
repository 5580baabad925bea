"""Lessons "nodes_not_paying" and "overlapping_siblings": where a hierarchy loses time.

The slide "Hierarchy efficiency". The first picture of each shows all, the others one node each.
Those come first where most is lost by lines through the root, to which a large node matters more
than a small one. The node is red if it does not pay and grey if it does, its children are blue and
orange; red is also what two siblings share. Small nodes are shown once more, enlarged.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import ramp
from ..contract.cells import Cells
from ..contract.outlines import wires_of
from ..geometry.box_shape import SIDES, box_segments, corners_of, surface_area
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.figures.overlap import shared_boxes
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Colour,
    Faces,
    Lines,
    coloured,
    opaque,
    picture_of,
    quads,
)
from .hierarchy import is_tree, tree_of
from .lesson import Lesson, Play, Subject
from .magnifier import magnifier
from .picture import Mark, Picture, Row

MOST_NODES = 24
"""Nodes with a frame of their own."""

MOST_ITEMS = 1000
"""Items drawn of each child."""

MOST_BOXES = 250
"""Nodes in the frame that shows them all."""


MAGNIFIED = 0.35
"""Size of a node under the magnifying glass, as a share of the scene's."""


@dataclass(frozen=True)
class Settings:
    """The knob of both lessons."""

    rank: int = setting(1, "Node", "Which node, the worst is 1; 0 shows them all", minimum=0)


class NodesNotPaying(Play):
    """The lecture's hierarchy efficiency, K B + sum p_i I_i < sum I_i, node by node."""

    def __init__(self, structure: BVH, progress: Progress) -> None:
        text = "Looking for nodes that do not pay"
        self.structure = structure
        progress.report(0, 4, text)
        self.efficiency = structure.efficiency()
        self.inner = np.flatnonzero(structure.arrays.size == 0)
        progress.report(1, 4, text)
        self.cells = structure.cells(progress)
        # The items below every node.
        self.begin, self.end = ranges_of(
            structure.arrays.first, structure.arrays.size, structure.width()
        )
        progress.report(2, 4, text)
        gain, areas = self.efficiency.gain[self.inner], structure.areas[self.inner]
        # Nodes that pay come behind all others: those with the least gain.
        order = np.lexsort([np.where(gain <= 0.0, gain * areas, gain), gain > 0.0])
        self.worst = self.inner[order]
        self.ends = {"rank": min(len(self.inner), MOST_NODES)}
        progress.report(3, 4, text)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of all nodes, or of one."""
        return self.one(int(self.worst[settings.rank - 1])) if settings.rank else self.all()

    def all(self) -> Picture:
        """Return the picture of all nodes that do not pay."""
        bad = self.worst[: int((self.efficiency.gain[self.inner] <= 0.0).sum())]
        shown = bad[:MOST_BOXES]
        parts = [
            volume_of(self.cells, np.array([0]), GREY), volume_of(self.cells, shown, RED)
        ]  # fmt: skip
        caption = (
            f"{len(bad)} of {len(self.inner)} inner nodes do not pay: "
            "K B + sum p_i I_i is not less than sum I_i"
        )
        if len(shown) < len(bad):
            caption += f"; drawn: the {len(shown)} worst"
        expected = self.efficiency.expected_gain[self.inner]
        rows = (
            Row("Inner Nodes", str(len(self.inner)), "Nodes with children"),
            Row("Do Not Pay", str(len(bad)), "By the objects in their children, as on the slide"),
            Row(
                "Do Not Pay, Expected", str(int((expected <= 0.0).sum())),
                "By what is expected below the children, with the volumes there as they are",
            ),
        )  # fmt: skip
        return picture_of(parts, caption, rows=rows)

    def one(self, node: int) -> Picture:
        """Return the picture of one node and its children."""
        structure, figures, cells = self.structure, self.efficiency, self.cells
        arrays, settings = structure.arrays, structure.settings
        children = int(arrays.first[node]) + np.arange(int(structure.width()[node]))
        areas = structure.areas
        p = areas[children] / areas[node] if areas[node] > 0.0 else np.ones(len(children))
        inside = settings.C_isect * figures.references[children]
        terms = " + ".join(f"{a:.2f} × {b:g}" for a, b in zip(p, inside, strict=True))
        left, right = settings.C_trav + float(p @ inside), float(inside.sum())
        pays = left < right
        caption = (
            f"Node {node}: K B + sum p_i I_i = {settings.C_trav:g} + {terms} = {left:.2f}, "
            f"sum I_i = {right:g}: it {'pays' if pays else 'does not pay'} "
            f"(gain {right - left:.2f}; "
            f"with what is expected below {figures.expected_gain[node]:.2f})"
        )
        parts = [volume_of(cells, np.array([node]), GREY if pays else RED)]
        rows = [Row("K B", f"{settings.C_trav:g}", "Testing the volumes of all children: C_trav")]
        boxes, marks = arrays.volumes.boxes(), []
        box = boxes[node]
        for i, child in enumerate(children):
            colour = ORANGE if i % 2 else BLUE
            begin, end = int(self.begin[child]), int(self.end[child])
            items = structure.geometry.ids[begin : min(end, begin + MOST_ITEMS)]
            lines = lines_of_items(structure.scene.geometry, items)
            parts.append(coloured(lines, colour))
            parts.append(volume_of(cells, np.array([child]), colour))
            values = f"p = {p[i]:.2f}, I = {inside[i]:g}"
            # Texts of children that lie within each other stand at opposite ends.
            end_of = boxes[child, 3:] if i % 2 else boxes[child, :3]
            marks.append(Mark(end_of, values, colour[:3]))
            rows.append(Row(f"Child {i + 1}", values, "p_i = SA_i / SA, and the time inside"))
        rows += [
            Row("K B + sum p_i I_i", f"{left:.3f}", "The time with the children's volumes"),
            Row("sum I_i", f"{right:g}", "The time of everything in them at once"),
            Row("Gain", f"{right - left:.3f}", "Of a node that does not pay it is not above 0"),
        ]
        root = volume_of(cells, np.array([0]), GREY)
        glass = magnifier(box, structure.scene, MAGNIFIED)
        if glass is not None:
            parts += [*(glass.of(part) for part in parts), glass.way()]
            marks = [Mark(glass.at(mark.position), mark.text, mark.colour) for mark in marks]
        return picture_of([root, *parts], caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return all of them, and the first."""
        return [Settings(rank) for rank in range(min(self.ends["rank"] + 1, 4))]


class OverlappingSiblings(Play):
    """Pairs of siblings that overlap, and the boxes that they share; the largest box first."""

    def __init__(self, structure: BVH, progress: Progress) -> None:
        self.structure = structure
        width, first = structure.width(), structure.arrays.first
        self.n_pairs = int((width * (width - 1) // 2).sum())
        text = "Looking for siblings that overlap"
        progress.report(0, 3, text)
        boxes = structure.arrays.volumes.boxes()
        found = []
        for i, j in itertools.combinations(range(int(width.max(initial=0))), 2):
            parents = np.flatnonzero(width > j)
            found.append(np.stack([parents, first[parents] + i, first[parents] + j]))
        pairs = np.concatenate([np.empty((3, 0), np.int64), *found], axis=1)
        progress.report(1, 3, text)
        shared = shared_boxes(boxes[pairs[1]], boxes[pairs[2]])
        progress.report(2, 3, text)
        areas, around = surface_area(shared), surface_area(boxes[pairs[0]])
        shares = np.divide(areas, around, out=np.zeros(len(areas)), where=around > 0.0)
        order = np.argsort(-areas, kind="stable")
        self.pairs, self.shared, self.shares = pairs[:, order].T, shared[order], shares[order]
        self.mean = float(structure.overlap()[width > 0].mean()) if self.n_pairs else 0.0
        self.ends = {"rank": min(self.n_pairs, MOST_NODES)}
        progress.report(3, 3, text)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of all pairs, or of one."""
        return self.one(settings.rank - 1) if settings.rank else self.all()

    def all(self) -> Picture:
        """Return the picture of all boxes that siblings share."""
        overlapping = int((self.shares > 0.0).sum())
        shown = np.flatnonzero(self.shares > 0.0)[:MOST_BOXES]
        # Large ones last: where they coincide, those are seen.
        colours = opaque(ramp(self.shares[shown][::-1])).repeat(12, axis=0)
        caption = (
            f"What siblings share: {overlapping} of {self.n_pairs} pairs overlap, "
            f"in the mean by {100.0 * self.mean:.1f}% of their parent's surface; "
            "blue to red: 0 to 100%"
        )
        if len(shown) < overlapping:
            caption += f"; drawn: the {len(shown)} largest"
        root = coloured(box_segments(self.structure.arrays.volumes.boxes()[:1]), GREY)
        lines = Lines(box_segments(self.shared[shown][::-1]), colours)
        rows = (
            Row("Pairs", str(self.n_pairs), "Of children of one node"),
            Row("Overlap", str(overlapping), "Pairs that share a box, or a side of one"),
            Row("Mean Overlap", f"{100.0 * self.mean:.1f}%",
                "Surface that siblings share, in that of their parent"),
        )  # fmt: skip
        return picture_of([root, lines], caption, rows=rows)

    def one(self, number: int) -> Picture:
        """Return the picture of one pair."""
        boxes, depths = self.structure.arrays.volumes.boxes(), self.structure.depths()
        parent, a, b = (int(node) for node in self.pairs[number])
        shared, share = self.shared[number], float(self.shares[number])
        sides = corners_of(shared[None])[:, SIDES].reshape(-1, 4, 3)
        parts: list[Lines | Faces] = [
            quads(sides, RED, 0.3),
            coloured(box_segments(boxes[[parent]]), GREY),
            coloured(box_segments(boxes[[a]]), BLUE),
            coloured(box_segments(boxes[[b]]), ORANGE),
            coloured(np.concatenate([box_segments(shared[None]), shared.reshape(1, 2, 3)]), RED),
        ]
        caption = (
            f"Children {a} (blue) and {b} (orange) of node {parent}, depth {depths[parent]}: "
            f"they share {100.0 * share:.1f}% of its surface (red)"
        )
        rows = (
            Row("Depth", str(int(depths[parent])), "Of the node whose children they are"),
            Row("Overlap", f"{100.0 * share:.1f}%", "SA of what they share in SA of the node"),
        )  # fmt: skip
        marks = [Mark(shared[3:], f"both: {100.0 * share:.0f}%", RED[:3])]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return all of them, and the first."""
        return [Settings(rank) for rank in range(min(self.ends["rank"] + 1, 4))]


def volume_of(cells: Cells, nodes: np.ndarray, colour: Colour) -> Lines:
    """Return the edges of the volumes of nodes."""
    return coloured(wires_of(cells, cells.places_of(nodes)).segments(), colour)


def play_paying(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Evaluate the inequality at every node."""
    return NodesNotPaying(tree_of(subject), progress)


def play_overlapping(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at all pairs of siblings."""
    return OverlappingSiblings(tree_of(subject), progress)


LESSONS = (
    Lesson(
        name="nodes_not_paying",
        label="Does a Node Pay?",
        slide="Hierarchy efficiency",
        begin="A node pays if testing the volumes of its children takes less than they keep off",
        look_for="Red nodes cost more than they save: their children's volumes are almost as large "
        "as they are themselves, or there is hardly anything inside",
        question="A node does not pay. What should a builder do with it?",
        answer="Make it a leaf: its objects are then tested at once, and the tests of its "
        "children's volumes, which keep off too little, are left out. Everything else stays as it "
        "is",
        source="structures.bvh.figures.efficiency",
        sample="suzanne:subdivisions=1",
        structures=("bvh:max_leaf_size=1",),
        suits=is_tree,
        Settings=Settings,
        play=play_paying,
        film="rank",
    ),
    Lesson(
        name="overlapping_siblings",
        label="Siblings That Overlap",
        slide="Hierarchy efficiency",
        begin="Where the volumes of two siblings overlap, a ray has to search both",
        look_for="Red is what both share: a ray through it enters both children, and its hit in "
        "one of them does not tell whether the other has a nearer one",
        question="Can the volumes of siblings be kept from overlapping?",
        answer="Not as long as each object is in one of them: an object that lies across the "
        "border sticks out. Space subdivisions and spatial splits cut it, and pay with references",
        source="structures.bvh.figures.overlap",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        suits=is_tree,
        Settings=Settings,
        play=play_overlapping,
        film="rank",
    ),
)
