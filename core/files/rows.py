"""Binary rows of numbers among which there are lists, each with its length before it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..kernels import call, kernel
from ..ranges import ranges
from .contents import BrokenFile


class Column(NamedTuple):
    """What stands in a place of every row.

    Attributes
    ----------
    name : str
    item : dtype
        Of the number, or of the numbers in the list.
    length : dtype or None
        Of the length before a list; None for a single number.
    """

    name: str
    item: np.dtype
    length: np.dtype | None = None


class Lists(NamedTuple):
    """Lists one after the other: all their numbers (n,), and how many each has (n_rows,) int64."""

    values: np.ndarray
    sizes: np.ndarray


def read_rows(
    data: np.ndarray, start: int, count: int, columns: Sequence[Column], what: str
) -> tuple[dict[str, np.ndarray | Lists], int]:
    """Return the columns of rows by their names, and where the rows end.

    Parameters
    ----------
    data : (n,) uint8
        The file.
    start, count : int
        Where the rows begin, and how many there are.
    what : str
        What a row is, for the message.

    Raises
    ------
    BrokenFile
        When the file ends before the rows do, or a length is negative or more than there is.
    """
    if not count or not columns:
        return {column.name: _nothing(column) for column in columns}, start
    least = sum((column.length or column.item).itemsize for column in columns)
    if count * least > len(data) - start:
        raise BrokenFile(f"it announces {count} times {what}, but ends before")
    # Rows of one length, as all are without lists and as those of a mesh of triangles are, can be
    # seen as an array.
    row, end = _row_like_the_first(data, start, columns)
    if row is not None and count * row.itemsize <= len(data) - start:
        table = np.frombuffer(data, row, count, start)
        if all((table[n] == table[n][:1]).all() for n in row.names or () if n.startswith("length")):
            return _columns_of(table, columns), start + count * row.itemsize
    n = len(columns)
    begins = np.empty((count, n), dtype=np.int64)
    sizes = np.empty((count, n), dtype=np.int64)
    layout = np.array(
        [
            (c.length.itemsize, _SIGNED[c.length.kind], c.length.str[0] == ">", c.item.itemsize)
            if c.length is not None
            else (0, 0, 0, c.item.itemsize)
            for c in columns
        ],
        dtype=np.int64,
    ).reshape(n, 4)
    end = call(find_rows, data, start, layout, begins, sizes)
    if end < 0:
        raise BrokenFile(
            f"{what} {-end} of {count} is not whole: it is cut off, or has a bad length"
        )
    found: dict[str, np.ndarray | Lists] = {}
    for k, column in enumerate(columns):
        values = _gather(data, begins[:, k], sizes[:, k], column.item)
        found[column.name] = values if column.length is None else Lists(values, sizes[:, k])
    return found, end


_SIGNED = {"i": 1, "u": 0}

LONGEST_ROW = np.iinfo(np.intc).max
"""Bytes that a row may have to be seen as an item of an array; NumPy counts them in a C int."""


def _nothing(column: Column) -> np.ndarray | Lists:
    """Return a column of no rows."""
    empty = np.zeros(0, dtype=column.item)
    return empty if column.length is None else Lists(empty, np.zeros(0, dtype=np.int64))


def _row_like_the_first(
    data: np.ndarray, start: int, columns: Sequence[Column]
) -> tuple[np.dtype | None, int]:
    """Return the dtype of rows whose lists are as long as those of the first, and its end."""
    fields: list[tuple] = []
    place = start
    for k, column in enumerate(columns):
        size = 1
        if column.length is not None:
            if place + column.length.itemsize > len(data):
                return None, start
            size = int(np.frombuffer(data, column.length, 1, place)[0])
            fields.append((f"length{k}", column.length))
            place += column.length.itemsize
        if not 0 <= size <= (len(data) - place) // column.item.itemsize:
            return None, start
        fields.append((f"item{k}", column.item, (size,) if column.length is not None else ()))
        place += size * column.item.itemsize
        if place - start > LONGEST_ROW:
            return None, start
    return np.dtype(fields), place


def _columns_of(table: np.ndarray, columns: Sequence[Column]) -> dict[str, np.ndarray | Lists]:
    found: dict[str, np.ndarray | Lists] = {}
    for k, column in enumerate(columns):
        values = table[f"item{k}"]
        if column.length is None:
            found[column.name] = values
        else:
            sizes = np.full(len(table), values.shape[1], dtype=np.int64)
            found[column.name] = Lists(values.reshape(-1), sizes)
    return found


def _gather(data: np.ndarray, begins: np.ndarray, sizes: np.ndarray, item: np.dtype) -> np.ndarray:
    """Return the numbers that begin at certain bytes of the file, `sizes` at each, (n,) `item`."""
    places = np.repeat(begins, sizes) + ranges(0, sizes) * item.itemsize
    return data[places[:, None] + np.arange(item.itemsize)].view(item).reshape(-1)


@kernel
def find_rows(data, start, layout, begins, sizes):
    """Find where every column of every row begins; return where the last row ends.

    Parameters
    ----------
    data : (n,) uint8
    start : int
        Where the first row begins.
    layout : (n_columns, 4) int64
        Of the length before a list: its bytes (0: a single number), whether it has a sign, whether
        its first byte is the largest; and the bytes of a number.
    begins, sizes : (n_rows, n_columns) int64
        Result: where the numbers begin and how many there are.

    Returns
    -------
    int
        Minus the number of a row, counted from 1, if that is not whole.
    """
    place = start
    for row in range(begins.shape[0]):
        for column in range(layout.shape[0]):
            width = layout[column, 0]
            size = 1
            if width > 0:
                if place + width > len(data):
                    return -row - 1
                size = 0
                for k in range(width):
                    at = place + k if layout[column, 2] else place + width - 1 - k
                    size = size * 256 + int(data[at])
                    # Here already, as eight bytes may hold more than an int64.
                    if size > len(data):
                        return -row - 1
                if layout[column, 1] and width < 8 and size >= 1 << (8 * width - 1):
                    return -row - 1
                place += width
            if size > (len(data) - place) // layout[column, 3]:
                return -row - 1
            begins[row, column], sizes[row, column] = place, size
            place += size * layout[column, 3]
    return place
