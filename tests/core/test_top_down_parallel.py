"""Builders from the top down on many threads, the GPU's and ours: queues, shares, copies."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from accelscope.core import parallel
from accelscope.core.kernels import call
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.spatial import sbvh
from accelscope.core.structures.bvh.builders.top_down import (
    parallel_sah,
    recursion,
    sweep_sah,
)
from accelscope.core.structures.bvh.builders.top_down.parallel_split import (
    data_parallel_rules,
    reduction_step,
)
from accelscope.core.structures.bvh.builders.top_down.recursion import room_for
from accelscope.core.structures.bvh.topology.tree import Primitives


def levels_over(scene, settings):
    primitives = Primitives(scene.geometry, scene.boxes())
    make_rule, _ = data_parallel_rules(primitives, settings)
    tree, splits = room_for(len(scene), False)
    return tree, list(parallel_sah.levels_of(make_rule, len(scene), tree, splits, SILENT))


def test_queues(lab, scene_name):
    scene = lab.small_scene(scene_name)
    tree, levels = levels_over(scene, BVHSettings())
    nodes, splits = 0, 0
    for level, after in itertools.pairwise([*levels, None]):
        queue, output, compacted = level
        assert len(queue) <= len(scene)
        assert len(output) == 2 * len(queue)
        assert after is None or np.array_equal(after.queue, compacted)
        there = output[:, parallel_sah.NODE] != parallel_sah.EMPTY
        assert np.array_equal(there[::2], there[1::2])
        assert np.array_equal(there[::2], tree.size[queue[:, parallel_sah.NODE]] == 0)
        assert np.array_equal(output[there], compacted)
        assert len(compacted) == 2 * level.n_split() == there.sum()
        # Siblings share out the triangles of their parent.
        left, right = output[::2][there[::2]], output[1::2][there[::2]]
        parents = queue[there[::2]]
        assert np.array_equal(left[:, parallel_sah.FIRST], parents[:, parallel_sah.FIRST])
        assert np.array_equal(left[:, 1] + left[:, 2], right[:, 1])
        assert np.array_equal(left[:, 2] + right[:, 2], parents[:, 2])
        nodes += len(queue)
        splits += level.n_split()
    assert len(levels[0].queue) == 1
    assert len(levels[-1].compacted) == 0
    assert splits == (tree.size == 0).sum()
    assert nodes == (tree.size >= 0).sum()


def test_queues_are_on_record(lab, build):
    figures = build("bvh", lab.small_scene("suzanne"), "builder=parallel_sah").statistics()
    lengths, splits = figures.extra["queue_lengths"], figures.extra["queue_splits"]
    assert len(lengths) == len(splits) == figures.max_depth + 1
    assert sum(splits) == figures.N_IN
    assert sum(lengths) == figures.N_IN + figures.N_V
    assert lengths == [1, *(2 * n for n in splits[:-1])]


def trees_equal(one, two):
    return all(np.array_equal(a, b) for a, b in zip(one.tree, two.tree, strict=True)) and (
        np.array_equal(one.order, two.order)
    )


def grouped(scene, settings):
    primitives = Primitives(scene.geometry, scene.boxes())
    return BUILDERS[settings.builder].build(primitives, settings, SILENT, log=True)


def test_threads_that_share_a_node_find_the_same_split(lab, monkeypatch):
    settings = dataclasses.replace(BVHSettings(), builder="parallel_sah")
    for name in ("suzanne", "mess"):
        scene = lab.small_scene(name)
        together = grouped(scene, settings)
        for tests in (1000, 48 * 20, 48):
            monkeypatch.setattr(parallel_sah, "TESTS", tests)
            assert trees_equal(together, grouped(scene, settings))
        monkeypatch.undo()


def test_subtrees_are_the_same_in_one_call_and_node_by_node(lab, monkeypatch):
    settings = dataclasses.replace(BVHSettings(), builder="sweep_sah")
    scene = lab.small_scene("suzanne")
    whole = grouped(scene, settings)
    monkeypatch.setattr(sweep_sah, "SUBTREE", 3)
    assert trees_equal(whole, grouped(scene, settings))


@pytest.mark.parametrize("builder", ["binned_sah", "parallel_sah", "sbvh"])
@pytest.mark.parametrize("part", [1, 3, 100])
def test_a_tree_copied_in_parts_is_the_same(lab, monkeypatch, builder, part):
    settings = dataclasses.replace(BVHSettings(), builder=builder, max_leaf_size=1)
    scene = lab.small_scene("mess")
    as_one = grouped(scene, settings)
    for module in (recursion, parallel_sah, sbvh):
        monkeypatch.setattr(module, "compact", functools.partial(recursion.compact, part=part))
    assert trees_equal(as_one, grouped(scene, settings))


@pytest.mark.parametrize("builder", ["binned_sah", "phr"])
def test_a_tree_does_not_depend_on_who_takes_which_subtree(lab, monkeypatch, builder):
    settings = dataclasses.replace(BVHSettings(), builder=builder)
    scene = lab.small_scene("suzanne")
    as_one = grouped(scene, settings)
    monkeypatch.setattr(recursion, "SMALLEST", 8)
    for cores in (1, 2, 8):
        for module in (parallel, recursion):
            monkeypatch.setattr(module, "core_count", lambda cores=cores: cores)
        assert trees_equal(as_one, grouped(scene, settings))


@pytest.mark.parametrize("n", [1, 2, 3, 6, 48, 49, 192])
def test_reduction_takes_the_logarithm_of_steps(n):
    rng = np.random.default_rng(n)
    for costs in (rng.random(n), rng.integers(3, size=n).astype(float), np.full(n, np.inf)):
        winners, steps = np.arange(n), 0
        while 1 << steps < n:
            call(reduction_step, costs, winners, 1 << steps)
            steps += 1
            for i in range(0, n, 1 << steps):
                group = costs[i : i + (1 << steps)]
                assert winners[i] == i + np.argmin(group)  # the first of equal ones
        assert steps == int(np.ceil(np.log2(n)))
        assert winners[0] == np.argmin(costs)
