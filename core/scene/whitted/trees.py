"""Trees of rays: from primary rays on, what each sends to the lights and on from where it has hit.

Rules of the Standard Procedural Databases (E. Haines, Readme 3.14, Testing Procedures 7 to 10):

- The primary ray is at depth 1; a hit at the greatest depth sends nothing on.
- A hit sends a shadow ray to each light on its side of the face, or several to an area light.
- It sends a reflected ray where its material reflects or transmits, and a refracted one where it
  transmits; in total reflection, a reflected ray alone. What transmits and reflects nothing has a
  reflected ray of weight zero.

Primitives are taken as seen from both sides: from behind, an opaque face is lit as from its front.
What a ray has hit from its inside it leaves, see :class:`..surfaces.Surfaces`.

Recursion by contribution: each ray has a weight, by which what it sees is multiplied on its way to
the picture (R. Hall, D. Greenberg: A testbed for realistic image synthesis, IEEE CG&A 3(8), 1983).
Where that of none of the three colours reaches the threshold, the ray is not sent. It then adds
nothing; but the light that a shadow ray was to ask for arrives unasked. Many a little makes a lot:
among seven lights none adds more than a fifth, and a picture without any would be black (G. Ward:
Adaptive shadow testing for ray tracing, EGWR 1991, estimates what it does not test as well).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Generator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ...geometry.rays import ANY, BYTES_PER_RAY, CLOSEST, NOBODY, Rays
from ...geometry.solids.frames import units_of
from ...memory import refuse_if_too_large
from ...progress import Progress
from .. import Light, Scene
from ..camera_rays import PRIMARY, REFLECTED, REFRACTED, SHADOW
from ..light_ways import CENTRES, Sampling, ways_to_lights
from ..surfaces import CHUNK, Found, Surfaces, surfaces_hit
from .optics import mirrored, refracted
from .shading import Surfacing, intensity, lit

CLASS_NAMES = PRIMARY, SHADOW, REFLECTED, REFRACTED

OF_PRIMARY, OF_SHADOW, OF_REFLECTED, OF_REFRACTED = range(4)
"""Classes by number."""


class Batch(NamedTuple):
    """Rays of one depth that are traced together.

    Attributes
    ----------
    rays : Rays
    depth : int
        Of a shadow ray, that of the ray whose hit it starts from.
    samples : (n,) int64
        Number of the primary ray that each descends from.
    parents : (n,) int64
        From whose hit each starts, among the rays of the last batch that is not of shadow rays;
        of primary rays, themselves.
    weights : (n, 3) float64
        By which what a ray sees is multiplied for its sample; of a shadow ray, what it adds to that
        if nothing is in its way.
    """

    rays: Rays
    depth: int
    samples: np.ndarray
    parents: np.ndarray
    weights: np.ndarray


class Receiver(Protocol):
    """What is told what every ray has seen."""

    def see(self, samples: np.ndarray, objects: np.ndarray) -> None:
        """Take the objects, -1 for none, that primary rays have hit."""

    def add(self, samples: np.ndarray, amounts: np.ndarray) -> None:
        """Take what each ray of a batch adds to its sample, (n, 3); once for every batch."""


class Spawned(NamedTuple):
    """Rays that go on from some rays of a batch: a row each."""

    parents: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    t_max: np.ndarray
    classes: np.ndarray
    targets: np.ndarray
    weights: np.ndarray


class Trees:
    """The trees of a picture's primary rays.

    Attributes
    ----------
    sent, spared : (depth, 4) int64
        Rays by depth and class, and those that were not sent for adding too little.
    """

    def __init__(
        self,
        scene: Scene,
        lights: Sequence[Light],
        depth: int,
        threshold: float,
        receiver: Receiver,
        progress: Progress,
        sampling: Sampling = CENTRES,
    ) -> None:
        self.scene, self.lights, self.progress = scene, lights, progress
        self.sampling = sampling
        self.depth, self.threshold, self.receiver = depth, threshold, receiver
        self.surfacing, self.intensity = Surfacing.of(scene), intensity(len(lights))
        self.sent = np.zeros((depth, len(CLASS_NAMES)), dtype=np.int64)
        self.spared = np.zeros_like(self.sent)

    def grow(self, rays: Rays, first_sample: int) -> Generator[Batch, Found, None]:
        """Yield primary rays, and what descends from them; be sent the hits of each batch.

        Parameters
        ----------
        first_sample : int
            Number of the sample that the first of them is; the others follow.

        Raises
        ------
        InputError
            If there would be more rays than fit into memory.
        Cancelled
            From the progress.
        """
        samples = np.arange(first_sample, first_sample + len(rays))
        self.sent[0, OF_PRIMARY] += len(rays)
        rays = dataclasses.replace(rays, class_names=CLASS_NAMES)
        batch: Batch | None = Batch(rays, 1, samples, np.arange(len(rays)), np.ones((len(rays), 3)))
        while batch is not None:
            hits = yield batch
            if batch.depth == 1:
                self.receiver.see(batch.samples, self.scene.objects_of(hits.primitive))
            shadows, batch = self._after(batch, hits)
            if shadows is not None:
                is_free = (yield shadows).primitive < 0
                self.receiver.add(shadows.samples, shadows.weights * is_free[:, None])

    def _after(self, batch: Batch, hits: Found) -> tuple[Batch | None, Batch | None]:
        """Return the shadow rays of a batch's hits, and the reflected and refracted ones."""
        hit = np.flatnonzero(hits.primitive >= 0)
        amounts = batch.weights * np.array(self.scene.background)
        shadows: list[Spawned] = []
        further: list[Spawned] = []
        for first in range(0, len(hit), CHUNK):
            self.progress.report(first, len(hit), "Making shadow, reflected and refracted rays")
            numbers = hit[first : first + CHUNK]
            surfaces = surfaces_hit(self.scene, batch.rays, hits, numbers)
            made_of = self.surfacing.at(self.scene.materials_of(hits.primitive[numbers]))
            amounts[numbers] = batch.weights[numbers] * made_of.matt * self.intensity
            directions = units_of(batch.rays.directions[numbers])[0]
            mirrors = mirrored(directions, surfaces.normals)
            shadows.append(self._to_lights(batch, surfaces, made_of, mirrors, amounts))
            if batch.depth < self.depth:
                further.append(self._onward(batch, surfaces, made_of, directions, mirrors))
            self._refuse_too_many(batch)
        if len(hit):
            self.progress.report(len(hit), len(hit), "Making shadow, reflected and refracted rays")
        self.receiver.add(batch.samples, amounts)
        return (
            self._batch(batch, hits, shadows, batch.depth, ANY),
            self._batch(batch, hits, further, batch.depth + 1, CLOSEST),
        )

    def _to_lights(
        self,
        batch: Batch,
        surfaces: Surfaces,
        made_of: Surfacing,
        mirrors: np.ndarray,
        amounts: np.ndarray,
    ) -> Spawned:
        """Return the shadow rays from surfaces; the light of others goes into the amounts."""
        ways = ways_to_lights(surfaces, self.lights, self.sampling)
        of = ways.surfaces
        to_light = units_of(ways.directions)[0]
        arriving = lit(made_of.at(of), surfaces.normals[of], mirrors[of], to_light)
        weights = batch.weights[surfaces.rays[of]] * arriving
        weights *= (self.intensity * ways.shares)[:, None]
        sent = weights.max(axis=1, initial=0.0) >= self.threshold
        self._count(batch.depth, np.full(len(of), OF_SHADOW), sent)
        np.add.at(amounts, surfaces.rays[of[~sent]], weights[~sent])
        return Spawned(
            surfaces.rays[of[sent]], ways.origins[sent], ways.directions[sent], ways.ends[sent],
            np.full(int(sent.sum()), OF_SHADOW), ways.lights[sent], weights[sent],
        )  # fmt: skip

    def _onward(
        self,
        batch: Batch,
        surfaces: Surfaces,
        made_of: Surfacing,
        directions: np.ndarray,
        mirrors: np.ndarray,
    ) -> Spawned:
        """Return the reflected and refracted rays from surfaces, those of one beside each other."""
        index = made_of.index_of_refraction
        ratios = np.where(surfaces.is_inside, index, 1.0 / index)
        through, is_total = refracted(directions, surfaces.normals, ratios)
        transmits = made_of.transmission.any(axis=1)
        is_total &= transmits
        # What cannot get out is reflected as well.
        held = np.where(is_total[:, None], made_of.transmission, 0.0)
        reflected = np.minimum(made_of.specular + held, 1.0)
        weights = np.stack([reflected, made_of.transmission - held], axis=1)
        weights *= batch.weights[surfaces.rays][:, None]

        is_mirror = made_of.specular.any(axis=1) | transmits
        goes_on = np.stack([is_mirror, transmits & ~is_total], axis=1)
        # Seen exactly edge-on, a face has no sides for a ray to go on from.
        goes_on &= surfaces.normals.any(axis=1)[:, None]
        of, way = np.nonzero(goes_on)
        weights = weights[goes_on]
        sent = weights.max(axis=1, initial=0.0) >= self.threshold
        classes = np.array([OF_REFLECTED, OF_REFRACTED])[way]
        self._count(batch.depth + 1, classes, sent)

        offsets = surfaces.offsets[:, None] * surfaces.normals
        origins = np.stack([surfaces.points + offsets, surfaces.points - offsets], axis=1)
        onward = units_of(np.stack([mirrors, through], axis=1)[goes_on][sent])[0]
        count = len(onward)
        return Spawned(
            surfaces.rays[of[sent]], origins[goes_on][sent], onward, np.full(count, np.inf),
            classes[sent], np.full(count, NOBODY), weights[sent],
        )  # fmt: skip

    def _count(self, depth: int, classes: np.ndarray, sent: np.ndarray) -> None:
        """Take note of rays of some classes, and which of them are sent."""
        for tally, which in ((self.sent, sent), (self.spared, ~sent)):
            tally[depth - 1] += np.bincount(classes[which], minlength=len(CLASS_NAMES))

    def _refuse_too_many(self, batch: Batch) -> None:
        """Raise InputError before rays are made that do not fit into memory with all before."""
        count = int(self.sent.sum())
        refuse_if_too_large(
            count * BYTES_PER_RAY,
            f"the {count} rays up to depth {batch.depth + 1}",
            "lower depth, samples, width or height of the rays, or raise their threshold",
        )

    def _batch(
        self, parents: Batch, hits: Found, parts: list[Spawned], depth: int, query: int
    ) -> Batch | None:
        """Return rays that go on as a batch; None if there are none."""
        if not sum(len(part.parents) for part in parts):
            return None
        new = Spawned(*map(np.concatenate, zip(*parts, strict=True)))
        of, rays = new.parents, parents.rays
        return Batch(
            Rays.from_arrays(
                new.origins, new.directions, new.t_max, queries=query, classes=new.classes,
                class_names=CLASS_NAMES, sources=hits.primitive[of], targets=new.targets,
                times=rays.times[of], masks=rays.masks[of], pixels=rays.pixels[of],
            ),
            depth, parents.samples[of], of, new.weights,
        )  # fmt: skip
