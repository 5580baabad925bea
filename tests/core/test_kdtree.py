"""The kd-tree: one SAH tree by three builders, closed forms, hits, stopping, and bad input."""

import kdtree_reference as reference
import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures import kdtree, structures
from accelscope.sample_scenes import make_sample

PLANES = ("cyclic", "longest", "object_median", "sah")
WALKS = ("march", "segments", "neighbours", "recursive", "heap")


def lines(scene, count, seed=1):
    return Rays.from_arrays(*random_lines(scene.lower, scene.upper, count, seed))


def assert_mean(values, expected):
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - expected) < 4 * error + 1e-12, (values.mean(), expected, error)


# --------------------------------------------------------------------------- three SAH builders


def pieces(scene, count):
    """The first triangles of a scene, so that the slow builders end."""
    return Scene.from_triangles(scene.triangles[:count], scene.name)


@pytest.mark.parametrize(
    "text",
    [
        "max_leaf_size=0",
        "max_leaf_size=2,empty_bonus=0",
        "max_leaf_size=8",
        "max_leaf_size=1,empty_bonus=1,max_depth=9",
        "max_leaf_size=0,C_trav=0.1,padding=0.1",
    ],
)
def test_three_builders_build_the_same_tree(lab, build, scene_name, text):
    scene = pieces(lab.small_scene(scene_name), 260)
    tree = build("kdtree", scene, text)
    got = reference.nested(tree.arrays.tree)
    for counts in (reference.counts_by_counting, reference.counts_by_sweeping):
        want = reference.build(
            scene, tree.triangles, tree.settings, tree.arrays.tree.box.copy(), counts
        )
        assert got == want


def test_triangles_in_walls_go_to_the_cheaper_side(build):
    """Axis-aligned walls of a room, in and beside every plane that could be chosen."""
    rng = np.random.default_rng(3)
    corners = rng.integers(0, 5, size=(300, 3, 3)).astype(float)
    axis = rng.integers(0, 3, size=300)
    for i in range(250):
        corners[i, :, axis[i]] = corners[i, 0, axis[i]]
    scene = Scene.from_triangles(corners, "walls")
    for text in ("max_leaf_size=0", "max_leaf_size=0,C_trav=0.1,empty_bonus=0.5"):
        tree = build("kdtree", scene, text)
        assert tree.validate() == []
        for counts in (reference.counts_by_counting, reference.counts_by_sweeping):
            want = reference.build(
                scene, tree.triangles, tree.settings, tree.arrays.tree.box.copy(), counts
            )
            assert reference.nested(tree.arrays.tree) == want


def test_threads_and_subtrees_change_nothing(build, monkeypatch):
    scene = make_sample("suzanne:subdivisions=2")
    whole = build("kdtree", scene, "max_leaf_size=2").arrays.tree
    monkeypatch.setattr(kdtree, "SUBTREE", 3000)
    settings = kdtree.KdTreeSettings(max_leaf_size=2)
    triangles = build("kdtree", scene).triangles
    for threads in (1, 2, 5):
        tree, _, _ = kdtree.build_tree(triangles, whole.box, settings, SILENT, threads)
        for a, b in zip(whole, tree):
            assert np.array_equal(a, b)
    for rule in ("longest", "object_median"):
        monkeypatch.setattr(kdtree, "SUBTREE", 1 << 30)
        one = build("kdtree", scene, f"planes={rule}").arrays.tree
        monkeypatch.setattr(kdtree, "SUBTREE", 3000)
        other = build("kdtree", scene, f"planes={rule}").arrays.tree
        assert all(np.array_equal(a, b) for a, b in zip(one, other))


# ------------------------------------------------------------------------------------------ hits


@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize(
    "text", ["max_leaf_size=1,max_depth=12", "max_leaf_size=3,mailbox=true,padding=0.01"]
)
@pytest.mark.parametrize("sample", ["suzanne", "cubes", "mess", "flat", "one"])
def test_hits_are_those_of_brute_force(lab, build, sample, planes, text):
    """On small leaves; the defaults are compared on all scenes by test_same_hits."""
    scene = lab.small_scene(sample)
    tree = build("kdtree", scene, f"planes={planes},{text}")
    assert tree.validate() == []
    rays, names, want, _ = lab.truth(sample)
    closest, _ = tree.trace(rays)
    assert lab.differences(names, want, closest) == {}
    everything, _ = tree.trace(rays, ALL)
    assert lab.differences(names, want, everything) == {}
    some, _ = tree.trace(rays, ANY)
    assert lab.any_differences(names, want, some) == {}
    rays, names = lab.batch_of(lab.wall_rays(tree, 150))
    want, _ = build("naive", scene).trace(rays)
    assert lab.differences(names, want, tree.trace(rays)[0]) == {}


@pytest.mark.parametrize("walk", WALKS)
@pytest.mark.parametrize("sample", ["suzanne", "cubes", "mess"])
def test_walks_agree(lab, build, sample, walk):
    scene = lab.small_scene(sample)
    for text in ("max_leaf_size=1", "max_leaf_size=1,mailbox=true", "planes=cyclic,max_depth=12"):
        tree = build("kdtree", scene, f"{text},walk={walk}")
        base = build("kdtree", scene, text)
        rays, names, want, _ = lab.truth(sample)
        got, counters = tree.trace(rays)
        assert lab.differences(names, want, got) == {}
        _, same = base.trace(rays)
        for name in ("N_ETS", "N_EETS", "N_IT", "mailbox_hits"):
            assert np.array_equal(counters[name], same[name]), name


def test_recording_is_counting(lab, build):
    scene = lab.small_scene("suzanne")
    tree = build("kdtree", scene, "max_leaf_size=1,mailbox=true")
    rays, _, _, _ = lab.truth("suzanne")
    rays = rays.select(np.arange(0, len(rays), 40))
    for query in (0, ANY, ALL):
        _, counters = tree.trace(rays, query)
        for i in range(len(rays)):
            tally = tree.record(rays, i, query).tally()
            assert tally == {name: int(counters[name][i]) for name in tally}


# --------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize("sample", ["suzanne", "tetra", "soup", "teapot_in_stadium"])
def test_random_lines_visit_what_the_areas_say(lab, build, sample, planes):
    scene = lab.small_scene(sample)
    tree = build("kdtree", scene, f"planes={planes},max_leaf_size=2")
    figures = tree.statistics()
    assert figures.N_V == figures.N_IN + 1
    assert figures.extra["duplication"] == figures.N_OIV / len(scene)
    _, counters = tree.trace(lines(scene, 100_000), ALL)
    assert_mean(counters["N_TS"], figures.expected_inner + figures.expected_leaves)
    assert_mean(counters["N_ETS"], figures.expected_leaves)
    assert_mean(counters["N_EETS"], figures.extra["expected_empty"])
    assert_mean(counters["N_IT"], figures.expected_tests)


@pytest.mark.parametrize("d", [1, 2, 3, 4])
def test_full_cyclic_tree(build, d):
    """A cube cut 3 d times in the middle, x, y, z in turn, is a grid of 2^d cells a side."""
    rng = np.random.default_rng(1)
    cells = np.stack(np.meshgrid(*[np.arange(2.0**d)] * 3), axis=-1).reshape(-1, 1, 3)
    inside = cells + rng.uniform(0.3, 0.7, (len(cells), 3, 3))
    ends = np.array([[[0.0, 0, 0]] * 2 + [[0.01, 0.01, 0]], [[2.0**d] * 3] * 3]) - np.array(
        [[[0.0]], [[0.0]]]
    )
    ends[1, 2, 0] -= 0.01
    ends[1, 1, 1] -= 0.01
    scene = Scene.from_triangles(np.concatenate([inside, ends]), "full")
    tree = build("kdtree", scene, f"planes=cyclic,max_depth={3 * d},max_leaf_size=0")
    figures = tree.statistics()
    assert (8**d - 1, 8**d) == (figures.N_IN, figures.N_V)
    assert figures.expected_leaves == pytest.approx(2**d, rel=1e-12)
    assert figures.expected_inner == pytest.approx(4 * (2**d - 1), rel=1e-12)
    _, counters = tree.trace(lines(scene, 100_000), ALL)
    assert_mean(counters["N_ETS"], 2**d)
    assert_mean(counters["N_TS"], 2**d + 4 * (2**d - 1))


def test_sah_of_tetra_is_no_worse_than_static_trees(build):
    scene = make_sample("tetra:size=5")
    sah = build("kdtree", scene, "max_leaf_size=0").statistics()
    for rule in ("cyclic", "longest", "object_median"):
        for leaf in (1, 2, 4, 8):
            other = build("kdtree", scene, f"planes={rule},max_leaf_size={leaf}").statistics()
            assert sah.sah <= other.sah
    # A triangle touches planes of others but straddles few.
    assert 3 * len(scene) > sah.N_OIV


def test_empty_space_is_cut_off(build):
    """Two triangles far apart: cells around them, and nothing in between."""
    near = np.array([[0.0, 0, 0], [1, 0, 0.5], [0, 1, 1]])
    scene = Scene.from_triangles(np.stack([near, near + 100.0]), "far apart")
    figures = build("kdtree", scene, "max_leaf_size=0,C_trav=0.1").statistics()
    assert figures.N_EV >= 1
    assert figures.N_OIV == 2
    assert figures.expected_tests < 0.05


# -------------------------------------------------------------------------------------- stopping


def test_a_budget_of_cells(build):
    scene = make_sample("suzanne:subdivisions=0")
    for planes in PLANES:
        full = build("kdtree", scene, f"planes={planes},max_leaf_size=2").arrays.tree
        nodes = len(full.link)
        for order in ("fifo", "priority", "depth_first"):
            text = f"planes={planes},max_leaf_size=2,order={order}"
            for budget in (1, 2, 3, 301, nodes - 1, nodes, 10 * nodes):
                tree = build("kdtree", scene, f"{text},budget={budget}")
                assert tree.validate() == []
                used = len(tree.arrays.tree.link)
                assert used <= min(budget, nodes)
                assert used >= min(budget, nodes) - 1
            for a, b in zip(full, tree.arrays.tree):
                assert np.array_equal(a, b)


def test_a_queue_fills_the_levels_in_turn(build):
    scene = make_sample("suzanne:subdivisions=1")
    text = "planes=cyclic,max_leaf_size=0,budget=1023,max_depth=30"
    fifo = build("kdtree", scene, f"{text},order=fifo").statistics()
    depth = build("kdtree", scene, f"{text},order=depth_first").statistics()
    priority = build("kdtree", scene, f"{text},order=priority").statistics()
    assert fifo.max_depth < 14 < depth.max_depth
    assert priority.expected_tests < fifo.expected_tests < depth.expected_tests


def test_depth_and_leaf_size(build):
    scene = make_sample("soup:count=2000")
    for planes in PLANES:
        for depth in (1, 2, 7):
            figures = build(
                "kdtree", scene, f"planes={planes},max_depth={depth},max_leaf_size=0"
            ).statistics()
            assert figures.max_depth == depth
        figures = build("kdtree", scene, f"planes={planes},max_leaf_size=2000").statistics()
        assert (figures.N_V, figures.N_OIV) == (1, 2000)
    figures = build("kdtree", scene, "planes=longest,max_leaf_size=8,max_depth=60").statistics()
    assert len(figures.leaf_sizes) <= 9


class CancelAt(Progress):
    def __init__(self, report):
        self.left = report

    def report(self, done, total, text):
        assert 0 <= done <= total
        self.left -= 1
        if self.left < 0:
            raise Cancelled


@pytest.mark.parametrize("planes", PLANES)
@pytest.mark.parametrize("report", [0, 1, 3])
def test_a_build_stops(planes, report):
    scene = make_sample("soup:count=100000,edge=0.02")
    tree = structures()["kdtree"]
    with pytest.raises(Cancelled):
        tree.build(scene, tree.Settings(planes=planes), CancelAt(report))


# ------------------------------------------------------------------------------------- bad input


def trace_like_naive(build, scene, tree, count=300):
    rays = lines(scene, count)
    want, _ = build("naive", scene).trace(rays)
    got, _ = tree.trace(rays)
    assert np.array_equal(want.t, got.t)
    assert np.array_equal(want.primitive, got.primitive)


def bad_scene(name):
    rng = np.random.default_rng(1)
    if name == "one plane":
        corners = rng.random((3000, 3, 3))
        corners[:, :, 2] = 0.0
        frame = np.array([[[0, 0, -1.0], [1e-3, 0, -1], [0, 1e-3, -1]]])
        return np.concatenate([corners, frame, -frame])
    if name == "through one point":
        corners = rng.normal(size=(20_000, 3, 3))
        corners[:, 2] = -0.5 * (corners[:, 0] + corners[:, 1])
        return corners
    if name == "long":
        return rng.random((5000, 1, 3)) * [1e6, 1, 1] + rng.random((5000, 3, 3))
    return np.repeat(rng.random((1, 3, 3)), 10_000, axis=0)  # identical


@pytest.mark.parametrize("name", ["one plane", "through one point", "long", "identical"])
@pytest.mark.parametrize("text", ["", "max_leaf_size=0", "max_leaf_size=0,max_depth=60"])
def test_bad_scenes_under_the_heuristic(build, name, text):
    scene = Scene.from_triangles(bad_scene(name), name)
    tree = build("kdtree", scene, text)
    # It stops by itself.
    assert len(tree.arrays.tree.references) <= 64 * len(scene) < kdtree.FEW
    assert tree.validate() == []
    trace_like_naive(build, scene, tree)


@pytest.mark.parametrize("name", ["one plane", "through one point", "long", "identical"])
@pytest.mark.parametrize("planes", ["cyclic", "longest", "object_median"])
def test_bad_scenes_under_static_rules(build, name, planes, monkeypatch):
    """Where no split helps, references are limited; without a limit they explode: refused."""
    monkeypatch.setattr(kdtree.builder, "MOST_REFERENCES", 1 << 19)
    scene = Scene.from_triangles(bad_scene(name), name)
    text = f"planes={planes}"
    if name != "long":
        with pytest.raises(InputError, match="or set a budget or duplication"):
            build("kdtree", scene, f"{text},duplication=0")
    for cure in (text, f"{text},duplication=0,max_depth=5"):
        tree = build("kdtree", scene, cure)
        assert tree.validate() == []
        trace_like_naive(build, scene, tree)


@pytest.mark.parametrize("planes", PLANES)
def test_100_000_triangles_through_one_point(build, planes, monkeypatch):
    monkeypatch.setattr(kdtree.builder, "MOST_REFERENCES", 1 << 21)
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(100_000, 3, 3))
    corners[:, 2] = -0.5 * (corners[:, 0] + corners[:, 1])
    scene = Scene.from_triangles(corners, "through one point")
    if planes == "sah":
        tree = build("kdtree", scene, "max_depth=9")
        assert tree.statistics().N_V > 100
        trace_like_naive(build, scene, tree, 20)
        return
    with pytest.raises(InputError, match="lower max_depth, raise max_leaf_size or set a bud"):
        build("kdtree", scene, f"planes={planes},duplication=0")
    tree = build("kdtree", scene, f"planes={planes}")
    assert len(tree.arrays.tree.references) <= kdtree.DUPLICATION * len(scene)


@pytest.mark.parametrize("planes", PLANES)
def test_depth_0_and_a_budget_of_one_are_one_cell(lab, build, planes):
    scene = lab.small_scene("suzanne")
    for text in ("max_depth=0", "budget=1", "budget=2", "max_depth=0,max_leaf_size=0"):
        tree = build("kdtree", scene, f"planes={planes},{text}")
        figures = tree.statistics()
        assert (0, 1, len(scene)) == (figures.N_IN, figures.N_V, figures.N_OIV)
        assert tree.validate() == []
        assert len(tree.cells()) == 1
        assert len(tree.cells().planes.owners) == 0
        trace_like_naive(build, scene, tree, 50)


@pytest.mark.parametrize("planes", PLANES)
def test_everything_in_a_plane_that_also_splits(build, planes):
    """Two halves of a sheet in the middle of the cell, whose frame is far away."""
    rng = np.random.default_rng(2)
    sheet = rng.random((400, 3, 3))
    sheet[:, :, 2] = 0.0
    frame = np.array([[[0, 0, -1.0], [1, 0, -1], [0, 1, -1]], [[1, 1, 1.0], [0, 1, 1], [1, 0, 1]]])
    scene = Scene.from_triangles(np.concatenate([sheet, frame]), "sheet")
    tree = build("kdtree", scene, f"planes={planes},max_leaf_size=20,max_depth=9")
    cells = tree.cells()
    assert (cells.extra["split"][cells.extra["axis"] == 2] == 0.0).any()
    assert tree.validate() == []
    trace_like_naive(build, scene, tree)


def test_depth_60_without_a_leaf_size_is_refused_or_done(build, monkeypatch):
    monkeypatch.setattr(kdtree.builder, "MOST_REFERENCES", 1 << 20)
    scene = make_sample("suzanne:subdivisions=0")
    for planes in ("cyclic", "longest"):
        with pytest.raises(InputError, match="max_depth"):
            build("kdtree", scene, f"planes={planes},max_depth=60,max_leaf_size=0")
    tree = build("kdtree", scene, "max_depth=60,max_leaf_size=0")
    trace_like_naive(build, scene, tree)


def test_a_flat_scene_without_padding(lab, build):
    scene = lab.small_scene("flat")
    for planes in PLANES:
        tree = build("kdtree", scene, f"planes={planes},max_leaf_size=0,padding=0")
        assert tree.validate() == []
        assert tree.statistics().N_V > 30


# ---------------------------------------------------------------------------------------- damage


def test_a_missing_reference_is_found(lab, build):
    tree = build("kdtree", lab.small_scene("soup"), "max_leaf_size=2")
    arrays = tree.arrays.tree
    ids, counts = np.unique(arrays.references, return_counts=True)
    place = int(np.flatnonzero(arrays.references == ids[counts > 2][0])[1])
    offsets = arrays.offsets.copy()
    offsets[np.searchsorted(offsets, place, side="right") :] -= 1
    damaged = arrays._replace(references=np.delete(arrays.references, place), offsets=offsets)
    tree.arrays = tree.arrays._replace(tree=damaged)
    assert tree.validate() == ["the leaves that list a triangle do not cover it"]


# --------------------------------------------------------------------------------------- drawing


@pytest.mark.parametrize("planes", PLANES)
def test_planes_of_cells(lab, build, planes):
    cells = build("kdtree", lab.small_scene("suzanne"), f"planes={planes}").cells()
    axis, split = cells.attributes()["axis"], cells.attributes()["split"]
    assert np.array_equal(axis == 3, cells.is_leaf)
    assert np.array_equal(np.isnan(split), cells.is_leaf)
    inner = np.flatnonzero(~cells.is_leaf)
    assert (cells.boxes[inner, axis[inner]] < split[inner]).all()
    assert (split[inner] < cells.boxes[inner, 3 + axis[inner]]).all()
    # One rectangle each: the cell's box, made flat.
    assert np.array_equal(cells.planes.owners, inner)
    corners = cells.planes.points.reshape(-1, 4, 3)
    flat = cells.boxes[inner].copy()
    flat[np.arange(len(inner)), axis[inner]] = split[inner]
    flat[np.arange(len(inner)), 3 + axis[inner]] = split[inner]
    assert np.array_equal(corners.min(axis=1), flat[:, :3])
    assert np.array_equal(corners.max(axis=1), flat[:, 3:])
    sides = np.ptp(corners, axis=1)
    around = np.abs(np.diff(corners, axis=1, append=corners[:, :1])).sum(axis=(1, 2))
    assert np.allclose(around, 2 * sides.sum(axis=1), rtol=1e-12)


def simulated_order(tree, order):
    """The step in which each node is made, by a builder that knows how its tree will look."""
    link, nodes = tree.arrays.tree.link, tree.topology()
    size = nodes.boxes[:, 3:] - nodes.boxes[:, :3]
    area = size[:, 0] * size[:, 1] + size[:, 1] * size[:, 2] + size[:, 2] * size[:, 0]
    inside = {}

    def triangles(node):
        if node not in inside:
            number = link[node] >> 2
            if nodes.is_leaf[node]:
                offsets = tree.arrays.tree.offsets
                inside[node] = set(
                    tree.arrays.tree.references[offsets[number] : offsets[number + 1]]
                )
            else:
                inside[node] = triangles(number) | triangles(number + 1)
        return inside[node]

    made, waiting, steps = {0: 0}, [0], 0
    while waiting:
        if order == "fifo":
            node = waiting.pop(0)
        elif order == "depth_first":
            node = waiting.pop()
        else:
            node = min(waiting, key=lambda n: (-area[n] * len(triangles(n)), made[n], n))
            waiting.remove(node)
        if nodes.is_leaf[node]:
            continue
        steps += 1
        left = link[node] >> 2
        made[left] = made[left + 1] = steps
        waiting += [left + 1, left] if order == "depth_first" else [left, left + 1]
    return np.array([made[node] for node in range(len(link))])


@pytest.mark.parametrize("order", ["fifo", "priority", "depth_first"])
@pytest.mark.parametrize("budget", [0, 201])
@pytest.mark.parametrize("planes", ["cyclic", "sah"])
def test_cells_tell_the_order_of_making(lab, build, order, budget, planes):
    scene = lab.small_scene("suzanne")
    text = f"planes={planes},order={order},budget={budget},max_depth=9"
    tree = build("kdtree", scene, text, log=True)
    cells = tree.cells()
    got = np.empty(len(cells), np.int64)
    got[cells.numbers] = cells.extra["order"]
    assert np.array_equal(got, simulated_order(tree, order))
    assert got.max() == tree.statistics().N_IN


def test_threads_do_not_change_the_order_of_making(build, monkeypatch):
    scene = make_sample("suzanne:subdivisions=2")
    whole = build("kdtree", scene, "order=depth_first", log=True).cells()
    monkeypatch.setattr(kdtree, "SUBTREE", 3000)
    pieces = build("kdtree", scene, "order=depth_first", log=True).cells()
    assert np.array_equal(whole.extra["order"], pieces.extra["order"])


@pytest.mark.parametrize("planes", ["cyclic", "longest"])
def test_one_triangle_is_not_cut_for_ever(build, planes):
    scene = Scene.from_triangles(np.array([[[0.0, 0.1, 0.2], [1, 0.3, 0.7], [0.4, 1, 0.9]]]), "one")
    with pytest.raises(InputError, match=r"kdtree.*nodes over 1 tri.*max_depth.*max_leaf_size"):
        build("kdtree", scene, f"planes={planes},max_depth=60,max_leaf_size=0")
