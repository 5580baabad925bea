"""Lesson less_rays_recursion: rays, savings and picture are those of the workload."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.lessons import lessons
from accelscope.core.lessons.less_rays_recursion import DEPTH, WIDTH, Settings, dashed, with_mirrors
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.progress import SILENT
from accelscope.core.scene import Camera
from accelscope.sample_scenes import make_sample

LESSON = lessons()["less_rays_recursion"]


@pytest.fixture(scope="module", params=["mount:size=2", "tetra:size=3", "gears:size=1"])
def played(request):
    subject = LESSON.subject(make_sample(request.param))
    return subject, LESSON.play(subject, Settings(), SILENT)


@pytest.mark.parametrize("threshold", [0.0, 0.013, 0.1])
def test_rays_and_picture_are_those_of_the_workload(played, threshold):
    subject, play = played
    structure = build(with_mirrors(subject.scene), "bvh")
    settings = WhittedSettings(width=WIDTH, height=WIDTH, depth=DEPTH, threshold=threshold)
    result = trace(Built(structure, 0.0), WhittedWorkload, settings)
    sent = play.sent(Settings(threshold=threshold))
    rays = play.rays
    for depth in range(1, DEPTH + 1):
        counts = np.bincount(rays.classes[sent & (rays.depths == depth)], minlength=4)
        assert counts.tolist() == result.outcome.sent[depth - 1].tolist()
    np.testing.assert_allclose(
        play.picture_by(Settings(threshold=threshold)), result.outcome.picture, atol=1e-12
    )
    picture = play.picture(Settings(threshold=threshold, tree=0))
    texts = {row.label: row.text for row in picture.rows}
    assert texts["Rays Saved"] == f"{np.mean(~sent):.1%}"
    if threshold:
        saved = result.outcome.saved
        assert (~sent).sum() == saved.by_depth.sum()
        assert texts["Error, RMS"] == f"{saved.rms_error:.2g}"
        assert texts["Error, Most"] == f"{saved.maximum_error:.2g}"


def test_nothing_that_comes_of_a_ray_is_stronger(played):
    """So a threshold cuts whole subtrees: what is not sent has no descendants that are."""
    _, play = played
    rays = play.rays
    strongest = np.ones(len(rays.film))
    for depth in range(1, DEPTH + 1):
        here = rays.depths == depth
        assert (rays.strengths[here] <= strongest[rays.samples[here]] + 1e-12).all()
        onward = here & (rays.classes != 1)
        now = np.zeros(len(rays.film))
        np.maximum.at(now, rays.samples[onward], rays.strengths[onward])
        strongest = now


def test_lines_are_the_rays_of_one_pixel(played):
    subject, play = played
    reach = subject.scene.diagonal
    for tree in range(play.ends["tree"] + 1):
        own = np.flatnonzero(play.rays.samples == play.pixels[tree])
        lines = play.lines(own, is_dashed=False)
        assert sum(len(part.segments) for part in lines) == len(own)
        segments = np.concatenate([part.segments for part in lines])
        starts = play.rays.origins[own]
        far = play.rays.classes[own] == 0
        for start in starts[~far]:
            assert np.abs(segments[:, 0] - start).max(axis=1).min() < 1e-9 * reach
    sizes = np.bincount(play.rays.samples)[play.pixels]
    assert (np.diff(sizes) >= 0).all()


def test_where_nothing_mirrors_all_does_by_half():
    scene = make_sample("tetra:size=2")
    assert with_mirrors(make_sample("mount:size=1")) is not None
    mirrored = with_mirrors(scene)
    assert {(each.diffuse, each.specular) for each in mirrored.materials} == {(0.5, 0.5)}
    balls = make_sample("balls:size=1")
    assert with_mirrors(balls) is balls


def test_dashes_lie_on_their_line():
    dashes = dashed(np.array([[[0.0, 0, 0], [8.5, 0, 0]]]))
    assert dashes.shape == (9, 2, 3)
    np.testing.assert_allclose(dashes[:, 1, 0] - dashes[:, 0, 0], 0.5)
    assert dashes[0, 0, 0] == 0.0
    assert dashes[-1, 1, 0] == 8.5


def test_a_camera_that_sees_nothing_is_refused():
    scene = make_sample("tetra:size=2")
    away = Camera(np.array([0.0, -9, 0]), np.array([0.0, -10, 0]), np.array([0.0, 0, 1]), 40.0)
    scene = dataclasses.replace(scene, camera=away)
    subject = Subject(scene, (build(scene, "bvh"),))
    with pytest.raises(InputError, match="sees nothing of it; turn it towards the mesh"):
        LESSON.play(subject, Settings(), SILENT)
