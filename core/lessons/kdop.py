"""The lecture's slides of k-DOP trees: levels 0 to 3 of 6-, 14-, 18- and 26-DOPs, side by side."""

from __future__ import annotations

import numpy as np

from ..colours import INNER_COLOUR, ramp
from ..contract.cells import Cells
from ..contract.outlines import wires_of
from ..geometry.instances import lines_of_items
from ..geometry.kdop import KDOPs
from ..progress import SILENT, Progress
from ..scene import Scene
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.fit import fit_all
from ..structures.bvh.topology.tree import ranges_of
from .drawing import counted
from .exhibit import Exhibit, Frame

LEVELS = 4
"""Levels that the slides show."""

GAP = 1.4
"""Distance of two copies, in sizes of the scene."""

PLACES = {6: (0, 0), 14: (1, 0), 18: (0, -1), 26: (1, -1)}
"""Where the copies stand as on the slides: steps in x and z from the model itself."""

MOST_NODES = 64
"""Nodes of a level that are drawn: a 26-DOP has up to 72 edges, and there are four copies."""

MOST_ITEMS = 1000
"""Items whose outlines stand for the object in each copy."""

FAINT = 0.45
"""Opacity of the object."""


def kdop_levels(bvh: BVH) -> Exhibit:
    """Return the same tree with four kinds of k-DOPs, one frame per level.

    Leaves above a level are drawn with it, so that the volumes of each frame contain everything.
    """
    depths = bvh.depths()
    count = min(int(depths.max()) + 1, LEVELS)

    def frame(level: int, progress: Progress = SILENT) -> Frame:
        is_shown = (depths == level) | ((bvh.arrays.size > 0) & (depths < level))
        nodes = np.flatnonzero(is_shown)
        begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
        nodes = np.sort(nodes[np.argsort(begin[nodes] - end[nodes], kind="stable")[:MOST_NODES]])
        corners, begin, end = bvh.referred(begin[nodes], end[nodes], progress)
        object_lines = outlines_of_some(bvh.scene)
        segments, colours, sums = [], [], []
        for k, (right, up) in PLACES.items():
            volumes = fit_all(f"kdop{k}", corners, begin, end, progress)
            lines, owners = edges_of(volumes)
            size = bvh.scene.upper - bvh.scene.lower
            shift = GAP * np.array([right * size[0], 0.0, up * size[2]])
            segments += [object_lines + shift, lines + shift]
            faint = np.tile((*INNER_COLOUR, FAINT), (len(object_lines), 1))
            bright = np.column_stack([ramp(owners / max(len(nodes) - 1, 1)), np.ones(len(lines))])
            colours += [faint, bright]
            sums.append((k, float(volumes.areas().sum())))
        caption = f"Level {level}: {counted(len(nodes), 'volume', 'volumes')}"
        if len(nodes) < is_shown.sum():
            caption += f", the largest of {is_shown.sum()}"
        caption += "; surfaces together, in those of the 6-DOPs: "
        whole = sums[0][1] or 1.0
        caption += ", ".join(f"{k}-DOP {area / whole:.2f}" for k, area in sums)
        return Frame(np.concatenate(segments), np.concatenate(colours), caption)

    return Exhibit(
        "kdop_levels",
        "K-DOP Levels",
        "Levels of the same tree with 6- and 14-DOPs above, 18- and 26-DOPs below",
        count,
        frame,
    )


def edges_of(volumes: KDOPs) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of all k-DOPs (k, 2, 3), and the number of each edge's own."""
    numbers = np.arange(len(volumes.rows))
    zero = np.zeros(len(numbers), np.int32)
    cells = Cells(
        volumes.boxes(), zero, zero, np.ones(len(numbers), dtype=bool), zero,
        faces=volumes.polygons(numbers),
    )  # fmt: skip
    wires = wires_of(cells, numbers)
    return wires.segments(), wires.edge_owners()


def outlines_of_some(scene: Scene) -> np.ndarray:
    """Return the outlines of items, of evenly chosen ones if they are many, (k, 2, 3)."""
    some = np.arange(0, len(scene), max(len(scene) // MOST_ITEMS, 1))
    return lines_of_items(scene.geometry, some)
