"""Lesson "kd-tree, static variant": the planes it draws are those of the tree."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.kdtree_static import AXIS_COLOURS, Settings
from accelscope.core.lessons.lesson import build
from accelscope.core.progress import SILENT

LESSON = lesson_named("kdtree_static")


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
@pytest.mark.parametrize("planes", ["cyclic", "sah"])
def test_planes_of_a_level_are_the_trees(lab, name, planes):
    scene = lab.small_scene(name)
    tree = build(scene, f"kdtree:planes={planes},max_leaf_size=6,max_depth=9")
    subject = LESSON.subject(scene, given=[tree])
    play = LESSON.play(subject, Settings(), SILENT)
    cells, stored = tree.cells(), tree.arrays.tree
    shown = 0
    for level in range(play.ends["level"] + 1):
        picture = play.picture(Settings(level))
        inner = np.flatnonzero(~cells.is_leaf & (cells.depth == level))
        rows = {row.label: row.text for row in picture.rows}
        assert rows["Planes of the Level"] == str(len(inner))
        # Each plane is two triangles: their axis is its colour's, their place the stored one.
        corners = picture.faces.reshape(-1, 6, 3)
        assert len(corners) == len(inner)
        axes = np.array(
            [np.flatnonzero((AXIS_COLOURS[:, :3] == c[:3]).all(axis=1))[0]
             for c in picture.face_colours[::2]], int,
        )  # fmt: skip
        for plane, axis in zip(corners, axes, strict=True):
            assert np.ptp(plane[:, axis]) == 0.0
        drawn = sorted((int(a), float(p[0, a])) for p, a in zip(corners, axes, strict=True))
        numbers = cells.numbers[inner]
        want = sorted((int(stored.link[n] & 3), float(stored.split[n])) for n in numbers.tolist())
        assert drawn == want
        if planes == "cyclic":
            assert set(axes.tolist()) <= {level % 3}
            boxes = cells.boxes[inner]
            middles = sorted(0.5 * (boxes[:, level % 3] + boxes[:, 3 + level % 3]))
            assert [position for _, position in drawn] == middles
        shown += len(inner)
    assert shown == int((~cells.is_leaf).sum())


def test_only_kdtrees_suit(lab):
    scene = lab.small_scene("one")
    assert not LESSON.suits(build(scene, "kdtree"))
    assert "no kd-tree" in LESSON.suits(build(scene, "octree"))
