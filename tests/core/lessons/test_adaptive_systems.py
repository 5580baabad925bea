"""Lesson "adaptive systems": what it shows of a level are the cells of the tree cut so far."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.adaptive_systems import COLUMNS, SYSTEMS, Settings
from accelscope.core.lessons.drawing import ORANGE, RED, counted
from accelscope.core.lessons.figures import lines_through
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.section import Plane, place_beside, section_of
from accelscope.core.progress import SILENT

LESSON = lesson_named("adaptive_systems")


@pytest.mark.parametrize("name", ["one", "mess", "suzanne"])
def test_cells_of_a_level_are_those_cut_so_far(lab, name):
    scene = lab.small_scene(name)
    play = LESSON.play(Subject(scene), Settings(), SILENT)
    for level in range(play.ends["level"] + 1):
        picture = play.picture(Settings(level))
        caption, plane, red, orange = picture.caption, Plane.across(scene, 0.5), [], []
        for number, (label, structure, cells) in enumerate(
            zip(SYSTEMS, play.structures.values(), play.cells, strict=True)
        ):
            children = 8 if structure.name == "octree" else 2
            depth = level // 3 if children == 8 else level
            cut = int((~cells.is_leaf & (cells.depth < depth)).sum())
            # A tree whose inner nodes have c children has 1 + (c - 1) n leaves.
            assert f"{label} {1 + (children - 1) * cut}" in caption
            # Red are the cells that are new on the level, orange the leaves with objects.
            new = np.flatnonzero((cells.depth == depth) & (depth > 0))
            full = np.flatnonzero(cells.is_leaf & (cells.depth <= depth) & (cells.count > 0))
            shift = place_beside(scene, number, COLUMNS)
            red.append(section_of(cells, new, plane).moved(shift).raised(scene).segments)
            orange.append(section_of(cells, full, plane).moved(shift).fans())
        assert "not drawn" not in caption
        drawn = picture.segments[(picture.colours == (*RED[:3], 0.8)).all(axis=1)]
        np.testing.assert_array_equal(drawn, np.concatenate(red))
        drawn = picture.faces[(picture.face_colours[:, :3] == ORANGE[:3]).all(axis=1)]
        np.testing.assert_array_equal(drawn, np.concatenate(orange))
    last = play.picture(Settings(play.ends["level"]))
    for row, structure in zip(last.rows, play.structures.values(), strict=True):
        figures = structure.statistics()
        counts = structure.trace(lines_through(scene))[1].by_name()
        assert row.text == (
            f"{counted(figures.N_V, 'leaf', 'leaves')}, SAH {figures.sah:.1f}, "
            f"N_TS {np.mean(counts['N_TS']):.1f}, N_IT {np.mean(counts['N_IT']):.1f}"
        )
    assert len({tuple(mark.position) for mark in last.marks}) == len(SYSTEMS)


def test_the_sah_is_the_best_of_the_four_choices_of_a_kdtree(lab):
    """What the slide says of it, on a model: least cost, and fewest tests."""
    scene = lab.small_scene("suzanne")
    play = LESSON.play(Subject(scene), Settings(), SILENT)
    names = list(SYSTEMS)
    sah = dict(zip(names, (costs.sah for costs in play.costs), strict=True))
    tests = dict(zip(names, (costs.tests for costs in play.costs), strict=True))
    kdtrees = [name for name in names if name.startswith("kd ")]
    assert min(kdtrees, key=sah.get) == "kd SAH"
    assert min(kdtrees, key=tests.get) == "kd SAH"
    assert max(kdtrees, key=sah.get) == "kd Median"


def test_other_items_than_triangles_have_no_bsp_tree(lab):
    play = LESSON.play(Subject(lab.small_scene("balls")), Settings(), SILENT)
    assert list(play.structures) == [name for name in SYSTEMS if name != "BSP"]
    assert len(play.picture(Settings()).marks) == 5
