"""Image-plane directory: what may be seen through each part of a picture, before a ray is sent.

The picture of a camera is divided into cells, each with a list of the items that may be seen
through it, the nearest first: for primary rays only (lecture, "Image plane directory"). Items are
projected conservatively, so the list of a cell has all that any of its rays can hit.

Where one item covers a cell and nothing lies before it, there is nothing to search for: all rays of
the cell hit that one. Where a list is empty, all of them miss. These pixels are decided *with
certainty*, as a share of the picture that the figures tell.

A ray that does not start in the camera, or leaves the picture, is tested against all items.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.figures import Figure
from ..contract.needs import CAMERA, GEOMETRY
from ..contract.statistics import Statistics
from ..contract.walk import walk
from ..errors import InputError
from ..kernels import implements, whole
from ..progress import SILENT, Progress
from ..scene import Camera, Scene
from ..scene.camera_rays import PRIMARY, framing_camera
from ..settings import setting
from .directional.faces import Faces, picture_of
from .directional.lists import NONE, NOT_DRAWN, Lists, cell_at
from .directional.settings import DirectionalSettings
from .directional.structure import Directional, filled, insertion_of
from .directional.walk import Seen, seen_by, sight_of, stranger, walk_cells

CERTAIN = Figure(
    "certain_share", "share of the picture in whose cells nothing has to be searched for: they are "
    "empty, or one item covers them before all others", "Certain pixels", section="Lists",
    column="certain",
)  # fmt: skip

UNCERTAIN = -2
"""In the place of an item: the list of the cell has to be searched."""


@dataclass(frozen=True)
class ImageDirectorySettings(DirectionalSettings):
    """Settings of the image-plane directory: the picture is that of the scene's camera."""

    width: int = setting(
        512, "Width", "Pixels in a row of the picture", unit="pixels", minimum=1, maximum=65536
    )
    height: int = setting(
        512, "Height", "Rows of pixels", unit="pixels", minimum=1, maximum=65536
    )  # fmt: skip


class ImageArrays(NamedTuple):
    """The directory as the walk sees it.

    Attributes
    ----------
    faces : Faces
        The picture.
    lists : Lists
        Its cells.
    drawn : (0,) int64
        Nothing: other structures draw.
    last : (0,) int32
        No last occluders.
    slack : float
        How far a ray may pass off the eye.
    extent : float
        How large the scene is.
    """

    faces: Faces
    lists: Lists
    drawn: np.ndarray
    last: np.ndarray
    slack: float
    extent: float


@implements(seen_by, ImageArrays, inline=True)
def seen_by_camera(structure, ray):
    """Return what is known of a ray through the picture."""
    faces, slack = structure.faces, structure.slack
    sight = sight_of(faces, whole(0), False, 1.0, structure.extent, ray)
    # It may start before the eye, but not so that it meets anything there.
    is_before = (sight.t - ray.t_min) * sight.length > slack
    if not sight.off <= slack * slack or (is_before and not faces.is_parallel[0]):
        return stranger()
    if not (abs(sight.u) <= 1.0 + 1e-12 and abs(sight.v) <= 1.0 + 1e-12):
        return stranger()
    cell = cell_at(structure.lists, sight.face, sight.u, sight.v)
    return Seen(cell, True, slack - sight.t * sight.length, sight.length, whole(NONE))


implements(walk, ImageArrays, inline=True)(walk_cells)


class ImageDirectory(Directional):
    """The picture of the scene's camera, in cells."""

    name = "image_directory"
    label = "Image Directory"
    summary = "Lists of what may be seen through the cells of a camera's picture, for primary rays"
    Settings = ImageDirectorySettings
    answers = (PRIMARY,)
    needs = frozenset({GEOMETRY, CAMERA})
    FIGURES = *Directional.FIGURES, CERTAIN

    arrays: ImageArrays

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: ImageDirectorySettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> ImageDirectory:
        """Divide the picture, and list what is seen through its cells.

        Raises
        ------
        InputError
            If the scene's camera is of a kind that no rays are made of, or lists do not fit into
            memory.
        """
        cls.refuse_too_large(scene, settings)
        camera = camera_for(scene, settings)
        if not camera.has_rays:
            raise InputError(
                f"the scene's camera '{camera.name}' is {camera.kind}, and an image directory is "
                "for a perspective or orthographic one; choose another camera",
                camera.name,
            )
        faces, geometry = picture_of(camera, settings.width, settings.height), scene.items()
        insertion = insertion_of(scene, geometry, faces, settings)
        lists = filled(insertion, settings, cls.name, progress)
        arrays = ImageArrays(
            faces, lists, NOT_DRAWN, np.empty(0, np.int32), insertion.slack, scene.diagonal
        )
        return cls(scene, settings, arrays, insertion, geometry)

    @property
    def is_of_cube(self) -> np.ndarray:
        """No face is that of a cube."""
        return np.zeros(1, dtype=bool)

    @functools.cached_property
    def drawn_size(self) -> float:
        """How far before the camera the picture is drawn."""
        distance = np.linalg.norm(
            self.faces.origins[0] - 0.5 * (self.scene.lower + self.scene.upper)
        )
        return 0.25 * float(distance) or self.scene.diagonal

    @functools.cached_property
    def certain_items(self) -> np.ndarray:
        """What all rays of a cell hit for certain, (n,) int64: a place in the geometry.

        NONE where all of them miss; UNCERTAIN where a list has to be searched, and for what is no
        leaf.
        """
        lists = self.lists
        is_leaf = lists.children < 0
        certain = np.full(len(is_leaf), UNCERTAIN)
        certain[is_leaf & (lists.first == lists.last)] = NONE
        filled = np.flatnonzero(is_leaf & (lists.first < lists.last))
        first, second = lists.first[filled], lists.first[filled] + 1
        following = np.full(len(filled), np.inf)
        has_second = second < lists.last[filled]
        following[has_second] = lists.nearest[second[has_second]]
        # Before the item that covers a cell there must be no other, wherever in the cell.
        is_one = (lists.references[first] == lists.cover[filled]) & (following > lists.far[filled])
        certain[filled[is_one]] = lists.cover[filled[is_one]]
        return certain

    @property
    def certain_share(self) -> float:
        """The share of the picture in whose cells nothing has to be searched for."""
        return float(self.weights[self.certain_items != UNCERTAIN].sum())

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of all cells together, and what of the picture is certain."""
        statistics = super().statistics(progress)
        extra = {**statistics.extra, CERTAIN.key: self.certain_share}
        return dataclasses.replace(statistics, extra=extra)


def camera_for(scene: Scene, settings: ImageDirectorySettings) -> Camera:
    """Return the scene's camera, or the one that frames it, as rays have it."""
    if scene.camera is not None:
        return scene.camera
    return framing_camera(scene, settings.width / settings.height)


STRUCTURE = ImageDirectory
