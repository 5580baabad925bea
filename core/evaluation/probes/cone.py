"""The probes ``cone`` and ``pyramid``: one for each pixel, around the ray through its middle."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...contract.structure import Structure
from ...errors import InputError
from ...geometry.cones import ROUND, SQUARE, Spread
from ...probes.coverage import Covering
from ...probes.flat_shading import flat_colours
from ...progress import SILENT, Progress
from ...scene import PERSPECTIVE, Camera, Scene
from ...scene.as_triangles import as_triangles, as_triangles_and_spheres
from ...scene.camera_rays import Window, camera_axes, camera_rays, window_of
from ...scene.whitted import lights_for
from ...settings import setting
from ..rays.camera import camera_of
from ..records.experiment import build
from .probe import Cast, Probe, ProbeSettings, refuse_impossible, shares_of_objects

SAME_AREA = 1.0 / math.sqrt(math.pi)
"""Radius of a circle that has the area of a unit square."""

ROUNDING = 1e-12
"""By how much the sides of a pixel may differ that is a square, relative to them."""


@dataclass(frozen=True)
class PixelSettings(ProbeSettings):
    """Settings of a picture of which each pixel has a probe of its own."""

    width: int = setting(64, "Width", "Pixels in a row", unit="pixels", minimum=1, maximum=4096)
    height: int = setting(48, "Height", "Rows of pixels", unit="pixels", minimum=1, maximum=4096)


@dataclass(frozen=True)
class ConeSettings(PixelSettings):
    """Settings of cones."""

    radius: float = setting(
        round(SAME_AREA, 6), "Radius", "Of the circle around the middle of a pixel, whose area it "
        "has by default", unit="pixels", minimum=0.01, maximum=10.0,
    )  # fmt: skip


@dataclass(frozen=True)
class PyramidSettings(PixelSettings):
    """Settings of pyramids."""

    side: float = setting(
        1.0, "Side", "Of the square around the middle of a pixel", unit="pixels", minimum=0.01,
        maximum=10.0,
    )  # fmt: skip


class ConeProbe(Probe):
    """Cones through any structure that takes them: what is covered, by exact areas."""

    name = "cone"
    label = "Cone"
    summary = "A cone for each pixel, elliptic where pixels are not square"
    Settings: ClassVar[type] = ConeSettings
    structure = "bvh"
    shape: ClassVar[str] = ROUND

    @classmethod
    def half_width(cls, settings: Any) -> float:
        """Return the half-width of a probe, in pixels."""
        return float(settings.radius)

    @classmethod
    def cast(
        cls,
        scene: Scene,
        structure: type[Structure],
        structure_settings: Any,
        settings: Any,
        progress: Progress = SILENT,
    ) -> Cast:
        """Build the structure, and ask for each pixel what covers how much of its probe."""
        if not structure.takes_cones:
            raise InputError(f"cones do not go through {structure.name}; choose another structure")
        refuse_impossible(settings)
        scene = scene.flat()
        camera, width, height = camera_of(scene, settings), settings.width, settings.height
        if camera.kind != PERSPECTIVE:
            raise InputError(f"a {cls.name} has an apex; choose a perspective camera")
        rays, window = camera_rays(camera, width, height), window_of(camera, width, height)
        right = camera_axes(camera)[1]
        first = cls.spread(camera, window, settings, rays.directions[0], right)
        if first.is_circular:
            scene = as_triangles_and_spheres(scene, "cones meet triangles and spheres only")
        else:
            scene = as_triangles(scene, f"{cls.name}s meet triangles only")
        built = build(scene, structure, structure_settings, progress)
        covering = Covering(built.structure)
        lights, apex = lights_for(scene, camera), np.asarray(camera.position, float)
        numbers = np.arange(len(scene))
        colours = flat_colours(scene, numbers, covering.planes, covering.middles, apex, lights)
        background = np.array(scene.background, dtype=np.float64)
        picture, covered = np.empty((width * height, 3)), np.empty(width * height)
        totals: dict[int, float] = {}
        met = 0
        covering.coverage(rays, 0, first)
        start = time.perf_counter()
        for pixel in range(width * height):
            if pixel % 64 == 0:
                progress.report(pixel, width * height, f"Casting {cls.name}s")
            spread = cls.spread(camera, window, settings, rays.directions[pixel], right)
            seen = covering.coverage(rays, pixel, spread)
            covered[pixel] = share = seen.shares.sum()
            spheres = seen.items[covering.radii[seen.items] > 0.0]
            if len(spheres):
                planes, middles = covering.facing(spheres, apex, rays.directions[pixel])
                colours[spheres] = flat_colours(scene, spheres, planes, middles, apex, lights)
            picture[pixel] = seen.shares @ colours[seen.items] + (1.0 - share) * background
            met += len(seen.items)
            for item, part in zip(seen.items.tolist(), seen.shares.tolist(), strict=True):
                totals[item] = totals.get(item, 0.0) + part
        seconds = time.perf_counter() - start
        partly = (covered > 1e-9) & (covered < 1.0 - 1e-9)
        figures = {
            "probes": width * height,
            "triangles": len(scene) - int((covering.radii > 0.0).sum()),
            "spheres": int((covering.radii > 0.0).sum()),
            "seen_per_probe": met / (width * height),
            "covered": float(covered.mean()),
            "at_edges": float(partly.mean()),
        }
        shares = {item: part / (width * height) for item, part in sorted(totals.items())}
        return Cast(
            built.structure, built.seconds, seconds, figures, picture.reshape(height, width, 3),
            covered.reshape(height, width), shares_of_objects(scene, shares),
        )  # fmt: skip

    @classmethod
    def spread(
        cls, camera: Camera, window: Window, settings: Any, way: np.ndarray, right: np.ndarray
    ) -> Spread:
        """Return what is around the ray through a pixel: as much solid angle as the pixel has.

        Parameters
        ----------
        way : (3,) float64
            The ray's direction, 1 along the view direction.
        right : (3,) float64
            Where rows run.
        """
        length = float(np.linalg.norm(way))
        # Of a pixel that is seen aslant, the cosine's root in either direction.
        scale = cls.half_width(settings) * 2.0 / length / math.sqrt(length)
        wide = scale * window.half_width / settings.width
        high = scale * window.half_height / settings.height
        if math.isclose(wide, high, rel_tol=ROUNDING):
            return Spread(math.atan(wide), None, cls.shape, right)
        return Spread(math.atan(wide), math.atan(high), cls.shape, right)


class PyramidProbe(ConeProbe):
    """Pyramids through any structure that takes cones."""

    name = "pyramid"
    label = "Pyramid"
    summary = "A pyramid for each pixel, around the ray through its middle"
    Settings = PyramidSettings
    shape = SQUARE

    @classmethod
    def half_width(cls, settings: Any) -> float:
        """Return the half-width of a probe, in pixels."""
        return 0.5 * float(settings.side)
