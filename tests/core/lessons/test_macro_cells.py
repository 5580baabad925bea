"""Lesson "macro-cells": what is skipped is empty, and all that the plain grid enters beside it."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.macro_cells import Settings
from accelscope.core.progress import SILENT
from accelscope.core.structures.macro_grid import FARTHEST

LESSON = lesson_named("macro_cells")


@pytest.mark.parametrize("regions", ["chessboard", "octant"])
@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
def test_steps_saved_are_cells_of_the_plain_grid(lab, name, regions):
    scene = lab.small_scene(name)
    play = LESSON.play(Subject(scene), Settings(0, regions), SILENT)
    counts, plain = play.walked.counts, play.plain.counts
    assert counts["N_TS"] + counts["cells_skipped"] == plain["N_TS"]
    assert counts["N_IT"] == plain["N_IT"]
    assert play.walked.t_hit == play.plain.t_hit
    last = play.ends["step"]
    assert sum(play.cells_passed(step) for step in range(last + 1)) == counts["cells_skipped"]
    cells = play.plain.cells
    slack = 1e-9 * np.abs(cells.boxes).max()
    entered = play.plain.places.tolist()
    # Of cells with objects, both enter the same.
    own = play.walked.places[play.distances == 0].tolist()
    assert own == [place for place in entered if cells.count[place] > 0]
    occupied = index_of(play, np.flatnonzero(cells.count > 0))
    for step in range(last + 1):
        box, distance = play.boxes[step], int(play.distances[step])
        inside = (cells.boxes[:, :3] >= box[:3] - slack) & (cells.boxes[:, 3:] <= box[3:] + slack)
        inside = np.flatnonzero(inside.all(axis=1))
        here = index_of(play, play.walked.places[[step]])
        away = np.abs(occupied - here)
        if regions == "octant" and distance:
            ahead = np.where(play.walked.rays.directions[0] > 0.0, 1, -1) * (occupied - here)
            away = away[(ahead >= 0).all(axis=1)]
        assert distance == min(int(away.max(axis=1).min(initial=FARTHEST)), FARTHEST)
        assert (cells.count[inside] > 0).any() == (distance == 0)
        first = entered.index(int(play.walked.places[step]))
        for place in entered[first : first + 1 + play.cells_passed(step)]:
            assert place in inside
        picture = play.picture(Settings(step, regions))
        assert np.isfinite(picture.points()).all()
        assert len(picture.marks) <= 15
    assert f"{plain['N_TS']} step" in picture.marks[0].text
    assert f"{counts['N_TS']} step" in picture.marks[1].text


def index_of(play, places):
    return np.stack(np.unravel_index(places, tuple(play.plain.structure.arrays.resolution)), axis=1)
