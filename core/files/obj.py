"""Wavefront OBJ: vertices, and polygons that name them by number.

A face may name vertices from the front (1 is the first of the file) or from the back (-1 is the
last one above the face). Of ``v/vt/vn`` only v matters here. One piece is a run of faces with the
same object, group and material.

Not read by trimesh: it counts negative numbers back from the end of the file, skips vertices that a
tab follows, fans out concave polygons and gives the two triangles of a quad numbers far apart.

Wavefront Technologies: Object Files (.obj), Advanced Visualizer manual, appendix B1.
"""

from __future__ import annotations

import itertools
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from ..kernels import has_numba, is_plain
from ..ranges import ranges
from .contents import BrokenFile, Contents, Piece, counted, note_small_faces, triangles_of_faces
from .mtl import materials_in
from .obj_lines import lines_of
from .text import floats_of, integers_of, name_of, shown, text_of

ELSEWHERE = frozenset(
    b"vt vn vp s mg usemap maplib bevel c_interp d_interp lod shadow_obj trace_obj ctech "
    b"stech cstype deg bmat step parm trim hole scrv sp end con".split()
)
"""Statements that make no surface of their own: normals, the parts of curves."""

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


LARGE = 2_000_000
"""Bytes from which on a kernel reads a file; a smaller one is read before that is compiled."""

Key = tuple[bytes, bytes, bytes]
"""Names of the object, the group and the material that a face belongs to."""

NO_NAMES: Key = (b"", b"", b"")

NAMING = {b"o": 0, b"g": 1, b"usemtl": 2}
"""Which name of a key a statement sets."""


class Text:
    """A file's text, which ends with a line feed; one line goes on after a backslash at its end."""

    def __init__(self, path: Path) -> None:
        data = text_of(path.read_bytes())
        if b"\\" in data:
            # The break becomes a vertical tab, a blank too, so that lines can still be counted. In
            # a comment a backslash is a backslash: it may be the end of a folder's name.
            data = re.sub(rb"(?m)^([^#\n]*?)\\[ \t]*(?:\n|\Z)", rb"\1\v", data)
        self.data = data if data.endswith(b"\n") else data + b"\n"

    def line(self, at: int) -> bytes:
        """Return the line that begins at a place."""
        return self.data[at : self.data.index(b"\n", at)]

    def words(self, places: Iterable[int]) -> Iterator[list[bytes]]:
        """Yield the words of the lines that begin at some places, without comments."""
        for line in map(self.line, places):
            yield (line.partition(b"#")[0] if b"#" in line else line).split()

    def name(self, at: int) -> str:
        """Return what people call the line at a place, such as ``"line 7"``."""
        breaks = sum(self.data.count(byte, 0, at) for byte in (b"\n", b"\v"))
        return f"line {1 + breaks}"


class Statements:
    """What stands in a file.

    Attributes
    ----------
    vertices : (n_vertices, 3) float64
    numbers : (n_corners,) int64
        Of the vertices of faces, as they stand there.
    sizes, places, above : (n_faces,) int64
        Of each face the corners, where its line begins, and the vertices above it.
    runs : list of (int, Key)
        The first face from which on a key holds, and that key.
    others : Counter of bytes
        How often there is what is not read, by its keyword.
    libraries : list of bytes
        What follows each ``mtllib``.
    """

    def __init__(self, text: Text) -> None:
        self.text = text
        if len(text.data) >= LARGE and has_numba() and not is_plain():
            others = self._read_by_kernel()
        else:
            others = self._read_by_python()
        self.runs: list[tuple[int, Key]] = [(0, NO_NAMES)]
        self.others: Counter[bytes] = Counter()
        self.libraries: list[bytes] = []
        for at, face in others:
            keyword, *names = text.line(at).split()
            self._add(keyword, names, face)

    def _read_by_kernel(self) -> list[list[int]]:
        """Read vertices and faces; return places of other lines, and the faces above them."""
        lines = lines_of(self.text.data)
        self.vertices, self.numbers = lines.vertices, lines.corners
        self.sizes, self.places, self.above = lines.sizes, lines.places, lines.above
        rows, places = lines.odd_vertices.T
        self.vertices[rows] = self._vertices_at(places.tolist())
        faces, firsts = lines.odd_faces.T
        numbers, sizes = self._faces_at(self.places[faces].tolist())
        self.numbers[ranges(firsts, sizes)] = numbers
        return lines.others.tolist()

    def _read_by_python(self) -> list[list[int]]:
        """Read vertices and faces; return places of other lines, and the faces above them."""
        at, vertices, faces, above, others = 0, [], [], [], []
        for line in self.text.data.split(b"\n")[:-1]:
            words = line.split(None, 1)
            keyword = words[0] if words else b"#"
            if keyword == b"v":
                vertices.append(at)
            elif keyword in (b"f", b"fo"):
                faces.append(at)
                above.append(len(vertices))
            elif keyword not in ELSEWHERE and keyword[:1] != b"#":
                others.append([at, len(faces)])
            at += len(line) + 1
        self.vertices = self._vertices_at(vertices)
        self.numbers, self.sizes = self._faces_at(faces)
        self.places, self.above = np.array(faces, np.int64), np.array(above, np.int64)
        return others

    def _vertices_at(self, places: list[int]) -> np.ndarray:
        """Return the vertices, (n, 3), of the lines at some places."""
        words: list[bytes] = []
        for at, (_, *row) in zip(places, self.text.words(places)):
            if len(row) < 3:
                reason = f"{self.text.name(at)}: a vertex has {len(row)} of three coordinates"
                raise BrokenFile(reason)
            words += row[:3]  # colours or a weight may follow
        try:
            return floats_of(words).reshape(-1, 3)
        except ValueError:
            for at, (_, *row) in zip(places, self.text.words(places)):
                try:
                    floats_of(row[:3])
                except ValueError:
                    name, given = self.text.name(at), shown(b" ".join(row[:3]))
                    raise BrokenFile(f"{name}: {given} are no numbers") from None
            raise

    def _faces_at(self, places: list[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers that the faces at some places give, and how many each gives."""
        words: list[bytes] = []
        sizes: list[int] = []
        for _, *row in self.text.words(places):
            words += row
            sizes.append(len(row))
        if any(b"/" in word for word in words):
            words = [word.partition(b"/")[0] for word in words]
        try:
            return integers_of(words), np.array(sizes, np.int64)
        except ValueError:
            for at, (_, *row) in zip(places, self.text.words(places)):
                for word in row:
                    try:
                        integers_of([word.partition(b"/")[0]])
                    except ValueError:
                        name = self.text.name(at)
                        raise BrokenFile(f"{name}: {shown(word)} is no corner of a face") from None
            raise

    def _add(self, keyword: bytes, names: list[bytes], face: int) -> None:
        """Add a line that is no vertex and no face, above a face."""
        if keyword in NAMING:
            key = list(self.runs[-1][1])
            key[NAMING[keyword]] = b" ".join(names)
            # A key that held for no face is forgotten.
            if self.runs[-1][0] == face:
                self.runs.pop()
            if not self.runs or self.runs[-1][1] != tuple(key):
                self.runs.append((face, (key[0], key[1], key[2])))
        elif keyword == b"mtllib":
            self.libraries.append(b" ".join(names))
        elif keyword not in ELSEWHERE:
            self.others[keyword] += 1


def read_obj(path: Path) -> Contents:
    """Read an OBJ file."""
    found = Statements(Text(path))
    triangles = triangles_of_faces(found.vertices, _corners(found), found.sizes)
    firsts = np.concatenate([[0], np.cumsum(np.maximum(found.sizes - 2, 0))])
    ends = (len(found.sizes), NO_NAMES)
    materials, notes = materials_in(path.parent, found.libraries)
    pieces = []
    for (face, key), (next_face, _) in itertools.pairwise([*found.runs, ends]):
        mine = triangles[firsts[face] : firsts[next_face]]
        if len(mine):
            # The same name in several places, as exporters give to object and group, is said once.
            names = dict.fromkeys(name_of(name) for name in key if name)
            made_of = materials.get(name_of(key[NAMING[b"usemtl"]]))
            pieces.append(Piece("/".join(names) or path.stem, mine, made_of))
    return Contents(pieces, _notes(found.others) + note_small_faces(found.sizes) + notes)


def _corners(found: Statements) -> np.ndarray:
    """Return the vertex of every corner of every face, counted from 0, (n,) int64."""
    numbers, n_vertices = found.numbers, len(found.vertices)
    corners = numbers - 1
    backward = np.flatnonzero(numbers < 0)
    if len(backward):
        corners[backward] = (numbers + np.repeat(found.above, found.sizes))[backward]
    wrong = np.flatnonzero((corners < 0) | (corners >= n_vertices))
    if len(wrong):
        number = numbers[wrong[0]]
        face = int(np.searchsorted(np.cumsum(found.sizes), wrong[0], side="right"))
        there = f"{found.above[face]} above it" if number < 0 else f"{n_vertices}"
        name = found.text.name(int(found.places[face]))
        raise BrokenFile(f"{name}: a face names vertex {number} of {there}")
    return corners


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
