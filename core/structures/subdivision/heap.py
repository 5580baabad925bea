"""Depth-first with a heap: the list of cells is ordered from the most promising one.

Most promising is the cell that the ray enters first. Where planes are met at nearly the same t, the
early t of entries do not tell the order of cells. So an entry is queued by its t limited to that of
its next sibling along the ray, its `ceiling`, which holds for all its descendants too; of equals
the younger one comes first.
"""

from __future__ import annotations

import numpy as np

from ...contract.events import NONE, SKIP, VISIT_INNER, VOLUME_TEST, note
from ...contract.walk import walk
from ...kernels import implements, inlined, inner, whole
from .tree import EMPTY, NODE, ROOT, Span, enter_root, expand, leaf_index, push
from .walks import NOWHERE_YET, Heap, found, limit_of, visit_leaf

ENTER, EXIT, LATE, KEY, CEILING, AGE = range(6)
"""Columns of an entry, beside that of its node."""


@inlined
def before(heap, i, j):
    """Say whether entry i comes before entry j: by key, the younger one of equals."""
    a, b = heap[i, KEY], heap[j, KEY]
    return a < b or (a == b and heap[i, AGE] > heap[j, AGE])


@inlined
def swap(heap, i, j):
    """Exchange two entries."""
    for column in range(7):
        heap[i, column], heap[j, column] = heap[j, column], heap[i, column]


@inner
def rise(heap, i):
    """Bring the last entry, i, to its place."""
    while i > 0 and before(heap, i, (i - 1) // 2):
        swap(heap, i, (i - 1) // 2)
        i = (i - 1) // 2


@inner
def sink(heap, size):
    """Bring the first of `size` entries to its place."""
    i, c = 0, 1
    while c < size:
        if c + 1 < size and before(heap, c + 1, c):
            c += 1
        if not before(heap, c, i):
            break
        swap(heap, i, c)
        i, c = c, 2 * c + 1


@inner
def queue(workspace, place, size, floor, ceiling, age):
    """Copy the node at a place of the stack into the heap of `size` entries; return its key."""
    stack, heap = workspace.stack, workspace.rows
    key = stack[place, 1]
    key = floor if key < floor else key
    key = ceiling if key > ceiling else key
    heap[size, NODE], heap[size, ENTER] = stack[place, 0], stack[place, 1]
    heap[size, EXIT], heap[size, LATE] = stack[place, 2], stack[place, 3]
    heap[size, KEY], heap[size, CEILING], heap[size, AGE] = key, ceiling, age
    rise(heap, size)
    return key


@implements(walk, Heap, inline=True)
def walk_heap(structure, geometry, ray, number, workspace, log):
    """Visit the most promising cell next: the one entered first."""
    tree, heap = structure.tree, workspace.rows
    span, _, _ = enter_root(tree.box, ray, workspace.frame)
    note(log, VOLUME_TEST, NONE, NONE, span.enter, span.enter)
    visited, inner, size, age = NOWHERE_YET, 0, EMPTY, whole(0)
    limit = ray.t_max
    if span.enter < np.inf:
        push(workspace, EMPTY, ROOT, span)
        queue(workspace, EMPTY, EMPTY, 0.0, np.inf, age)
        size = 1
    while size > 0:
        node, span = whole(heap[0, NODE]), Span(heap[0, ENTER], heap[0, EXIT], heap[0, LATE])
        floor, ceiling = heap[0, KEY], heap[0, CEILING]
        size -= 1
        swap(heap, 0, size)
        sink(heap, size)
        if span.enter > limit:
            note(log, SKIP, node, NONE, span.enter, span.exit)
            continue
        index = leaf_index(tree, node)
        if index >= 0:
            visited = visit_leaf(
                tree, structure.mailbox, geometry, ray, number, workspace, log,
                node, index, span.enter, span.exit, visited,
            )  # fmt: skip
            limit = limit_of(tree, ray, visited)
            continue
        inner += 1
        note(log, VISIT_INNER, node, NONE, span.enter, span.exit)
        node, span, height = expand(tree, node, workspace, span, EMPTY)
        push(workspace, height, node, span)
        # From the last child along the ray to the first.
        for i in range(height + 1):
            age += 1
            ceiling = queue(workspace, i, size, floor, ceiling, age)
            size += 1
    return found(visited, inner)
