"""Rays of a class that a structure is not for are refused; what it was built from may not move."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.needs import CAMERA, GEOMETRY, LIGHTS, moved
from accelscope.core.contract.protocols import Linked, Refittable, Skipping
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import SUN, Camera, Light
from accelscope.core.structures import general_structures, structures_that_are
from accelscope.core.structures.naive import Naive
from accelscope.sample_scenes import make_sample


class ShadowsOnly(Naive):
    """As a light buffer will be: for shadow rays, built from the lights."""

    name = "shadows_only"
    answers = ("shadow",)
    needs = frozenset({GEOMETRY, LIGHTS})


@pytest.fixture(scope="module")
def scene():
    return make_sample("soup:count=20")


def rays_of(classes):
    origins, directions = np.zeros((3, 3)), np.eye(3)
    return Rays.from_arrays(
        origins, directions, classes=np.array(classes), class_names=("primary", "shadow")
    )


def test_what_answers_every_class_needs_geometry_alone():
    for structure in general_structures().values():
        assert structure.needs == {GEOMETRY}


def test_rays_of_another_class_are_refused_by_its_name(scene):
    structure = ShadowsOnly.build(scene, Naive.Settings())
    hits, _ = structure.trace(rays_of([1, 1, 1]))
    want, _ = Naive.build(scene, Naive.Settings()).trace(rays_of([1, 1, 1]))
    assert np.array_equal(hits.t, want.t)
    with pytest.raises(InputError, match="shadows_only answers shadow rays only, not primary ones"):
        structure.trace(rays_of([1, 0, 1]))


def test_what_it_needs_may_not_move(scene):
    lit = dataclasses.replace(scene, lights=(Light(SUN, direction=np.array([0.0, 0.0, -1.0])),))
    other = dataclasses.replace(scene, lights=(Light(SUN, direction=np.array([1.0, 0.0, 0.0])),))
    seen = dataclasses.replace(lit, camera=Camera(np.zeros(3), np.ones(3), np.eye(3)[2], 45.0))
    assert moved(ShadowsOnly.needs, lit, lit) == moved(Naive.needs, lit, other) == ""
    assert moved(ShadowsOnly.needs, lit, other) == "the lights were changed"
    assert moved(ShadowsOnly.needs, lit, seen) == ""
    assert moved(frozenset({CAMERA}), lit, seen) == "the camera was moved"


def test_who_can_what():
    assert [each.name for each in structures_that_are(Refittable)] == ["bvh", "two_level"]
    assert [each.name for each in structures_that_are(Linked)] == ["kdtree", "octree"]
    assert [each.name for each in structures_that_are(Skipping)] == ["macro_grid"]
