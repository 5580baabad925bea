"""A column beside a section: what a walk remembers, entry by entry."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..scene import Scene
from .drawing import Colour, Lines, coloured, outlines
from .picture import Mark
from .section import Plane, sideways, title_place

YELLOW: Colour = (0.88, 0.68, 0.05, 1.0)
"""What is remembered."""

BESIDE = 1.1
"""How far from the left of the section a column stands, in widths of the scene."""

HIGH, WIDE = 0.11, 3.6
"""Height of an entry in heights of the scene, and its width in those."""

MOST_LISTED = 8
"""Entries that are written."""


def column_beside(
    scene: Scene,
    plane: Plane,
    direction: np.ndarray,
    shift: np.ndarray,
    heading: str,
    entries: Sequence[str],
    colour: Colour,
) -> tuple[Lines, list[Mark]]:
    """Return a column right of a section, its first entry on top.

    Parameters
    ----------
    direction : (3,) float64
        Of the ray: the column stands where it goes on to.
    shift : (3,) float64
        Of the section, beside the model.
    """
    along = sideways(plane, direction)
    size = scene.upper - scene.lower
    high = HIGH * max(size[2], 0.3 * size.max())
    corner = title_place(scene, plane, shift) + BESIDE * size[:2].max() * along
    corner[2] = scene.upper[2] - high
    side, up = WIDE * high * along, np.array([0.0, 0.0, 0.86 * high])
    feet = corner - np.arange(MOST_LISTED + 1)[:, None] * np.array([0.0, 0.0, high])
    shown = list(entries[:MOST_LISTED])
    names = [
        Mark(foot + 0.1 * side + 0.4 * up, text) for foot, text in zip(feet, shown, strict=False)
    ]
    if len(entries) > len(shown):
        names.append(Mark(feet[MOST_LISTED], f"and {len(entries) - len(shown)} more"))
    names.append(Mark(corner + 1.35 * up, heading, colour[:3]))
    ring = np.stack([np.zeros(3), side, side + up, up])
    return coloured(outlines(feet[: len(shown), None] + ring), colour), names
