"""Lessons "treelets" and "rotations": the same leaves in another tree, which gains what is said."""

import numpy as np
import pytest
from accelscope.core.contract.build_log import MOVE
from accelscope.core.geometry.box_shape import box_segments, surface_area
from accelscope.core.lessons.drawing import GREEN, GREY, RED
from accelscope.core.lessons.moves import MOST_MOVES
from accelscope.core.lessons.treelets import Settings, Treelets, boxes_of_treelet
from accelscope.core.progress import SILENT


def check_tree(chart, colour, boxes, children):
    """Assert that every node of a treelet that is drawn as a tree is as high as it is large."""
    count = len(children) + 1
    heights = surface_area(boxes) / surface_area(boxes[count])
    # To each of two children there is a way across and a way down.
    ways = chart.lines(colour).reshape(count - 1, 2, 2, 2, 2)
    (begin, corner), (above, end) = np.moveaxis(ways, (2, 3), (0, 1))
    np.testing.assert_allclose(corner, above)
    np.testing.assert_allclose(begin[:, :, 1], np.repeat(heights[count:, None], 2, axis=1))
    np.testing.assert_allclose(above[:, :, 1], begin[:, :, 1])
    np.testing.assert_allclose(end[:, :, 1], heights[children], atol=1e-9)
    # Each stands above the middle of its children.
    x = np.empty(2 * count - 1)
    x[count], x[children] = begin[0, 0, 0], end[:, :, 0]
    np.testing.assert_allclose(x[count:], x[children].mean(axis=1), atol=1e-9)
    leaves = chart.lines(GREY)[2::4, 1]  # behind the axes, before the arms of each star
    np.testing.assert_allclose(leaves, np.stack([x, heights], axis=1)[:count], atol=1e-9)


@pytest.mark.parametrize("optimise", ["treelet", "treelet_agglomerative", "rotate"])
def test_moves_that_are_shown(muddle, build, read_charts, optimise):
    bvh = build("bvh", muddle, f"builder=lbvh,optimise={optimise}", log=True)
    log, play = bvh.build_log, Treelets(bvh, bvh.build_log, SILENT, "Move")
    gains = log.cost[log.kind == MOVE]
    gains = gains[~np.isnan(gains)]
    shown = np.argsort(-gains, kind="stable")[:MOST_MOVES]
    assert play.ends == {"move": len(shown) - 1}
    root = surface_area(bvh.arrays.volumes.boxes()[0])
    sizes = set()
    for place, (number, move) in enumerate(zip(shown.tolist(), play.moves, strict=True)):
        assert (move.number, move.gain) == (number, gains[number])
        count, sums, roots = len(move.leaves), [], []
        sizes.add(count)
        for is_after, children in enumerate(move.children):
            # Every node but the root hangs below exactly one, and parents come first.
            numbers = [*range(count), *range(count + 1, 2 * count - 1)]
            assert sorted(children.ravel().tolist()) == numbers
            assert (children < count).any()
            inner = children - count
            assert all((inner[k][inner[k] >= 0] > k).all() for k in range(count - 1))
            boxes = boxes_of_treelet(move.leaves, children)
            sums.append(surface_area(boxes)[count:].sum())
            roots.append(boxes[count])
            (chart,) = read_charts(play, Settings(place, bool(is_after)))
            check_tree(chart, GREEN if is_after else RED, boxes, children)
            picture = chart.picture
            assert picture.caption.startswith(f"Move {number + 1} of {len(gains)}, ")
            colour = GREEN if is_after else RED
            drawn = picture.segments[(picture.colours == colour).all(axis=1)]
            below = box_segments(boxes[count + 1 :])
            assert np.array_equal(drawn[: len(below)], below)
        assert np.array_equal(*roots)
        fall = bvh.settings.C_trav * (sums[0] - sums[1]) / root
        assert fall == pytest.approx(move.gain, rel=1e-9)
    # A child with a grandchild, or two grandchildren.
    assert sizes <= {3, 4} if optimise == "rotate" else max(sizes) >= 7
    assert optimise != "rotate" or sizes == {3, 4}
