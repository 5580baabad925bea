"""Exhibit "split planes": candidate planes of the root with their figures and a curve of cost.

The curve stands along the axis that the planes cut, so that every plane is above (or beside) its
own cost. Orange: the halves of the space, as on the slide "SAH decision". Blue: boxes drawn tight
around the items of both sides, as builders count. Grey: what testing all of them costs.
"""

from __future__ import annotations

import numpy as np

from ..contract.cells import planes_across
from ..geometry.box_shape import box_segments
from ..geometry.instances import lines_of_items
from ..progress import SILENT, Progress
from ..sah.split_plane import (
    SortedAxis,
    SplitPlane,
    evaluate_plane,
    evaluate_planes,
    halves_of,
    sort_along,
    tight_costs,
)
from ..sah.worked_example import PRINTED, T_TRA, T_TRI, Case, cases_of, is_worked_example
from ..scene import Scene
from ..structures.bvh.hierarchy import BVH
from .drawing import BLUE, GREY, ORANGE, RED, Chart, Lines, coloured, frame_of, outlines
from .exhibit import Exhibit, Frame, Once

MOST_ITEMS = 4000
"""Items up to which each is drawn in the colour of its side."""

SAMPLES = 240
"""Positions at which the curve is evaluated."""

CHART = 0.4
"""Height of the chart, as a share of the longest side of the scene."""


def split_planes(structure: BVH) -> Exhibit:
    """Return the exhibit; of the worked example its cases come first."""
    scene, settings = structure.scene, structure.settings
    box = np.concatenate([scene.lower, scene.upper])
    costs = settings.C_trav, settings.C_isect
    cases: list[Case] = []
    if is_worked_example(len(scene), box):
        cases = cases_of(scene.boxes(), box)
    places = [
        (axis, float(box[axis] + share * (box[3 + axis] - box[axis])))
        for axis in range(3)
        if box[3 + axis] > box[axis]
        for share in np.arange(1, settings.bins) / settings.bins
    ]
    # Of each axis the plane in its middle.
    middles = tuple(range((settings.bins - 1) // 2, len(places), settings.bins - 1))

    def sorting(axis: int) -> Once[SortedAxis]:
        return Once(lambda progress: sort_along(scene.boxes(), axis, progress))

    axes = [sorting(axis) for axis in range(3)]

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        if number < len(cases):
            return frame_of_case(scene, box, cases[number])
        axis, position = places[number - len(cases)]
        return frame_of_plane(scene, axes[axis](progress), box, position, *costs)

    return Exhibit(
        "split_planes",
        "Split Planes",
        "Candidate planes of the root: N_L, N_R, p_L, p_R and Cost, and the curve of cost",
        len(cases) + len(places),
        frame,
        on_page=tuple(range(len(cases))) or middles,
    )


def frame_of_plane(
    scene: Scene,
    along: SortedAxis,
    box: np.ndarray,
    position: float,
    C_trav: float,
    C_isect: float,
) -> Frame:
    """Return the picture of one plane: both halves, and where it is on the curve of its axis.

    Parameters
    ----------
    along : SortedAxis
        The scene's items, sorted along the axis that the plane cuts.
    box : (6,) float64
        What is divided.
    """
    plane = evaluate_plane(along, box, position, C_trav, C_isect)
    planes = evaluate_planes(along, box, np.array([position]), C_trav, C_isect)
    tight = float(tight_costs(along, box, planes, C_trav, C_isect)[0])
    axis = "xyz"[plane.axis]
    caption = f"{axis} = {position:.5g}: {figures_of(plane)}, Cost = {plane.cost:.2f}; "
    if np.isfinite(tight):
        caption += f"with tight boxes {tight:.2f}; "
    caption += f"no split {C_isect * len(scene):.2f} (C_trav {C_trav:g}, C_isect {C_isect:g})"
    parts = [
        *drawn_halves(scene, box, plane),
        *drawn_curve(along, box, plane, C_trav, C_isect),
    ]
    return frame_of(parts, caption)


def frame_of_case(scene: Scene, box: np.ndarray, case: Case) -> Frame:
    """Return the picture of one case of the worked example; `box` is all of V."""
    parts = [coloured(box_segments(box[None]), GREY)]
    divided = case.box
    for plane in case.planes:
        parts += drawn_halves(scene, divided, plane)
        divided = halves_of(divided, plane.axis, plane.position)[1]  # where a second plane goes on
    caption = (
        f"Cost({case.name}) = {case.formula} = {case.cost:.2f}; "
        f"the slide prints {PRINTED[case.name]:.1f} (t_tra {T_TRA:g}, t_tri {T_TRI:g})"
    )
    if len(case.planes) == 1:
        (plane,) = case.planes
        boxes = scene.boxes()
        along = sort_along(boxes[inside(boxes, case.box)], plane.axis)
        parts += drawn_curve(along, case.box, plane, T_TRA, T_TRI)
        caption = f"{figures_of(plane)}; {caption}"
    return frame_of(parts, caption)


def figures_of(plane: SplitPlane) -> str:
    """Return the figures of a plane as the slide writes them."""
    return f"N_L = {plane.N_L}, N_R = {plane.N_R}, p_L = {plane.p_L:.2f}, p_R = {plane.p_R:.2f}"


def inside(boxes: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Return which items have the centroid of their box in a box, (n,) bool."""
    centroids = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    return ((centroids >= box[:3]) & (centroids <= box[3:])).all(axis=1)


def drawn_halves(scene: Scene, box: np.ndarray, plane: SplitPlane) -> list[Lines]:
    """Return the halves of a box and the items in them, left blue, right orange; the plane."""
    left, right = halves_of(box, plane.axis, plane.position)
    parts = [coloured(box_segments(left[None]), BLUE), coloured(box_segments(right[None]), ORANGE)]
    if len(scene) <= MOST_ITEMS:
        boxes = scene.boxes()
        on_left = 0.5 * (boxes[:, plane.axis] + boxes[:, 3 + plane.axis]) < plane.position
        there = inside(boxes, box)
        for side, colour in ((there & on_left, BLUE), (there & ~on_left, ORANGE)):
            lines = lines_of_items(scene.geometry, np.flatnonzero(side))
            parts.append(coloured(lines, colour))
    cut = planes_across(box[None], plane.axis, np.array([plane.position]))
    diagonals = cut[0, [[0, 2], [1, 3]]]
    return [*parts, coloured(np.concatenate([outlines(cut), diagonals]), RED)]


def drawn_curve(
    along: SortedAxis, box: np.ndarray, plane: SplitPlane, C_trav: float, C_isect: float
) -> list[Lines]:
    """Return the curve of cost over all planes of the axis, with this one marked."""
    axis, low, high = plane.axis, box[:3], box[3:]
    positions = np.linspace(low[axis], high[axis], SAMPLES)
    planes = evaluate_planes(along, box, positions, C_trav, C_isect)
    halves, tight = planes.cost, tight_costs(along, box, planes, C_trav, C_isect)
    unsplit = C_isect * len(along.centroids)
    top = max(float(halves.max()), float(tight[np.isfinite(tight)].max(initial=unsplit)))

    # Below the model for planes across x and y, to its right for those across z.
    size = float((high - low).max())
    outwards = np.array([1.0, 0.0, 0.0]) if axis == 2 else np.array([0.0, 0.0, 1.0])
    corner = np.array([high[0], low[1], low[2]])
    corner[axis] = low[axis]
    corner += size * (0.1 if axis == 2 else -0.1 - CHART) * outwards
    across = (high[axis] - low[axis]) * np.eye(3)[axis]
    chart = Chart(corner, across, CHART * size * outwards, low[axis], high[axis], top)
    return [
        chart.axes(),
        chart.level(unsplit, GREY),
        chart.curve(positions, tight, BLUE),
        chart.curve(positions, halves, ORANGE),
        chart.mark(plane.position, plane.cost, RED),
    ]
