"""Whitted's recursive ray tracing: all rays of a picture, and the picture.

Primary rays come from the camera; from what they hit, shadow rays go to the lights, and reflected
and refracted rays go on, from hit to hit (:mod:`.trees`). What they see is put together to the
picture (:mod:`.shading`, :mod:`.film`). Whoever uses it traces the rays.

All is the same on every machine and with any number of threads, but for what the mathematical
library's tangent of the angle of view and cosine of a spot light's cone may differ by in their last
digit, and the inverses of the matrices of instances.

T. Whitted: An improved illumination model for shaded display, CACM 23(6), 1980.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator

import numpy as np

from ...geometry.rays import Rays
from .. import POINT, Camera, Light, Scene
from ..camera_rays import camera_axes, camera_rays
from ..surfaces import Found
from .film import Film
from .trees import Batch, Trees

Batches = Generator[Batch, Found, None]
"""Rays that are to be traced; after each batch, the generator is sent its hits."""


def rays_of_film(camera: Camera, film: Film, first: int = 0, corner: bool = False) -> Rays:
    """Return the primary rays of a film's samples from a number on."""
    rays = camera_rays(
        camera, film.width * film.side, film.height * film.side, corner, film.places(first)
    )
    return dataclasses.replace(rays, pixels=film.pixels(first).astype(np.int32))


def batches_of(trees: Trees, camera: Camera, film: Film, first: Rays, contrast: float) -> Batches:
    """Yield all rays of a picture.

    After the primary rays of a depth follow the shadow rays from what they hit, then the next
    depth. Adaptive samples grow their trees one division of the film after the other.

    Parameters
    ----------
    first : Rays
        Those of the film before it is divided.
    """
    yield from trees.grow(first, 0)
    before = len(film)
    while film.divide(contrast):
        yield from trees.grow(rays_of_film(camera, film, before), before)
        before = len(film)


def lights_for(scene: Scene, camera: Camera) -> tuple[Light, ...]:
    """Return the lights of a scene; where it has none, one over the camera's left shoulder."""
    if scene.lights:
        return scene.lights
    _, right, up = camera_axes(camera)
    position = np.asarray(camera.position, float)
    distance = float(np.linalg.norm(0.5 * (scene.lower + scene.upper) - position))
    return (Light(POINT, position + 0.3 * distance * (up - right), name="over the shoulder"),)
