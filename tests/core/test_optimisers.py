"""Trees that are rearranged stay sound and never get worse; moves are the best ones there are."""

import dataclasses
import functools
import itertools
import threading

import numpy as np
import pytest
from accelscope.core import parallel
from accelscope.core.contract.build_log import MOVE, REINSERT
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.kernels import call
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.structures.bvh.builders.top_down import binned_sah
from accelscope.core.structures.bvh.optimisers import OPTIMISERS, rearranging
from accelscope.core.structures.bvh.optimisers import reinsert as one_by_one
from accelscope.core.structures.bvh.optimisers import reinsert_batches as in_batches
from accelscope.core.structures.bvh.optimisers import reinsert_parallel as at_once
from accelscope.core.structures.bvh.optimisers import rotate as rotations
from accelscope.core.structures.bvh.settings import BVHSettings
from accelscope.core.structures.bvh.topology.collapse import LeafRule, collapse
from accelscope.core.structures.bvh.topology.tree import LinkedTree, Primitives, linked
from accelscope.sample_scenes import make_sample

NAMES = [name for name in OPTIMISERS if name != "none"]
SETTINGS = BVHSettings(max_leaf_size=1, batch=0.25)
"""A batch that has something to do in a tree of a thousand nodes."""

# ------------------------------------------------------------------- trees as nested tuples


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


# ------------------------------------------------------------------------------------ each move


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
