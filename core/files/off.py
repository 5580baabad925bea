"""OFF: counts, vertices, then faces as a number of corners and their vertices.

The keyword may be left out, and may say more: ``[ST][C][N][4][n]OFF`` for texture coordinates,
colours, normals, a fourth homogeneous coordinate, a number of dimensions. What stands behind a
vertex's coordinates, and behind a face's corners, is of no use here.

Geomview manual, "OFF: Object File Format", The Geometry Center, 1998.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .contents import BrokenFile, Contents, Piece, counted, note_small_faces, triangles_of_faces
from .rows import Column, read_rows
from .text import bytes_of, integer_of, integers_of, numbers_in

KEYWORD = re.compile(rb"\s*(?:#[^\n]*\n\s*)*((?:ST|C|N|4|n)*)OFF[ \t]*(BINARY)?")

INTEGER, NUMBER = np.dtype(">i4"), np.dtype(">f4")


def read_off(path: Path) -> Contents:
    """Read an OFF file."""
    raw = path.read_bytes()
    found = KEYWORD.match(raw)
    if found and found[2]:
        return _read_binary(path, raw, found)
    data = bytes_of(path)
    found = KEYWORD.match(data)
    kind, begin = (found[1], found.end()) if found else (b"", 0)
    n_lines = data.count(b"\n", 0, begin)
    # The keyword's line may go on with the counts, also with no blank between ("OFF6 2 0").
    split = [line.partition(b"#")[0].split() for line in data[begin:].split(b"\n")]
    numbers = [number for number, words in enumerate(split, n_lines + 1) if words]
    rows = [words for words in split if words]
    if b"n" in kind:
        if not rows or len(rows[0]) != 1:
            raise BrokenFile("'nOFF' has to say how many dimensions there are")
        _refuse_dimensions(integer_of(rows[0][0], "the number of dimensions"))
        rows, numbers = rows[1:], numbers[1:]
    if not rows or not 2 <= len(rows[0]) <= 3:
        raise BrokenFile("it does not begin with 'OFF' and the numbers of vertices and faces")
    n_vertices = integer_of(rows[0][0], "the number of vertices")
    n_faces = integer_of(rows[0][1], "the number of faces")
    if len(rows) - 1 < n_vertices + n_faces:
        raise BrokenFile(
            f"it announces {n_vertices} vertices and {n_faces} faces, a line each, but has only "
            f"{counted(len(rows) - 1, 'line')} of them"
        )
    rows, numbers = rows[1:], numbers[1:]
    vertices = _vertices(rows[:n_vertices], numbers, b"4" in kind)
    last = n_vertices + n_faces
    corners, sizes = _faces(rows[n_vertices:last], numbers[n_vertices:])
    notes = note_small_faces(sizes)
    if len(rows) > last:
        notes.append(f"not read: {counted(len(rows) - last, 'line')} behind the last face")
    return Contents([Piece(path.stem, triangles_of_faces(vertices, corners, sizes))], notes)


def _refuse_dimensions(dimensions: int) -> None:
    if dimensions != 3:
        raise BrokenFile(f"it has {dimensions} dimensions, not three")


def _vertices(rows: list[list[bytes]], numbers: list[int], is_homogeneous: bool) -> np.ndarray:
    """Return the vertices, (n, 3) float64, of rows with the given numbers of their lines."""
    n = 4 if is_homogeneous else 3
    for row, number in zip(rows, numbers):
        if len(row) < n:
            raise BrokenFile(f"line {number}: a vertex has {len(row)} of {n} coordinates")
    return _flattened(numbers_in([row[:n] for row in rows], numbers).reshape(-1, n))


def _flattened(vertices: np.ndarray) -> np.ndarray:
    """Return vertices of four homogeneous coordinates, if they are such, as points of space."""
    if vertices.shape[1] == 3:
        return vertices
    with np.errstate(all="ignore"):
        return vertices[:, :3] / vertices[:, 3:]


def _faces(rows: list[list[bytes]], numbers: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners of all faces, one after the other, and how many each has."""
    sizes = numbers_in([row[:1] for row in rows], numbers, integers_of)
    lengths = np.array([len(row) - 1 for row in rows], dtype=np.int64)
    wrong = np.flatnonzero((sizes < 0) | (sizes > lengths))
    if len(wrong):
        at = wrong[0]
        raise BrokenFile(f"line {numbers[at]}: a face of {sizes[at]} corners names {lengths[at]}")
    # Colours may follow.
    named = [row[1 : 1 + size] for row, size in zip(rows, sizes.tolist())]
    return numbers_in(named, numbers, integers_of), sizes


def _read_binary(path: Path, data: bytes, found: re.Match[bytes]) -> Contents:
    """Read the binary form: the same numbers, all of four bytes, the largest first."""
    kind, begin = found[1], data.find(b"\n", found.end()) + 1
    n_counts = 4 if b"n" in kind else 3
    counts = np.frombuffer(data[begin : begin + 4 * n_counts], dtype=INTEGER).tolist()
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
