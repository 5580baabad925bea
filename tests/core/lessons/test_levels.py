"""Lesson "levels": each with the leaves above it holds the whole scene; of many, the largest."""

import numpy as np
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.levels import MOST_VOLUMES, Settings
from accelscope.core.progress import SILENT


def played(structure):
    lesson = lesson_named("levels")
    subject = lesson.subject(structure.scene, given=[structure])
    return lesson.play(subject, lesson.Settings(), SILENT)


def test_every_level_holds_the_scene(lab, build):
    structure = build("bvh", lab.small_scene("suzanne"))
    cells, play = structure.cells(), played(structure)
    assert play.ends == {"level": int(cells.depth.max())}
    for level in (0, 3, play.ends["level"]):
        picture = play.picture(Settings(level))
        shown = (cells.depth == level) | (cells.is_leaf & (cells.depth < level))
        assert len(picture.segments) == 12 * shown.sum()
        bright = picture.colours[:, 3] == 1.0
        assert bright.sum() == 12 * (cells.depth == level).sum()
        low, high = picture.segments.min(axis=(0, 1)), picture.segments.max(axis=(0, 1))
        np.testing.assert_array_equal([low, high], [structure.scene.lower, structure.scene.upper])
        rows = {row.label: int(row.text) for row in picture.rows}
        share = surface_area(cells.boxes[shown]).sum() / surface_area(cells.boxes[0])
        assert f"; together {share:.2f} times the root's surface" in picture.caption
        assert rows["Nodes on the Level"] == (cells.depth == level).sum()
        assert rows["Leaves among Them"] == (cells.is_leaf & (cells.depth == level)).sum()
    first = play.picture(Settings(0)).caption
    assert first.startswith(f"Level 0 of {play.ends['level']}: 1 node; together 1")


def test_of_many_nodes_the_largest_are_drawn(build):
    from accelscope.sample_scenes import make_sample

    structure = build("bvh", make_sample("suzanne"), "max_leaf_size=1")
    cells = structure.cells()
    level = int(np.bincount(cells.depth).argmax())
    picture = played(structure).picture(Settings(level))
    shown = MOST_VOLUMES
    assert len(picture.segments) == 12 * shown
    sizes = np.sort(surface_area(cells.boxes[cells.depth == level]))[-shown:]
    ends = picture.segments.reshape(shown, 24, 3)
    drawn = surface_area(np.concatenate([ends.min(axis=1), ends.max(axis=1)], axis=1))
    np.testing.assert_array_equal(np.sort(drawn), sizes)
    assert picture.caption.endswith(f"drawn: {shown} volumes")
