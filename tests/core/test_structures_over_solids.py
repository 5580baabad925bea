"""Every structure over elementary solids: the hits of testing each item, bit for bit."""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import (
    Box,
    Cone,
    Disc,
    MovingTriangle,
    Placed,
    Polygon,
    Sphere,
    Triangle,
)
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.scene import Scene
from solids_reference import trace


def some_items(count=300, seed=0):
    """Items of every kind, of many sizes, some of them twice and some touching each other."""
    rng = np.random.default_rng(seed)
    items = []
    while len(items) < count:
        at, size = 3 * rng.normal(size=3), float(10 ** rng.uniform(-2, 0.2))
        a, b, c = size * rng.normal(size=(3, 3))
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.3, 2, 3)
        ring = size * np.stack([np.cos(np.arange(7.0)), np.sin(np.arange(7.0))], axis=1)
        items += [
            Sphere(at, size), Cone(at, at + a, size, size), Cone(at, at + a, size, 0.0),
            Cone(at, at + b, size, 0.5 * size, False), Box(at, at + np.abs(a)), Disc(at, b, size),
            Polygon(at + ring @ np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]),
            Triangle((at + a, at + b, at + c)),
            MovingTriangle((at + a, at + b, at + c), (at + b, at + c, at + a)),
            Placed(Sphere((0, 0, 0), size), np.column_stack([turn, at])),
            Placed(Cone((0, 0, 0), (0, 0, size), size, 0.2), np.column_stack([turn, at])),
        ]  # fmt: skip
        items += [Sphere(at + 2 * size * np.eye(3)[0], size), Box(at, at + np.abs(a))]
    return items


def scene_of(items):
    geometry = mixed_of(items)
    lower, upper = geometry.boxes[:, :3].min(axis=0), geometry.boxes[:, 3:].max(axis=0)
    count = len(items)
    return Scene(
        "solids", "solids", geometry, np.arange(count, dtype=np.int32), 0,
        np.zeros(count, np.int32), ("solids",), lower, upper,
    )  # fmt: skip


def some_rays(scene, count=1500):
    rng = np.random.default_rng(1)
    origins, directions = random_lines(scene.lower, scene.upper, count, 1)
    inside = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    unit = np.eye(3)[rng.integers(3, size=count)] * rng.choice([-1.0, 1.0], (count, 1))
    t_min = np.concatenate([np.zeros(2 * count), np.full(count, 0.4)])
    return Rays.from_arrays(
        np.vstack([origins, inside, inside]), np.vstack([directions, unit, directions]),
        t_min=t_min, times=rng.random(3 * count),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("bvh", ""),
        *(
            pytest.param(*case, marks=pytest.mark.exhaustive)  # each compiles a walk of its own
            for case in (
                ("naive", ""),
                ("sorted_volumes", ""),
                ("sorted_volumes", "volume=sphere"),
                ("grid", ""),
                ("grid", "assignment=exact"),
                ("macro_grid", ""),
                ("octree", ""),
                ("kdtree", ""),
                ("kdtree", "planes=cyclic,walk=march"),
                ("bvh", "volume=obb"),
                ("bvh", "volume=kdop14"),
                ("bvh", "volume=sphere"),
                ("bvh", "arity=4"),
            )
        ),
    ],
)
def test_hits_are_those_of_testing_each(build, name, settings):
    scene = scene_of(some_items())
    rays = some_rays(scene)
    hits, _ = build(name, scene, settings).trace(rays)
    t, primitive = trace(mixed_of(some_items()), rays)
    assert (primitive >= 0).sum() > 1000
    np.testing.assert_array_equal(hits.t, t)
    np.testing.assert_array_equal(hits.primitive, primitive)


@pytest.mark.exhaustive
def test_solids_may_be_instances(build):
    """A mesh of solids in several places: the same hits through any structure over the places."""
    items = some_items(60)
    meshes = [mixed_of(items[:30]), mixed_of(items[30:])]
    rng = np.random.default_rng(3)
    matrices = np.concatenate([rng.normal(size=(8, 3, 3)), 5 * rng.normal(size=(8, 3, 1))], axis=2)
    which = np.arange(8) % 2
    scene = Scene.from_instances(instanced(meshes, which, matrices), "placed")
    rays = some_rays(scene, 3000)
    hits, _ = build("bvh", scene).trace(rays)
    expected, _ = build("naive", scene).trace(rays)
    assert (expected.primitive >= 0).sum() > 500
    np.testing.assert_array_equal(hits.t, expected.t)
    np.testing.assert_array_equal(hits.primitive, expected.primitive)
    # Moved one by one, a sphere is hit at the same t, but for rounding.
    spheres = [Sphere((0, 0, 0), 1), Sphere((1, 2, 0.5), 0.5)]
    placed = mixed_of([Placed(sphere, matrix) for matrix in matrices for sphere in spheres])
    balls = instanced([mixed_of(spheres)], np.zeros(8, int), matrices)
    t, _ = trace(placed, rays)
    hits, _ = build("naive", Scene.from_instances(balls, "balls")).trace(rays)
    both = np.isfinite(t) & np.isfinite(hits.t)
    assert both.sum() > 150
    assert (np.isfinite(t) != np.isfinite(hits.t)).mean() < 1e-3
    np.testing.assert_allclose(hits.t[both], t[both], rtol=1e-6)
