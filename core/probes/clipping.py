"""Regions of a beam's cross section: convex, and cut by lines.

The cross section lies in the plane one unit before the apex. What a polygon covers there is bounded
by the planes through the apex and its edges, each of which is a line in the cross section: the
beam is clipped against these planes, and no point is ever divided by its distance. So it does not
matter whether a polygon reaches behind the apex.

A line parts a region in two (Sutherland and Hodgman 1974), and both parts are kept: what is taken
out of a region leaves the rest, and areas add up. A part that reaches less than `shell` across the
line is no part; it stays with the other one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import inner

FREE = -1
"""Owner of a region that sees nothing yet."""

REGIONS, CORNERS, OPEN, CLOSED = range(4)
"""Places in `Room.used`."""


class Room(NamedTuple):
    """Memory for the regions of a cross section.

    Attributes
    ----------
    points : (p, 2) float64
    start, size : (r,) int64
        Region i has ``points[start[i]:start[i] + size[i]]``, once around.
    owner : (r,) int64
        The convex polygon that is seen in it, or FREE.
    open : (r,) int64
        Regions of which something may still be taken.
    closed : (r,) int64
        Regions of which it is known what they see.
    used : (4,) int64
        How much is in use of the regions, the points, `open` and `closed`.
    lines : (l, 3) float64
        Scratch: the lines around what a polygon covers, a x + b y + c >= 0 with a^2 + b^2 = 1.
    corners : (2, l, 3) float64
        Scratch: the part of a polygon, before and after it is cut.
    stack : (s,) int64
        Scratch: nodes that wait.
    """

    points: np.ndarray
    start: np.ndarray
    size: np.ndarray
    owner: np.ndarray
    open: np.ndarray
    closed: np.ndarray
    used: np.ndarray
    lines: np.ndarray
    corners: np.ndarray
    stack: np.ndarray


def make_room(
    regions: int, corners: int, lines: int, levels: int, windows: list[np.ndarray]
) -> Room:
    """Return memory whose regions are the convex parts of a cross section, all of them free."""
    sizes = np.array([len(window) for window in windows])
    count, total = len(windows), int(sizes.sum())
    room = Room(
        np.zeros((max(corners, 2 * total), 2)), np.zeros(max(regions, 2 * count), np.int64),
        np.zeros(max(regions, 2 * count), np.int64), np.zeros(max(regions, 2 * count), np.int64),
        np.zeros(max(regions, 2 * count), np.int64), np.zeros(max(regions, 2 * count), np.int64),
        np.array([count, total, count, 0]), np.zeros((lines, 3)), np.zeros((2, lines, 3)),
        np.zeros(2 * levels + 2, np.int64),
    )  # fmt: skip
    room.points[:total] = np.concatenate(windows)
    room.start[:count], room.size[:count] = np.cumsum(sizes) - sizes, sizes
    room.owner[:count], room.open[:count] = FREE, np.arange(count)
    return room


@inner
def write_part(room, begin, count, line, sign, shell, target):
    """Write the part of a region on one side of a line; return how many corners it has.

    A line crosses the border of a convex region twice, one with rounding as well: what is within
    the shell counts as on the line, in both parts.
    """
    points = room.points
    corner, crossings = target, 0
    last = begin + count - 1
    h = line[0] * points[last, 0] + line[1] * points[last, 1] + line[2]
    before = h if abs(h) > shell else 0.0
    for i in range(begin, begin + count):
        h = line[0] * points[i, 0] + line[1] * points[i, 1] + line[2]
        here = h if abs(h) > shell else 0.0
        if (here < 0.0 < before or before < 0.0 < here) and crossings < 2:
            crossings += 1
            share = before / (before - here)
            points[corner, 0] = points[last, 0] + share * (points[i, 0] - points[last, 0])
            points[corner, 1] = points[last, 1] + share * (points[i, 1] - points[last, 1])
            corner += 1
        if sign * here >= 0.0:
            points[corner, 0], points[corner, 1] = points[i, 0], points[i, 1]
            corner += 1
        last, before = i, here
    return corner - target


@inner
def reach_across(room, begin, count, line):
    """Return how far a region reaches below a line and above it; both are signed."""
    low, high = np.inf, -np.inf
    for i in range(begin, begin + count):
        h = line[0] * room.points[i, 0] + line[1] * room.points[i, 1] + line[2]
        low = h if h < low else low
        high = h if h > high else high
    return low, high


@inner
def take(room, region, n_lines, owner, shell):
    """Give an owner what some lines bound of an open region; the rest stays as it was, in parts.

    Parameters
    ----------
    region : int
    n_lines : int
        The first of `room.lines`.

    Returns
    -------
    bool
        False if room is lacking.
    """
    used = room.used
    n_regions, n_corners, n_open = used[REGIONS], used[CORNERS], used[OPEN]
    begin, count = room.start[region], room.size[region]
    for i in range(n_lines):
        line = room.lines[i]
        low, high = reach_across(room, begin, count, line)
        if low >= -shell:
            continue
        if not high > shell:
            # Nothing is left inside: as if nothing had been cut.
            used[REGIONS], used[CORNERS], used[OPEN] = n_regions, n_corners, n_open
            return True
        new = used[REGIONS]
        if new == len(room.start) or used[CORNERS] + 2 * (count + 2) > len(room.points):
            return False
        place = used[CORNERS]
        inside = write_part(room, begin, count, line, 1.0, shell, place)
        outside = write_part(room, begin, count, line, -1.0, shell, place + inside)
        room.start[new], room.size[new] = place + inside, outside
        room.owner[new] = room.owner[region]
        room.open[used[OPEN]] = new
        used[REGIONS], used[OPEN] = new + 1, used[OPEN] + 1
        used[CORNERS] = place + inside + outside
        begin, count = place, inside
    room.start[region], room.size[region], room.owner[region] = begin, count, owner
    return True
