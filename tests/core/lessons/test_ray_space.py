"""Lesson "ray_space": cells fill ray space, and list every object whose strip reaches into them."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, GREEN
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.ray_space import MOST_RAYS, Settings
from accelscope.core.progress import SILENT
from accelscope.core.structures.ray_classification.ray_space import V, Z
from accelscope.sample_scenes import make_sample

SCENES = ["nonuniform", "suzanne:subdivisions=0", "mess"]


@functools.cache
def played(name, size, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("ray_space").play(Subject(scene), Settings(size), SILENT)


@pytest.mark.parametrize("size", [1, 5])
@pytest.mark.parametrize("name", SCENES)
def test_cells_fill_ray_space_and_every_ray_lies_in_its_own(lab, name, size):
    play = played(name, size, lab)
    low, high = (play.structure.known.bounds[play.cells, key] for key in range(2))
    areas = (high[:, Z] - low[:, Z]) * (high[:, V] - low[:, V])
    extent = play.scene.upper[2] - play.scene.lower[2]
    assert areas.sum() == pytest.approx(2.0 * extent, rel=1e-12)
    assert set(play.of_rays.tolist()) <= set(play.cells.tolist())
    chart = play.chart()
    place = {cell: number for number, cell in enumerate(play.cells.tolist())}
    corners = play.rectangles(chart)
    rays = play.rays
    points = chart.points(rays.origins[:, 2], rays.directions[:, 2] + 1.0)
    own = corners[[place[cell] for cell in play.of_rays.tolist()]]
    for side in (chart.across, chart.upwards):
        along = points @ side
        assert ((own @ side).min(axis=1) <= along + 1e-9).all()
        assert (along <= (own @ side).max(axis=1) + 1e-9).all()


@pytest.mark.parametrize("name", SCENES)
def test_a_ray_in_a_strip_has_its_object_listed(lab, name):
    """And hits it, if nothing else is nearer."""
    play = played(name, 2, lab)
    z, v = play.rays.origins[:, 2], play.rays.directions[:, 2]
    listed = {cell: set(play.candidates(cell).tolist()) for cell in play.cells.tolist()}
    met = 0
    for item in range(len(play.scene)):
        lines = play.lines(item, v)
        if lines is None:
            continue
        margin = 1e-9 * play.scene.diagonal
        inside = (lines.min(axis=0) + margin < z) & (z < lines.max(axis=0) - margin)
        assert all(item in listed[cell] for cell in play.of_rays[inside].tolist())
        assert (play.hits.primitive[inside] >= 0).all()
        met += int(inside.sum())
        beside = (z < lines.min(axis=0) - margin) | (lines.max(axis=0) + margin < z)
        assert not (play.hits.primitive[beside] == item).any()
    assert met > 100


@pytest.mark.parametrize("name", SCENES)
def test_green_is_what_the_cell_lists_and_blue_are_its_rays(lab, name):
    play = played(name, 2, lab)
    for number in {0, play.ends["cell"] // 2}:
        cell = int(play.cells[play.order[number]])
        picture = play.picture(Settings(2, number))
        listed = play.candidates(cell)
        is_green = (picture.face_colours == (*GREEN[:3], 0.55)).all(axis=1)
        np.testing.assert_array_equal(picture.faces[is_green], play.scene.geometry.corners[listed])
        blue = picture.segments[(picture.colours == BLUE).all(axis=1)]
        mine = np.flatnonzero(play.of_rays == cell)
        some = mine[:MOST_RAYS]
        origins = {tuple(origin) for origin in play.rays.origins[some].tolist()}
        assert sum(tuple(begin) in origins for begin in blue[:, 0].tolist()) == len(some)
        # The others are the lines of stars on the chart.
        assert (len(blue) - len(some)) % len(some) == 0


def test_smaller_lists_make_more_cells(lab):
    cells = [len(played("suzanne:subdivisions=0", size, lab).cells) for size in (1, 5, 500)]
    assert cells[0] > cells[1] > cells[2]
