"""BSP trees that stop early: budgets, depth, cancelling, and scenes that no plane divides."""

import itertools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures import bsp, structures
from accelscope.sample_scenes import make_sample
from bsp_trees import TREES, lines

# -------------------------------------------------------------------------------------- stopping


def shape(tree):
    """Return the cells of a tree, whatever the order in which they were made."""
    grown = tree.grown

    def nested(node):
        left = int(grown.link[node])
        if left < 0:
            begin, end = grown.offsets[-1 - left : 1 - left]
            return tuple(grown.references[begin:end].tolist())
        return tuple(grown.planes[node].tolist()), nested(left), nested(left + 1)

    return nested(0)


@pytest.mark.parametrize("text", TREES)
def test_a_budget_of_cells(lab, build, text):
    scene = lab.small_scene("suzanne")
    full = build("bsp", scene, text)
    nodes = len(full.grown.link)
    for order in ("fifo", "priority", "depth_first"):
        for budget in (1, 2, 3, 50, nodes - 1, nodes, 10 * nodes):
            tree = build("bsp", scene, f"{text},order={order},budget={budget}")
            used = len(tree.grown.link)
            assert min(budget, nodes) - 1 <= used <= min(budget, nodes)
            if budget < 100:
                assert tree.validate() == []
        assert shape(tree) == shape(full)


def test_a_queue_fills_the_levels_in_turn(build):
    scene = make_sample("suzanne:subdivisions=1")
    text = "planes=fixed,directions=3,max_leaf_size=0,budget=501,max_depth=30"
    fifo, depth, priority = (
        build("bsp", scene, f"{text},order={order}").statistics()
        for order in ("fifo", "depth_first", "priority")
    )
    assert fifo.max_depth < depth.max_depth
    assert priority.expected_tests < fifo.expected_tests < depth.expected_tests


def test_depth_and_leaf_size(lab, build):
    scene = lab.small_scene("soup")
    for text, depth in itertools.product(TREES, (1, 2, 7)):
        figures = build("bsp", scene, f"{text},max_depth={depth},max_leaf_size=0").statistics()
        assert figures.max_depth == depth
    figures = build("bsp", scene, "max_leaf_size=500").statistics()
    assert (figures.N_V, figures.N_OIV) == (1, 500)


class CancelAt(Progress):
    def __init__(self, report):
        self.left = report
        self.latest = 0.0

    def report(self, done, total, text):
        assert self.latest <= done <= total == 1.0
        self.latest = done
        self.left -= 1
        if self.left < 0:
            raise Cancelled


@pytest.mark.parametrize("text", TREES)
@pytest.mark.parametrize("report", [0, 1, 5])
def test_a_build_stops(lab, text, report):
    scene = make_sample("soup:count=50000,edge=0.02")
    tree = structures()["bsp"]
    with pytest.raises(Cancelled):
        tree.build(scene, lab.settings_of(tree, text), CancelAt(report))


# ------------------------------------------------------------------------------------- bad input


def trace_like_naive(build, tree, count=300):
    rays = lines(tree, count)
    want, _ = build("naive", tree.scene).trace(rays)
    got, _ = tree.trace(rays)
    assert np.array_equal(want.t, got.t)
    assert np.array_equal(want.primitive, got.primitive)


def bad_scene(name):
    rng = np.random.default_rng(1)
    if name == "one plane":
        corners = rng.random((3000, 3, 3))
        corners[:, :, 2] = corners[:, :, :2].sum(axis=2)
        return corners
    if name == "through one point":
        corners = rng.normal(size=(4000, 3, 3))
        corners[:, 2] = -0.5 * (corners[:, 0] + corners[:, 1])
        return corners
    if name == "long":
        return rng.random((5000, 1, 3)) * [1e6, 1, 1] + rng.random((5000, 3, 3))
    return np.repeat(rng.random((1, 3, 3)), 5000, axis=0)  # identical


TOO_MANY = {
    ("one plane", "planes=fixed"),
    ("one plane", "planes=fixed,directions=13"),
    ("through one point", "planes=autopartition"),
}
"""Where splitting to a depth of 60 makes more references than are allowed."""


@pytest.mark.parametrize("name", ["one plane", "through one point", "long", "identical"])
@pytest.mark.parametrize("text", TREES)
@pytest.mark.parametrize("limits", ["", "max_leaf_size=0,max_depth=60"])
def test_bad_scenes(build, name, text, limits, monkeypatch):
    """A right answer, or where no split helps and a depth is given a refusal."""
    monkeypatch.setattr(bsp.build, "MOST_REFERENCES", 1 << 17)
    scene = Scene.from_triangles(bad_scene(name), name)
    if limits and (name, text) in TOO_MANY:
        with pytest.raises(InputError, match="lower max_depth, raise max_leaf_size or set a bud"):
            build("bsp", scene, f"{text},{limits}")
        limits = "max_depth=5"
    tree = build("bsp", scene, f"{text},{limits}")
    assert tree.validate() == []
    trace_like_naive(build, tree)


def test_a_budget_of_one_cell(lab, build, scene_name):
    tree = build("bsp", lab.small_scene(scene_name), "budget=1")
    assert tree.validate() == []
    assert tree.statistics().N_V == 1
    trace_like_naive(build, tree, 50)
