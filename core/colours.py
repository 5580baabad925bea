"""Colours of cells: one ramp for the overlay, for baked meshes and for pictures.

The ramp runs from blue over green and orange to red in even steps of hue. Its stops were chosen
in the OKLCH colour space with a lightness between 0.62 and 0.88, so that all of it stands out both
from the dark grey of Blender's viewport and from the light grey of a shaded mesh, which the dark
ends of viridis and turbo do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

# Nine stops at even distances, sRGB in 0 to 255.
_STOPS = np.array([
    (104, 117, 246), (8, 157, 236), (11, 182, 204), (3, 205, 176), (99, 222, 108),
    (209, 218, 10), (255, 193, 75), (255, 145, 86), (246, 91, 114),
]) / 255.0  # fmt: skip

INNER_COLOUR = (0.62, 0.62, 0.66)
"""Cells without a figure of their own: inner nodes when cells are coloured by count."""

EMPTY_TINT = (0.45, 0.65, 1.0)
"""Faces of empty leaves."""


def ramp(fractions: np.ndarray) -> np.ndarray:
    """Return the ramp's colours, (n, 3) float64 in sRGB from 0 to 1, for (n,) fractions."""
    position = np.clip(np.asarray(fractions, dtype=np.float64), 0.0, 1.0) * (len(_STOPS) - 1)
    return np.stack(
        [np.interp(position, np.arange(len(_STOPS)), channel) for channel in _STOPS.T], axis=-1
    )


def depth_colours(values: np.ndarray, maximum: int) -> np.ndarray:
    """Return the colours of cells by depth.

    Parameters
    ----------
    values : (n,) array_like of int
        Depth of each cell.
    maximum : int
        Depth that gets the last colour; 0 is allowed.

    Returns
    -------
    (n, 3) float64
        sRGB, 0 to 1.
    """
    return ramp(np.asarray(values) / max(maximum, 1))


def count_colours(values: np.ndarray, maximum: int) -> np.ndarray:
    """Return the colours of cells by their number of primitives, on a logarithmic scale.

    Logarithmic, because a grid has many cells with a few primitives and a few with thousands.

    Parameters
    ----------
    values : (n,) array_like of int
        Primitives in each cell.
    maximum : int
        Number that gets the last colour; 0 is allowed.

    Returns
    -------
    (n, 3) float64
        sRGB, 0 to 1.
    """
    return ramp(np.log1p(values) / np.log1p(max(maximum, 1)))


def face_opacity(area: float, around: float, cover: float) -> float:
    """Return the opacity of translucent faces that gives any number of them an even impression.

    A random line through a convex body of surface `around` meets 2 A / around of the faces within
    that have the area A (Cauchy, Crofton). Their covers add up like 1 - (1 - a)^k. The least is
    what is still drawn in its colour by a screen with eight bits.
    """
    met = max(2.0 * area / around, 1.0) if around > 0.0 else 1.0
    return max(1.0 - (1.0 - min(cover, 0.999)) ** (1.0 / met), 3.0 / 255.0)


def luminance(colour: Sequence[float]) -> float:
    """Return how bright a colour (3,) in sRGB is, from 0 to 1: as the eye weighs the channels."""
    red, green, blue = colour
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
