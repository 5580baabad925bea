"""Lessons "volume_trees" and "kdop_levels": levels of the tree itself, volumes around all below."""

import numpy as np
import pytest
from accelscope.core.geometry.fit import fit_all, sticking_out
from accelscope.core.geometry.geometry import hulls_of
from accelscope.core.progress import SILENT


@pytest.mark.parametrize("lesson", ["volume_trees", "kdop_levels"])
@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "balls"])
def test_every_level_is_one_of_the_tree(lab, play_lesson, lesson, name):
    played = play_lesson(lesson, lab.small_scene(name))
    (bvh,), play = played.subject.structures, played.play
    depths, size, first = bvh.depths(), bvh.arrays.size, bvh.arrays.first
    assert play.ends["level"] == min(int(depths.max()), 5 if lesson == "volume_trees" else 3)
    corners, places = hulls_of(bvh.geometry)
    for level in range(play.ends["level"] + 1):
        nodes = play.nodes[level]
        assert set(nodes) == set(
            np.flatnonzero((depths == level) | ((size > 0) & (depths < level)))
        )
        ranges = [references_below(first, size, node) for node in nodes]
        # Together they have everything, each item once.
        assert sorted(ranges)[0][0] == 0
        assert sum(end - begin for begin, end in ranges) == len(bvh.geometry.ids)
        begin, end = places[np.array(ranges).T]
        for kind, name in play.kinds.items():
            volumes = fit_all(kind, corners, begin, end, SILENT)
            assert not len(sticking_out(volumes, corners, begin, end))
            assert float(volumes.areas().sum()) == play.sums[level][kind]
            assert played.row(name, level=level) == f"{play.sums[level][kind]:.4g}"


def references_below(first, size, node):
    """First and behind the last reference below a node of a binary tree."""
    if size[node] > 0:
        return int(first[node]), int(first[node] + size[node])
    left, right = (references_below(first, size, int(first[node]) + side) for side in (0, 1))
    return left[0], right[1]


def test_more_strips_are_tighter_on_every_level(play_lesson):
    play = play_lesson("kdop_levels").play
    for sums in play.sums:
        assert sums["kdop26"] <= min(sums["kdop14"], sums["kdop18"])
        assert max(sums["kdop14"], sums["kdop18"]) <= sums["kdop6"]


def test_copies_are_the_same_tree(play_lesson):
    """A node has its colour in all copies; and the copies lie apart."""
    play = play_lesson("volume_trees").play
    for lines in play.lines:
        colours = [{tuple(row) for row in each.colours} for each in lines.values()]
        assert all(each == colours[0] for each in colours)
