# SPDX-License-Identifier: GPL-3.0-or-later
"""Back faces that are culled: no ray hits one, whatever its cell lists."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.icosphere import icosphere
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.scene import Scene
from ray_space_cases import awkward


def ball(levels=3):
    """A closed mesh whose faces are turned outward."""
    return Scene.from_triangles(icosphere(levels), "ball")


def fronts_only(build, scene, rays, query):
    """What naive hits if each ray is given only the triangles that it sees from the front."""
    corners = scene.geometry.corners
    edges = corners[:, 1:] - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    t, primitive = np.full(len(rays), np.inf), np.full(len(rays), -1)
    ways, which = np.unique(rays.directions, axis=0, return_inverse=True)
    for number, way in enumerate(ways):
        # Those that are seen edge-on have no side.
        side = normals @ way / np.linalg.norm(way)
        fronts = np.flatnonzero(side <= 1e-9 * np.linalg.norm(normals, axis=1))
        mine = np.flatnonzero(which.ravel() == number)
        if len(fronts):
            part = build("naive", Scene.from_triangles(corners[fronts], "fronts"))
            hits, _ = part.trace(rays.select(mine), query)
            t[mine] = hits.t
            primitive[mine] = np.where(hits.primitive >= 0, fronts[hits.primitive], -1)
    return t, primitive


def rays_in_few_directions(scene, count=2400):
    """Rays from inside, outside and far away, in some hundred directions."""
    rng = np.random.default_rng(8)
    size = scene.upper - scene.lower
    origins = scene.lower + (3.0 * rng.random((count, 3)) - 1.0) * size
    origins[::7] = scene.lower + rng.random((len(origins[::7]), 3)) * size
    ways = rng.normal(size=(120, 3))
    ways[:12] = np.concatenate([np.eye(3), -np.eye(3)] * 2)
    directions = ways[rng.integers(len(ways), size=count)]
    origins[::11] -= 1e5 * directions[::11]
    return Rays.from_arrays(origins, directions)


@pytest.mark.parametrize("text", ["", "min_rays=1,max_list_size=2", "min_rays=2,truncate=false"])
@pytest.mark.parametrize("name", ["suzanne", "ball"])
def test_hits_are_those_of_naive_over_what_is_seen_from_the_front(build, lab, name, text):
    scene = ball() if name == "ball" else lab.small_scene(name)
    rays = rays_in_few_directions(scene)
    structure = build("ray_classification", scene, f"cull=true,{text}")
    for query in (None, ALL):
        t, primitive = fronts_only(build, scene, rays, query)
        for _ in range(3):  # in cells that are divided meanwhile
            hits, _ = structure.trace(rays, query)
            np.testing.assert_array_equal(hits.primitive, primitive)
            np.testing.assert_array_equal(hits.t, t)
    blocked, _ = structure.trace(rays, ANY)
    np.testing.assert_array_equal(blocked.primitive >= 0, primitive >= 0)
    assert (primitive >= 0).sum() > 100


def test_of_a_closed_mesh_seen_from_outside_hits_are_those_of_naive_and_lists_shorter(build):
    scene = ball()
    rng = np.random.default_rng(3)
    begin = 4.0 * rng.normal(size=(20_000, 3))
    begin = begin[np.linalg.norm(begin, axis=1) > 1.1]
    rays = Rays.from_arrays(begin, rng.uniform(-1.0, 1.0, begin.shape) - begin)
    want, _ = build("naive", scene).trace(rays)
    tests, lists = {}, {}
    for cull in ("false", "true"):
        structure = build("ray_classification", scene, f"cull={cull}")
        hits, counts = structure.trace(rays)
        np.testing.assert_array_equal(hits.t, want.t)
        np.testing.assert_array_equal(hits.primitive, want.primitive)
        tests[cull] = counts["N_IT"].mean()
        lists[cull] = structure.statistics().extra["mean_list"]
    assert tests["true"] < 0.8 * tests["false"]
    assert lists["true"] < 0.8 * lists["false"]


def test_nothing_is_hit_from_inside_and_hardly_anything_tested(build):
    """What is tested turns its front to the ray, and lies behind where that begins."""
    scene = ball()
    rays = Rays.from_arrays(np.zeros((500, 3)), np.random.default_rng(1).normal(size=(500, 3)))
    tests = {}
    for cull in ("false", "true"):
        structure = build("ray_classification", scene, f"cull={cull},min_rays=1")
        hits, counts = structure.trace(rays)
        assert (hits.primitive == -1).all() == (cull == "true")
        tests[cull] = counts["N_IT"].sum()
    assert tests["true"] < 0.1 * tests["false"]


def test_a_mirrored_mesh_has_its_fronts_outside_too(build):
    """Corners that a matrix has mirrored run clockwise, and the scene says so."""
    scene = ball()
    mirrored = Scene.from_triangles(scene.triangles * (-1.0, 1.0, 1.0), "mirrored")
    mirrored = dataclasses.replace(mirrored, turned=np.ones(len(mirrored), dtype=bool))
    origins = np.array([(3.0, 0.1, 0.2), (0.0, 0.0, 0.0)])
    rays = Rays.from_arrays(origins, np.array([(-1.0, 0.0, 0.0), (-1.0, 0.1, 0.2)]))
    hits, _ = build("ray_classification", mirrored, "cull=true").trace(rays)
    assert (hits.primitive >= 0).tolist() == [True, False]
    assert 1.9 < hits.t[0] < 2.2


def test_a_recorded_walk_is_what_was_counted(build, lab):
    scene = lab.small_scene("sombrero")
    rays = awkward(scene, 60)
    structure = build("ray_classification", scene, "cull=true,min_rays=2")
    _, counts = structure.trace(rays)
    for index in range(0, len(rays), 17):
        expected = {name: int(each[index]) for name, each in counts.by_name().items()}
        assert structure.record(rays, index).tally() == expected
