"""Lesson "light_buffer": grey items were not tested by the recorded walk, green ones block it."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.contract.events import TEST
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import ANY
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.directions import with_light
from accelscope.core.lessons.drawing import GREEN, GREY, ORANGE
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.lessons.light_buffer import Settings
from accelscope.core.progress import SILENT
from accelscope.core.scene.light import point_lights
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "cubes", "sombrero:size=1"]
OPACITY = {GREY: 0.35, ORANGE: 0.5, GREEN: 0.7}


@functools.cache
def played(name, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("light_buffer").play(Subject(scene), Settings(), SILENT)


def drawn(play, picture, colour):
    """The items that are drawn in a colour."""
    is_own = (picture.face_colours == (*colour[:3], OPACITY[colour])).all(axis=1)
    corners = play.scene.geometry.corners
    return {
        int(np.flatnonzero((corners == face).all(axis=(1, 2)))[0]) for face in picture.faces[is_own]
    }


def knobs(play):
    numbers = np.unique(np.linspace(0, play.ends["ray"], 12).astype(int)).tolist()
    return [Settings(n, cuts) for n in numbers for cuts in (True, False)]


@pytest.mark.parametrize("name", SCENES)
def test_colours_are_what_the_walk_has_done(lab, name):
    play, kinds = played(name, lab), set()
    truth, _ = build(play.scene, "naive").trace(play.rays, ANY)
    for settings in knobs(play):
        number = int(play.order[settings.ray])
        buffer = play.buffers[settings.full_occlusion]
        steps, picture = buffer.record(play.rays, number, ANY), play.picture(settings)
        cell = buffer.cell_of(0, -play.rays.directions[number])
        lists = buffer.lists
        part = slice(lists.first[cell], lists.last[cell])
        places, nearest = lists.references[part], lists.nearest[part]
        listed = buffer.geometry.ids[places].tolist()
        tested = steps.primitive[steps.kind == TEST].tolist()
        green, orange, grey = (drawn(play, picture, colour) for colour in (GREEN, ORANGE, GREY))
        assert grey == set(listed) - set(tested)
        assert orange | green == set(tested) & set(listed)
        is_blocked = truth.primitive[number] >= 0
        assert (len(green) == 1) == is_blocked
        if green:
            (hit,) = play.buffers[True].trace(play.rays.select(np.array([number])))[0].primitive
            assert settings.full_occlusion is False or hit in green
            assert tested[-1] in green
        # In order; the rest begins beyond the point, or follows the one that blocks.
        if not play.walked(settings).is_covered:
            assert tested == listed[: len(tested)]
            distance = np.linalg.norm(play.rays.directions[number])
            assert (nearest[: len(tested)] <= distance * (1 + 1e-9)).all()
            assert is_blocked or (nearest[len(tested) :] > distance).all()
        rows = {row.label: row.text for row in picture.rows}
        assert int(rows["Tested"]) == len(tested) == steps.tally()["N_IT"]
        assert int(rows["Listed"]) == len(listed)
        kinds.add((is_blocked, play.walked(settings).is_covered))
    # Lit and blocked points, behind a cover and not.
    assert len(kinds) == 3 or name != SCENES[0]


@pytest.mark.parametrize("name", SCENES[:1])
def test_the_ruler_is_the_list(lab, name, read_charts):
    play = played(name, lab)
    for settings in knobs(play):
        (chart,) = read_charts(play, settings)
        walked = play.walked(settings)
        upright = np.concatenate([chart.lines(c) for c in (GREY, ORANGE, GREEN)])
        # The axis is grey, too: it is level.
        upright = upright[upright[:, 0, 1] != upright[:, 1, 1]]
        ticks = np.sort(upright[:, 0, 0])
        np.testing.assert_allclose(ticks, np.sort(walked.listing.nearest), rtol=1e-9)


def test_figures_are_means_over_the_same_rays(lab):
    play = played(SCENES[0], lab)
    rows = {row.label: row.text for row in play.picture(Settings()).rows}
    bvh = build(play.scene, "bvh")
    for label, structure in (
        ("Light Buffer", play.buffers[True]),
        ("Without Full Occlusion", play.buffers[False]),
        ("BVH", bvh),
    ):
        _, counts = structure.trace(play.rays)
        assert rows[label] == f"{counts['N_IT'].mean():.3g}"
    assert float(rows["Light Buffer"]) < float(rows["BVH"])


def test_pages_show_a_lit_point_a_blocked_one_and_one_behind_a_cover(lab):
    play = played(SCENES[0], lab)
    pages = play.on_page(lesson_named("light_buffer"), Settings())
    walks = [play.walked(each) for each in pages]
    assert [walk.blocker >= 0 for walk in walks] == [False, True, True, True]
    assert [walk.is_covered for walk in walks] == [False, False, True, False]


def test_a_scene_that_shows_the_light_no_face_is_refused(lab):
    scene = lab.small_scene("one")
    (light,) = point_lights(scene.geometry.corners[0].mean(axis=0))
    with pytest.raises(InputError, match="faces the light; move the light"):
        lesson_named("light_buffer").play(Subject(with_light(scene, light)), Settings(), SILENT)
