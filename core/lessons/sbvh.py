"""Exhibit "spatial splits": planes that cut triangles, clipped boxes, references on both sides.

The builder is run again, level by level, until it has made enough spatial splits.
"""

from __future__ import annotations

import dataclasses
from collections import deque

import numpy as np

from ..contract.cells import planes_across
from ..geometry.box import boxes_of
from ..geometry.box_shape import box_segments, surface_area
from ..progress import SILENT, Progress
from ..structures.bvh.builders.spatial.sbvh import Construction, Node, Split
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import Primitives
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Colour, coloured, frame_of, outlines
from .efficiency import magnified
from .exhibit import Exhibit, Frame, Once

MOST_SPLITS = 12
"""Spatial splits with a frame of their own, those nearest to the root."""

MOST_BOXES = 200
"""Clipped references drawn on either side, the largest."""

MOST_TRIANGLES = 1500
"""Other triangles drawn on either side, evenly out of all."""


def spatial_splits(structure: BVH) -> list[Exhibit]:
    """Return the exhibit, if there were any spatial splits."""
    made = sum(structure.figures.get("spatial_splits", ()))
    if made == 0:
        return []

    @Once
    def frames(progress: Progress) -> list[Frame]:
        return frames_of(structure, min(made, MOST_SPLITS), progress)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        return frames(progress)[number]

    exhibit = Exhibit(
        "spatial_splits",
        "Spatial Splits",
        "Planes of SBVH that cut triangles: clipped boxes, and triangles referenced on both sides",
        min(made, MOST_SPLITS),
        frame,
    )
    return [exhibit]


def frames_of(structure: BVH, count: int, progress: Progress) -> list[Frame]:
    """Run the builder until it has made so many spatial splits, and show each.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    settings, corners = structure.settings, structure.scene.triangles
    if settings.optimise != "none":
        # What an optimiser gets has one reference a leaf.
        settings = dataclasses.replace(settings, max_leaf_size=1)
    work = Construction(Primitives(corners, boxes_of(corners)), settings)
    waiting = deque([work.root])
    frames: list[Frame] = []
    while len(frames) < count:
        progress.report(len(frames), count, "Running SBVH again")
        split = work.split(waiting.popleft())
        if split:
            waiting += [split.left, split.right]
            if split.plane:
                label = f"Spatial split {len(frames) + 1}, at depth {split.node.depth}"
                frames.append(frame_of_split(structure, work, split, label, progress))
    return frames


def frame_of_split(
    structure: BVH, work: Construction, split: Split, label: str, progress: Progress
) -> Frame:
    """Show a split that was made just now: the references of its children are still in order."""
    assert split.plane is not None
    corners, (axis, position) = structure.scene.triangles, split.plane
    box = work.tree.boxes[split.node.number]
    sides = [side_of(work, node) for node in (split.left, split.right)]
    progress.report(0, 3, label)
    both = np.intersect1d(sides[0][0], sides[1][0])
    plane = planes_across(box[None], axis, np.array([position]))
    parts = [coloured(box_segments(box[None]), GREY)]
    for done, ((ids, boxes), colour) in enumerate(zip(sides, (BLUE, ORANGE), strict=True), 1):
        progress.report(done, 3, label)
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
    caption = (
        f"{label}: {'xyz'[axis]} = {position:.4g} (green) divides {split.node.size} references "
        f"into {split.left.size} (blue) and {split.right.size} (orange); {len(both)} triangles "
        "(red) are referenced on both sides, each time with the box of its part"
    )
    if len(shown) < len(both):
        caption += f"; boxes drawn: the {MOST_BOXES} largest"
    return frame_of([*parts, *magnified(parts, box, structure.scene)], caption)


def side_of(work: Construction, node: Node) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (n,) and the boxes (n, 6) of a node's references."""
    last = node.first + node.size
    references = work.references
    return references.triangle[node.first : last].copy(), references.boxes[node.first : last].copy()


def faint(colour: Colour) -> Colour:
    """Return a colour for what is not the subject."""
    return (*colour[:3], 0.25)
