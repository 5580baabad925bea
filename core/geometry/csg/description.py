"""Trees of constructive solid geometry (CSG) as they are described.

An inner node is a set operation, a leaf a solid with an inside: a sphere, a box, a capped cone, a
half-space, a closed mesh. Operands are nodes themselves, to any depth.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ..solids.description import Item, Point, moved_item


class HalfSpace(NamedTuple):
    """All points p with ``normal . p <= normal . point``: what lies behind a plane.

    Attributes
    ----------
    point : (3,) float
        Any point of the plane.
    normal : (3,) float
        Points out of the half-space; it need not have unit length.
    """

    point: Point
    normal: Point


class ClosedMesh(NamedTuple):
    """All points inside of a closed surface of triangles.

    Attributes
    ----------
    vertices : (n, 3) float
    triangles : (m, 3) int
        Counter-clockwise as seen from outside.
    """

    vertices: np.ndarray
    triangles: np.ndarray


def mesh_of_triangles(corners: np.ndarray) -> ClosedMesh:
    """Return triangles, (n, 3, 3), as a closed mesh."""
    points, ids = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    return ClosedMesh(points, ids.reshape(-1, 3))


class Union(NamedTuple):
    """What is in one of the operands at least; more than two of them are halved into a tree."""

    operands: Sequence[Node]


class Intersection(NamedTuple):
    """What is in all operands."""

    operands: Sequence[Node]


class Difference(NamedTuple):
    """What is in the first operand and in none of the others."""

    operands: Sequence[Node]


Node = Union | Intersection | Difference | HalfSpace | ClosedMesh | Item

OPERATIONS = Union, Intersection, Difference


def is_tree(described: object) -> bool:
    """Say whether a description is one of a tree, or of a leaf that only trees have."""
    return isinstance(described, (*OPERATIONS, HalfSpace, ClosedMesh))


def leaves_of(node: Node) -> Iterator[Node]:
    """Yield the leaves of a tree, from the first operands to the last."""
    waiting = [node]
    while waiting:
        node = waiting.pop()
        if isinstance(node, OPERATIONS):
            waiting += reversed(node.operands)
        else:
            yield node


def moved_node(node: Node, matrix: np.ndarray) -> Node:
    """Return a tree seen through an affine matrix, (3, 4) or (4, 4) float64."""
    if np.array_equal(matrix[:3], np.eye(3, 4)):
        return node
    if isinstance(node, OPERATIONS):
        return type(node)([moved_node(operand, matrix) for operand in node.operands])
    linear, shift = matrix[:3, :3], matrix[:3, 3]
    if isinstance(node, HalfSpace):
        # Normals are moved by the transposed inverse, here without its determinant, whose sign
        # is that of a mirror.
        x, y, z = linear.T
        cofactors = np.column_stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)])
        normal = cofactors @ np.asarray(node.normal, np.float64)
        sign = -1.0 if (np.cross(x, y) * z).sum() < 0.0 else 1.0
        return HalfSpace(linear @ np.asarray(node.point, np.float64) + shift, sign * normal)
    if isinstance(node, ClosedMesh):
        return ClosedMesh(np.asarray(node.vertices, np.float64) @ linear.T + shift, node.triangles)
    return moved_item(node, matrix)
