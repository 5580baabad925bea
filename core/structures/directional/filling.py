"""Filling: faces are divided into cells, and items put into their lists, the nearest first.

Uniform cells are filled item by item, adaptive ones cell by cell: what a cell lists is asked of its
four parts, until lists are short or dividing makes them no shorter.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ...kernels import call, inner, kernel, whole
from ...memory import refuse_if_too_large
from ...parallel import for_chunks
from ...progress import SILENT, Cancelled, Progress
from .insertion import View, cells_around, through_cell, view_of
from .lists import NONE, NOWHERE, OF_CELLS, OF_REFERENCES, Lists, with_entries
from .projection import NEAREST, Insertion, footprints_of

BYTES_PER_REFERENCE = 12
BYTES_PER_CELL = 40


# -------------------------------------------------------------------------------- uniform cells


@kernel
def insert_uniformly(view, begin, end, size, places, cover, far, references, nearest):
    """Count, or write, some items in the lists of the cells of a face.

    Parameters
    ----------
    view : View
    begin, end : int
        Of which footprints.
    size : int
        Cells along an edge.
    places : (size * size,) int64
        Zeros to count; in the end how many there are. To write, where each list begins; in the end
        where it ends.
    cover, far : (size * size,)
        NONE, inf; in the end what covers each cell.
    references : (m,) int32
        Empty to count.
    nearest : (m,) float64
    """
    width, footprints = 2.0 / size, view.footprints
    for k in range(begin, end):
        near = footprints.rows[k, NEAREST]
        left, right, low, high = cells_around(footprints.rows[k], size)
        for j in range(low, high + 1):
            v = -1.0 + j * width
            for i in range(left, right + 1):
                cell = j * size + i
                if near > far[cell]:
                    continue
                is_seen, depth = through_cell(view, k, -1.0 + i * width, v, width)
                if not is_seen:
                    continue
                if len(references) > 0:
                    references[places[cell]] = footprints.item[k]
                    nearest[places[cell]] = near
                places[cell] += 1
                if depth < far[cell]:
                    cover[cell], far[cell] = footprints.item[k], depth


# ------------------------------------------------------------------------------- adaptive cells

WANTS_CELLS, WANTS_REFERENCES, PAUSES, FINISHED = range(4)
"""Why :func:`divide_face` has stopped: it needs room, has worked for a while, or is done."""

N_CELLS, N_REFERENCES, WAITING = range(3)
"""Places in its state: cells and references so far, cells that are not looked at yet."""

AT_ONCE, TESTS_AT_ONCE = 1 << 14, 1 << 21
"""Items that are inserted, and tests that are made, before a wish to stop is asked for."""

GAIN = 0.9
"""A cell stays as it is if its parts would list more than this share of it, on average."""

BEGIN, END, CELL_U, CELL_V, CELL_SIZE, DEPTH, CELL = range(7)
"""Columns of its stack."""


@kernel
def divide_face(view, most, deepest, waiting, stack, state, lists):
    """Divide a face, cell by cell, until all lists are short; it goes on where it has stopped.

    Parameters
    ----------
    most, deepest : int
        A cell is divided if its list is longer and its depth less.
    waiting : (k,) int32
        Footprints: the lists of cells that wait, the last one at the end.
    stack : (k, 7) float64
    state : (3,) int64
    lists : Lists
        With room.

    Returns
    -------
    int
        WANTS_CELLS, WANTS_REFERENCES, PAUSES or FINISHED.
    """
    tested = whole(0)
    while state[WAITING] > 0:
        if tested > TESTS_AT_ONCE:
            return PAUSES
        top = state[WAITING] - 1
        row = stack[top]
        begin, end, cell = whole(row[BEGIN]), whole(row[END]), whole(row[CELL])
        u, v, size, depth = row[CELL_U], row[CELL_V], row[CELL_SIZE], row[DEPTH]
        if end - begin <= most or depth >= deepest:
            room = state[N_REFERENCES]
            if room + end - begin > len(lists.references):
                return WANTS_REFERENCES
            lists.first[cell] = room
            for k in range(begin, end):
                lists.references[room] = view.footprints.item[waiting[k]]
                lists.nearest[room] = view.footprints.rows[waiting[k], NEAREST]
                room += 1
            lists.last[cell] = room
            state[N_REFERENCES] = room
            state[WAITING] = top
            continue
        if state[N_CELLS] + 4 > len(lists.children):
            return WANTS_CELLS
        tested += 4 * (end - begin)
        child, half, place = state[N_CELLS], 0.5 * size, end
        lists.children[cell] = child
        for k in range(4):
            row = stack[top + k]
            row[CELL_U] = u + (half if k & 1 else 0.0)
            row[CELL_V] = v + (half if k & 2 else 0.0)
            row[CELL_SIZE], row[DEPTH], row[CELL] = half, depth + 1.0, child + k
            row[BEGIN] = place
            place = list_child(
                view, waiting, begin, end, lists, child + k, row[CELL_U], row[CELL_V], half, place
            )
            row[END] = place
        if place - end > 4 * GAIN * (end - begin):
            # It is listed as it is, in the next turn.
            lists.children[cell] = NONE
            row = stack[top]
            row[BEGIN], row[END], row[CELL], row[DEPTH] = begin, end, cell, deepest
            continue
        state[N_CELLS] += 4
        state[WAITING] = top + 4
    return FINISHED


@inner
def list_child(view, waiting, begin, end, lists, cell, u, v, size, place):
    """Write those of a list that may be seen through a part of its cell; return where that ends."""
    footprints = view.footprints
    lists.children[cell] = NONE
    lists.first[cell] = lists.last[cell] = 0
    lists.cover[cell], lists.far[cell] = NONE, np.inf
    for n in range(begin, end):
        k = whole(waiting[n])
        if footprints.rows[k, NEAREST] > lists.far[cell]:
            break
        is_seen, depth = through_cell(view, k, u, v, size)
        if is_seen:
            waiting[place] = k
            place += 1
        if depth < lists.far[cell]:
            lists.cover[cell], lists.far[cell] = footprints.item[k], depth
    return place


# -------------------------------------------------------------------------------------- building


class Division(NamedTuple):
    """How faces are divided.

    Attributes
    ----------
    size : int
        Cells along an edge of a face; of adaptive division 1.
    most, deepest : int
        Of adaptive division: see :func:`divide_face`. A `deepest` of 0 divides no cell.
    advice : str
        What to do where lists do not fit into memory.
    """

    size: int
    most: int
    deepest: int
    advice: str


def lists_of(
    insertion: Insertion, division: Division, name: str, progress: Progress = SILENT
) -> Lists:
    """Divide all faces, and list what may be seen through each cell.

    Raises
    ------
    InputError
        When the lists do not fit into memory.
    Cancelled
        From `progress`.
    """
    count = len(insertion.faces.origins)
    parts: list[Lists | None] = [None] * count
    listed = [0] * count

    stop = Stop(progress)

    def divide(first: int, last: int) -> None:
        for face in range(first, last):
            footprints = footprints_of(insertion, face, stop.check)
            view = view_of(insertion, face, footprints)
            list_face = adaptive if division.deepest else uniform
            parts[face] = list_face(view, face, division, listed, name, stop)

    for_chunks(divide, count, 0, stop, f"Filling {name}")
    return with_entries(joined_lists([part for part in parts if part is not None]), count)


class Stop(Progress):
    """Passes reports on, and lets the threads at work know that they were told to stop."""

    def __init__(self, progress: Progress) -> None:
        self._progress, self._is_wanted = progress, False

    def report(self, done: float, total: float, text: str) -> None:
        """Pass it on."""
        try:
            self._progress.report(done, total, text)
        except Cancelled:
            self._is_wanted = True
            raise

    def check(self) -> None:
        """Raise Cancelled if that was the answer to a report."""
        if self._is_wanted:
            raise Cancelled


def refuse_lists(listed: list[int], cells: int, name: str, advice: str) -> None:
    """Refuse references, of all faces so far, that do not fit into memory."""
    total = sum(listed)
    refuse_if_too_large(
        2 * total * BYTES_PER_REFERENCE + cells * BYTES_PER_CELL,
        f"{name} with lists of {total} items or more",
        advice,
    )


def uniform(
    view: View, face: int, division: Division, listed: list[int], name: str, stop: Stop
) -> Lists:
    """Return the lists of the cells of one face: counted first, then written."""
    size, count = division.size, len(view.footprints.item)
    counts = np.zeros(size * size, np.int64)

    def insert(places: np.ndarray, references: np.ndarray, nearest: np.ndarray) -> list[np.ndarray]:
        cover, far = np.full(size * size, NONE, np.int32), np.full(size * size, np.inf)
        for begin in range(0, count, AT_ONCE):
            stop.check()
            call(
                insert_uniformly, view, begin, min(begin + AT_ONCE, count), size, places, cover,
                far, references, nearest,
            )  # fmt: skip
        return [cover, far]

    insert(counts, np.empty(0, np.int32), np.empty(0))
    listed[face] = int(counts.sum())
    refuse_lists(listed, len(listed) * size * size, name, division.advice)
    ends = np.cumsum(counts)
    references, nearest = np.empty(int(ends[-1]), np.int32), np.empty(int(ends[-1]))
    found = insert(ends - counts, references, nearest)
    children = np.full(size * size, NONE, np.int32)
    return Lists(
        size, 0, NOWHERE, children, ends - counts, ends, found[0], found[1], references, nearest
    )


def adaptive(
    view: View, face: int, division: Division, listed: list[int], name: str, stop: Stop
) -> Lists:
    """Return the lists of one face, divided where lists are long."""
    count = len(view.footprints.item)
    lists = Lists(
        1, 0, NOWHERE, np.full(64, NONE, np.int32), np.zeros(64, np.int64), np.zeros(64, np.int64),
        np.full(64, NONE, np.int32), np.full(64, np.inf), np.empty(1024, np.int32), np.empty(1024),
    )  # fmt: skip
    # Of the face the list of all, of every level below those of four cells.
    waiting = np.empty(count * (1 + 4 * division.deepest), np.int32)
    waiting[:count] = np.arange(count)
    stack = np.zeros((4 * division.deepest + 4, 7))
    stack[0] = 0.0, count, -1.0, -1.0, 2.0, 0.0, 0.0
    state = np.array([1, 0, 1])
    while True:
        reason = call(
            divide_face, view, division.most, division.deepest, waiting, stack, state, lists
        )
        listed[face] = int(state[N_REFERENCES])
        if reason == FINISHED:
            break
        stop.check()
        if reason == PAUSES:
            continue
        lists = with_room(lists, reason)
        refuse_lists(listed, len(lists.children), name, division.advice)
    return cut_to(lists, int(state[N_CELLS]), int(state[N_REFERENCES]))


def cut_to(lists: Lists, cells: int, references: int) -> Lists:
    """Return lists without the room behind so many cells and references."""
    columns: dict[str, Any] = {
        name: getattr(lists, name)[: references if name in OF_REFERENCES else cells]
        for name in (*OF_CELLS, *OF_REFERENCES)
    }
    return lists._replace(**{name: column.copy() for name, column in columns.items()})


def with_room(lists: Lists, reason: int) -> Lists:
    """Return lists with twice the room for cells, or for references."""
    names = OF_CELLS if reason == WANTS_CELLS else OF_REFERENCES
    grown: dict[str, Any] = {}
    for name in names:
        column = getattr(lists, name)
        grown[name] = np.concatenate([column, np.empty_like(column)])
    return lists._replace(**grown)


def joined_lists(parts: list[Lists]) -> Lists:
    """Return the lists of faces, each given by itself, under the numbers that cells have."""
    size = parts[0].size
    roots = size * size
    others = np.cumsum([0] + [len(part.children) - roots for part in parts])
    listed = np.cumsum([0] + [len(part.references) for part in parts])
    columns: dict[str, Any] = {}
    for name in (*OF_CELLS, *OF_REFERENCES):
        values = [getattr(part, name) for part in parts]
        if name == "children":
            # Children come behind all roots.
            added = [len(parts) * roots + n - roots for n in others.tolist()]
            values = [
                np.where(each >= 0, each + more, NONE).astype(np.int32)
                for each, more in zip(values, added, strict=False)
            ]
        elif name in ("first", "last"):
            values = [each + n for each, n in zip(values, listed.tolist(), strict=False)]
        if name in OF_CELLS:
            values = [each[:roots] for each in values] + [each[roots:] for each in values]
        columns[name] = np.concatenate(values)
    return Lists(size, 0, NOWHERE, **columns)
