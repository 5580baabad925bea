"""Shadow rays: from what rays have hit to the lights."""

from __future__ import annotations

import numpy as np

from ..geometry.rays import ANY, Rays
from . import Scene
from .camera_rays import SHADOW
from .light_ways import ways_to_lights
from .surfaces import Found, surfaces_hit


def shadow_rays(scene: Scene, primary: Rays, hits: Found) -> Rays | None:
    """Return the shadow rays of primary rays; None if there are none.

    From every hit one ray goes to each light that is on the viewer's side of the face and shines
    there. Its source is the item that was hit, its target the number of the light.
    """
    surfaces = surfaces_hit(scene, primary, hits, np.flatnonzero(hits.primitive >= 0))
    ways = ways_to_lights(surfaces, scene.lights)
    if not len(ways.origins):
        return None
    of = surfaces.rays[ways.surfaces]
    return Rays.from_arrays(
        ways.origins, ways.directions, ways.ends,
        queries=ANY, classes=primary.class_names.index(SHADOW), class_names=primary.class_names,
        sources=hits.primitive[of], targets=ways.lights, times=primary.times[of],
        pixels=primary.pixels[of],
    )  # fmt: skip
