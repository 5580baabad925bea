"""The workload ``whitted``: all rays of a picture by Whitted's recursive ray tracing.

Primary rays come from the camera; from what they hit, shadow rays go to the lights, and reflected
and refracted rays go on, from hit to hit (:mod:`.trees`). What they see is put together to the
picture (:mod:`.shading`, :mod:`.film`), and rays can be saved in two ways: by not sending those
that would add too little, and by taking many samples of a pixel only where the picture needs them.

All is the same on every machine and with any number of threads, but for what the mathematical
library's tangent of the angle of view and cosine of a spot light's cone may differ by in their last
digit.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ....contract.structure import Hits
from ....errors import InputError
from ....geometry.rays import Rays
from ....memory import refuse_if_too_large
from ....progress import SILENT, Progress
from ....scene import POINT, Camera, Light, Scene
from ....scene.camera_rays import camera_axes, camera_rays
from ....settings import GIVEN, setting
from ..camera import ViewSettings, camera_of, camera_used, refuse_no_view
from ..ray_files import BYTES_PER_RAY
from ..workload import Generations, Workload, ray_order
from .film import Film
from .outcome import FIGURES, Pictured
from .trees import Batch, Trees

MOST_DEPTH = 50

BYTES_PER_PLACE = 30
"""Of a film that is divided: whose cell it is, and whether that differs from others."""


@dataclass(frozen=True)
class WhittedSettings(ViewSettings):
    """Settings of the picture."""

    rays: ClassVar[str] = "whitted"

    depth: int = setting(
        5, "Depth", "How many rays one after the other at most, the primary one being the first",
        unit="rays", minimum=1, maximum=MOST_DEPTH,
    )  # fmt: skip
    threshold: float = setting(
        0.0, "Threshold", "A ray is not sent if it could add less than this to its sample, 1 being "
        "white; 0 sends all", minimum=0.0, maximum=1.0,
    )  # fmt: skip
    samples: int = setting(
        1, "Samples", "Samples of a pixel in a row and in a column, n x n of it", minimum=1,
        maximum=16, only_for={"pixel": ["centre"]},
    )  # fmt: skip
    adaptive: bool = setting(
        False, "Adaptive", "Take all of a pixel's samples only where neighbours differ, one "
        "elsewhere; samples are then 2, 4, 8 or 16", only_for={"pixel": ["centre"]},
    )  # fmt: skip
    contrast: float = setting(
        0.1, "Contrast", "How much red, green or blue of neighbours must differ, from 0 to 1; "
        "other objects always do", minimum=0.0, maximum=1.0, only_for={"adaptive": GIVEN},
    )  # fmt: skip
    compare: bool = setting(
        True, "Compare", "Where rays are saved, trace those as well, unmeasured, to say how many "
        "they are and how far the picture is off",
    )  # fmt: skip
    order: str = ray_order()


class WhittedWorkload(Workload):
    """Primary, shadow, reflected and refracted rays of a picture.

    They start from the camera as those of ``camera`` do, and go to the scene's lights; in a scene
    without a light, to one over the camera's left shoulder. What a ray meets is made of the scene's
    materials; in a scene without, all is matt.
    """

    name = "whitted"
    label = "Whitted"
    summary = "All rays of a picture: primary, shadow, reflected and refracted ones"
    Settings = WhittedSettings
    FIGURES = FIGURES

    @staticmethod
    def refuse_impossible(settings: WhittedSettings) -> None:
        """Refuse more samples than fit into memory, and settings that do not fit each other."""
        where = "rays whitted"
        side = side_of(settings)
        if settings.adaptive and settings.pixel == "centre" and side not in (2, 4, 8, 16):
            raise InputError(f"{where}: adaptive needs samples of 2, 4, 8 or 16, not {side}")
        pixels, places = settings.width * settings.height, side * side
        per_pixel = (
            BYTES_PER_RAY + BYTES_PER_PLACE * places if settings.adaptive
            else BYTES_PER_RAY * places
        )  # fmt: skip
        refuse_if_too_large(
            pixels * per_pixel, f"{where}: a picture of {pixels} pixels",
            "lower width, height or samples",
        )  # fmt: skip
        refuse_no_view(settings)

    @staticmethod
    def make(scene: Scene, settings: WhittedSettings) -> Rays:
        """Return the primary rays; of adaptive samples, the first of each pixel."""
        WhittedWorkload.refuse_impossible(settings)
        return primary_rays(scene, settings, film_of(settings))

    @staticmethod
    def generations(
        scene: Scene, settings: WhittedSettings, first: Rays, progress: Progress = SILENT
    ) -> Generations:
        """Yield primary rays, and depth by depth what descends from them; return the picture.

        After the hits of each depth follow the shadow rays from there, then the next depth.
        Adaptive samples grow their trees one division of the film after the other.
        """
        film = film_of(settings)
        trees = Trees(
            scene, lights_of(scene, settings), settings.depth, settings.threshold, film, progress
        )
        yield from rays_only(trees.grow(first, 0))
        before = len(first)
        while film.divide(settings.contrast):
            yield from rays_only(trees.grow(primary_rays(scene, settings, film, before), before))
            before = len(film)
        return Pictured(film.picture(), film.samples(), trees.sent, trees.spared)

    @staticmethod
    def unsparing(settings: WhittedSettings) -> WhittedSettings | None:
        """Return the settings of all samples and contributions."""
        if not settings.compare or not (settings.threshold or settings.adaptive):
            return None
        return dataclasses.replace(settings, threshold=0.0, adaptive=False)

    @staticmethod
    def used(scene: Scene, settings: WhittedSettings) -> dict[str, Any]:
        """Return the camera, and the light that stands in where the scene has none."""
        camera = {"camera": camera_used(scene, settings)}
        if scene.lights:
            return camera
        return camera | {"lights": [each.to_json() for each in lights_of(scene, settings)]}


def side_of(settings: WhittedSettings) -> int:
    """Return how many samples a pixel has in a row; through corners there is one for each."""
    return settings.samples if settings.pixel == "centre" else 1


def film_of(settings: WhittedSettings) -> Film:
    """Return the film for a picture, on which nothing has been seen yet."""
    side = side_of(settings)
    return Film(settings.width, settings.height, side, settings.adaptive and side > 1)


def primary_rays(scene: Scene, settings: WhittedSettings, film: Film, first: int = 0) -> Rays:
    """Return the rays of a film's samples from a number on."""
    camera, side = camera_of(scene, settings), film.side
    rays = camera_rays(
        camera, settings.width * side, settings.height * side, settings.pixel == "corner",
        film.places(first),
    )  # fmt: skip
    return dataclasses.replace(rays, pixels=film.pixels(first).astype(np.int32))


def lights_of(scene: Scene, settings: WhittedSettings) -> tuple[Light, ...]:
    """Return the lights of a scene, or the one that stands in for them."""
    return scene.lights or (light_at(camera_of(scene, settings), scene),)


def light_at(camera: Camera, scene: Scene) -> Light:
    """Return a light over the left shoulder of who looks through a camera."""
    _, right, up = camera_axes(camera)
    position = np.asarray(camera.position, float)
    distance = float(np.linalg.norm(0.5 * (scene.lower + scene.upper) - position))
    return Light(POINT, position + 0.3 * distance * (up - right), name="over the shoulder")


def rays_only(batches: Generator[Batch, Hits, None]) -> Generator[Rays, Hits, None]:
    """Yield the rays of batches, and pass their hits on."""
    try:
        batch = next(batches)
        while True:
            batch = batches.send((yield batch.rays))
    except StopIteration:
        return
