"""Binary trees as nested pairs of leaf numbers, and as linked trees that optimisers rearrange."""

import itertools

import numpy as np
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.top_down import binned_sah
from accelscope.core.structures.bvh.optimisers import OPTIMISERS
from accelscope.core.structures.bvh.settings import BVHSettings
from accelscope.core.structures.bvh.topology.tree import LinkedTree, Primitives, linked

SETTINGS = BVHSettings(max_leaf_size=1, batch=0.25)
"""A batch that has something to do in a tree of a thousand nodes."""


def tree_of(nested, boxes):
    """The linked tree of nested pairs of leaf numbers."""
    n = len(boxes)
    tree = LinkedTree(
        np.zeros((2 * n - 1, 6)), *(np.full(2 * n - 1, -1, np.int32) for _ in range(3))
    )
    tree.boxes[:n] = boxes
    numbers, todo, preorder = itertools.count(n), [(nested, -1, None)], []
    while todo:
        part, parent, side = todo.pop()
        node = next(numbers) if isinstance(part, tuple) else part
        tree.parent[node] = parent
        if side is not None:
            side[parent] = node
        if isinstance(part, tuple):
            preorder.append(node)
            todo += [(part[1], node, tree.right), (part[0], node, tree.left)]
    for node in reversed(preorder):
        a, b = tree.boxes[tree.left[node]], tree.boxes[tree.right[node]]
        tree.boxes[node] = union(a, b)
    return tree


def nested_of(tree, node=None):
    """The nested pairs of a linked tree."""
    node = int(np.flatnonzero(tree.parent < 0)[0]) if node is None else int(node)
    if tree.left[node] < 0:
        return node
    return nested_of(tree, tree.left[node]), nested_of(tree, tree.right[node])


def union(a, b):
    return np.concatenate([np.minimum(a[:3], b[:3]), np.maximum(a[3:], b[3:])])


def measure(nested, boxes):
    """The box of nested pairs, and the sum of the areas of all pairs."""
    if not isinstance(nested, tuple):
        return boxes[nested], 0.0
    (a, below_a), (b, below_b) = (measure(part, boxes) for part in nested)
    box = union(a, b)
    return box, below_a + below_b + float(surface_area(box))


def parts_of(nested):
    """All subtrees, this one included."""
    yield nested
    if isinstance(nested, tuple):
        for part in nested:
            yield from parts_of(part)


def leaves_of(nested):
    return {part for part in parts_of(nested) if not isinstance(part, tuple)}


def without(nested, part):
    """The tree without one of its subtrees, whose sibling takes the parent's place."""
    if not isinstance(nested, tuple):
        return nested
    if part in nested:
        return nested[1 - nested.index(part)]
    return tuple(without(each, part) for each in nested)


def beside(nested, place, part):
    """The tree with a new subtree hung beside `place`."""
    if nested == place:
        return (nested, part)
    if not isinstance(nested, tuple):
        return nested
    return tuple(beside(each, place, part) for each in nested)


def balanced(leaves):
    leaves = list(leaves)
    if len(leaves) == 1:
        return int(leaves[0])
    return balanced(leaves[: len(leaves) // 2]), balanced(leaves[len(leaves) // 2 :])


def random_boxes(n, seed=0):
    rng = np.random.default_rng(seed)
    low = rng.random((n, 3))
    return np.concatenate([low, low + 0.4 * rng.random((n, 3))], axis=1)


def random_tree(boxes, seed=0):
    """A tree that joins nodes at random: nothing about it is good."""
    rng = np.random.default_rng(seed)
    parts = list(range(len(boxes)))
    while len(parts) > 1:
        a, b = (parts.pop(rng.integers(len(parts))) for _ in range(2))
        parts.append((a, b))
    return tree_of(parts[0], boxes)


def poor_tree(scene):
    """Halves of the triangles in their order, as soon as they are shuffled."""
    boxes = boxes_of(scene.triangles)
    return tree_of(balanced(np.random.default_rng(3).permutation(len(boxes))), boxes)


def good_tree(scene):
    grouping = binned_sah.build_binned_sah(
        Primitives(scene.geometry, scene.boxes()), SETTINGS, SILENT
    )
    return linked(grouping.tree)


def copied(tree):
    return LinkedTree(*(array.copy() for array in tree))


def optimised(name, tree, settings=SETTINGS, progress=SILENT, log=False):
    return OPTIMISERS[name].optimise(tree, settings, progress, log)


def assert_sound(tree, leaf_boxes):
    n = len(leaf_boxes)
    np.testing.assert_array_equal(tree.boxes[:n], leaf_boxes)
    assert (tree.left[:n] == -1).all()
    assert (tree.right[:n] == -1).all()
    inner = np.arange(n, 2 * n - 1)
    left, right = tree.left[inner], tree.right[inner]
    roots = np.flatnonzero(tree.parent < 0)
    assert len(roots) == 1
    children = np.sort(np.concatenate([left, right, roots]))
    np.testing.assert_array_equal(children, np.arange(2 * n - 1))
    np.testing.assert_array_equal(tree.parent[left], inner)
    np.testing.assert_array_equal(tree.parent[right], inner)
    low = np.minimum(tree.boxes[left, :3], tree.boxes[right, :3])
    high = np.maximum(tree.boxes[left, 3:], tree.boxes[right, 3:])
    np.testing.assert_array_equal(tree.boxes[inner], np.concatenate([low, high], axis=1))
    reached, level = 0, roots
    while len(level):
        reached += len(level)
        level = level[tree.left[level] >= 0]
        level = np.concatenate([tree.left[level], tree.right[level]])
    assert reached == 2 * n - 1


def cost_of(tree, settings=SETTINGS):
    areas = surface_area(tree.boxes)
    is_leaf = tree.left < 0
    total = settings.C_trav * areas[~is_leaf].sum() + settings.C_isect * areas[is_leaf].sum()
    return total / areas[tree.parent < 0][0]


def assert_never_worse(costs):
    assert all(b <= a * (1.0 + 1e-12) for a, b in itertools.pairwise(costs)), costs
