"""The recursive walk: depth-first with a stack, near children first (Gargantini, Atkinson)."""

from __future__ import annotations

import numpy as np

from ...contract.events import NONE, SKIP, VISIT_INNER, VOLUME_TEST, note
from ...contract.walk import walk
from ...kernels import implements
from .tree import EMPTY, ROOT, enter_root, expand, leaf_index, pop, push
from .walks import NOWHERE_YET, Recursive, found, limit_of, visit_leaf


@implements(walk, Recursive, inline=True)
def walk_recursive(structure, geometry, ray, number, workspace, log):
    """Go on with the first child along the ray, put the others on a stack."""
    tree = structure.tree
    span, _, _ = enter_root(tree.box, ray, workspace.frame)
    note(log, VOLUME_TEST, NONE, NONE, span.enter, span.enter)
    visited, inner, height = NOWHERE_YET, 0, EMPTY
    limit = ray.t_max
    if span.enter < np.inf:
        push(workspace, height, ROOT, span)
        height = 1
    while height > 0:
        height -= 1
        node, span = pop(workspace, height)
        if span.enter > limit:
            note(log, SKIP, node, NONE, span.enter, span.exit)
            continue
        index = leaf_index(tree, node)
        while index < 0:
            inner += 1
            note(log, VISIT_INNER, node, NONE, span.enter, span.exit)
            node, span, height = expand(tree, node, workspace, span, height)
            index = leaf_index(tree, node)
        visited = visit_leaf(
            tree, structure.mailbox, geometry, ray, number, workspace, log,
            node, index, span.enter, span.exit, visited,
        )  # fmt: skip
        limit = limit_of(tree, ray, visited)
    return found(visited, inner)
