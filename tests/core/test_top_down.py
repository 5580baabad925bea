"""Builders from the top down: their splits against brute force, their trees, their queues."""

import dataclasses
import itertools

import numpy as np
import pytest
from accelscope.core.contract.workspace import MAXIMUM_DEPTH
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.kernels import call
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.sah.split_curve import RULES, split_curve
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.top_down import (
    object_median,
)
from accelscope.core.structures.bvh.topology.tree import Primitives, depths_of, ranges_of
from accelscope.sample_scenes import make_sample

MEDIANS = ["spatial_median", "object_median"]
TOP_DOWN = [*MEDIANS, *RULES]
AXES = ["best", "round_robin"]
each_builder = pytest.mark.parametrize("builder", TOP_DOWN)
each_axis = pytest.mark.parametrize("axis", AXES)


def doubled(boxes):
    """Centroids as builders reckon them: the sum of both sides."""
    return boxes[:, :3] + boxes[:, 3:]


def sweep_costs(boxes, ids):
    """SA(L) N_L + SA(R) N_R of every cut of the list sorted along every axis, (3, n - 1)."""
    rows = []
    for axis in range(3):
        ordered = boxes[np.lexsort((ids, doubled(boxes)[:, axis]))]
        left, right = areas_of_growing(ordered), areas_of_growing(ordered[::-1])[::-1]
        n = np.arange(1, len(boxes))
        rows.append(n * left[:-1] + (len(boxes) - n) * right[1:])
    return np.array(rows)


def areas_of_growing(boxes):
    low = np.minimum.accumulate(boxes[:, :3])
    high = np.maximum.accumulate(boxes[:, 3:])
    return surface_area(np.concatenate([low, high], axis=1))


def inner_nodes(structure):
    """Yield number, depth, triangles and how many of them go left, of each inner node."""
    first, size = structure.arrays.first, structure.arrays.size
    begin, end = ranges_of(first, size, structure.width())
    depths = structure.depths()
    for node in np.flatnonzero(size == 0).tolist():
        ids = structure.triangles.ids[begin[node] : end[node]]
        yield node, int(depths[node]), ids, int(end[first[node]] - begin[node])


def extra_of(structure, name):
    """A figure of the cells, by node."""
    cells = structure.cells()
    out = np.empty_like(cells.extra[name])
    out[cells.numbers] = cells.extra[name]
    return out


# -------------------------------------------------------------------------------- closed forms


@each_builder
@each_axis
@pytest.mark.parametrize(("c_trav", "c_isect"), [(1, 1), (1.2, 1.0), (3, 1), (1, 2)])
def test_cost_of_tetra(build, builder, axis, c_trav, c_isect):
    text = f"builder={builder},axis={axis},C_trav={c_trav},C_isect={c_isect}"
    for s in (2, 4, 6):
        scene = make_sample(f"tetra:size={s}")
        figures = build("bvh", scene, text).statistics()
        assert figures.sah == pytest.approx(c_trav * 7 / 3 * (s - 1) + 4 * c_isect, rel=1e-12)
        assert figures.leaf_sizes.tolist() == [0, 0, 0, 0, 4 ** (s - 1)]
        single = build("bvh", scene, f"{text},max_leaf_size=1").statistics()
        inner = 7 / 3 * (s - 1) + 3  # four equal boxes below each leaf's parent
        assert single.sah == pytest.approx(c_trav * inner + 4 * c_isect, rel=1e-12)


@pytest.mark.parametrize("bins", [2, 4, 8, 20, 32, 64])
def test_cost_of_tetra_with_any_even_number_of_planes(build, bins):
    for s in (3, 5):
        scene = make_sample(f"tetra:size={s}")
        figures = build("bvh", scene, f"builder=parallel_sah,bins={bins}").statistics()
        assert figures.sah == pytest.approx(1.2 * 7 / 3 * (s - 1) + 4, rel=1e-12)


@each_builder
def test_sum_over_single_leaves_is_that_of_the_triangles(lab, build, builder, scene_name):
    scene = lab.small_scene(scene_name)
    areas = surface_area(boxes_of(scene.triangles))
    root = float(surface_area(np.concatenate([scene.lower, scene.upper])))
    figures = build("bvh", scene, f"builder={builder},max_leaf_size=1").statistics()
    assert figures.N_V == figures.N_IN + 1 == len(scene)
    assert figures.expected_tests == pytest.approx(areas.sum() / root, rel=1e-9)


@pytest.mark.parametrize("builder", RULES)
def test_curve_of_a_lattice_of_boxes(build, builder):
    """N_L boxes that fill their space: p_L + p_R = 1 + 2 A_cut / SA."""
    corner = np.array(list(itertools.product(range(4), repeat=3)), float)
    triangle = np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1]], float)  # its box is the unit cube
    scene = Scene.from_triangles(corner[:, None] + triangle, "lattice")
    curve = split_curve(build("bvh", scene, f"builder={builder},C_trav=3,C_isect=2"), 0)
    assert curve.leaf_cost == 128.0
    between = curve.N_L % 16 == 0
    i = curve.N_L[between] / 16
    p_left, p_right = (2 * (16 + 8 * k) / 96 for k in (i, 4 - i))
    assert p_left + p_right == pytest.approx(1 + 2 * 16 / 96)
    expected = 3 + 2 * (p_left * 16 * i + p_right * 16 * (4 - i))
    assert curve.cost[between] == pytest.approx(expected, rel=1e-12)
    assert set(zip(curve.axis[between], i, strict=True)) == set(
        itertools.product(range(3), (1, 2, 3))
    )
    assert curve.cost[curve.best] == pytest.approx(3 + 2 * 64 * 2 / 3, rel=1e-12)


# -------------------------------------------------------------------------------------- splits


@each_axis
@pytest.mark.parametrize("sample", ["soup", "mess", "cubes"])
def test_sweep_finds_the_cheapest_of_all_cuts(lab, build, sample, axis):
    scene = lab.small_scene(sample)
    boxes = boxes_of(scene.triangles)
    tree = build("bvh", scene, f"builder=sweep_sah,axis={axis},max_leaf_size=1", log=True)
    axes, costs = extra_of(tree, "split_axis"), extra_of(tree, "split_cost")
    areas = tree.arrays.volumes.areas()
    for node, depth, ids, n_left in inner_nodes(tree):
        every = sweep_costs(boxes[ids], ids)
        if axis == "round_robin":
            extends = np.ptp(doubled(boxes[ids]), axis=0) > 0
            turn = [a % 3 for a in range(depth, depth + 3) if extends[a % 3]]
            assert axes[node] == (turn[0] if turn else 0)
            if not turn:
                continue
            every[np.arange(3) != turn[0]] = np.inf
        assert every[axes[node], n_left - 1] == every.min()
        if areas[node] > 0.0:
            assert costs[node] == pytest.approx(1.2 + every.min() / areas[node], rel=1e-12)


@pytest.mark.parametrize("bins", [8, 64])
@pytest.mark.parametrize("sample", ["soup", "mess", "cubes", "suzanne"])
def test_few_triangles_are_split_as_by_a_full_sweep(lab, build, sample, bins):
    """With n <= k the candidates are the centroids: the very cost of the best cut of all."""
    scene = lab.small_scene(sample)
    boxes = boxes_of(scene.triangles)
    tree = build("bvh", scene, f"builder=parallel_sah,bins={bins},max_leaf_size=1")
    begin, end = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    areas, checked = tree.arrays.volumes.areas(), 0
    for node, _, ids, n_left in inner_nodes(tree):
        if len(ids) <= bins:
            left = tree.arrays.first[node]
            cost = n_left * areas[left] + (len(ids) - n_left) * areas[left + 1]
            assert cost == sweep_costs(boxes[ids], ids).min()
            checked += 1
    assert checked > 50
    assert end[0] - begin[0] == len(scene)


@pytest.mark.parametrize("bins", [2, 16, 64])
def test_of_one_node_no_rule_is_cheaper_than_a_sweep(lab, build, scene_name, bins):
    """Of one node; whole trees may well be."""
    scene = lab.small_scene(scene_name)
    best = {}
    for builder in RULES:
        curve = split_curve(build("bvh", scene, f"builder={builder},bins={bins}"), 0)
        best[builder] = curve.cost[curve.best] if curve.best >= 0 else np.inf
    assert best["sweep_sah"] <= min(best.values()) * (1 + 1e-12)


@each_axis
@pytest.mark.parametrize("builder", RULES)
@pytest.mark.parametrize("sample", ["suzanne", "mess"])
def test_curves_have_the_split_that_was_taken(lab, build, sample, builder, axis):
    scene = lab.small_scene(sample)
    boxes = boxes_of(scene.triangles)
    tree = build("bvh", scene, f"builder={builder},axis={axis}", log=True)
    axes, positions, costs = (
        extra_of(tree, f"split_{name}") for name in ("axis", "position", "cost")
    )
    for node, _, ids, n_left in list(inner_nodes(tree))[:150]:
        curve = split_curve(tree, node)
        assert set((curve.N_L + curve.N_R).tolist()) <= {len(ids)}
        assert (curve.N_L > 0).all()
        assert (curve.N_R > 0).all()
        assert np.array_equal(curve.box, tree.arrays.volumes.boxes()[node])
        if axis == "round_robin":
            assert len(set(curve.axis.tolist())) <= 1
        order = np.lexsort((curve.position, curve.axis))
        assert np.array_equal(order, np.arange(len(order))) or builder != "binned_sah"
        if curve.best < 0 or axes[node] < 0:
            assert n_left == len(ids) // 2
            continue
        best = curve.best
        assert curve.cost[best] == curve.cost.min()
        assert (axes[node], positions[node]) == (curve.axis[best], curve.position[best])
        assert curve.N_L[best] == n_left
        assert costs[node] == pytest.approx(curve.cost[best], rel=1e-12)
        # What is left of a plane and what is right of it; ties and rounding apart.
        centroids = 0.5 * doubled(boxes[ids])
        for i in range(0, len(curve.axis), 7):
            below = centroids[:, curve.axis[i]] - curve.position[i]
            slack = 1e-12 * np.abs(centroids[:, curve.axis[i]]).max()
            assert (below < -slack).sum() <= curve.N_L[i] <= (below <= slack).sum()


@each_builder
@each_axis
@pytest.mark.parametrize("text", ["", "C_trav=0", "C_trav=20,max_leaf_size=32", "C_isect=0"])
def test_leaves_are_where_no_split_is_cheaper(lab, build, builder, axis, text):
    scene = lab.small_scene("soup")
    tree = build("bvh", scene, f"builder={builder},axis={axis},{text}", log=True)
    settings = tree.settings
    costs, sizes = extra_of(tree, "split_cost"), np.zeros(len(tree.arrays.size), int)
    for node, _, ids, n_left in inner_nodes(tree):
        sizes[node] = len(ids)
        left = tree.arrays.first[node]
        share = tree.areas[[left, left + 1]] / tree.areas[node]
        cost = settings.C_trav + settings.C_isect * (share @ [n_left, len(ids) - n_left])
        assert costs[node] == pytest.approx(cost, rel=1e-12)
        if len(ids) <= settings.max_leaf_size:
            assert costs[node] < settings.C_isect * len(ids)
    assert tree.arrays.size.max() <= settings.max_leaf_size
    if builder in RULES:
        for leaf in np.flatnonzero(tree.arrays.size > 1)[:60].tolist():
            curve = split_curve(tree, leaf)
            assert curve.cost.min() >= curve.leaf_cost * (1 - 1e-12)


def test_trees_that_were_rearranged_have_no_curves(lab, build):
    scene = lab.small_scene("soup")
    for text in ("builder=spatial_median", "arity=4"):
        tree = build("bvh", scene, text)
        with pytest.raises(ValueError, match="comparing costs"):
            split_curve(tree, 0)
    assert "split_axis" not in build("bvh", scene, "arity=4", log=True).cells().extra


# ------------------------------------------------------------------------------------- medians


@each_axis
@pytest.mark.parametrize("sample", ["soup", "mess", "flat"])
def test_spatial_median_halves_the_extent_of_the_centroids(lab, build, sample, axis):
    scene = lab.small_scene(sample)
    boxes = boxes_of(scene.triangles)
    tree = build("bvh", scene, f"builder=spatial_median,axis={axis},max_leaf_size=1", log=True)
    axes, positions = extra_of(tree, "split_axis"), extra_of(tree, "split_position")
    for node, depth, ids, n_left in inner_nodes(tree):
        centroids = doubled(boxes[ids])
        extents = np.ptp(centroids, axis=0)
        if not extents.any():
            assert (axes[node], n_left) == (-1, len(ids) // 2)
            continue
        turn = next(a % 3 for a in range(depth, depth + 3) if extents[a % 3] > 0)
        assert axes[node] == (turn if axis == "round_robin" else int(np.argmax(extents)))
        along = centroids[:, axes[node]]
        assert 2 * positions[node] == 0.5 * along.min() + 0.5 * along.max()
        assert n_left == (along <= 2 * positions[node]).sum() or not 0 < n_left < len(ids)


@each_axis
def test_object_median_halves_the_number(lab, build, scene_name, axis):
    scene = lab.small_scene(scene_name)
    boxes = boxes_of(scene.triangles)
    tree = build("bvh", scene, f"builder=object_median,axis={axis},max_leaf_size=1", log=True)
    assert tree.statistics().max_depth == int(np.ceil(np.log2(len(scene))))
    axes, ids_at = extra_of(tree, "split_axis"), tree.triangles.ids
    begin, _ = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    for node, _, ids, n_left in inner_nodes(tree):
        assert n_left == len(ids) // 2
        if axes[node] >= 0:
            along = doubled(boxes[ids])[:, axes[node]]
            ordered = ids[np.lexsort((ids, along))]
            got = ids_at[begin[node] : begin[node] + n_left]
            assert np.array_equal(np.sort(got), np.sort(ordered[:n_left]))


def test_selection_puts_the_wanted_triangle_into_its_place():
    rng = np.random.default_rng(1)
    for n, wanted in ((1, 0), (2, 1), (9, 0), (9, 8), (200, 77)):
        for values in (
            rng.random(n),
            np.zeros(n),
            np.arange(n),
            np.arange(n)[::-1],
            rng.integers(3, size=n),
        ):
            low = np.repeat(np.asarray(values, float)[:, None], 3, axis=1)
            boxes = np.concatenate([low, low], axis=1)
            ids = rng.permutation(n).astype(np.int32)
            key = sorted(zip(2.0 * low[:, 1], ids, strict=True))
            order = ids.copy()
            call(object_median.select, boxes, order, 0, n, 1, wanted)
            got = list(zip(2.0 * boxes[:, 1], order, strict=True))
            assert got[wanted] == key[wanted]
            assert sorted(got[:wanted]) == key[:wanted]
            assert sorted(got) == key


# -------------------------------------------------------------------------------- awkward input


def nested(n):
    """Triangles around one another with one centroid."""
    size = np.arange(1.0, n + 1)[:, None, None]
    return size * (np.array([[0, 0, 0], [1, 1, 0], [1, 0, 1]], float) - 0.5)


AWKWARD = {
    "identical": lambda: np.repeat(np.random.default_rng(1).random((1, 3, 3)), 300, axis=0),
    "nested": lambda: nested(500),
    "dolls": lambda: nested(200) * np.exp2(np.arange(200.0))[:, None, None] + 1.0,
    "points": lambda: np.repeat(np.random.default_rng(2).random((60, 1, 3)), 3, axis=1),
    "one point": lambda: np.ones((40, 3, 3)),
    "on a line": lambda: np.arange(300.0).reshape(100, 3, 1) * np.ones(3),
    "far away": lambda: 1e12 + np.random.default_rng(3).random((100, 3, 3)),
    "adjacent numbers": lambda: (
        np.nextafter(1.0, 1.0 + np.arange(40.0) % 2).repeat(9).reshape(40, 3, 3)
    ),
    "smallest numbers": lambda: 5e-324 * np.random.default_rng(4).integers(9, size=(60, 3, 3)),
    "large": lambda: 1e99 * np.random.default_rng(5).random((60, 3, 3)),
}


@each_builder
@each_axis
@pytest.mark.parametrize("name", AWKWARD)
def test_awkward_triangles(builder, axis, name):
    """Also those that no scene has, because no ray can hit any of them."""
    corners = AWKWARD[name]()
    boxes = boxes_of(corners)
    defaults = dataclasses.replace(BVHSettings(), builder=builder, axis=axis)
    for changes in (
        {},
        {"max_leaf_size": 1},
        {"max_leaf_size": 1024, "bins": 2},
        {"C_trav": 0.0, "C_isect": 0.0},
    ):
        settings = dataclasses.replace(defaults, **changes)
        primitives = Primitives(all_triangles(corners), boxes.copy())
        grouping = BUILDERS[builder].build(primitives, settings, SILENT, log=True)
        tree, order, log = grouping.tree, grouping.order, grouping.log()
        width = np.where(tree.size > 0, 0, 2)
        assert np.array_equal(np.sort(order), np.arange(len(boxes)))
        assert tree.size.max() <= settings.max_leaf_size
        assert depths_of(tree.first, tree.size, width).max() <= MAXIMUM_DEPTH
        begin, end = ranges_of(tree.first, tree.size, width)
        for node in range(len(tree.size)):
            below = boxes[order[begin[node] : end[node]]]
            assert np.array_equal(tree.boxes[node, :3], below[:, :3].min(axis=0))
            assert np.array_equal(tree.boxes[node, 3:], below[:, 3:].max(axis=0))
        assert not np.isinf(log.cost).any()
        assert (
            np.isfinite(log.cost).sum() <= (log.axis >= 0).sum() == np.isfinite(log.position).sum()
        )


@each_builder
def test_builders_can_be_stopped_and_say_how_far_they_are(builder):
    scene = make_sample("soup:count=30000")
    settings = dataclasses.replace(BVHSettings(), builder=builder)

    class Stop(Progress):
        def __init__(self, at):
            self.at, self.seen = at, []

        def report(self, done, total, text):
            self.seen.append(done)
            assert total == len(scene)
            if done >= self.at:
                raise Cancelled

    full = Stop(np.inf)
    primitives = Primitives(scene.geometry, scene.boxes())
    BUILDERS[builder].build(primitives, settings, full)
    assert full.seen == sorted(full.seen)
    assert (full.seen[0], full.seen[-1]) == (0, len(scene))
    with pytest.raises(Cancelled):
        BUILDERS[builder].build(primitives, settings, Stop(1))
