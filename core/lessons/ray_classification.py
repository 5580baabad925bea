"""Lesson "ray classification": a cell of 5D ray space as a bundle of rays, with its candidates.

As on the lecture's slides "5D ray space" and "Ray classification": where a ray begins and where it
goes are five numbers, and an interval of each is a cell. All of its rays fill a beam; what reaches
into that is the list of all of them (:mod:`..structures.ray_classification`; REFERENCE.md A25).

Orange is the cell: the box in which its rays begin, and the beam that they fill together. Blue are
those of the rays that were sent which are in it, up to their hits; green its candidates, with
numbers in the order in which rays ask for them, along the main axis.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..geometry.box_shape import box_segments, corners_of
from ..geometry.hull import hull_faces
from ..geometry.rays import Rays
from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..settings import setting
from ..structures.ray_classification import RayClassification, RayClassificationSettings
from ..structures.ray_classification.ray_space import U, V
from .drawing import (
    BLUE,
    GREEN,
    ORANGE,
    Faces,
    Lines,
    coloured,
    counted,
    items_in,
    picture_of,
    tinted,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Mark, Picture, Row

RAYS = 30_000
"""Rays that are sent, each from a point of the scene's box to another."""

MOST_NUMBERED, MOST_RAYS = 9, 60
"""What is drawn of a cell: numbers of its first candidates, and rays."""

FLAT = 1.0 - 1e-9
"""Cosine from which on two faces of a beam are one."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    max_list_size: int = setting(
        12, "Max List Size", "A cell is divided if it lists more objects", unit="objects",
        minimum=1, maximum=1000,
    )  # fmt: skip
    cell: int = setting(0, "Cell", "Which cell: that with the most rays is the first", minimum=0)


class RayCells(Play):
    """Cells of ray space to which rays have come."""

    def __init__(self, structure: RayClassification, rays: Rays) -> None:
        self.structure, self.rays, self.scene = structure, rays, structure.scene
        self.hits, self.counts = structure.trace(rays)
        self.cells = structure.cells_of(rays)
        numbers, in_each = np.unique(self.cells, return_counts=True)
        has_list = (numbers >= 0) & (structure.sizes()[numbers] > 0)
        # Of equally many rays the cell with the shorter list, and then the one made first.
        order = np.lexsort((numbers, structure.sizes()[numbers], -in_each))
        self.order = numbers[order[has_list[order]]]
        self.ends = {"cell": len(self.order) - 1}
        self.figures = structure.statistics().extra

    def candidates(self, cell: int) -> np.ndarray:
        """Return what a cell lists, in its order."""
        arrays = self.structure.arrays
        return np.asarray(arrays.references[arrays.first[cell] : arrays.last[cell]])

    def beam(self, cell: int) -> np.ndarray:
        """Return the beam of a cell, as far as its candidates reach: its faces, (k, 3, 3)."""
        known = self.structure.known
        root = int(known.root[cell])
        farthest = self.structure.items.farthest[root, self.candidates(cell)].max()
        return beam_until(known.bounds[cell], root, farthest)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one cell."""
        known, cell = self.structure.known, int(self.order[settings.cell])
        low, high = known.bounds[cell]
        listed, beam = self.candidates(cell), self.beam(cell)
        mine = np.flatnonzero(self.cells == cell)
        some = mine[:MOST_RAYS]
        origins, ways = self.rays.origins[some], self.rays.directions[some]
        ends = np.minimum(self.hits.t[some], 1.0)[:, None]
        box = np.concatenate([low[:3], high[:3]])
        parts: list[Lines | Faces] = [
            tinted(beam, ORANGE, 0.05),
            coloured(sharp_edges(beam), (*ORANGE[:3], 0.5)),
            coloured(box_segments(box[None]), ORANGE),
            coloured(np.stack([origins, origins + ends * ways], axis=1), (*BLUE[:3], 0.8)),
            items_in(self.scene, listed, GREEN, 0.55),
        ]
        middles = self.scene.boxes()[listed[:MOST_NUMBERED]].reshape(-1, 2, 3).mean(axis=1)
        marks = [Mark(middle, str(n + 1), GREEN[:3]) for n, middle in enumerate(middles)]
        item, n_items = self.scene.item_name, len(listed)
        root = int(known.root[cell])
        name = f"{'+-'[root % 2]}{'xyz'[root // 2]}"
        caption = (
            f"A cell of root {name}, divided from it {known.depth[cell]} times: its "
            f"{counted(len(mine), 'ray', 'rays')} may hit {counted(n_items, item, f'{item}s')} of "
            f"{show_integer(len(self.scene))}"
        )
        rows = (
            Row("Origins", " ".join(f"{x:.3g}" for x in high[:3] - low[:3]),
                "Sizes of the box in which the rays of this cell begin, along x, y and z"),
            Row("Slopes", f"{low[U]:.3g} to {high[U]:.3g}, {low[V]:.3g} to {high[V]:.3g}",
                "u and v: along the two other axes, for each unit along the main one"),
            Row("Candidates", show_integer(n_items), "Of this cell"),
            Row("Rays", show_integer(len(mine)), f"Of {show_integer(RAYS)}, in this cell"),
            Row("Tests", f"{self.counts['N_IT'][mine].mean():.3g}",
                "Per ray of this cell: they end at the first candidate behind their hit"),
            Row("Cells Made", show_integer(self.figures["cells_made"]),
                "To which rays have come, with those that were divided afterwards"),
            Row("Share Made", f"{self.figures['made_share']:.1%}",
                "Cells that rays have come to / cells there are"),
            Row("Mean Tests", f"{self.counts['N_IT'].mean():.3g}", "Per ray, of all rays"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows)


def beam_until(bounds: np.ndarray, root: int, farthest: float) -> np.ndarray:
    """Return the faces, (k, 3, 3), of a beam up to a place along the axis of its root.

    Parameters
    ----------
    bounds : (2, 6) float64
        The intervals of its cell of ray space.
    farthest : float
        Counted the way its rays run.
    """
    low, high = bounds
    a = root // 2
    ways = np.zeros((4, 3))
    ways[:, a] = 1.0 if root % 2 == 0 else -1.0
    ways[:, (a + 1) % 3] = low[U], low[U], high[U], high[U]
    ways[:, (a + 2) % 3] = low[V], high[V], low[V], high[V]
    corners = corners_of(np.concatenate([low[:3], high[:3]])[None])[0]
    begin, beyond = (low[a], high[a]) if root % 2 == 0 else (-high[a], -low[a])
    far = corners[:, None] + (max(beyond, farthest) - begin) * ways
    return hull_faces(np.concatenate([corners, far.reshape(-1, 3)]))


def sharp_edges(faces: np.ndarray) -> np.ndarray:
    """Return the edges, (m, 2, 3), of a convex surface of triangles at which it bends."""
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    edges = faces[:, [(0, 1), (1, 2), (2, 0)]].reshape(-1, 2, 3)
    owners = np.repeat(np.arange(len(faces)), 3)
    by_ends: dict[frozenset[tuple[float, ...]], list[int]] = {}
    for number, ends in enumerate(edges):
        by_ends.setdefault(frozenset(map(tuple, ends.tolist())), []).append(number)
    bent = [
        pair[0]
        for pair in by_ends.values()
        if len(pair) < 2 or normals[owners[pair[0]]] @ normals[owners[pair[1]]] < FLAT
    ]
    return np.asarray(edges[bent])


def rays_within(scene: Scene) -> Rays:
    """Return rays from points of the scene's box to others, all seeded."""
    points = np.random.default_rng(1).random((2, RAYS, 3))
    begin, end = scene.lower + points * (scene.upper - scene.lower)
    return Rays.from_arrays(begin, end - begin)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Send rays through the scene, which make the cells that they need."""
    progress.report(0, 1, "Sending rays")
    chosen = RayClassificationSettings(max_list_size=settings.max_list_size, min_rays=8)
    structure = RayClassification.build(subject.scene, chosen, progress)
    return RayCells(structure, rays_within(subject.scene))


LESSONS = (
    Lesson(
        name="ray_classification",
        label="Ray Classification",
        slide="Ray classification",
        begin="Where a ray begins and where it goes are five numbers, so a ray is a point, and "
        "rays that are much alike lie in one cell, with one list of what they may hit",
        look_for="The beam is as wide as the box in which its rays begin, and opens with the angle "
        "between them; what is green reaches into it, though no blue ray may come near",
        question="Ray space has five dimensions: cells of 1/16 of each range would be a million in "
        "each of the six roots. Why are there so few here?",
        answer="A cell is divided only when many rays come to it. Those of a picture begin on "
        "surfaces, and neighbours go similar ways: most of ray space is never asked for",
        source="structures.ray_classification.ray_space",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="cell",
        replays=("max_list_size",),
    ),
)
