"""Lesson "soft_shadow": its curve is the share by many rays, the error that it tells is theirs."""

from __future__ import annotations

import functools

import numpy as np
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import GREEN
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.soft_shadow import MOST_RAYS, POINTS, Settings
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample


@functools.cache
def played():
    scene = make_sample("room:open=true,mirrors=0")
    return lesson_named("soft_shadow").play(Subject(scene), Settings(), SILENT)


def test_cones_and_rays_agree_within_the_error_of_rays():
    play = played()
    for kind in ("disc", "square", "star"):
        exact, sampled = play.exact[kind], play.sampled[kind][:, -1]
        error = np.sqrt(np.maximum(exact * (1.0 - exact), 1e-3) / MOST_RAYS)
        assert (np.abs(sampled - exact) < 5.0 * error).all()
        # Where all or nothing is seen, every ray says so.
        certain = (exact <= 0.0) | (exact >= 1.0)
        assert (sampled[certain] == exact[certain]).all()
        partly = (exact > 0.01) & (exact < 0.99)
        assert partly.sum() > 5
        assert certain.sum() > 20


def test_what_a_picture_tells_is_what_was_found():
    play = played()
    for settings in (Settings(10, 1), Settings(POINTS // 2, 64, "square")):
        picture = play.picture(settings)
        rows = {row.label: row.text for row in picture.rows}
        exact = play.exact[settings.light]
        assert rows["Seen"] == f"{exact[settings.point]:.4%}"
        by_rays = play.sampled[settings.light][:, settings.rays - 1]
        error = np.sqrt(np.mean((by_rays - exact) ** 2))
        assert rows["Error, RMS"] == f"{error:.2g}"
        curve = (picture.colours == GREEN).all(axis=1)
        assert curve.sum() >= POINTS - 1


def test_errors_go_down_with_the_root_of_the_number_of_rays():
    play = played()
    exact = play.exact["disc"][:, None]
    partly = ((exact > 0.05) & (exact < 0.95))[:, 0]
    errors = np.sqrt(np.mean((play.sampled["disc"] - exact)[partly] ** 2, axis=0))
    assert errors[MOST_RAYS - 1] < 0.35 * errors[3]
