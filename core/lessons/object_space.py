"""The space of a mesh, drawn upright beside the scene: what lies in it is stored there once."""

from __future__ import annotations

import numpy as np

from ..contract.cells import Cells
from ..geometry.box_shape import box_segments
from ..geometry.instances import lines_of_items
from ..geometry.triangles import Triangles
from ..scene import Scene
from ..structures.two_level import TwoLevel
from .drawing import GREY, Faces, Lines, coloured, extent_of, faint, some_of, tinted
from .picture import Mark

APART = 0.25
"""Between the scene and what stands beside it, in lengths of the scene."""

LARGE = 0.8
"""How large the longest side of a mesh is drawn, in lengths of the scene's."""

MOST_TRIANGLES = 2500
"""Of a mesh that are drawn."""


def is_two_level(structure: object) -> str:
    """Accept two levels, see :attr:`.lesson.Lesson.suits`."""
    return "" if isinstance(structure, TwoLevel) else "it has no two levels"


class ObjectSpace:
    """The space of a mesh, as it stands beside a scene.

    Attributes
    ----------
    mesh : NamedTuple of arrays
    cells : Cells
        Of its structure.
    """

    def __init__(self, scene: Scene, structure: TwoLevel, mesh: object) -> None:
        self.mesh = mesh
        self.cells: Cells = structure.bottom_of(mesh).cells().own()
        box = np.concatenate(
            [self.cells.boxes[:, :3].min(axis=0), self.cells.boxes[:, 3:].max(axis=0)]
        )
        size = extent_of(scene)
        self.scale = LARGE * size / (float((box[3:] - box[:3]).max()) or 1.0)
        middle = 0.5 * (scene.lower + scene.upper)
        corner = np.array([scene.upper[0] + APART * size, middle[1], 0.0])
        centre = 0.5 * (box[:3] + box[3:])
        self.shift = corner - self.scale * np.array([box[0], centre[1], 0.0])
        self.shift[2] = scene.lower[2] - self.scale * box[2]
        self.box = box

    def points(self, points: np.ndarray) -> np.ndarray:
        """Return where points of the mesh's space, (..., 3), are drawn."""
        return self.shift + self.scale * points

    def boxes(self, boxes: np.ndarray) -> np.ndarray:
        """Return the edges of boxes, (n, 6), as they are drawn, (12 n, 2, 3)."""
        return self.points(box_segments(boxes))

    def items(self, opacity: float = 0.12) -> Lines | Faces:
        """Return some of what the mesh consists of, faint."""
        numbers = some_of(np.arange(len(self.mesh.ids)), MOST_TRIANGLES)  # type: ignore[attr-defined]
        if isinstance(self.mesh, Triangles):
            return tinted(self.points(self.mesh.corners[numbers]), GREY, opacity)
        return coloured(self.points(lines_of_items(self.mesh, numbers)), faint(GREY))

    def name(self, text: str) -> Mark:
        """Return a text above it."""
        top = np.array([self.box[0], self.box[1], self.box[5] + 0.05 / self.scale])
        return Mark(self.points(top), text)
