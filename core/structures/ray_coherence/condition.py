"""The coherence condition: in which directions a ray from one sphere may hit another.

Let the spheres have the centres S1 and S2, d apart, and the radii R1 and R2. Of all rays that start
in the first and hit the second, none turns farther away from S2 - S1 than one along a common inner
tangent: that passes both centres at R1 and R2, on either side, so

    sin a = (R1 + R2) / d            cos a = sqrt(1 - ((R1 + R2) / d)^2)

The lecture's slide "Ray coherence" has sqrt(1 - (R1 + R2) / d), without the square. That holds as
well, for what is squared is at most 1, but the cap of directions is larger: 10.2 times at
(R1 + R2) / d = 0.1, 2.2 times at 0.5 (REFERENCE.md 0.1). Spheres that overlap see each other in all
directions.

Only the direction of a ray is asked, not where in the sphere it starts: a cell of the cube around
S1 lists the second sphere if one of its directions is within the angle.

M. Ohta, M. Maekawa: Ray Coherence Theorem and Constant Time Ray Tracing Algorithm, Computer
Graphics 1987 (Proceedings of CG International), 303-314.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...kernels import inlined, inner, whole

EXACT, LECTURE = "exact", "lecture"
"""The two bounds, with and without the square."""

MARGIN = 1e-12
"""Of u and v: what is rounded in finding a ray's cell."""


def cosine(radii: np.ndarray | float, distances: np.ndarray | float, bound: str) -> np.ndarray:
    """Return the least cosine between a ray from one sphere to another and the line of centres.

    Parameters
    ----------
    radii : (n,) float64
        Sums R1 + R2.
    distances : (n,) float64
        Of the centres.
    bound : {EXACT, LECTURE}

    Returns
    -------
    (n,) float64
        -1 for spheres that overlap.
    """
    radii, distances = np.broadcast_arrays(np.asarray(radii, float), distances)
    share = np.divide(radii, distances, out=np.ones_like(radii), where=distances > radii)
    share = share * share if bound == EXACT else share
    return np.where(distances > radii, np.sqrt(1.0 - share), -1.0)


def solid_angle(cosines: np.ndarray | float) -> np.ndarray:
    """Return the solid angle of caps whose border has these cosines."""
    return 2.0 * np.pi * (1.0 - np.asarray(cosines))


class Window(NamedTuple):
    """The directions of a cell: through ``u0 <= u <= u1``, ``v0 <= v <= v1`` of a face."""

    face: int | np.integer
    u0: float
    v0: float
    u1: float
    v1: float


@inlined
def window_of(size, cell):
    """Return the directions of a cell, a little more than all of them.

    Parameters
    ----------
    size : int
        Cells along an edge of a face.
    cell : int
        ``(face size + j) size + i``, with i along u.
    """
    i, j = cell % size, cell // size % size
    step = 2.0 / size
    return Window(
        whole(cell // (size * size)),
        i * step - (1.0 + MARGIN), j * step - (1.0 + MARGIN),
        (i + 1) * step - (1.0 - MARGIN), (j + 1) * step - (1.0 - MARGIN),
    )  # fmt: skip


@inlined
def is_within(u, v, x, y, z, squared):
    """Say whether the direction u, v, 1 is within an angle of a vector."""
    a, b, c = y - v * z, u * z - x, x * v - y * u
    most = squared * (x * x + y * y + z * z) * (u * u + v * v + 1.0)
    return u * x + v * y + z > 0.0 and a * a + b * b + c * c <= most


@inner
def edge_is_within(u, v0, v1, x, y, z, squared):
    """Say whether a direction through an edge, at u and from v0 to v1, is within an angle.

    Along the edge the cosine has one maximum if ``u x + z`` is positive, else it is largest at an
    end.
    """
    along = u * x + z
    if not along > 0.0:
        return is_within(u, v0, x, y, z, squared) or is_within(u, v1, x, y, z, squared)
    v = y * (u * u + 1.0) / along
    v = v0 if v < v0 else v
    v = v1 if v > v1 else v
    return is_within(u, v, x, y, z, squared)


@inner
def meets_window(window, x, y, z, squared):
    """Say whether a direction of a cell is within an angle of a vector.

    Parameters
    ----------
    window : Window
    x, y, z : float
    squared : float
        The square of the sine of the angle, which is below a right one.
    """
    a = whole(window.face // 2)
    p, q, w = x, y, z
    if a == 0:
        p, q, w = y, z, x
    elif a == 1:
        p, q, w = z, x, y
    if window.face % 2 == 1:
        w = -w
    u0, v0, u1, v1 = window.u0, window.v0, window.u1, window.v1
    if w > 0.0 and u0 * w <= p <= u1 * w and v0 * w <= q <= v1 * w:
        return True
    return (
        edge_is_within(u0, v0, v1, p, q, w, squared)
        or edge_is_within(u1, v0, v1, p, q, w, squared)
        or edge_is_within(v0, u0, u1, q, p, w, squared)
        or edge_is_within(v1, u0, u1, q, p, w, squared)
    )


@inlined
def sees(window, is_exact, x, y, z, distance, radii):
    """Say whether rays through a cell, from one sphere, may hit another one.

    Parameters
    ----------
    x, y, z, distance : float
        From the centre of the one to that of the other.
    radii : float
        The sum of both, with room for what is rounded.
    """
    if not distance > radii:
        return True
    share = radii / distance
    return meets_window(window, x, y, z, share * share if is_exact else share)
