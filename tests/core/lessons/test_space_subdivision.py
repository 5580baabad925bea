"""Lesson "space subdivision": its figures are those of the structures."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import counted
from accelscope.core.lessons.figures import lines_through
from accelscope.core.lessons.section import Plane
from accelscope.core.lessons.space_subdivision import Settings
from accelscope.core.memory import in_words
from accelscope.core.progress import SILENT

LESSON = lesson_named("space_subdivision")


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
def test_figures_are_those_of_the_structures(lab, name):
    scene = lab.small_scene(name)
    subject = LESSON.subject(scene)
    play = LESSON.play(subject, Settings(), SILENT)
    picture = play.picture(Settings(0.4))
    rows = {row.label: row.text for row in picture.rows}
    plane = Plane.across(scene, 0.4)
    for structure in subject.structures:
        label, figures = structure.label, structure.statistics()
        counts = structure.trace(lines_through(scene))[1].by_name()
        assert rows[f"{label}: Cells"] == f"{figures.N_V:,}".replace(",", " ")
        assert rows[f"{label}: Memory"] == in_words(structure.memory())
        assert rows[f"{label}: Steps"] == f"{np.mean(counts['N_TS']):.1f}"
        assert rows[f"{label}: Tests"] == f"{np.mean(counts['N_IT']):.1f}"
        cells = structure.cells()
        leaves = cells.boxes[cells.is_leaf]
        height = plane.point[1]
        # Cells whose lower side lies in the plane are not cut, those whose upper does are.
        cut = int(((leaves[:, 1] <= height) & (leaves[:, 4] > height)).sum())
        assert f"{label}: {counted(cut, 'cell', 'cells')} cut" in picture.caption


def test_the_slides_claims_hold_on_the_sample():
    from accelscope.sample_scenes import make_sample

    subject = LESSON.subject(make_sample(LESSON.sample))
    grid, octree = LESSON.play(subject, Settings(), SILENT).costs
    assert octree.cells < grid.cells
    assert octree.memory < grid.memory
    assert octree.steps < grid.steps
