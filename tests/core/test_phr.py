"""PHR: its cuts by definition, and the trees that it is at both ends of its settings."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.lessons.phr import first_splits
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.morton import phr
from accelscope.core.structures.bvh.topology.tree import Primitives, ranges_of
from accelscope.sample_scenes import make_sample

SCENES = ("suzanne", "soup", "mess", "flat", "one")


def grouping_of(builder, triangles, *, log=False, **changes):
    settings = dataclasses.replace(BVHSettings(), **changes)
    primitives = Primitives(all_triangles(triangles), boxes_of(triangles))
    return BUILDERS[builder].build(primitives, settings, SILENT, log)


def groups_of(grouping):
    """Return the triangles below every node, as a set of sets."""
    tree = grouping.tree
    begin, end = ranges_of(tree.first, tree.size, np.where(tree.size > 0, 0, 2))
    return {frozenset(grouping.order[a:b].tolist()) for a, b in zip(begin, end, strict=True)}


# --------------------------------------------------------------------- the ends of its settings


@pytest.mark.parametrize(
    "changes",
    [{}, {"max_leaf_size": 1, "bins": 5}, {"axis": "round_robin", "morton_bits": "30"}],
)
@pytest.mark.parametrize("name", SCENES)
def test_with_everything_opened_it_is_binned_sah_node_by_node(lab, name, changes):
    """A cut of single triangles is what that divides; in which order they are does not matter."""
    triangles = lab.small_scene(name).triangles
    mine = grouping_of("phr", triangles, cut_delta=1024.0, log=True, **changes)
    theirs = grouping_of("binned_sah", triangles, log=True, **changes)
    for a, b in zip(mine.tree, theirs.tree, strict=True):
        assert np.array_equal(a, b)
    boxes = boxes_of(triangles)
    for first, size in zip(mine.tree.first, mine.tree.size, strict=True):
        # Of triangles with the same box it may be either.
        a, b = (sorted(boxes[each.order[first : first + size]].tolist()) for each in (mine, theirs))
        assert a == b
    for column in ("axis", "position", "cost", "counts"):
        a, b = (getattr(each.log(), column) for each in (mine, theirs))
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", ["suzanne", "soup", "flat", "one"])
def test_with_nothing_opened_it_is_lbvh(lab, name):
    """Every cut is a single cluster, which has its two children in the end.

    Where those have the same centre, as in scenes of cubes or of equal triangles, all is opened.
    """
    triangles = lab.small_scene(name).triangles
    changes = {"max_leaf_size": 1, "cut_alpha": 0.0, "cut_delta": 0.0}
    mine, theirs = (grouping_of(b, triangles, **changes) for b in ("phr", "lbvh"))
    assert groups_of(mine) == groups_of(theirs)


def test_the_settings_of_the_paper_lie_between(lab):
    """In cost, too: the finer the cut, the nearer to what all triangles would give."""
    scene = make_sample("suzanne:subdivisions=2")
    costs = []
    for alpha, delta in ((0.0, 0.0), (0.5, 6.0), (0.55, 9.0), (0.0, 1024.0)):
        tree = grouping_of(
            "phr", scene.triangles, max_leaf_size=1, cut_alpha=alpha, cut_delta=delta
        ).tree
        costs.append(float(surface_area(tree.boxes).sum() / surface_area(tree.boxes[:1])[0]))
    assert costs == sorted(costs, reverse=True)
    assert costs[2] < costs[3] + 0.1 * (costs[0] - costs[3])


# ------------------------------------------------------------------------- cuts by definition


def highest_not_larger(auxiliary, clusters, threshold):
    """Return the highest nodes below some clusters that are leaves or not larger."""
    found, pending = [], list(clusters)
    areas = surface_area(auxiliary.boxes)
    while pending:
        node = pending.pop()
        if auxiliary.size[node] > 0 or areas[node] <= threshold:
            found.append(node)
        else:
            pending += [auxiliary.first[node], auxiliary.first[node] + 1]
    if len(found) == 1 and auxiliary.size[found[0]] == 0:
        found = [auxiliary.first[found[0]], auxiliary.first[found[0]] + 1]
    return sorted(found)


def cheapest_by_definition(boxes, counts, bins):
    """Return the least SA(L) N_L + SA(R) N_R of clusters at the borders of bins; boxes (k, 6)."""
    centres = boxes[:, :3] + boxes[:, 3:]
    bins = min(bins, 4 + len(boxes))
    least = np.inf
    for axis in range(3):
        low, extent = centres[:, axis].min(), np.ptp(centres[:, axis])
        if extent == 0.0:
            continue
        number = ((centres[:, axis] - low) * (bins * (1.0 - 1e-6) / extent)).astype(int)
        for border in range(1, bins):
            left = number < border
            if left.any() and not left.all():
                cost = 0.0
                for side in (left, ~left):
                    low_side, high_side = boxes[side, :3].min(axis=0), boxes[side, 3:].max(axis=0)
                    around = np.concatenate([low_side, high_side])
                    cost += surface_area(around[None])[0] * counts[side].sum()
                least = min(least, cost)
    return least


@pytest.mark.parametrize(("alpha", "delta"), [(0.5, 6.0), (0.2, 3.0), (1.5, 2.0)])
@pytest.mark.parametrize("name", ["suzanne", "soup", "mess"])
def test_cuts_and_splits_are_those_of_the_definition(lab, name, alpha, delta):
    triangles = lab.small_scene(name).triangles
    changes = {"max_leaf_size": 1, "cut_alpha": alpha, "cut_delta": delta, "bins": 8}
    settings = dataclasses.replace(BVHSettings(), **changes)
    grouping = grouping_of("phr", triangles, log=True, **changes)
    log, boxes = grouping.log(), boxes_of(triangles)
    auxiliary = phr.auxiliary_tree(Primitives(None, boxes.copy()), settings, SILENT)
    sizes = auxiliary.end - auxiliary.begin
    surface = surface_area(auxiliary.boxes[:1])[0]
    begin, end = ranges_of(
        grouping.tree.first, grouping.tree.size, np.where(grouping.tree.size > 0, 0, 2)
    )
    splits = first_splits(auxiliary, settings, log, SILENT)
    assert splits[0].before.tolist() == [0]
    assert len(splits) == min(100, len(log))
    for event, split in enumerate(splits):
        threshold = surface * 2.0 ** -(alpha * split.depth + delta)
        after = np.concatenate([split.left, split.right])
        if log.axis[event] < 0:
            threshold = -1.0  # nothing tells them apart: all are opened
        assert sorted(after) == highest_not_larger(auxiliary, split.before, threshold)
        # The children of the tree have the triangles of the clusters on their side.
        for clusters, child in zip(
            (split.left, split.right), log.cells[log.children[event]], strict=True
        ):
            inside = np.concatenate(
                [auxiliary.order[auxiliary.begin[c] : auxiliary.end[c]] for c in clusters]
            )
            there = grouping.order[begin[child] : end[child]]
            assert np.array_equal(np.sort(inside), np.sort(there))
        assert log.counts[event].tolist() == [sizes[split.left].sum(), sizes[split.right].sum()]
        # The plane parts the centres of the clusters, and none is cheaper.
        axis, position = log.axis[event], log.position[event]
        least = cheapest_by_definition(auxiliary.boxes[after], sizes[after], 8)
        assert (axis >= 0) == np.isfinite(least)
        if axis < 0:
            continue
        centres = auxiliary.boxes[:, [axis, 3 + axis]].mean(axis=1)
        grain = 1e-12 * np.abs(auxiliary.boxes[0]).max()
        assert centres[split.left].max() <= position + grain
        assert centres[split.right].min() >= position - grain
        node = surface_area(grouping.tree.boxes[[log.cells[log.node[event]]]])[0]
        cost = settings.C_trav + settings.C_isect * least / node
        assert log.cost[event] == pytest.approx(cost, rel=1e-12)


# -------------------------------------------------------------------------------- awkward input


@pytest.mark.parametrize("delta", [0.0, 6.0, 1024.0])
def test_clusters_that_nothing_tells_apart_and_too_deep_branches(build, delta):
    size = 1.5 ** np.arange(300.0)
    doll = np.array([[-1.0, -1, -1], [1, -1, 0], [0, 2, 1]])
    scenes = {
        "identical": np.tile(doll, (70, 1, 1)),
        "dolls": doll * size[:, None, None],
        "towards a point": (doll + 3.0) * 0.5 ** np.arange(200)[:, None, None],
        "points": np.repeat(np.random.default_rng(1).random((50, 1, 3)), 3, axis=1),
        "a line": np.arange(90.0)[:, None, None] * [1, 0, 0] + [[0, 0, 0], [1, 0, 0], [2, 0, 0]],
    }
    for name, triangles in scenes.items():
        scene = Scene.from_triangles(np.concatenate([triangles, doll[None]]), name)
        for leaf in (1, 4, 1024):
            text = f"builder=phr,cut_delta={delta},max_leaf_size={leaf}"
            built = build("bvh", scene, text)
            assert built.validate() == [], name
            assert np.array_equal(np.sort(built.triangles.ids), np.arange(len(scene)))
