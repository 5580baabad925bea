"""The octree: published counts, four storages of one tree, planes, criteria, bad input."""

import itertools
import json

import numpy as np
import pytest
from accelscope.addon.command.main import main
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.rays import ALL, Rays
from accelscope.core.scene import Scene
from accelscope.core.structures.octree.storage import (
    STORAGES,
    chain_lengths,
    table_size,
    topology_bytes,
)
from accelscope.core.structures.subdivision import selection
from accelscope.core.structures.subdivision.structure import padded_box
from accelscope.sample_scenes import make_sample

HAVRAN = "camera:width=513,height=513,pixel=corner,shadows=true"
MIXED = "max_depth=6,max_leaf_size=3,assignment=box"


@pytest.fixture
def evaluate(capsys):
    """Run ``accelscope evaluate`` and return the one record."""

    def call(*arguments):
        capsys.readouterr()
        code = main(["evaluate", *arguments, "--json", "-", "--quiet"])
        captured = capsys.readouterr()
        assert (code, captured.err) == (0, "")
        (record,) = json.loads(captured.out)["records"]
        return record

    return call


# ---------------------------------------------------------------------------- published tables

COUNTS = {
    "max_depth=4": (305, 2136, 1072, 13312),
    "max_depth=5": (1369, 9584, 4764, 32768),
    "max_depth=4,padding=0": (405, 2836, 1252, 29776),
    "max_depth=4,padding=0,overlap=open": (85, 596, 340, 4096),
}
"""N_IN, N_V, N_EV, N_OIV of tetra, one triangle per leaf (Havran 1999, Octree84-C)."""


@pytest.mark.parametrize("text", COUNTS)
@pytest.mark.parametrize("storage", STORAGES)
def test_published_counts(evaluate, text, storage):
    spec = f"octree:max_leaf_size=1,assignment=box,duplication=0,storage={storage},{text}"
    figures = evaluate("sample:tetra", "--structure", spec, "--rays", "random_lines:count=10")[
        "statistics"
    ]
    assert tuple(figures[name] for name in ("N_IN", "N_V", "N_EV", "N_OIV")) == COUNTS[text]
    assert figures["max_depth"] == int(text[10])


PER_RAY = {
    ("march", 4): 21.54, ("march", 5): 32.08,
    ("neighbours", 4): 17.75, ("neighbours", 5): 23.91,
    ("recursive", 4): 9.59, ("recursive", 5): 12.70,
}  # fmt: skip
PUBLISHED = "padding=0.001,max_leaf_size=1,assignment=box,duplication=0"
TOLERANCE = {"march": 0.015, "neighbours": 0.08, "recursive": 0.025}


@pytest.mark.parametrize(("walk", "depth"), PER_RAY)
def test_published_steps(evaluate, walk, depth):
    spec = f"octree:{PUBLISHED},max_depth={depth},walk={walk}"
    trace = evaluate("sample:tetra", "--structure", spec, "--rays", HAVRAN)["trace"]
    assert trace["N_TS"] == pytest.approx(PER_RAY[walk, depth], rel=TOLERANCE[walk])
    assert trace["N_ETS"] == pytest.approx({4: 4.72, 5: 6.20}[depth], rel=0.015)
    assert trace["N_EETS"] == pytest.approx({4: 3.05, 5: 4.48}[depth], rel=0.015)
    assert abs(trace["hits_by_class"]["primary"] - 49950) <= 2
    assert trace["hits_by_class"]["shadow"] == pytest.approx(5538, rel=0.01)


# ------------------------------------------------------------------------- the tree by hand


def octree_by_hand(scene, max_depth, max_leaf_size, padding, closed):
    """Return the leaves {path of octants: triangles} of a middle octree, in a few plain lines."""
    boxes = boxes_of(scene.triangles)
    leaves = {}

    def split(path, cell, inside):
        if len(inside) <= max_leaf_size or len(path) == max_depth:
            leaves[path] = inside.tolist()
            return
        middle = 0.5 * (cell[:3] + cell[3:])
        low, high = boxes[inside, :3], boxes[inside, 3:]
        below, above = low < middle, (high > middle) | (low == middle)
        if closed:
            below, above = low <= middle, high >= middle
        for octant in range(8):
            upper = np.array([octant >> axis & 1 for axis in range(3)], dtype=bool)
            part = np.concatenate(
                [np.where(upper, middle, cell[:3]), np.where(upper, cell[3:], middle)]
            )
            split((*path, octant), part, inside[np.where(upper, above, below).all(axis=1)])

    split((), padded_box(scene.lower, scene.upper, padding), np.arange(len(scene)))
    return leaves


def leaves_of(built):
    """Return the same of a built tree."""
    leaves = {}

    def visit(path, node):
        if node >= len(built.planes):
            first, last = built.offsets[node - len(built.planes) :][:2]
            leaves[path] = built.references[first:last].tolist()
            return
        for octant in range(8):
            visit((*path, octant), built.children[node, octant])

    visit((), 0)
    return leaves


@pytest.mark.parametrize("order", ["fifo", "priority", "depth_first"])
@pytest.mark.parametrize("overlap", ["closed", "open"])
@pytest.mark.parametrize("padding", ["0", "0.001"])
def test_tree_is_the_one_built_by_hand(lab, build, scene_name, order, overlap, padding):
    scene = lab.small_scene(scene_name)
    text = f"{MIXED},order={order},overlap={overlap},padding={padding}"
    want = octree_by_hand(scene, 6, 3, float(padding), overlap == "closed")
    got = leaves_of(build("octree", scene, text).built)
    assert got == want
    assert list(got) == list(want), "leaves are numbered in the order of octants"


def test_every_tree_has_seven_leaves_per_inner_node_and_one(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    for text in (MIXED, f"{MIXED},planes=adaptive", "max_depth=0", f"{MIXED},assignment=exact", ""):
        figures = build("octree", scene, text).statistics()
        assert figures.N_V == 7 * figures.N_IN + 1
        assert figures.depths.sum() == figures.N_V
        assert figures.leaf_sizes @ np.arange(len(figures.leaf_sizes)) == figures.N_OIV


def test_exact_assignment_keeps_a_subset(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    by_box, exact = (
        build("octree", scene, f"{MIXED},max_leaf_size=0,max_depth=4,assignment={a}")
        for a in ("box", "exact")
    )
    boxes, exactly = leaves_of(by_box.built), leaves_of(exact.built)
    for path, inside in exactly.items():
        # An empty octant is not divided further, so leaves of the one may be inner for the other.
        below = [set(each) for p, each in boxes.items() if p[: len(path)] == path]
        assert set(inside) <= set().union(*below)
    assert exact.statistics().N_OIV <= by_box.statistics().N_OIV


def test_full_tree_costs_two_to_the_depth_leaves_per_line(build):
    for depth in (1, 2, 3):
        text = f"padding=0,max_leaf_size=0,max_depth={depth}"
        scene = dense(depth)
        tree = build("octree", scene, text)
        assert len(tree.built.offsets) - 1 == 8**depth
        rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 100_000, depth))
        _, counters = tree.trace(rays, ALL)
        assert_mean(counters["N_ETS"], 2.0**depth)
        assert_mean(counters["N_TS"] - counters["N_ETS"], 2.0**depth - 1)
        assert tree.statistics().expected_leaves == pytest.approx(2**depth, rel=1e-12)


def dense(depth):
    """One triangle within every cell of a full octree of this depth over the unit cube."""
    corners = np.array(list(itertools.product(range(2**depth), repeat=3))) / 2**depth
    small = np.array([[0.2, 0.2, 0.2], [0.8, 0.3, 0.2], [0.3, 0.8, 0.7]]) / 2**depth
    inside = corners[:, None] + small
    ends = np.array(
        [[[0, 0, 0], [1e-3, 0, 0], [0, 1e-3, 0]], [[1, 1, 1], [0.999, 1, 1], [1, 0.999, 1]]]
    )
    return Scene.from_triangles(np.concatenate([inside, ends]), "dense")


def assert_mean(values, expected):
    """Assert that the mean is right within four standard errors."""
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - expected) < 4 * error + 1e-12, (values.mean(), expected, error)


@pytest.mark.parametrize(
    "text",
    ["", "planes=adaptive", "max_depth=5,max_leaf_size=1,assignment=exact", "walk=march",
     "walk=neighbours", "walk=neighbours,links=stored", "walk=heap", "walk=segments"],
)  # fmt: skip
@pytest.mark.parametrize("sample", ["suzanne", "tetra", "soup"])
def test_random_lines_visit_what_the_areas_say(lab, build, sample, text):
    scene = lab.small_scene(sample)
    tree = build("octree", scene, f"padding=0,{text}".rstrip(","))
    figures = tree.statistics()
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 100_000, 3))
    _, counters = tree.trace(rays, ALL)
    assert_mean(counters["N_ETS"], figures.expected_leaves)
    assert_mean(counters["N_IT"], figures.expected_tests)
    assert_mean(counters["N_EETS"], figures.extra["expected_empty"])
    if "march" not in text and "neighbours" not in text:
        assert_mean(counters["N_TS"], figures.expected_inner + figures.expected_leaves)


# ------------------------------------------------------------------------------------ storages


@pytest.mark.parametrize("planes", ["middle", "adaptive"])
def test_all_storages_take_the_same_steps(lab, build, scene_name, planes):
    scene = lab.small_scene(scene_name)
    rays, _, _, _ = lab.truth(scene_name)
    text = f"{MIXED},planes={planes}"
    pointer = build("octree", scene, text)
    hits, counters = pointer.trace(rays)
    for storage in STORAGES:
        other = build("octree", scene, f"{text},storage={storage}")
        assert other.validate() == []
        same, too = other.trace(rays)
        assert np.array_equal(hits.t, same.t)
        assert np.array_equal(hits.primitive, same.primitive)
        assert np.array_equal(counters.values, too.values)
        for i in range(0, len(rays), len(rays) // 20):
            one, two = pointer.record(rays, i), other.record(rays, i)
            assert one.counters == two.counters
            for name in ("kind", "cell", "primitive", "t_enter", "t_exit", "level"):
                assert np.array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("text", [MIXED, "max_depth=0", "max_depth=1,max_leaf_size=0"])
def test_bytes_of_a_storage_are_what_the_statistics_say(build, storage, text):
    tree = build("octree", make_sample("tetra:size=4"), f"{text},storage={storage}")
    extra = tree.statistics().extra
    common = extra["bytes_planes_and_references"]
    # The root's box is six numbers.
    assert tree.memory() == 48 + common + extra[f"bytes_{storage}"]
    assert {f"bytes_{name}" for name in STORAGES} <= set(extra)


def test_implicit_array_is_a_full_tree():
    assert topology_bytes(0, 1, 0)["implicit"] == 4
    assert topology_bytes(1, 8, 1)["implicit"] == 4 * 9 + 8
    assert topology_bytes(9, 64, 2)["implicit"] == 4 * (1 + 8 + 64) + 72


def test_names_of_the_hash_table(build):
    tree = build("octree", make_sample("tetra:size=4"), f"{MIXED},storage=hash").arrays.tree
    assert tree.names[0] == 1
    assert sorted(tree.names[1:9] // 10 * 10 + tree.names[1:9] % 10) == sorted(tree.names[1:9])
    names = set(tree.names.tolist())
    assert len(names) == len(tree.names)
    assert all(name // 10 in names and 1 <= name % 10 <= 8 for name in names - {1})
    assert chain_lengths(tree).sum() == len(tree.names)
    assert len(tree.heads) == table_size(len(tree.names))


def test_chain_length_is_reported(build):
    scene = make_sample("tetra:size=4")
    extra = build("octree", scene, f"{MIXED},storage=hash").statistics().extra
    assert 1.0 <= extra["hash_chain_mean"] <= extra["hash_chain_max"]
    assert "hash_chain_mean" not in build("octree", scene, MIXED).statistics().extra


def test_table_sizes_are_prime():
    for n in (1, 2, 3, 4, 10, 100, 585, 9584, 65536):
        size = table_size(n)
        assert size >= n
        assert all(size % k for k in range(2, int(size**0.5) + 1))


def test_linear_octree_is_sorted(build):
    tree = build("octree", make_sample("tetra:size=4"), f"{MIXED},storage=linear").arrays.tree
    assert (np.diff(tree.codes) > 0).all()
    # Leaves follow each other without a gap: a leaf of level l spans 8^(depth - l) codes.
    spans = 8 ** (tree.depth - tree.levels.astype(np.int64))
    assert np.array_equal(np.cumsum(spans)[:-1], tree.codes[1:])


# -------------------------------------------------------------------------------------- planes


def test_select_finds_every_rank():
    select = getattr(selection.select, "py_func", selection.select)
    rng = np.random.default_rng(1)
    for values in (rng.random(50), rng.integers(0, 3, 41).astype(float), np.ones(7), np.zeros(1)):
        want = np.sort(values)
        for rank in range(len(values)):
            assert select(values.copy(), 0, len(values) - 1, rank) == want[rank]


def test_adaptive_planes_cost_no_more_than_the_middle(lab, build, scene_name):
    """Cell by cell and axis by axis: the middle is among the candidates."""
    scene = lab.small_scene(scene_name)
    tree = build("octree", scene, "max_depth=1,max_leaf_size=0,planes=adaptive,padding=0.01")
    boxes, cell = boxes_of(scene.triangles), tree.built.box

    def cost(axis, plane):
        low, high = cell.copy(), cell.copy()
        low[3 + axis] = high[axis] = plane
        n_low, n_high = (boxes[:, axis] <= plane).sum(), (boxes[:, 3 + axis] >= plane).sum()
        return surface_area(low) * n_low + surface_area(high) * n_high

    for axis in range(3):
        middle = 0.5 * (cell[axis] + cell[3 + axis])
        centres = np.sort(0.5 * (boxes[:, axis] + boxes[:, 3 + axis]))
        median = centres[len(centres) // 2]
        plane = tree.built.planes[0, axis]
        candidates = middle + (median - middle) * np.arange(10) / 9
        assert np.isclose(candidates, plane, rtol=0, atol=1e-12 * np.abs(cell).max()).any()
        best = min(cost(axis, c) for c in candidates)
        assert cost(axis, plane) <= best * (1 + 1e-9)


# ---------------------------------------------------------------------------- when to stop


@pytest.mark.parametrize("order", ["fifo", "priority", "depth_first"])
@pytest.mark.parametrize("budget", [1, 8, 9, 16, 17, 100, 500])
def test_budget_is_kept_and_used(build, order, budget):
    scene = make_sample("tetra:size=5")
    tree = build("octree", scene, f"max_leaf_size=1,budget={budget},order={order}")
    figures = tree.statistics()
    n_nodes = figures.N_IN + figures.N_V
    assert n_nodes <= budget < n_nodes + 8
    assert tree.validate() == []


def test_breadth_first_refines_evenly(build):
    scene = make_sample("tetra:size=6")
    fifo, deep = (
        build("octree", scene, f"max_leaf_size=1,max_depth=9,budget=400,order={order}").statistics()
        for order in ("fifo", "depth_first")
    )
    assert fifo.max_depth < deep.max_depth
    assert fifo.sah < deep.sah


@pytest.mark.parametrize("planes", ["middle", "adaptive"])
def test_orders_agree_without_a_budget(lab, build, scene_name, planes):
    scene = lab.small_scene(scene_name)
    trees = [
        build("octree", scene, f"{MIXED},planes={planes},order={order},budget={budget}").built
        for order in ("depth_first", "fifo", "priority")
        for budget in (0, 10**9)
    ]
    for other in trees[1:]:
        for name in set(other._fields) - {"order"}:
            assert np.array_equal(getattr(trees[0], name), getattr(other, name))


# ------------------------------------------------------------------------------ to be drawn


@pytest.mark.parametrize("order", ["fifo", "priority", "depth_first"])
def test_order_of_building(lab, build, order):
    """A budget for k splits makes just the cells of the first k steps."""
    scene = lab.small_scene("suzanne")
    whole = build("octree", scene, f"{MIXED},order={order}", log=True).cells()
    made = whole.extra["order"]
    assert np.array_equal(np.bincount(made), [1] + [8] * made.max())
    for steps in (0, 1, 2, 17):
        text = f"{MIXED},order={order},budget={1 + 8 * steps}"
        part = build("octree", scene, text, log=True).cells()
        early = made <= steps
        assert np.array_equal(np.unique(part.boxes, axis=0), np.unique(whole.boxes[early], axis=0))
        assert part.extra["order"].max() == steps


@pytest.mark.parametrize("planes", ["middle", "adaptive"])
def test_three_planes_across_every_inner_cell(lab, build, scene_name, planes):
    tree = build("octree", lab.small_scene(scene_name), f"{MIXED},planes={planes}")
    cells = tree.cells()
    inner = np.flatnonzero(~cells.is_leaf)
    assert np.array_equal(cells.planes.owners, np.repeat(inner, 3))
    corners = cells.planes.points.reshape(len(inner), 3, 4, 3)
    low, high = cells.boxes[inner, :3], cells.boxes[inner, 3:]
    for axis in range(3):
        plane = tree.built.planes[cells.numbers[inner], axis]
        assert (corners[:, axis, :, axis] == plane[:, None]).all()
        for other in {0, 1, 2} - {axis}:
            assert np.array_equal(corners[:, axis, :, other].min(axis=1), low[:, other])
            assert np.array_equal(corners[:, axis, :, other].max(axis=1), high[:, other])


def test_links_of_a_leaf(lab, build):
    """One for each face inside the root, to a node right behind it that covers it."""
    tree = build("octree", lab.small_scene("suzanne"), "max_depth=4,max_leaf_size=3")
    boxes, leaves = tree.topology().boxes, tree.topology().leaves
    for leaf in leaves[::50]:
        links = tree.links(leaf)
        assert len(links) == 6 - (boxes[leaf] == boxes[0]).sum()
        # Right behind a face, of which it covers all.
        low = np.maximum(boxes[leaf, :3], boxes[links, :3])
        high = np.minimum(boxes[leaf, 3:], boxes[links, 3:])
        face = np.sort(high - low, axis=1)
        own = [
            np.delete(boxes[leaf, 3:] - boxes[leaf, :3], axis) for axis in (high - low).argmin(1)
        ]
        assert (face[:, 0] == 0.0).all()
        assert np.array_equal(face[:, 1:], np.sort(own, axis=1))
    assert tree.links(0).shape == (0,)


# ----------------------------------------------------------------------------------- bad input


def through_a_point(n=100_000):
    triangles = np.random.default_rng(3).normal(size=(n, 3, 3))
    triangles[:, 0] = 0.25
    return Scene.from_triangles(triangles, "point")


def long_scene():
    rng = np.random.default_rng(4)
    places = rng.random((400, 1, 3)) * [1e6, 1, 1]
    return Scene.from_triangles(places + 0.1 * rng.random((400, 3, 3)), "long")


def sheet():
    """Everything in one plane, which is the middle of the scene's box."""
    x, y = np.meshgrid(np.arange(30.0), np.arange(30.0), indexing="ij")
    p = np.stack([x.ravel(), y.ravel(), np.zeros(900)], axis=1)[:, None]
    lower = p + np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0]])
    upper = p + np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0]])
    ends = np.array([[[0, 0, z], [1, 0, z], [0, 1, z]] for z in (-8.0, 8.0)])
    return Scene.from_triangles(np.concatenate([lower, upper, ends]), "sheet")


HARD = {"point": lambda: through_a_point(300), "long": long_scene, "sheet": sheet}


@pytest.mark.parametrize("make", HARD)
@pytest.mark.parametrize(
    "text",
    ["max_depth=0", "max_depth=60,max_leaf_size=40", "max_depth=4,max_leaf_size=0", "budget=1",
     "max_depth=60,max_leaf_size=40,planes=adaptive", "max_depth=5,padding=0",
     "max_depth=5,overlap=open,padding=0"],
)  # fmt: skip
def test_hard_scenes_come_out_right(lab, build, make, text):
    scene = HARD[make]()
    # Where 300 triangles meet, 40 cannot be separated.
    text = text.replace("=40", "=300") if make == "point" else text
    tree = build("octree", scene, text)
    assert tree.validate() == []
    rays, names = lab.batch_of(lab.ray_families(scene, 60) | lab.wall_rays(tree, 60))
    want, _ = build("naive", scene).trace(rays)
    got, _ = tree.trace(rays)
    assert lab.differences(names, want, got) == {}


def test_no_split_helps_where_all_meet(build):
    """Without a limit the references explode, which is refused with what would help."""
    text = "max_depth=8,assignment=box"
    with pytest.raises(InputError, match=r"octree.*references.*max_depth.*leaf_size.*duplication"):
        build("octree", through_a_point(), text)
    for cure in ("", "max_depth=3", f"{text},duplication=16"):
        assert build("octree", through_a_point(), cure).validate() == []


def test_cells_without_end_are_refused(build):
    with pytest.raises(InputError, match=r"octree.*nodes.*max_depth.*max_leaf_size"):
        build("octree", make_sample("tetra:size=3"), "max_depth=60,max_leaf_size=0")


@pytest.mark.parametrize(("storage", "levels"), [("linear", 20), ("hash", 18)])
def test_a_storage_refuses_trees_deeper_than_its_names(build, storage, levels):
    rng = np.random.default_rng(1)
    # Ever smaller triangles towards a corner make a tree as deep as wanted.
    sizes = 0.5 ** np.arange(30)[:, None, None]
    scene = Scene.from_triangles(sizes * (1 + rng.random((30, 3, 3))), "spiral")
    text = f"max_leaf_size=3,storage={storage}"
    assert build("octree", scene, f"{text},max_depth={levels}").statistics().max_depth == levels
    with pytest.raises(InputError, match=f"storage={storage}.*max_depth"):
        build("octree", scene, f"{text},max_depth=60")


def test_implicit_storage_refuses_what_does_not_fit(build):
    sizes = 0.5 ** np.arange(30)[:, None, None]
    scene = Scene.from_triangles(
        sizes * (1 + np.random.default_rng(1).random((30, 3, 3))), "spiral"
    )
    with pytest.raises(InputError, match=r"storage=implicit.*max_depth"):
        build("octree", scene, "max_leaf_size=3,storage=implicit,max_depth=60")


def test_arrays_are_those_of_the_scene(build):
    scene = make_sample("tetra:size=3")
    assert np.array_equal(build("octree", scene).triangles.corners, scene.items().corners)
