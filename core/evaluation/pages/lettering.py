"""Text in pictures, set by Pillow.

Blender's own Python has no Pillow unless the full extension brought it; then pictures are without
text, and :func:`can_letter` says so.
"""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

SIZE = 15
"""Height of the letters in pixels."""

HALO = 3
"""Width in pixels of what sets letters off from what is behind them."""

GAP = 6
"""Distance in pixels between a point and the text beside it."""

INK, PAPER = (0.13, 0.13, 0.15), (0.965, 0.965, 0.955)


class Letters(NamedTuple):
    """A text in a picture.

    Attributes
    ----------
    column, row : float
        The point that it stands beside, in pixels.
    text : str
    colour : tuple of float
        sRGB.
    """

    column: float
    row: float
    text: str
    colour: tuple[float, float, float]


def can_letter() -> bool:
    """Say whether text can be set."""
    try:
        import PIL.ImageFont  # noqa: F401  only to see whether it is there
    except ImportError:
        return False
    return True


@functools.cache
def _font(size: int) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(size)


def lettered(image: np.ndarray, texts: Sequence[Letters], size: int = SIZE) -> np.ndarray:
    """Return an image with texts in it, those first that come first: none covers another.

    A text that would leave the picture, or lie over an earlier one, is moved up or down; one for
    which there is no room near its point is left out.

    Parameters
    ----------
    image : (rows, columns, 3) float64
        From 0 to 1.
    size : int
        Height of the letters in pixels.
    """
    if not texts or not can_letter():
        return image
    from PIL import Image, ImageDraw

    font = _font(size)
    rows, columns, _ = image.shape
    canvas = Image.fromarray((np.clip(image, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8))
    draw = ImageDraw.Draw(canvas)
    taken: list[tuple[float, float, float, float]] = []
    for letters in texts:
        width = draw.textlength(letters.text, font=font)
        place = free_place(letters, width, 1.25 * size, taken, columns, rows)
        if place is None:
            continue
        taken.append((*place, place[0] + width, place[1] + 1.25 * size))
        draw.text(
            place, letters.text, font=font, fill=_bytes(letters.colour),
            stroke_width=HALO, stroke_fill=_bytes(PAPER),
        )  # fmt: skip
        draw.text(place, letters.text, font=font, fill=_bytes(letters.colour))
    return np.asarray(canvas, dtype=np.float64) / 255.0


def free_place(
    letters: Letters, width: float, height: float,
    taken: Sequence[tuple[float, float, float, float]], columns: int, rows: int,
) -> tuple[float, float] | None:  # fmt: skip
    """Return the upper left corner of a text of some width and height; None if there is no room.

    Parameters
    ----------
    taken : sequence of (left, top, right, bottom)
        Where other texts stand.
    columns, rows : int
        Size of the picture.
    """
    if not (0.0 <= letters.column <= columns and 0.0 <= letters.row <= rows):
        return None
    left = letters.column + GAP
    if left + width > columns:
        left = letters.column - GAP - width
        # With room on neither side it stands across its point.
        left = left if left >= 0.0 else columns - width
    for step in (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0):
        top = letters.row - 0.5 * height + step * height
        box = left, top, left + width, top + height
        if left < 0.0 or top < 0.0 or box[3] > rows:
            continue
        if not any(
            box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3]
            for other in taken
        ):
            return left, top
    return None


def _bytes(colour: Sequence[float]) -> tuple[int, ...]:
    return tuple(round(255.0 * channel) for channel in colour)
