"""Trees of hierarchies: from one form into the other and back, leaves by cost, bounded depth."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.workspace import MAXIMUM_DEPTH
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.topology.collapse import LeafRule, collapse
from accelscope.core.structures.bvh.topology.tree import (
    LinkedTree,
    Primitives,
    depths_of,
    linked,
    ranges_of,
)
from accelscope.sample_scenes import make_sample

RULE = LeafRule(4, 1.2, 1.0)


def cost_of(tree, rule):
    """Return the SAH cost, times the root's area."""
    areas = surface_area(tree.boxes)
    return rule.c_trav * areas[tree.size == 0].sum() + rule.c_isect * (areas * tree.size).sum()


def grouping_of(text, **changes):
    corners = make_sample(text).triangles
    settings = dataclasses.replace(BVHSettings(), max_leaf_size=1, **changes)
    build = BUILDERS[settings.builder].build
    return build(Primitives(all_triangles(corners), boxes_of(corners)), settings, SILENT)


def check(tree, order, boxes):
    """Assert that a tree partitions its references and that its boxes are exact unions."""
    width = np.where(tree.size > 0, 0, 2)
    begin, end = ranges_of(tree.first, tree.size, width)
    assert np.array_equal(np.sort(order), np.arange(len(boxes)))
    assert (begin[0], end[0]) == (0, len(boxes))
    for node in range(len(tree.size)):
        below = boxes[order[begin[node] : end[node]]]
        assert np.array_equal(tree.boxes[node, :3], below[:, :3].min(axis=0))
        assert np.array_equal(tree.boxes[node, 3:], below[:, 3:].max(axis=0))


def chain(count):
    """Return boxes nested like dolls, and the tree that has one of them per level."""
    sizes = np.arange(1.0, count + 1)[:, None]
    boxes = np.concatenate([-sizes, -sizes, -sizes, sizes, sizes, sizes], axis=1)
    tree = LinkedTree(
        np.concatenate([boxes, boxes[1:]]),
        *(np.full(2 * count - 1, -1, np.int32) for _ in range(3)),
    )
    for i in range(1, count):
        node, below = count + i - 1, count + i - 2 if i > 1 else 0
        tree.left[node], tree.right[node] = below, i
        tree.parent[below] = tree.parent[i] = node
    return boxes, tree


def test_linked_and_back():
    """Without leaves of several, the tree comes back: the same boxes over the same references."""
    grouping = grouping_of("suzanne:subdivisions=0")
    tree, order = collapse(linked(grouping.tree), LeafRule(1, 1.2, 1.0))
    assert np.array_equal(order, np.arange(len(order))), "left stays left"
    assert np.array_equal(tree.size, grouping.tree.size)
    assert np.array_equal(tree.first, grouping.tree.first)
    assert np.array_equal(tree.boxes, grouping.tree.boxes)


def test_a_leaf_of_several_cannot_be_linked():
    grouping = grouping_of("suzanne:subdivisions=0")
    tree, _ = collapse(linked(grouping.tree), RULE)
    with pytest.raises(ValueError, match="several"):
        linked(tree)


@pytest.mark.parametrize("limit", [1, 2, 4, 8, 1024])
def test_leaves_are_the_best_there_are(limit):
    """The cost is that of trying, for every node, both to end there and to go on."""
    scene = make_sample("suzanne:subdivisions=0")
    grouping = grouping_of("suzanne:subdivisions=0")
    source = linked(grouping.tree)
    rule = LeafRule(limit, 1.2, 1.0)
    tree, order = collapse(source, rule)
    check(tree, order, source.boxes[: len(scene)])
    assert tree.size.max() <= limit

    full = grouping.tree
    begin, end = ranges_of(full.first, full.size, np.where(full.size > 0, 0, 2))
    areas = surface_area(full.boxes)
    best = np.empty(len(full.size))
    for node in range(len(full.size) - 1, -1, -1):
        count = end[node] - begin[node]
        best[node] = rule.c_isect * count * areas[node] if count <= limit else np.inf
        if full.size[node] == 0:
            left = full.first[node]
            split = rule.c_trav * areas[node] + best[left] + best[left + 1]
            best[node] = min(best[node], split)
    assert cost_of(tree, rule) == pytest.approx(best[0], rel=1e-12)


@pytest.mark.parametrize("count", [2, 97, 98, 300])
def test_depth_is_bounded(count):
    boxes, source = chain(count)
    tree, order = collapse(source, LeafRule(1, 1.2, 1.0))
    check(tree, order, boxes)
    depth = depths_of(tree.first, tree.size, np.where(tree.size > 0, 0, 2)).max()
    assert depth <= MAXIMUM_DEPTH
    if count <= MAXIMUM_DEPTH + 1:
        assert depth == count - 1, "a tree that is not too deep stays as it is"


def test_one_triangle():
    boxes, source = chain(1)
    tree, order = collapse(source, RULE)
    assert (tree.size.tolist(), tree.first.tolist(), order.tolist()) == ([1], [0], [0])
    assert np.array_equal(tree.boxes, boxes)
