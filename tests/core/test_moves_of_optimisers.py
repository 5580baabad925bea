"""Every optimiser's move is the best one there is: found again by trying all of them."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from accelscope.core.contract.build_log import REINSERT
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.kernels import call
from accelscope.core.structures.bvh.optimisers import rearranging
from accelscope.core.structures.bvh.optimisers import reinsert as one_by_one
from accelscope.core.structures.bvh.optimisers import reinsert_batches as in_batches
from accelscope.core.structures.bvh.optimisers import reinsert_parallel as at_once
from accelscope.core.structures.bvh.optimisers import rotate as rotations
from accelscope.core.structures.bvh.topology.tree import LinkedTree
from accelscope.sample_scenes import make_sample
from nested_trees import (
    SETTINGS,
    assert_sound,
    beside,
    copied,
    good_tree,
    leaves_of,
    measure,
    nested_of,
    optimised,
    parts_of,
    poor_tree,
    random_boxes,
    random_tree,
    union,
    without,
)


@pytest.mark.parametrize("seed", range(4))
def test_reinsertion_finds_the_best_place_of_all(seed):
    boxes = random_boxes(11, seed)
    tree = random_tree(boxes, seed)
    nested, n_nodes = nested_of(tree), len(tree.left)
    before = measure(nested, boxes)[1]
    places, gains = np.empty(n_nodes, np.int32), np.zeros(n_nodes)
    nodes, search = np.arange(n_nodes, dtype=np.int32), at_once.make_search()
    call(at_once.search_range, tree, nodes, 0, n_nodes, 1e-12, search, places, gains)
    for node in range(n_nodes):
        if tree.parent[node] < 0:
            assert places[node] == -1
            continue
        part = nested_of(tree, node)
        rest = without(nested, part)
        best = min(measure(beside(rest, place, part), boxes)[1] for place in parts_of(rest))
        if places[node] < 0:
            assert best >= before - 1e-9
            continue
        assert gains[node] == pytest.approx(before - best, abs=1e-9)
        # The place is named before the node is cut off: perhaps it loses the node by that.
        place = without(nested_of(tree, places[node]), part)
        assert measure(beside(rest, place, part), boxes)[1] == pytest.approx(best, abs=1e-9)


def test_a_batch_of_all_nodes_is_parallel_reinsertion():
    """The same tree, and the same one in the middle if there are fewer rounds."""
    scene = make_sample("suzanne:subdivisions=0")
    whole, batches = poor_tree(scene), poor_tree(scene)
    done = optimised("reinsert_parallel", whole)
    settings = dataclasses.replace(SETTINGS, batch=1.0, rounds=1000)
    same = optimised("reinsert_batches", batches, settings)
    assert same.costs == done.costs
    assert same.made == done.made
    for one, other in zip(whole, batches, strict=True):
        np.testing.assert_array_equal(one, other)
    few = optimised("reinsert_batches", poor_tree(scene), dataclasses.replace(settings, rounds=2))
    assert few.costs == done.costs[:3]


def test_a_round_moves_some_of_the_largest_nodes_and_no_other():
    scene = make_sample("suzanne:subdivisions=2")
    start = good_tree(scene)
    settings = dataclasses.replace(SETTINGS, batch=0.01, rounds=1)
    done = optimised("reinsert_batches", copied(start), settings, log=True)
    # The root is one of them; it has no better place.
    count = int(np.ceil(0.01 * len(start.left))) + 1
    areas = surface_area(start.boxes)
    least = np.sort(areas)[-count]
    assert 0 < done.made <= count
    log = done.log()
    moved = log.node[log.kind == REINSERT]
    assert len(moved) == done.made
    assert (areas[moved] >= least).all()


@pytest.mark.parametrize("count", [1, 2, 5, 9, 10])
def test_the_largest_nodes_of_equal_ones_the_lowest(count):
    edges = np.array([2.0, 3.0, 1.0, 3.0, 2.0, 2.0, 3.0, 1.0, 2.0, 2.0])
    tree = LinkedTree(np.zeros((10, 6)), *(np.zeros(10, np.int32) for _ in range(3)))
    tree.boxes[:, 3:] = edges[:, None]
    expected = sorted(sorted(range(10), key=lambda node: (-edges[node], node))[:count])
    assert in_batches.largest(tree, count).tolist() == expected


@pytest.mark.parametrize("seed", range(4))
def test_taking_a_node_apart_puts_each_child_to_its_best_place(seed):
    boxes = random_boxes(11, seed)
    start = random_tree(boxes, seed)
    size = one_by_one.MOST_VISITS + 2
    queue = one_by_one.Queue(np.empty(size), np.empty(size, np.int32))
    for node in range(11, 21):
        tree = copied(start)
        nested = nested_of(tree)
        for child in (tree.left[node], tree.right[node]):
            # The other child may have gone below this one.
            leaves = leaves_of(nested_of(start, child))
            part = min(
                (p for p in parts_of(nested) if leaves <= leaves_of(p)),
                key=lambda p: len(leaves_of(p)),
            )
            if nested == part:
                continue
            rest = without(nested, part)
            found = [beside(rest, place, part) for place in parts_of(rest)]
            nested = min([nested, *found], key=lambda each: round(measure(each, boxes)[1], 12))
        moves = rearranging.make_moves()
        call(one_by_one.reinsert_children, tree, np.array([node], np.int32), 0, 1e-12, queue, moves)
        assert_sound(tree, boxes)
        total = measure(nested_of(tree), boxes)[1]
        assert total == pytest.approx(measure(nested, boxes)[1], rel=1e-12)


def test_a_queue_gives_the_least_first():
    size = one_by_one.MOST_VISITS + 2
    queue = one_by_one.Queue(np.empty(size), np.empty(size, np.int32))
    push, pop = (getattr(f, "py_func", f) for f in (one_by_one.push, one_by_one.pop))
    bounds = np.random.default_rng(2).integers(0, 50, 200).astype(float)
    for i, bound in enumerate(bounds):
        push(queue, i, bound, i)
    taken = [pop(queue, size) for size in range(len(bounds), 0, -1)]
    assert [bound for bound, _ in taken] == sorted(bounds)
    assert sorted(node for _, node in taken) == list(range(len(bounds)))
    assert all(bounds[node] == bound for bound, node in taken)


def exchanges(nested):
    """All trees that a rotation below the root makes."""
    for a, b in (nested, nested[::-1]):
        if isinstance(b, tuple):
            yield (b[0], (a, b[1]))
            yield (b[1], (b[0], a))
    a, b = nested
    if isinstance(a, tuple) and isinstance(b, tuple):
        yield ((a[0], b[0]), (a[1], b[1]))
        yield ((a[0], b[1]), (b[0], a[1]))


@pytest.mark.parametrize("seed", range(30))
def test_a_rotation_is_the_best_of_six(seed):
    boxes = random_boxes(9, seed)
    tree = random_tree(boxes, seed)
    nested = nested_of(tree)
    best = min([nested, *exchanges(nested)], key=lambda each: measure(each, boxes)[1])
    root = np.flatnonzero(tree.parent < 0).astype(np.int32)
    call(rotations.rotate_range, tree, root, 0, 1, 1e-12, rearranging.make_moves())
    assert_sound(tree, boxes)
    assert measure(nested_of(tree), boxes)[1] == pytest.approx(measure(best, boxes)[1], rel=1e-12)


def best_sum(boxes):
    """The least sum of inner areas of all trees over boxes."""

    @functools.cache
    def best(part):
        if len(part) == 1:
            return 0.0
        first, *others = sorted(part)
        found = np.inf
        for size in range(len(others)):
            for chosen in itertools.combinations(others, size):
                one = frozenset([first, *chosen])
                found = min(found, best(one) + best(part - one))
        own = np.array(sorted(part))
        around = np.concatenate([boxes[own, :3].min(axis=0), boxes[own, 3:].max(axis=0)])
        return found + float(surface_area(around))

    return best(frozenset(range(len(boxes))))


@pytest.mark.parametrize("seed", range(6))
def test_a_treelet_becomes_the_best_of_10395_trees(seed):
    boxes = random_boxes(7, seed)
    tree = random_tree(boxes, seed)
    optimised("treelet", tree)
    assert measure(nested_of(tree), boxes)[1] == pytest.approx(best_sum(boxes), rel=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_an_agglomerative_treelet_joins_the_nearest_pairs(seed):
    boxes = random_boxes(9, seed)
    tree = random_tree(boxes, seed)
    before = measure(nested_of(tree), boxes)[1]
    parts = list(range(9))
    while len(parts) > 1:
        pair = min(
            itertools.combinations(parts, 2),
            key=lambda pair: surface_area(union(*(measure(part, boxes)[0] for part in pair))),
        )
        parts = [part for part in parts if part not in pair] + [pair]
    joined = measure(parts[0], boxes)[1]
    assert joined < before
    optimised("treelet_agglomerative", tree)
    assert measure(nested_of(tree), boxes)[1] == pytest.approx(joined, rel=1e-12)
