"""Preprocessing: one pass through the tree cuts the ray into segments, then these are processed.

A segment is the piece of the ray within one leaf. A ray with more segments than there are rows for
is cut piece by piece.
"""

from __future__ import annotations

import numpy as np

from ...contract.events import NONE, SKIP, VISIT_INNER, VOLUME_TEST, note
from ...contract.missing import note_if_missing
from ...contract.walk import walk
from ...kernels import implements, whole
from .tree import EMPTY, NODE, ROOT, ROWS, enter_root, expand, leaf_index, pop, push
from .walks import NOWHERE_YET, Segments, found, limit_of, one_missing, visit_leaf

ENTER, EXIT = 0, 1
"""Columns of a segment, beside that of its leaf's node."""


@implements(walk, Segments, inline=True)
def walk_segments(structure, geometry, ray, number, workspace, log):
    """Cut the ray into segments, then process these one by one."""
    tree, segments = structure.tree, workspace.rows
    span, _, _ = enter_root(tree.box, ray, workspace.frame)
    note(log, VOLUME_TEST, NONE, NONE, span.enter, span.enter)
    visited, inner, height = NOWHERE_YET, 0, EMPTY
    limit = ray.t_max
    if span.enter < np.inf:
        push(workspace, height, ROOT, span)
        height = 1
    while height > 0:
        # Preprocessing: the tree is left with a list of segments.
        count = 0
        while height > 0 and count < ROWS:
            height -= 1
            node, span = pop(workspace, height)
            if span.enter > limit:
                note(log, SKIP, node, NONE, span.enter, span.exit)
                continue
            while leaf_index(tree, node) < 0:
                inner += 1
                note(log, VISIT_INNER, node, NONE, span.enter, span.exit)
                node, span, height = expand(tree, node, workspace, span, height)
            if note_if_missing(tree, node):
                visited = one_missing(visited)
                limit = limit_of(tree, ray, visited)
                continue
            segments[count, ENTER] = span.enter
            segments[count, EXIT] = span.exit if span.exit > span.enter else span.enter
            segments[count, NODE] = node
            count += 1
        # Processing: the list is all that is needed now.
        for i in range(count):
            enter, leave = segments[i, ENTER], segments[i, EXIT]
            leaf = whole(segments[i, NODE])
            if enter > limit:
                note(log, SKIP, leaf, NONE, enter, leave)
                continue
            index = leaf_index(tree, leaf)
            visited = visit_leaf(
                tree, structure.mailbox, geometry, ray, number, workspace, log,
                leaf, index, enter, leave, visited,
            )  # fmt: skip
            limit = limit_of(tree, ray, visited)
    return found(visited, inner)
