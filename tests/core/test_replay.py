"""Moves of an optimiser made again: they lead from the tree as built to the finished one."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.optimisers import OPTIMISERS
from accelscope.core.structures.bvh.optimisers import replay as replay_module
from accelscope.core.structures.bvh.optimisers.replay import Replay

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
