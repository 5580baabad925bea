"""Wavefront OBJ: vertices, and polygons that name them by number.

A face may name vertices from the front (1 is the first of the file) or from the back (-1 is the
last one above the face). Of ``v/vt/vn`` only v matters here. One piece is a run of faces with the
same object, group and material.

Not read by trimesh: it counts negative numbers back from the end of the file, skips vertices that a
tab follows, fans out concave polygons and gives the two triangles of a quad numbers far apart.

Wavefront Technologies: Object Files (.obj), Advanced Visualizer manual, appendix B1.
"""

from __future__ import annotations

import contextlib
import itertools
import re
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .contents import BrokenFile, Contents, Piece, counted, note_small_faces, triangles_of_faces
from .text import floats_of, integers_of, name_of, shown, text_of

ELSEWHERE = frozenset(
    b"vt vn vp s mg mtllib usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj ctech "
    b"stech cstype deg bmat step parm trim hole scrv sp end con".split()
)
"""Statements that make no surface of their own: normals, materials, the parts of curves."""

NOT_READ = {
    b"p": ("statement of points (p)", "statements of points (p)"),
    b"l": ("line (l)", "lines (l)"),
    b"curv": ("curve (curv)", "curves (curv)"),
    b"curv2": ("curve (curv2)", "curves (curv2)"),
    b"surf": ("free-form surface (surf)", "free-form surfaces (surf)"),
    b"call": ("file to be put in (call)", "files to be put in (call)"),
    b"csh": ("command of the system (csh)", "commands of the system (csh)"),
    **{
        old: (f"old free-form element ({old.decode()})", f"old free-form elements ({old.decode()})")
        for old in (b"bsp", b"bzp", b"cdc", b"cdp", b"res")
    },
}
"""Statements that make something to be seen."""


Key = tuple[bytes, bytes, bytes]
"""Names of the object, the group and the material that a face belongs to."""

NO_NAMES: Key = (b"", b"", b"")

NAMING = {b"o": 0, b"g": 1, b"usemtl": 2}
"""Which name of a key a statement sets."""


class Text:
    """The lines of a file, where one that ends in a backslash goes on in the next."""

    def __init__(self, path: Path) -> None:
        data = text_of(path.read_bytes())
        if b"\\" in data:
            # The break becomes a vertical tab, a blank too, so that lines can still be counted. In
            # a comment a backslash is a backslash: it may be the end of a folder's name.
            data = re.sub(rb"(?m)^([^#\n]*?)\\[ \t]*(?:\n|\Z)", rb"\1\v", data)
        self.lines = data.split(b"\n")

    def place(self, index: int) -> str:
        """Return the place in the file of a line of ours, such as ``"line 7"``."""
        joined = sum(line.count(b"\v") for line in self.lines[:index])
        return f"line {1 + index + joined}"


@dataclass
class Statements:
    """What stands in a file, words still; `..._lines` are indices of lines of the text."""

    vertices: list[bytes] = field(default_factory=list)  # three words each
    vertex_lines: list[int] = field(default_factory=list)
    corners: list[bytes] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)  # of faces
    face_lines: list[int] = field(default_factory=list)
    vertices_above: list[int] = field(default_factory=list)  # of each face
    runs: list[tuple[int, Key]] = field(default_factory=lambda: [(0, NO_NAMES)])
    """The first face from which on a key holds, and that key."""
    others: Counter[bytes] = field(default_factory=Counter)


def read_obj(path: Path) -> Contents:
    """Read an OBJ file."""
    text = Text(path)
    found = statements_of(text)
    vertices = _vertices(found, text)
    sizes = np.array(found.sizes, dtype=np.int64)
    corners = _corners(found, text, sizes, len(vertices))
    triangles = triangles_of_faces(vertices, corners, sizes)
    firsts = np.concatenate([[0], np.cumsum(np.maximum(sizes - 2, 0))])
    pieces = []
    for (face, key), (next_face, _) in itertools.pairwise([*found.runs, (len(sizes), NO_NAMES)]):
        mine = triangles[firsts[face] : firsts[next_face]]
        if len(mine):
            # The same name in several places, as exporters give to object and group, is said once.
            names = dict.fromkeys(name_of(name) for name in key if name)
            pieces.append(Piece("/".join(names) or path.stem, mine))
    return Contents(pieces, _notes(found.others) + note_small_faces(sizes))


def statements_of(text: Text) -> Statements:
    """Return the statements of a file, sorted by what they are."""
    found = Statements()
    for index, line in enumerate(text.lines):
        words = line.split()
        if not words:
            continue
        keyword = words[0]
        if keyword == b"v":
            found.vertices += words[1:4]  # colours or a weight may follow
            found.vertex_lines.append(index)
        elif keyword == b"f" or keyword == b"fo":
            if b"#" in line:
                words = line.partition(b"#")[0].split()
            found.corners += words[1:]
            found.sizes.append(len(words) - 1)
            found.face_lines.append(index)
            found.vertices_above.append(len(found.vertex_lines))
        elif keyword in NAMING:
            names = list(found.runs[-1][1])
            names[NAMING[keyword]] = b" ".join(words[1:])
            _begin_run(found, (names[0], names[1], names[2]))
        elif keyword not in ELSEWHERE and not keyword.startswith(b"#"):
            found.others[keyword] += 1
    return found


def _begin_run(found: Statements, key: Key) -> None:
    """Note that a key holds from here on; one that held for no face is forgotten."""
    if found.runs[-1][0] == len(found.sizes):
        found.runs.pop()
    if not found.runs or found.runs[-1][1] != key:
        found.runs.append((len(found.sizes), key))


def _vertices(found: Statements, text: Text) -> np.ndarray:
    """Return the vertices, (n, 3) float64."""
    if len(found.vertices) == 3 * len(found.vertex_lines):
        with contextlib.suppress(ValueError):
            return floats_of(found.vertices).reshape(-1, 3)
    # A number too few or none at all, or a comment that touches a number.
    rows = []
    for index in found.vertex_lines:
        row = text.lines[index].partition(b"#")[0].split()[1:4]
        if len(row) < 3:
            raise BrokenFile(f"{text.place(index)}: a vertex has {len(row)} of three coordinates")
        try:
            rows.append(floats_of(row))
        except ValueError:
            raise BrokenFile(
                f"{text.place(index)}: {shown(b' '.join(row))} are no numbers"
            ) from None
    return np.array(rows).reshape(-1, 3)


def _corners(found: Statements, text: Text, sizes: np.ndarray, n_vertices: int) -> np.ndarray:
    """Return the vertex of every corner of every face, counted from 0, (n,) int64."""
    words = found.corners
    if any(b"/" in word for word in words):
        words = [word.partition(b"/")[0] for word in words]
    try:
        numbers = integers_of(words)
    except ValueError:
        raise _bad_corner(found, text) from None
    above = np.repeat(np.array(found.vertices_above, dtype=np.int64), sizes)
    corners = np.where(numbers < 0, above + numbers, numbers - 1)
    wrong = np.flatnonzero((corners < 0) | (corners >= n_vertices))
    if len(wrong):
        number = numbers[wrong[0]]
        there = f"{above[wrong[0]]} above it" if number < 0 else f"{n_vertices}"
        face = int(np.searchsorted(np.cumsum(sizes), wrong[0], side="right"))
        place = text.place(found.face_lines[face])
        raise BrokenFile(f"{place}: a face names vertex {number} of {there}")
    return corners


def _bad_corner(found: Statements, text: Text) -> BrokenFile:
    """Return what is wrong with the first corner that is no number."""
    words = iter(found.corners)
    for size, index in zip(found.sizes, found.face_lines):
        for word in itertools.islice(words, size):
            try:
                integers_of([word.partition(b"/")[0]])
            except ValueError:
                return BrokenFile(f"{text.place(index)}: {shown(word)} is no corner of a face")
    raise AssertionError("every corner is a number")


def _notes(others: Counter[bytes]) -> list[str]:
    """Return sentences on the statements that were not read."""
    known = [
        counted(others[keyword], *NOT_READ[keyword]) for keyword in NOT_READ if keyword in others
    ]
    unknown = sorted(others.keys() - NOT_READ.keys())
    notes = [f"not read: {', '.join(known)}"] if known else []
    if unknown:
        listed = ", ".join(map(shown, unknown[:5])) + (", ..." if len(unknown) > 5 else "")
        lines = counted(sum(others[keyword] for keyword in unknown), "line")
        notes.append(f"not read: {lines} with what OBJ does not have: {listed}")
    return notes
