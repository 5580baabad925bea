"""Which cells the display settings show, and what their colours mean; without graphics.

Cells are kept in three sections: leaves with primitives, inner nodes, empty leaves, each sorted by
depth. So whatever the settings ask for is one run of cells per section.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ..core.outlines import division_steps

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

MAXIMUM_DRAWN = 500_000
"""Cells drawn at most; of more, leaves come first, then inner nodes, then the shallow ones."""

MAXIMUM_HELD = 4_000_000
"""Cells uploaded at most, 32 bytes each."""

MAXIMUM_FILLED = 50_000
"""Empty leaves tinted and planes drawn at most: the shallow ones. More of them are a fog."""


class Sections(NamedTuple):
    """Cells in the order of their upload.

    Attributes
    ----------
    order : (n,) int
        Index of each cell in `Cells`.
    depth : (n,) int32
        Ascending within each section.
    ends : (3,) int
        Where each section ends: leaves with primitives, inner nodes, empty leaves.
    total : int
        Cells there are, uploaded or not.
    """

    order: np.ndarray
    depth: np.ndarray
    ends: np.ndarray
    total: int


def sections_of(cells: Cells) -> Sections:
    """Sort cells into the three sections; within each they stay sorted by depth."""
    empty = is_empty(cells)
    parts = [np.flatnonzero(part) for part in (cells.is_leaf & ~empty, ~cells.is_leaf, empty)]
    order = np.concatenate(parts)[:MAXIMUM_HELD]
    ends = np.minimum(np.cumsum([len(part) for part in parts]), len(order))
    return Sections(order, cells.depth[order], ends, len(cells))


def is_empty(cells: Cells) -> np.ndarray:
    """Return which cells are leaves without primitives, (n,) bool."""
    return cells.is_leaf & (cells.count == 0)


def step_shown(cells: Cells, display: Any) -> int | None:
    """Return the step of the building up to which cells are shown; None shows all of them."""
    return display.step if display.replay and "order" in cells.extra else None


def visible(cells: Cells, display: Any) -> np.ndarray:
    """Return which cells the display settings let through, (n,) bool."""
    shown = (cells.depth >= display.depth_min) & (cells.depth <= display.depth_max)
    step = step_shown(cells, display)
    is_leaf = cells.is_leaf
    if step is not None:
        shown &= cells.extra["order"] <= step
        is_leaf = division_steps(cells) > step  # not divided yet
    if display.leaves_only:
        shown &= is_leaf
    if display.hide_empty:
        shown &= ~is_empty(cells)
    return shown


def depth_run(depth: np.ndarray, display: Any) -> tuple[int, int]:
    """Return the piece of ascending depths within the range, as (first, last + 1)."""
    first = int(np.searchsorted(depth, display.depth_min, side="left"))
    last = int(np.searchsorted(depth, display.depth_max, side="right"))
    return first, max(first, last)


def runs(sections: Sections, display: Any, replayed: bool = False) -> list[tuple[int, int]]:
    """Return the cells to draw in each section as (first, last + 1).

    Parameters
    ----------
    replayed : bool
        Only a part of the building is shown: inner nodes may be leaves as yet.
    """
    found = []
    first = 0
    hidden = (False, display.leaves_only and not replayed, display.hide_empty)
    for end, is_hidden in zip(sections.ends.tolist(), hidden):
        low, high = depth_run(sections.depth[first:end], display)
        found.append((first, first) if is_hidden else (first + low, first + high))
        first = end
    return found


def drawn_runs(sections: Sections, display: Any, replayed: bool = False) -> list[tuple[int, int]]:
    """Return the runs cut to MAXIMUM_DRAWN cells in all."""
    left = MAXIMUM_DRAWN
    found = []
    for first, last in runs(sections, display, replayed):
        last = min(last, first + left)
        left -= last - first
        found.append((first, last))
    return found


def shown_text(cells: Cells, sections: Sections, display: Any) -> str:
    """Say how many cells are shown: ``"showing 1 203 of 4 096 cells"``."""
    if step_shown(cells, display) is None:
        wanted = sum(last - first for first, last in runs(sections, display))
    else:
        wanted = int(visible(cells, display).sum())
    shown = min(wanted, sum(last - first for first, last in drawn_runs(sections, display, True)))
    text = f"showing {spaced(shown)} of {spaced(sections.total)} cells"
    if shown < wanted or len(sections.order) < sections.total:
        text += f" (at most {spaced(MAXIMUM_DRAWN)} are drawn)"
    if display.tint_empty and int(is_empty(cells).sum()) > MAXIMUM_FILLED:
        text += f", tinting {spaced(MAXIMUM_FILLED)}"
    if display.planes and cells.planes is not None and len(cells.planes.owners) > MAXIMUM_FILLED:
        text += f", with {spaced(MAXIMUM_FILLED)} planes"
    return text


def spaced(number: int) -> str:
    """Return a number with a space between thousands."""
    return f"{number:,}".replace(",", " ")


def coloured_by(cells: Cells, display: Any) -> str:
    """Return what colours mean: "depth", "count" or "order".

    Counts not only by choice, but also where all cells have the same depth.
    """
    if display.colour_by == "order" and "order" in cells.extra:
        return "order"
    flat = int(cells.depth.max(initial=0)) == 0
    return "count" if flat or display.colour_by == "count" else "depth"


def colour_maximum(cells: Cells, display: Any) -> int:
    """Return the depth, count or step that gets the last colour of the ramp.

    The depth only up to the deepest that is shown: a few levels take the whole ramp.
    """
    by = coloured_by(cells, display)
    if by == "depth":
        step = step_shown(cells, display)
        depth = cells.depth if step is None else cells.depth[cells.extra["order"] <= step]
        return max(min(int(depth.max(initial=0)), display.depth_max), 0)
    values = cells.count if by == "count" else cells.extra["order"]
    return int(values.max(initial=0))
