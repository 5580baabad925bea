"""Shadow rays: from what rays have hit to the lights."""

from __future__ import annotations

import numpy as np

from ...contract.structure import Hits
from ...errors import InputError
from ...geometry.rays import ANY, Rays
from ...scene import LIGHT_KINDS, Scene
from ...scene.camera_rays import SHADOW
from ...scene.light_ways import ways_to_lights
from ...scene.surfaces import surfaces_hit


def refuse_darkness(scene: Scene) -> None:
    """Raise InputError if a scene has no light: there are no shadow rays then."""
    if not scene.lights:
        raise InputError(
            f"{scene.name} has no light, so there are no shadow rays; add a light "
            f"({', '.join(LIGHT_KINDS)}), or leave the shadow rays out",
            scene.name,
        )


def shadow_rays(scene: Scene, primary: Rays, hits: Hits) -> Rays | None:
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
