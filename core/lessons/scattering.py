"""Rows of squares: items by a flag, a sum for each, and where each goes: what lessons share."""

from __future__ import annotations

import numpy as np

from .drawing import BLUE, ORANGE, Chart, Colour, Faces, Lines, coloured
from .picture import Mark

TOP = 3.0
"""Height of a chart with all rows."""

ITEMS, SUMS, RESULT = 2.5, 1.3, 0.1
"""Where the rows of the items, of their sums, and of the result begin."""


def squares(
    chart: Chart, places: np.ndarray, low: float, colour: Colour, height: float = 0.4
) -> tuple[Lines, Faces]:
    """Return squares of a row that begins at a height of a chart."""
    floor = np.full(len(places), low)
    return chart.blocks(places + 0.1, places + 0.9, floor, floor + height, colour)


def drawn_items(chart: Chart, is_blue: np.ndarray) -> list[Lines | Faces]:
    """Return the items in order, blue or orange."""
    x = np.arange(len(is_blue))
    return [*squares(chart, x[is_blue], ITEMS, BLUE), *squares(chart, x[~is_blue], ITEMS, ORANGE)]


def drawn_sums(
    chart: Chart, sums: np.ndarray, is_blue: np.ndarray
) -> tuple[list[Lines | Faces], list[Mark]]:
    """Return bars as high as the sums of the items, and their numbers below."""
    x, unit = np.arange(len(sums)), 0.4 / max(float(sums.max(initial=0)), 1.0)
    parts: list[Lines | Faces] = []
    for side, colour in ((is_blue, BLUE), (~is_blue, ORANGE)):
        floor = np.full(int(side.sum()), SUMS)
        parts += chart.blocks(
            x[side] + 0.1, x[side] + 0.9, floor, floor + unit * sums[side], colour
        )
    numbers = [
        Mark(chart.place(place + 0.25, SUMS - 0.2), str(int(value)))
        for place, value in enumerate(sums)
    ]
    return parts, numbers


def drawn_result(chart: Chart, places: np.ndarray, is_blue: np.ndarray) -> list[Lines | Faces]:
    """Return the items at their places, and lines that lead there from their sums."""
    x = np.arange(len(places))
    parts: list[Lines | Faces] = []
    for side, colour in ((is_blue, BLUE), (~is_blue, ORANGE)):
        count = int(side.sum())
        starts = chart.points(x[side] + 0.5, np.full(count, SUMS - 0.35))
        ends = chart.points(places[side] + 0.5, np.full(count, RESULT + 0.5))
        parts += squares(chart, places[side], RESULT, colour)
        parts.append(coloured(np.stack([starts, ends], axis=1), colour))
    return parts


def names_of_rows(chart: Chart, count: int, *names: str) -> list[Mark]:
    """Return the names of the rows, to their right."""
    heights = ITEMS + 0.2, SUMS + 0.2, RESULT + 0.2
    return [
        Mark(chart.place(count + 0.4, height), name)
        for name, height in zip(names, heights, strict=False)
    ]
