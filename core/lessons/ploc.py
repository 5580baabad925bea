"""Exhibit "PLOC clusters": the clusters after every iteration, in colours along the curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..colours import ramp
from ..geometry.box import boxes_of
from ..geometry.box_shape import box_segments
from ..parallel import Team
from ..progress import SILENT, Progress
from ..structures.bvh.builders.bottom_up.ploc import iterations
from ..structures.bvh.builders.morton.codes import sort_by_code
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import leaves_only
from .drawing import Lines, counted, frame_of
from .exhibit import MOST_SEGMENTS, Exhibit, Frame, Once

FAINT = 0.35
"""Opacity of clusters that have not merged in this iteration."""


class Snapshot(NamedTuple):
    """Some of the clusters after an iteration.

    Attributes
    ----------
    boxes : (k, 6) float64
    places : (k,) float64
        Where on the curve each begins, as a share of it.
    is_new : (k,) bool
        Whether it has been merged in this iteration.
    total : int
        Number of all clusters.
    """

    boxes: np.ndarray
    places: np.ndarray
    is_new: np.ndarray
    total: int


def ploc_exhibits(bvh: BVH) -> list[Exhibit]:
    """Return the clusters after every iteration, of a tree that PLOC has built.

    Frame 0 has the triangles themselves.
    """
    if bvh.settings.builder != "ploc":
        return []
    counts = bvh.figures["clusters"]

    @Once
    def snapshots(progress: Progress) -> list[Snapshot]:
        return take_snapshots(bvh, progress)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        shot = snapshots(progress)[number]
        opacity = np.where(shot.is_new, 1.0, FAINT)
        colours = np.concatenate([ramp(shot.places), opacity[:, None]], axis=1)
        lines = Lines(box_segments(shot.boxes), np.repeat(colours, 12, axis=0))
        if number == 0:
            caption = f"{counted(shot.total, 'triangle', 'triangles')}, each a cluster"
        else:
            merged = counted(counts[number - 1] - shot.total, "merger leaves", "mergers leave")
            caption = (
                f"Iteration {number} of {len(counts) - 1}: {merged} "
                f"{counted(shot.total, 'cluster', 'clusters')}; bright: merged just now"
            )
        if len(shot.boxes) < shot.total:
            caption += f"; drawn: {len(shot.boxes)} of them, evenly along the curve"
        return frame_of([lines], caption)

    # Where there are that many clusters for the first time.
    on_page = tuple(dict.fromkeys(sum(n > most for n in counts) for most in (1000, 100, 20, 5)))
    description = "The clusters after every iteration, coloured along the Morton curve"
    return [Exhibit("ploc_clusters", "PLOC Clusters", description, len(counts), frame, on_page)]


def take_snapshots(bvh: BVH, progress: Progress) -> list[Snapshot]:
    """Run the builder once more and keep what one frame can show of every iteration.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    boxes = boxes_of(bvh.scene.triangles)
    n = len(boxes)
    begins = np.arange(2 * n - 1)  # the first reference below each node
    made = 0  # nodes below this number are not new

    def snapshot(nodes: np.ndarray) -> Snapshot:
        some = nodes[:: -(-len(nodes) // (MOST_SEGMENTS // 12))]
        return Snapshot(tree.boxes[some], begins[some] / n, some >= made, len(nodes))

    with Team(progress, "Running PLOC again") as team:
        _, order = sort_by_code(boxes, int(bvh.settings.morton_bits), team)
        tree = leaves_only(boxes[order])
        shots, made = [snapshot(np.arange(n))], n
        for nodes in iterations(tree, bvh.settings.radius, team):
            new = nodes[nodes >= made]
            begins[new] = begins[tree.left[new]]
            shots.append(snapshot(nodes))
            made += len(new)
    return shots
