"""Rays: the batch as arrays, the single ray as the kernels see it.

A ray is ``o + t d`` with ``t_min <= t <= t_max``; d need not have unit length. A batch says of each
ray as well where it comes from: its class, what it leaves, where it goes, when, for which pixel.

Slack
-----
Every slab test of a ray is widened by a few units in the last place of the coordinates involved,
by using ``o + slack`` for the low planes and ``o - slack`` for the high ones; it costs nothing in
the loop. A hit is clamped into the slab interval of its own triangle's box (see
:mod:`.triangle`). Since floating-point subtraction and multiplication are monotonic, the interval
of any box around that triangle contains it: no structure can lose a hit to rounding, and all of
them return the same bits.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernels import dispatched, implements, inlined, inner, unsigned
from .geometry import EVERY_OBJECT

CLOSEST = 0
"""Query: the nearest hit; of several at the same t the lowest primitive id."""
ANY = 1
"""Query: whether there is a hit at all (shadow rays); which one is reported is not defined."""
ALL = 2
"""Query: like CLOSEST, but the walk never stops early: the lines of the SAH's assumption."""

ULPS = 8 * np.finfo(np.float64).eps
"""Slack relative to the largest coordinate: three roundings in a slab test, with room."""

BYTES_PER_RAY = 520
"""Memory of a ray of a batch, its hit, its counters, and the temporaries of making them."""

NOBODY = -1
"""Source, target or pixel of a ray that has none."""


@dataclass(frozen=True)
class Rays:
    """A batch of rays; make it with :meth:`from_arrays`.

    Attributes
    ----------
    origins, directions : (n, 3) float64
    t_min, t_max : (n,) float64
    queries : (n,) uint8
        CLOSEST, ANY or ALL.
    classes : (n,) uint8
        Index into `class_names`: what each ray is for (primary, shadow, ...).
    class_names : tuple of str
    sources : (n,) int32
        The object that a ray leaves; NOBODY for one from a camera.
    targets : (n,) int32
        Where a ray goes, if that is known: for a shadow ray the number of the light.
    times : (n,) float64
        When it is under way: 0 at the first key of what moves, 1 at the second.
    masks : (n,) uint8
        It meets only instances whose masks have a bit in common with its own.
    pixels : (n,) int32
        Number of the pixel that it is for, row by row: that of the primary ray it descends from.
    """

    origins: np.ndarray
    directions: np.ndarray
    t_min: np.ndarray
    t_max: np.ndarray
    queries: np.ndarray
    classes: np.ndarray
    class_names: tuple[str, ...]
    sources: np.ndarray
    targets: np.ndarray
    times: np.ndarray
    masks: np.ndarray
    pixels: np.ndarray

    @classmethod
    def from_arrays(
        cls,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        *,
        t_min: np.ndarray | float = 0.0,
        queries: np.ndarray | int = CLOSEST,
        classes: np.ndarray | int = 0,
        class_names: tuple[str, ...] = ("ray",),
        sources: np.ndarray | int = NOBODY,
        targets: np.ndarray | int = NOBODY,
        times: np.ndarray | float = 0.0,
        masks: np.ndarray | int = EVERY_OBJECT,
        pixels: np.ndarray | int = NOBODY,
    ) -> Rays:
        """Check arrays and bring them into the one form the kernels take.

        Raises
        ------
        InputError
            If shapes differ, a number is not finite, a direction is zero, t_min is negative or
            beyond t_max, or a time is not in [0, 1].
        """
        if any(np.iscomplexobj(a) for a in (origins, directions, t_min, t_max, times)):
            raise InputError("rays are real numbers, not complex ones")
        # Kernels are compiled for writable C arrays; a read-only one would compile them anew.
        # Without -0.0: its inverse would be -inf, and a way into an instance's space ends in 0.0.
        origins = np.ascontiguousarray(origins, dtype=np.float64) + 0.0
        directions = np.ascontiguousarray(directions, dtype=np.float64) + 0.0
        count = len(origins)
        if origins.shape != (count, 3) or directions.shape != (count, 3):
            raise InputError(
                "origins and directions of rays must both be n x 3, "
                f"not {origins.shape} and {directions.shape}"
            )
        if count == 0:
            raise InputError("there are no rays; ask for at least one")
        if not (np.isfinite(origins).all() and np.isfinite(directions).all()):
            bad = ~(np.isfinite(origins).all(1) & np.isfinite(directions).all(1))
            raise InputError(f"{bad.sum()} rays are not finite, the first is ray {bad.argmax()}")
        zero = (directions[:, 0] == 0) & (directions[:, 1] == 0) & (directions[:, 2] == 0)
        if zero.any():
            raise InputError(
                f"{zero.sum()} rays have the direction zero, the first is ray {zero.argmax()}"
            )
        t_max = column("t_max", t_max, np.float64, count)
        if not (t_max >= 0).all():
            raise InputError("t_max of a ray must not be negative or NaN")
        t_min = column("t_min", t_min, np.float64, count)
        if not ((t_min >= 0) & (t_min <= t_max) & (t_min < np.inf)).all():
            raise InputError("t_min of a ray must be finite, at least 0 and at most its t_max")
        times = column("time", times, np.float64, count)
        if not ((times >= 0) & (times <= 1)).all():
            raise InputError("the time of a ray must be between 0 and 1")
        classes = column("class", classes, np.uint8, count)
        if int(classes.max()) >= len(class_names):
            raise InputError(f"rays are of class {classes.max()}, which has no name")
        return cls(
            origins, directions, t_min, t_max, column("query", queries, np.uint8, count),
            classes, class_names,
            column("source", sources, np.int32, count),
            column("target", targets, np.int32, count),
            times,
            column("mask", masks, np.uint8, count),
            column("pixel", pixels, np.int32, count),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.origins)

    def arrays(self) -> RayArrays:
        """Return what the kernels need."""
        return RayArrays(
            self.origins, self.directions, self.t_min, self.t_max, self.queries, self.times,
            self.masks, self.sources, self.targets,
        )  # fmt: skip

    def select(self, which: np.ndarray) -> Rays:
        """Return the rays at the indices `which`, or where the mask `which` is True."""
        return Rays(
            self.origins[which], self.directions[which],
            self.t_min[which], self.t_max[which], self.queries[which],
            self.classes[which], self.class_names, self.sources[which], self.targets[which],
            self.times[which], self.masks[which], self.pixels[which],
        )  # fmt: skip


def joined_rays(batches: Sequence[Rays]) -> Rays:
    """Return the rays of several batches, which name classes alike, one batch after the other."""
    first = batches[0]
    if len(batches) == 1:
        return first
    names = [field.name for field in dataclasses.fields(Rays) if field.name != "class_names"]
    columns = {name: np.concatenate([getattr(each, name) for each in batches]) for name in names}
    return Rays(class_names=first.class_names, **columns)


def column(name: str, values: np.ndarray | float, dtype: type, count: int) -> np.ndarray:
    """Return a column of a batch, (count,) of a type, from one value or one for each ray.

    Raises
    ------
    InputError
        If there are as many values as neither, or the type does not hold one of them.
    """
    given = np.asarray(values)
    if given.shape not in ((), (1,), (count,)):
        raise InputError(f"{name} must have one value per ray ({count})")
    with np.errstate(invalid="ignore"):
        held: np.ndarray = given.astype(dtype)
    if np.issubdtype(dtype, np.integer) and (held != given).any():
        raise InputError(f"{name} of a ray must be a whole number that fits into {held.dtype}")
    return np.array(np.broadcast_to(held, count))


class RayArrays(NamedTuple):
    """A batch of rays inside kernels; see :class:`Rays`."""

    origins: np.ndarray
    directions: np.ndarray
    t_min: np.ndarray
    t_max: np.ndarray
    queries: np.ndarray
    times: np.ndarray
    masks: np.ndarray
    sources: np.ndarray
    targets: np.ndarray


class Ray(NamedTuple):
    """One ray inside kernels, with everything precomputed that does not change along it.

    ``low_*`` and ``high_*`` are the origin moved by the slack, for the low and the high plane of a
    slab. ``kx, ky, kz``, ``shear_*`` and the permuted origin ``ok*`` serve the triangle test.
    """

    ox: float
    oy: float
    oz: float
    dx: float
    dy: float
    dz: float
    ix: float
    iy: float
    iz: float
    low_x: float
    low_y: float
    low_z: float
    high_x: float
    high_y: float
    high_z: float
    kx: np.uint64
    ky: np.uint64
    kz: np.uint64
    okx: float
    oky: float
    okz: float
    shear_x: float
    shear_y: float
    shear_z: float
    t_min: float
    t_max: float
    query: int
    time: float
    mask: int
    source: int
    target: int


@dispatched
def make_probe(batch, index, reach):
    """Return what goes through a structure for number `index` of a batch: a ray, or a cone.

    Parameters
    ----------
    batch : NamedTuple of arrays
        Decides the implementation.
    reach : (3,) float64
        The scene's largest |coordinate|.
    """
    raise TypeError(f"no probes in {type(batch).__name__}")


@inner
@implements(make_probe, RayArrays)
def make_ray(rays, index, reach):
    """Return ray number `index` of the batch; `reach` is the scene's largest |coordinate|, (3,)."""
    o, d = rays.origins[index], rays.directions[index]
    return ray_along(
        o[0], o[1], o[2], d[0], d[1], d[2], 1.0 / d[0], 1.0 / d[1], 1.0 / d[2], reach,
        rays.t_min[index], rays.t_max[index], rays.queries[index], rays.times[index],
        rays.masks[index], rays.sources[index], rays.targets[index],
    )  # fmt: skip


@inlined
def ray_along(
    ox, oy, oz, dx, dy, dz, ix, iy, iz, reach, t_min, t_max, query, time, mask, source, target
):  # fmt: skip
    """Return a ray from its origin, its direction and the inverse of that, with all that follows.

    Parameters
    ----------
    reach : (3,) float64
        The largest |coordinate| of what it may hit.
    """
    slack_x = ULPS * (abs(ox) + reach[0])
    slack_y = ULPS * (abs(oy) + reach[1])
    slack_z = ULPS * (abs(oz) + reach[2])
    # The triangle test looks along the axis of the largest component of d. Each number is chosen by
    # itself, not all at once: which axis it is cannot be guessed.
    along_y = abs(dy) > abs(dx)
    along_z = abs(dz) > (abs(dy) if along_y else abs(dx))
    kz = unsigned(2) if along_z else unsigned(1) if along_y else unsigned(0)
    kx = unsigned(0) if along_z else unsigned(2) if along_y else unsigned(1)
    ky = unsigned(1) if along_z else unsigned(0) if along_y else unsigned(2)
    okx = ox if along_z else oz if along_y else oy
    oky = oy if along_z else ox if along_y else oz
    okz = oz if along_z else oy if along_y else ox
    dkx = dx if along_z else dz if along_y else dy
    dky = dy if along_z else dx if along_y else dz
    dkz = dz if along_z else dy if along_y else dx
    return Ray(
        ox, oy, oz, dx, dy, dz, ix, iy, iz,
        ox + slack_x, oy + slack_y, oz + slack_z, ox - slack_x, oy - slack_y, oz - slack_z,
        kx, ky, kz, okx, oky, okz, dkx / dkz, dky / dkz, 1.0 / dkz,
        t_min, t_max, query, time, mask, source, target,
    )  # fmt: skip


@inlined
def line_of(ray):
    """Return the line that a ray lies on: the same ray, from any t to any other."""
    return Ray(
        ray.ox, ray.oy, ray.oz, ray.dx, ray.dy, ray.dz, ray.ix, ray.iy, ray.iz,
        ray.low_x, ray.low_y, ray.low_z, ray.high_x, ray.high_y, ray.high_z,
        ray.kx, ray.ky, ray.kz, ray.okx, ray.oky, ray.okz, ray.shear_x, ray.shear_y, ray.shear_z,
        -np.inf, np.inf, ray.query, ray.time, ray.mask, ray.source, ray.target,
    )  # fmt: skip
