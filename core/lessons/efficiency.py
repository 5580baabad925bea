"""Exhibits "nodes that do not pay" and "overlapping siblings" of a hierarchy.

The first frame of each shows them all, the others one node each. Those come first where most is
lost by lines through the root, to which a large node matters more than a small one.
"""

from __future__ import annotations

import itertools

import numpy as np

from ..colours import ramp
from ..contract.cells import Cells
from ..contract.outlines import wires_of
from ..geometry.box_shape import box_segments, surface_area
from ..geometry.instances import lines_of_items
from ..progress import SILENT, Progress
from ..scene import Scene
from ..structures.bvh.figures.efficiency import Efficiency
from ..structures.bvh.figures.overlap import shared_boxes
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .drawing import BLUE, GREY, ORANGE, RED, Colour, Lines, coloured, frame_of
from .exhibit import Exhibit, Frame, Once

MOST_NODES = 24
"""Nodes with a frame of their own."""

MOST_ITEMS = 1000
"""Items drawn of each child."""

MAGNIFIED = 0.35
"""Size of a node under the magnifying glass, as a share of the scene's."""

MOST_BOXES = 1500
"""Nodes in the frame that shows them all."""


def nodes_not_paying(structure: BVH) -> Exhibit:
    """Return the exhibit of the lecture's hierarchy efficiency, K B + sum p_i I_i < sum I_i."""
    settings = structure.settings
    inner = np.flatnonzero(structure.arrays.size == 0)
    text = "Looking for nodes that do not pay"

    @Once
    def efficiency(progress: Progress) -> Efficiency:
        progress.report(0, 4, text)
        return structure.efficiency()

    cells = Once(structure.cells)

    @Once
    def ranges(progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        """Begin and end of the items below every node."""
        progress.report(2, 4, text)
        return ranges_of(structure.arrays.first, structure.arrays.size, structure.width())

    @Once
    def worst(progress: Progress) -> np.ndarray:
        gain, areas = efficiency(progress).gain[inner], structure.areas[inner]
        progress.report(3, 4, text)
        # Nodes that pay come behind all others: those with the least gain.
        return inner[np.lexsort([np.where(gain <= 0.0, gain * areas, gain), gain > 0.0])]

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        bad = worst(progress)
        for each in (cells, ranges):
            each(progress)
        if number > 0:
            return one(int(bad[number - 1]))
        bad = bad[: int((efficiency().gain[inner] <= 0.0).sum())]
        shown = bad[:MOST_BOXES]
        parts = [volume_of(cells(), np.array([0]), GREY), volume_of(cells(), shown, RED)]
        caption = (
            f"{len(bad)} of {len(inner)} inner nodes do not pay: "
            "K B + sum p_i I_i is not less than sum I_i"
        )
        if len(shown) < len(bad):
            caption += f"; drawn: the {len(shown)} worst"
        return frame_of(parts, caption)

    def one(node: int) -> Frame:
        arrays, figures = structure.arrays, efficiency()
        children = int(arrays.first[node]) + np.arange(int(structure.width()[node]))
        areas = arrays.volumes.areas()
        p = areas[children] / areas[node] if areas[node] > 0.0 else np.ones(len(children))
        inside = settings.C_isect * figures.references[children]
        terms = " + ".join(f"{a:.2f} × {b:g}" for a, b in zip(p, inside, strict=True))
        left, right = settings.C_trav + float(p @ inside), float(inside.sum())
        verdict = "pays" if left < right else "does not pay"
        caption = (
            f"Node {node}: K B + sum p_i I_i = {settings.C_trav:g} + {terms} = {left:.2f}, "
            f"sum I_i = {right:g}: it {verdict} (gain {right - left:.2f}; "
            f"with what is expected below {figures.expected_gain[node]:.2f})"
        )
        own = RED if left >= right else GREY
        parts = [volume_of(cells(), np.array([node]), own)]
        for i, child in enumerate(children):
            colour = ORANGE if i % 2 else BLUE
            begin, end = (int(each[child]) for each in ranges())
            items = structure.geometry.ids[begin : min(end, begin + MOST_ITEMS)]
            lines = lines_of_items(structure.scene.geometry, items)
            parts.append(coloured(lines, colour))
            parts.append(volume_of(cells(), np.array([child]), colour))
        box = structure.arrays.volumes.boxes()[node]
        root = volume_of(cells(), np.array([0]), GREY)
        return frame_of([root, *parts, *magnified(parts, box, structure.scene)], caption)

    return Exhibit(
        "nodes_not_paying",
        "Nodes That Do Not Pay",
        "Hierarchy efficiency: nodes whose volumes cost more than they save, the worst first",
        1 + min(len(inner), MOST_NODES),
        frame,
    )


def overlapping_siblings(structure: BVH) -> Exhibit:
    """Return the exhibit of pairs of siblings that overlap, and of the boxes they share."""
    width, first = structure.width(), structure.arrays.first
    n_pairs = int((width * (width - 1) // 2).sum())

    @Once
    def pairs(progress: Progress) -> tuple[np.ndarray, ...]:
        """Parents, both children, the boxes they share, and how much; the largest box first."""
        text = "Looking for siblings that overlap"
        progress.report(0, 3, text)
        boxes = structure.arrays.volumes.boxes()
        found = []
        for i, j in itertools.combinations(range(int(width.max(initial=0))), 2):
            parents = np.flatnonzero(width > j)
            found.append(np.stack([parents, first[parents] + i, first[parents] + j]))
        parents, a, b = np.concatenate([np.empty((3, 0), np.int64), *found], axis=1)
        progress.report(1, 3, text)
        shared = shared_boxes(boxes[a], boxes[b])
        progress.report(2, 3, text)
        areas, around = surface_area(shared), surface_area(boxes[parents])
        shares = np.divide(areas, around, out=np.zeros(len(areas)), where=around > 0.0)
        order = np.argsort(-areas, kind="stable")
        progress.report(3, 3, text)
        return tuple(each[order] for each in (parents, a, b, shared, shares))

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        parents, a, b, shared, shares = pairs(progress)
        if number > 0:
            n = number - 1
            return one(int(parents[n]), int(a[n]), int(b[n]), shared[n], float(shares[n]))
        shown = np.flatnonzero(shares > 0.0)[:MOST_BOXES]
        # Large ones last: where they coincide, those are seen.
        colours = ramp(shares[shown][::-1]).repeat(12, axis=0)
        colours = np.concatenate([colours, np.ones((len(colours), 1))], axis=1)
        mean = float(structure.overlap()[width > 0].mean()) if n_pairs else 0.0
        caption = (
            f"What siblings share: {int((shares > 0.0).sum())} of {n_pairs} pairs overlap, "
            f"in the mean by {100.0 * mean:.1f}% of their parent's surface; "
            "blue to red: 0 to 100%"
        )
        if len(shown) < (shares > 0.0).sum():
            caption += f"; drawn: the {len(shown)} largest"
        root = coloured(box_segments(structure.arrays.volumes.boxes()[:1]), GREY)
        return frame_of([root, Lines(box_segments(shared[shown][::-1]), colours)], caption)

    def one(parent: int, a: int, b: int, shared: np.ndarray, share: float) -> Frame:
        boxes, depths = structure.arrays.volumes.boxes(), structure.depths()
        parts = [
            coloured(box_segments(boxes[[parent]]), GREY),
            coloured(box_segments(boxes[[a]]), BLUE),
            coloured(box_segments(boxes[[b]]), ORANGE),
            coloured(np.concatenate([box_segments(shared[None]), shared.reshape(1, 2, 3)]), RED),
        ]
        caption = (
            f"Children {a} (blue) and {b} (orange) of node {parent}, depth {depths[parent]}: "
            f"they share {100.0 * share:.1f}% of its surface (red)"
        )
        return frame_of(parts, caption)

    return Exhibit(
        "overlapping_siblings",
        "Overlapping Siblings",
        "What two children of a node share: the pairs that overlap most",
        1 + min(n_pairs, MOST_NODES),
        frame,
    )


def volume_of(cells: Cells, nodes: np.ndarray, colour: Colour) -> Lines:
    """Return the edges of the volumes of nodes."""
    return coloured(wires_of(cells, cells.places_of(nodes)).segments(), colour)


def magnified(parts: list[Lines], box: np.ndarray, scene: Scene) -> list[Lines]:
    """Return parts once more, enlarged beside the model, with a line that leads there.

    Nothing, if they are large enough as they are.

    Parameters
    ----------
    box : (6,) float64
        What is enlarged.
    """
    size = float((scene.upper - scene.lower).max())
    own = float((box[3:] - box[:3]).max())
    if not 0.0 < own < MAGNIFIED * size:
        return []
    centre = 0.5 * (box[:3] + box[3:])
    place = np.array([scene.upper[0] + 0.35 * size, *(0.5 * (scene.lower + scene.upper))[1:]])
    scale = MAGNIFIED * size / own
    found = [Lines(place + scale * (part.segments - centre), part.colours) for part in parts]
    return [coloured(np.stack([centre, place])[None], GREY), *found]
