"""Ambient rays: their density, what they say of how open the sky is, and the same everywhere."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.ambient import disc_points
from accelscope.core.evaluation.rays.workloads import AmbientSettings, AmbientWorkload
from accelscope.core.evaluation.records.experiment import Built, make_record, trace
from accelscope.core.geometry.rays import ANY, Rays
from accelscope.core.geometry.solids.description import Box, Polygon, Sphere
from accelscope.core.scene import Camera, Scene
from accelscope.sample_scenes import make_sample

FLOOR = Polygon([(-99, -99, 0), (99, -99, 0), (99, 99, 0), (-99, 99, 0)])


def scene_of(*items, eye=(-4.0, -9.0, 0.5), at=(0.0, 0.0, 0.0), fov=0.01):
    camera = Camera(np.array(eye, float), np.array(at, float), np.array([0.0, 0.1, 1]), fov)
    return Scene.from_items(items, "made", camera=camera)


def traced(build, scene, structure="bvh", threads=0, **settings):
    settings = AmbientSettings(**{"width": 24, "height": 24, **settings})
    return trace(Built(build(structure, scene), 0.0), AmbientWorkload, settings, threads)


def ambient_of(result):
    return result.rays.select(result.rays.classes == 1)


def test_points_are_uniform_in_the_disc():
    x, y = disc_points(200_000, np.random.default_rng(1))
    squares = x * x + y * y
    assert squares.max() < 1.0
    assert abs(squares.mean() - 0.5) < 4.0 * np.sqrt(1.0 / 12.0 / 200_000)
    assert abs(x.mean()) < 4.0 * np.sqrt(0.25 / 200_000)
    assert len(disc_points(0, np.random.default_rng(1))[0]) == 0


def test_density_is_that_of_the_cosine(build):
    """Its mean is 2/3, that of its square 1/2; about the normal there is no preference."""
    result = traced(build, scene_of(FLOOR), count=100)
    rays = ambient_of(result)
    assert len(rays) == 24 * 24 * 100
    assert (rays.queries == ANY).all()
    assert (rays.sources == 0).all()
    np.testing.assert_allclose(np.linalg.norm(rays.directions, axis=1), 1.0, atol=1e-14)
    cosines = rays.directions[:, 2]
    assert (cosines >= 0.0).all()
    n = len(rays)
    assert abs(cosines.mean() - 2.0 / 3.0) < 4.0 * np.sqrt(1.0 / 18.0 / n)
    assert abs((cosines**2).mean() - 0.5) < 4.0 * np.sqrt(1.0 / 12.0 / n)
    assert np.abs(rays.directions[:, :2].mean(axis=0)).max() < 4.0 * np.sqrt(0.25 / n)
    # From a plane nothing is in the way.
    assert (result.outcome.picture == 1.0).all()


@pytest.mark.parametrize(("x", "height"), [(0.0, 2.0), (0.0, 5.0), (3.0, 4.0)])
def test_a_ball_takes_its_form_factor_of_the_sky(build, x, height):
    """(r / d)^2 cos: the part of the light of an even sky that a ball above a point takes."""
    ball = Sphere((x, 0, height), 1.0)
    result = traced(build, scene_of(FLOOR, ball), count=100)
    distance = np.hypot(x, height)
    taken = height / distance**3
    n = 24 * 24 * 100
    error = np.sqrt(taken * (1.0 - taken) / n)
    assert abs(1.0 - result.outcome.open.mean() - taken) < 4.0 * error + 1e-4
    assert result.outcome.to_json()["mean_openness"] == result.outcome.open.mean()


def test_rays_end_at_their_distance(build):
    ball = Sphere((0, 0, 3), 1.0)
    near = traced(build, scene_of(FLOOR, ball), distance=1.99)
    assert (near.outcome.open == 1.0).all()
    assert (ambient_of(near).t_max == 1.99).all()
    assert (traced(build, scene_of(FLOOR, ball), distance=2.5).outcome.open < 1.0).any()


def test_within_a_box_nothing_is_open(build):
    scene = scene_of(Box((-1, -1, -1), (1, 1, 1)), eye=(0, 0, 0), at=(1, 0.2, 0.1), fov=120.0)
    result = traced(build, scene)
    assert (result.outcome.open == 0.0).all()
    outside = scene_of(Box((-1, -1, -1), (1, 1, 1)), eye=(4, 3, 2), fov=60.0)
    assert (traced(build, outside).outcome.open == 1.0).all()


def test_where_nothing_is_seen_there_are_no_ambient_rays(build):
    result = traced(build, scene_of(FLOOR, eye=(0, 0, 5), at=(0, 1, 9)))
    assert len(ambient_of(result)) == 0
    assert (result.outcome.open == 1.0).all()


@pytest.mark.parametrize("name", ["balls:size=1", "tetra:size=3"])
def test_the_same_for_all_structures_and_threads(build, name):
    scene = make_sample(name)
    first = traced(build, scene, "naive", 1, count=3)
    for structure, threads in (("bvh", 1), ("bvh", 8), ("kdtree", 2)):
        other = traced(build, scene, structure, threads, count=3)
        for field in dataclasses.fields(Rays):
            assert np.array_equal(getattr(first.rays, field.name), getattr(other.rays, field.name))
        assert np.array_equal(first.hits.primitive < 0, other.hits.primitive < 0)
        assert np.array_equal(first.outcome.open, other.outcome.open)
    seeded = traced(build, scene, count=3, seed=2)
    assert not np.array_equal(ambient_of(first).directions, ambient_of(seeded).directions)


def test_records_hold_classes_and_figure(build):
    built = Built(build("bvh", make_sample("tetra:size=3")), 0.0)
    record = make_record(built, trace(built, AmbientWorkload, AmbientSettings(width=9, height=9)))
    seen = record["trace"]["hits_by_class"]["primary"]
    assert record["rays"]["classes"] == {"primary": 81, "ambient": 16 * seen}
    assert 0.0 < record["outcome"]["mean_openness"] < 1.0


def test_too_many_are_refused_by_the_setting(build):
    with pytest.raises(InputError, match="lower count, width or height"):
        traced(build, make_sample("tetra:size=3"), count=10**12)
    with pytest.raises(InputError, match="rays ambient: a camera of 3600000000 rays"):
        traced(build, make_sample("tetra:size=3"), width=60000, height=60000)
