"""The cells of a BSP tree as polyhedra, to draw and to check.

They are not stored: each is cut out of its parent, from the root down.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...contract.cells import Polygons
from ...kernels import call, inner, kernel
from ...progress import SILENT, Progress
from ...ranges import ranges
from .grown import Grown
from .polyhedron import clip, make_polyhedra, measure


class Measures(NamedTuple):
    """Of every node.

    Attributes
    ----------
    boxes : (n, 6) float64
        Around the cells.
    areas, volumes : (n,) float64
    faces, corners : (n,) int64
        Number of faces, and of corners in all of them.
    cut : (n,) int64
        Number of corners of the face that the cut through the parent has made; 0 for the root.
    """

    boxes: np.ndarray
    areas: np.ndarray
    volumes: np.ndarray
    faces: np.ndarray
    corners: np.ndarray
    cut: np.ndarray


class Loops(NamedTuple):
    """Where polyhedra are written to: corners, face after face, and the ends of the faces.

    ``first_corner`` and ``first_face``, (n,) int64, are the places of a node's own.
    """

    points: np.ndarray
    ends: np.ndarray
    first_corner: np.ndarray
    first_face: np.ndarray


@inner
def write_loops(loops, node, room, row):
    """Copy a polyhedron."""
    corner, first = loops.first_corner[node], loops.first_face[node]
    for face in range(room.n_faces[row]):
        loops.ends[first + face] = corner + room.starts[row, face + 1]
    for i in range(room.starts[row, room.n_faces[row]]):
        for axis in range(3):
            loops.points[corner + i, axis] = room.points[row, i, axis]


@kernel
def visit_cells(tree, room, shell, stack, height, most, measures, loops, write):
    """Cut out cells, depth-first; measure them, or write them to `loops`. Return the new height.

    Parameters
    ----------
    tree : Grown
    room : Polyhedra
        One row per level.
    stack : (levels,) int64
        Nodes that wait, `height` of them. The polyhedra in the room are those above the last.
    most : int
        Cells after which to stop.
    """
    for _ in range(most):
        if height == 0:
            break
        height -= 1
        node = stack[height]
        level = tree.depth[node]
        if level > 0:
            parent = tree.parent[node]
            sign = -1.0 if tree.link[parent] == node else 1.0
            if not clip(room, level - 1, level, tree.planes[parent], sign, shell):
                room.n_faces[level] = 0
        if write:
            write_loops(loops, node, room, level)
        else:
            n = room.n_faces[level]
            measures.areas[node], measures.volumes[node] = measure(
                room, level, measures.boxes[node]
            )
            measures.faces[node], measures.corners[node] = n, room.starts[level, n]
            if level > 0 and n > 0:
                measures.cut[node] = room.starts[level, n] - room.starts[level, n - 1]
        if tree.link[node] > 0:
            stack[height], stack[height + 1] = tree.link[node] + 1, tree.link[node]
            height += 2
    return height


AT_ONCE = 20_000
"""Cells that are visited between two reports: a tenth of a second."""


def visit_all(
    tree: Grown, box: np.ndarray, shell: float, measures: Measures, loops: Loops, write: bool,
    progress: Progress,
) -> None:  # fmt: skip
    """Measure all cells of a tree, or write them to `loops`."""
    depth = int(tree.depth.max())
    room, stack = make_polyhedra(depth + 1, box), np.zeros(depth + 2, np.int64)
    height, done = 1, 0
    while height > 0:
        progress.report(done, len(tree.link), "Cutting out cells")
        height = call(
            visit_cells, tree, room, shell, stack, height, AT_ONCE, measures, loops, write
        )
        done += AT_ONCE


def measured(tree: Grown, box: np.ndarray, shell: float, progress: Progress = SILENT) -> Measures:
    """Return the measures of all cells of a tree whose root is a box, (6,)."""
    n = len(tree.link)
    measures = Measures(
        np.zeros((n, 6)), np.zeros(n), np.zeros(n), np.zeros(n, np.int64), np.zeros(n, np.int64),
        np.zeros(n, np.int64),
    )  # fmt: skip
    none = Loops(
        np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64)
    )
    visit_all(tree, box, shell, measures, none, False, progress)
    return measures


def polygons(
    tree: Grown, box: np.ndarray, shell: float, measures: Measures, progress: Progress = SILENT
) -> tuple[Polygons, Polygons]:
    """Return the faces of all cells, and the planes that cut the inner ones."""
    loops = Loops(
        np.zeros((int(measures.corners.sum()), 3)), np.zeros(int(measures.faces.sum()), np.int64),
        np.cumsum(measures.corners) - measures.corners, np.cumsum(measures.faces) - measures.faces,
    )  # fmt: skip
    visit_all(tree, box, shell, measures, loops, True, progress)
    owners = np.repeat(np.arange(len(tree.link)), measures.faces)
    faces = Polygons(loops.points, np.concatenate([[0], loops.ends]), owners)
    # The cut of an inner node is the last face of the left child.
    inner_nodes = np.flatnonzero(tree.link > 0)
    left = tree.link[inner_nodes].astype(np.int64)
    sizes = measures.cut[left]
    ends = (loops.first_corner + measures.corners)[left]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    points = loops.points[ranges(ends - sizes, sizes)]
    return faces, Polygons(points, offsets, inner_nodes)
