"""Five walks of octrees and kd-trees: the same leaves in the same order, all hits."""

import dataclasses
import functools
import itertools

import numpy as np
import pytest
from accelscope.core.contract.events import HIT, POSTPONE, VISIT_EMPTY, VISIT_INNER, VISIT_LEAF
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.kernels import has_numba, kernel
from accelscope.core.structures import structures
from accelscope.core.structures.subdivision.frontier import (
    DEPTH_FIRST,
    FIFO,
    PRIORITY,
    drop,
    make_frontier,
    peek,
    put,
)


def choices(name, key):
    return list(structures()[name].Settings.__dataclass_fields__[key].metadata["choices"])


WALKS = [(walk, "found") for walk in choices("octree", "walk")] + [("neighbours", "stored")]
STORED = [
    ("octree", f"max_depth=5,max_leaf_size=3,assignment=box,storage={storage},planes={planes}")
    for storage, planes in itertools.product(
        choices("octree", "storage"), choices("octree", "planes")
    )
]
"""Storages take the same steps in the same tree, for which two of them are enough in long tests."""

OPEN_AND_EXACT = [
    ("octree", "max_depth=4,max_leaf_size=1,padding=0,assignment=box,overlap=open"),
    ("octree", "max_depth=4,max_leaf_size=1,padding=0,assignment=exact"),
]
KDTREES = [("kdtree", f"planes={planes}") for planes in choices("kdtree", "planes")]
TREES = [*STORED, *OPEN_AND_EXACT, *KDTREES]
MIDDLE, ADAPTIVE = STORED[0], STORED[-1]


def test_nothing_is_left_out():
    assert choices("kdtree", "walk") == choices("octree", "walk")
    assert len(WALKS) >= 6
    assert len(STORED) >= 8
    assert len(KDTREES) >= 4
    assert MIDDLE[1].endswith("storage=pointer,planes=middle")
    assert ADAPTIVE[1].endswith("storage=hash,planes=adaptive")


@functools.cache
def tree_of(lab, scene_name, name, text):
    structure = structures()[name]
    return structure.build(lab.small_scene(scene_name), lab.settings_of(structure, text))


def walked(tree, walk, links, mailbox=False):
    """Give a built tree another walk."""
    tree.settings = dataclasses.replace(tree.settings, walk=walk, links=links, mailbox=mailbox)
    tree.with_walk(tree.arrays.tree)
    return tree


def leaves(steps):
    """Return the leaves of a recorded walk, in order."""
    return steps.cell[np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY))]


@pytest.mark.parametrize(("name", "text"), TREES)
def test_hits_are_those_of_brute_force(lab, scene_name, name, text):
    tree = tree_of(lab, scene_name, name, text)
    rays, names, want, _ = lab.truth(scene_name, 40)
    in_walls, wall_names = lab.batch_of(lab.wall_rays(tree, 40))
    naive = structures()["naive"]
    at_walls, _ = naive.build(lab.small_scene(scene_name), naive.Settings()).trace(in_walls)
    for (walk, links), mailbox in itertools.product(WALKS, (False, True)):
        walked(tree, walk, links, mailbox)
        for query in (CLOSEST, ALL):
            got, _ = tree.trace(rays, query)
            assert lab.differences(names, want, got) == {}, (walk, links, mailbox, query)
        got, _ = tree.trace(rays, ANY)
        assert lab.any_differences(names, want, got) == {}, (walk, links, mailbox)
        got, _ = tree.trace(in_walls)
        assert lab.differences(wall_names, at_walls, got) == {}, (walk, links, mailbox)


@pytest.mark.parametrize(("name", "text"), [MIDDLE, ADAPTIVE, *OPEN_AND_EXACT, *KDTREES])
@pytest.mark.parametrize("query", [CLOSEST, ALL])
def test_all_walks_visit_the_same_leaves(lab, scene_name, name, text, query):
    tree = tree_of(lab, scene_name, name, text)
    rays, _, _, _ = lab.truth(scene_name)
    in_walls, _ = lab.batch_of(lab.wall_rays(tree, 12))
    batches = [rays.select(np.arange(0, len(rays), 397)), in_walls]
    for batch in batches:
        want = None
        for walk, links in WALKS:
            walked(tree, walk, links)
            got = [leaves(tree.record(batch, i, query)).tolist() for i in range(len(batch))]
            want = want or got
            assert got == want, (walk, links)
            # And the batch counts what the recording shows.
            _, counters = tree.trace(batch, query)
            assert counters["N_ETS"].tolist() == [len(each) for each in got]


@pytest.mark.parametrize(("name", "text"), [MIDDLE, *KDTREES])
@pytest.mark.parametrize(("walk", "links"), WALKS)
@pytest.mark.parametrize("mailbox", [False, True])
def test_recording_is_counting(lab, name, text, walk, links, mailbox):
    tree = walked(tree_of(lab, "suzanne", name, text), walk, links, mailbox)
    rays, _, _, _ = lab.truth("suzanne")
    rays = rays.select(np.arange(0, len(rays), 181))
    for query in (CLOSEST, ANY, ALL):
        hits, counters = tree.trace(rays, query)
        for i in range(len(rays)):
            steps = tree.record(rays, i, query)
            assert steps.tally() == {name: int(counters[name][i]) for name in steps.tally()}
            found = steps.primitive[np.isin(steps.kind, (HIT, POSTPONE))]
            assert (found[-1] if len(found) else -1) == hits.primitive[i]


@pytest.mark.parametrize(("walk", "links"), WALKS)
@pytest.mark.parametrize(("name", "text"), [MIDDLE, *KDTREES])
def test_segments_partition_the_ray(lab, name, text, walk, links):
    """Consecutive leaves touch exactly, and their boxes are where the ray says it is."""
    tree = walked(tree_of(lab, "suzanne", name, text), walk, links)
    cells = tree.cells()
    boxes = np.empty_like(cells.boxes)
    boxes[cells.numbers] = cells.boxes
    rays = Rays.from_arrays(*lab.ray_families(lab.small_scene("suzanne"), 60)["random lines"])
    for i in range(len(rays)):
        steps = tree.record(rays, i, ALL)
        visits = np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY))
        enter, leave = steps.t_enter[visits], steps.t_exit[visits]
        assert np.array_equal(enter[1:], leave[:-1])
        assert (leave > enter).all()
        inside = boxes[steps.cell[visits]]
        middle = rays.origins[i] + (0.5 * (enter + leave))[:, None] * rays.directions[i]
        assert ((middle > inside[:, :3]) & (middle < inside[:, 3:])).all()
        t = (boxes[0].reshape(2, 3) - rays.origins[i]) / rays.directions[i]
        chord = t.max(axis=0).min() - t.min(axis=0).max()
        assert (leave - enter).sum() == pytest.approx(chord, rel=1e-9)


@pytest.mark.parametrize(("name", "text"), [MIDDLE, ADAPTIVE, *KDTREES])
def test_steps_of_the_walks(lab, name, text):
    """March from the root: the sum of depth + 1 over the leaves. The heap is as good as the stack,
    links save going up, and finding a neighbour never costs more than the whole way down."""
    tree = tree_of(lab, "suzanne", name, text)
    rays = Rays.from_arrays(*lab.ray_families(lab.small_scene("suzanne"), 300)["random lines"])
    cells = tree.cells()
    depth = np.empty(len(cells), np.int64)
    depth[cells.numbers] = cells.depth
    steps = {}
    for walk, links in WALKS:
        _, counters = walked(tree, walk, links).trace(rays, ALL)
        steps[walk, links] = counters["N_TS"]
    walked(tree, "march", "found")
    for i in range(0, len(rays), 10):
        assert steps["march", "found"][i] == (depth[leaves(tree.record(rays, i, ALL))] + 1).sum()
    recursive = steps["recursive", "found"]
    assert np.array_equal(recursive, steps["heap", "found"])
    assert np.array_equal(recursive, steps["segments", "found"])
    assert (recursive <= steps["march", "found"]).all()
    assert (steps["neighbours", "stored"] <= steps["neighbours", "found"]).all()


@pytest.mark.parametrize(("name", "text"), [MIDDLE, ADAPTIVE, *KDTREES])
def test_ropes_lead_through_the_whole_face(lab, scene_name, name, text):
    tree = walked(tree_of(lab, scene_name, name, text), "neighbours", "stored")
    ropes, boxes, root = tree.arrays.ropes, tree.arrays.boxes, tree.arrays.tree.box
    cells = tree.cells()
    all_boxes = np.empty_like(cells.boxes)
    all_boxes[cells.numbers] = cells.boxes
    for face in range(6):
        axis, side = face % 3, face // 3
        at_border = boxes[:, face] == root[face]
        assert np.array_equal(ropes[:, face] < 0, at_border)
        mine, other = boxes[~at_border], all_boxes[ropes[~at_border, face]]
        # The neighbour, or the inner node around it, begins at the face or reaches across it ...
        assert np.array_equal(mine[:, face], other[:, 3 * (1 - side) + axis])
        # ... and covers it.
        for a in {0, 1, 2} - {axis}:
            assert (other[:, a] <= mine[:, a]).all()
            assert (other[:, 3 + a] >= mine[:, 3 + a]).all()


def test_walks_with_many_segments_are_cut_piece_by_piece(lab, build):
    """More leaves on a ray than the list of segments has room for."""
    scene = lab.small_scene("one")
    text = "max_depth=9,max_leaf_size=0,padding=0,overlap=closed"
    tree = build("octree", scene, text)
    n = 200
    a = np.random.default_rng(1).random((n, 3)) * [1, 1, 0]
    rays = Rays.from_arrays(a - [0, 0, 1], np.array([[0.0, 0.0, 1.0]]) + 1e-3 * a)
    along = Rays.from_arrays(
        np.full((n, 3), [-0.1, 0.3, 0.0]) + 1e-8 * a,
        np.array([[1.0, 0.01, 1e-9]]) + 1e-3 * a * [0, 1, 0],
    )
    for batch in (rays, along):
        want, counters = tree.trace(batch, ALL)
        got, same = walked(tree, "segments", "found").trace(batch, ALL)
        assert np.array_equal(want.t, got.t)
        assert np.array_equal(counters.values, same.values)
        walked(tree, "recursive", "found")


@kernel
def put_one(frontier, node, key):
    """Only kernels can call the frontier's kernels."""
    put(frontier, node, key)


@kernel
def take_one(frontier):
    node = peek(frontier)
    drop(frontier)
    return node


@pytest.mark.parametrize("order", [DEPTH_FIRST, FIFO, PRIORITY])
def test_frontier_hands_out_in_order(order):
    rng = np.random.default_rng(order)
    keys = rng.integers(0, 9, 200).astype(float)
    frontier = make_frontier(200, order)
    waiting, handed = [], []
    for node in range(200):
        put_one(frontier, node, keys[node])
        waiting.append(node)
        if rng.random() < 0.4:
            take(frontier, order, waiting, keys, handed)
    while waiting:
        take(frontier, order, waiting, keys, handed)
    assert frontier.state[0] == frontier.state[1]
    assert sorted(handed) == list(range(200))


def take(frontier, order, waiting, keys, handed):
    node = take_one(frontier)
    want = {
        DEPTH_FIRST: waiting[-1],
        FIFO: waiting[0],
        PRIORITY: min(waiting, key=lambda n: (-keys[n], n)),
    }[order]
    assert node == want
    waiting.remove(node)
    handed.append(node)


@pytest.mark.skipif(not has_numba(), reason="compares with compiled kernels")
def test_walks_start_with_the_root(lab):
    tree = tree_of(lab, "tetra", *MIDDLE)
    rays, _, _, _ = lab.truth("tetra")
    for walk, links in WALKS:
        steps = walked(tree, walk, links).record(rays, 3, ALL)
        visits = steps.cell[np.isin(steps.kind, (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY))]
        assert len(visits) == 0 or visits[0] == 0
