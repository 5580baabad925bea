"""Lesson "split_plane": a plane under a slider, and its cost as on the slide "SAH decision".

    Cost(V -> {L, R}) = t_tra + t_tri (SA(V_L) / SA(V) N_L + SA(V_R) / SA(V) N_R)

The children are the halves of the space, as on the slide (:mod:`..sah.split_plane`). The curve has
the cost of all planes across the same axis and stands along that axis, below the model or to its
right, so that every plane is above or beside its own cost.

Blue and orange: what is left and right of the plane, and in the chart, blue, what planes cost if
the boxes are drawn tight around the items of both sides, as builders count. Orange in the chart:
the halves of the space. Red: the plane, and its cost. Grey: what testing all items costs.

Moving the plane sorts nothing: the items are sorted along all three axes when the lesson begins.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..geometry.box_shape import box_segments
from ..geometry.geometry import lines_of
from ..geometry.instances import Instanced
from ..progress import Progress
from ..sah.split_plane import (
    SortedAxis,
    SplitPlane,
    evaluate_plane,
    evaluate_planes,
    halves_of,
    sort_along,
    tight_costs,
)
from ..sah.worked_example import T_TRA, T_TRI
from ..scene import Scene
from ..settings import setting
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    RED,
    Chart,
    Colour,
    Faces,
    Lines,
    coloured,
    column,
    cut_across,
    picture_of,
    solid,
    some_of,
)
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

MOST_ITEMS = 1500
"""Items that are drawn in the colour of their side, evenly chosen."""

SAMPLES = 240
"""Positions at which the curve is evaluated."""

CHART = 0.4
"""Height of the chart, as a share of the longest side of the scene."""

AXES = {"x": "Across x", "y": "Across y", "z": "Across z"}


@dataclass(frozen=True)
class Settings:
    """Where the plane is, and the constants of the cost."""

    axis: str = setting("x", "Axis", "Across which axis the plane lies", choices=AXES)
    position: float = setting(
        0.5,
        "Position",
        "Place of the plane, as a share of the scene's extent along the axis",
        minimum=0.0,
        maximum=1.0,
    )
    t_tra: float = setting(
        T_TRA,
        "t_tra",
        "Cost of one traversal step, in the unit of t_tri",
        minimum=0.0,
        maximum=1e9,
    )
    t_tri: float = setting(
        T_TRI,
        "t_tri",
        "Cost of one ray-triangle test, in the unit of t_tra",
        minimum=0.0,
        maximum=1e9,
    )


@dataclass(frozen=True)
class ItemLines:
    """Some items of a scene as lines.

    Attributes
    ----------
    segments : (k, 2, 3) float64
    centroids : (k, 3) float64
        The middle of the box of what each belongs to: it decides on which side that is.
    """

    segments: np.ndarray
    centroids: np.ndarray

    @classmethod
    def of(cls, scene: Scene, most: int = MOST_ITEMS) -> ItemLines:
        """Return items of a scene, evenly chosen if there are more than so many."""
        items = some_of(np.arange(len(scene)), most)
        if isinstance(scene.geometry, Instanced):
            segments = box_segments(scene.geometry.boxes[items])
            owners = np.repeat(np.arange(len(items)), 12)
        else:
            segments, owners = lines_of(scene.geometry, items)
        boxes = scene.boxes()[items]
        return cls(segments, (0.5 * (boxes[:, :3] + boxes[:, 3:]))[owners])

    def inside(self, box: np.ndarray) -> np.ndarray:
        """Return which belong to items with their centroid in a box, (k,) bool."""
        return ((self.centroids >= box[:3]) & (self.centroids <= box[3:])).all(axis=1)


def picture_of_plane(
    lines: ItemLines,
    scene: Scene,
    along: SortedAxis,
    position: float,
    t_tra: float,
    t_tri: float,
) -> Picture:
    """Return the picture of one plane: both halves, and where it is on the curve of its axis.

    Parameters
    ----------
    along : SortedAxis
        The scene's items, sorted along the axis that the plane cuts.
    """
    box = np.concatenate([scene.lower, scene.upper])
    plane = evaluate_plane(along, box, position, t_tra, t_tri)
    planes = evaluate_planes(along, box, np.array([position]), t_tra, t_tri)
    tight = float(tight_costs(along, box, planes, t_tra, t_tri)[0])
    axis = "xyz"[plane.axis]
    caption = f"{axis} = {position:.5g}: {figures_of(plane)}, Cost = {plane.cost:.2f}; "
    if np.isfinite(tight):
        caption += f"with tight boxes {tight:.2f}; "
    caption += f"no split {t_tri * len(scene):.2f} (t_tra {t_tra:g}, t_tri {t_tri:g})"
    curve, beside = drawn_curve(along, box, plane, t_tra, t_tri)
    rows = [
        Row(axis, f"{position:.5g}", "Place of the plane, in scene units"),
        *rows_of(plane),
        Row("Cost with Tight Boxes", f"{tight:.2f}" if np.isfinite(tight) else "no split",
            "What a builder counts: boxes drawn around the items of both sides"),
        Row("Cost(V)", f"{t_tri * len(scene):.1f}", "Without a split: t_tri N"),
    ]  # fmt: skip
    return picture_of(
        [*drawn_halves(lines, box, plane), *curve],
        caption,
        marks=[*column(scene, texts_of(plane)), *beside],
        rows=rows,
    )


def figures_of(plane: SplitPlane) -> str:
    """Return the figures of a plane as the slide writes them."""
    return f"N_L = {plane.N_L}, N_R = {plane.N_R}, p_L = {plane.p_L:.2f}, p_R = {plane.p_R:.2f}"


def rows_of(plane: SplitPlane) -> list[Row]:
    """Return the figures of a plane, by the names on the slide."""
    return [
        Row("N_L", str(plane.N_L), "Items to the left: with a lower centroid"),
        Row("N_R", str(plane.N_R), "Items to the right of the plane, or with a centroid in it"),
        Row("p_L", f"{plane.p_L:.2f}", "SA(V_L) / SA(V)"),
        Row("p_R", f"{plane.p_R:.2f}", "SA(V_R) / SA(V)"),
        Row("Cost(V -> {L, R})", f"{plane.cost:.1f}", "t_tra + t_tri (p_L N_L + p_R N_R)"),
    ]


def texts_of(plane: SplitPlane, name: str = "") -> list[tuple[str, Colour]]:
    """Return the figures of a plane and their colours, each on a line."""
    return [
        (f"N_L = {plane.N_L}   p_L = {plane.p_L:.2f}", BLUE),
        (f"N_R = {plane.N_R}   p_R = {plane.p_R:.2f}", ORANGE),
        (f"Cost{name} = {plane.cost:.1f}", RED),
    ]


def drawn_halves(lines: ItemLines, box: np.ndarray, plane: SplitPlane) -> list[Lines | Faces]:
    """Return the halves of a box and the items in them, left blue, right orange; the plane."""
    halves = halves_of(box, plane.axis, plane.position)
    there = lines.inside(box)
    on_left = lines.centroids[:, plane.axis] < plane.position
    parts: list[Lines | Faces] = []
    for half, side, colour in zip(halves, (on_left, ~on_left), (BLUE, ORANGE), strict=True):
        parts += solid(half[None], colour, 0.1)
        parts.append(coloured(lines.segments[there & side], colour))
    return [*parts, *cut_across(box, plane.axis, plane.position)]


def drawn_curve(
    along: SortedAxis, box: np.ndarray, plane: SplitPlane, t_tra: float, t_tri: float
) -> tuple[list[Lines], list[Mark]]:
    """Return the curve of cost over all planes of the axis, with this one marked."""
    axis, low, high = plane.axis, box[:3], box[3:]
    positions = np.linspace(low[axis], high[axis], SAMPLES)
    planes = evaluate_planes(along, box, positions, t_tra, t_tri)
    halves, tight = planes.cost, tight_costs(along, box, planes, t_tra, t_tri)
    unsplit = t_tri * len(along.centroids)
    top = max(float(halves.max()), float(tight[np.isfinite(tight)].max(initial=unsplit)))

    # Below the model for planes across x and y, to its right for those across z.
    size = float((high - low).max()) or 1.0
    outwards = np.array([1.0, 0.0, 0.0]) if axis == 2 else np.array([0.0, 0.0, 1.0])
    corner = np.array([high[0], low[1], low[2]])
    corner[axis] = low[axis]
    corner += size * (0.1 if axis == 2 else -0.1 - CHART) * outwards
    across = (high[axis] - low[axis]) * np.eye(3)[axis]
    chart = Chart(corner, across, CHART * size * outwards, low[axis], high[axis], top)
    lines = [
        chart.axes(),
        chart.level(unsplit, GREY),
        chart.curve(positions, tight, BLUE),
        chart.curve(positions, halves, ORANGE),
        chart.mark(plane.position, plane.cost, RED),
    ]
    place = chart.place(high[axis], unsplit)
    if axis == 2:  # to the right of it nothing is seen any more
        place = corner - 0.07 * size * np.eye(3)[2]
    marks = [Mark(place, f"no split: {unsplit:.6g}")]
    return lines, marks


class SplitPlaneOfScene(Play):
    """All planes of a scene: its items, sorted along all axes."""

    def __init__(self, scene: Scene, progress: Progress) -> None:
        self.scene = scene
        boxes = scene.boxes()
        self.axes = [sort_along(boxes, axis, progress) for axis in range(3)]
        self.lines = ItemLines.of(scene)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one plane."""
        along = self.axes[list(AXES).index(settings.axis)]
        low, high = self.scene.lower[along.axis], self.scene.upper[along.axis]
        position = float(low + settings.position * (high - low))
        costs = settings.t_tra, settings.t_tri
        return picture_of_plane(self.lines, self.scene, along, position, *costs)

    def on_page(self, lesson: Lesson, settings: Settings) -> list[Any]:
        """Return a plane a quarter of the way, then the cheapest across every axis."""
        box = np.concatenate([self.scene.lower, self.scene.upper])
        chosen = [dataclasses.replace(settings, position=0.25)]
        for name, along in zip(AXES, self.axes, strict=True):
            shares = np.linspace(0.0, 1.0, SAMPLES)
            low, high = box[along.axis], box[3 + along.axis]
            positions = low + shares * (high - low)
            planes = evaluate_planes(along, box, positions, settings.t_tra, settings.t_tri)
            share = float(shares[np.argmin(planes.cost)])
            chosen.append(dataclasses.replace(settings, axis=name, position=share))
        return chosen


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Sort the items of the scene along every axis."""
    return SplitPlaneOfScene(subject.scene, progress)


LESSONS = (
    Lesson(
        name="split_plane",
        label="A Split Plane under a Slider",
        slide="SAH decision",
        begin="Every plane that cuts a volume has a cost, and the curve of it has a lowest point",
        look_for="Move the plane: areas change steadily, counts jump from item to item, and the "
        "cost is low where much empty space is cut off",
        question="Where is the cheapest plane if the items are spread evenly, and what happens to "
        "it if most of them gather on one side?",
        answer="Evenly spread items make the curve a parabola with its lowest point in the middle. "
        "If they gather, the plane moves towards them, so that many items get a small volume, and "
        "the large one is left with few",
        source="sah.split_plane",
        sample="suzanne:subdivisions=1",
        Settings=Settings,
        play=play,
        film="position",
    ),
)
