"""The parts into which the planes of a BSP tree cut its items, leaf after leaf.

A finished tree keeps only which items its leaves list. Each is cut anew here by the planes on the
way from the root to the leaf, as it was when the tree was built (:mod:`.references`). What is not
cut, since it is not flat, is in every leaf that lists it as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...geometry.length import polygon_area
from ...geometry.shapes import Shapes
from ...kernels import call, inner, kernel, whole
from .grown import Grown
from .references import MOST_PLANES, Lists, append_side

NOTHING = -1
"""Instead of a reference, where nothing is left."""


class Parts(NamedTuple):
    """The parts of items in the leaves that list them.

    Attributes
    ----------
    points : (m, 3) float64
    offsets : (N_OIV + 1,) int64
        Entry i of the lists of leaves has ``points[offsets[i]:offsets[i + 1]]``: corners once
        around what is cut, points of its hull of anything else.
    """

    points: np.ndarray
    offsets: np.ndarray


@inner
def way_down(tree, node, path):
    """Write the nodes from one up to the root, which is left out; return how many."""
    height = 0
    while node > 0:
        path[height] = node
        height += 1
        node = whole(tree.parent[node])
    return height


@inner
def cut_down(tree, path, height, shapes, item, shell, lists):
    """Cut an item by all planes on the way down; return the reference to what is left of it."""
    begin, count = shapes.start[item], shapes.size[item]
    lists.item[0], lists.start[0], lists.size[0] = item, 0, count
    lists.used[0], lists.used[1] = 1, count
    for i in range(count):
        for axis in range(3):
            lists.points[i, axis] = shapes.points[begin + i, axis]
    reference = whole(0)
    for i in range(height - 1, -1, -1):
        above = tree.parent[path[i]]
        sign = -1.0 if tree.link[above] == path[i] else 1.0
        if append_side(lists, reference, 1, tree.planes[above], sign, shell) == 0:
            return whole(NOTHING)
        reference += 1
    return reference


@kernel
def add_areas(parts, references, areas):
    """Add the area of every part to that of its item; of what is nothing that is 0."""
    for entry in range(len(references)):
        begin, end = parts.offsets[entry], parts.offsets[entry + 1]
        areas[references[entry]] += polygon_area(parts.points, begin, end)


@kernel
def write_parts(tree, nodes, shapes, shell, lists, path, offsets, points):
    """Count the corners of all parts, or write them where `offsets` say, if there is room."""
    for leaf in range(len(nodes)):
        height = way_down(tree, nodes[leaf], path)
        for entry in range(tree.offsets[leaf], tree.offsets[leaf + 1]):
            item = tree.references[entry]
            reference = cut_down(tree, path, height, shapes, item, shell, lists)
            if reference == NOTHING:
                continue
            first, size = lists.start[reference], lists.size[reference]
            if len(points) == 0:
                offsets[entry + 1] = size
                continue
            for i in range(size):
                for axis in range(3):
                    points[offsets[entry] + i, axis] = lists.points[first + i, axis]


def room_for(tree: Grown, shapes: Shapes) -> tuple[np.ndarray, Lists, np.ndarray]:
    """Return the nodes of all leaves, and scratch memory for the parts of one item."""
    depth = int(tree.depth.max()) + 2
    most = int(shapes.size.max()) + MOST_PLANES
    lists = Lists(
        np.zeros(depth, np.int32), np.zeros(depth, np.int64), np.zeros(depth, np.int32),
        np.zeros((depth * most, 3)), np.zeros(1, np.int32), np.zeros(3, np.int64), shapes.is_cut,
    )  # fmt: skip
    nodes = np.empty(len(tree.offsets) - 1, np.int64)
    leaves = np.flatnonzero(tree.link < 0)
    nodes[-1 - tree.link[leaves]] = leaves
    return nodes, lists, np.zeros(depth, np.int64)


def parts_in_leaves(tree: Grown, shapes: Shapes, shell: float) -> Parts:
    """Return the parts of items in the leaves that list them."""
    nodes, lists, path = room_for(tree, shapes)
    offsets = np.zeros(len(tree.references) + 1, np.int64)
    call(write_parts, tree, nodes, shapes, shell, lists, path, offsets, np.zeros((0, 3)))
    offsets = np.cumsum(offsets)
    points = np.zeros((int(offsets[-1]), 3))
    if len(points):
        call(write_parts, tree, nodes, shapes, shell, lists, path, offsets, points)
    return Parts(points, offsets)


def covered_areas(tree: Grown, shapes: Shapes, shell: float) -> tuple[np.ndarray, int]:
    """Return of every item the area of its parts in leaves, and how many parts are nothing.

    The area of what is not cut means nothing.
    """
    parts = parts_in_leaves(tree, shapes, shell)
    areas = np.zeros(len(shapes.start))
    call(add_areas, parts, tree.references, areas)
    return areas, int((np.diff(parts.offsets) == 0).sum())
