"""The workload ``whitted``: all rays of a picture by Whitted's recursive ray tracing.

See :mod:`...scene.whitted`. Rays can be saved in two ways: by not sending those that would add too
little, and by taking many samples of a pixel only where the picture needs them.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar

from ...contract.structure import Hits
from ...errors import InputError
from ...geometry.rays import BYTES_PER_RAY, Rays
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.light_ways import Sampling
from ...scene.whitted import Batches, batches_of, lights_for, rays_of_film
from ...scene.whitted.film import Film
from ...scene.whitted.trees import Trees
from ...settings import GIVEN, setting
from .camera import ViewSettings, camera_of, camera_used, refuse_no_view
from .picture_outcome import FIGURES, Pictured
from .workload import Generations, Workload, ray_order

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
        "white; light that no shadow ray asks for arrives. 0 sends all", minimum=0.0, maximum=1.0,
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
    light_samples: int = setting(
        0, "Light Samples", "Shadow rays from a hit to points on each area light; 0 sends one to "
        "its centre", unit="rays", minimum=0, maximum=1024,
    )  # fmt: skip
    seed: int = setting(
        1, "Seed", "Start of the numbers by which points on lights are chosen", minimum=0,
        only_for={"light_samples": GIVEN},
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
        if WhittedWorkload.unsparing(settings) is not None:
            refuse_if_too_large(
                pixels * places * BYTES_PER_RAY,
                f"{where}: comparing with {places} samples of {pixels} pixels",
                "set compare=false, or lower width, height or samples",
            )
        refuse_no_view(settings)

    @staticmethod
    def make(scene: Scene, settings: WhittedSettings) -> Rays:
        """Return the primary rays; of adaptive samples, the first of each pixel."""
        WhittedWorkload.refuse_impossible(settings)
        camera, film = camera_of(scene, settings), film_of(settings)
        return rays_of_film(camera, film, corner=settings.pixel == "corner")

    @staticmethod
    def generations(
        scene: Scene, settings: WhittedSettings, first: Rays, progress: Progress = SILENT
    ) -> Generations:
        """Yield primary rays, and depth by depth what descends from them; return the picture.

        After the hits of each depth follow the shadow rays from there, then the next depth.
        Adaptive samples grow their trees one division of the film after the other.
        """
        camera, film = camera_of(scene, settings), film_of(settings)
        trees = Trees(
            scene, lights_for(scene, camera), settings.depth, settings.threshold, film, progress,
            Sampling(settings.light_samples, settings.seed),
        )  # fmt: skip
        yield from rays_only(batches_of(trees, camera, film, first, settings.contrast))
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
        lights = lights_for(scene, camera_of(scene, settings))
        return camera | {"lights": [each.to_json() for each in lights]}


def side_of(settings: WhittedSettings) -> int:
    """Return how many samples a pixel has in a row; through corners there is one for each."""
    return settings.samples if settings.pixel == "centre" else 1


def film_of(settings: WhittedSettings) -> Film:
    """Return the film for a picture, on which nothing has been seen yet."""
    side = side_of(settings)
    return Film(settings.width, settings.height, side, settings.adaptive and side > 1)


def rays_only(batches: Batches) -> Generator[Rays, Hits, None]:
    """Yield the rays of batches, and pass their hits on."""
    try:
        batch = next(batches)
        while True:
            batch = batches.send((yield batch.rays))
    except StopIteration:
        return
