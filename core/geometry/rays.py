"""Rays: the batch as arrays, the single ray as the kernels see it.

A ray is ``o + t d`` with ``0 <= t <= t_max``; d need not have unit length.

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

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..kernels import inner

CLOSEST = 0
"""Query: the nearest hit; of several at the same t the lowest primitive id."""
ANY = 1
"""Query: whether there is a hit at all (shadow rays); which one is reported is not defined."""
ALL = 2
"""Query: like CLOSEST, but the walk never stops early: the lines of the SAH's assumption."""

ULPS = 8 * np.finfo(np.float64).eps
"""Slack relative to the largest coordinate: three roundings in a slab test, with room."""


@dataclass(frozen=True)
class Rays:
    """A batch of rays; make it with :meth:`from_arrays`.

    Attributes
    ----------
    origins, directions, inverse : (n, 3) float64
        `inverse` is ``1 / directions`` with IEEE infinities.
    t_max : (n,) float64
    queries : (n,) uint8
        CLOSEST, ANY or ALL.
    classes : (n,) uint8
        Index into `class_names`: what each ray is for (primary, shadow, ...).
    class_names : tuple of str
    """

    origins: np.ndarray
    directions: np.ndarray
    inverse: np.ndarray
    t_max: np.ndarray
    queries: np.ndarray
    classes: np.ndarray
    class_names: tuple[str, ...]

    @classmethod
    def from_arrays(
        cls,
        origins: np.ndarray,
        directions: np.ndarray,
        t_max: np.ndarray | float = np.inf,
        *,
        queries: np.ndarray | int = CLOSEST,
        classes: np.ndarray | int = 0,
        class_names: tuple[str, ...] = ("ray",),
    ) -> Rays:
        """Check arrays and bring them into the one form the kernels take.

        Raises
        ------
        InputError
            If shapes differ, a number is not finite, a direction is zero or t_max is negative.
        """
        if np.iscomplexobj(origins) or np.iscomplexobj(directions) or np.iscomplexobj(t_max):
            raise InputError("rays are real numbers, not complex ones")
        # Kernels are compiled for writable C arrays; a read-only one would compile them anew.
        origins = np.require(origins, np.float64, ["C", "W"])
        directions = np.ascontiguousarray(directions, dtype=np.float64) + 0.0  # no -0.0
        count = len(origins)
        if origins.shape != (count, 3) or directions.shape != (count, 3):
            raise InputError(
                "origins and directions of rays must both be n x 3, "
                f"not {origins.shape} and {directions.shape}"
            )
        if count == 0:
            raise InputError("there are no rays; ask for at least one")
        bad = ~(np.isfinite(origins).all(1) & np.isfinite(directions).all(1))
        if bad.any():
            raise InputError(f"{bad.sum()} rays are not finite, the first is ray {bad.argmax()}")
        zero = ~directions.any(axis=1)
        if zero.any():
            raise InputError(
                f"{zero.sum()} rays have the direction zero, the first is ray {zero.argmax()}"
            )
        try:
            t_max = np.array(np.broadcast_to(t_max, count), dtype=np.float64)
        except ValueError:
            raise InputError(f"t_max must have one value per ray ({count})") from None
        if not (t_max >= 0).all():
            raise InputError("t_max of a ray must not be negative or NaN")
        with np.errstate(divide="ignore", over="ignore"):
            inverse = 1.0 / directions
        return cls(
            origins, directions, inverse, t_max,
            np.array(np.broadcast_to(queries, count), dtype=np.uint8),
            np.array(np.broadcast_to(classes, count), dtype=np.uint8),
            class_names,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.origins)

    def arrays(self) -> RayArrays:
        """Return what the kernels need."""
        return RayArrays(self.origins, self.directions, self.inverse, self.t_max, self.queries)

    def select(self, which: np.ndarray) -> Rays:
        """Return the rays at the indices `which`, or where the mask `which` is True."""
        return Rays(
            self.origins[which], self.directions[which], self.inverse[which],
            self.t_max[which], self.queries[which], self.classes[which], self.class_names,
        )  # fmt: skip


class RayArrays(NamedTuple):
    """A batch of rays inside kernels; see :class:`Rays`."""

    origins: np.ndarray
    directions: np.ndarray
    inverse: np.ndarray
    t_max: np.ndarray
    queries: np.ndarray


class Ray(NamedTuple):
    """One ray inside kernels, with everything precomputed that does not change along it.

    ``low_*`` and ``high_*`` are the origin moved by the slack, for the low and the high plane of a
    slab. ``kx, ky, kz``, ``shear_*`` and the permuted origin ``ok*`` serve the triangle test; the
    former are unsigned, for which Numba omits the look at negative indices.
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
    t_max: float
    query: int


@inner
def make_ray(rays, index, reach):
    """Return ray number `index` of the batch; `reach` is the scene's largest |coordinate|, (3,)."""
    o, d, inverse = rays.origins[index], rays.directions[index], rays.inverse[index]
    slack_x = ULPS * (abs(o[0]) + reach[0])
    slack_y = ULPS * (abs(o[1]) + reach[1])
    slack_z = ULPS * (abs(o[2]) + reach[2])
    # The triangle test looks along the axis of the largest component of d.
    kz = 0
    if abs(d[1]) > abs(d[kz]):
        kz = 1
    if abs(d[2]) > abs(d[kz]):
        kz = 2
    kx = (kz + 1) % 3
    ky = (kx + 1) % 3
    return Ray(
        o[0], o[1], o[2], d[0], d[1], d[2], inverse[0], inverse[1], inverse[2],
        o[0] + slack_x, o[1] + slack_y, o[2] + slack_z,
        o[0] - slack_x, o[1] - slack_y, o[2] - slack_z,
        np.uint64(kx), np.uint64(ky), np.uint64(kz), o[kx], o[ky], o[kz],
        d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz],
        rays.t_max[index], rays.queries[index],
    )  # fmt: skip
