"""Lesson "spatial_splits": planes that cut triangles, clipped boxes, references on both sides.

Which splits those were, the build log has: afterwards there are more references than before. What
they have cut is in the finished tree. A triangle below both children of a node was referenced on
both sides of its plane, and the parts of it below one of them lie in the box that it had there.

Blue: left of the plane. Orange: right of it. Red: the plane, and the triangles that it cuts. M.
Stich, H. Friedrich, A. Dietrich: Spatial Splits in Bounding Volume Hierarchies, HPG 2009.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.build_log import SPLIT, BuildLog
from ..errors import InputError
from ..geometry.box_shape import box_segments, surface_area
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..ranges import ranges
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    coloured,
    column,
    counted,
    cut_across,
    faint,
    picture_of,
    solid,
    some_of,
)
from .hierarchy import has_log, is_tree, tree_and_log
from .lesson import Lesson, Play, Subject
from .magnifier import enlarged_beside
from .picture import Picture, Row
from .splits import box_around

MOST_SPLITS = 12
"""Spatial splits that are shown, those nearest to the root."""

MOST_BOXES = 60
"""Clipped references drawn on either side, the largest."""

MOST_TRIANGLES = 1000
"""Other triangles drawn on either side, evenly out of all."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    split: int = setting(0, "Split", "Which spatial split; 0 is nearest to the root", minimum=0)


class Descent(NamedTuple):
    """The tree as it was split, by names of the log.

    Attributes
    ----------
    children : (m, 2) int32
        -1 where there are none.
    depth : (m,) int32
    size : (m,) int64
        References of a node when it was made.
    """

    children: np.ndarray
    depth: np.ndarray
    size: np.ndarray


def descent_of(log: BuildLog, n_triangles: int) -> Descent:
    """Return the tree as it was split."""
    count, is_split = len(log.cells), log.kind == SPLIT
    node, children = log.node[is_split], log.children[is_split]
    out = Descent(
        np.full((count, 2), -1, np.int32), np.zeros(count, np.int32), np.zeros(count, np.int64)
    )
    out.children[node] = children
    out.size[children] = log.counts[is_split]
    if not len(node):
        return out
    root = node[0]
    out.size[root] = n_triangles
    level, depth = np.array([root]), 0
    while len(level):
        out.depth[level] = depth
        level = out.children[level]
        level, depth = level[level >= 0], depth + 1
    return out


def spatial_events(bvh: BVH, log: BuildLog, descent: Descent) -> np.ndarray:
    """Return the events that have cut triangles, those nearest to the root first."""
    splits = np.flatnonzero(log.kind == SPLIT)
    cuts = splits[log.counts[splits].sum(axis=1) > descent.size[log.node[splits]]]
    return cuts[np.argsort(descent.depth[log.node[cuts]], kind="stable")][:MOST_SPLITS]


class SpatialSplits(Play):
    """The spatial splits nearest to the root."""

    def __init__(self, bvh: BVH, log: BuildLog, progress: Progress) -> None:
        self.bvh, self.log = bvh, log
        self.descent = descent_of(log, len(bvh.scene))
        events = spatial_events(bvh, log, self.descent).tolist()
        if not events:
            raise InputError(
                "no triangle was worth being cut here; choose a mesh with large triangles beside "
                "small ones, such as sample:suzanne"
            )
        self.pictures = []
        for done, event in enumerate(events):
            progress.report(done, len(events), "Reading the spatial splits")
            self.pictures.append(self._picture_of(done, event))
        self.ends = {"split": len(events) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a split."""
        return self.pictures[settings.split]

    def _picture_of(self, number: int, event: int) -> Picture:
        """Return the picture of the split that an event of the log tells of."""
        bvh, log, descent = self.bvh, self.log, self.descent
        axis, position = int(log.axis[event]), float(log.position[event])
        geometry, all_boxes = bvh.scene.geometry, bvh.scene.boxes()
        sides = [side_of(bvh, log, descent, int(child)) for child in log.children[event]]
        both = np.intersect1d(sides[0][0], sides[1][0])
        box = box_around(np.concatenate([boxes for _, boxes in sides]))
        lines, faces = [coloured(box_segments(box[None]), GREY)], []
        for (ids, boxes), colour in zip(sides, (BLUE, ORANGE), strict=True):
            is_cut = np.isin(ids, both)
            others = some_of(ids[~is_cut], MOST_TRIANGLES)
            lines.append(coloured(lines_of_items(geometry, others), faint(colour, 0.25)))
            around, inside = solid(box_around(boxes)[None], colour, 0.1)
            lines.append(around)
            faces.append(inside)
            clipped = boxes[is_cut]
            largest = np.argsort(-surface_area(clipped), kind="stable")[:MOST_BOXES]
            lines.append(coloured(box_segments(clipped[largest]), colour))
        largest = np.argsort(-surface_area(all_boxes[both]), kind="stable")[:MOST_BOXES]
        lines.append(coloured(lines_of_items(geometry, both[largest]), RED))
        plane, inside = cut_across(box, axis, position)
        lines, faces = [*lines, plane], [*faces, inside]
        (n_left, n_right), size = log.counts[event].tolist(), int(descent.size[log.node[event]])
        depth = int(descent.depth[log.node[event]])
        caption = (
            f"Spatial split {number + 1}, at depth {depth}: {'xyz'[axis]} = {position:.4g} divides "
            f"{size} references into {n_left} (blue) and {n_right} (orange); "
            f"{counted(len(both), 'triangle (red) is', 'triangles (red) are')} referenced on both "
            "sides, each time with the box of its part"
        )
        if len(largest) < len(both):
            caption += f"; drawn: the {MOST_BOXES} largest"
        texts = [
            (f"N_L = {n_left}", BLUE),
            (f"N_R = {n_right}", ORANGE),
            (f"cut: {len(both)}", RED),
        ]
        rows = [
            Row("References", str(size), "Of the node, before the split"),
            Row("N_L", str(n_left), "References to the left"),
            Row("N_R", str(n_right), "References to the right"),
            Row("Cut", str(len(both)), "Triangles with a reference on both sides: N_L + N_R - N"),
            Row("Spatial Splits", str(sum(bvh.figures["spatial_splits"])), "In the whole tree"),
        ]
        enlarged = enlarged_beside(lines, box, bvh.scene)
        return picture_of(
            [*lines, *faces, *enlarged], caption, marks=column(bvh.scene, texts), rows=rows
        )


def side_of(bvh: BVH, log: BuildLog, descent: Descent, name: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (n,) that a node had references to, ascending, and boxes of those."""
    references = references_below(bvh, log, descent, name)
    ids, where = np.unique(bvh.geometry.ids[references], return_inverse=True)
    parts = bvh.reference_boxes()[references]
    boxes = np.full((len(ids), 6), np.inf)
    boxes[:, 3:] = -np.inf
    np.minimum.at(boxes[:, :3], where, parts[:, :3])
    np.maximum.at(boxes[:, 3:], where, parts[:, 3:])
    return ids, boxes


def references_below(bvh: BVH, log: BuildLog, descent: Descent, name: int) -> np.ndarray:
    """Return the references of the finished structure that came from a node, (n,) int64."""
    ends, level = [], np.array([name])
    while len(level):
        is_end = descent.children[level, 0] < 0
        ends.append(level[is_end])
        level = descent.children[level[~is_end]].ravel()
    names = np.concatenate(ends)
    if log.leaves is not None:
        return np.flatnonzero(np.isin(log.leaves, names))
    leaves = log.cells[names]
    return ranges(bvh.arrays.first[leaves], bvh.arrays.size[leaves])


def cuts_triangles(structure: Any) -> str:
    """Accept trees that SBVH has built, see :attr:`.Lesson.suits`."""
    if reason := is_tree(structure):
        return reason
    if structure.settings.builder != "sbvh":
        return "its builder cuts no triangles; take sbvh"
    return has_log(structure)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Read the splits that have cut triangles."""
    bvh, log = tree_and_log(subject, progress)
    return SpatialSplits(bvh, log, progress)


LESSONS = (
    Lesson(
        name="spatial_splits",
        label="Spatial Splits (SBVH)",
        slide="Contemporary methods",
        begin="A plane may cut triangles, too: each part is referenced with the box around it",
        look_for="A large triangle would make both children overlap; cut into two references, it "
        "makes neither child larger; where that does not pay a triangle is left whole on one side",
        question="What is paid for children that do not overlap?",
        answer="References: a cut triangle is stored and may be tested on both sides, so that the "
        "tree has more references. The heuristic counts it in N_L and in N_R and cuts only where "
        "the smaller boxes save more than that",
        source="structures.bvh.builders.spatial.sbvh",
        sample="suzanne:subdivisions=0",
        structures=("bvh:builder=sbvh",),
        suits=cuts_triangles,
        Settings=Settings,
        play=play,
        film="split",
    ),
)
