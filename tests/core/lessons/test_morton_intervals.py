"""Lesson "morton_intervals": levels, boxes and intervals are those of the tree."""

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.lessons.morton_intervals import (
    MOST_BRACKETS,
    Intervals,
    Settings,
    has_intervals,
    sorts_by_code,
)
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh.builders.morton.codes import MortonSettings, sort_by_code
from accelscope.core.structures.bvh.topology.tree import ranges_of


@pytest.mark.parametrize("builder", ["lbvh", "lbvh_parallel", "hlbvh"])
@pytest.mark.parametrize("optimise", ["none", "rotate"])
@pytest.mark.parametrize("kind", ["standard", "extended"])
def test_the_levels_along_the_curve_are_those_of_the_tree(
    muddle, build, read_charts, builder, optimise, kind
):
    text = f"builder={builder},morton_codes={kind}"
    bvh = build("bvh", muddle, f"{text},optimise={optimise}", log=True)
    # What an optimiser gets has one triangle a leaf.
    tree = bvh if optimise == "none" else build("bvh", muddle, f"{text},max_leaf_size=1")
    with Team(SILENT, "testing") as team:
        _, order = sort_by_code(boxes_of(muddle.triangles), MortonSettings(morton_codes=kind), team)
    if builder != "hlbvh":
        assert np.array_equal(tree.triangles.ids, order)
    play = Intervals(bvh, bvh.build_log, SILENT)
    assert len(play.levels) == 8
    depth, is_leaf = tree.depths(), tree.arrays.size > 0
    begin, end = ranges_of(tree.arrays.first, tree.arrays.size, tree.width())
    for number, level in enumerate(play.levels):
        nodes = np.flatnonzero((depth == number) | (is_leaf & (depth < number)))
        nodes = nodes[np.argsort(begin[nodes])]
        assert np.array_equal(level.boxes, tree.arrays.volumes.boxes()[nodes])
        assert np.array_equal(level.sizes, (end - begin)[nodes])
        for place, node in enumerate(nodes):
            inside = np.sort(order[level.node == place])
            assert np.array_equal(inside, np.sort(tree.triangles.ids[begin[node] : end[node]]))
        runs = 1 + np.count_nonzero(np.diff(level.node))
        assert runs == len(nodes) or builder == "hlbvh"
        (chart,) = read_charts(play, Settings(number))
        picture = chart.picture
        if runs <= MOST_BRACKETS:  # the level's brackets, a tenth shorter at either end
            across, left, _ = chart.values(picture.segments[-3 * runs :]).reshape(3, runs, 2, 2)
            begins = np.flatnonzero(np.diff(level.node, prepend=-1))
            lengths = np.diff(begins, append=len(level.node))
            ends = np.stack([begins + 0.1 * lengths, begins + 0.9 * lengths], axis=1)
            np.testing.assert_allclose(across[..., 0], ends)
            np.testing.assert_allclose(across[..., 1], len(play.levels) - number, atol=1e-9)
            np.testing.assert_allclose(left[:, 0], across[:, 0])
        assert f": {len(nodes)} node" in picture.caption
        assert f", {runs} interval" in picture.caption
        assert f"{level.sizes.max()} triangle" in picture.caption
        if runs == len(nodes) <= 8:
            ends = [f"[{b}, {e})" for b, e in zip(begin[nodes], end[nodes], strict=True)]
            assert [mark.text for mark in picture.marks] == ends


def test_who_has_intervals(lab, build):
    scene = lab.small_scene("soup")
    assert "no hierarchy" in has_intervals(build("grid", scene))
    ploc = build("bvh", scene, "builder=ploc", log=True)
    assert sorts_by_code(ploc) == ""
    assert "clusters" in has_intervals(ploc)
    phr = build("bvh", scene, "builder=phr", log=True)
    assert sorts_by_code(phr) == ""
    assert "cost" in has_intervals(phr)
    assert "Morton" in has_intervals(build("bvh", scene, log=True))
    assert "log" in has_intervals(build("bvh", scene, "builder=lbvh"))


@pytest.mark.parametrize("name", ["one", "flat", "mess"])
def test_other_meshes(lab, play_lesson, name):
    scene = lab.small_scene(name)
    played = play_lesson("morton_intervals", scene)
    for level in range(played.play.ends["level"] + 1):
        sizes = played.play.levels[level].sizes
        assert sizes.sum() == len(scene)
        assert np.isfinite(played.picture(level=level).points()).all()
