"""Workloads: named, seeded sets of rays with a class per ray.

A workload is a class with ``Settings``, ``make(scene, settings) -> Rays`` and, if there are rays
that come of those, ``generations``; WORKLOADS lists them.
"""

from __future__ import annotations

import dataclasses
import os
from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...contract.ray_order import AUTOMATIC, CHOICES
from ...contract.structure import Hits
from ...errors import InputError, naming
from ...geometry.rays import Rays
from ...memory import refuse_if_too_large
from ...sah.line_sample import random_lines
from ...scene import ORTHOGRAPHIC, Camera, Scene
from ...scene.camera_rays import camera_rays, framing_camera
from ...settings import setting
from .ray_files import BYTES_PER_RAY, headers_of, read_rays
from .shadow_rays import refuse_darkness, shadow_rays

Generations = Generator[Rays, Hits, None]
"""Batches of rays; after each, the generator is sent its hits."""


class Workload(ABC):
    """A named set of rays: a first batch, and perhaps others that start where it has hit.

    Attributes
    ----------
    name, label, summary : str
    Settings : type
        The settings dataclass; one of them is ``order``, see :func:`ray_order`.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    summary: ClassVar[str]
    Settings: ClassVar[type]

    @staticmethod
    @abstractmethod
    def refuse_impossible(settings: Any) -> None:
        """Raise InputError for settings that fit no scene whatever."""

    @staticmethod
    @abstractmethod
    def make(scene: Scene, settings: Any) -> Rays:
        """Return the first rays for a scene.

        Raises
        ------
        InputError
            When the settings do not fit the scene.
        """

    @staticmethod
    def generations(scene: Scene, settings: Any, first: Rays) -> Generations:
        """Yield a batch of rays after the other, and be sent what each has hit.

        Who traces them is not the workload's affair: the structure that is measured does. Its hits
        are those of any other structure, bit for bit, so the batches are, too.

        Parameters
        ----------
        first : Rays
            What :meth:`make` has returned.
        """
        yield first

    @staticmethod
    def used(scene: Scene, settings: Any) -> dict[str, Any]:
        """Return what of the scene the rays start from, as JSON takes it, for the record."""
        return {}


def ray_order() -> Any:
    """Declare in which order the rays of a batch are traced."""
    return setting(
        AUTOMATIC,
        "Order",
        "In which order rays are traced; what they hit and count is the same",
        choices=CHOICES,
    )


# --------------------------------------------------------------------------------------- camera


def vector(label: str, description: str) -> Any:
    """Declare a point or direction that is left to the scene where it is zero."""
    return setting(
        (0.0, 0.0, 0.0), label, description, minimum=-1e15, maximum=1e15, unset="auto"
    )  # fmt: skip


@dataclass(frozen=True)
class CameraSettings:
    """Settings of the camera."""

    from_: tuple[float, float, float] = vector(
        "From",
        "Where the camera stands; equal to At, the scene's own camera is used, or one that "
        "frames the scene",
    )
    at: tuple[float, float, float] = vector("At", "What the camera looks at")
    up: tuple[float, float, float] = vector(
        "Up", "Which way is up; 0 takes the scene's own camera's, or z"
    )
    fov: float = setting(
        0.0,
        "Field of View",
        "Full angle of view of the larger side; 0 takes the scene's own, or 45",
        unit="degrees",
        minimum=0.0,
        maximum=179.0,
        unset="auto",
    )
    width: int = setting(512, "Width", "Rays in a row", unit="rays", minimum=1, maximum=65536)
    height: int = setting(512, "Height", "Rows of rays", unit="rays", minimum=1, maximum=65536)
    pixel: str = setting(
        "centre",
        "Pixel",
        "Where in its pixel a ray passes",
        choices={
            "centre": "Through the middle of each pixel",
            "corner": "Through the corners: the first and last rays lie in the picture's border",
        },
    )
    shadows: bool = setting(
        False,
        "Shadow Rays",
        "From every hit, one ray to each light that shines on its face: point, sun, spot, area",
    )
    order: str = ray_order()


class CameraWorkload(Workload):
    """Primary rays of a camera, row by row from the top left; shadow rays if wanted.

    The camera is that of the settings `from` and `at`, or the scene's own, perspective or
    orthographic, or, where there is none, one that frames the scene.
    """

    name = "camera"
    label = "Camera"
    summary = "One ray per pixel of a camera, and shadow rays if wanted"
    Settings = CameraSettings

    @staticmethod
    def refuse_impossible(settings: CameraSettings) -> None:
        """Refuse more rays than fit into memory, and a camera that cannot be."""
        count = settings.width * settings.height
        refuse_if_too_large(
            count * BYTES_PER_RAY, f"a camera of {count} rays", "lower width and height"
        )
        if settings.from_ == settings.at != (0.0, 0.0, 0.0):
            raise InputError("rays camera: 'from' and 'at' are the same point; move one of them")

    @staticmethod
    def make(scene: Scene, settings: CameraSettings) -> Rays:
        """Return width * height primary rays."""
        CameraWorkload.refuse_impossible(settings)
        primary = camera_rays(
            camera_of(scene, settings), settings.width, settings.height, settings.pixel == "corner"
        )
        if settings.shadows:
            refuse_darkness(scene)
        return primary

    @staticmethod
    def generations(scene: Scene, settings: CameraSettings, first: Rays) -> Generations:
        """Yield the primary rays, then the shadow rays, if wanted, from where those have hit."""
        hits = yield first
        if settings.shadows and (shadows := shadow_rays(scene, first, hits)) is not None:
            yield shadows

    @staticmethod
    def used(scene: Scene, settings: CameraSettings) -> dict[str, Any]:
        """Return the camera, and where it comes from."""
        camera = camera_of(scene, settings).to_json()
        return {"camera": {"source": source_of_camera(scene, settings), **camera}}


def source_of_camera(scene: Scene, settings: CameraSettings) -> str:
    """Say where the camera comes from: "settings", "scene" or "framing"."""
    if settings.from_ != settings.at:
        return "settings"
    return "framing" if scene.camera is None else "scene"


def camera_of(scene: Scene, settings: CameraSettings) -> Camera:
    """Return the camera that the settings describe, or the scene's own, or one that frames it.

    Raises
    ------
    InputError
        If the settings do not fit each other, or the scene's own camera.
    """
    source = source_of_camera(scene, settings)
    if source == "settings":
        camera = Camera(
            np.array(settings.from_), np.array(settings.at), np.array([0.0, 0.0, 1.0]), 45.0
        )
    elif scene.camera is None:
        camera = framing_camera(scene, settings.width / settings.height)
    else:
        camera = scene.camera
    if any(settings.up):
        camera = dataclasses.replace(camera, up=np.array(settings.up), right=None)
    if settings.fov:
        if camera.kind == ORTHOGRAPHIC:
            raise InputError(
                f"rays camera: the scene's camera '{camera.name}' is orthographic and has no angle "
                "of view; leave 'fov' at 0",
                camera.name,
            )
        camera = dataclasses.replace(camera, fov=settings.fov, fit="larger")
    return camera


# --------------------------------------------------------------------------------- random lines


@dataclass(frozen=True)
class RandomLinesSettings:
    """Settings of the random lines."""

    count: int = setting(100_000, "Count", "How many lines", unit="rays", minimum=1)
    seed: int = setting(1, "Seed", "Start of the random numbers", minimum=0)
    order: str = ray_order()


class RandomLinesWorkload(Workload):
    """Isotropic uniform lines through the scene's box: the SAH's own assumption.

    A point uniform on the box's surface, then a direction into the box with a density proportional
    to the cosine of its angle with the surface. Every line through the box enters it just once, so
    no line is drawn in vain. Under this distribution a convex body inside another is hit with
    probability S_i / S.
    """

    name = "random_lines"
    label = "Random Lines"
    summary = "Isotropic uniform lines through the scene's box: the SAH's own assumption"
    Settings = RandomLinesSettings

    @staticmethod
    def refuse_impossible(settings: RandomLinesSettings) -> None:
        """Refuse more rays than fit into memory."""
        refuse_if_too_large(
            settings.count * BYTES_PER_RAY, f"{settings.count} random lines", "lower the count"
        )

    @staticmethod
    def make(scene: Scene, settings: RandomLinesSettings) -> Rays:
        """Return lines that start outside the scene's bounding sphere."""
        RandomLinesWorkload.refuse_impossible(settings)
        origins, directions = random_lines(scene.lower, scene.upper, settings.count, settings.seed)
        return Rays.from_arrays(origins, directions, class_names=("random line",))


# ----------------------------------------------------------------------------------------- file


@dataclass(frozen=True)
class FileSettings:
    """Settings of rays from a file."""

    path: str = setting(
        "",
        "File",
        "An .npz with origins (n, 3), directions (n, 3) and optionally t_min, t_max, query, "
        "ray_class, source, target, time, mask, pixel (n each): what --hits writes",
    )
    order: str = ray_order()


class FileWorkload(Workload):
    """Rays of the user's own, from an .npz file."""

    name = "file"
    label = "File"
    summary = "Rays from an .npz file, such as --hits writes"
    Settings = FileSettings

    @staticmethod
    def refuse_impossible(settings: FileSettings) -> None:
        """Refuse a file that has no rays, by what it says of its arrays."""
        path = path_of(settings)
        with naming(str(path)):
            headers_of(path)

    @staticmethod
    def make(scene: Scene, settings: FileSettings) -> Rays:
        """Read the rays; they are the same for every scene."""
        path = path_of(settings)
        with naming(str(path)):
            return read_rays(path)


def path_of(settings: FileSettings) -> Path:
    """Return the path of a file of rays.

    Raises
    ------
    InputError
        If none is given.
    """
    if not settings.path:
        raise InputError("rays from a file need its path, that of an .npz file")
    # Path.expanduser raises for ~name if there is nobody of that name, though there may be a file.
    return Path(os.path.expanduser(settings.path))


WORKLOADS: dict[str, type[Workload]] = {
    workload.name: workload for workload in (CameraWorkload, RandomLinesWorkload, FileWorkload)
}


def workloads() -> dict[str, type[Workload]]:
    """Return every workload by name."""
    return WORKLOADS


def workload_named(name: str) -> type[Workload]:
    """Return the workload called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    if name not in WORKLOADS:
        known = ", ".join(WORKLOADS)
        raise InputError(f"there are no rays '{name}'; known are: {known}")
    return WORKLOADS[name]
