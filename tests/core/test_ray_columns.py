# SPDX-License-Identifier: GPL-3.0-or-later
"""What a batch says of its rays: checked, honoured by every structure, written and read again."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.ray_files import columns_of, read_rays
from accelscope.core.geometry.rays import Rays, joined_rays
from accelscope.core.structures import general_structures, structures
from accelscope.sample_scenes import make_sample

ORIGINS, DIRECTIONS = np.zeros((3, 3)), np.ones((3, 3))


@pytest.mark.parametrize("name", general_structures())
def test_a_ray_begins_at_t_min(name):
    """What it would hit before does not count: the hits are those of a ray that starts there."""
    scene = make_sample("soup:count=200,edge=0.4")
    kind = structures()[name]
    baseline = structures()["naive"]
    structure, naive = (each.build(scene, each.Settings()) for each in (kind, baseline))
    rng = np.random.default_rng(6)
    targets = scene.triangles[rng.integers(0, len(scene), 400)].mean(axis=1)
    origins = np.round(rng.normal(size=(400, 3)) * 8.0) / 4.0
    directions = np.round((targets - origins) * 64.0) / 64.0
    t_min = np.round(rng.random(400) * 8.0) / 8.0
    late = Rays.from_arrays(origins, directions, t_min=t_min)
    hits, _ = structure.trace(late)
    expected, _ = naive.trace(late)
    np.testing.assert_array_equal(hits.t, expected.t)
    np.testing.assert_array_equal(hits.primitive, expected.primitive)
    # Few digits: that the origin is moved rounds nothing but t itself.
    moved, _ = naive.trace(Rays.from_arrays(origins + t_min[:, None] * directions, directions))
    np.testing.assert_array_equal(hits.primitive, moved.primitive)
    found = hits.primitive >= 0
    assert found.sum() > 50
    assert (hits.t >= t_min)[found].all()
    np.testing.assert_allclose(hits.t[found], (moved.t + t_min)[found], rtol=1e-13)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"t_min": -1.0}, "t_min of a ray must be finite"),
        ({"t_min": np.nan}, "t_min of a ray must be finite"),
        ({"t_min": 2.0, "t_max": 1.0}, "at most its t_max"),
        ({"times": 1.5}, "time of a ray must be between 0 and 1"),
        ({"times": np.nan}, "time of a ray must be between 0 and 1"),
        ({"classes": 1}, "class 1, which has no name"),
        ({"masks": 256}, "mask of a ray must be a whole number that fits into uint8"),
        ({"pixels": 2.5}, "pixel of a ray must be a whole number"),
        ({"sources": [1, 2]}, r"source must have one value per ray \(3\)"),
    ],
)
def test_what_is_no_ray_is_refused(columns, words):
    with pytest.raises(InputError, match=words):
        Rays.from_arrays(ORIGINS, DIRECTIONS, **columns)


def full_batch():
    return Rays.from_arrays(
        ORIGINS + np.arange(3)[:, None], DIRECTIONS, [1.0, 2.0, np.inf], t_min=[0.0, 0.5, 0.25],
        queries=[0, 1, 2], classes=[1, 0, 1], class_names=("primary", "shadow"),
        sources=[-1, 5, 6], targets=[0, 1, -1], times=[0.0, 0.5, 1.0], masks=[1, 2, 255],
        pixels=[7, 8, 9],
    )  # fmt: skip


def same(a, b):
    for field in dataclasses.fields(Rays):
        np.testing.assert_array_equal(getattr(a, field.name), getattr(b, field.name))


def test_files_hold_all_of_it(tmp_path):
    np.savez(tmp_path / "rays.npz", **columns_of(full_batch()))
    same(read_rays(tmp_path / "rays.npz"), full_batch())


def test_classes_without_names_are_numbered(tmp_path):
    path = tmp_path / "rays.npz"
    np.savez(path, origins=ORIGINS, directions=DIRECTIONS, ray_class=[0, 2, 1])
    assert read_rays(path).class_names == ("class 0", "class 1", "class 2")
    np.savez(path, origins=ORIGINS, directions=DIRECTIONS)
    assert read_rays(path).class_names == ("file",)
    np.savez(path, origins=ORIGINS, directions=DIRECTIONS, class_names=np.array([1, 2]))
    with pytest.raises(InputError, match="class_names must be a short list of words"):
        read_rays(path)


def test_batches_are_joined_and_chosen_from():
    whole = full_batch()
    parts = [whole.select(np.array([0])), whole.select(np.array([False, True, True]))]
    same(joined_rays(parts), whole)
