"""Lesson "ray_space_time": what a ray meets at its time is listed, and lists are shorter so."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import GREEN
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.ray_space_time import Settings
from accelscope.core.progress import SILENT
from accelscope.core.structures.ray_classification.ray_space import TIME, Z
from accelscope.sample_scenes import make_sample


@functools.cache
def played(dimensions, size=2, name="nonuniform"):
    settings = Settings(dimensions, size)
    return lesson_named("ray_space_time").play(Subject(make_sample(name)), settings, SILENT)


@pytest.mark.parametrize("dimensions", ["5", "6"])
def test_cells_fill_z_and_time_and_list_what_rays_meet_there(dimensions):
    play = played(dimensions)
    low, high = (play.structure.known.bounds[play.cells, key] for key in range(2))
    areas = (high[:, Z] - low[:, Z]) * (high[:, TIME] - low[:, TIME])
    assert areas.sum() == pytest.approx(play.scene.upper[2] - play.scene.lower[2], rel=1e-12)
    assert ((high[:, TIME] - low[:, TIME] == 1.0).all()) == (dimensions == "5")
    assert set(play.of_rays.tolist()) <= set(play.cells.tolist())
    z, times = play.rays.origins[:, 2], play.rays.times
    listed = {cell: set(play.candidates(cell).tolist()) for cell in play.cells.tolist()}
    margin, met = 1e-9 * play.scene.diagonal, 0
    for item in range(len(play.scene)):
        lines = play.lines(item, times)
        inside = (lines.min(axis=0) + margin < z) & (z < lines.max(axis=0) - margin)
        assert all(item in listed[cell] for cell in play.of_rays[inside].tolist())
        assert (play.hits.primitive[inside] >= 0).all()
        beside = (z < lines.min(axis=0) - margin) | (lines.max(axis=0) + margin < z)
        assert not (play.hits.primitive[beside] == item).any()
        met += int(inside.sum())
    assert met > 100


def test_time_makes_lists_shorter():
    tests = [played(dimensions).counts["N_IT"].mean() for dimensions in "56"]
    assert tests[1] < 0.95 * tests[0]


def test_candidates_are_drawn_where_they_are_at_both_ends_of_the_cells_times():
    play = played("6")
    for number in {0, play.ends["cell"]}:
        cell = int(play.cells[play.order[number]])
        picture = play.picture(Settings("6", 2, number))
        low, high = play.structure.known.bounds[cell, :, TIME]
        listed = play.candidates(cell)
        for opacity, time in ((0.2, low), (0.55, high)):
            is_there = (picture.face_colours == (*GREEN[:3], opacity)).all(axis=1)
            expected = make_sample("nonuniform").geometry.corners[listed]
            expected[:, :, 2] += time * play.moving.shifts[listed, None]
            np.testing.assert_allclose(picture.faces[is_there], expected, atol=1e-12)


def test_solids_do_not_move():
    with pytest.raises(InputError):
        played("6", name="balls:size=1")
