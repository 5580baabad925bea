"""Lesson "reinsertion": the moves are those of the log with the greatest gains."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import REINSERT
from accelscope.core.errors import InputError
from accelscope.core.geometry.box_shape import box_segments, surface_area
from accelscope.core.lessons.drawing import GREEN, ORANGE, RED
from accelscope.core.lessons.moves import MOST_MOVES, union
from accelscope.core.lessons.reinsertion import OPTIMISERS, Reinsertions, Settings, suits
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.topology.build_log import tree_as_built


@pytest.mark.parametrize("optimise", OPTIMISERS)
def test_reinsertions_that_are_shown(muddle, build, optimise):
    bvh = build("bvh", muddle, f"builder=lbvh,optimise={optimise}", log=True)
    assert suits(bvh) == ""
    log, play = bvh.build_log, Reinsertions(bvh, bvh.build_log, SILENT)
    gains = log.cost[log.kind == REINSERT]
    assert len(gains) == bvh.rearrangement.made
    shown = np.argsort(-gains, kind="stable")[:MOST_MOVES]
    assert play.ends == {"move": len(shown) - 1}
    nodes = log.node[log.kind == REINSERT]
    boxes = tree_as_built(log, bvh.reference_boxes()).boxes
    known = {int(name) for name in log.leaves}
    root = surface_area(bvh.arrays.volumes.boxes()[0])
    for place, (number, move) in enumerate(zip(shown.tolist(), play.moves, strict=True)):
        # Whoever was cut off and its sibling had their parent's box to fill.
        assert np.array_equal(union(move.node, move.old_sibling), move.old_parent)
        new_parent = union(move.node, move.new_sibling)
        pictures = [play.picture(Settings(place, is_after)) for is_after in (False, True)]
        parents = (move.old_parent, RED), (new_parent, GREEN)
        for picture, verb, (box, colour) in zip(
            pictures, ("will fall", "fell"), parents, strict=True
        ):
            assert picture.caption.startswith(f"Reinsertion {number + 1} of {len(gains)}, ")
            assert picture.caption.endswith(f"The cost {verb} by {gains[number]:.3g}")
            assert f"{100.0 * surface_area(box) / root:.3g}% of the root" in picture.caption
            drawn = picture.segments[(picture.colours == colour).all(axis=1)]
            assert np.array_equal(drawn[:12], box_segments(box[None]))
        if nodes[number] in known:  # the box of a leaf is always the same
            moved = box_segments(boxes[nodes[number]][None])
            orange = (pictures[0].colours == ORANGE).all(axis=1)
            assert np.array_equal(pictures[0].segments[orange][:12], moved)


def test_a_tree_that_was_not_kept_has_no_moves_to_show(lab, build):
    scene = lab.small_scene("teapot_in_stadium")
    bvh = build("bvh", scene, "max_leaf_size=16,C_trav=3,optimise=reinsert", log=True)
    assert not bvh.figures["optimise_pays"]
    with pytest.raises(InputError, match="nothing of this tree was moved"):
        Reinsertions(bvh, bvh.build_log, SILENT)
    assert "not rearranged by" in suits(build("bvh", scene, "optimise=rotate", log=True))
