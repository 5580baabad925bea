"""Lesson "image directory": the picture plane in cells, and what of it is certain.

As on the lecture's slide "Image plane directory": the picture is divided, a cell lists in order
what may be seen through it, and "in most pixels it can be done with complete certainty"
(:mod:`..structures.image_directory`; REFERENCE.md A26).

The picture stands before its camera, and once more beside the model. Faint grey are cells in which
nothing is seen, green those that one object covers before all others: both are certain. In others
the list has to be searched; they are tinted by its length. Orange is the pyramid of one cell, green
its objects, with their numbers in the list.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import count_colours
from ..printing import show_integer
from ..progress import Progress
from ..scene import Camera, Scene
from ..structures.directional.lists import NONE
from ..structures.directional.settings import UNIFORM
from ..structures.image_directory import UNCERTAIN, ImageDirectory, ImageDirectorySettings
from .directions import (
    cell_setting,
    cells_setting,
    corners_at,
    cube_edges,
    division_setting,
    lengths_of,
    list_of,
    longest_first,
    longest_setting,
    numbered,
    pyramid,
    reach_of,
)
from .drawing import (
    GREEN,
    GREY,
    ORANGE,
    Faces,
    Lines,
    coloured,
    counted,
    halves,
    items_in,
    outlines,
    picture_of,
)
from .lesson import Lesson, Play, Subject, only_its_own
from .picture import Image, Picture, Row

WIDTH, HEIGHT = 512, 384
"""Pixels of the picture."""

FROM = np.array([-1.15, 0.15, 0.25])
"""Where the lessons' own camera is: from the scene's middle, in diagonals. From the front right the
picture is seen aslant."""

DEEPEST = 7
"""How often the picture is divided at most: cells are a few pixels then."""

AHEAD = 0.45
"""How far before the camera the picture is drawn, of the way to the scene's middle."""

MOST_CELLS = 4096
"""Cells that are drawn of the picture: of more, those with something, and of too many of these some
from everywhere."""

PAPER = 0.93
"""Grey of pixels in which nothing is seen."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    division: str = division_setting("the picture", "rectangles")
    cells: int = cells_setting(24, "each side of the picture", 256)
    longest: int = longest_setting(2)
    cell: int = cell_setting()


class PicturePlane(Play):
    """One directory.

    Attributes
    ----------
    leaf_of : (HEIGHT, WIDTH) int64
        The cell that the middle of each pixel lies in; row 0 is the top.
    """

    def __init__(self, directory: ImageDirectory, camera: str) -> None:
        self.directory, self.camera, self.scene = directory, camera, directory.scene
        self.order, self.lengths = longest_first(directory), lengths_of(directory)
        self.ends = {"cell": max(len(self.order) - 1, 0)}
        middle = 0.5 * (self.scene.lower + self.scene.upper)
        away = float((middle - directory.faces.origins[0]) @ directory.faces.axes[0, 2])
        self.depth = AHEAD * (away if away > 0.0 else self.scene.diagonal)
        self.certain = directory.certain_items
        is_leaf = directory.lists.children < 0
        weights = directory.weights
        self.shares = {
            "empty": float(weights[self.certain == NONE].sum()),
            "covered": float(weights[self.certain >= 0].sum()),
            "searched": float(weights[is_leaf & (self.certain == UNCERTAIN)].sum()),
        }
        self.n_cells = int(is_leaf.sum())
        step = np.array([2.0 / WIDTH, 2.0 / HEIGHT])
        u = -1.0 + (np.arange(WIDTH) + 0.5) * step[0]
        v = 1.0 - (np.arange(HEIGHT) + 0.5) * step[1]
        across, down = np.meshgrid(u, v)
        self.leaf_of = leaves_at(directory, across, down)
        self.colours = self.colours_of_cells()
        self.plane = self.drawn_plane()

    def colours_of_cells(self) -> np.ndarray:
        """Return the colours of all leaves, (n, 4)."""
        longest = int(self.lengths.max(initial=1))
        colours = np.empty((len(self.certain), 4))
        colours[:, :3], colours[:, 3] = count_colours(self.lengths, longest), 0.45
        colours[self.certain == NONE] = *GREY[:3], 0.05
        colours[self.certain >= 0] = *GREEN[:3], 0.55
        return colours

    def drawn_plane(self) -> list[Lines | Faces]:
        """Return the cells of the picture before its camera, and lines to its corners."""
        directory = self.directory
        leaves = np.flatnonzero(directory.lists.children < 0)
        if len(leaves) > MOST_CELLS:
            leaves = leaves[self.lengths[leaves] > 0]
        if len(leaves) > MOST_CELLS:
            leaves = leaves[np.linspace(0, len(leaves) - 1, MOST_CELLS).astype(int)]
        corners, colours = corners_at(directory, leaves, self.depth), self.colours[leaves]
        borders = colours.copy()
        borders[:, 3] = 0.35
        frame = cube_edges(directory, self.depth)
        eye = np.broadcast_to(directory.faces.origins[0], (4, 3))
        parts: list[Lines | Faces] = [
            Faces(halves(corners), np.repeat(colours, 2, axis=0)),
            Lines(outlines(corners), np.repeat(borders, 4, axis=0)),
            frame,
        ]
        if not directory.faces.is_parallel[0]:
            lines = np.stack([eye, frame.segments[:, 0]], axis=1)
            parts.append(coloured(lines, (*GREY[:3], 0.4)))
        return parts

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one cell."""
        item, n_all = self.scene.item_name, show_integer(len(self.scene))
        parts: list[Lines | Faces] = [*self.plane]
        marks, cell = [], -1
        certain = 1.0 - self.shares["searched"]
        caption = (
            f"{counted(self.n_cells, 'cell', 'cells')}; {certain:.0%} of the picture is certain: "
            f"in {self.shares['empty']:.0%} there is nothing, {self.shares['covered']:.0%} one "
            f"{item} covers"
        )
        if len(self.order):
            directory, cell = self.directory, int(self.order[settings.cell])
            listing = list_of(directory, cell)
            near = corners_at(directory, np.array([cell]), 0.998 * self.depth)
            reach = max(reach_of(directory, 0, listing.places), 1.1 * self.depth)
            parts.append(coloured(outlines(near), ORANGE))
            parts += pyramid(directory, cell, self.depth, reach, ORANGE)
            parts.append(items_in(self.scene, listing.items, GREEN, 0.6))
            marks = numbered(directory, listing.places)
            caption += (
                f". Cell {settings.cell} lists "
                f"{counted(len(listing.items), item, f'{item}s')} of {n_all}"
            )
            if self.certain[cell] >= 0:
                caption += ", and the first covers it"
        seen = self.lengths > 0
        weights = self.directory.weights
        mean = float((weights * self.lengths)[seen].sum() / (weights[seen].sum() or 1.0))
        rows = (
            Row("Cells", show_integer(self.n_cells), "Of the whole picture"),
            Row("Certain", f"{certain:.1%}", "Share of the picture where nothing is searched for"),
            Row("Empty", f"{self.shares['empty']:.1%}", "Share in which all rays miss"),
            Row("Covered", f"{self.shares['covered']:.1%}",
                f"Share in which one {item} covers the cell, and nothing is before it"),
            Row("Searched", f"{self.shares['searched']:.1%}", "Share in which lists are searched"),
            Row("Mean List", f"{mean:.3g}", "Over the picture, where something may be seen"),
            Row("Longest List", str(int(self.lengths.max(initial=0))), "Objects in cell 0"),
            Row("Camera", self.camera, "Whose picture it is"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows, images=[self.image(cell)])

    def image(self, cell: int) -> Image:
        """Return the picture in the colours of its cells; one of them is orange."""
        colours = self.colours[self.leaf_of]
        # As translucent as before the camera, on paper.
        share = np.minimum(1.6 * colours[..., 3:], 1.0)
        pixels = share * colours[..., :3] + (1.0 - share) * PAPER
        pixels[self.leaf_of == cell] = ORANGE[:3]
        return Image("certain", pixels, self.lengths[self.leaf_of].astype(np.float64))

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return both divisions, and a cell in which there is less."""
        return [
            Settings(),
            Settings(cell=self.ends["cell"]),
            Settings(UNIFORM, 24),
            Settings(UNIFORM, 128),
        ]


def leaves_at(directory: ImageDirectory, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the leaves of a picture at places, as the walk finds them."""
    lists = directory.lists
    x, y = (0.5 * (place + 1.0) * lists.size for place in (u, v))
    i, j = (np.clip(place, 0.0, lists.size - 1.0).astype(np.int64) for place in (x, y))
    x, y, cell = x - i, y - j, j * lists.size + i
    while (is_divided := lists.children[cell] >= 0).any():
        x, y = 2.0 * x, 2.0 * y
        right, upper = x >= 1.0, y >= 1.0
        cell = np.where(is_divided, lists.children[cell] + right + 2 * upper, cell)
        x, y = x - right, y - upper
    return cell


def with_camera(scene: Scene) -> tuple[Scene, str]:
    """Return a scene with a camera, and what that is called: its own, or one of the lesson's."""
    if scene.camera is not None and scene.camera.has_rays:
        return scene, scene.camera.name or "the scene's camera"
    middle = 0.5 * (scene.lower + scene.upper)
    place = middle + FROM * scene.diagonal
    camera = Camera(place, middle, np.array([0.0, 0.0, 1.0]), 48.0)
    return dataclasses.replace(scene, camera=camera), "the lesson's own camera"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Divide the picture of the camera."""
    progress.report(0, 1, "Filling the cells of the picture")
    scene, camera = with_camera(subject.scene)
    chosen = ImageDirectorySettings(
        division=settings.division, cells=settings.cells, max_list_size=settings.longest,
        max_depth=DEEPEST, width=WIDTH, height=HEIGHT,
    )  # fmt: skip
    return PicturePlane(ImageDirectory.build(scene, chosen, progress), camera)


LESSONS = (
    Lesson(
        name="image_directory",
        label="What of a Picture Is Certain",
        slide="Image plane directory",
        begin="All primary rays start in one point, so before one is sent the picture can be "
        "divided into cells, each with the objects that may be seen through it, in order",
        look_for="Inside a triangle cells become green: it covers them, and there is nothing to "
        "search for. Along outlines and edges lists stay longer, however small cells are",
        question="Why can a cell through which exactly one object is seen still be uncertain?",
        answer="The object may cover only a part of it: some rays hit it, others pass beside it. "
        "Only when it covers the whole cell, and nothing lies before, is every pixel decided",
        source="structures.image_directory",
        sample="suzanne:subdivisions=0",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="longest",
        replays=("division", "cells", "longest"),
    ),
)
