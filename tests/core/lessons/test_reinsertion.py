"""Lesson "reinsertion": the moves are those of the log with the greatest gains."""

import functools

import numpy as np
import pytest
from accelscope.core.contract.build_log import REINSERT
from accelscope.core.errors import InputError
from accelscope.core.geometry.box_shape import box_segments, surface_area
from accelscope.core.lessons.drawing import BLUE, GREEN, GREY, ORANGE, RED
from accelscope.core.lessons.moves import MOST_MOVES, union
from accelscope.core.lessons.reinsertion import OPTIMISERS, Reinsertions, Settings, suits
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.topology.build_log import tree_as_built


class Linked:
    """A tree as it was built, whose reinsertions are made by the words of the log's contract."""

    def __init__(self, tree):
        self.boxes, self.parent = tree.boxes, tree.parent.tolist()
        self.children = np.stack([tree.left, tree.right], axis=1).tolist()

    def box(self, node):
        """The box around all leaves below a node."""
        below = [child for child in self.children[node] if child >= 0]
        return functools.reduce(union, map(self.box, below)) if below else self.boxes[node]

    def put(self, node, place, above):
        """Let a node take the place of another below a third, which may be none."""
        if above >= 0:
            self.children[above] = [node if c == place else c for c in self.children[above]]
        self.parent[node] = above

    def cut_off(self, node):
        """Cut a node off; its sibling takes the place of the parent, and is returned."""
        parent = self.parent[node]
        (sibling,) = (child for child in self.children[parent] if child != node)
        self.put(sibling, parent, self.parent[parent])
        return sibling

    def hang(self, node, sibling):
        """Hang a node that was cut off beside a sibling, below the parent that went with it."""
        parent = self.parent[node]
        self.put(parent, sibling, self.parent[sibling])
        self.children[parent], self.parent[sibling] = [sibling, node], parent


def reinsertions_of(log, boxes, shown):
    """Of some reinsertions: node, old parent, old sibling, and new sibling while it is cut off."""
    linked, found = Linked(tree_as_built(log, boxes)), {}
    events = np.flatnonzero(log.kind == REINSERT).tolist()
    for number, event in enumerate(events[: max(shown) + 1]):
        node, (new, old) = int(log.node[event]), log.children[event].tolist()
        before = [linked.box(each) for each in (node, linked.parent[node], old)]
        assert linked.cut_off(node) == old
        if number in shown:
            found[number] = *before, linked.box(new)
        linked.hang(node, new)
    return found


@pytest.mark.parametrize("optimise", OPTIMISERS)
def test_reinsertions_that_are_shown(muddle, build, optimise):
    bvh = build("bvh", muddle, f"builder=lbvh,optimise={optimise}", log=True)
    assert suits(bvh) == ""
    log, play = bvh.build_log, Reinsertions(bvh, bvh.build_log, SILENT)
    gains = log.cost[log.kind == REINSERT]
    assert len(gains) == bvh.rearrangement.made
    shown = np.argsort(-gains, kind="stable")[:MOST_MOVES]
    assert play.ends == {"move": len(shown) - 1}
    found = reinsertions_of(log, bvh.reference_boxes(), shown.tolist())
    root = surface_area(bvh.arrays.volumes.boxes()[0])
    for place, (number, move) in enumerate(zip(shown.tolist(), play.moves, strict=True)):
        boxes = move.node, move.old_parent, move.old_sibling, move.new_sibling
        assert np.array_equal(boxes, found[number])
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
            for box, other in (
                (move.node, ORANGE), (move.old_sibling, GREY), (move.new_sibling, BLUE)
            ):  # fmt: skip
                drawn = picture.segments[(picture.colours == other).all(axis=1)]
                assert np.array_equal(drawn[:12], box_segments(box[None]))


def test_a_tree_that_was_not_kept_has_no_moves_to_show(lab, build):
    scene = lab.small_scene("teapot_in_stadium")
    bvh = build("bvh", scene, "max_leaf_size=16,C_trav=3,optimise=reinsert", log=True)
    assert not bvh.figures["optimise_pays"]
    with pytest.raises(InputError, match="nothing of this tree was moved"):
        Reinsertions(bvh, bvh.build_log, SILENT)
    assert "not rearranged by" in suits(build("bvh", scene, "optimise=rotate", log=True))
