"""R-trees: Guttman's invariants, his splits by hand, and the answers of another implementation."""

import math

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.structures.bvh.builders.rtree import rtree_insert, rtree_str
from accelscope.core.structures.bvh.builders.rtree.nodes import LEAST, MOST, binary
from accelscope.sample_scenes import make_sample

MAKERS = {
    "quadratic": lambda boxes: rtree_insert.insert_all(boxes, is_linear=False, progress=SILENT),
    "linear": lambda boxes: rtree_insert.insert_all(boxes, is_linear=True, progress=SILENT),
    "str": lambda boxes: rtree_str.pack(boxes, SILENT),
}


def random_boxes(n, size=0.1, seed=1):
    rng = np.random.default_rng(seed)
    low = rng.random((n, 3))
    return np.concatenate([low, low + size * rng.random((n, 3))], axis=1)


def nested(n):
    r = np.random.default_rng(3).permutation(n)[:, None] + 1.0
    return np.concatenate([-r, -r, -r, r, r, r], axis=1)


SCENES = {
    "random": random_boxes,
    "overlapping": lambda n: random_boxes(n, 2.0),
    "ties": lambda n: np.round(random_boxes(n) * 4) / 4,
    "identical": lambda n: np.tile([0.0, 1, 2, 3, 4, 5], (n, 1)),
    "nested": nested,
    "flat": lambda n: random_boxes(n) * [1, 1, 0, 1, 1, 0],
    "on a line": lambda n: random_boxes(n) * [1, 0, 0, 1, 0, 0],
    "points": lambda n: random_boxes(n)[:, [0, 1, 2, 0, 1, 2]],
}


@pytest.fixture(params=MAKERS)
def make(request):
    return MAKERS[request.param]


def entries(tree, node):
    return tree.children[node, : tree.size[node]]


# ------------------------------------------------------------------------------- any R-tree


@pytest.mark.parametrize("n", [1, 2, 8, 9, 10, 57, 64, 65, 66, 67, 512, 513, 1000])
@pytest.mark.parametrize("scene", SCENES)
def test_invariants(make, scene, n):
    boxes = SCENES[scene](n)
    tree = make(boxes.copy())
    others = np.delete(np.arange(len(tree.size)), tree.root)
    assert (tree.size <= MOST).all()
    assert (tree.size[others] >= LEAST).all()
    assert tree.size[tree.root] >= min(n, 2)
    height = tree.level[tree.root] + 1
    assert height <= max(1, math.ceil(round(math.log(n, LEAST), 9)))
    assert np.array_equal(tree.boxes[:n], boxes)
    for node, level in enumerate(tree.level):
        below = entries(tree, node)
        # All references are at the same depth: every step goes down exactly one level.
        levels = np.where(below < n, -1, tree.level[np.maximum(below - n, 0)])
        assert (levels == level - 1).all()
        around = np.r_[tree.boxes[below, :3].min(axis=0), tree.boxes[below, 3:].max(axis=0)]
        assert np.array_equal(around, tree.boxes[n + node])
    everybody = np.concatenate([entries(tree, node) for node in range(len(tree.size))])
    expected = np.delete(np.arange(n + len(tree.size)), n + tree.root)
    assert np.array_equal(np.sort(everybody), expected)


@pytest.mark.parametrize("scene", ["random", "ties", "nested"])
def test_binary_form_keeps_every_node(make, scene):
    """Each node of the R-tree is a node of the binary tree, with the same references below."""
    n = 700
    tree = make(SCENES[scene](n))
    pairs = binary(tree, SILENT)
    assert (pairs.parent < 0).sum() == 1
    below = {i: frozenset([i]) for i in range(n)}
    for node in range(n, 2 * n - 1):  # children are made before their parents
        left, right = int(pairs.left[node]), int(pairs.right[node])
        assert pairs.parent[left] == pairs.parent[right] == node
        below[node] = below[left] | below[right]
        low = np.minimum(pairs.boxes[left, :3], pairs.boxes[right, :3])
        high = np.maximum(pairs.boxes[left, 3:], pairs.boxes[right, 3:])
        assert np.array_equal(pairs.boxes[node], np.r_[low, high])
    groups = {group: node for node, group in below.items()}
    of_entry = {i: frozenset([i]) for i in range(n)}
    for node in np.argsort(tree.level, kind="stable"):
        of_entry[n + node] = frozenset().union(*(of_entry[e] for e in entries(tree, node)))
        assert np.array_equal(pairs.boxes[groups[of_entry[n + node]]], tree.boxes[n + node])


def inside(tree, query):
    """Return the references whose box meets the box of a query, found from the root."""
    n = len(tree.boxes) - len(tree.size)
    found, waiting = [], [n + tree.root]
    while waiting:
        entry = waiting.pop()
        box = tree.boxes[entry]
        if (box[:3] <= query[3:]).all() and (query[:3] <= box[3:]).all():
            if entry < n:
                found.append(entry)
            else:
                waiting += entries(tree, entry - n).tolist()
    return sorted(found)


def test_queries_are_answered_as_another_implementation_does(make):
    index = pytest.importorskip("rtree.index")
    boxes = boxes_of(make_sample("suzanne:subdivisions=0").triangles)
    other = index.Index(
        ((i, box, None) for i, box in enumerate(boxes.tolist())),
        properties=index.Property(dimension=3),
    )
    tree = make(boxes.copy())
    sizes = []
    for query in 2.5 * random_boxes(60, 0.4) - 1.25:
        found = inside(tree, query)
        assert found == sorted(other.intersection(query))
        sizes.append(len(found))
    assert np.mean(sizes) > 5


# --------------------------------------------------------------------------------- insertion


def groups(tree):
    """Return the references of the two leaves of a root that has been split once."""
    n = len(tree.boxes) - len(tree.size)
    assert tree.size[tree.root] == 2
    return {frozenset(entries(tree, int(e) - n).tolist()) for e in entries(tree, tree.root)}


def unit_boxes(x):
    low = np.stack([np.array(x, float), np.zeros(len(x)), np.zeros(len(x))], axis=1)
    return np.concatenate([low, low + 1.0], axis=1)


@pytest.mark.parametrize("make", [MAKERS["quadratic"], MAKERS["linear"]])
def test_the_ninth_box_splits_a_full_leaf(make):
    assert len(make(unit_boxes(range(8))).size) == 1
    clumps = [0, 100, 1, 101, 2, 102, 3, 103, 104]
    assert groups(make(unit_boxes(clumps))) == {
        frozenset([0, 2, 4, 6]), frozenset([1, 3, 5, 7, 8])
    }  # fmt: skip


@pytest.mark.parametrize("make", [MAKERS["quadratic"], MAKERS["linear"]])
def test_a_group_that_needs_the_rest_gets_it(make):
    """One box far away from eight: alone it would be best, but three have to be."""
    sizes = sorted(len(group) for group in groups(make(unit_boxes([*range(8), 1000]))))
    assert sizes == [LEAST, MOST + 1 - LEAST]


def test_the_splits_differ():
    """Wide boxes begin and end far out, but waste little together with what they contain."""
    boxes = unit_boxes([0, 10, 20, 30, 40, 50, 60, 70, 35])
    boxes[8] = [-5, 0, 0, 76, 1, 1]
    boxes[7, [4, 5]] = 9.0  # with a tall one at the end, the long one wastes most
    assert groups(MAKERS["quadratic"](boxes)) != groups(MAKERS["linear"](boxes))
    # Quadratic: the long and the tall one are apart.
    assert all(len({7, 8} & group) == 1 for group in groups(MAKERS["quadratic"](boxes)))


@pytest.mark.parametrize("make", [MAKERS["quadratic"], MAKERS["linear"]])
def test_a_box_goes_where_surface_grows_least(make):
    """With the volume instead, flat boxes would all tell the same: nothing grows."""
    x = [0, 100, 1, 101, 2, 102, 3, 103, 4]
    boxes = unit_boxes(x)
    boxes[:, 5] = 0.0
    more = np.array([[99.5, 0, 0, 100.5, 1, 0]])
    tree = make(np.concatenate([boxes, more]))
    assert frozenset([1, 3, 5, 7, 9]) in groups(tree)


# ---------------------------------------------------------------------------------- packing


def test_packing_fills_all_nodes():
    for n in (8, 64, 512, 4096, 1000, 12_345):
        tree = MAKERS["str"](random_boxes(n))
        per_level, entries_there = [], n
        while entries_there > 1:
            entries_there = -(-entries_there // MOST)
            per_level.append(entries_there)
        assert np.bincount(tree.level).tolist() == per_level
        # At most the last two of a level share what is left.
        for level in range(len(per_level)):
            assert (tree.size[tree.level == level] < MOST).sum() <= 2


def test_packing_a_lattice_makes_cubes():
    """4096 boxes on a 16^3 lattice are 8^3 nodes: 8 slabs of 8 columns of 8 runs."""
    place = np.stack(np.unravel_index(np.random.default_rng(1).permutation(4096), (16,) * 3), 1)
    boxes = np.concatenate([place, place + 1.0], axis=1)
    tree = MAKERS["str"](boxes)
    lowest = tree.boxes[4096:][tree.level == 0]
    assert len(lowest) == 512
    # Slabs are two cells thick; a run takes its 8 boxes from 2 x 2 x 16 sorted by z.
    assert np.array_equal(lowest[:, 3:] - lowest[:, :3], np.full((512, 3), 2.0))
    assert surface_area(lowest).sum() == 512 * 24


# ----------------------------------------------------------------------------- as hierarchies


@pytest.mark.parametrize("text", ["rtree_insert", "rtree_insert,rtree_split=linear", "rtree_str"])
@pytest.mark.parametrize("s", [2, 3, 4])
def test_tetra_is_not_cheaper_than_its_closed_form(build, text, s):
    scene = make_sample(f"tetra:size={s}")
    single = build("bvh", scene, f"builder={text},max_leaf_size=1,C_trav=1").statistics()
    assert single.sah >= 7 / 3 * (s - 1) + 3 + 4 - 1e-12
    assert single.expected_tests == pytest.approx(4.0, rel=1e-12)


def test_quadratic_is_better_than_linear_than_nothing(build):
    """Guttman's finding for queries, on a mesh whose triangles come in a sensible order."""
    scene = make_sample("suzanne:subdivisions=1")
    cost = {
        text: build("bvh", scene, f"builder=rtree_insert,rtree_split={text}").statistics().sah
        for text in ("quadratic", "linear")
    }
    best = build("bvh", scene).statistics().sah
    assert best < cost["quadratic"] < cost["linear"] < 2 * best


class CancelAt(Progress):
    """Cancels at a report, and counts them."""

    def __init__(self, last):
        self.last, self.count = last, 0

    def report(self, done, total, text):
        self.count += 1
        if self.count == self.last:
            raise Cancelled


@pytest.mark.parametrize("last", [1, 5])
def test_they_can_be_cancelled(last):
    boxes = random_boxes(60_000)
    for work in (
        lambda progress: rtree_insert.insert_all(boxes, is_linear=False, progress=progress),
        lambda progress: rtree_str.pack(boxes, progress),
    ):
        with pytest.raises(Cancelled):
            work(CancelAt(last))
