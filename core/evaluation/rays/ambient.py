"""The workload ``ambient``: how open the sky is above what the camera sees (ambient occlusion).

From each hit of a primary ray rays go into the half-space above the face. Their density is
proportional to the cosine of the angle with the normal, so that the share of those that hit nothing
is how much light an even sky would send there (S. Zhukov, A. Iones, G. Kronin: An ambient light
illumination model, EGWR 1998). They leave in all directions, unlike shadow rays to a light, and
only whether they hit anything counts.

A direction is the normal of the sphere above a point uniform in its disc (Malley's method). The
points are drawn by rejection, without sine or cosine: the same on every machine.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...contract.figures import Figure
from ...contract.structure import Hits
from ...geometry.rays import ANY, Rays
from ...geometry.solids.frames import across
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.camera_rays import AMBIENT, PRIMARY
from ...scene.surfaces import CHUNK, Surfaces, surfaces_hit
from ...settings import setting
from .camera import ViewSettings, ViewWorkload, primary_rays
from .ray_files import BYTES_PER_RAY
from .workload import Generations, ray_order

CLASS_NAMES = PRIMARY, AMBIENT


@dataclass(frozen=True)
class AmbientSettings(ViewSettings):
    """Settings of the ambient rays."""

    rays: ClassVar[str] = "ambient"

    count: int = setting(16, "Count", "Ambient rays from each hit", unit="rays", minimum=1)
    distance: float = setting(
        0.0, "Distance", "How far ambient rays go, in scene units; 0 lets them go on for ever",
        minimum=0.0, unset="auto",
    )  # fmt: skip
    seed: int = setting(1, "Seed", "Start of the random numbers", minimum=0)
    order: str = ray_order()


@dataclass(frozen=True)
class Openness:
    """The outcome of ``ambient``.

    Attributes
    ----------
    open : (height, width) float64
        Share of the ambient rays of each pixel that hit nothing; 1 where the primary ray does.
    """

    open: np.ndarray

    @property
    def picture(self) -> np.ndarray:
        """What is open in grey, (height, width, 3)."""
        return np.repeat(self.open[..., None], 3, axis=2)

    @property
    def samples(self) -> np.ndarray:
        """One of each pixel, (height, width)."""
        return np.ones(self.open.shape, dtype=np.int64)

    def to_json(self) -> dict[str, Any]:
        """Return the figures by their keys."""
        return {"mean_openness": float(self.open.mean())}

    def against(self, whole: Any) -> Any:
        """Return this: no ray is saved."""
        return self


class AmbientWorkload(ViewWorkload):
    """Primary rays, and from each of their hits rays into the half-space above.

    Faces are taken as seen from both sides: above is where the camera is.
    """

    name = "ambient"
    label = "Ambient"
    summary = "From what the camera sees, rays into the half-space above, denser around the normal"
    Settings = AmbientSettings
    FIGURES = (
        Figure(
            "mean_openness",
            "share of ambient rays that hit nothing, mean of all pixels; 1 where nothing is seen",
            "Mean openness", "", "Rays",
        ),
    )  # fmt: skip

    @staticmethod
    def make(scene: Scene, settings: AmbientSettings) -> Rays:
        """Return the primary rays."""
        return dataclasses.replace(primary_rays(scene, settings), class_names=CLASS_NAMES)

    @staticmethod
    def generations(
        scene: Scene, settings: AmbientSettings, first: Rays, progress: Progress = SILENT
    ) -> Generations:
        """Yield the primary rays, then the ambient ones; return how open the sky is."""
        hits = yield first
        shares = np.ones(len(first))
        hit = np.flatnonzero(hits.primitive >= 0)
        if len(hit):
            ambient, owners = ambient_rays(scene, settings, first, hits, hit, progress)
            if ambient is not None:
                is_blocked = (yield ambient).primitive >= 0
                n_blocked = np.bincount(owners[is_blocked], minlength=len(first))
                shares -= n_blocked / settings.count
        return Openness(shares.reshape(settings.height, settings.width))


def ambient_rays(
    scene: Scene,
    settings: AmbientSettings,
    primary: Rays,
    hits: Hits,
    hit: np.ndarray,
    progress: Progress,
) -> tuple[Rays | None, np.ndarray]:
    """Return the ambient rays from some hits, and which of the primary rays each comes from.

    Those of a hit follow each other. A face that is seen exactly edge-on has none; where there are
    no others, there are no rays.

    Parameters
    ----------
    hit : (n,) int
        Numbers of the primary rays that have hit.

    Raises
    ------
    InputError
        If they do not fit into memory.
    Cancelled
        From `progress`.
    """
    count = len(hit) * settings.count
    refuse_if_too_large(
        (len(primary) + count) * BYTES_PER_RAY, f"rays ambient: {count} rays from {len(hit)} hits",
        "lower count, width or height",
    )  # fmt: skip
    random = np.random.default_rng(settings.seed)
    parts: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    step = max(CHUNK // settings.count, 1)
    for first in range(0, len(hit), step):
        progress.report(first, len(hit), "Making ambient rays")
        surfaces = surfaces_hit(scene, primary, hits, hit[first : first + step])
        directions = upward(surfaces, settings.count, random)
        origins = surfaces.points + surfaces.offsets[:, None] * surfaces.normals
        has_side = np.repeat(surfaces.normals.any(axis=1), settings.count)
        owners = np.repeat(surfaces.rays, settings.count)
        origins = np.repeat(origins, settings.count, axis=0)
        parts.append((owners[has_side], origins[has_side], directions[has_side]))
    progress.report(len(hit), len(hit), "Making ambient rays")
    owners, origins, directions = map(np.concatenate, zip(*parts, strict=True))
    if not len(owners):
        return None, owners
    rays = Rays.from_arrays(
        origins, directions, settings.distance or np.inf, queries=ANY,
        classes=CLASS_NAMES.index(AMBIENT), class_names=CLASS_NAMES,
        sources=hits.primitive[owners], times=primary.times[owners], pixels=primary.pixels[owners],
    )  # fmt: skip
    return rays, owners


def upward(surfaces: Surfaces, count: int, random: np.random.Generator) -> np.ndarray:
    """Return unit vectors into the half-spaces above surfaces, (n * count, 3).

    Their density is proportional to the cosine of the angle with the normal.
    """
    x, y = disc_points(len(surfaces.rays) * count, random)
    z = np.sqrt(np.maximum(1.0 - x * x - y * y, 0.0))
    u, v = across(surfaces.normals)
    axes = (np.repeat(axis, count, axis=0) for axis in (u, v, surfaces.normals))
    return sum(part[:, None] * axis for part, axis in zip((x, y, z), axes, strict=True))


def disc_points(count: int, random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y of points uniform in the unit disc, (count,) each, drawn by rejection."""
    kept: list[np.ndarray] = []
    missing = count
    while missing > 0:
        points = 2.0 * random.random((missing + missing // 3 + 8, 2)) - 1.0
        points = points[(points * points).sum(axis=1) < 1.0][:missing]
        kept.append(points)
        missing -= len(points)
    x, y = np.concatenate(kept).T if kept else np.empty((2, 0))
    return x, y
