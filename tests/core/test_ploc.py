"""PLOC: the iterations of the definition, ties, radius, blocks, and what nests like dolls."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh.builders.bottom_up import agglomerative, ploc
from accelscope.core.structures.bvh.topology.tree import leaves_only
from accelscope.sample_scenes import make_sample


def boxes_from(low, size):
    return np.concatenate([low, low + size], axis=1)


def random_boxes(n, size, seed=1):
    rng = np.random.default_rng(seed)
    return boxes_from(rng.random((n, 3)), size * rng.random((n, 3)))


def nested(n):
    r = np.arange(1.0, n + 1)[:, None]
    return np.concatenate([-r, -r, -r, r, r, r], axis=1)


MAKERS = {
    "small": lambda n: random_boxes(n, 0.05),
    "overlapping": lambda n: random_boxes(n, 2.0),
    "many ties": lambda n: np.round(random_boxes(n, 0.3) * 4) / 4,
    "identical": lambda n: np.tile([0.0, 1, 2, 3, 4, 5], (n, 1)),
    "nested": nested,
    "on a line": lambda n: random_boxes(n, 0.1) * [1, 0, 0, 1, 0, 0],
}


def around(a, b):
    """Return the boxes around boxes."""
    return np.concatenate(
        [np.minimum(a[..., :3], b[..., :3]), np.maximum(a[..., 3:], b[..., 3:])], axis=-1
    )


def iterations_by_definition(boxes, radius):
    """Yield the clusters after each iteration, as sets of what they contain, along the curve."""
    clusters = [(frozenset([i]), box) for i, box in enumerate(boxes)]
    while len(clusters) > 1:
        nearest = []
        for i, (_, box) in enumerate(clusters):
            window = [j for j in range(i - radius, i + radius + 1) if j != i]
            window = [j for j in window if 0 <= j < len(clusters)]
            area = {j: surface_area(around(box, clusters[j][1])) for j in window}
            nearest.append(min(window, key=lambda j: (area[j], i ^ j)))
        merged = []
        for i, (members, box) in enumerate(clusters):
            j = nearest[i]
            if nearest[j] != i:
                merged.append((members, box))
            elif i < j:
                merged.append((members | clusters[j][0], around(box, clusters[j][1])))
        clusters = merged
        yield [members for members, _ in clusters]


def members_of(tree, nodes, below):
    """Return what nodes contain; children are made before their parents."""
    count = (len(tree.left) + 1) // 2
    for node in range(len(below), max(nodes) + 1):
        if node < count:
            below.append(frozenset([node]))
        else:
            below.append(below[tree.left[node]] | below[tree.right[node]])
    return [below[node] for node in nodes]


def run(boxes, radius):
    """Return the finished tree and what its clusters contained after each iteration."""
    tree, below = leaves_only(boxes), []
    with Team(SILENT, "testing") as team:
        found = [
            members_of(tree, nodes.tolist(), below) for nodes in ploc.iterations(tree, radius, team)
        ]
    return tree, found


@pytest.mark.parametrize("kind", MAKERS)
@pytest.mark.parametrize("radius", [1, 2, 14, 512])
def test_iterations_are_those_of_the_definition(kind, radius):
    for n in (1, 2, 3, 65):
        boxes = MAKERS[kind](n)
        tree, found = run(boxes, radius)
        assert found == list(iterations_by_definition(boxes, radius))
        inner = np.arange(n, 2 * n - 1)
        union = around(tree.boxes[tree.left[inner]], tree.boxes[tree.right[inner]])
        assert np.array_equal(tree.boxes[inner], union)
        assert np.array_equal(tree.parent[tree.left[inner]], inner)
        assert np.array_equal(tree.parent[tree.right[inner]], inner)


@pytest.mark.parametrize("radius", [1, 7, 40])
def test_blocks_leave_no_trace(radius, monkeypatch):
    boxes = random_boxes(1000, 0.1)
    want, _ = run(boxes, radius)
    monkeypatch.setattr(ploc, "BLOCK", 64)
    monkeypatch.setattr(ploc, "PAIRS", 1)
    whole = Team.run
    monkeypatch.setattr(
        Team, "run", lambda self, work, total, block=64: whole(self, work, total, block)
    )
    got, _ = run(boxes, radius)
    for mine, theirs in zip(want, got, strict=True):
        assert np.array_equal(mine, theirs)


@pytest.mark.parametrize("n", [2, 50, 400])
def test_a_radius_over_everything_gives_agglomerative_clustering(n):
    """Without ties it does not matter in which order mutually nearest clusters merge."""
    boxes = random_boxes(n, 0.1)
    tree, _ = run(boxes, 512)
    exact = agglomerative.cluster(boxes.copy(), SILENT)
    groups = []
    for each in (tree, exact):
        groups.append(set(members_of(each, range(2 * n - 1), [])))
    assert groups[0] == groups[1]


def test_identical_clusters_merge_in_pairs():
    _, found = run(np.tile([0.0, 0, 0, 1, 1, 1], (1024, 1)), 3)
    assert [len(clusters) for clusters in found] == [1 << k for k in range(9, -1, -1)]


@pytest.mark.parametrize("n", [3000, 3001])
def test_dolls_do_not_take_an_iteration_each(n):
    _, found = run(nested(n), 2)
    sizes = [len(clusters) for clusters in found]
    # Where only the innermost two would merge, all neighbours do, until few are left.
    assert sizes[0] == n - n // 2
    assert len(sizes) < ploc.FEW + 10
    assert sizes[-1] == 1


@pytest.mark.parametrize("radius", [1, 2, 3, 6, 14, 32, 512])
def test_cost_over_tetra(build, radius):
    for s, shuffle in itertools.product((2, 4, 6), (False, True)):
        triangles = make_sample(f"tetra:size={s}").triangles
        if shuffle:
            triangles = np.random.default_rng(s).permutation(triangles)
        scene = Scene.from_triangles(triangles, "tetra")
        text = f"builder=ploc,radius={radius},C_trav=1,C_isect=1"
        figures = build("bvh", scene, text).statistics()
        assert figures.expected_inner == pytest.approx(7 / 3 * (s - 1), rel=1e-12)
        assert figures.expected_tests == pytest.approx(4, rel=1e-12)
        single = build("bvh", scene, f"{text},max_leaf_size=1").statistics()
        assert single.sah == pytest.approx(7 / 3 * (s - 1) + 7, rel=1e-12)


def test_many_dolls_build(build):
    sizes = np.arange(1.0, 5001)[:, None, None]
    scene = Scene.from_triangles(np.array([[[-1, -1, -1], [1, -1, 0], [0, 2, 1]]]) * sizes, "dolls")
    built = build("bvh", scene, "builder=ploc")
    assert built.validate() == []
