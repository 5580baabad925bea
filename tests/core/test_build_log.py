"""The build log: what it says is what was built, whoever built it."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from accelscope.core import parallel
from accelscope.core.contract.build_log import (
    FIT,
    INSERT,
    MERGE,
    MOVE,
    OBLIQUE,
    REINSERT,
    SPLIT,
)
from accelscope.core.contract.cells import NEVER
from accelscope.core.evaluation.pages.pictures import steps_shown
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structures
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.morton.codes import MortonSettings, codes_of
from accelscope.core.structures.bvh.builders.morton.hlbvh import TREELET_BITS
from accelscope.core.structures.bvh.builders.spatial import sbvh
from accelscope.core.structures.bvh.builders.top_down import parallel_sah, recursion, sweep_sah
from accelscope.core.structures.bvh.hierarchy import BVH
from accelscope.core.structures.bvh.optimisers import OPTIMISERS
from accelscope.core.structures.bvh.topology.tree import ranges_of
from accelscope.sample_scenes import make_sample

MERGING = ("agglomerative", "ploc", "rtree_insert", "rtree_str")
DIVIDING = tuple(name for name in BUILDERS if name not in MERGING)
BY_LEVEL = ("parallel_sah", "lbvh", "lbvh_parallel", "hlbvh")
SUBDIVISIONS = ("kdtree", "octree", "bsp")

SOME = [
    *((builder, "none", "2") for builder in BUILDERS),
    *(("binned_sah", optimiser, "2") for optimiser in OPTIMISERS if optimiser != "none"),
    ("ploc", "reinsert", "2"), ("ploc", "none", "4"), ("sbvh", "treelet", "8"),
]  # fmt: skip
ALL = [
    pytest.param(*each, marks=() if each in SOME else pytest.mark.exhaustive)
    for each in itertools.product(BUILDERS, OPTIMISERS, ("2", "4", "8"))
]


@pytest.fixture(scope="module")
def scene():
    """Triangles of many sizes that overlap: all that builders and optimisers do happens."""
    rng = np.random.default_rng(4)
    size = np.concatenate([np.full(240, 0.1), np.full(40, 0.6), np.full(20, 2.0)])
    corners = rng.random((300, 1, 3)) + size[:, None, None] * rng.random((300, 3, 3))
    return Scene.from_triangles(corners, "muddle")


def built(scene, builder, optimise="none", arity="2", **more):
    settings = BVH.Settings(builder=builder, optimise=optimise, arity=arity, **more)
    return BVH.build(scene, settings, log=True)


def replayed(log):
    """Return the children of every inner node, as a dict, after all events; an own machine."""
    children, parent = {}, {}

    def link(node, pair):
        children[node] = list(pair)
        parent.update(dict.fromkeys(pair, node))

    def put(old, new):
        """Hang a node in the place of another."""
        above = parent.get(old)
        parent[new] = above
        if above is not None:
            children[above] = [new if child == old else child for child in children[above]]

    for kind, node, pair in zip(log.kind.tolist(), log.node.tolist(), log.children.tolist()):
        if kind in (SPLIT, MERGE):
            assert node not in children
            link(node, pair)
        elif kind == MOVE:
            link(node, pair)
        elif kind == REINSERT:
            place, old_sibling = pair
            above = parent[node]
            (sibling,) = set(children[above]) - {node}
            assert sibling == old_sibling
            put(above, sibling)
            put(place, above)
            link(above, (place, node))
    return children


@pytest.mark.parametrize(("builder", "optimise", "arity"), ALL)
def test_the_tree_replayed_from_the_events_is_the_tree(scene, builder, optimise, arity):
    bvh = built(scene, builder, optimise, arity)
    log, children = bvh.build_log, replayed(bvh.build_log)
    cells = log.cells
    assert np.array_equal(np.sort(cells[cells >= 0]), np.arange(len(bvh.arrays.size)))

    def cells_below(name):
        """Return the nearest cells below a node."""
        found = []
        for child in children[name]:
            found += [int(cells[child])] if cells[child] >= 0 else cells_below(child)
        return found

    below_something = {child for pair in children.values() for child in pair}
    (root,) = set(children) - below_something
    assert cells[root] == 0
    width = bvh.width()
    for name in np.flatnonzero(cells >= 0).tolist():
        cell = int(cells[name])
        if width[cell] > 0:
            first = int(bvh.arrays.first[cell])
            assert sorted(cells_below(name)) == list(range(first, first + width[cell]))


@pytest.mark.parametrize("builder", BUILDERS)
def test_events_are_the_nodes(scene, builder):
    bvh = built(scene, builder)
    log, is_inner = bvh.build_log, bvh.arrays.size == 0
    counts = np.bincount(log.kind, minlength=FIT + 1)
    if builder in DIVIDING:
        assert counts[SPLIT] == is_inner.sum() == len(log)
        assert np.array_equal(np.sort(log.cells[log.node]), np.flatnonzero(is_inner))
    else:
        assert counts[MERGE] == len(scene) - 1
        assert counts[INSERT] == (len(scene) if builder == "rtree_insert" else 0)
        made = log.cells[log.node[log.kind == MERGE]]
        several = is_inner | (bvh.arrays.size > 1)
        assert np.array_equal(np.sort(made[made >= 0]), np.flatnonzero(several))
    assert (np.diff(log.step) >= 0).all()
    assert np.array_equal(np.unique(log.step), np.arange(1, log.last_step + 1))
    if builder in DIVIDING and builder not in BY_LEVEL:
        assert log.last_step == is_inner.sum()
    if builder in BY_LEVEL:
        depth = bvh.depths()
        assert np.array_equal(log.step, 1 + depth[log.cells[log.node]])
        assert log.last_step == depth.max()
    if builder == "ploc":
        assert log.last_step == len(bvh.figures["clusters"]) - 1
        assert np.array_equal(np.bincount(log.step)[1:], -np.diff(bvh.figures["clusters"]))


@pytest.mark.parametrize("builder", BUILDERS)
def test_steps_go_down_or_up_and_what_is_there_overlaps_nowhere(scene, builder):
    bvh = built(scene, builder)
    made, replaced = bvh.build_log.steps(bvh.parents())
    below = np.flatnonzero(bvh.parents() >= 0)
    above = bvh.parents()[below]
    if builder in DIVIDING:
        assert made[0] == 0
        assert (made[below] > made[above]).all()
        assert np.array_equal(replaced == NEVER, bvh.arrays.size > 0)
    elif builder == "rtree_insert":
        # Complete with the last of its triangles.
        begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
        last = [bvh.triangles.ids[a:b].max() + 1 for a, b in zip(begin, end)]
        assert np.array_equal(made, last)
    else:
        # What stands between a node of an R-tree and its children is made together with it.
        is_below = np.less_equal if builder == "rtree_str" else np.less
        assert is_below(made[below], made[above]).all()
        assert np.array_equal(np.flatnonzero(replaced == NEVER), [0])
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    for step in (0, 1, 2, made.max() // 2, made.max() - 1, made.max()):
        there = np.flatnonzero((made <= step) & (replaced > step))
        there = there[np.argsort(begin[there])]
        assert (begin[there][1:] >= end[there][:-1]).all()
        if builder in DIVIDING or step == made.max():
            assert begin[there[0]] == 0
            assert end[there[-1]] == len(bvh.triangles.ids)
            assert np.array_equal(begin[there][1:], end[there][:-1])


@pytest.mark.parametrize("builder", ["binned_sah", "lbvh", "sbvh"])
@pytest.mark.parametrize("arity", ["4", "8"])
def test_wide_nodes_have_all_planes_that_cut_them(scene, builder, arity):
    wide, binary = built(scene, builder, arity=arity).cells(), built(scene, builder).cells()
    found, all_of = (cells.planes.points.reshape(-1, 12) for cells in (wide, binary))
    assert np.array_equal(np.unique(found, axis=0), np.unique(all_of, axis=0))
    assert len(found) == len(all_of)
    low, high = np.split(wide.boxes[wide.planes.owners], 2, axis=1)
    corners = wide.planes.points.reshape(-1, 4, 3)
    assert (corners >= low[:, None]).all()
    assert (corners <= high[:, None]).all()
    # Of k children, k - 1 planes, less where a split was by index.
    inner = ~wide.is_leaf
    children = np.bincount(wide.planes.owners, minlength=len(wide))
    assert (children[inner] <= int(arity) - 1).all()
    assert not children[wide.is_leaf].any()


def treelet_boxes(boxes, treelet):
    """Return the boxes around the treelets of HLBVH."""
    groups = [boxes[treelet == each] for each in np.unique(treelet)]
    return np.array([[*g[:, :3].min(axis=0), *g[:, 3:].max(axis=0)] for g in groups])


@pytest.mark.parametrize("builder", DIVIDING)
def test_planes_lie_in_their_cells_and_part_the_children(scene, builder):
    bvh = built(scene, builder)
    log, boxes = bvh.build_log, bvh.arrays.volumes.boxes()
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    whole = boxes_of(scene.triangles)[bvh.triangles.ids]
    parts = whole if bvh.parts is None else bvh.parts
    grain = 1e-12 * np.abs(boxes).max()
    with Team(SILENT, "testing") as team:
        treelet = codes_of(whole, MortonSettings(), team) >> 63 - TREELET_BITS
    assert (log.axis >= 0).sum() > 100
    for axis, position, node, pair in zip(log.axis, log.position, log.node, log.children):
        if axis < 0:
            assert np.isnan(position)
            continue
        assert boxes[node, axis] - grain <= position <= boxes[node, 3 + axis] + grain
        if builder == "phr":
            continue  # planes between clusters: test_phr.py knows those
        left, right = (parts[begin[child] : end[child]] for child in pair)
        if builder == "hlbvh" and len(np.unique(treelet[begin[node] : end[node]])) > 1:
            left, right = (
                treelet_boxes(parts[begin[child] : end[child]], treelet[begin[child] : end[child]])
                for child in pair
            )
        by_centroid = (
            left[:, [axis, 3 + axis]].mean(axis=1).max() <= position + grain
            and right[:, [axis, 3 + axis]].mean(axis=1).min() >= position - grain
        )
        if builder == "sbvh":
            # Or in space, where triangles are left whole if that is cheaper.
            assert by_centroid or left[:, axis].min() < position < right[:, 3 + axis].max()
        else:
            assert by_centroid
    # As polygons: one for each plane, across its cell.
    planes = bvh.cells().planes
    assert len(planes.owners) == (log.axis >= 0).sum()
    corners = planes.points.reshape(-1, 4, 3)
    cells = bvh.cells()
    low, high = np.split(cells.boxes[planes.owners], 2, axis=1)
    assert (corners >= low[:, None]).all()
    assert (corners <= high[:, None]).all()
    flat = (corners.max(axis=1) - corners.min(axis=1) == 0.0).argmax(axis=1)
    axes = cells.extra["split_axis"][planes.owners]
    assert np.array_equal(flat, axes)


@pytest.mark.parametrize("builder", BUILDERS)
def test_counts_and_costs_are_those_of_the_boxes(scene, builder):
    """Cost(V -> {L, R}) reckoned anew from the children's boxes."""
    bvh = built(scene, builder, max_leaf_size=1)
    log, boxes = bvh.build_log, bvh.arrays.volumes.boxes()
    areas = surface_area(boxes)
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    events = np.flatnonzero(np.isin(log.kind, (SPLIT, MERGE)))
    node, children = log.cells[log.node[events]], log.cells[log.children[events]]
    counts, cost = log.counts[events], log.cost[events]
    if builder != "sbvh":  # there, splits further down make more
        assert np.array_equal(counts, (end - begin)[children])
    if builder in MERGING:
        assert cost == pytest.approx(areas[node], rel=1e-14)
        return
    if builder in ("lbvh", "lbvh_parallel"):
        assert np.isnan(cost).all()  # nobody asks for it
        return
    if builder == "hlbvh":  # what is compared there is counted in treelets
        whole = boxes_of(scene.triangles)
        with Team(SILENT, "testing") as team:
            treelet = (
                codes_of(whole, MortonSettings(), team)[bvh.triangles.ids] >> 63 - TREELET_BITS
            )
        counts = np.array(
            [[len(np.unique(treelet[begin[c] : end[c]])) for c in pair] for pair in children]
        )
        several = [len(np.unique(treelet[begin[each] : end[each]])) > 1 for each in node]
        log = replace(log, axis=np.where(several, log.axis, -1))
    settings = bvh.settings
    expected = settings.C_trav + settings.C_isect * (
        (areas[children] * counts).sum(axis=1) / areas[node]
    )
    asked = np.isfinite(cost)
    assert np.array_equal(asked, log.axis[events] >= 0)
    if builder == "sbvh":
        # Exact where nothing was cut: not below, either, since that shrinks the boxes.
        asked &= counts.sum(axis=1) == (end - begin)[node]
        asked &= ((end - begin)[children] == counts).all(axis=1)
        # A spatial split with nothing on both sides has bins for boxes: they may be larger.
        assert (cost[asked] >= expected[asked] * (1.0 - 1e-12)).all()
        assert np.isclose(cost[asked], expected[asked], rtol=1e-12).mean() > 0.8
        return
    assert cost[asked] == pytest.approx(expected[asked], rel=1e-12)


CORES = (parallel, recursion, parallel_sah, sweep_sah, sbvh)


@pytest.mark.parametrize(
    ("builder", "optimise"),
    [
        *((builder, "none") for builder in BUILDERS),
        *(("binned_sah", optimiser) for optimiser in OPTIMISERS if optimiser != "none"),
    ],
)
def test_the_log_does_not_depend_on_the_threads(monkeypatch, builder, optimise):
    scene = make_sample("suzanne:subdivisions=1")
    for module in (recursion, sweep_sah, sbvh):
        monkeypatch.setattr(module, "SUBTREE", 300)
    logs = []
    for cores in (1, 2):
        for module in CORES:
            monkeypatch.setattr(module, "core_count", lambda *_, cores=cores: cores)
        logs.append(built(scene, builder, optimise).build_log)
    one, other = logs
    assert len(one) > 500
    for name in one.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


@pytest.mark.parametrize("optimise", sorted(set(OPTIMISERS) - {"none"}))
def test_moves_are_those_that_were_made(scene, optimise):
    """Their gains add up to what the cost has fallen by, and there are as many as were counted."""
    bvh = built(scene, "lbvh", optimise)
    log, done = bvh.build_log, bvh.rearrangement
    gains = log.cost[np.isin(log.kind, (MOVE, REINSERT))]
    gains = gains[~np.isnan(gains)]
    assert len(gains) == done.made > 10
    assert gains.sum() == pytest.approx(done.costs[0] - done.costs[-1], rel=1e-9)
    assert log.last_step <= log.step[log.kind == SPLIT].max() + len(done.costs) - 1
    made, _ = log.steps(bvh.parents())
    # A node is there when its box has changed for the last time.
    names = np.full(len(made), -1)
    names[log.cells[log.cells >= 0]] = np.flatnonzero(log.cells >= 0)
    for cell in range(len(made)):
        fits = log.step[(log.kind == FIT) & (log.node == names[cell])]
        if len(fits):
            assert made[cell] == fits.max()
    assert bvh.cells().planes is None


def test_a_tree_that_is_not_taken_is_not_in_the_log():
    """Where leaves of several triangles make the rearranged tree dearer, the first one stays."""
    scene = make_sample("soup:count=300,edge=0.3")
    for optimise, builder in itertools.product(sorted(set(OPTIMISERS) - {"none"}), BUILDERS):
        bvh = built(scene, builder, optimise, max_leaf_size=64, C_trav=30.0)
        if not bvh.figures["optimise_pays"]:
            assert not bvh.build_log.is_rearranged
            assert len(replayed(bvh.build_log)) == len(scene) - 1
            return
    pytest.fail("no optimiser has made a tree dearer")


@pytest.mark.parametrize("builder", ["agglomerative", "binned_sah"])
def test_a_branch_that_is_too_deep_is_balanced_in_the_log(builder):
    """Triangles that nest in each other like dolls."""
    size = 1.5 ** np.arange(150.0)
    corners = size[:, None, None] * np.array([[0.0, 0, 0], [1, 0, 0.1], [0.1, 1, 0]])
    scene = Scene.from_triangles(corners, "dolls")
    bvh = built(scene, builder, "none" if builder == "agglomerative" else "rotate")
    log, children = bvh.build_log, replayed(bvh.build_log)
    if builder == "agglomerative":
        assert log.is_rearranged
    for name in np.flatnonzero(log.cells >= 0).tolist():
        cell = log.cells[name]
        if bvh.arrays.size[cell] == 0:
            first = bvh.arrays.first[cell]
            assert sorted(log.cells[children[name]]) == [first, first + 1]


@pytest.mark.parametrize("name", general_structures())
def test_nothing_is_kept_unless_asked(scene, name):
    kind = structures()[name]
    without, asked = (
        kind.build(scene, kind.Settings()),
        kind.build(scene, kind.Settings(), log=True),
    )
    assert without.build_log is None
    cells = without.cells()
    assert cells.replaced is None
    assert "order" not in cells.extra
    told = asked.cells()
    assert (asked.build_log is not None) == ("order" in told.extra) == (told.replaced is not None)
    assert (asked.build_log is not None) == (name in (*SUBDIVISIONS, "bvh", "shafts", "two_level"))
    assert np.array_equal(cells.boxes, told.boxes)
    assert np.array_equal(cells.numbers, told.numbers)


def test_one_triangle_has_an_empty_log():
    scene = Scene.from_triangles(np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 1]]]), "one")
    for builder, optimise in (*((b, "none") for b in BUILDERS), ("ploc", "reinsert")):
        bvh = built(scene, builder, optimise)
        assert not np.isin(bvh.build_log.kind, (SPLIT, MERGE, MOVE, REINSERT)).any()
        cells = bvh.cells()
        assert cells.replaced.tolist() == [NEVER]


@pytest.mark.parametrize("order", ["fifo", "priority", "depth_first"])
@pytest.mark.parametrize("name", SUBDIVISIONS)
def test_subdivisions(scene, name, order):
    kind = structures()[name]
    tree = kind.build(scene, kind.Settings(order=order, max_leaf_size=4), log=True)
    log, nodes, cells = tree.build_log, tree.topology(), tree.cells()
    planes = 3 if name == "octree" else 1
    inner = np.flatnonzero(~nodes.is_leaf)
    assert (log.kind == SPLIT).all()
    assert np.array_equal(np.sort(log.node), inner.repeat(planes))
    assert np.array_equal(log.step, np.arange(1, len(inner) + 1).repeat(planes))
    # Counts: the root has all, a leaf what it lists, and both sides of every plane add up.
    size = np.full(len(nodes.depth), -1)
    size[nodes.is_leaf] = nodes.count[nodes.is_leaf]
    if name != "octree":
        pairs = log.children
        size[pairs.ravel()] = log.counts.ravel()
        assert np.array_equal(size[nodes.is_leaf], nodes.count[nodes.is_leaf])
        assert (log.counts.sum(axis=1)[1:] >= size[log.node[1:]]).all()
        areas = tree.areas(nodes)
        shares = (areas[pairs] * log.counts).sum(axis=1) / areas[log.node]
        expected = tree.settings.C_trav + tree.settings.C_isect * shares
        assert log.cost == pytest.approx(expected, rel=1e-12)
    else:
        assert len(np.unique(log.counts.sum(axis=1).reshape(-1, 3), axis=1).T) >= 1
        sums = log.counts.sum(axis=1).reshape(-1, 3)
        assert (sums == sums[:, :1]).all()
    for axis, position, node, below in zip(log.axis, log.position, log.node, log.children):
        if axis == OBLIQUE:
            assert np.isnan(position)
            continue
        box = nodes.boxes[node]
        assert box[axis] < position < box[3 + axis]
        ends = nodes.boxes[below, axis], nodes.boxes[below, 3 + axis]
        assert position == pytest.approx(ends[0].max(), abs=1e-9)
        assert position == pytest.approx(ends[1].min(), abs=1e-9)
    made = np.empty(len(cells), np.int64)
    made[cells.numbers] = cells.extra["order"]
    for step, node, below in zip(log.step, log.node, log.children):
        assert (made[below] == step).all()
        assert made[node] < step
    if name != "bsp":
        drawn = log.planes(nodes.boxes)
        assert len(drawn.owners) == len(cells.planes.owners) == len(log)


@pytest.mark.parametrize("builder", BUILDERS)
def test_pictures_of_the_building_show_few_cells(scene, builder):
    cells = built(scene, builder).cells()
    steps = steps_shown(cells)
    assert steps == sorted(steps)
    assert steps
    for step in steps:
        there = (cells.extra["order"] <= step) & (cells.replaced > step)
        assert 1 < there.sum() < cells.is_leaf.sum()


@pytest.mark.parametrize("name", ["kdtree", "octree", "bsp"])
def test_what_is_built_at_once_has_no_picture_of_its_building(name):
    kind = structures()[name]
    scene = make_sample("nonuniform")
    assert steps_shown(kind.build(scene, kind.Settings(), log=True).cells()) == []
