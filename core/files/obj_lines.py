"""The lines of an OBJ file, read by a kernel; what it finds odd it leaves to Python."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..kernels import call, inner, kernel
from .plain_numbers import LINE_FEED, SLASH, after_blanks, float_at, integer_at, is_blank

HASH, SMALL_F, SMALL_N, SMALL_O, SMALL_P, SMALL_S, SMALL_T, SMALL_V = map(ord, "#fnopstv")

VERTICES, ODD_VERTICES, FACES, ODD_FACES, CORNERS, OTHERS = range(6)
"""Places among the counts."""


class Lines(NamedTuple):
    """What the lines of a file are; the arrays have room for more.

    A *place* is where a line begins in the text.

    Attributes
    ----------
    counts : (6,) int64
        How many there are: vertices, odd ones among them, faces, odd ones, corners, other lines.
    vertices : (n_vertices, 3) float64
        Those that are odd are not filled in.
    odd_vertices : (n_odd_vertices, 2) int64
        Row and place of vertices that Python has to read.
    sizes, places, above : (n_faces,) int64
        Of each face its corners, its place, and the vertices above it.
    odd_faces : (n_odd_faces, 2) int64
        The face and its first corner, for those whose corners Python has to read.
    corners : (n_corners,) int64
        The numbers that faces give.
    others : (n_others, 2) int64
        Place of other lines, but for comments, normals and the like, and the faces above it.
    """

    counts: np.ndarray
    vertices: np.ndarray
    odd_vertices: np.ndarray
    sizes: np.ndarray
    places: np.ndarray
    above: np.ndarray
    odd_faces: np.ndarray
    corners: np.ndarray
    others: np.ndarray


def lines_of(text: bytes) -> Lines:
    """Return what the lines of a text are, which ends with a line feed, read by a kernel."""
    # Room for all that there may be. What is not used of it takes no memory.
    vertices, faces, others = map(text.count, (b"v", b"f", b"\n"))
    corners = sum(map(text.count, (b" ", b"\t", b"\v", b"\f")))
    lines = Lines(
        np.zeros(6, np.int64),
        np.empty((vertices, 3)), np.empty((vertices, 2), np.int64),
        np.empty(faces, np.int64), np.empty(faces, np.int64), np.empty(faces, np.int64),
        np.empty((faces, 2), np.int64), np.empty(corners, np.int64),
        np.empty((others, 2), np.int64),
    )  # fmt: skip
    call(read_lines, np.frombuffer(text, np.uint8), lines)
    counts = lines.counts
    return Lines(
        counts,
        lines.vertices[: counts[VERTICES]], lines.odd_vertices[: counts[ODD_VERTICES]],
        lines.sizes[: counts[FACES]], lines.places[: counts[FACES]], lines.above[: counts[FACES]],
        lines.odd_faces[: counts[ODD_FACES]], lines.corners[: counts[CORNERS]],
        lines.others[: counts[OTHERS]],
    )  # fmt: skip


@kernel
def read_lines(data, lines):
    """Read all lines of a text."""
    at = 0
    while at < len(data):
        place = at
        at = after_blanks(data, at)
        if data[at] == SMALL_V and ends_keyword(data[at + 1]):
            read_vertex(data, at + 1, place, lines)
        elif data[at] == SMALL_F and ends_keyword(data[at + 1]):
            read_face(data, at + 1, place, lines)
        elif data[at] == SMALL_F and data[at + 1] == SMALL_O and ends_keyword(data[at + 2]):
            read_face(data, at + 2, place, lines)
        elif not is_of_no_use(data, at):
            other = lines.counts[OTHERS]
            lines.others[other, 0], lines.others[other, 1] = place, lines.counts[FACES]
            lines.counts[OTHERS] += 1
        while data[at] != LINE_FEED:
            at += 1
        at += 1


@inner
def read_vertex(data, at, place, lines):
    """Read three numbers; colours or a weight may follow."""
    row = lines.counts[VERTICES]
    lines.counts[VERTICES] += 1
    for axis in range(3):
        at, lines.vertices[row, axis] = float_at(data, after_blanks(data, at))
        if at < 0:
            odd = lines.counts[ODD_VERTICES]
            lines.odd_vertices[odd, 0], lines.odd_vertices[odd, 1] = row, place
            lines.counts[ODD_VERTICES] += 1
            return


@inner
def read_face(data, at, place, lines):
    """Read corners such as ``7`` or ``7/1/2``; if one is not plain, only count them."""
    face, first = lines.counts[FACES], lines.counts[CORNERS]
    corner, is_odd = first, False
    at = after_blanks(data, at)
    while data[at] != LINE_FEED and data[at] != HASH:
        end, lines.corners[corner] = integer_at(data, at)
        corner += 1
        is_odd |= end < 0 or not (data[end] == SLASH or ends_word(data[end]))
        while not ends_word(data[at]):
            at += 1
        at = after_blanks(data, at)
    if is_odd:
        odd = lines.counts[ODD_FACES]
        lines.odd_faces[odd, 0], lines.odd_faces[odd, 1] = face, first
        lines.counts[ODD_FACES] += 1
    lines.sizes[face], lines.places[face] = corner - first, place
    lines.above[face] = lines.counts[VERTICES]
    lines.counts[FACES] += 1
    lines.counts[CORNERS] = corner


@inner
def ends_word(byte):
    """Say whether a byte is white space, the end of a line, or the beginning of a comment."""
    return ends_keyword(byte) or byte == HASH


@inner
def is_of_no_use(data, at):
    """Say whether a line is empty, a comment, a normal (vn), vt, vp, or a smoothing group (s)."""
    if data[at] == LINE_FEED or data[at] == HASH:
        return True
    if data[at] == SMALL_V:
        at += 1
        if data[at] != SMALL_N and data[at] != SMALL_T and data[at] != SMALL_P:
            return False
    elif data[at] != SMALL_S:
        return False
    return ends_keyword(data[at + 1])


@inner
def ends_keyword(byte):
    """Say whether a byte is white space or the end of a line."""
    return is_blank(byte) or byte == LINE_FEED
