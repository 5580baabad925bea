"""All sample scenes: announced sizes, determinism, cameras, refusals."""

import dataclasses
import math

import numpy as np
import pytest
from accelscope.core.contract.structure import arrays_in
from accelscope.core.errors import InputError
from accelscope.core.geometry.triangles import Triangles
from accelscope.core.settings import describe
from accelscope.sample_scenes import make_sample, sample_named, samples
from mesh_measures import areas

NAMES = list(samples())
SPD = {
    "balls", "gears", "jacks", "lattice", "mount", "rings", "shells", "sombrero", "teapot", "tetra",
    "tree",
}  # fmt: skip
"""Scenes of the Standard Procedural Databases."""


@pytest.mark.parametrize("name", NAMES)
def test_default_scene_is_small_and_as_large_as_announced(name):
    sample = sample_named(name)
    scene = make_sample(name)
    assert len(scene) == sample.count(sample.Settings()) <= 20_000
    assert scene.name == name
    assert scene.source == f"sample:{name}"
    assert scene.dropped == 0
    if isinstance(scene.geometry, Triangles):
        assert (areas(scene.triangles) > 0.0).all()
    assert len(scene.object_ids) == len(scene)
    assert set(scene.object_ids) == set(range(len(scene.object_names)))


@pytest.mark.parametrize("name", NAMES)
def test_generation_is_deterministic(name):
    first, second = make_sample(name).geometry, make_sample(name).geometry
    assert type(first) is type(second)
    for column, again in zip(arrays_in(first), arrays_in(second), strict=True):
        assert np.array_equal(column, again)


@pytest.mark.parametrize("name", NAMES)
def test_registry_says_what_a_menu_needs(name):
    sample = samples()[name]
    assert sample.name == name
    assert sample.label
    assert sample.summary
    assert all(row["label"] and row["description"] for row in describe(sample.Settings))
    assert dataclasses.is_dataclass(sample.Settings)


def test_own_cameras_see_their_scene():
    for name in (*sorted(SPD), "teapot_in_stadium"):
        scene = make_sample(name)
        assert scene.lights
        assert {light.kind for light in scene.lights} == {"point"}
        view = scene.camera.target - scene.camera.position
        boxes = scene.boxes()
        centres = (boxes[:, :3] + boxes[:, 3:]) / 2.0 - scene.camera.position
        if name == "teapot_in_stadium":
            # The whole stadium surrounds its camera; the teapot is what it has to see.
            centres = centres[scene.object_ids == 0]
        cosines = centres @ view / (np.linalg.norm(view) * np.linalg.norm(centres, axis=1))
        within = cosines > math.cos(math.radians(scene.camera.fov / 2.0))
        # The camera of the lattice stands inside of it.
        assert within.mean() > (0.25 if name == "lattice" else 0.75), name


def test_source_repeats_the_settings_that_differ_from_the_default():
    assert make_sample("tetra:size=3").source == "sample:tetra:size=3"
    assert make_sample("tetra:size=6").source == "sample:tetra"
    spec = "soup:count=7,edge=0.5,seed=3"
    scene = make_sample(spec)
    assert scene.source == f"sample:{spec}"
    again = make_sample(scene.source.removeprefix("sample:"))
    assert np.array_equal(scene.triangles, again.triangles)


# Refusals --------------------------------------------------------------------------------------


def test_unknown_sample_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"no sample scene 'tetrahedron'.*suzanne.*tetra.*soup"):
        make_sample("tetrahedron")


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("tetra:dept=3", "sample scene tetra has no setting 'dept'.*size"),
        ("tetra:size=0", "size must be at least 1 and at most 12, not 0"),
        ("tetra:size=13", "size must be .*at most 12"),
        ("tetra:size=deep", "size takes a whole number, not 'deep'"),
        ("tetra:size=2.5", "size takes a whole number"),
        ("mount:size=8", "size must be .*at most 7"),
        ("mount:sphere_subdivisions=2", "sample scene mount has no setting 'sphere_subdivisions'"),
        ("balls:size=7", "size must be .*at most 6"),
        ("lattice:size=0", "size must be at least 1"),
        ("sombrero:size=0", "size must be at least 1"),
        ("suzanne:subdivisions=7", "subdivisions must be .*at most 6"),
        ("soup:edge=0", "edge must be at least 1e-06"),
        ("soup:edge=nan", "edge must be finite"),
        ("soup:count=0", "count must be at least 1"),
        ("soup:seed=-1", "seed must be at least 0"),
        ("teapot_in_stadium:size_ratio=1", "size_ratio must be at least 1.5"),
        ("teapot_in_stadium:stand_height=inf", "stand_height must be finite"),
        ("bunny:size=2", "sample scene bunny has no setting 'size'"),
    ],
)
def test_bad_setting_is_refused_by_name(spec, message):
    with pytest.raises(InputError, match=message):
        make_sample(spec)


def test_settings_made_in_code_are_checked_too():
    sample = sample_named("tetra")
    with pytest.raises(InputError, match="size must be"):
        sample.generate(sample.Settings(size=40))


@pytest.mark.parametrize("spec", ["soup:count=1000000000", "tetra:size=12", "sombrero:size=9"])
def test_scene_that_does_not_fit_is_refused_before_allocating(spec, monkeypatch):
    monkeypatch.setattr("accelscope.core.memory.available_bytes", lambda: 2**30)
    name = spec.partition(":")[0]
    with pytest.raises(InputError, match=rf"sample scene {name} with \d+ items needs .*lower"):
        make_sample(spec)
