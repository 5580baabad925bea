"""The workload ``camera``: primary rays, and shadow rays of what they hit."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...errors import InputError
from ...geometry.rays import Rays
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import LIGHT_KINDS, ORTHOGRAPHIC, Camera, Scene
from ...scene.camera_rays import camera_rays, framing_camera
from ...scene.shadow_rays import shadow_rays
from ...settings import setting
from .ray_files import BYTES_PER_RAY
from .workload import Generations, Workload, ray_order


def vector(label: str, description: str) -> Any:
    """Declare a point or direction that is left to the scene where it is zero."""
    return setting(
        (0.0, 0.0, 0.0), label, description, minimum=-1e15, maximum=1e15, unset="auto"
    )  # fmt: skip


@dataclass(frozen=True)
class PictureSettings:
    """Settings of a camera, and of the size of its picture."""

    rays: ClassVar[str] = "camera"
    """The workload, for messages."""

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


@dataclass(frozen=True)
class ViewSettings(PictureSettings):
    """Settings of a camera, whatever its rays are for."""

    pixel: str = setting(
        "centre",
        "Pixel",
        "Where in its pixel a ray passes",
        choices={
            "centre": "Through the middle of each pixel",
            "corner": "Through the corners: the first and last rays lie in the picture's border",
        },
    )


@dataclass(frozen=True)
class CameraSettings(ViewSettings):
    """Settings of the camera."""

    shadows: bool = setting(
        False,
        "Shadow Rays",
        "From every hit, one ray to each light that shines on its face: point, sun, spot, area",
    )
    order: str = ray_order()


class ViewWorkload(Workload):
    """Rays that start from a camera, row by row from the top left, and what follows from those.

    The camera is that of the settings `from` and `at`, or the scene's own, perspective or
    orthographic, or, where there is none, one that frames the scene.
    """

    @staticmethod
    def refuse_impossible(settings: ViewSettings) -> None:
        """Refuse more primary rays than fit into memory, and a camera that cannot be."""
        count = settings.width * settings.height
        refuse_if_too_large(
            count * BYTES_PER_RAY, f"rays {settings.rays}: a camera of {count} rays",
            "lower width and height",
        )  # fmt: skip
        refuse_no_view(settings)

    @staticmethod
    def used(scene: Scene, settings: ViewSettings) -> dict[str, Any]:
        """Return the camera, and where it comes from."""
        return {"camera": camera_used(scene, settings)}


def primary_rays(scene: Scene, settings: ViewSettings) -> Rays:
    """Return width * height primary rays.

    Raises
    ------
    InputError
        If they do not fit into memory, or there can be no such camera.
    """
    ViewWorkload.refuse_impossible(settings)
    return camera_rays(
        camera_of(scene, settings), settings.width, settings.height, settings.pixel == "corner"
    )


class CameraWorkload(ViewWorkload):
    """Primary rays; shadow rays if wanted."""

    name = "camera"
    label = "Camera"
    summary = "One ray per pixel of a camera, and shadow rays if wanted"
    Settings = CameraSettings

    @staticmethod
    def make(scene: Scene, settings: CameraSettings) -> Rays:
        """Return width * height primary rays."""
        primary = primary_rays(scene, settings)
        if settings.shadows:
            refuse_darkness(scene)
        return primary

    @staticmethod
    def generations(
        scene: Scene, settings: CameraSettings, first: Rays, progress: Progress = SILENT
    ) -> Generations:
        """Yield the primary rays, then the shadow rays, if wanted, from where those have hit."""
        hits = yield first
        if settings.shadows and (shadows := shadow_rays(scene, first, hits)) is not None:
            yield shadows
        return None


def refuse_darkness(scene: Scene) -> None:
    """Raise InputError if a scene has no light: there are no shadow rays then."""
    if not scene.lights:
        raise InputError(
            f"{scene.name} has no light, so there are no shadow rays; add a light "
            f"({', '.join(LIGHT_KINDS)}), or leave the shadow rays out",
            scene.name,
        )


def refuse_no_view(settings: PictureSettings) -> None:
    """Raise InputError for a camera that looks at where it stands."""
    if settings.from_ == settings.at != (0.0, 0.0, 0.0):
        raise InputError(
            f"rays {settings.rays}: 'from' and 'at' are the same point; move one of them"
        )


def camera_used(scene: Scene, settings: PictureSettings) -> dict[str, Any]:
    """Return the camera and where it comes from, as JSON takes it, for a record."""
    camera = camera_of(scene, settings).to_json()
    return {"source": source_of_camera(scene, settings), **camera}


def source_of_camera(scene: Scene, settings: PictureSettings) -> str:
    """Say where the camera comes from: "settings", "scene" or "framing"."""
    if settings.from_ != settings.at:
        return "settings"
    return "framing" if scene.camera is None else "scene"


def camera_of(scene: Scene, settings: PictureSettings) -> Camera:
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
                f"rays {settings.rays}: the scene's camera '{camera.name}' is orthographic and has "
                "no angle of view; leave 'fov' at 0",
                camera.name,
            )
        camera = dataclasses.replace(camera, fov=settings.fov, fit="larger")
    return camera
