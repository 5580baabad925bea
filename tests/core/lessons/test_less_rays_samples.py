"""Lesson less_rays_samples: samples, savings and picture are those of the workload with them."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.lessons import lessons
from accelscope.core.lessons.less_rays_samples import DEPTH, WIDTH, Settings
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

LESSON = lessons()["less_rays_samples"]


@pytest.mark.parametrize(("name", "samples"), [("tetra:size=3", "2"), ("balls:size=1", "4")])
def test_samples_and_picture_are_those_of_the_workload(name, samples):
    subject = LESSON.subject(make_sample(name))
    play = LESSON.play(subject, Settings(samples=samples), SILENT)
    for contrast in (0.0, 0.1, 0.5):
        settings = WhittedSettings(
            width=WIDTH, height=WIDTH, depth=DEPTH, samples=int(samples), adaptive=True,
            contrast=contrast,
        )  # fmt: skip
        result = trace(Built(subject.structures[0], 0.0), WhittedWorkload, settings)
        outcome, knobs = result.outcome, Settings(samples=samples, contrast=contrast)
        film = play.developed(knobs)
        assert np.array_equal(film.samples(), outcome.samples)
        np.testing.assert_allclose(film.picture(), outcome.picture, atol=1e-12)
        picture = play.picture(knobs)
        texts = {row.label: row.text for row in picture.rows}
        share = outcome.saved.by_depth.sum() / outcome.saved.whole
        assert texts["Rays Saved"] == f"{share:.1%}"
        assert texts["Error, RMS"] == f"{outcome.saved.rms_error:.2g}"
        assert np.array_equal(picture.images[1].values, outcome.samples)


def test_stars_are_where_pixels_have_more_than_one_sample():
    play = LESSON.play(LESSON.subject(make_sample("tetra:size=2")), Settings(samples="2"), SILENT)
    settings = Settings(samples="2")
    film = play.developed(settings)
    seen = play.points[film.places()]
    where = (film.samples().ravel()[film.pixels()] > 1) & np.isfinite(seen).all(axis=1)
    picture = play.picture(settings)
    middles = picture.segments.mean(axis=1)[::3]
    np.testing.assert_allclose(middles, seen[where], atol=1e-9)


def test_one_colour_needs_one_sample():
    """At a contrast that nothing reaches only outlines are divided."""
    play = LESSON.play(LESSON.subject(make_sample("tetra:size=2")), Settings(samples="4"), SILENT)
    samples = play.developed(Settings(contrast=1.0)).samples()
    few = play.developed(Settings(contrast=0.02)).samples()
    assert (samples == 1).mean() > 0.5
    assert samples.sum() <= few.sum()
