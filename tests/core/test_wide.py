"""Wide trees: the collapse is optimal, and what is left relates to the binary tree as it must."""

import functools

import numpy as np
import pytest
from accelscope.core.contract.workspace import MAXIMUM_DEPTH
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.rays import ALL
from accelscope.core.structures.bvh.topology.tree import Tree, depths_of, ranges_of
from accelscope.core.structures.bvh.topology.wide import widened
from accelscope.core.structures.bvh.walks.wide_walk import WIDE_STACK_SIZE
from accelscope.sample_scenes import make_sample

ARITIES = (2, 3, 4, 8)


def random_tree(n_leaves, seed):
    """Return a binary tree of any shape over random boxes, children behind their parents."""
    rng = np.random.default_rng(seed)
    first, size, waiting, taken = [0], [0], [(0, n_leaves)], 1
    done = 0
    while waiting:
        node, count = waiting.pop()
        if count == 1:
            first[node], size[node] = done, 1
            done += 1
            continue
        left = int(rng.integers(1, count))
        first[node], size[node] = taken, 0
        first += [0, 0]
        size += [0, 0]
        waiting += [(taken + 1, count - left), (taken, left)]
        taken += 2
    first, size = np.array(first, np.int32), np.array(size, np.int32)
    low = rng.random((len(size), 3))
    boxes = np.concatenate([low, low + rng.random((len(size), 3)) ** 4], axis=1)
    for node in range(len(size) - 1, -1, -1):
        if size[node] == 0:
            a, b = boxes[first[node]], boxes[first[node] + 1]
            boxes[node] = [*np.minimum(a[:3], b[:3]), *np.maximum(a[3:], b[3:])]
    return Tree(boxes, first, size)


def inner_area(tree):
    return surface_area(tree.boxes)[tree.size == 0].sum()


def least_inner_area(tree, arity):
    """Return the least area of inner nodes, by trying every subset of nodes that could go."""
    areas = surface_area(tree.boxes)

    @functools.cache
    def options(node):
        """Return {children handed to the parent: least area of the inner nodes below}."""
        if tree.size[node] > 0:
            return {1: 0.0}
        together = {}
        for a, left in options(int(tree.first[node])).items():
            for b, right in options(int(tree.first[node]) + 1).items():
                together[a + b] = min(together.get(a + b, np.inf), left + right)
        found = {k: area for k, area in together.items() if k <= arity}
        return found | {1: min(found.values()) + areas[node]}

    return options(0)[1]


@pytest.mark.parametrize("arity", ARITIES)
def test_the_collapse_is_optimal(arity):
    saved = 0
    for seed in range(60):
        tree = random_tree(2 + seed, seed)
        wide = widened(tree, arity)
        assert inner_area(wide) == pytest.approx(least_inner_area(tree, arity), rel=1e-12)
        saved += len(tree.size) - len(wide.size)
    assert (saved > 0) == (arity > 2)


@pytest.mark.parametrize("arity", ARITIES)
def test_leaves_stay_and_no_node_has_too_many_children(arity):
    for seed in range(30):
        tree = random_tree(3 + 2 * seed, seed)
        wide = widened(tree, arity)
        inner = wide.size == 0
        assert (wide.width[inner] >= 2).all()
        assert (wide.width[inner] <= arity).all()
        assert (wide.width[~inner] == 0).all()
        # Leaves with their boxes, in the order of their references.
        order, wide_order = (
            np.flatnonzero(t.size > 0)[np.argsort(t.first[t.size > 0])] for t in (tree, wide)
        )
        assert np.array_equal(tree.boxes[order], wide.boxes[wide_order])
        assert np.array_equal(tree.first[order], wide.first[wide_order])
        begin, end = ranges_of(wide.first, wide.size, wide.width)
        assert (begin[0], end[0]) == (0, (len(tree.size) + 1) // 2)
        for node in range(len(wide.size)):
            leaves = wide_order[begin[node] : end[node]]
            assert np.array_equal(wide.boxes[node, :3], wide.boxes[leaves, :3].min(axis=0))
            assert np.array_equal(wide.boxes[node, 3:], wide.boxes[leaves, 3:].max(axis=0))


def test_collapse_to_two_changes_nothing():
    tree = random_tree(40, 7)
    wide = widened(tree, 2)
    assert len(wide.size) == len(tree.size)
    assert inner_area(wide) == pytest.approx(inner_area(tree), rel=1e-12)


def test_a_chain_of_the_greatest_depth_fits_onto_the_stack():
    n = MAXIMUM_DEPTH + 1
    first = np.arange(2 * n - 1, dtype=np.int32) + 1
    size = np.zeros(2 * n - 1, np.int32)
    size[1::2] = size[-1] = 1
    first[1::2] = np.arange(n - 1)
    first[-1] = n - 1
    boxes = np.tile([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], (2 * n - 1, 1))
    for node in range(2, 2 * n - 1, 2):
        first[node] = node + 1 if node < 2 * n - 2 else n - 1
    wide = widened(Tree(boxes, first, size), 8)
    depth = depths_of(wide.first, wide.size, wide.width)
    assert depth.max() == -(-MAXIMUM_DEPTH // 7)
    assert 7 * depth.max() + 8 <= WIDE_STACK_SIZE


@pytest.mark.parametrize("sample", ["soup", "suzanne", "teapot_in_stadium"])
def test_quality_and_steps_beside_the_binary_tree(lab, build, sample):
    """A ray that never stops meets the same leaves, and of the inner nodes those that are left."""
    scene = lab.small_scene(sample)
    rays, _, _, _ = lab.truth(sample)
    binary = build("bvh", scene)
    before = binary.trace(rays, ALL)[1]
    figures = binary.statistics()
    for arity in (4, 8):
        wide = build("bvh", scene, f"arity={arity}")
        after, now = wide.trace(rays, ALL)[1], wide.statistics()
        for name in ("N_ETS", "N_IT"):
            assert np.array_equal(after[name], before[name])
        assert (after["N_TS"] <= before["N_TS"]).all()
        assert after["N_TS"].sum() < 0.7 * before["N_TS"].sum()
        assert now.expected_tests == pytest.approx(figures.expected_tests, rel=1e-12)
        assert now.expected_leaves == pytest.approx(figures.expected_leaves, rel=1e-12)
        assert now.expected_inner < 0.7 * figures.expected_inner
        assert now.N_V == figures.N_V
        compared = now.extra["binary"]
        assert compared["N_IN"] == figures.N_IN
        assert compared["sah"] == figures.sah
        tests = pytest.approx(figures.extra["expected_volume_tests"], rel=1e-12)
        assert compared["expected_volume_tests"] == tests


def test_expected_volume_tests_are_those_of_random_lines(build):
    """Within four standard errors: lines through the root's box, which never stop."""
    from accelscope.core.evaluation.rays.workloads import random_lines
    from accelscope.core.geometry.rays import Rays

    scene = make_sample("suzanne:subdivisions=0")
    lines = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 20_000, 3))
    for arity in (2, 4, 8):
        wide = build("bvh", scene, f"arity={arity}")
        counters = wide.trace(lines, ALL)[1]
        hits_root = counters["N_TS"] > 0
        tests = counters["volume_tests"][hits_root]
        error = tests.std() / np.sqrt(len(tests))
        expected = wide.statistics().extra["expected_volume_tests"]
        assert abs(tests.mean() - expected) < 4 * error
        assert hits_root.sum() > 10_000
