"""A plane that divides a volume in two, and what that is worth: the lecture's "SAH decision".

    Cost(V -> {L, R}) = t_tra + t_tri (SA(V_L) / SA(V) N_L + SA(V_R) / SA(V) N_R)

The children are the halves of the *space* V here, as on the slide, not boxes drawn tight around
their triangles. Hence the areas add up to that of V and twice the cut:

    p_L + p_R = 1 + 2 A_cut / SA(V)

A triangle belongs to the side of its centroid (the middle of its box), also where the plane cuts
it; one whose centroid lies in the plane belongs to the right. So N_L + N_R = N, again as on the
slide. A builder of hierarchies counts alike, but then draws the boxes of both sides tight:
:func:`tight_costs` says what the same planes cost then.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..geometry.box_shape import surface_area
from ..progress import SILENT, Progress


class SplitPlane(NamedTuple):
    """A plane and its figures, by the names on the slide.

    Attributes
    ----------
    axis : int
        0, 1, 2 for a plane across x, y, z.
    position : float
    N_L, N_R : int
        Triangles to the left (lower coordinates) and to the right.
    p_L, p_R : float
        SA(V_L) / SA(V) and SA(V_R) / SA(V).
    cost : float
    """

    axis: int
    position: float
    N_L: int
    N_R: int
    p_L: float
    p_R: float
    cost: float


class SplitPlanes(NamedTuple):
    """Several planes across one axis: arrays of the figures of :class:`SplitPlane`, (k,) each."""

    axis: int
    position: np.ndarray
    N_L: np.ndarray
    N_R: np.ndarray
    p_L: np.ndarray
    p_R: np.ndarray
    cost: np.ndarray


class SortedAxis(NamedTuple):
    """Triangles sorted along an axis: with them a plane anywhere is a matter of a look-up.

    Attributes
    ----------
    axis : int
    centroids : (n,) float64
        Middles of their boxes, ascending.
    first, last : (n + 1,) float64
        Areas of the box around the first i triangles, and of that around the last i.
    """

    axis: int
    centroids: np.ndarray
    first: np.ndarray
    last: np.ndarray


def sort_along(boxes: np.ndarray, axis: int, progress: Progress = SILENT) -> SortedAxis:
    """Sort the triangles of V along an axis.

    Parameters
    ----------
    boxes : (n, 6) float64
        Boxes of the triangles.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    text = f"Sorting along {'xyz'[axis]}"
    progress.report(0, 4, text)
    centroids = 0.5 * (boxes[:, axis] + boxes[:, 3 + axis])
    order = np.argsort(centroids, kind="stable")
    progress.report(1, 4, text)
    ordered = boxes[order]
    progress.report(2, 4, text)
    first = _areas_of_growing(ordered)
    progress.report(3, 4, text)
    last = _areas_of_growing(ordered[::-1])
    progress.report(4, 4, text)
    return SortedAxis(axis, centroids[order], first, last)


def evaluate_plane(
    triangles: SortedAxis, box: np.ndarray, position: float, C_trav: float, C_isect: float
) -> SplitPlane:
    """Return the figures of one plane.

    Parameters
    ----------
    triangles : SortedAxis
        The triangles in V, sorted along the axis that the plane cuts.
    box : (6,) float64
        V itself.
    position : float
        Beyond V it counts as its border.
    C_trav, C_isect : float
        The slide's t_tra and t_tri.
    """
    planes = evaluate_planes(triangles, box, np.array([position]), C_trav, C_isect)
    return SplitPlane(planes.axis, *(values[0].item() for values in planes[1:]))


def evaluate_planes(
    triangles: SortedAxis, box: np.ndarray, positions: np.ndarray, C_trav: float, C_isect: float
) -> SplitPlanes:
    """Return the figures of several planes across one axis, as :func:`evaluate_plane` does.

    Parameters
    ----------
    positions : (k,) float64
    """
    axis = triangles.axis
    position = np.clip(positions, box[axis], box[3 + axis])
    n_left = np.searchsorted(triangles.centroids, position, side="left")
    n_right = len(triangles.centroids) - n_left
    left, right = halves_of(np.tile(box, (len(position), 1)), axis, position)
    area = float(surface_area(box))
    if area > 0.0:
        p_left, p_right = surface_area(left) / area, surface_area(right) / area
    else:  # a box without a surface: no line hits it, whatever the halves are
        p_left = p_right = np.ones(len(position))
    cost = C_trav + C_isect * (p_left * n_left + p_right * n_right)
    return SplitPlanes(axis, position, n_left, n_right, p_left, p_right, cost)


def halves_of(box: np.ndarray, axis: int, position: Any) -> tuple[np.ndarray, np.ndarray]:
    """Return the parts of a box left and right of a plane, (..., 6) each."""
    left, right = box.copy(), box.copy()
    left[..., 3 + axis] = right[..., axis] = position
    return left, right


def tight_costs(
    triangles: SortedAxis, box: np.ndarray, planes: SplitPlanes, C_trav: float, C_isect: float
) -> np.ndarray:
    """Return what planes cost with boxes drawn tight around the triangles of both sides, (k,).

    Infinite where a side has no triangle: that would be no split of a hierarchy.

    Parameters
    ----------
    planes : SplitPlanes
        From :func:`evaluate_planes`, for the same triangles.
    """
    first, last = triangles.first, triangles.last
    n_left, n_right = planes.N_L, planes.N_R
    area = float(surface_area(box))
    if not area > 0.0:
        return np.full(len(n_left), np.inf)
    shares = (first[n_left] * n_left + last[n_right] * n_right) / area
    return np.where((n_left > 0) & (n_right > 0), C_trav + C_isect * shares, np.inf)


def _areas_of_growing(boxes: np.ndarray) -> np.ndarray:
    """Return the areas of the boxes around the first 0, 1, 2, ... boxes, (n + 1,)."""
    low = np.minimum.accumulate(boxes[:, :3])
    high = np.maximum.accumulate(boxes[:, 3:])
    return np.concatenate([[0.0], surface_area(np.concatenate([low, high], axis=1))])
