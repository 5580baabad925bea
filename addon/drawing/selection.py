"""Which cells the display settings show, and what their colours mean; without graphics.

Cells are kept in three sections: leaves with primitives, inner nodes, empty leaves, each sorted by
depth. So whatever the settings ask for is one run of cells per section.

The panel and the overlay ask at every redraw, so all they ask is looked up in what was counted
once, when the cells were made ready (:mod:`.drawable`). Only :func:`visible` goes through them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:  # only the types: the module of cells brings Numba in
    from ...core.contract.cells import Cells

MAXIMUM_DRAWN = 500_000
"""Cells drawn at most; of more, leaves come first, then inner nodes, then the shallow ones."""

MAXIMUM_HELD = 2_000_000
"""Cells uploaded at most, 36 bytes each; of more, every section has its shallow ones."""

MAXIMUM_CORNERS = 4_000_000
"""Corners of the faces of those that are no boxes: no more edges than that, 36 bytes each."""

MOST_DEPTH = 2**31 - 1
"""No depth is larger: they are kept in 32 bits."""

MAXIMUM_FILLED = 50_000
"""Empty leaves tinted and planes drawn at most: the shallow ones. More of them are a fog."""


# ------------------------------------------------------------------------- what is counted once


class Extent(NamedTuple):
    """How far cells go: what colours, and the fields of the panel, range over.

    Attributes
    ----------
    deepest : int
        Depth of the deepest cell.
    largest : int
        Primitives in the fullest leaf.
    last_step : int or None
        Last step of the building; None where nobody knows the steps.
    """

    deepest: int
    largest: int
    last_step: int | None


def extent_of(cells: Cells) -> Extent:
    """Go through cells and note how far they go."""
    has_steps = len(cells) > 0 and cells.replaced is not None
    last_step = int(cells.extra["order"].max()) if has_steps else None
    deepest, largest = (int(values.max(initial=0)) for values in (cells.depth, cells.count))
    return Extent(deepest, largest, last_step)


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
    """Sort cells into the three sections; within each they stay sorted by depth.

    Of more cells than the graphics card is to hold, each section keeps its first ones.
    """
    empty = is_empty(cells)
    parts = [np.flatnonzero(part) for part in (cells.is_leaf & ~empty, ~cells.is_leaf, empty)]
    sizes = shares([len(part) for part in parts], MAXIMUM_HELD)
    parts = [part[:size] for part, size in zip(parts, sizes, strict=True)]
    if cells.faces is not None:
        corners = np.zeros(len(cells), dtype=np.int64)
        np.add.at(corners, cells.faces.owners, np.diff(cells.faces.offsets))
        sums = [np.cumsum(corners[part]) for part in parts]
        most = shares([int(each[-1]) if len(each) else 0 for each in sums], MAXIMUM_CORNERS)
        sizes = [int(np.searchsorted(*pair, side="right")) for pair in zip(sums, most, strict=True)]
        parts = [part[:size] for part, size in zip(parts, sizes, strict=True)]
    order = np.concatenate(parts)
    return Sections(order, cells.depth[order], np.cumsum([len(part) for part in parts]), len(cells))


def shares(sizes: Sequence[int], most: int) -> list[int]:
    """Divide `most` among parts: none gets more than its size, and what it leaves, others get."""
    given, left = [0] * len(sizes), most
    for rank, part in enumerate(np.argsort(sizes, kind="stable").tolist()):
        given[part] = min(sizes[part], left // (len(sizes) - rank))
        left -= given[part]
    return given


class Tally:
    """Sums over items by their depth, of a range of depths, however many items there are.

    Parameters
    ----------
    depth : (n,) int
        Of each item, from 0.
    weight : (n,) float64
        What is summed up.
    """

    def __init__(self, depth: np.ndarray, weight: np.ndarray) -> None:
        self._sums = np.concatenate([[0.0], np.cumsum(np.bincount(depth, weight))])

    def total(self, low: int, high: int) -> float:
        """Return the sum over depths `low` to `high`."""
        first, last = np.clip([low, high + 1], 0, len(self._sums) - 1)
        return float(self._sums[max(first, last)] - self._sums[first])


# ------------------------------------------------------------------------------- what is shown


class Shown(NamedTuple):
    """Display settings as plain values, which a thread may read (:mod:`..settings.properties`)."""

    depth_min: int
    depth_max: int
    leaves_only: bool
    hide_empty: bool
    opacity: float
    colour_by: str

    @classmethod
    def by(cls, display: Any) -> Shown:
        """Return what display settings say now."""
        return cls(*(getattr(display, name) for name in cls._fields))


def is_empty(cells: Cells) -> np.ndarray:
    """Return which cells are leaves without primitives, (n,) bool."""
    return cells.is_leaf & (cells.count == 0)


def visible(cells: Cells, display: Any) -> np.ndarray:
    """Return which cells the display settings let through, (n,) bool."""
    shown = (cells.depth >= display.depth_min) & (cells.depth <= display.depth_max)
    if display.leaves_only:
        shown &= cells.is_leaf
    if display.hide_empty:
        shown &= ~is_empty(cells)
    return shown


def depth_run(depth: np.ndarray, display: Any) -> tuple[int, int]:
    """Return the piece of ascending depths within the range, as (first, last + 1)."""
    # Of the same type: for another one NumPy would convert all depths first.
    low, high = np.clip([display.depth_min, display.depth_max], 0, MOST_DEPTH).astype(depth.dtype)
    first = int(np.searchsorted(depth, low, side="left"))
    last = int(np.searchsorted(depth, high, side="right"))
    return first, max(first, last)


def runs(sections: Sections, display: Any) -> list[tuple[int, int]]:
    """Return the cells to draw in each section as (first, last + 1)."""
    found = []
    first = 0
    hidden = (False, display.leaves_only, display.hide_empty)
    for end, is_hidden in zip(sections.ends.tolist(), hidden):
        low, high = depth_run(sections.depth[first:end], display)
        found.append((first, first) if is_hidden else (first + low, first + high))
        first = end
    return found


def drawn_runs(sections: Sections, display: Any) -> list[tuple[int, int]]:
    """Return the runs cut to MAXIMUM_DRAWN cells in all."""
    wanted = runs(sections, display)
    sizes = [last - first for first, last in wanted]
    before = np.cumsum([0, *sizes[:-1]])
    most = np.clip(MAXIMUM_DRAWN - before, 0, sizes).tolist()
    return [(first, first + size) for (first, _), size in zip(wanted, most, strict=True)]


def coloured_by(extent: Extent, display: Any) -> str:
    """Return what colours mean: "depth", "count" or "order".

    Counts not only by choice, but also where all cells have the same depth.
    """
    if display.colour_by == "order" and extent.last_step is not None:
        return "order"
    return "count" if extent.deepest == 0 or display.colour_by == "count" else "depth"


def colour_maximum(extent: Extent, display: Any) -> int:
    """Return the depth, count or step that gets the last colour of the ramp.

    The depth only up to the deepest that is shown: a few levels take the whole ramp.
    """
    by = coloured_by(extent, display)
    if by == "count":
        return extent.largest
    if by == "order":
        return extent.last_step or 0
    return max(min(extent.deepest, display.depth_max), 0)
