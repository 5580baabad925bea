"""Lesson "ray space with time": the sixth dimension, over objects that move.

The slide "5D ray space" has a variant with one more quantity, the time. Here every object moves up
or down, each at a speed of its own, and rays go straight to the right, from heights z at times t.
So what of the cells of :mod:`..structures.ray_classification` they can come to is a picture of z
and t, in which an object at rest would be upright, and one that moves leans. A cell is an interval
of times, too, and lists what reaches into its beam then, not what passes it some time.

M. Quail: Space Time Ray-Tracing Using Ray Classification, thesis, Macquarie University, 1996.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.rays import Rays
from ..geometry.solids.description import MovingTriangle
from ..geometry.triangles import Triangles
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.ray_classification import RayClassification, RayClassificationSettings
from ..structures.ray_classification.ray_space import TIME, Z
from .drawing import (
    GREEN,
    GREY,
    coloured,
    counted,
    faint,
    outlines,
    picture_of,
    some_of,
    tinted,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Picture
from .ray_space import RAYS, FlatRaySpace, cut_of_triangle, rays_in_plane

MOST_MOVING = 2000
"""Objects that move; of more, so many are evenly chosen."""

FARTHEST = 0.3
"""How far one moves at most, in heights of the scene."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    dimensions: str = setting(
        "6", "Dimensions", "Whether cells are intervals of times, too",
        choices={"5": "Cells have all times", "6": "Cells are divided by time as well"},
    )  # fmt: skip
    max_list_size: int = setting(
        2, "Max List Size", "A cell is divided if it lists more objects", unit="objects",
        minimum=1, maximum=1000,
    )  # fmt: skip
    cell: int = setting(0, "Cell", "Which cell: that with the most rays is the first", minimum=0)


class Times(FlatRaySpace):
    """Rays straight to the right in a plane, with z and the time."""

    UP = TIME

    def __init__(self, structure: RayClassification, moving: Moving, rays: Rays) -> None:
        self.moving = moving
        super().__init__(structure, rays)

    def lines(self, item: int, up: np.ndarray) -> np.ndarray | None:
        """Return the lines z = p_z + t s_z."""
        ends = cut_of_triangle(self.moving.corners[item], self.y)
        return None if ends is None else ends[:, 1:] + up * self.moving.shifts[item]

    def at(self, items: np.ndarray, time: float) -> np.ndarray:
        """Return where items are at a time, (k, 3, 3)."""
        corners = self.moving.corners[items].copy()
        corners[:, :, 2] += time * self.moving.shifts[items, None]
        return corners

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one cell."""
        chart, cell = self.chart(), int(self.cells[self.order[settings.cell]])
        low, high = self.structure.known.bounds[cell]
        listed = self.candidates(cell)
        middle = 0.5 * (low[TIME] + high[TIME])
        begin, end = (self.at(listed, time) for time in (low[TIME], high[TIME]))
        parts = [
            coloured(outlines(self.at(np.arange(len(self.scene)), middle)), faint(GREY, 0.5)),
            *self.on_chart(chart, cell, self.rays.times),
            *self.in_scene(cell, 0.0, 0.0),
            tinted(begin, GREEN, 0.2),
            tinted(end, GREEN, 0.55),
            coloured(np.stack([begin, end], axis=2).reshape(-1, 2, 3), faint(GREEN, 0.6)),
        ]
        caption = (
            f"Rays from z = {low[Z]:.3g} to {high[Z]:.3g}, from time {low[TIME]:.3g} to "
            f"{high[TIME]:.3g}, may hit {counted(len(listed), 'object', 'objects')} of "
            f"{len(self.scene)}; they are drawn where they begin and end to be in that time"
        )
        marks = chart.named("z: where a ray begins", "time, from 0 to 1")
        return picture_of(parts, caption, marks=marks, rows=self.rows(cell))


class Moving:
    """Triangles that move along z, each at a speed of its own.

    Attributes
    ----------
    corners : (n, 3, 3) float64
        At time 0.
    shifts : (n,) float64
        Along z, until time 1.
    """

    def __init__(self, scene: Scene) -> None:
        if not isinstance(scene.geometry, Triangles):
            scene.refuse_other_items("this lesson is played")
        some = some_of(np.arange(len(scene)), MOST_MOVING)
        self.corners = scene.geometry.corners[some]
        speeds = np.random.default_rng(3).uniform(-1.0, 1.0, len(some))
        self.shifts = FARTHEST * float(scene.upper[2] - scene.lower[2]) * speeds

    def scene(self, name: str) -> Scene:
        """Return them as a scene."""
        ends = self.corners + self.shifts[:, None, None] * np.array([0.0, 0.0, 1.0])
        pairs = zip(self.corners, ends, strict=True)
        return Scene.from_items([MovingTriangle(*pair) for pair in pairs], name)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Let the scene's triangles move, and send rays, which make the cells that they need."""
    progress.report(0, 1, "Sending rays")
    moving = Moving(subject.scene)
    scene = moving.scene(subject.scene.name)
    chosen = RayClassificationSettings(
        dimensions=settings.dimensions, max_list_size=settings.max_list_size, min_rays=4,
        truncate=False,
    )  # fmt: skip
    structure = RayClassification.build(scene, chosen, progress)
    times = np.random.default_rng(2).random(RAYS)
    return Times(structure, moving, rays_in_plane(scene, np.zeros(RAYS), times))


LESSONS = (
    Lesson(
        name="ray_space_time",
        label="Ray Space with Time",
        slide="5D ray space",
        begin="In an animation a ray has a time, too. That is a sixth dimension of ray space, "
        "across which cells are divided as across the others",
        look_for="Strips lean, for their objects move. With five dimensions a cell has all times, "
        "and lists whatever passes its beam some time; with six, what reaches into it then",
        question="A cell may be divided by where rays begin, where they go, or when. Where does "
        "time not pay?",
        answer="For objects at rest: their strips are upright, and both halves list the same",
        source="structures.ray_classification.making",
        sample="nonuniform",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="cell",
        replays=("dimensions", "max_list_size"),
    ),
)
