"""STL: loose triangles, as text or binary.

Text is solids of facets, ``solid NAME`` to ``endsolid``, and one piece each. Binary is 80 bytes of
anything, the number of triangles, and 50 bytes for each. Many a binary file begins with "solid"
too; it is known by its length.

3D Systems: StereoLithography Interface Specification, 1988.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .contents import BrokenFile, Contents, Piece
from .text import bytes_of, name_of, numbers_in, shown

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

FACET = [b"facet", b"outer", b"vertex", b"vertex", b"vertex", b"endloop", b"endfacet"]
"""What the lines of a facet begin with."""


def read_stl(path: Path) -> Contents:
    """Read an STL file."""
    with path.open("rb") as file:
        head = file.read(84)
    size = path.stat().st_size
    announced = int.from_bytes(head[80:84], "little") if len(head) == 84 else 0
    if len(head) == 84 and size == 84 + RECORD.itemsize * announced:
        return _read_binary(path, announced)
    if _is_text(bytes_of(path)):
        return _read_text(path)
    if len(head) < 84:
        raise BrokenFile("it is neither text that begins with 'solid' nor long enough for binary")
    if size < 84 + RECORD.itemsize * announced:
        raise BrokenFile(
            f"as binary STL it announces {announced} triangles, but ends within the "
            f"{1 + (size - 84) // RECORD.itemsize}th"
        )
    contents = _read_binary(path, announced)
    extra = size - 84 - RECORD.itemsize * announced
    contents.notes.append(f"not read: {extra} bytes behind the {announced} announced triangles")
    return contents


def _is_text(data: bytes) -> bool:
    """Say whether a file of this content can only be meant as text."""
    return bool(re.match(rb"\s*solid\b[^\n]*(\n\s*(facet|endsolid|$)|\Z)", data, re.IGNORECASE))


def _read_binary(path: Path, count: int) -> Contents:
    records = np.fromfile(path, dtype=RECORD, count=count, offset=84)
    return Contents([Piece(path.stem, records["corners"].astype(np.float64))], [])


def _read_text(path: Path) -> Contents:
    lines = bytes_of(path).split(b"\n")
    split = [line.split() for line in lines]
    numbers = [number for number, words in enumerate(split, 1) if words]
    rows = [words for words in split if words]
    keywords = [words[0].lower() for words in rows]
    pieces = []
    first = 0
    while first < len(rows):
        if keywords[first] != b"solid":
            raise BrokenFile(f"line {numbers[first]}: {shown(rows[first][0])} stands in no solid")
        last = _end_of_solid(keywords, numbers, first)
        corners = [rows[k + j][1:] for k in range(first + 1, last, len(FACET)) for j in (2, 3, 4)]
        places = [numbers[k + j] for k in range(first + 1, last, len(FACET)) for j in (2, 3, 4)]
        for words, place in zip(corners, places):
            if len(words) != 3:
                raise BrokenFile(f"line {place}: a vertex has {len(words)} coordinates, not three")
        name = name_of(b" ".join(rows[first][1:])) or path.stem
        pieces.append(Piece(name, numbers_in(corners, places).reshape(-1, 3, 3)))
        first = last + 1
    return Contents(pieces, [])


def _end_of_solid(keywords: list[bytes], numbers: list[int], first: int) -> int:
    """Return the row of the ``endsolid`` of the solid that begins in row `first`."""
    try:
        last = keywords.index(b"endsolid", first)
    except ValueError:
        last = len(keywords)
    facets = -(-(last - first - 1) // len(FACET))
    wanted = FACET * facets
    if keywords[first + 1 : last] != wanted[: last - first - 1]:
        for found, expected, number in zip(keywords[first + 1 :], wanted, numbers[first + 1 :]):
            is_cut = last == len(keywords) and number == numbers[-1]
            if found != expected and not is_cut:
                raise BrokenFile(
                    f"line {number}: {shown(found)} where {shown(expected)} has to stand"
                )
    if last == len(keywords):
        raise BrokenFile(
            f"it ends inside the solid that begins in line {numbers[first]}: no 'endsolid' follows"
        )
    if len(wanted) != last - first - 1:
        raise BrokenFile(f"line {numbers[last]}: the solid ends inside a facet")
    return last
