"""How many cells are shown, in words."""

from __future__ import annotations

from typing import Any

from ...core.printing import show_integer
from . import selection
from .drawable import Drawable


def in_words(drawable: Drawable, display: Any) -> str:
    """Say how many cells are shown: ``"showing 1 203 of 4 096 cells"``, and what is left out."""
    sections = drawable.sections
    asked = sum(last - first for first, last in selection.runs(sections, display))
    drawn = sum(last - first for first, last in selection.drawn_runs(sections, display))
    text = f"showing {show_integer(drawn)} of {show_integer(sections.total)} cells"
    limits = []
    if len(sections.order) < sections.total:
        limits.append(f"{show_integer(len(sections.order))} are kept")
    if drawn < asked:
        limits.append(f"{show_integer(selection.MAXIMUM_DRAWN)} are drawn")
    if limits:
        text += f" (at most {', '.join(limits)})"
    # Beside those within instances, boxes are what they are.
    is_cut = drawable.cells.n_own is None and drawable.n_shaped < len(sections.order)
    if drawable.n_shaped and is_cut:
        text += f"; the {show_integer(drawable.n_shaped)} nearest to the root in their shape, "
        text += "deeper ones as the boxes around them"
    for sentence in drawable.cells.left_out:
        text += f"; {sentence}"
    filled = selection.MAXIMUM_FILLED
    if display.tint_empty and drawable.n_empty > filled:
        text += f"; tinting {show_integer(filled)} of {show_integer(drawable.n_empty)} empty leaves"
    if display.planes and drawable.n_planes > filled:
        text += f"; with {show_integer(filled)} of {show_integer(drawable.n_planes)} planes"
    return text
