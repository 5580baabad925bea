"""STL: loose triangles, as text or binary.

Text is solids of facets, ``solid NAME`` to ``endsolid``, and one piece each. Binary is 80 bytes of
anything, the number of triangles, and 50 bytes for each. Many a binary file begins with "solid"
too; it is known by its length.

Not read by trimesh: of a text that ends inside a solid it drops that solid without a word.

3D Systems: StereoLithography Interface Specification, 1988.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from .contents import BrokenFile, Contents, Piece
from .text import floats_of, name_of, shown, text_of

HEAD = 84
"""Bytes before the triangles of a binary file; the last four of them say how many there are."""

RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

FACET = (
    b"facet normal . . . outer loop vertex . . . vertex . . . vertex . . . endloop endfacet".split()
)
"""The words of a facet; a point stands for a number."""

CORNERS = [8, 9, 10, 12, 13, 14, 16, 17, 18]
"""Which of them are the corners' coordinates."""

NAMED = re.compile(rb"^[ \t]*(end[ \t]*)?solid\b([^\n]*)$", re.IGNORECASE | re.MULTILINE)
"""The first and the last line of a solid, and its name, which may be any words."""


def read_stl(path: Path) -> Contents:
    """Read an STL file."""
    data = path.read_bytes()
    size, has_head = len(data), len(data) >= HEAD
    announced = int.from_bytes(data[HEAD - 4 : HEAD], "little") if has_head else 0
    extra = size - HEAD - RECORD.itemsize * announced
    if has_head and extra == 0:
        return _read_binary(path, data, announced)
    text = text_of(data)
    if _is_text(text):
        return _read_text(path, text)
    if not has_head:
        raise BrokenFile("it is neither text that begins with 'solid' nor long enough for binary")
    if extra < 0:
        raise BrokenFile(
            f"as binary STL it announces {announced} triangles, but ends after "
            f"{(size - HEAD) // RECORD.itemsize}"
        )
    contents = _read_binary(path, data, announced)
    contents.notes.append(f"not read: {extra} bytes behind the {announced} announced triangles")
    return contents


def _is_text(data: bytes) -> bool:
    """Say whether a file of this content can only be meant as text."""
    begins = rb"\s*solid\b[^\n]*(\n\s*(facet|endsolid|$)|\Z)"
    return b"\0" not in data and bool(re.match(begins, data, re.IGNORECASE))


def _read_binary(path: Path, data: bytes, count: int) -> Contents:
    records = np.frombuffer(data, RECORD, count, HEAD)
    return Contents([Piece(path.stem, records["corners"].astype(np.float64))], [])


def _read_text(path: Path, data: bytes) -> Contents:
    pieces = []
    begin: re.Match[bytes] | None = None
    place = 0
    for found in NAMED.finditer(data):
        is_end = found[1] is not None
        if begin is None and (is_end or data[place : found.start()].strip()):
            raise BrokenFile(f"{_line(data, place)}: something stands in no solid")
        if begin is not None:
            if not is_end:
                raise BrokenFile(f"{_line(data, found.start())}: a solid begins within another")
            name = name_of(begin[2]) or path.stem
            pieces.append(Piece(name, _facets(data, begin.end(), found.start())))
        begin, place = None if is_end else found, found.end()
    if begin is not None:
        raise BrokenFile(
            f"it ends inside the solid that begins in {_line(data, begin.start())}: no 'endsolid' "
            "follows"
        )
    if data[place:].strip():
        raise BrokenFile(f"{_line(data, place)}: something stands behind the last solid")
    return Contents(pieces, [])


def _line(data: bytes, place: int) -> str:
    """Return the line in which the next word from a byte on stands, such as ``"line 7"``."""
    blanks = len(data[place:]) - len(data[place:].lstrip())
    number = 1 + data.count(b"\n", 0, place + blanks)
    return f"line {number}"


def _facets(data: bytes, begin: int, end: int) -> np.ndarray:
    """Return the triangles, (n, 3, 3) float64, of the facets of a solid."""
    words = data[begin:end].split()
    count, rest = divmod(len(words), len(FACET))
    for k, expected in enumerate(FACET):
        column = words[k :: len(FACET)]
        if expected == b"." or column.count(expected) == len(column):
            continue
        if any(word.lower() != expected for word in column):
            raise _misplaced(data, begin, end)
    if rest:
        raise BrokenFile(f"{_line(data, end)}: the solid ends inside a facet")
    try:
        numbers = [floats_of(words[k :: len(FACET)]) for k in CORNERS]
    except ValueError:
        raise _misplaced(data, begin, end) from None
    return np.stack(numbers, axis=1).reshape(count, 3, 3)


def _misplaced(data: bytes, begin: int, end: int) -> BrokenFile:
    """Return what is wrong with the first word that is not as a facet wants it."""
    pattern = itertools.cycle(FACET)
    for found, expected in zip(re.finditer(rb"\S+", data[begin:end]), pattern):
        if expected != b"." and found[0].lower() != expected:
            wanted = f"where {shown(expected)} has to stand"
        elif expected == b"." and not _is_number(found[0]):
            wanted = "is no number"
        else:
            continue
        return BrokenFile(f"{_line(data, begin + found.start())}: {shown(found[0])} {wanted}")
    raise AssertionError("every word is in its place")


def _is_number(word: bytes) -> bool:
    try:
        return len(floats_of([word])) == 1
    except ValueError:
        return False
