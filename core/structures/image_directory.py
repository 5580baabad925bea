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
from typing import Any, NamedTuple

import numpy as np

from ..contract.figures import Figure
from ..contract.needs import CAMERA, GEOMETRY
from ..contract.statistics import Statistics
from ..contract.walk import walk
from ..errors import InputError
from ..kernels import implements, inlined, whole
from ..progress import SILENT, Progress
from ..scene import Camera, Scene
from ..scene.camera_rays import PRIMARY, framing_camera
from ..settings import setting
from .directional.faces import Faces, in_face, picture_of
from .directional.lists import NONE, Lists, cell_at, no_lists
from .directional.projection import Insertion
from .directional.structure import Directional, DirectionalSettings, filled, insertion_of
from .directional.walk import Seen, walk_list

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
    lists, nothing : Lists
        Its cells; and none, in the place of what other structures draw.
    last : (0,) int32
        No last occluders.
    slack : float
        How far a ray may pass off the eye.
    extent : float
        How large the scene is.
    """

    faces: Faces
    lists: Lists
    nothing: Lists
    last: np.ndarray
    slack: float
    extent: float


@inlined
def seen_from_camera(structure, ray):
    """Return where a ray goes through the picture."""
    faces, lists, slack = structure.faces, structure.lists, structure.slack
    stranger = Seen(whole(NONE), False, 0.0, 0.0, whole(NONE))
    o, w = faces.origins[0], faces.axes[0, 2]
    x, y, z = ray.ox - o[0], ray.oy - o[1], ray.oz - o[2]
    length = np.sqrt(ray.dx * ray.dx + ray.dy * ray.dy + ray.dz * ray.dz)
    ux, uy, uz = ray.dx / length, ray.dy / length, ray.dz / length
    if faces.is_parallel[0]:
        off = np.sqrt((ux - w[0]) ** 2 + (uy - w[1]) ** 2 + (uz - w[2]) ** 2)
        if not off * (structure.extent + np.sqrt(x * x + y * y + z * z)) <= slack:
            return stranger
        u, v, start = in_face(faces, 0, x, y, z)
    else:
        along = -(x * ux + y * uy + z * uz)
        ex, ey, ez = x + along * ux, y + along * uy, z + along * uz
        # It may start before the eye, but not so that it meets anything there.
        if ex * ex + ey * ey + ez * ez > slack * slack or along > ray.t_min * length + slack:
            return stranger
        a, b, c = in_face(faces, 0, ux, uy, uz)
        if c <= 0.0:
            return stranger
        u, v, start = a / c, b / c, -along
    if not (abs(u) <= 1.0 + 1e-12 and abs(v) <= 1.0 + 1e-12):
        return stranger
    return Seen(cell_at(lists, 0, u, v), True, start + slack, length, whole(NONE))


@implements(walk, ImageArrays, inline=True)
def walk_image_directory(structure, geometry, ray, number, workspace, log):
    """Test what the cell lists that a ray goes through, the nearest to the eye first."""
    return walk_list(
        structure.lists, structure.nothing, structure.last, geometry,
        seen_from_camera(structure, ray), ray, number, workspace, log,
    )  # fmt: skip


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

    def __init__(
        self,
        scene: Scene,
        settings: ImageDirectorySettings,
        arrays: ImageArrays,
        insertion: Insertion,
        geometry: Any,
    ) -> None:
        super().__init__(scene, settings, arrays, geometry)
        self.insertion = insertion

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
            faces, lists, no_lists(), np.empty(0, np.int32), insertion.slack, scene.diagonal
        )
        return cls(scene, settings, arrays, insertion, geometry)

    @property
    def is_of_cube(self) -> np.ndarray:
        """No face is that of a cube."""
        return np.zeros(1, dtype=bool)

    @property
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
