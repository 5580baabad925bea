"""OFF: counts, vertices, then faces as a number of corners and their vertices.

The keyword may be left out, and may say more: ``[ST][C][N][4][n]OFF`` for texture coordinates,
colours, normals, a fourth homogeneous coordinate, a number of dimensions. What stands behind a
vertex's coordinates, and behind a face's corners, is of no use here.

Not read by trimesh: it sorts faces by their number of corners, gives the two triangles of a quad
numbers far apart, and cuts concave polygons as fans.

Geomview manual, "OFF: Object File Format", The Geometry Center, 1998.
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path

import numpy as np

from .contents import BrokenFile, Contents, Piece, counted, note_small_faces, triangles_of_faces
from .rows import Column, read_rows
from .text import TextLines, integer_of, integers_of, lines_of, numbers_in, text_of

KEYWORD = re.compile(rb"\s*(?:#[^\n]*\n\s*)*((?:ST|C|N|4|n)*)OFF[ \t]*(BINARY)?")

INTEGER, NUMBER = np.dtype(">i4"), np.dtype(">f4")


def read_off(path: Path) -> Contents:
    """Read an OFF file."""
    raw = path.read_bytes()
    found = KEYWORD.match(raw)
    if found and found[2]:
        return _read_binary(path, raw, found)
    data = text_of(raw)
    found = KEYWORD.match(data)
    kind, begin = (found[1], found.end()) if found else (b"", 0)
    n_lines = data.count(b"\n", 0, begin)
    # The keyword's line may go on with the counts, also with no blank between ("OFF6 2 0").
    lines = lines_of(data[begin:], n_lines, comment=b"#")
    first = 0
    if b"n" in kind:
        _refuse_dimensions(_counts(lines, 0, 1, 1)[0])
        first = 1
    n_vertices, n_faces, *_ = _counts(lines, first, 2, 3)
    first += 1
    last = first + n_vertices + n_faces
    if len(lines.texts) < last:
        raise BrokenFile(
            f"it announces {n_vertices} vertices and {n_faces} faces, a line each, but has only "
            f"{counted(len(lines.texts) - first, 'line')} of them"
        )
    vertices = _vertices(lines.part(first, first + n_vertices), 4 if b"4" in kind else 3)
    corners, sizes = _faces(lines.part(first + n_vertices, last))
    notes = note_small_faces(sizes)
    if len(lines.texts) > last:
        notes.append(f"not read: {counted(len(lines.texts) - last, 'line')} behind the last face")
    return Contents([Piece(path.stem, triangles_of_faces(vertices, corners, sizes))], notes)


def _counts(lines: TextLines, index: int, least: int, most: int) -> list[int]:
    """Return the whole numbers in a line of the header."""
    words = lines.texts[index].split() if index < len(lines.texts) else []
    if not least <= len(words) <= most:
        raise BrokenFile("it does not begin with 'OFF' and the numbers of vertices and faces")
    return [integer_of(word, f"line {lines.numbers[index]}: a count") for word in words]


def _refuse_dimensions(dimensions: int) -> None:
    if dimensions != 3:
        raise BrokenFile(f"it has {dimensions} dimensions, not three")


def _vertices(lines: TextLines, n: int) -> np.ndarray:
    """Return the vertices, (n_vertices, 3) float64, of lines with `n` coordinates and more."""
    words: list[bytes] = []
    for text, number in zip(*lines):
        row = text.split()
        if len(row) < n:
            raise BrokenFile(f"line {number}: a vertex has {len(row)} of {n} coordinates")
        words += row[:n]
    return _flattened(numbers_in(words, itertools.repeat(n), lines.numbers).reshape(-1, n))


def _flattened(vertices: np.ndarray) -> np.ndarray:
    """Return vertices of four homogeneous coordinates, if they are such, as points of space."""
    if vertices.shape[1] == 3:
        return vertices
    return vertices[:, :3] / vertices[:, 3:]


def _faces(lines: TextLines) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of all faces, one after the other, and how many each has."""
    words: list[bytes] = []
    sizes = []
    for text, number in zip(*lines):
        row = text.split()
        size = integer_of(row[0], f"line {number}: the number of a face's corners")
        if size >= len(row):
            raise BrokenFile(f"line {number}: a face of {size} corners names {len(row) - 1}")
        words += row[1 : 1 + size]  # a colour may follow
        sizes.append(size)
    corners = numbers_in(words, sizes, lines.numbers, integers_of)
    return corners, np.array(sizes, dtype=np.int64)


def _read_binary(path: Path, data: bytes, found: re.Match[bytes]) -> Contents:
    """Read the binary form: the same numbers, all of four bytes, the largest first."""
    kind, begin = found[1], data.find(b"\n", found.end()) + 1
    n_counts = 4 if b"n" in kind else 3
    header = data[begin : begin + 4 * n_counts]
    counts = np.frombuffer(header, INTEGER, len(header) // 4).tolist()
    if len(counts) < n_counts or min(counts) < 0:
        raise BrokenFile("the counts at its beginning are cut off, or negative")
    if b"n" in kind:
        _refuse_dimensions(counts.pop(0))
    n = 4 if b"4" in kind else 3
    more = 3 * (b"N" in kind) + 4 * (b"C" in kind) + 2 * (b"ST" in kind)
    columns = [Column(str(k), NUMBER) for k in range(n + more)]
    rows = np.frombuffer(data, dtype=np.uint8)
    table, place = read_rows(rows, begin + 4 * n_counts, counts[0], columns, "vertex")
    vertices = np.stack([np.asarray(table[str(k)], dtype=np.float64) for k in range(n)], axis=1)
    columns = [Column("corners", INTEGER, INTEGER), Column("colours", NUMBER, INTEGER)]
    table, place = read_rows(rows, place, counts[1], columns, "face")
    corners, sizes = table["corners"]
    triangles = triangles_of_faces(_flattened(vertices), corners.astype(np.int64), sizes)
    return Contents([Piece(path.stem, triangles)], note_small_faces(sizes))
