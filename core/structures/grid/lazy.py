"""A grid whose cells list their triangles when a ray first enters them.

To make one list, not all triangles should be looked at. So the build sorts them into blocks of
SIDE x SIDE x SIDE cells, by their boxes: a coarse grid, whose walls are some of the fine one's. The
list of a cell is made from that of its block, by the very comparisons that fill a whole grid
(:mod:`.cells`): what a cell lists does not depend on when it is made.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...contract.missing import most_missing, note_if_missing
from ...kernels import call, implements, kernel
from ...parallel import Spare, for_chunks
from ...progress import Progress
from ...scene import Scene
from .cells import (
    GridArrays,
    fill_cells,
    find_span,
    list_of,
    lowering_of,
    make_scratch,
    overlaps_cell,
    refuse_references,
)

SIDE = 4
"""Cells along the side of a block. A triangle that is in one cell of a block is looked at for the
others too, but only where they are wanted."""

NOT_MADE = -1
"""Where the list of a cell ends that is not made."""


class LazyGridArrays(NamedTuple):
    """The grid as its kernels see it; what is not named here is as in :class:`.cells.GridArrays`.

    Attributes
    ----------
    begins, ends : (n_cells,) int64
        Cell c lists ``references[begins[c]:ends[c]]``; its end is NOT_MADE before it is made.
    blocks : GridArrays
        Of the same box: the lists of blocks of SIDE^3 cells, by boxes.
    wanted : (n_cells,) uint8
    look_ahead : int
        See :class:`....contract.lazy.LazyStructure`.
    """

    box: np.ndarray
    walls: np.ndarray
    cell_size: np.ndarray
    tolerance: np.ndarray
    resolution: np.ndarray
    begins: np.ndarray
    ends: np.ndarray
    references: np.ndarray
    mailbox: bool
    blocks: GridArrays
    wanted: np.ndarray
    look_ahead: int


@implements(list_of, LazyGridArrays, inline=True)
def list_made(grid, cell):
    """Look at both ends: lists lie in the order in which they were made."""
    return grid.begins[cell], grid.ends[cell]


@implements(note_if_missing, LazyGridArrays, inline=True)
def note_cell(grid, cell):
    """Look whether there is an end."""
    if grid.ends[cell] >= 0:
        return False
    grid.wanted[cell] = 1
    return True


@implements(most_missing, LazyGridArrays, inline=True)
def look_ahead_of(grid):
    """As far as the driver says."""
    return grid.look_ahead


def sort_into_blocks(
    grid: GridArrays, scene: Scene, items: Any, *, is_open: bool, progress: Progress
) -> LazyGridArrays:
    """Return an empty grid as one whose cells are still to be made.

    Raises
    ------
    InputError
        When the references of blocks need more memory than there is.
    Cancelled
        From `progress`.
    """
    resolution = -(-grid.resolution // SIDE)
    walls = np.full((3, int(resolution.max()) + 2), np.inf)
    for axis, (cells, blocks) in enumerate(zip(grid.resolution, resolution, strict=True)):
        walls[axis, : blocks + 1] = grid.walls[
            axis, np.minimum(np.arange(blocks + 1) * SIDE, cells)
        ]
    blocks = grid._replace(
        walls=walls, cell_size=SIDE * grid.cell_size, resolution=resolution,
        offsets=np.zeros(int(np.prod(resolution)) + 1, np.int64),
    )  # fmt: skip
    blocks = fill_cells(blocks, scene, items, is_open=is_open, is_exact=False, progress=progress)
    n_cells = len(grid.offsets) - 1
    return LazyGridArrays(
        grid.box, grid.walls, grid.cell_size, grid.tolerance, grid.resolution,
        np.zeros(n_cells, np.int64), np.full(n_cells, NOT_MADE, np.int64), grid.references,
        grid.mailbox, blocks, np.zeros(0, np.uint8), 0,
    )  # fmt: skip


def make_lists(
    grid: LazyGridArrays,
    scene: Scene,
    items: Any,
    wanted: np.ndarray,
    threads: int,
    progress: Progress,
    *,
    is_open: bool,
    is_exact: bool,
) -> tuple[LazyGridArrays, int]:
    """Make the lists of cells; return the grid with them, and how many there were to make.

    Parameters
    ----------
    wanted : (n_cells,) uint8

    Raises
    ------
    InputError
        When the references need more memory than there is.
    Cancelled
        From `progress`.
    """
    cells = np.flatnonzero((wanted != 0) & (grid.ends == NOT_MADE))
    wanted = np.zeros(len(grid.ends), np.uint8)
    wanted[cells] = 1
    index = np.stack(np.unravel_index(cells, tuple(grid.resolution))) // SIDE
    blocks = np.unique(np.ravel_multi_index(tuple(index), tuple(grid.blocks.resolution)))
    boxes, lowering = scene.boxes(), lowering_of(grid, scene, is_open)
    spare, made = Spare(make_scratch), grid._replace(wanted=wanted)

    def list_all(fill: bool, cursor: np.ndarray) -> None:
        def list_some(first: int, last: int) -> None:
            with spare.lent() as scratch:
                call(
                    list_of_blocks, made, items, boxes, blocks, first, last, lowering, is_exact,
                    fill, cursor, scratch,
                )  # fmt: skip

        # Threads may: a cell is in one block.
        for_chunks(list_some, len(blocks), threads, progress, "Grid: making cells")

    counts = np.zeros(len(wanted), np.int64)
    list_all(False, counts)
    before = len(grid.references)
    ends = before + np.cumsum(counts[cells])
    total = int(ends[-1]) if len(ends) else before
    refuse_references(total)
    references = np.empty(total, np.int32)
    references[:before] = grid.references
    made = made._replace(
        begins=grid.begins.copy(), ends=grid.ends.copy(), references=references
    )  # fmt: skip
    made.begins[cells], made.ends[cells] = ends - counts[cells], ends
    list_all(True, made.begins.copy())
    return made._replace(wanted=grid.wanted), len(cells)


@kernel
def list_of_blocks(
    grid, geometry, boxes, blocks, first, last, lowering, is_exact, fill, cursor, scratch
):
    """List the triangles of the blocks ``blocks[first:last]`` in those of their cells wanted.

    As :func:`.cells.insert` does: with `fill` false, ``cursor[c]`` counts the references of cell c;
    with `fill` true it is the place of the next one.
    """
    coarse = grid.blocks
    _, ny, nz = grid.resolution
    _, my, mz = coarse.resolution
    lo, hi = scratch.lo, scratch.hi
    for place in range(first, last):
        block = blocks[place]
        i0, j0, k0 = SIDE * (block // (my * mz)), SIDE * (block // mz % my), SIDE * (block % mz)
        for slot in range(coarse.offsets[block], coarse.offsets[block + 1]):
            n = coarse.references[slot]
            is_tested = not find_span(grid, boxes, n, lowering, scratch) and is_exact
            for i in range(max(lo[0], i0), min(hi[0], i0 + SIDE - 1) + 1):
                for j in range(max(lo[1], j0), min(hi[1], j0 + SIDE - 1) + 1):
                    for k in range(max(lo[2], k0), min(hi[2], k0 + SIDE - 1) + 1):
                        cell = (i * ny + j) * nz + k
                        if grid.wanted[cell] == 0:
                            continue
                        if is_tested and not overlaps_cell(grid, geometry, n, i, j, k, scratch.box):
                            continue
                        if fill:
                            grid.references[cursor[cell]] = n
                        cursor[cell] += 1
