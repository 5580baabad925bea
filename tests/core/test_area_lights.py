"""Points on area lights: uniform, the same whatever is made beside them; and penumbras."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Polygon
from accelscope.core.scene import AREA, Camera, Light, Scene, point_lights
from accelscope.core.scene.light_ways import chances, points_on

N = 40_000
AXES = np.array([[2.0, 0.0, 0.0], [0.0, 0.5, 0.0]])


def area(is_round=False, position=(0.0, 0.0, 4.0)):
    down = np.array([0.0, 0.0, -1.0])
    return Light(AREA, np.array(position), down, 180.0, "lamp", AXES, is_round)


def test_numbers_are_even_and_follow_from_the_point_alone():
    points = np.random.default_rng(1).random((N, 3))
    values = chances(points, (1, 2, 3))
    assert (values >= 0.0).all()
    assert (values < 1.0).all()
    assert abs(values.mean() - 0.5) < 4.0 * np.sqrt(1.0 / 12.0 / N)
    counts, _ = np.histogram(values, bins=64, range=(0.0, 1.0))
    assert ((counts - N / 64) ** 2 / (N / 64)).sum() < 63 + 5.0 * np.sqrt(2.0 * 63)
    assert np.array_equal(values[::3], chances(points[::3], (1, 2, 3)))
    other = chances(points, (1, 2, 4))
    assert abs(np.corrcoef(values, other)[0, 1]) < 4.0 / np.sqrt(N)
    assert np.array_equal(chances(np.zeros((1, 3)), (1,)), chances(-np.zeros((1, 3)), (1,)))


@pytest.mark.parametrize("is_round", [False, True])
def test_points_are_uniform_on_the_light(is_round):
    points = points_on(area(is_round), np.random.default_rng(2).random((N, 3)), (1,))
    u, v = points[:, 0] / 2.0, points[:, 1] / 0.5
    assert (points[:, 2] == 4.0).all()
    assert max(np.abs(u).max(), np.abs(v).max()) <= 1.0
    if is_round:
        assert (u * u + v * v).max() < 1.0
    mean, variance = (0.25, 1.0 / 16.0) if is_round else (1.0 / 3.0, 4.0 / 45.0)
    for each in (u, v):
        assert abs(each.mean()) < 4.0 * np.sqrt(mean / N)
        assert abs((each * each).mean() - mean) < 4.0 * np.sqrt(variance / N)


def lit_floor(light, *others):
    floor = Polygon([(-99, -99, 0), (99, -99, 0), (99, 99, 0), (-99, 99, 0)])
    camera = Camera(np.array([0.0, -6, 1.5]), np.zeros(3), np.array([0.0, 0, 1]), 0.05)
    return Scene.from_items([floor, *others], "floor", camera=camera, lights=(light,))


def traced(build, scene, structure="bvh", threads=0, **settings):
    settings = WhittedSettings(**{"width": 16, "height": 16, **settings})
    return trace(Built(build(structure, scene), 0.0), WhittedWorkload, settings, threads)


def shadow_of(result):
    return result.rays.select(result.rays.classes == 1)


def test_a_penumbra_is_as_deep_as_the_light_is_seen(build):
    """A half-plane at half height hides from the point below its edge + x as much as x moves it."""
    n, samples = 16 * 16, 64
    for edge, seen in ((-1.0, 1.0), (-0.5, 0.75), (0.0, 0.5), (0.5, 0.25), (1.0, 0.0)):
        # The light is 4 wide at twice the height of the edge: there its image is 2 wide.
        screen = Polygon([(-99, -99, 2), (edge, -99, 2), (edge, 99, 2), (-99, 99, 2)])
        result = traced(build, lit_floor(area(), screen), light_samples=samples)
        shadow = result.rays.classes == 1
        assert shadow.sum() == n * samples
        free = (result.hits.primitive[shadow] < 0).mean()
        assert abs(free - seen) < 4.0 * np.sqrt(0.25 / (n * samples)) + 2e-3


def test_one_sample_or_many_bring_the_same_light(build):
    """Each sample brings its part: an open light is as bright in the mean as its centre is."""
    small = dataclasses.replace(area(), half_axes=1e-3 * AXES)
    centre = traced(build, lit_floor(small)).outcome.picture
    for samples in (1, 5):
        picture = traced(build, lit_floor(small), light_samples=samples).outcome.picture
        np.testing.assert_allclose(picture, centre, atol=1e-3)


def test_the_rays_are_the_same_for_structures_threads_and_fewer_rays(build):
    scene = lit_floor(area(True), Polygon([(0, 0, 1), (1, 0, 1), (0, 1, 1)]))
    first = traced(build, scene, "naive", 1, light_samples=3, samples=4)
    other = traced(build, scene, "bvh", 8, light_samples=3, samples=4)
    for field in dataclasses.fields(Rays):
        assert np.array_equal(getattr(first.rays, field.name), getattr(other.rays, field.name))
    some = traced(build, scene, light_samples=3, samples=4, adaptive=True, compare=False)
    everything = {tuple(row) for row in shadow_of(first).directions.tolist()}
    assert {tuple(row) for row in shadow_of(some).directions.tolist()} <= everything
    seeded = traced(build, scene, light_samples=3, samples=4, seed=2)
    assert not np.array_equal(shadow_of(first).directions, shadow_of(seeded).directions)


def test_other_lights_have_one_ray_each(build):
    scene = lit_floor(point_lights((1, 2, 3))[0])
    one, many = (traced(build, scene, light_samples=k) for k in (0, 9))
    assert np.array_equal(one.rays.directions, many.rays.directions)
    assert (shadow_of(traced(build, lit_floor(area()))).targets == 0).all()
