"""An octree as the walks of :mod:`..subdivision` see it: one node, three planes, eight octants."""

from __future__ import annotations

from ...contract.missing import all_made
from ...kernels import implements, whole
from ..subdivision.tree import (
    child,
    expand,
    far_part,
    leaf_index,
    meets_far,
    meets_near,
    near_part,
    near_side,
    plane_times,
    planes,
    pop,
    push,
)
from .lazy import LazyPointers
from .storage import OCTREES

X, Y, Z = whole(0), whole(1), whole(2)
"""The axes."""


def leaf_index_of_octree(tree, node):
    """Leaves are numbered after the inner nodes."""
    return node - tree.planes.shape[0]


def planes_of_octree(tree, node):
    """Return the three planes of an inner node."""
    return tree.planes[node, 0], tree.planes[node, 1], tree.planes[node, 2]


def expand_octree(tree, node, workspace, span, height):
    """Cut the interval by x, its parts by y, theirs by z: at most four octants for most rays.

    From the far side of each plane to the near one, so that the first octant along the ray is
    pushed last; it is taken off the stack again.
    """
    frame = workspace.frame
    early_x, late_x = plane_times(frame, X, tree.planes[node, 0])
    early_y, late_y = plane_times(frame, Y, tree.planes[node, 1])
    early_z, late_z = plane_times(frame, Z, tree.planes[node, 2])
    # The octant in which a ray from very far begins; crossing a plane changes one bit.
    nearest = near_side(frame, X) + 2 * near_side(frame, Y) + 4 * near_side(frame, Z)
    for x in range(1, -1, -1):
        if not (meets_far(span, early_x) if x == 1 else meets_near(span, late_x)):
            continue
        in_x = far_part(span, early_x) if x == 1 else near_part(span, early_x, late_x)
        for y in range(1, -1, -1):
            if not (meets_far(in_x, early_y) if y == 1 else meets_near(in_x, late_y)):
                continue
            in_y = far_part(in_x, early_y) if y == 1 else near_part(in_x, early_y, late_y)
            for z in range(1, -1, -1):
                if not (meets_far(in_y, early_z) if z == 1 else meets_near(in_y, late_z)):
                    continue
                in_z = far_part(in_y, early_z) if z == 1 else near_part(in_y, early_z, late_z)
                push(workspace, height, child(tree, node, nearest ^ (x + 2 * y + 4 * z)), in_z)
                height += 1
    height -= 1
    first, span = pop(workspace, height)
    return first, span, height


for stored in OCTREES:
    all_made(stored)
    implements(leaf_index, stored)(leaf_index_of_octree)
for record in (*OCTREES, LazyPointers):
    implements(planes, record)(planes_of_octree)
    implements(expand, record)(expand_octree)
