"""Lesson "nonuniform subdivision": 13 cells against 17, and on other scenes what was walked."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.events import TEST
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.nonuniform_subdivision import Settings
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

LESSON = lesson_named("nonuniform_subdivision")


def played(scene, rays=None):
    subject = LESSON.subject(scene)
    subject = Subject(scene, subject.structures, rays)
    return LESSON.play(subject, Settings(), SILENT)


def test_the_slide_comes_out():
    play = played(make_sample("nonuniform"))
    octree, grid = (each.walked for each in play.both)
    assert [octree.counts["N_ETS"], grid.counts["N_ETS"]] == [13, 17]
    assert [octree.counts["N_IT"], grid.counts["N_IT"]] == [3, 3]
    assert play.ends == {"cells": 17}
    picture = play.picture(play.within(Settings()))
    assert [mark.text for mark in picture.marks] == ["Octree: 13 cells", "Uniform Grid: 17 cells"]
    assert picture.caption.count("3 objects tested") == 2


@pytest.mark.parametrize("name", ["one", "flat", "mess", "suzanne"])
def test_what_is_drawn_is_what_was_walked(lab, name):
    scene = lab.small_scene(name)
    play = played(scene)
    picture = play.picture(play.within(Settings()))
    assert np.isfinite(picture.points()).all()
    for each, structure in zip(play.both, LESSON.subject(scene).structures, strict=True):
        steps = structure.record(each.walked.rays, 0)
        counts = steps.tally()
        assert each.walked.counts == counts
        assert len(each.walked.places) == counts["N_ETS"]
        assert int(each.walked.is_empty.sum()) == counts["N_EETS"]
        tested = each.tested(counts["N_ETS"])
        assert set(tested.tolist()) == set(steps.primitive[steps.kind == TEST].tolist())
        # The boxes of the cells entered hold the pieces of the ray between entry and exit.
        boxes = each.walked.cells.boxes[each.walked.places]
        enter = steps.t_enter[each.walked.visits]
        leave = np.minimum(steps.t_exit[each.walked.visits], 1e6 * scene.diagonal)
        middle = each.walked.at(0.5 * (enter + leave))
        slack = 1e-9 * np.abs(boxes).max()
        assert (middle >= boxes[:, :3] - slack).all()
        assert (middle <= boxes[:, 3:] + slack).all()


def test_a_ray_that_is_given_is_shown():
    """Also a ray that is in no plane across an axis, and one that misses everything."""
    scene = make_sample("suzanne:subdivisions=1")
    centre = 0.5 * (scene.lower + scene.upper)
    way = np.array([[1.0, 2.0, -1.5], [0.0, 0.0, 3.0], [1.0, 0.0, 0.0]])
    origins = centre - 2.0 * way + [[0, 0, 0], [0, 0, 0], [0, 0, 100.0]]
    rays = Rays.from_arrays(origins, way)
    subject = LESSON.subject(scene)
    for ray in range(3):
        play = LESSON.play(Subject(scene, subject.structures, rays, ray), Settings(), SILENT)
        picture = play.picture(play.within(Settings()))
        for each in play.both:
            counts = each.structure.record(rays, ray).tally()
            assert each.walked.counts == counts
            assert f"{each.structure.label}: {counts['N_ETS']} cell" in picture.caption
    assert "0 cells" in picture.caption
