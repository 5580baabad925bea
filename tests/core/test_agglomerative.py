"""Agglomerative clustering: the tree of merging the globally closest pair, ties included."""

import time

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.kernels import call
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh.builders.bottom_up import agglomerative
from accelscope.sample_scenes import make_sample


def around(a, b):
    """Return the boxes around boxes."""
    return np.concatenate(
        [np.minimum(a[..., :3], b[..., :3]), np.maximum(a[..., 3:], b[..., 3:])], axis=-1
    )


def groups_by_definition(boxes):
    """Merge the closest pair of all, the lowest numbers first, and return every cluster made."""
    boxes, n = boxes.copy(), len(boxes)
    members = [frozenset([i]) for i in range(n)]
    distance = np.full((n, n), np.inf)
    for i in range(n - 1):
        distance[i, i + 1 :] = surface_area(around(boxes[i], boxes[i + 1 :]))
    found = set()
    for _ in range(n - 1):
        a, b = divmod(int(np.argmin(distance)), n)  # the first of several: the lowest numbers
        members[a] |= members[b]
        found.add(members[a])
        boxes[a] = around(boxes[a], boxes[b])
        members[b] = frozenset()
        distance[b], distance[:, b] = np.inf, np.inf
        alive = np.array([bool(m) for m in members])
        new = np.where(alive, surface_area(around(boxes[a], boxes)), np.inf)
        distance[:a, a], distance[a, a + 1 :] = new[:a], new[a + 1 :]
    return found


def groups_of(tree):
    """Return the references below every inner node of a linked tree."""
    n = (len(tree.left) + 1) // 2
    below = {i: frozenset([i]) for i in range(n)}
    for node in range(n, 2 * n - 1):  # children are made before their parents
        below[node] = below[int(tree.left[node])] | below[int(tree.right[node])]
    return {below[node] for node in range(n, 2 * n - 1)}


def boxes_from(low, size):
    return np.concatenate([low, low + size], axis=1)


def nested(n):
    r = np.random.default_rng(3).permutation(n)[:, None] + 1.0
    return np.concatenate([-r, -r, -r, r, r, r], axis=1)


def random_boxes(n, size, seed=1):
    rng = np.random.default_rng(seed)
    return boxes_from(rng.random((n, 3)), size * rng.random((n, 3)))


MAKERS = {
    "small": lambda n: random_boxes(n, 0.05),
    "overlapping": lambda n: random_boxes(n, 2.0),
    "all sizes": lambda n: boxes_from(
        random_boxes(n, 0)[:, :3], np.exp(-9 * random_boxes(n, 0, 2)[:, :3])
    ),
    "many ties": lambda n: np.round(random_boxes(n, 0.3) * 4) / 4,
    "lattice": lambda n: boxes_from(np.stack(np.unravel_index(np.arange(n), (5, 5, 99)), 1), 1.0),
    "identical": lambda n: np.tile([0.0, 1, 2, 3, 4, 5], (n, 1)),
    "nested": nested,
    "flat": lambda n: random_boxes(n, 0.1) * [1, 1, 0, 1, 1, 0],
    "on a line": lambda n: random_boxes(n, 0.1) * [1, 0, 0, 1, 0, 0],
}


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("n", [2, 3, 7, 64, 130])
def test_it_is_the_tree_of_the_definition(kind, n):
    boxes = MAKERS[kind](n)
    tree = agglomerative.cluster(boxes.copy(), SILENT)
    assert groups_of(tree) == groups_by_definition(boxes)
    inner = np.arange(n, 2 * n - 1)
    union = around(tree.boxes[tree.left[inner]], tree.boxes[tree.right[inner]])
    assert np.array_equal(tree.boxes[inner], union)
    assert np.array_equal(tree.parent[tree.left[inner]], inner)
    assert np.array_equal(tree.parent[tree.right[inner]], inner)
    assert (tree.parent < 0).sum() == 1


def test_one_triangle_is_a_root():
    tree = agglomerative.cluster(np.zeros((1, 6)), SILENT)
    assert (tree.left.tolist(), tree.parent.tolist()) == ([-1], [-1])


@pytest.mark.parametrize("s", [2, 3, 4, 5])
def test_tetra_in_the_order_of_its_generation(build, s):
    """Most distances are equal there; the lowest numbers then follow the recursion."""
    figures = build("bvh", make_sample(f"tetra:size={s}"), "builder=agglomerative").statistics()
    assert figures.sah == pytest.approx(1.2 * 7 / 3 * (s - 1) + 4, rel=1e-12)
    text = "builder=agglomerative,max_leaf_size=1,C_trav=1"
    single = build("bvh", make_sample(f"tetra:size={s}"), text).statistics()
    assert single.sah == pytest.approx(7 / 3 * (s - 1) + 3 + 4, rel=1e-12)


@pytest.mark.parametrize(("s", "low", "high"), [(3, 7.9, 8.15), (4, 10.5, 11.1)])
def test_shuffled_tetra_costs_more(build, s, low, high):
    """Equal distances across parents are then decided otherwise; costs as measured elsewhere."""
    tetra = make_sample(f"tetra:size={s}")
    costs = []
    for seed in range(10):
        order = np.random.default_rng(seed).permutation(len(tetra))
        scene = Scene.from_triangles(tetra.triangles[order], "shuffled")
        tree = build("bvh", scene, "builder=agglomerative,max_leaf_size=1")
        costs.append(tree.statistics().expected_inner)
    assert min(costs) > 7 / 3 * (s - 1) + 3 - 1e-12
    assert low < np.mean(costs) < high, costs


def test_the_order_of_the_triangles_does_not_matter_without_ties(build):
    scene = make_sample("soup:count=3000,edge=0.2")
    shuffled = np.random.default_rng(1).permutation(len(scene))
    other = Scene.from_triangles(scene.triangles[shuffled], "shuffled")
    one, two = (build("bvh", each, "builder=agglomerative") for each in (scene, other))
    assert one.statistics().sah == pytest.approx(two.statistics().sah, rel=1e-12)
    assert np.array_equal(
        np.unique(one.arrays.volumes.rows, axis=0), np.unique(two.arrays.volumes.rows, axis=0)
    )


@pytest.mark.parametrize("kind", [kind for kind in MAKERS if kind != "lattice"])
def test_few_nodes_are_looked_at(kind, monkeypatch):
    """Searching all of 10,000 for each step of the chain would be 600 calls of the kernel."""
    calls = []

    def counting(function, *arguments):
        calls.append(function)
        return call(function, *arguments)

    monkeypatch.setattr(agglomerative, "call", counting)
    agglomerative.cluster(MAKERS[kind](10_000), SILENT)
    assert calls.count(agglomerative.merge_some) < 60


class CancelAt(Progress):
    """Cancels at the first report after a share of the work is done, and times the reports."""

    def __init__(self, share):
        self.share, self.times = share, []

    def report(self, done, total, text):
        self.times.append(time.perf_counter())
        if done >= self.share * total:
            raise Cancelled


@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_it_can_be_cancelled_at_any_time(share):
    boxes = random_boxes(50_000, 0.01)
    progress = CancelAt(share)
    with pytest.raises(Cancelled):
        agglomerative.cluster(boxes, progress)
    assert len(progress.times) > 5 * share
