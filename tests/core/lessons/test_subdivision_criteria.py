"""Lesson "subdivision criteria": who waits is who is cut later, in the order that is claimed."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.build_log import SPLIT
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import ORANGE, RED
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.section import frame_of_plane, place_beside, section_of
from accelscope.core.lessons.subdivision_criteria import ORDERS, Settings
from accelscope.core.progress import SILENT

LESSON = lesson_named("subdivision_criteria")


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
@pytest.mark.parametrize("limits", [(4, 12, 60), (1, 3, 5000), (20, 25, 3)])
def test_cells_are_cut_in_the_order_that_is_claimed(lab, name, limits):
    m, k, budget = limits
    settings = Settings(0, m, k, budget)
    play = LESSON.play(Subject(lab.small_scene(name)), settings, SILENT)
    for order, each in play.trees.items():
        cells, log = each.cells, each.tree.build_log
        assert len(cells) <= budget
        leaves = cells.is_leaf
        np.testing.assert_array_equal(each.count[leaves], cells.count[leaves])
        keys = surface_area(cells.boxes) * each.count
        for event in range(0, len(log), max(len(log) // 40, 1)):
            assert log.kind[event] == SPLIT
            step = int(log.step[event])
            (place,) = cells.places_of(log.cells[log.node[event]][None])
            there = each.there(step - 1)
            assert int(there.sum()) == step
            waiting = np.flatnonzero(there & each.is_candidate)
            assert place in waiting
            if order == "priority":
                assert keys[place] == keys[waiting].max()
            elif order == "fifo":
                assert each.made[place] == each.made[waiting].min()
            else:
                assert each.made[place] == each.made[waiting].max()
            # Its children are what the picture paints as newest.
            newest = np.flatnonzero(each.there(step) & (each.made == step))
            assert len(newest) == 2
            assert (cells.parents[newest] == cells.numbers[place]).all()
        picture = play.picture(Settings(each.cuts, m, k, budget))
        rows = {row.label: row.text for row in picture.rows}
        waits = int((leaves & each.is_candidate).sum())
        assert rows[f"{ORDERS[order]}: Now"].startswith(f"{int(leaves.sum())} leaves, {waits} wait")


@pytest.mark.parametrize("name", ["mess", "suzanne"])
def test_orange_cells_wait_and_red_ones_are_new(lab, name):
    m, k, budget = 4, 12, 60
    play = LESSON.play(Subject(lab.small_scene(name)), Settings(0, m, k, budget), SILENT)
    scene, plane = play.scene, play.plane
    for step in (0, 1, 7, play.ends["step"]):
        picture, waiting, newest = play.picture(Settings(step, m, k, budget)), [], []
        for number, each in enumerate(play.trees.values()):
            cells, shift, now = each.cells, place_beside(scene, number), min(step, each.cuts)
            there = each.there(now)
            waits = np.flatnonzero(there & (each.count > m) & (cells.depth < k))
            waiting.append(section_of(cells, waits, plane).moved(shift).fans())
            new = np.flatnonzero(there & (each.made == now)) if step else waits[:0]
            section = section_of(cells, new, plane).moved(shift)
            newest += [section.segments, section.raised(scene).segments]
        orange = picture.faces[(picture.face_colours[:, :3] == ORANGE[:3]).all(axis=1)]
        np.testing.assert_array_equal(orange, np.concatenate(waiting))
        red = picture.segments[(picture.colours == RED).all(axis=1)]
        frame = frame_of_plane(scene, plane)
        np.testing.assert_array_equal(red, np.concatenate([frame, *newest]))


def test_without_a_budget_that_ends_it_all_orders_give_one_tree(lab):
    play = LESSON.play(Subject(lab.small_scene("suzanne")), Settings(0, 20, 8, 5000), SILENT)
    trees = [
        sorted(map(tuple, each.cells.boxes[each.cells.is_leaf].tolist()))
        for each in play.trees.values()
    ]
    assert len(trees[0]) > 20
    assert trees[0] == trees[1] == trees[2]
    # With one, depth-first leaves the largest cells.
    play = LESSON.play(Subject(lab.small_scene("suzanne")), Settings(0, 4, 16, 80), SILENT)
    left = {name: each.count[each.cells.is_leaf].max() for name, each in play.trees.items()}
    assert left["depth_first"] > left["fifo"] > left["priority"]
