"""Trees that are rearranged stay sound and never get worse, whatever rearranges them."""

import dataclasses
import functools
import threading

import numpy as np
import pytest
from accelscope.core import parallel
from accelscope.core.contract.build_log import MOVE, REINSERT
from accelscope.core.geometry.box import boxes_of
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.structures.bvh.optimisers import OPTIMISERS, rearranging
from accelscope.core.structures.bvh.topology.collapse import LeafRule, collapse
from accelscope.core.structures.bvh.topology.tree import LinkedTree
from accelscope.sample_scenes import make_sample
from nested_trees import (
    SETTINGS,
    assert_never_worse,
    assert_sound,
    balanced,
    copied,
    cost_of,
    good_tree,
    optimised,
    poor_tree,
    random_boxes,
    random_tree,
    tree_of,
)

NAMES = [name for name in OPTIMISERS if name != "none"]


# ------------------------------------------------------------------------------- any optimiser


def awkward():
    """Boxes that are hard on somebody: name and triangles."""
    rng = np.random.default_rng(7)
    one = rng.random((1, 3, 3))
    scales = np.linspace(1.0, 300.0, 300)[:, None, None]
    line = np.linspace(0.0, 1.0, 40)[:, None, None] * np.ones((1, 3, 3))
    return {
        "one": one,
        "two": rng.random((2, 3, 3)),
        "three": rng.random((3, 3, 3)),
        "identical": np.repeat(one, 60, axis=0),
        "nested": scales * one,
        "points on a line": line,
        "points on an axis": line * [1.0, 0.0, 0.0],
        "needles": rng.random((80, 3, 3)) * [1e6, 1e-6, 1e-6],
        "enormous": rng.random((50, 3, 3)) * 1e150,
        "beyond": rng.random((50, 3, 3)) * 1e160,  # areas are infinite
        "tiny": rng.random((50, 3, 3)) * 1e-160,
    }


@pytest.mark.parametrize("name", NAMES)
def test_trees_stay_sound_and_never_get_worse(lab, name, scene_name):
    scene = lab.small_scene(scene_name)
    for start in (poor_tree(scene), good_tree(scene)):
        leaf_boxes, before = start.boxes[: len(scene)].copy(), cost_of(start)
        done = optimised(name, start)
        assert_sound(start, leaf_boxes)
        assert_never_worse(done.costs)
        assert done.costs[0] == pytest.approx(before, rel=1e-12)
        assert done.costs[-1] == pytest.approx(cost_of(start), rel=1e-12)
        assert (done.made > 0) == (done.costs[-1] < done.costs[0])


@pytest.mark.parametrize("shape", awkward())
@pytest.mark.parametrize("name", NAMES)
def test_awkward_trees(name, shape):
    boxes = boxes_of(awkward()[shape])
    for nested in (
        balanced(range(len(boxes))),
        functools.reduce(lambda below, leaf: (below, leaf), range(len(boxes))),
        functools.reduce(lambda below, leaf: (leaf, below), range(len(boxes))),
    ):
        tree = tree_of(nested, boxes)
        with np.errstate(over="ignore", invalid="ignore"):
            done = optimised(name, tree)
        assert_sound(tree, boxes)
        assert len(done.costs) > 1
        if shape not in ("beyond", "tiny"):
            assert_never_worse(done.costs)


@pytest.mark.parametrize("name", NAMES)
def test_trees_as_deep_as_there_are_triangles(name):
    """Every queue and stack is bounded; a tree of any depth comes out as one that can be walked."""
    n = 3000
    boxes = np.repeat(np.arange(1.0, n + 1)[:, None], 6, axis=1) * [-1, -1, -1, 1, 1, 1]
    tree = LinkedTree(
        np.zeros((2 * n - 1, 6)), *(np.full(2 * n - 1, -1, np.int32) for _ in range(3))
    )
    tree.boxes[:n], tree.boxes[n:] = boxes, boxes[1:]
    inner = np.arange(n, 2 * n - 1)
    tree.left[inner], tree.right[inner] = np.r_[0, inner[:-1]], np.arange(1, n)
    tree.parent[tree.left[inner]] = tree.parent[tree.right[inner]] = inner
    assert_sound(tree, boxes)
    done = optimised(name, tree)
    assert_sound(tree, boxes)
    assert_never_worse(done.costs)
    _, order = collapse(tree, LeafRule(4, 1.2, 1.0))
    np.testing.assert_array_equal(np.sort(order), np.arange(n))


@pytest.mark.parametrize("name", NAMES)
def test_the_gains_of_all_moves_are_what_the_cost_fell_by(name):
    trees = (
        random_tree(random_boxes(14, seed=4), seed=4),
        poor_tree(make_sample("suzanne:subdivisions=0")),
    )
    for tree in trees:
        done = optimised(name, copied(tree), log=True)
        log = done.log()
        gains = log.cost[np.isin(log.kind, (MOVE, REINSERT))]
        gains = gains[~np.isnan(gains)]
        assert len(gains) == done.made > 0
        assert (gains > 0.0).all()
        assert gains.sum() == pytest.approx(done.costs[0] - done.costs[-1], rel=1e-9)
        # Whoever asks for no log gets the same tree and none.
        without = optimised(name, tree)
        assert (without.costs, without.made, without.log) == (done.costs, done.made, None)


@pytest.mark.parametrize("name", NAMES)
def test_the_tree_does_not_depend_on_the_threads(monkeypatch, name):
    start = poor_tree(make_sample("suzanne:subdivisions=1"))
    results = []
    for cores in (1, 5):
        monkeypatch.setattr(parallel, "core_count", functools.partial(int, cores))
        tree = copied(start)
        results.append((optimised(name, tree).costs, tree))
    (costs, tree), (others, other) = results
    assert costs == others
    for one, two in zip(tree, other, strict=True):
        np.testing.assert_array_equal(one, two)


class Reports(Progress):
    """Notes what is reported, and cancels at one of the reports."""

    def __init__(self, last=None):
        self.reports, self.last = [], last

    def report(self, done, total, text):
        self.reports.append((done, total, text))
        if len(self.reports) == self.last:
            raise Cancelled


@pytest.mark.parametrize("name", NAMES)
def test_progress_and_cancel(name):
    start = poor_tree(make_sample("suzanne:subdivisions=1"))
    progress = Reports()
    optimised(name, copied(start), progress=progress)
    by_text = {}
    for done, total, text in progress.reports:
        by_text.setdefault(text, []).append((done, total))
    assert len(by_text) > 2
    for steps in by_text.values():
        assert steps == sorted(steps)
        assert steps[-1][0] == steps[-1][1]
        assert len({total for _, total in steps}) == 1
    threads = set(threading.enumerate())
    for last in (1, len(progress.reports) // 2):
        with pytest.raises(Cancelled):
            optimised(name, copied(start), progress=Reports(last))
    assert set(threading.enumerate()) <= threads


def test_poor_trees_become_good_ones():
    """Reinsertion reaches what the SAH reaches from the top down, wherever it starts."""
    scene = make_sample("suzanne:subdivisions=1")
    aim = cost_of(good_tree(scene))
    start = cost_of(poor_tree(scene))
    settings = dataclasses.replace(SETTINGS, rounds=1000)
    ends = {name: optimised(name, poor_tree(scene), settings).costs[-1] for name in NAMES}
    assert start > 20 * aim
    assert ends["reinsert"] < 1.1 * aim
    assert ends["reinsert_parallel"] < 1.1 * aim
    for name in ("rotate", "treelet", "treelet_agglomerative", "reinsert_batches"):
        assert ends[name] < 0.5 * start


# ------------------------------------------------------------------------------- as a setting


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("s", [2, 4, 6])
def test_the_best_trees_of_tetra_stay(build, name, s):
    scene = make_sample(f"tetra:size={s}")
    text = f"optimise={name},C_trav=1,C_isect=1"
    figures = build("bvh", scene, text).statistics()
    assert figures.sah == pytest.approx(7 / 3 * (s - 1) + 4, rel=1e-12)
    assert figures.extra["optimise_costs"][-1] == pytest.approx(7 / 3 * (s - 1) + 7, rel=1e-12)
    single = build("bvh", scene, f"{text},max_leaf_size=1").statistics()
    assert single.sah == pytest.approx(7 / 3 * (s - 1) + 7, rel=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_what_the_statistics_say(build, name):
    scene = make_sample("suzanne:subdivisions=0")
    plain = build("bvh", scene, "builder=spatial_median,max_leaf_size=1").statistics()
    bvh = build("bvh", scene, f"builder=spatial_median,max_leaf_size=1,optimise={name}")
    figures = bvh.statistics()
    costs = figures.extra["optimise_costs"]
    assert len(costs) <= rearranging.MOST_COSTS
    assert costs[0] == pytest.approx(plain.sah, rel=1e-12)
    assert costs[-1] == pytest.approx(figures.sah, rel=1e-12)
    assert figures.sah < plain.sah
    assert figures.extra["optimise_pays"] is True
    assert figures.extra["optimise_moves"] == bvh.rearrangement.made > 0
    assert bvh.validate() == []


@pytest.mark.parametrize("name", NAMES)
def test_a_tree_that_larger_leaves_spoil_stays_as_it_was(lab, build, name):
    """Every triangle by itself it gets better, but fewer of its nodes can be leaves."""
    scene = lab.small_scene("teapot_in_stadium")
    text = "max_leaf_size=16,C_trav=3"
    plain, bvh = build("bvh", scene, text), build("bvh", scene, f"{text},optimise={name}")
    figures = bvh.statistics()
    assert figures.extra["optimise_pays"] is False
    assert figures.extra["optimise_costs"][-1] < figures.extra["optimise_costs"][0]
    assert figures.sah <= plain.statistics().sah * (1 + 1e-12)
    assert bvh.validate() == []


@pytest.mark.parametrize("builder", ["object_median", "rtree_insert"])
def test_optimised_trees_of_others_are_sound(lab, build, builder):
    for scene_name, name in (("mess", "reinsert"), ("cubes", "treelet")):
        bvh = build("bvh", lab.small_scene(scene_name), f"builder={builder},optimise={name}")
        assert bvh.validate() == []
