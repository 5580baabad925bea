"""Lesson "reordering": flags, sums and places are those of the tree and of the builder's scan."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons.drawing import BLUE, ORANGE
from accelscope.core.lessons.reordering import MOST_TRIANGLES, Settings
from accelscope.core.lessons.scattering import ITEMS, RESULT, SUMS
from accelscope.core.structures.bvh.topology.tree import ranges_of


@pytest.mark.parametrize("name", ["suzanne", "mess", "flat"])
def test_triangles_go_where_the_tree_has_them(lab, play_lesson, read_charts, name):
    played = play_lesson("reordering", lab.small_scene(name))
    (tree,) = played.subject.structures
    begin, end = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    counts = []
    for number, this in enumerate(played.play.divisions):
        counts.append(len(this.ids))
        left = int(tree.arrays.first[this.node])
        below = [tree.geometry.ids[begin[child] : end[child]] for child in (left, left + 1)]
        assert np.array_equal(this.ids[this.flags == 1], np.sort(below[0]))
        assert np.array_equal(this.ids[this.flags == 0], np.sort(below[1]))
        # The parallel sum ends with the sum up to each place; the builder's scan has it before.
        assert np.array_equal(this.sums[-1], np.cumsum(this.flags))
        assert np.array_equal(this.sums[-1] - this.flags, this.scan)
        assert this.sums[-1][-1] == len(below[0])
        assert len(this.sums) - 1 == int(np.ceil(np.log2(len(this.ids))))
        # After j steps every place has the sum of the 2^j flags that end there.
        total = np.cumsum(this.flags)
        for j, sums in enumerate(this.sums):
            before = np.concatenate([np.zeros(1 << j, int), total])[: len(total)]
            assert np.array_equal(sums, total - before)
        # Who goes left takes the place of its sum, and order is kept on both sides.
        went_left = this.flags == 1
        assert np.array_equal(this.places[went_left], this.sums[-1][went_left] - 1)
        for side in (went_left, ~went_left):
            assert (np.diff(this.places[side]) == 1).all()
        (chart,) = read_charts(played.play, Settings(99, number))
        for side, colour in ((went_left, BLUE), (~went_left, ORANGE)):
            for low, x in ((ITEMS, np.flatnonzero(side)), (RESULT, this.places[side])):
                np.testing.assert_allclose(chart.rectangles(colour, low)[:, 0], x + 0.1)
            heights = chart.rectangles(colour, SUMS)[:, 3] - SUMS
            highest = max(float(total[-1]), 1.0)
            np.testing.assert_allclose(heights, 0.4 * total[side] / highest, atol=1e-9)
        picture = chart.picture
        assert f"N_L = {len(below[0])};" in picture.caption
        texts = [mark.text for mark in picture.marks]
        assert texts[: len(this.ids)] == [str(total) for total in this.sums[-1]]
        colours = {tuple(colour) for colour in picture.colours}
        assert {BLUE, ORANGE} <= colours
    assert counts == sorted(counts, reverse=True)
    assert 2 <= counts[-1] <= counts[0] <= MOST_TRIANGLES


def test_without_a_small_node_it_says_what_to_do(lab, play_lesson):
    with pytest.raises(InputError, match="more triangles"):
        play_lesson("reordering", lab.small_scene("one"))
