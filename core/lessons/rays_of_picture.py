"""All rays of a small picture, traced once: what lessons about fewer rays take some of."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..contract.structure import Structure
from ..errors import InputError
from ..progress import Progress
from ..scene import Camera, Scene
from ..scene.whitted import batches_of, lights_for, rays_of_film
from ..scene.whitted.film import Film
from ..scene.whitted.trees import OF_SHADOW, Trees
from .drawing import BLUE, GREEN, ORANGE, Colour
from .one_ray import RAY

COLOURS: tuple[Colour, ...] = (RAY, ORANGE, BLUE, GREEN)
"""Of primary, shadow, reflected and refracted rays."""


class Ledger:
    """Takes what every ray adds, batch after batch, and what primary rays have hit."""

    def __init__(self) -> None:
        self.amounts: list[np.ndarray] = []
        self.objects: list[np.ndarray] = []

    def see(self, samples: np.ndarray, objects: np.ndarray) -> None:
        """Take the objects that primary rays have hit."""
        self.objects.append(objects)

    def add(self, samples: np.ndarray, amounts: np.ndarray) -> None:
        """Take what each ray of a batch adds to its sample."""
        self.amounts.append(amounts)


class PictureRays(NamedTuple):
    """Every ray of a picture.

    Attributes
    ----------
    film : Film
        On which nothing has been put: samples have their places there.
    objects : (n_samples,) int
        What each primary ray has hit, -1 for nothing.
    origins, ends : (n, 3) float64
        Where each ray begins, and where it hits or, for a shadow ray, its light is; infinite where
        there is nothing.
    directions : (n, 3) float64
        Of any length.
    classes : (n,) uint8
        Primary, shadow, reflected or refracted.
    depths, samples : (n,) int64
    strengths : (n,) float64
        The most that what a ray sees, or brings from a light, adds to a colour of its sample.
    parent_strengths : (n,) float64
        That of the ray from whose hit it starts.
    arriving : (n, 3) float64
        Of a shadow ray, what it adds if nothing is in its way; of others 0.
    amounts : (n, 3) float64
        What it does add.
    """

    film: Film
    objects: np.ndarray
    origins: np.ndarray
    ends: np.ndarray
    directions: np.ndarray
    classes: np.ndarray
    depths: np.ndarray
    samples: np.ndarray
    strengths: np.ndarray
    parent_strengths: np.ndarray
    arriving: np.ndarray
    amounts: np.ndarray

    def colours(self, chosen: np.ndarray, unasked: np.ndarray | None = None) -> np.ndarray:
        """Return what samples see, (n_samples, 3), by some of the rays, (n,) bool.

        Parameters
        ----------
        unasked : (n,) bool, optional
            Shadow rays whose light arrives, whatever is in their way.
        """
        count = len(self.film)
        amounts = self.amounts
        if unasked is not None:
            amounts, chosen = np.where(unasked[:, None], self.arriving, amounts), chosen | unasked
        channels = [
            np.bincount(self.samples[chosen], amounts[chosen, channel], count)
            for channel in range(3)
        ]
        return np.stack(channels, axis=1)


def rays_of_picture(
    structure: Structure,
    scene: Scene,
    camera: Camera,
    film: Film,
    depth: int,
    progress: Progress,
) -> PictureRays:
    """Trace all rays of a picture through a structure.

    Parameters
    ----------
    scene : Scene
        What the structure was built over; it may have other materials.

    Raises
    ------
    InputError
        If the camera sees nothing of the scene.
    Cancelled
        From `progress`.
    """
    ledger = Ledger()
    trees = Trees(scene, lights_for(scene, camera), depth, 0.0, ledger, progress)
    batches = batches_of(trees, camera, film, rays_of_film(camera, film), 1.0)
    batch, kept = next(batches), []
    before = np.ones(len(batch.rays))
    try:
        while True:
            hits, _ = structure.trace(batch.rays, progress=progress)
            rays = batch.rays
            t = np.where(np.isfinite(rays.t_max), rays.t_max, hits.t)
            with np.errstate(invalid="ignore"):
                ends = rays.origins + t[:, None] * rays.directions
            strengths, is_shadow = batch.weights.max(axis=1), rays.classes == OF_SHADOW
            kept.append((
                rays.origins, ends, rays.directions, rays.classes,
                np.full(len(rays), batch.depth), batch.samples, strengths, before[batch.parents],
                np.where(is_shadow[:, None], batch.weights, 0.0),
            ))  # fmt: skip
            if not is_shadow.any():
                before = strengths
            batch = batches.send(hits)
    except StopIteration:
        pass
    (objects,) = ledger.objects
    if (objects < 0).all():
        raise InputError(f"the camera of {scene.name} sees nothing of it; turn it towards the mesh")
    columns = [*map(np.concatenate, zip(*kept, strict=True)), np.concatenate(ledger.amounts)]
    return PictureRays(film, objects, *columns)
