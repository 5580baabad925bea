"""Exhibits of the building show what was built: asserted against the log, the tree, the builder."""

import itertools

import numpy as np
import pytest
from accelscope.core.contract.build_log import FIT, MERGE, MOVE, REINSERT, SPLIT
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import box_segments, surface_area
from accelscope.core.lessons import exhibits_left_out, exhibits_of
from accelscope.core.lessons import rearranging as lesson
from accelscope.core.lessons.drawing import BLUE, GREEN, ORANGE
from accelscope.core.lessons.ploc import take_snapshots
from accelscope.core.lessons.sbvh import descent_of, side_of
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.bottom_up import ploc
from accelscope.core.structures.bvh.builders.morton.codes import sort_by_code
from accelscope.core.structures.bvh.builders.spatial.sbvh import Construction
from accelscope.core.structures.bvh.optimisers import OPTIMISERS
from accelscope.core.structures.bvh.optimisers import replay as replay_module
from accelscope.core.structures.bvh.optimisers.replay import Replay
from accelscope.core.structures.bvh.topology.build_log import tree_as_built
from accelscope.core.structures.bvh.topology.tree import Primitives, leaves_only

OPTIMISING = sorted(set(OPTIMISERS) - {"none"})


@pytest.fixture(scope="module")
def scene():
    """Triangles of many sizes that overlap: all that builders and optimisers do happens."""
    rng = np.random.default_rng(4)
    size = np.concatenate([np.full(240, 0.1), np.full(40, 0.6), np.full(20, 2.0)])
    corners = rng.random((300, 1, 3)) + size[:, None, None] * rng.random((300, 3, 3))
    return Scene.from_triangles(corners, "muddle")


def built(scene, builder, optimise="none", **more):
    settings = BVH.Settings(builder=builder, optimise=optimise, **more)
    return BVH.build(scene, settings, log=True)


def rearranged(scene, builder, optimise):
    """Return a tree whose moves were kept: with leaves of several triangles, or else of one."""
    bvh = built(scene, builder, optimise)
    return bvh if bvh.figures["optimise_pays"] else built(scene, builder, optimise, max_leaf_size=1)


def exhibit_of(bvh, name):
    return next(each for each in exhibits_of(bvh) if each.name == name)


def segments_in(frame, colour):
    return frame.segments[(frame.colours == colour).all(axis=1)]


def test_without_a_log_there_are_none_and_it_is_said(scene):
    settings = BVH.Settings(builder="ploc", optimise="reinsert")
    without, asked = BVH.build(scene, settings), BVH.build(scene, settings, log=True)
    names, all_names = ({each.name for each in exhibits_of(bvh)} for bvh in (without, asked))
    assert all_names - names == {
        "radix_sort", "radix_2_split", "ploc_clusters", "cost_over_steps", "reinsertions",
    }  # fmt: skip
    assert exhibits_left_out(asked) == ""
    assert "no log" in exhibits_left_out(without)


# ------------------------------------------------------------------------------------- moves


@pytest.mark.parametrize(
    ("builder", "optimise"),
    [*itertools.product(BUILDERS, ["treelet"]), *itertools.product(["hlbvh"], OPTIMISING)],
)
def test_the_moves_of_the_log_lead_from_the_tree_as_built_to_the_finished_one(
    monkeypatch, scene, builder, optimise
):
    monkeypatch.setattr(replay_module, "EVENTS_AT_ONCE", 3)
    bvh = rearranged(scene, builder, optimise)
    log = bvh.build_log
    replay = Replay(log, bvh.reference_boxes())
    parent, boxes = replay.tree.parent.copy(), replay.tree.boxes.copy()
    assert (replay.gains > 0.0).all()
    assert len(replay.gains) == bvh.rearrangement.made > 0
    replay.go_on(len(replay.node), SILENT, "")
    there = np.flatnonzero(log.cells >= 0)
    cells = log.cells[there]
    assert np.array_equal(replay.tree.boxes[there], bvh.arrays.volumes.boxes()[cells])
    above = replay.tree.parent[there]
    assert np.array_equal(np.where(above < 0, -1, log.cells[above]), bvh.parents()[cells])
    # It began as a tree that was not rearranged.
    plain = built(scene, builder, max_leaf_size=1)
    assert np.array_equal(np.sort(boxes, axis=0), np.sort(plain.arrays.volumes.boxes(), axis=0))
    assert (parent != replay.tree.parent).any()


def test_boxes_are_those_that_the_builder_had(lab):
    """Triangles without an area have other corners in the copies that walks test."""
    bvh = rearranged(lab.small_scene("mess"), "lbvh", "reinsert")
    replay = Replay(bvh.build_log, bvh.reference_boxes())
    replay.go_on(len(replay.node), SILENT, "")
    there = np.flatnonzero(bvh.build_log.cells >= 0)
    boxes = bvh.arrays.volumes.boxes()[bvh.build_log.cells[there]]
    assert np.array_equal(replay.tree.boxes[there], boxes)


@pytest.mark.parametrize("optimise", OPTIMISING)
@pytest.mark.parametrize(
    "builder",
    ["ploc", *(pytest.param(name, marks=pytest.mark.exhaustive) for name in ("lbvh", "sbvh"))],
)
def test_every_move_gains_what_the_log_says(scene, builder, optimise):
    """The areas of all inner nodes, added up before and after it."""
    bvh = rearranged(scene, builder, optimise)
    replay = Replay(bvh.build_log, bvh.reference_boxes())
    inner = np.flatnonzero(replay.tree.left >= 0)
    root = surface_area(replay.tree.boxes[replay.tree.parent < 0])[0]
    before = surface_area(replay.tree.boxes[inner]).sum()
    for (_, behind), gain in zip(replay.moves, replay.gains, strict=True):
        replay.go_on(int(behind), SILENT, "")
        after = surface_area(replay.tree.boxes[inner]).sum()
        fall = bvh.settings.C_trav * (before - after) / root
        assert gain == pytest.approx(fall, abs=1e-12 * before / root)
        before = after


@pytest.mark.parametrize("optimise", ["reinsert", "reinsert_parallel", "reinsert_batches"])
def test_reinsertions_that_are_shown(scene, optimise):
    bvh = built(scene, "lbvh", optimise)
    log = bvh.build_log
    gains = log.cost[log.kind == REINSERT]
    assert len(gains) == bvh.rearrangement.made
    exhibit = exhibit_of(bvh, "reinsertions")
    shown = np.argsort(-gains, kind="stable")[: lesson.MOST_MOVES]
    assert exhibit.count == 2 * len(shown)
    nodes = log.node[log.kind == REINSERT]
    boxes = tree_as_built(log, bvh.reference_boxes()).boxes
    known = {int(name) for name in log.leaves}
    for place, number in enumerate(shown.tolist()):
        before, after = (exhibit.frame(2 * place + i) for i in range(2))
        for frame, verb in ((before, "will fall"), (after, "fell")):
            assert frame.caption.startswith(f"Reinsertion {number + 1} of {len(gains)}, ")
            assert frame.caption.endswith(f"The cost {verb} by {gains[number]:.3g}")
        assert len(segments_in(after, GREEN)) == 24
        if nodes[number] in known:  # the box of a leaf is always the same
            moved = box_segments(boxes[nodes[number]][None])
            assert np.array_equal(segments_in(before, ORANGE)[:12], moved)
    parts = lesson.replayed(bvh, log, lesson.look_at_reinsertion, SILENT)
    for move in parts:
        # Whoever was cut off and its sibling had their parent's box to fill.
        assert np.array_equal(lesson.union(move.node, move.old_sibling), move.old_parent)


@pytest.mark.parametrize("optimise", ["treelet", "treelet_agglomerative"])
def test_treelets_that_are_shown(scene, optimise):
    bvh = built(scene, "lbvh", optimise)
    log = bvh.build_log
    gains = log.cost[log.kind == MOVE]
    gains = gains[~np.isnan(gains)]
    exhibit = exhibit_of(bvh, "treelets")
    shown = np.argsort(-gains, kind="stable")[: lesson.MOST_MOVES]
    assert exhibit.count == 2 * len(shown)
    root = surface_area(bvh.arrays.volumes.boxes()[0])
    moves = lesson.replayed(bvh, log, lesson.look_at_treelet, SILENT)
    for place, (number, move) in enumerate(zip(shown.tolist(), moves, strict=True)):
        assert (move.number, move.gain) == (number, gains[number])
        count, sums = len(move.leaves), []
        for children in move.children:
            numbers = [*range(count), *range(count + 1, 2 * count - 1)]
            assert sorted(children.ravel().tolist()) == numbers
            sums.append(surface_area(lesson.boxes_of_treelet(move.leaves, children))[count:].sum())
        fall = bvh.settings.C_trav * (sums[0] - sums[1]) / root
        assert fall == pytest.approx(move.gain, rel=1e-9)
        for i in range(2):
            start = f"Treelet {number + 1} of {len(gains)}, "
            assert exhibit.frame(2 * place + i).caption.startswith(start)


def test_a_tree_that_was_not_kept_has_no_moves_to_show(lab, build):
    bvh = build(
        "bvh", lab.small_scene("teapot_in_stadium"), "max_leaf_size=16,C_trav=3,optimise=reinsert",
        log=True,
    )  # fmt: skip
    assert not bvh.figures["optimise_pays"]
    assert "reinsertions" not in {each.name for each in exhibits_of(bvh)}
    assert exhibit_of(bvh, "cost_over_steps").frame(0).caption.endswith("and was kept")


# --------------------------------------------------------------------------------- clusters


@pytest.mark.parametrize("optimise", ["none", "reinsert", "treelet"])
def test_the_clusters_shown_are_those_of_every_iteration(scene, optimise):
    bvh = built(scene, "ploc", optimise)
    shots = take_snapshots(bvh, bvh.build_log, SILENT)
    boxes = boxes_of(scene.triangles)
    with Team(SILENT, "testing") as team:
        _, order = sort_by_code(boxes, 63, team)
        tree = leaves_only(boxes[order])
        assert np.array_equal(shots[0].boxes, boxes[order])
        made = len(boxes)
        for shot, nodes in zip(shots[1:], ploc.iterations(tree, 14, team), strict=True):
            assert np.array_equal(shot.boxes, tree.boxes[nodes])
            assert np.array_equal(shot.is_new, nodes >= made)
            assert shot.total == len(nodes)
            made += int(shot.is_new.sum())
    assert [shot.total for shot in shots] == bvh.figures["clusters"]
    assert (bvh.build_log.kind == MERGE).sum() == len(boxes) - 1


# --------------------------------------------------------------------------- spatial splits


def splits_one_by_one(scene, settings):
    """Yield of every split, breadth-first, what went to either side, from the builder itself."""
    work = Construction(Primitives(scene.geometry, scene.boxes()), settings)
    waiting = [work.root]
    while waiting:
        node = waiting.pop(0)
        children = work.split(node)
        waiting += children
        if children:
            sides = []
            for child in children:
                these = slice(child.first, child.first + child.size)
                ids = work.references.triangle[these]
                order = np.argsort(ids)
                sides.append((ids[order], work.references.boxes[these][order]))
            yield node.size, sides


@pytest.mark.parametrize(("optimise", "arity"), [("none", "2"), ("none", "4"), ("reinsert", "2")])
def test_spatial_splits_that_are_shown(scene, optimise, arity):
    bvh = built(scene, "sbvh", optimise, arity=arity)
    log, descent = bvh.build_log, descent_of(bvh.build_log, len(scene))
    events = np.flatnonzero(log.kind == SPLIT)
    settings = bvh.settings
    if optimise != "none":
        settings = BVH.Settings(builder="sbvh", max_leaf_size=1)
    exhibit, frames = exhibit_of(bvh, "spatial_splits"), 0
    witness = list(splits_one_by_one(scene, settings))
    assert len(witness) == len(events)
    for event, (size, sides) in zip(events, witness, strict=True):
        assert descent.size[log.node[event]] == size
        assert log.counts[event].tolist() == [len(ids) for ids, _ in sides]
        for child, (ids, boxes) in zip(log.children[event], sides, strict=True):
            found, around = side_of(bvh, log, descent, int(child))
            assert np.array_equal(found, ids)
            # Parts of a triangle leave out what of its box has none of it, and rounding.
            assert (around[:, :3] >= boxes[:, :3]).all()
            assert (around[:, 3:] <= boxes[:, 3:]).all()
            np.testing.assert_allclose(around, boxes, atol=1e-9)
        if log.counts[event].sum() > size and frames < exhibit.count:
            frame = exhibit.frame(frames)
            both = len(np.intersect1d(sides[0][0], sides[1][0]))
            assert both == log.counts[event].sum() - size
            axis, position = log.axis[event], log.position[event]
            green = segments_in(frame, GREEN)[:4]
            assert (green[..., axis] == position).all()
            text = f"divides {size} references into {len(sides[0][0])} (blue) and "
            assert text in frame.caption
            assert f"{len(sides[1][0])} (orange); {both} triangle" in frame.caption
            for (_, boxes), colour in zip(sides, (BLUE, ORANGE), strict=True):
                outer = np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])
                ends = segments_in(frame, colour)[:12].reshape(-1, 3)
                drawn = np.concatenate([ends.min(axis=0), ends.max(axis=0)])
                np.testing.assert_allclose(drawn, outer, atol=1e-9)
            frames += 1
    assert frames == exhibit.count > 0
    assert not (log.kind == FIT).any() or optimise != "none"
