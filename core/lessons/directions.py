"""Cells of directional structures as lessons draw them: squares of a cube, pyramids, footprints.

All of it is read from the structure: where a cell lies, what it lists and in which order, and
what its insertion knows of an item in a face.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..colours import count_colours
from ..contract.structure import Structure
from ..geometry.rays import Rays
from ..progress import Progress
from ..scene import SUN, Camera, Light, Scene
from ..scene.camera_rays import camera_rays, framing_camera
from ..scene.light import point_lights
from ..scene.shadow_rays import shadow_rays
from ..settings import setting
from ..structures.directional.projection import (
    OUTLINE,
    U0,
    U1,
    V0,
    V1,
    Footprints,
    footprints_of,
)
from ..structures.directional.settings import ADAPTIVE, UNIFORM
from ..structures.directional.structure import Directional
from .drawing import GREEN, GREY, Colour, Faces, Lines, coloured, halves, opaque, outlines, tinted
from .picture import Mark

BESIDE = np.array([-0.7, -0.2, 0.1])
"""Where a light of the lessons' own is: from the scene's middle, in its diagonals; to the left, so
that its cells are seen from the front right."""

NEAR = 1.5
"""A light of the scene is taken that is no farther from the middle, in diagonals."""

MOST_CELLS = 1200
"""Cells that are drawn of a cube; of more, those that they are parts of."""

MOST_NUMBERED = 9
"""Items of a list that have their number beside them."""

COLUMNS, ROWS = 96, 72
"""Rays of the picture from whose hits the shadow rays of a lesson start."""


def division_setting(whole: str, parts: str) -> Any:
    """Declare how a lesson's cells are divided: of what, and into what if all are equal."""
    return setting(
        ADAPTIVE,
        "Division",
        f"How {whole} is divided into cells",
        choices={
            ADAPTIVE: "Into four, again and again, where lists are long",
            UNIFORM: f"Into equal {parts}",
        },
    )


def cells_setting(cells: int, along: str, maximum: int) -> Any:
    """Declare how many cells there are in a row if all are equal."""
    return setting(
        cells, "Cells", f"Cells along {along}", unit="cells", minimum=1, maximum=maximum,
        only_for={"division": [UNIFORM]},
    )  # fmt: skip


def longest_setting(longest: int) -> Any:
    """Declare how long a list may be whose cell is not divided."""
    return setting(
        longest, "Max List Size", "A cell is divided if more objects are listed", unit="objects",
        minimum=1, maximum=64, only_for={"division": [ADAPTIVE]},
    )  # fmt: skip


def cell_setting() -> Any:
    """Declare which cell is looked at."""
    return setting(
        0, "Cell", "Which of the cells with objects; that of the longest list is 0", minimum=0
    )


def lit(scene: Scene) -> tuple[Scene, str]:
    """Return a scene with one light that has a place, and what that light is called."""
    middle = 0.5 * (scene.lower + scene.upper)
    for light in scene.lights:
        is_near = np.linalg.norm(light.position - middle) <= NEAR * scene.diagonal
        if light.kind != SUN and is_near:
            return with_light(scene, light), light.name or f"the scene's {light.kind} light"
    (own,) = point_lights(middle + BESIDE * scene.diagonal)
    return with_light(scene, own), "the lesson's own light"


def with_light(scene: Scene, light: Light) -> Scene:
    """Return a scene with one light alone."""
    return dataclasses.replace(scene, lights=(light,))


def shadow_rays_seen(scene: Scene, tracer: Structure, progress: Progress) -> Rays | None:
    """Return the shadow rays of a small picture from the front; None if nothing in it is lit."""
    camera: Camera = framing_camera(scene, COLUMNS / ROWS)
    primary = camera_rays(camera, COLUMNS, ROWS)
    hits, _ = tracer.trace(primary, progress=progress)
    return shadow_rays(scene, primary, hits)


class Listing(NamedTuple):
    """The list of a cell.

    Attributes
    ----------
    places : (n,) int64
        Places of items in the geometry, nearest first.
    items : (n,) int64
        Their numbers in the scene.
    nearest : (n,) float64
        How far away each is at least.
    """

    places: np.ndarray
    items: np.ndarray
    nearest: np.ndarray


def list_of(structure: Directional, cell: int) -> Listing:
    """Return the list of a cell."""
    lists = structure.lists
    part = slice(int(lists.first[cell]), int(lists.last[cell]))
    places = lists.references[part].astype(np.int64)
    return Listing(places, structure.geometry.ids[places].astype(np.int64), lists.nearest[part])


def lengths_of(structure: Directional) -> np.ndarray:
    """Return how many items each cell lists, (n,); 0 for what is divided."""
    lists = structure.lists
    return np.where(lists.children < 0, lists.last - lists.first, 0)


def longest_first(structure: Directional) -> np.ndarray:
    """Return the cells with something, that of the longest list first."""
    lengths = lengths_of(structure)
    filled = np.flatnonzero(lengths > 0)
    return filled[np.argsort(-lengths[filled], kind="stable")]


def corners_at(structure: Directional, cells: np.ndarray, depth: float) -> np.ndarray:
    """Return the corners of cells at a depth of their faces, (n, 4, 3), once around."""
    squares = structure.squares
    u, v, width = squares.u[cells], squares.v[cells], squares.width[cells]
    ways = [(0, 0), (1, 0), (1, 1), (0, 1)]
    return np.stack(
        [points_at(structure, squares.face[cells], u + width * x, v + width * y, depth)
         for x, y in ways], axis=1,
    )  # fmt: skip


def points_at(
    structure: Directional, face: np.ndarray | int, u: np.ndarray, v: np.ndarray, depth: float
) -> np.ndarray:
    """Return places of faces at a depth, (n, 3)."""
    faces = structure.faces
    face = np.broadcast_to(face, u.shape)
    back = faces.back[face]
    spread = np.where(faces.is_parallel[face], 1.0, depth)[:, None]
    way = u[:, None] * back[:, 0] + v[:, None] * back[:, 1]
    return faces.origins[face] + spread * way + depth * back[:, 2]


def drawn_cells(structure: Directional) -> tuple[np.ndarray, np.ndarray]:
    """Return the cells to draw, and the length of the longest list in each.

    Where leaves with something are too many, cells as deep as can be stand for their parts.
    """
    squares, longest = structure.squares, lengths_of(structure).astype(np.int64)
    is_leaf = structure.lists.children < 0
    for depth in range(int(squares.depth.max()), 0, -1):
        level = np.flatnonzero(squares.depth == depth)
        np.maximum.at(longest, squares.parent[level], longest[level])
    deepest = int(squares.depth.max())
    while True:
        is_shown = is_leaf & (squares.depth <= deepest) | (squares.depth == deepest)
        shown = np.flatnonzero(is_shown & (longest > 0))
        if len(shown) <= MOST_CELLS or deepest == 0:
            return shown[: 4 * MOST_CELLS], longest[shown[: 4 * MOST_CELLS]]
        deepest -= 1


def tinted_cells(
    corners: np.ndarray, lengths: np.ndarray, longest: int, opacity: float = 0.3
) -> list[Lines | Faces]:
    """Return cells (n, 4, 3) tinted by the length of their lists, with faint borders."""
    colours = opaque(count_colours(lengths, longest))
    colours[:, 3] = opacity
    borders = opaque(count_colours(lengths, longest))
    borders[:, 3] = 0.35
    return [
        Faces(halves(corners), np.repeat(colours, 2, axis=0)),
        Lines(outlines(corners), np.repeat(borders, 4, axis=0)),
    ]


def cube_edges(structure: Directional, depth: float) -> Lines:
    """Return the borders of all faces, faint."""
    count = len(structure.faces.origins)
    signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
    number = np.arange(count)
    corners = [
        points_at(structure, number, np.full(count, u), np.full(count, v), depth) for u, v in signs
    ]
    return coloured(outlines(np.stack(corners, axis=1)), (*GREY[:3], 0.6))


def pyramid(
    structure: Directional, cell: int, near: float, far: float, colour: Colour
) -> list[Lines | Faces]:
    """Return what is seen through a cell from one depth to another: its edges, its sides faint."""
    begin, end = (corners_at(structure, np.array([cell]), depth)[0] for depth in (near, far))
    sides = np.stack(
        [begin, np.roll(begin, -1, axis=0), np.roll(end, -1, axis=0), end], axis=1
    )  # fmt: skip
    return [
        coloured(np.stack([begin, end], axis=1), (*colour[:3], 0.7)),
        coloured(outlines(end[None]), (*colour[:3], 0.7)),
        tinted(halves(sides), colour, 0.07),
    ]


def reach_of(structure: Directional, face: int, places: np.ndarray) -> float:
    """Return the depth in a face up to which items, by their places, reach."""
    boxes, faces = structure.insertion.items.boxes[places], structure.faces
    w = faces.axes[face, 2]
    farthest = np.where(w > 0.0, boxes[:, 3:], boxes[:, :3])
    return float(((farthest - faces.origins[face]) @ w).max())


@dataclass(frozen=True)
class Projections:
    """What the structure's insertion knows of all items in a face.

    Attributes
    ----------
    face : int
    footprints : Footprints
    rows : dict of int to int
        The footprint of each item, by its place in the geometry.
    """

    face: int
    footprints: Footprints
    rows: dict[int, int]

    @classmethod
    def of(cls, structure: Directional, face: int, check: Callable[[], object]) -> Projections:
        """Project the items once more, as it was done to fill the cells.

        Parameters
        ----------
        check : callable
            Is called now and then, and may raise.
        """
        footprints = footprints_of(structure.insertion, face, check)
        return cls(face, footprints, {int(i): k for k, i in enumerate(footprints.item)})

    def outline(self, place: int) -> np.ndarray:
        """Return the outline of an item, (k, 2) in u and v, within the face."""
        footprints, row = self.footprints, self.rows[place]
        if footprints.kind[row] == OUTLINE:
            part = slice(int(footprints.first[row]), int(footprints.first[row + 1]))
            return np.clip(footprints.outline[part], -1.0, 1.0)
        box = np.clip(footprints.rows[row, [U0, V0, U1, V1]], -1.0, 1.0)
        return box[[[0, 1], [2, 1], [2, 3], [0, 3]]]

    def drawn(
        self, structure: Directional, places: np.ndarray, depth: float, colour: Colour,
        opacity: float = 0.25,
    ) -> list[Lines | Faces]:  # fmt: skip
        """Return the footprints of items as they lie in the face, drawn at a depth."""
        parts: list[Lines | Faces] = []
        for place in places.tolist():
            corners = self.outline(place)
            ring = points_at(structure, self.face, corners[:, 0], corners[:, 1], depth)
            fan = np.stack([np.broadcast_to(ring[0], ring[2:].shape), ring[1:-1], ring[2:]], axis=1)
            parts += [coloured(outlines(ring[None]), colour), tinted(fan, colour, opacity)]
        return parts


def numbered(structure: Directional, places: np.ndarray, colour: Colour = GREEN) -> list[Mark]:
    """Return the numbers of items in their order, 1 for the nearest, beside the first of them."""
    boxes = structure.insertion.items.boxes[places[:MOST_NUMBERED]]
    middles = 0.5 * (boxes[:, :3] + boxes[:, 3:])
    return [Mark(middle, str(n), colour[:3]) for n, middle in enumerate(middles, 1)]
