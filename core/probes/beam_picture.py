"""Pictures of what beams see: at the centres of pixels, and by the exact areas in them.

A picture of rays has one point of each pixel. Of pieces, the share of each pixel that they cover is
known exactly: it is cut out of them, row by row and pixel by pixel. So edges are without steps, and
a window that is smaller than a pixel is not lost.

A point on the border of two pieces is in both. Which of them a ray would hit there is a matter of
rounding; those few pixels ask one.

Colours are those of flat shading (:mod:`.flat_shading`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..geometry.rays import Rays
from ..kernels import call, inner, kernel
from ..scene import Camera, Light
from ..scene.camera_rays import Window, camera_rays, window_of
from .beam_tree import BeamNode
from .flat_shading import flat_colours
from .polygonal import Polygonal
from .visible import MISS, Pieces

BORDER = 1e-9
"""Distance from the border of a piece, in pixels, within which a ray is asked."""

NOT_FOUND, SEVERAL = -2, -3
"""Instead of an item: none, yet; more than one."""


class Seen(NamedTuple):
    """What is seen at the centres of pixels.

    Attributes
    ----------
    items : (height, width) int64
        MISS for nothing.
    is_asked : (height, width) bool
        Where a centre lies on the border of different items, and a ray was asked.
    """

    items: np.ndarray
    is_asked: np.ndarray


def in_pixels(points: np.ndarray, window: Window, width: int, height: int) -> np.ndarray:
    """Return columns and rows, (n, 2), of points of the cross section; row 0 is the top."""
    x = (points[:, 0] - window.x) / window.half_width
    y = (points[:, 1] - window.y) / window.half_height
    return np.column_stack([0.5 * width * (1.0 + x), 0.5 * height * (1.0 - y)])


@kernel
def find_centres(points, offsets, items, border, found, beside):
    """Write what is seen at the centre of each pixel.

    Parameters
    ----------
    points : (m, 2) float64
        Columns and rows.
    found : (height, width) int64
        What is seen all around a centre.
    beside : (height, width) int64
        What is seen in pieces on whose border it lies: SEVERAL if they differ.
    """
    height, width = found.shape
    for piece in range(len(offsets) - 1):
        first, end = offsets[piece], offsets[piece + 1]
        left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
        for i in range(first, end):
            left, right = min(left, points[i, 0]), max(right, points[i, 0])
            top, bottom = min(top, points[i, 1]), max(bottom, points[i, 1])
        for row in range(max(0, int(top - 0.5)), min(height, int(bottom + 0.5) + 1)):
            for column in range(max(0, int(left - 0.5)), min(width, int(right + 0.5) + 1)):
                x, y, least = column + 0.5, row + 0.5, np.inf
                for i in range(first, end):
                    j = i + 1 if i + 1 < end else first
                    dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
                    length = (dx * dx + dy * dy) ** 0.5
                    if length > 0.0:
                        # Rows run downward, so that pieces run clockwise here.
                        h = (dy * (x - points[i, 0]) - dx * (y - points[i, 1])) / length
                        least = h if h < least else least
                if least > border:
                    found[row, column] = items[piece]
                elif least >= -border:
                    other = beside[row, column]
                    is_first = other == NOT_FOUND or other == items[piece]
                    beside[row, column] = items[piece] if is_first else SEVERAL


def seen_at_centres(
    scene: Polygonal, pieces: Pieces, camera: Camera, width: int, height: int
) -> Seen:
    """Return what a camera sees in its pixels' centres, from the pieces of its beam."""
    window = window_of(camera, width, height)
    items = np.full((height, width), NOT_FOUND, np.int64)
    beside = np.full((height, width), NOT_FOUND, np.int64)
    points = in_pixels(pieces.points, window, width, height)
    call(find_centres, points, pieces.offsets, pieces.items, BORDER, items, beside)
    items = np.where(items == NOT_FOUND, beside, items)
    is_asked = items < MISS
    those = np.flatnonzero(is_asked)
    if len(those):
        rays: Rays = camera_rays(camera, width, height, chosen=those)
        hits, _ = scene.tree.trace(rays)
        found = np.where(hits.primitive < 0, MISS, scene.convex.items[hits.primitive])
        items[np.divmod(those, width)] = found
    return Seen(items, is_asked)


# --------------------------------------------------------------------------------- exact areas


@inner
def cut_strip(polygons, row, count, axis, low, high):
    """Cut a polygon to ``low <= coordinate <= high``; return its row and corners then."""
    for side in range(2):
        bound, sign = (low, 1.0) if side == 0 else (high, -1.0)
        kept, last = 0, count - 1
        before = sign * (polygons[row, last, axis] - bound)
        for i in range(count):
            here = sign * (polygons[row, i, axis] - bound)
            if here < 0.0 < before or before < 0.0 < here:
                share = before / (before - here)
                other = 1 - axis
                start = polygons[row, last, other]
                polygons[1 - row, kept, other] = start + share * (polygons[row, i, other] - start)
                polygons[1 - row, kept, axis] = bound
                kept += 1
            if here >= 0.0:
                polygons[1 - row, kept, 0] = polygons[row, i, 0]
                polygons[1 - row, kept, 1] = polygons[row, i, 1]
                kept += 1
            last, before = i, here
        row, count = 1 - row, kept
    return row, count


@kernel
def add_areas(points, offsets, colours, strip, pixel, picture):
    """Add the colours of pieces to pixels, each times the share that it covers of the pixel.

    Parameters
    ----------
    points : (m, 2) float64
        Columns and rows.
    colours : (k, c) float64
    strip, pixel : (2, n, 2) float64
        Scratch, with room for the corners of a piece and four more.
    picture : (height, width, c) float64
    """
    height, width = picture.shape[0], picture.shape[1]
    for piece in range(len(offsets) - 1):
        first, size = offsets[piece], offsets[piece + 1] - offsets[piece]
        top, bottom = np.inf, -np.inf
        for i in range(first, first + size):
            top, bottom = min(top, points[i, 1]), max(bottom, points[i, 1])
        for row in range(max(0, int(top)), min(height, int(bottom) + 1)):
            for i in range(size):
                strip[0, i, 0], strip[0, i, 1] = points[first + i, 0], points[first + i, 1]
            of_strip, count = cut_strip(strip, 0, size, 1, float(row), row + 1.0)
            if count < 3:
                continue
            left, right = np.inf, -np.inf
            for i in range(count):
                left = min(left, strip[of_strip, i, 0])
                right = max(right, strip[of_strip, i, 0])
            for column in range(max(0, int(left)), min(width, int(right) + 1)):
                for i in range(count):
                    pixel[0, i, 0] = strip[of_strip, i, 0]
                    pixel[0, i, 1] = strip[of_strip, i, 1]
                place, n = cut_strip(pixel, 0, count, 0, float(column), column + 1.0)
                area = 0.0
                for i in range(1, n - 1):
                    ax, ay = pixel[place, i, 0] - column, pixel[place, i, 1] - row
                    bx, by = pixel[place, i + 1, 0] - column, pixel[place, i + 1, 1] - row
                    ox, oy = pixel[place, 0, 0] - column, pixel[place, 0, 1] - row
                    area += 0.5 * ((ay - oy) * (bx - ox) - (ax - ox) * (by - oy))
                for channel in range(colours.shape[1]):
                    picture[row, column, channel] += area * colours[piece, channel]


def coverage(
    pieces: Pieces, values: np.ndarray, window: Window, width: int, height: int
) -> np.ndarray:
    """Return a picture, (height, width, c), of values of pieces, (k, c), by their exact areas."""
    picture = np.zeros((height, width, values.shape[1]))
    most = int(np.diff(pieces.offsets).max(initial=0)) + 6
    strip, pixel = np.zeros((2, most, 2)), np.zeros((2, most, 2))
    points = in_pixels(pieces.points, window, width, height)
    call(
        add_areas, points, pieces.offsets, np.ascontiguousarray(values), strip, pixel, picture
    )  # fmt: skip
    return picture


def share_of(
    pieces: Pieces, items: Sequence[int] | np.ndarray, window: Window, width: int, height: int
) -> np.ndarray:
    """Return the share of each pixel, (height, width), that some items cover."""
    values = np.isin(pieces.items, np.asarray(items)).astype(np.float64)[:, None]
    return coverage(pieces, values, window, width, height)[:, :, 0]


def picture_of_tree(
    scene: Polygonal,
    nodes: Sequence[BeamNode],
    lights: Sequence[Light],
    window: Window,
    width: int,
    height: int,
) -> np.ndarray:
    """Return the picture of a beam tree, (height, width, 3), by exact areas."""
    picture = np.zeros((height, width, 3))
    for node in nodes:
        colours = node.weight * colours_of(scene, node, lights)
        picture += coverage(node.pieces, colours, window, width, height)
    return picture


def colours_of(scene: Polygonal, node: BeamNode, lights: Sequence[Light]) -> np.ndarray:
    """Return the colours, (k, 3), of the pieces of a beam: of a polygon the same everywhere."""
    items = node.pieces.items
    colours = np.tile(np.array(scene.scene.background, dtype=np.float64), (len(items), 1))
    seen = np.flatnonzero(items != MISS)
    polygons = node.pieces.polygons[seen]
    colours[seen] = flat_colours(
        scene.scene, items[seen], scene.convex.planes[polygons], scene.middles[polygons],
        node.beam.apex, lights,
    )  # fmt: skip
    return colours
