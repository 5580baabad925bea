"""Exhibits of rearranged trees: reinsertions, treelets, and how the cost falls.

They show what the optimiser wrote into its log while it worked: the moves with the greatest gains,
the greatest first.
"""

from __future__ import annotations

import numpy as np

from ..geometry.box_shape import box_segments, surface_area
from ..progress import SILENT, Progress
from ..scene import Scene
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers.rearranging import Rearrangement
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Chart, Colour, Lines, coloured, frame_of
from .exhibit import Exhibit, Frame

OUTWARDS = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
"""Added to a box, moves all its sides outwards."""


def rearranging_exhibits(structure: BVH) -> list[Exhibit]:
    """Return what there is to show of a tree that was rearranged."""
    done = structure.rearrangement
    if done is None:
        return []
    found = [cost_over_steps(structure, done)]
    if done.made and structure.settings.optimise.startswith("reinsert"):
        found.append(reinsertions(structure, done))
    if done.made and structure.settings.optimise.startswith("treelet"):
        found.append(treelets(structure, done))
    return found


def cost_over_steps(structure: BVH, done: Rearrangement) -> Exhibit:
    """Return a chart of the cost; its frames go on step by step, at most 24 of them."""
    costs = np.array(done.costs)
    ends = np.unique(np.linspace(0, len(costs) - 1, min(len(costs), 24)).astype(np.int64))
    scene, optimise = structure.scene, structure.settings.optimise

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        size = extent(np.concatenate([scene.lower, scene.upper]))
        corner = np.array([scene.upper[0] + 0.3 * size, scene.lower[1], scene.lower[2]])
        across, upwards = np.array([size, 0.0, 0.0]), np.array([0.0, 0.0, 0.6 * size])
        last = int(ends[number])
        chart = Chart(corner, across, upwards, 0.0, len(costs) - 1.0, 1.1 * costs[0])
        shown = costs[: last + 1]
        parts = [
            chart.axes(),
            chart.level(costs[0], GREY),
            chart.curve(np.arange(last + 1), shown, BLUE),
            chart.mark(last, shown[-1], ORANGE),
        ]
        fallen = 1.0 - shown[-1] / costs[0] if costs[0] > 0.0 else 0.0
        return frame_of(
            parts,
            f"{optimise}, step {last} of {len(costs) - 1}: SAH cost {shown[-1]:.2f}, "
            f"{100.0 * fallen:.1f}% less than the {costs[0]:.2f} as built (grey); "
            "one triangle a leaf, the axis begins at 0",
        )

    return Exhibit(
        "cost_over_steps",
        "Cost over Steps",
        "How the cost of the tree falls while it is rearranged",
        len(ends),
        frame,
    )


def reinsertions(structure: BVH, done: Rearrangement) -> Exhibit:
    """Return the reinsertions that gained most, two frames each: before and after."""
    root = coloured(box_segments(structure.arrays.volumes.boxes()[:1]), GREY)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        row, is_after = done.moves[number // 2], number % 2 == 1
        node, old_parent, old_sibling, new_sibling = row[2:].reshape(4, 6)
        new_parent = union(node, new_sibling)
        parent, colour = (new_parent, GREEN) if is_after else (old_parent, RED)
        whole = union(old_parent, new_parent)

        def parts(margin: float) -> list[Lines]:
            # Around the others by a margin, a parent is not hidden by them.
            return [
                around(parent + margin * OUTWARDS, colour), around(old_sibling, GREY),
                around(new_sibling, BLUE), around(node, ORANGE),
            ]  # fmt: skip

        copy = enlarged(parts(0.02 * extent(whole)), whole, structure.scene)
        verb = "fell" if is_after else "will fall"
        caption = (
            f"Reinsertion {int(row[1]) + 1} of {done.made}, {'after' if is_after else 'before'}: "
            f"the node (orange) and its {'new' if is_after else 'old'} parent "
            f"({'green' if is_after else 'red'}), {share(structure, parent)}; its old sibling "
            f"(grey) and its new one (blue). The cost {verb} by {row[0]:.3g}"
        )
        return frame_of([root, *parts(0.0), *copy], caption)

    return Exhibit(
        "reinsertions",
        "Reinsertions",
        f"Where nodes were moved to: the {len(done.moves)} reinsertions that gained most",
        2 * len(done.moves),
        frame,
    )


def treelets(structure: BVH, done: Rearrangement) -> Exhibit:
    """Return the treelets that gained most, two frames each: before and after."""
    most = (done.moves.shape[1] + 1) // 10  # see treelet_width

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        row, is_new = done.moves[number // 2], number % 2
        count = int(row[2])
        leaves = row[3 : 3 + 6 * count].reshape(-1, 6)
        begin = 3 + 6 * most + 2 * (most - 1) * is_new
        children = row[begin : begin + 2 * (count - 1)].astype(np.int64).reshape(-1, 2)
        boxes = boxes_of_treelet(leaves, children)
        inner = boxes[count + 1 :]
        parts = [coloured(box_segments(leaves), GREY), around(boxes[count], BLUE)]
        parts += [coloured(box_segments(inner), GREEN if is_new else RED)]
        root = float(surface_area(structure.arrays.volumes.boxes()[0])) or 1.0
        areas = surface_area(inner).sum() / root
        caption = (
            f"Treelet {int(row[1]) + 1} of {done.made}, {'after' if is_new else 'before'}: "
            f"{count} leaves (grey), root (blue), {count - 2} inner nodes "
            f"({'green' if is_new else 'red'}) with {areas:.4g} times the area of the scene's box. "
            f"The cost {'fell' if is_new else 'will fall'} by {row[0]:.3g}; "
            "right: the tree, the height of a node is its area"
        )
        diagram = topology(structure, boxes, children, GREEN if is_new else RED)
        copy = enlarged(parts, boxes[count], structure.scene)
        return frame_of([*parts, *copy, *diagram], caption)

    return Exhibit(
        "treelets",
        "Treelets",
        f"Treelets before and after: the {len(done.moves)} that gained most, and their trees",
        2 * len(done.moves),
        frame,
    )


def union(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the box (6,) around two boxes."""
    return np.concatenate([np.minimum(a[:3], b[:3]), np.maximum(a[3:], b[3:])])


def centre(box: np.ndarray) -> np.ndarray:
    """Return the centre (3,) of a box."""
    return 0.5 * (box[:3] + box[3:])


def extent(box: np.ndarray) -> float:
    """Return the longest edge of a box, or 1 if it has none."""
    return float((box[3:] - box[:3]).max()) or 1.0


def around(box: np.ndarray, colour: Colour) -> Lines:
    """Return the edges of a box."""
    return coloured(box_segments(box[None]), colour)


def enlarged(parts: list[Lines], box: np.ndarray, scene: Scene) -> list[Lines]:
    """Return what is in a box once more beside the model, where no triangles hide it."""
    size = extent(np.concatenate([scene.lower, scene.upper]))
    middle = 0.5 * (scene.lower + scene.upper)
    place = np.array([scene.upper[0] + 0.6 * size, middle[1], middle[2]])
    scale = 0.6 * size / extent(box)
    return [Lines(place + scale * (part.segments - centre(box)), part.colours) for part in parts]


def share(structure: BVH, box: np.ndarray) -> str:
    """Return the area of a box as a share of the root's."""
    root = float(surface_area(structure.arrays.volumes.boxes()[0])) or 1.0
    return f"{100.0 * float(surface_area(box)) / root:.3g}% of the root's area"


def boxes_of_treelet(leaves: np.ndarray, children: np.ndarray) -> np.ndarray:
    """Return the boxes of all nodes of a treelet, (2k - 1, 6), by their numbers.

    Parameters
    ----------
    leaves : (k, 6) float64
    children : (k - 1, 2) int64
        Of each inner node; parents come first.
    """
    boxes = np.concatenate([leaves, np.empty((len(children), 6))])
    for k in range(len(children) - 1, -1, -1):
        boxes[len(leaves) + k] = union(*boxes[children[k]])
    return boxes


def topology(
    structure: BVH, boxes: np.ndarray, children: np.ndarray, colour: Colour
) -> list[Lines]:
    """Return a treelet as a tree drawn beside the model; the height of a node is its area."""
    count = len(children) + 1
    areas = surface_area(boxes)
    heights = areas / (areas[count] or 1.0)
    # Leaves from left to right as the tree has them.
    order, todo = [], [count]
    while todo:
        number = todo.pop()
        if number < count:
            order.append(number)
        else:
            todo += children[number - count][::-1].tolist()
    x = np.empty(len(boxes))
    x[order] = np.arange(count) / (count - 1)
    for k in range(count - 2, -1, -1):
        x[count + k] = x[children[k]].mean()
    scene = structure.scene
    size = extent(np.concatenate([scene.lower, scene.upper]))
    middle = 0.5 * (scene.lower + scene.upper)
    corner = np.array([scene.upper[0] + 1.1 * size, middle[1], middle[2] - 0.3 * size])
    across, upwards = np.array([0.6 * size, 0.0, 0.0]), np.array([0.0, 0.0, 0.6 * size])
    chart = Chart(corner, across, upwards, 0.0, 1.0, 1.0)
    links = []
    for k, pair in enumerate(children.tolist()):
        for child in pair:
            corners = chart.points(
                x[[count + k, child, child]], heights[[count + k, count + k, child]]
            )
            links += [corners[:2], corners[1:]]
    marks = [chart.mark(x[n], heights[n], GREY) for n in range(count)]
    return [chart.axes(), *marks, coloured(np.array(links), colour)]
