"""Exhibits of rearranged trees: reinsertions, treelets, and how the cost falls.

They show moves of the build log, those with the greatest gains, the greatest first. How the tree
was at that time comes from making the moves of the log again, from the tree as it was built
(:mod:`..structures.bvh.optimisers.replay`).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from ..contract.build_log import MOVE, REINSERT, BuildLog
from ..geometry.box_shape import box_segments, surface_area
from ..progress import SILENT, Progress
from ..scene import Scene
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.optimisers.rearranging import Rearrangement
from ..structures.bvh.optimisers.replay import Replay
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Chart, Colour, Lines, coloured, frame_of
from .exhibit import Exhibit, Frame, Once

MOST_MOVES = 24
"""Moves that are shown."""

TEXT = "Making the moves of the log again"

OUTWARDS = np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
"""Added to a box, moves all its sides outwards."""


def rearranging_exhibits(structure: BVH, log: BuildLog) -> list[Exhibit]:
    """Return what there is to show of a tree that was rearranged.

    Where the tree as built was kept, since it is cheaper with its leaves, the log has no moves.
    """
    done = structure.rearrangement
    if done is None:
        return []
    found = [cost_over_steps(structure, done)]
    made = int((np.isin(log.kind, (MOVE, REINSERT)) & ~np.isnan(log.cost)).sum())
    if made and structure.settings.optimise.startswith("reinsert"):
        found.append(reinsertions(structure, log, made))
    if made and structure.settings.optimise.startswith("treelet"):
        found.append(treelets(structure, log, made))
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
        caption = (
            f"{optimise}, step {last} of {len(costs) - 1}: SAH cost {shown[-1]:.2f}, "
            f"{100.0 * fallen:.1f}% less than the {costs[0]:.2f} as built (grey); "
            "one triangle a leaf, the axis begins at 0"
        )
        if not structure.figures["optimise_pays"]:
            caption += "; with its leaves the tree as built costs less, and was kept"
        return frame_of(parts, caption)

    return Exhibit(
        "cost_over_steps",
        "Cost over Steps",
        "How the cost of the tree falls while it is rearranged",
        len(ends),
        frame,
    )


T = TypeVar("T")


def replayed(
    bvh: BVH, log: BuildLog, look: Callable[[Replay, int, Progress], T], progress: Progress
) -> list[T]:
    """Return what a look at each of the greatest moves has found, the greatest first.

    Parameters
    ----------
    look : callable
        Gets the tree before a move, and the number of that; it may make the move.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    progress.report(0, 1, TEXT)
    replay = Replay(log, bvh.reference_boxes())
    greatest = np.argsort(-replay.gains, kind="stable")[:MOST_MOVES]
    found = {}
    for number in np.sort(greatest).tolist():
        replay.go_on(int(replay.moves[number, 0]), progress, TEXT)
        found[number] = look(replay, number, progress)
    return [found[number] for number in greatest.tolist()]


class Reinsertion(NamedTuple):
    """A node that was cut off and hung elsewhere.

    Attributes
    ----------
    number : int
        Moves that were made before.
    gain : float
    node, old_parent, old_sibling : (6,) float64
        Boxes before it was cut off.
    new_sibling : (6,) float64
        The box while it was cut off: that of a node above it has shrunk.
    """

    number: int
    gain: float
    node: np.ndarray
    old_parent: np.ndarray
    old_sibling: np.ndarray
    new_sibling: np.ndarray


def look_at_reinsertion(replay: Replay, number: int, progress: Progress) -> Reinsertion:
    """Make a reinsertion, and return what it was."""
    tree, (first, behind) = replay.tree, replay.moves[number].tolist()
    node, (place, old_sibling) = replay.node[first], replay.children[first]
    own, above, beside = tree.boxes[[node, tree.parent[node], old_sibling]]
    replay.go_on(behind, progress, TEXT)
    gain, new_sibling = float(replay.gains[number]), tree.boxes[place].copy()
    return Reinsertion(number, gain, own, above, beside, new_sibling)


def reinsertions(structure: BVH, log: BuildLog, made: int) -> Exhibit:
    """Return the reinsertions that gained most, two frames each: before and after."""
    root = coloured(box_segments(structure.arrays.volumes.boxes()[:1]), GREY)
    shown = min(made, MOST_MOVES)

    @Once
    def moves(progress: Progress) -> list[Reinsertion]:
        return replayed(structure, log, look_at_reinsertion, progress)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        move, is_after = moves(progress)[number // 2], number % 2 == 1
        new_parent = union(move.node, move.new_sibling)
        parent, colour = (new_parent, GREEN) if is_after else (move.old_parent, RED)
        whole = union(move.old_parent, new_parent)

        def parts(margin: float) -> list[Lines]:
            # Around the others by a margin, a parent is not hidden by them.
            return [
                around(parent + margin * OUTWARDS, colour), around(move.old_sibling, GREY),
                around(move.new_sibling, BLUE), around(move.node, ORANGE),
            ]  # fmt: skip

        copy = enlarged(parts(0.02 * extent(whole)), whole, structure.scene)
        verb = "fell" if is_after else "will fall"
        caption = (
            f"Reinsertion {move.number + 1} of {made}, {'after' if is_after else 'before'}: "
            f"the node (orange) and its {'new' if is_after else 'old'} parent "
            f"({'green' if is_after else 'red'}), {share(structure, parent)}; its old sibling "
            f"(grey) and its new one (blue). The cost {verb} by {move.gain:.3g}"
        )
        return frame_of([root, *parts(0.0), *copy], caption)

    return Exhibit(
        "reinsertions",
        "Reinsertions",
        f"Where nodes were moved to: the {shown} reinsertions that gained most",
        2 * shown,
        frame,
    )


class Restructured(NamedTuple):
    """A treelet that was given another tree; numbers as in :class:`..treelet.Treelet`.

    Attributes
    ----------
    number : int
        Moves that were made before.
    gain : float
    leaves : (k, 6) float64
        Boxes.
    children : (2, k - 1, 2) int64
        Of each inner node, the root first, before and after.
    """

    number: int
    gain: float
    leaves: np.ndarray
    children: np.ndarray


def look_at_treelet(replay: Replay, number: int, progress: Progress) -> Restructured:
    """Return what becomes of a treelet."""
    tree, (first, behind) = replay.tree, replay.moves[number].tolist()
    inner, after = replay.node[first:behind], replay.children[first:behind]
    before = np.stack([tree.left[inner], tree.right[inner]], axis=1)
    leaves = np.setdiff1d(before, inner)
    names = np.concatenate([leaves, inner])
    order = np.argsort(names)
    children = order[np.searchsorted(names[order], np.stack([before, after]))]
    return Restructured(number, float(replay.gains[number]), tree.boxes[leaves].copy(), children)


def treelets(structure: BVH, log: BuildLog, made: int) -> Exhibit:
    """Return the treelets that gained most, two frames each: before and after."""
    shown = min(made, MOST_MOVES)

    @Once
    def moves(progress: Progress) -> list[Restructured]:
        return replayed(structure, log, look_at_treelet, progress)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        move, is_new = moves(progress)[number // 2], number % 2
        leaves, children = move.leaves, move.children[is_new]
        count = len(leaves)
        boxes = boxes_of_treelet(leaves, children)
        inner = boxes[count + 1 :]
        parts = [coloured(box_segments(leaves), GREY), around(boxes[count], BLUE)]
        parts += [coloured(box_segments(inner), GREEN if is_new else RED)]
        root = float(surface_area(structure.arrays.volumes.boxes()[0])) or 1.0
        areas = surface_area(inner).sum() / root
        caption = (
            f"Treelet {move.number + 1} of {made}, {'after' if is_new else 'before'}: "
            f"{count} leaves (grey), root (blue), {count - 2} inner nodes "
            f"({'green' if is_new else 'red'}) with {areas:.4g} times the area of the scene's box. "
            f"The cost {'fell' if is_new else 'will fall'} by {move.gain:.3g}; "
            "right: the tree, the height of a node is its area"
        )
        diagram = topology(structure, boxes, children, GREEN if is_new else RED)
        copy = enlarged(parts, boxes[count], structure.scene)
        return frame_of([*parts, *copy, *diagram], caption)

    return Exhibit(
        "treelets",
        "Treelets",
        f"Treelets before and after: the {shown} that gained most, and their trees",
        2 * shown,
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
