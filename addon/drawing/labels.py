"""Labels: where texts at points of a picture find room, so that none lies on another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

WAYS = (
    (0.0, 0.0), (0.0, 1.0), (0.0, -1.0), (-0.5, 1.3), (-0.5, -1.3), (-1.0, 0.0), (-1.0, 1.0),
    (-1.0, -1.0), (0.0, 2.1), (0.0, -2.1), (-1.0, 2.1), (-1.0, -2.1), (-0.5, 2.5), (-0.5, -2.5),
)  # fmt: skip
"""Where a text may stand beside its point, the best first: how many of its widths to the right of
standing at the right of it, and how many of its heights above standing at its height."""


class Room(NamedTuple):
    """A rectangle in pixels."""

    left: float
    bottom: float
    right: float
    top: float


def project(points: np.ndarray, matrix: np.ndarray, width: float, height: float) -> np.ndarray:
    """Return where points are seen, (n, 2), in pixels from the lower left; NaN behind the eye.

    Parameters
    ----------
    points : (n, 3) float64
    matrix : (4, 4) float64
        From the world to the clip space of a region, times columns.
    width, height : float
        Of that region.
    """
    clip = np.concatenate([points, np.ones((len(points), 1))], axis=1) @ matrix.T
    ahead = clip[:, 3] > 1e-9
    places = np.full((len(points), 2), np.nan)
    places[ahead] = (0.5 + 0.5 * clip[ahead, :2] / clip[ahead, 3:]) * (width, height)
    return places


def raised(points: np.ndarray, heights: np.ndarray, line: float, top: float) -> np.ndarray:
    """Return the middles of columns of texts, (n, 2), whose last lines stand beside points.

    Lower where they would not fit otherwise. A text by itself is not moved.

    Parameters
    ----------
    points : (n, 2) float
        In pixels; NaN for those that are not seen.
    heights : (n,) float
        Of the columns.
    line : float
        Height of one text.
    top : float
        Where the room for texts ends.
    """
    up = np.minimum(0.5 * (heights - line), top - 0.5 * heights - points[:, 1])
    is_moved = (heights > line) & (points[:, 1] <= top)
    return points + np.stack([np.zeros(len(points)), np.where(is_moved, up, 0.0)], axis=1)


def place(
    points: np.ndarray, sizes: np.ndarray, room: Room, gap: float, taken: Sequence[Room] = ()
) -> list[Room | None]:
    """Return the rectangle of each text; None for those that find no room.

    Those in front are placed first, and nothing pushes them away any more.

    Parameters
    ----------
    points : (n, 2) float
        In pixels; NaN for those that are not seen.
    sizes : (n, 2) float
        Width and height of each text.
    room : Room
        Where texts may stand.
    gap : float
        Between a text and its point, and at least between two texts.
    taken : sequence of Room
        Where none may stand.
    """
    there = list(taken)
    found: list[Room | None] = []
    for (x, y), (width, height) in zip(points, sizes, strict=True):
        best = None
        is_seen = room.left <= x <= room.right and room.bottom <= y <= room.top
        for right, up in WAYS if is_seen else ():
            # Of a text at the left the gap is at its other side.
            left = x + (1.0 + 2.0 * right) * gap + right * width
            bottom = y + up * (height + gap) - 0.5 * height
            tried = Room(left, bottom, left + width, bottom + height)
            if _is_within(tried, room) and not any(meet(tried, other, gap) for other in there):
                best = tried
                there.append(tried)
                break
        found.append(best)
    return found


def _is_within(inner: Room, outer: Room) -> bool:
    return (
        inner.left >= outer.left
        and inner.bottom >= outer.bottom
        and inner.right <= outer.right
        and inner.top <= outer.top
    )


def meet(one: Room, other: Room, gap: float) -> bool:
    """Say whether there is less than a gap between two rectangles."""
    return (
        one.left < other.right + gap
        and other.left < one.right + gap
        and one.bottom < other.top + gap
        and other.bottom < one.top + gap
    )
