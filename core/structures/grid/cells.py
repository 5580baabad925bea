"""The cells of a uniform grid: their walls, their numbers, and the triangles in them.

Cells are stored in one array with an offset per cell (compressed sparse rows): cell c lists
``references[offsets[c]:offsets[c + 1]]``, and c = (i * ny + j) * nz + k.

A cell owns its lower walls, not its upper ones: a point on a wall lies in the cell above it. That
is what computing an index by rounding down gives, and what published counts rest on.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...geometry.geometry import overlaps
from ...geometry.rays import ULPS
from ...kernels import call, inner, kernel
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


def fill_cells(
    scene: Scene,
    items: Any,
    lower: np.ndarray,
    upper: np.ndarray,
    resolution: np.ndarray,
    *,
    is_open: bool,
    is_exact: bool,
    mailbox: bool,
    progress: Progress,
) -> GridArrays:
    """Cut a box into cells and list the triangles in each.

    References are counted cell by cell, the counts turned into offsets, the references filled in.

    Parameters
    ----------
    lower, upper : (3,) float64
        Corners of the box.
    resolution : (3,) int64
    is_open, is_exact : bool
        Overlap and assignment, see the settings.

    Raises
    ------
    InputError
        When the references need more memory than there is.
    Cancelled
        From `progress`.
    """
    boxes = scene.boxes()
    margin, tolerance = margin_and_tolerance(lower, upper, scene)
    grid = GridArrays(
        np.concatenate([lower, upper])[None], make_walls(lower, upper, margin, resolution),
        (upper - lower) / resolution, tolerance, resolution,
        np.zeros(int(np.prod(resolution)) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32),
        mailbox,
    )  # fmt: skip
    scratch = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64), np.empty(6)

    def insert_all(fill: bool, cursor: np.ndarray, text: str) -> None:
        def insert_some(first: int, last: int) -> None:
            call(
                insert, grid, items, boxes, first, last, tolerance, margin * is_open,
                is_exact, fill, cursor, *scratch,
            )  # fmt: skip

        # One thread: threads would meet at the cursors of cells.
        for_chunks(insert_some, len(scene), 1, progress, text)

    insert_all(False, grid.offsets[1:], "Grid: counting references")
    np.cumsum(grid.offsets, out=grid.offsets)
    n_references = int(grid.offsets[-1])
    refuse_if_too_large(
        4 * n_references, f"a grid with {n_references} references", "lower the resolution"
    )
    grid = grid._replace(references=np.empty(n_references, dtype=np.int32))
    insert_all(True, grid.offsets[:-1].copy(), "Grid: filling cells")
    return grid


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


@kernel
def insert(
    grid, geometry, boxes, first, last, tolerance, margin, is_exact, fill, cursor, lo, hi, cell_box
):
    """Insert the triangles ``first <= n < last`` into every cell they overlap.

    Boxes are widened by `tolerance` (3,), and under open overlap lowered at the top by twice the
    `margin` (3,). Called twice: with `fill` false, ``cursor[c]`` counts the references of cell c;
    with `fill` true it is the place of the next one. `lo` and `hi`, (3,) int64, and `cell_box`,
    (6,), are scratch.
    """
    _, ny, nz = grid.resolution
    for n in range(first, last):
        single = True
        for axis in range(3):
            walls, size, count = grid.walls[axis], grid.cell_size[axis], grid.resolution[axis]
            low, high = boxes[n, axis] - tolerance[axis], boxes[n, 3 + axis] + tolerance[axis]
            lo[axis] = cell_at(walls, size, count, low)
            # A flat triangle in a wall overlaps neither side openly: it goes to the upper one.
            hi[axis] = max(lo[axis], cell_at(walls, size, count, high - 2.0 * margin[axis]))
            single = single and lo[axis] == hi[axis]
        for i in range(lo[0], hi[0] + 1):
            for j in range(lo[1], hi[1] + 1):
                for k in range(lo[2], hi[2] + 1):
                    if is_exact and not single:
                        for axis in range(3):
                            index = i if axis == 0 else j if axis == 1 else k
                            cell_box[axis] = grid.walls[axis, index] - tolerance[axis]
                            cell_box[3 + axis] = grid.walls[axis, index + 1] + tolerance[axis]
                        if not overlaps(geometry, n, cell_box):
                            continue
                    cell = (i * ny + j) * nz + k
                    if fill:
                        grid.references[cursor[cell]] = n
                    cursor[cell] += 1
