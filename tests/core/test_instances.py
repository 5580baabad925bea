# SPDX-License-Identifier: GPL-3.0-or-later
"""Instances one, two and three levels deep: every structure has naive's hits, bit for bit."""

import os
import subprocess
import sys

import numpy as np
import pytest
from accelscope.core.contract.structure import arrays_in
from accelscope.core.errors import InputError
from accelscope.core.geometry.instances import instanced, owners_of
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structure_named
from accelscope.sample_scenes import make_sample


def matrices(rng, count, scale=0.4):
    """Sheared and mirrored ones, far apart; the fourth is singular, so is the fifth."""
    linear = rng.normal(size=(count, 3, 3)) * scale
    linear[::3, 0] *= -1.0
    linear[3:4], linear[4:5, :, 0] = 0.0, 0.0
    return np.concatenate([linear, 4.0 * rng.normal(size=(count, 3, 1))], axis=2)


def scene_of(levels, rng=None):
    rng = rng or np.random.default_rng(1)
    meshes = [all_triangles(make_sample(f"tetra:size={size}").triangles) for size in (2, 3)]
    geometry = instanced(meshes, rng.integers(0, 2, 20), matrices(rng, 20))
    for _ in range(levels - 1):
        geometry = instanced([geometry], np.zeros(4), matrices(rng, 4, 0.6)[[0, 1, 2, 3]])
    return Scene.from_instances(geometry, f"{levels} levels")


def rays_through(scene, count=300, seed=2, **columns):
    rng = np.random.default_rng(seed)
    corners = scene.flat().triangles
    targets = corners[rng.integers(0, len(corners), count)].mean(axis=1)
    origins = scene.lower + rng.normal(size=(count, 3)) * scene.diagonal
    return Rays.from_arrays(origins, targets - origins, **columns)


def traced(name, scene, rays, query=None):
    kind = structure_named(name)
    structure = kind.build(scene, kind.Settings())
    return structure, *structure.trace(rays, query)


@pytest.mark.parametrize("levels", [1, 2, pytest.param(3, marks=pytest.mark.exhaustive)])
def test_hierarchies_have_naives_hits(levels):
    check("bvh", levels)


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", sorted(set(general_structures()) - {"bvh", "naive"}))
@pytest.mark.parametrize("levels", [1, 2])
def test_all_structures_have_naives_hits(name, levels):
    check(name, levels)


def check(name, levels):
    scene = scene_of(levels)
    rays = rays_through(scene)
    _, expected, _ = traced("naive", scene, rays)
    assert (expected.primitive >= 0).mean() > 0.4  # singular ones are aimed at, too
    for query in (None, ALL):
        structure, hits, counts = traced(name, scene, rays, query)
        np.testing.assert_array_equal(hits.t, expected.t)
        np.testing.assert_array_equal(hits.primitive, expected.primitive)
    _, any_hits, _ = traced(name, scene, rays, ANY)
    np.testing.assert_array_equal(any_hits.primitive >= 0, expected.primitive >= 0)
    assert structure.validate() == []
    names = {counter.name for counter in counts.counters}
    assert {f"N_IT_{level}" for level in range(1, levels + 1)} <= names
    for index in range(3):
        steps = structure.record(rays, index, ALL)
        assert steps.tally() == {name: int(each[index]) for name, each in counts.by_name().items()}


def test_the_same_triangles_in_world_space_are_hit_at_nearly_the_same_t():
    """Within 64 units in the last place of the coordinates that the ray passes.

    And as much more as the matrix is worse than a rotation: that is how it carries roundings on.
    """
    scene = scene_of(1)
    rays = rays_through(scene, 2000)
    _, kept, _ = traced("bvh", scene, rays)
    flat = scene.flat()
    assert len(flat) == scene.geometry.first[-1]
    _, world, _ = traced("bvh", flat, rays)
    # What a singular matrix has made flat is met in world space alone; and where a ray passes an
    # edge within rounding, one of them may miss.
    is_flat = np.isin(owners_of(scene.geometry, world.primitive)[0], [3, 4])
    assert ((kept.primitive >= 0) == (world.primitive >= 0))[~is_flat].mean() > 0.999
    both = (kept.primitive >= 0) & (kept.primitive == world.primitive)
    apart = np.abs(kept.t[both] - world.t[both]) * np.linalg.norm(rays.directions[both], axis=1)
    size = np.abs(rays.origins[both]).max(axis=1) + scene.diagonal
    owners, _ = owners_of(scene.geometry, kept.primitive[both])
    condition = np.linalg.cond(scene.geometry.matrices[owners, :, :3])
    assert (apart <= 64 * np.finfo(np.float64).eps * size * condition).all()
    # Where two triangles of neighbours lie on each other, rounding decides between them.
    assert both.sum() > 0.99 * (kept.primitive >= 0).sum()


def test_a_translated_mesh_has_the_hits_of_the_mesh():
    mesh = make_sample("tetra:size=3").triangles
    shift = np.array([8.0, -4.0, 2.0])
    place = np.concatenate([np.eye(3), shift[:, None]], axis=1)
    scene = Scene.from_instances(instanced([all_triangles(mesh)], [0], place[None]), "moved")
    alone = Scene.from_triangles(mesh, "alone")
    # Numbers with few digits: moving them rounds nothing.
    rng = np.random.default_rng(4)
    origins = np.round(rng.normal(size=(500, 3)) * 64.0) / 16.0
    directions = np.round((rng.random((500, 3)) * 2.0 - 1.0 - origins) * 64.0) / 64.0
    here = Rays.from_arrays(origins, directions + (directions == 0.0).all(axis=1, keepdims=True))
    there = Rays.from_arrays(origins + shift, here.directions)
    _, expected, _ = traced("bvh", alone, here)
    _, hits, _ = traced("bvh", scene, there)
    np.testing.assert_array_equal(hits.primitive, expected.primitive)
    np.testing.assert_array_equal(hits.t, expected.t)


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1e3, 1e6])
def test_scaled_instances_lose_no_hit(scale):
    mesh = all_triangles(make_sample("tetra:size=3").triangles)
    rng = np.random.default_rng(7)
    places = matrices(rng, 3, scale)
    places[:, :, 3] *= scale
    scene = Scene.from_instances(instanced([mesh], [0, 0, 0], places), "scaled")
    rays = rays_through(scene, 500)
    _, expected, _ = traced("naive", scene, rays)
    _, hits, _ = traced("bvh", scene, rays)
    assert (expected.primitive >= 0).any()
    np.testing.assert_array_equal(hits.t, expected.t)
    np.testing.assert_array_equal(hits.primitive, expected.primitive)


def test_of_coincident_instances_the_first_is_hit():
    mesh = all_triangles(make_sample("tetra:size=2").triangles)
    place = np.concatenate([np.eye(3), np.zeros((3, 1))], axis=1)
    geometry = instanced([mesh], [0, 0, 0], np.stack([place] * 3))
    scene = Scene.from_instances(geometry, "coincident")
    rays = rays_through(scene, 300)
    for name in ("naive", "bvh"):
        _, hits, _ = traced(name, scene, rays)
        owners, within = owners_of(geometry, hits.primitive)
        assert set(owners[hits.primitive >= 0]) == {0}
        assert within.max() < len(mesh.ids)
        assert (owners[hits.primitive < 0] == -1).all()


def test_masks_hide_instances():
    mesh = all_triangles(make_sample("tetra:size=2").triangles)
    place = np.concatenate([np.eye(3), np.zeros((3, 1))], axis=1)
    geometry = instanced([mesh], [0, 0], np.stack([place] * 2), masks=[0b01, 0b10])
    scene = Scene.from_instances(geometry, "masked")
    for mask, expected in ((0b01, {0}), (0b10, {1}), (0b11, {0}), (0b100, set())):
        rays = rays_through(scene, 200, masks=mask)
        _, hits, _ = traced("bvh", scene, rays)
        assert set(owners_of(geometry, hits.primitive)[0][hits.primitive >= 0]) == expected


def test_a_singular_matrix_is_never_hit():
    mesh = all_triangles(make_sample("tetra:size=2").triangles)
    flat = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, 0.0, 0.5]])
    usual = np.concatenate([np.eye(3), np.full((3, 1), 5.0)], axis=1)
    scene = Scene.from_instances(instanced([mesh], [0, 0], [flat, usual]), "flat")
    rays = Rays.from_arrays(np.array([[0.0, 0.0, 9.0]]), np.array([[0.01, 0.02, -1.0]]))
    _, hits, _ = traced("bvh", scene, rays)
    assert hits.primitive[0] == -1


def test_a_hundred_thousand_instances_are_small():
    """200 bytes each, the hierarchy's nodes among them; measured over fewer."""
    count = 20_000
    rng = np.random.default_rng(9)
    mesh = all_triangles(make_sample("tetra:size=4").triangles)
    scene = Scene.from_instances(instanced([mesh], np.zeros(count), matrices(rng, count)), "many")
    structure = structure_named("bvh").build(scene, structure_named("bvh").Settings())
    held = sum(array.nbytes for array in arrays_in(structure.geometry))
    shared = sum(array.nbytes for array in arrays_in(structure.geometry.items))
    nodes = sum(array.nbytes for array in arrays_in(structure.arrays))
    assert (held - shared + nodes) / count < 200
    # The memory of a structure is both, without the triangles of the meshes.
    assert structure.memory() == nodes + held - shared


def test_refusals():
    mesh = all_triangles(make_sample("tetra:size=2").triangles)
    place = np.concatenate([np.eye(3), np.zeros((3, 1))], axis=1)
    with pytest.raises(InputError, match="there are no instances"):
        instanced([mesh], [], np.empty((0, 3, 4)))
    with pytest.raises(InputError, match="matrix of instance 1 is not finite"):
        instanced([mesh], [0, 0], np.stack([place, place * np.nan]))
    inner = instanced([mesh], [0], place[None])
    with pytest.raises(InputError, match="of one kind"):
        instanced([mesh, inner], [0, 1], np.stack([place] * 2))
    for _ in range(2):
        inner = instanced([inner], [0], place[None])
    with pytest.raises(InputError, match="3 deep"):
        instanced([inner], [0], place[None])


@pytest.mark.exhaustive
def test_two_and_three_levels_come_from_the_cache_of_another_process(tmp_path):
    script = """
import sys
from accelscope.core.kernel_cache import set_cache_root
set_cache_root(sys.argv[1])
sys.path.insert(0, sys.argv[2])
from test_instances import rays_through, scene_of, traced
for levels in (2, 3):
    scene = scene_of(levels)
    _, hits, _ = traced("bvh", scene, rays_through(scene))
    print(hits.t.tobytes().hex(), hits.primitive.tobytes().hex())
"""
    here = os.path.dirname(__file__)
    outputs = [
        subprocess.run(
            [sys.executable, "-c", script, str(tmp_path), here],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for _ in range(2)
    ]
    assert outputs[0] == outputs[1] != ""
