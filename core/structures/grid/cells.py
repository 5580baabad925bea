"""The cells of a uniform grid: their walls, their numbers, and the triangles in them.

Cells are stored in one array with an offset per cell (compressed sparse rows): cell c lists
``references[offsets[c]:offsets[c + 1]]``, and c = (i * ny + j) * nz + k.

A cell owns its lower walls, not its upper ones: a point on a wall lies in the cell above it. That
is what computing an index by rounding down gives, and what published counts rest on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...contract.missing import all_made
from ...geometry.geometry import overlaps
from ...geometry.rays import ULPS
from ...kernels import call, dispatched, implements, inlined, inner, kernel
from ...memory import refuse_if_too_large
from ...parallel import for_chunks
from ...progress import Progress
from ...scene import Scene

MARGIN = 1e-8
"""How far below their nominal places the walls lie, as a share of the grid's longest side.

Coordinates like to lie exactly on walls. A margin lower, every wall has such triangles and rays
clearly above it, farther than rounding can reach, and nearer than any published count could tell.
"""

TOLERANCE = 2e-9
"""How much boxes are widened when they are inserted, as a share of the grid's longest side.

Where a ray passes through the corner of cells, rounding decides which of them it visits; a triangle
there has to be in all of them. This covers the rounding of rays that start up to a million
sides away, and is well below a margin. Who comes from farther is walked otherwise (:mod:`.broad`).
"""


class GridArrays(NamedTuple):
    """The grid as its kernels see it.

    Attributes
    ----------
    box : (1, 6) float64
        The box that is cut into cells.
    walls : (3, longest + 2) float64
        Coordinates of the walls along each axis, ascending: cell i lies between walls i and i + 1.
        After the last one follow infinities, for steps that lead out of the grid.
    cell_size : (3,) float64
    tolerance : (3,) float64
        How much boxes were widened when they were inserted, see :data:`TOLERANCE`.
    resolution : (3,) int64
    offsets : (n_cells + 1,) int64
    references : (N_OIV,) int32
        Triangle indices, ascending within a cell.
    mailbox : bool
    """

    box: np.ndarray
    walls: np.ndarray
    cell_size: np.ndarray
    tolerance: np.ndarray
    resolution: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    mailbox: bool


def margin_and_tolerance(
    lower: np.ndarray, upper: np.ndarray, scene: Scene
) -> tuple[np.ndarray, np.ndarray]:
    """Return HAIR and TOUCH as lengths, (3,) each, for a grid between two corners."""
    longest = np.full(3, (upper - lower).max())
    # Far from the origin coordinates are coarse, however small the scene is.
    rounding = 8 * ULPS * np.maximum(np.abs(scene.lower), np.abs(scene.upper))
    return MARGIN * longest + 4 * rounding, TOLERANCE * longest + rounding


def make_walls(
    lower: np.ndarray, upper: np.ndarray, margin: np.ndarray, resolution: np.ndarray
) -> np.ndarray:
    """Return the walls between two corners, as in :class:`GridArrays`."""
    walls = np.full((3, resolution.max() + 2), np.inf)
    for axis, count in enumerate(resolution):
        origin = lower[axis] - margin[axis]
        walls[axis, :count] = origin + np.arange(count) * ((upper[axis] - lower[axis]) / count)
        # The last wall lies a margin above the box, so that the box's own boundary is inside.
        walls[axis, count] = upper[axis] + (lower[axis] - origin)
    return walls


def empty_grid(
    scene: Scene, lower: np.ndarray, upper: np.ndarray, resolution: np.ndarray, mailbox: bool
) -> GridArrays:
    """Cut a box into cells that list nothing yet.

    Parameters
    ----------
    lower, upper : (3,) float64
        Corners of the box.
    resolution : (3,) int64
    """
    margin, tolerance = margin_and_tolerance(lower, upper, scene)
    return GridArrays(
        np.concatenate([lower, upper])[None], make_walls(lower, upper, margin, resolution),
        (upper - lower) / resolution, tolerance, resolution,
        np.zeros(int(np.prod(resolution)) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32),
        mailbox,
    )  # fmt: skip


def fill_cells(
    grid: GridArrays,
    scene: Scene,
    items: Any,
    *,
    is_open: bool,
    is_exact: bool,
    progress: Progress,
) -> GridArrays:
    """List the triangles in each cell of an empty grid.

    References are counted cell by cell, the counts turned into offsets, the references filled in.

    Parameters
    ----------
    is_open, is_exact : bool
        Overlap and assignment, see the settings.

    Raises
    ------
    InputError
        When the references need more memory than there is.
    Cancelled
        From `progress`.
    """
    boxes, lowering = scene.boxes(), lowering_of(grid, scene, is_open)
    scratch = make_scratch()

    def insert_all(fill: bool, cursor: np.ndarray, text: str) -> None:
        def insert_some(first: int, last: int) -> None:
            call(insert, grid, items, boxes, first, last, lowering, is_exact, fill, cursor, scratch)

        # One thread: threads would meet at the cursors of cells.
        for_chunks(insert_some, len(scene), 1, progress, text)

    insert_all(False, grid.offsets[1:], "Grid: counting references")
    np.cumsum(grid.offsets, out=grid.offsets)
    n_references = int(grid.offsets[-1])
    refuse_references(n_references)
    grid = grid._replace(references=np.empty(n_references, dtype=np.int32))
    insert_all(True, grid.offsets[:-1].copy(), "Grid: filling cells")
    return grid


def lowering_of(grid: Any, scene: Scene, is_open: bool) -> np.ndarray:
    """Return by how much boxes are lowered at the top, (3,): under open overlap two margins."""
    margin, _ = margin_and_tolerance(grid.box[0, :3], grid.box[0, 3:], scene)
    return 2.0 * margin * is_open


def refuse_references(count: int) -> None:
    """Raise InputError where there is no memory for so many references."""
    refuse_if_too_large(4 * count, f"a grid with {count} references", "lower the resolution")


class Scratch(NamedTuple):
    """Scratch memory of one thread: the span of a triangle, (3,) int64 each, and a box, (6,)."""

    lo: np.ndarray
    hi: np.ndarray
    box: np.ndarray


def make_scratch() -> Scratch:
    """Return scratch memory for one thread."""
    return Scratch(np.empty(3, np.int64), np.empty(3, np.int64), np.empty(6))


# ------------------------------------------------------------------- how a walk sees the lists


@dispatched
def list_of(grid, cell):
    """Return where the list of a cell begins in the references, and where it ends."""
    raise TypeError(f"no lists in {type(grid).__name__}")


def stored_list(grid, cell):
    """Look at the offsets."""
    return grid.offsets[cell], grid.offsets[cell + 1]


implements(list_of, GridArrays, inline=True)(stored_list)
all_made(GridArrays)

# ------------------------------------------------------------------------- which cells list what


@inner
def cell_at(walls, cell_size, count, x):
    """Return the cell of one axis whose walls hold the coordinate x; the nearest if none does.

    Parameters
    ----------
    walls : (m,) float64
        Of this axis.
    cell_size : float
    count : int
        Cells along this axis.
    """
    last = count - 1
    position, i = (x - walls[0]) / cell_size, 0
    # Compared so that what is no number leads to a cell, too.
    if position >= last:
        i = last
    elif position > 0.0:
        i = int(position)
    # The division may be off by one; the walls decide.
    while i > 0 and walls[i] > x:
        i -= 1
    while i < last and walls[i + 1] <= x:
        i += 1
    return i


# Inlined, not called: building a grid takes a sixth less.
@inlined
def find_span(grid, boxes, n, lowering, scratch):
    """Find the first and the last cell per axis that a triangle's box overlaps.

    The box is widened by the grid's tolerance, and lowered at the top by `lowering`, (3,).

    Returns
    -------
    bool
        Whether it is one cell alone.
    """
    single = True
    for axis in range(3):
        walls, size, count = grid.walls[axis], grid.cell_size[axis], grid.resolution[axis]
        low, high = boxes[n, axis] - grid.tolerance[axis], boxes[n, 3 + axis] + grid.tolerance[axis]
        first = cell_at(walls, size, count, low)
        # A flat triangle in a wall overlaps neither side openly: it goes to the upper one.
        last = max(first, cell_at(walls, size, count, high - lowering[axis]))
        scratch.lo[axis], scratch.hi[axis] = first, last
        single = single and first == last
    return single


@inner
def overlaps_cell(grid, geometry, n, i, j, k, box):
    """Say whether a triangle itself overlaps a cell, widened by the tolerance; `box` is scratch."""
    for axis in range(3):
        index = i if axis == 0 else j if axis == 1 else k
        box[axis] = grid.walls[axis, index] - grid.tolerance[axis]
        box[3 + axis] = grid.walls[axis, index + 1] + grid.tolerance[axis]
    return overlaps(geometry, n, box)


@kernel
def insert(grid, geometry, boxes, first, last, lowering, is_exact, fill, cursor, scratch):
    """Insert the triangles ``first <= n < last`` into every cell they overlap.

    Called twice: with `fill` false, ``cursor[c]`` counts the references of cell c; with `fill` true
    it is the place of the next one.
    """
    _, ny, nz = grid.resolution
    lo, hi = scratch.lo, scratch.hi
    for n in range(first, last):
        is_tested = not find_span(grid, boxes, n, lowering, scratch) and is_exact
        for i in range(lo[0], hi[0] + 1):
            for j in range(lo[1], hi[1] + 1):
                for k in range(lo[2], hi[2] + 1):
                    if is_tested and not overlaps_cell(grid, geometry, n, i, j, k, scratch.box):
                        continue
                    cell = (i * ny + j) * nz + k
                    if fill:
                        grid.references[cursor[cell]] = n
                    cursor[cell] += 1
