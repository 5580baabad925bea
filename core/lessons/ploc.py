"""Exhibit "PLOC clusters": the clusters after every iteration, in colours along the curve."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..colours import ramp
from ..contract.build_log import MERGE, BuildLog
from ..geometry.box_shape import box_segments
from ..progress import SILENT, Progress
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.build_log import tree_as_built
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


def ploc_exhibits(bvh: BVH, log: BuildLog) -> list[Exhibit]:
    """Return the clusters after every iteration, of a tree that PLOC has built.

    Frame 0 has the triangles themselves.
    """
    if bvh.settings.builder != "ploc":
        return []
    counts = bvh.figures["clusters"]

    @Once
    def snapshots(progress: Progress) -> list[Snapshot]:
        return take_snapshots(bvh, log, progress)

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


def take_snapshots(bvh: BVH, log: BuildLog, progress: Progress) -> list[Snapshot]:
    """Return what one frame can show of every iteration; the log has the mergers of each.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    text = "Reading the mergers"
    progress.report(0, 1, text)
    n, boxes = len(bvh.scene), tree_as_built(log, bvh.reference_boxes()).boxes
    merges = np.flatnonzero(log.kind == MERGE)
    made, children, step = log.node[merges], log.children[merges], log.step[merges]
    # Names begin with those of the triangles, along the curve. A cluster is known by the place of
    # its first triangle: that is in the left one of the two that it was merged of.
    begins, now = np.arange(len(log.cells)), np.arange(n)  # now: the cluster that begins there
    is_new = np.ones(len(log.cells), bool)

    def snapshot() -> Snapshot:
        nodes = now[now >= 0]
        some = nodes[:: -(-len(nodes) // (MOST_SEGMENTS // 12))]
        return Snapshot(boxes[some], begins[some] / n, is_new[some], len(nodes))

    shots, last = [snapshot()], int(step[-1]) if len(step) else 0
    for iteration in range(1, last + 1):
        progress.report(iteration - 1, last, text)
        these = slice(*np.searchsorted(step, [iteration, iteration + 1]))
        left, right = children[these].T
        begins[made[these]] = begins[left]
        now[begins[right]] = -1
        now[begins[left]] = made[these]
        is_new[:] = False
        is_new[made[these]] = True
        shots.append(snapshot())
    return shots
