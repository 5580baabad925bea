"""Lesson "uniform subdivision": the cells it shows are the grid's."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, ORANGE
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.uniform_subdivision import Settings, border_of, rulings
from accelscope.core.progress import SILENT

LESSON = lesson_named("uniform_subdivision")


def played(scene, settings):
    return LESSON.play(Subject(scene), settings, SILENT)


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
@pytest.mark.parametrize("along", [1, 7, 20])
def test_figures_are_those_of_the_grid(lab, name, along):
    scene = lab.small_scene(name)
    play = played(scene, Settings(along))
    figures = play.grid.statistics()
    assert play.grid.arrays.resolution.max() == along
    for shown in ("objects", "ray"):
        picture = play.picture(Settings(along, shown))
        assert np.isfinite(picture.points()).all()
        rows = {row.label: row.text.replace(" ", "") for row in picture.rows}
        assert rows["Cells"] == str(figures.N_V)
        assert rows["With Objects"].split(",")[0] == str(figures.N_V - figures.N_EV)
        assert rows["References"] == str(figures.N_OIV)
    # The cells that the ray enters, by what is listed in them.
    entered = play.walked.places
    for is_full, colour in ((False, (*BLUE[:3], 0.8)), (True, ORANGE)):
        drawn = picture.segments[(picture.colours == colour).all(axis=1)]
        cells = entered[(play.counts[entered] > 0) == is_full]
        np.testing.assert_array_equal(drawn, box_segments(play.walked.cells.boxes[cells]))
    counts = play.grid.record(play.walked.rays, 0).tally()
    shown = [rows["Entered"], rows["Empty Ones"], rows["Tests"]]
    assert shown == [str(counts[name]) for name in ("N_TS", "N_EETS", "N_IT")]


def test_the_border_is_between_cells_with_and_without_objects(lab):
    play = played(lab.small_scene("suzanne"), Settings(8))
    grid = play.grid
    resolution = tuple(grid.arrays.resolution)
    inside = (play.counts > 0).reshape(resolution)
    want = 0
    for index in itertools.product(*map(range, resolution)):
        for axis, step in itertools.product(range(3), (-1, 1)):
            beside = list(index)
            beside[axis] += step
            within = 0 <= beside[axis] < resolution[axis]
            want += inside[index] and not (within and inside[tuple(beside)])
    assert len(play.sides) == want
    # Every side is one of a cell with objects: it lies in the box of one, flat along one axis.
    boxes = play.walked.cells.boxes[play.counts > 0]
    slack = 1e-9 * np.abs(boxes).max()
    for side in play.sides[::7]:
        low, high = side.min(axis=0), side.max(axis=0)
        assert ((boxes[:, :3] <= low + slack) & (high - slack <= boxes[:, 3:])).all(axis=1).any()
    # All cells in, the border is that of the box.
    everything = border_of(grid, np.ones(len(play.counts), bool))
    n = grid.arrays.resolution
    assert len(everything) == 2 * (n[0] * n[1] + n[1] * n[2] + n[2] * n[0])
    assert len(rulings(grid)) == 2 * (n.sum() + 3)
