"""Exhibit "spatial splits": planes that cut triangles, clipped boxes, references on both sides.

Which splits those were, the build log has: afterwards there are more references than before. What
they have cut is in the finished tree. A triangle below both children of a node was referenced on
both sides of its plane, and the parts of it below one of them lie in the box that it had there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contract.build_log import SPLIT, BuildLog
from ..contract.cells import planes_across
from ..geometry.box import boxes_of
from ..geometry.box_shape import box_segments, surface_area
from ..progress import SILENT, Progress
from ..ranges import ranges
from ..structures.bvh.hierarchy import BVH
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Colour, coloured, counted, frame_of, outlines
from .efficiency import magnified
from .exhibit import Exhibit, Frame

MOST_SPLITS = 12
"""Spatial splits with a frame of their own, those nearest to the root."""

MOST_BOXES = 200
"""Clipped references drawn on either side, the largest."""

MOST_TRIANGLES = 1500
"""Other triangles drawn on either side, evenly out of all."""


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
    root = node[0]
    out.size[root] = n_triangles
    level, depth = np.array([root]), 0
    while len(level):
        out.depth[level] = depth
        level = out.children[level]
        level, depth = level[level >= 0], depth + 1
    return out


def spatial_splits(structure: BVH, log: BuildLog) -> list[Exhibit]:
    """Return the exhibit, if triangles were cut."""
    if structure.parts is None:
        return []
    descent = descent_of(log, len(structure.scene))
    splits = np.flatnonzero(log.kind == SPLIT)
    cuts = splits[log.counts[splits].sum(axis=1) > descent.size[log.node[splits]]]
    shown = cuts[np.argsort(descent.depth[log.node[cuts]], kind="stable")][:MOST_SPLITS]

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        event = int(shown[number])
        label = f"Spatial split {number + 1}, at depth {descent.depth[log.node[event]]}"
        return frame_of_split(structure, log, descent, event, label, progress)

    exhibit = Exhibit(
        "spatial_splits",
        "Spatial Splits",
        "Planes of SBVH that cut triangles: clipped boxes, and triangles referenced on both sides",
        len(shown),
        frame,
    )
    return [exhibit] if len(shown) else []


def frame_of_split(
    bvh: BVH, log: BuildLog, descent: Descent, event: int, label: str, progress: Progress
) -> Frame:
    """Show the split that an event of the log tells of."""
    corners, axis, position = bvh.scene.triangles, int(log.axis[event]), log.position[event]
    progress.report(0, 4, label)
    sides = [side_of(bvh, log, descent, int(child)) for child in log.children[event]]
    progress.report(1, 4, label)
    both = np.intersect1d(sides[0][0], sides[1][0])
    everything = np.concatenate([boxes for _, boxes in sides])
    box = np.concatenate([everything[:, :3].min(axis=0), everything[:, 3:].max(axis=0)])
    plane = planes_across(box[None], axis, np.array([position]))
    parts = [coloured(box_segments(box[None]), GREY)]
    for done, ((ids, boxes), colour) in enumerate(zip(sides, (BLUE, ORANGE), strict=True), 2):
        progress.report(done, 4, label)
        is_cut = np.isin(ids, both)
        others = ids[~is_cut]
        places = np.linspace(0, len(others) - 1, min(len(others), MOST_TRIANGLES)).astype(np.int64)
        parts.append(coloured(outlines(corners[others[places]]), faint(colour)))
        around = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
        parts.append(coloured(box_segments(around[None]), colour))
        clipped = boxes[is_cut]
        largest = np.argsort(-surface_area(clipped), kind="stable")[:MOST_BOXES]
        parts.append(coloured(box_segments(clipped[largest]), colour))
    parts.append(coloured(outlines(plane), GREEN))
    shown = both[np.argsort(-surface_area(boxes_of(corners[both])), kind="stable")[:MOST_BOXES]]
    parts.append(coloured(outlines(corners[shown]), RED))
    n_left, n_right = log.counts[event]
    caption = (
        f"{label}: {'xyz'[axis]} = {position:.4g} (green) divides {descent.size[log.node[event]]} "
        f"references into {n_left} (blue) and {n_right} (orange); "
        f"{counted(len(both), 'triangle (red) is', 'triangles (red) are')} referenced on both "
        "sides, each time with the box of its part"
    )
    if len(shown) < len(both):
        caption += f"; boxes drawn: the {MOST_BOXES} largest"
    return frame_of([*parts, *magnified(parts, box, bvh.scene)], caption)


def side_of(bvh: BVH, log: BuildLog, descent: Descent, name: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (n,) that a node had references to, ascending, and boxes of those."""
    references = references_below(bvh, log, descent, name)
    ids, where = np.unique(bvh.triangles.ids[references], return_inverse=True)
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


def faint(colour: Colour) -> Colour:
    """Return a colour for what is not the subject."""
    return (*colour[:3], 0.25)
