"""PLY: a header that says what follows, then rows of numbers, as text or binary.

Taken are the elements ``vertex`` (properties x, y and z), ``face`` (the list ``vertex_indices``, or
``vertex_index``) and ``tristrips``, where -1 in the list begins another strip.

Not read by trimesh: it sorts faces by their number of corners, gives the two triangles of a quad
numbers far apart, cuts concave polygons as fans, and knows no strips.

G. Turk: The PLY Polygon File Format, in the PLY tools of the Georgia Institute of Technology, 1998.
"""

from __future__ import annotations

import codecs
import itertools
import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .contents import (
    BrokenFile,
    Contents,
    Piece,
    counted,
    note_small_faces,
    triangles_of_faces,
    triangles_of_strip,
)
from .rows import Column, Lists, read_rows
from .text import (
    TextLines,
    floats_of,
    integer_of,
    integers_of,
    lines_of,
    name_of,
    numbers_in,
    shown,
)

TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
"""Names of types. Those of 64 bit integers are not in the specification, but in files."""

BYTE_ORDERS = {b"ascii": "", b"binary_little_endian": "<", b"binary_big_endian": ">"}

COORDINATES = ("x", "y", "z")

INDICES = ("vertex_indices", "vertex_index")

UNSEEN = {"material", "camera"}
"""Elements that have no surface, known from common programs."""


class Element(NamedTuple):
    """Rows of one kind."""

    name: str
    n_rows: int
    columns: list[Column]


class Header(NamedTuple):
    """What a header says, and at which byte and after how many lines the rows begin.

    Attributes
    ----------
    unknown : list of str
        Lines that have no place in a header.
    """

    elements: list[Element]
    is_text: bool
    size: int
    n_lines: int
    unknown: list[str]


def read_ply(path: Path) -> Contents:
    """Read a PLY file."""
    data = path.read_bytes().removeprefix(codecs.BOM_UTF8)
    header = header_of(data)
    read = _text_rows if header.is_text else _binary_rows
    tables, notes = read(data, header)
    if header.unknown:
        more = len(header.unknown) - 1
        also = f" and {counted(more, 'other line')}" if more else ""
        notes.append(f"not read: {header.unknown[0]}{also}")
    vertices, pieces = np.zeros((0, 3)), []
    if "vertex" in tables:
        axes = [_numbers(tables["vertex"], "vertex", axis) for axis in COORDINATES]
        vertices = np.stack(axes, axis=1)
    for name in tables:  # in the order of the file
        if name == "face":
            values, sizes = _lists(tables[name], name)
            pieces.append(triangles_of_faces(vertices, values, sizes))
            notes += note_small_faces(sizes)
        elif name == "tristrips":
            pieces += _strips(vertices, *_lists(tables[name], name))
    for element in header.elements:
        if element.name not in {"vertex", "face", "tristrips"} | UNSEEN and element.n_rows:
            notes.append(f"not read: {counted(element.n_rows, 'element')} '{element.name}'")
    triangles = np.concatenate([np.zeros((0, 3, 3)), *pieces])
    return Contents([Piece(path.stem, triangles)], notes)


Table = dict[str, np.ndarray | Lists]


def _numbers(table: Table, element: str, name: str) -> np.ndarray:
    column = table.get(name)
    if column is None or isinstance(column, Lists):
        raise BrokenFile(f"its element '{element}' has no property {name}")
    return column.astype(np.float64)


def _lists(table: Table, element: str) -> Lists:
    for name in INDICES:
        column = table.get(name)
        if isinstance(column, Lists):
            return Lists(_whole(column.values), column.sizes)
    raise BrokenFile(f"its element '{element}' has no list {' or '.join(INDICES)}")


def _whole(values: np.ndarray) -> np.ndarray:
    """Return vertex indices as int64, whatever type the file gives them."""
    indices = values.astype(np.int64)
    if not np.array_equal(indices, values):
        raise BrokenFile("a vertex index is no whole number")
    return indices


def _strips(vertices: np.ndarray, values: np.ndarray, sizes: np.ndarray) -> list[np.ndarray]:
    """Return the triangles of strips."""
    pieces = []
    for strip in np.split(values, np.cumsum(sizes)[:-1]):
        for part in np.split(strip, np.flatnonzero(strip == -1)):
            corners = triangles_of_strip(part[part != -1]).reshape(-1)
            pieces.append(triangles_of_faces(vertices, corners, np.full(len(corners) // 3, 3)))
    return pieces


def header_of(data: bytes) -> Header:
    """Return what the header of a file says."""
    first = re.match(rb"ply[ \t]*(\r\n|\n|\r)", data)
    if first is None:
        raise BrokenFile("it does not begin with the line 'ply'")
    # Lines of the header end as the first one does; the byte after the last may be anything.
    ending = first[1]
    elements: list[Element] = []
    unknown: list[str] = []
    byte_order = None
    place = first.end()
    for number in itertools.count(2):
        end = data.find(ending, place)
        if end < 0:
            raise BrokenFile("its header has no 'end_header'")
        words = data[place:end].split()
        place = end + len(ending)
        keyword = words[0] if words else b""
        if keyword == b"end_header":
            break
        if keyword == b"format":
            byte_order = BYTE_ORDERS.get(words[1] if len(words) > 1 else b"")
            if byte_order is None:
                raise BrokenFile(f"line {number}: no format {shown(b' '.join(words[1:]))} is known")
        elif keyword == b"element" and len(words) == 3:
            count = integer_of(words[2], f"line {number}: the count of an element")
            elements.append(Element(name_of(words[1]), count, []))
        elif keyword == b"property" and elements:
            elements[-1].columns.append(_column(words, byte_order or "=", number))
        elif keyword in (b"element", b"property"):
            raise BrokenFile(f"line {number}: {shown(b' '.join(words))} cannot stand there")
        elif keyword not in (b"", b"comment", b"obj_info"):
            unknown.append(f"line {number} of the header, {shown(b' '.join(words))}")
    if byte_order is None:
        raise BrokenFile("its header names no format")
    names = [element.name for element in elements]
    for name in {"vertex", "face", "tristrips"}:
        if names.count(name) > 1:
            raise BrokenFile(f"its header has the element '{name}' {names.count(name)} times")
    return Header(elements, not byte_order, place, number, unknown)


def _column(words: list[bytes], byte_order: str, number: int) -> Column:
    """Return the column that a line of the header tells of."""
    names = [name_of(word) for word in words[1:]]
    is_list = names[:1] == ["list"]
    types = names[1:3] if is_list else names[:1]
    if len(names) != (4 if is_list else 2) or any(name not in TYPES for name in types):
        raise BrokenFile(f"line {number}: {shown(b' '.join(words))} is no property")
    dtypes = [np.dtype(byte_order + TYPES[name]) for name in types]
    if is_list and dtypes[0].kind == "f":
        raise BrokenFile(f"line {number}: the length of a list is no {types[0]}")
    return Column(names[-1], dtypes[-1], dtypes[0] if is_list else None)


def _binary_rows(data: bytes, header: Header) -> tuple[dict[str, Table], list[str]]:
    tables = {}
    bytes_ = np.frombuffer(data, dtype=np.uint8)
    place = header.size
    for element in header.elements:
        tables[element.name], place = read_rows(
            bytes_, place, element.n_rows, element.columns, f"'{element.name}'"
        )
    return tables, []


def _text_rows(data: bytes, header: Header) -> tuple[dict[str, Table], list[str]]:
    body = data[header.size :].replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    lines = lines_of(body, header.n_lines)
    tables: dict[str, Table] = {}
    first = 0
    for element in header.elements:
        last = first + element.n_rows if element.columns else first
        if last > len(lines.texts):
            raise BrokenFile(
                f"it announces {element.n_rows} times '{element.name}', but ends after "
                f"{len(lines.texts) - first}"
            )
        tables[element.name] = _table(element, lines.part(first, last))
        first = last
    extra = len(lines.texts) - first
    return tables, [f"not read: {counted(extra, 'line')} behind the last element"] if extra else []


def _table(element: Element, lines: TextLines) -> Table:
    """Return the columns of rows of text that are of use."""
    columns = element.columns
    words: list[list[bytes]] = [[] for _ in columns]
    sizes: list[list[int]] = [[] for _ in columns]
    for text, number in zip(*lines):
        row = text.split()
        place = 0
        for column, column_words, column_sizes in zip(columns, words, sizes):
            size = 1
            if column.length is not None and place < len(row):
                size = integer_of(row[place], f"line {number}: the length of a list")
                place += 1
            column_sizes.append(size)
            column_words += row[place : place + size]
            place += size
        if place != len(row):
            raise BrokenFile(
                f"line {number}: '{element.name}' takes {place} numbers, there are {len(row)}"
            )
    table: Table = {}
    for column, column_words, column_sizes in zip(columns, words, sizes):
        if column.name in COORDINATES or column.name in INDICES:
            is_whole = column.length is not None and column.item.kind != "f"
            convert = integers_of if is_whole else floats_of
            values = numbers_in(column_words, column_sizes, lines.numbers, convert)
            counts = np.array(column_sizes, dtype=np.int64)
            table[column.name] = values if column.length is None else Lists(values, counts)
    return table
