"""Rays from any distance and of any length hit the same in every structure."""

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures

STRUCTURES = [
    *((name, "") for name in general_structures() if name != "naive"),
    ("grid", "resolution=9x9x9,assignment=exact,mailbox=true"),
    ("macro_grid", "resolution=12x12x12,regions=octant"), ("bsp", "planes=fixed"),
    ("bvh", "volume=obb"), ("bvh", "volume=kdop26"), ("sorted_volumes", "volume=smallest_sphere"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text"), STRUCTURES)
def test_from_far_away(lab, build, name, text):
    scene = lab.small_scene("soup")
    rng = np.random.default_rng(1)
    size = float((scene.upper - scene.lower).max())
    families = {}
    for far in (1e7, 1e10, 1e12, 1e14, 3e14, 1e15, 1e16, 1e18, 1e60, 1e200):
        some = scene.triangles[rng.integers(len(scene), size=200)]
        points = (some * rng.dirichlet([1, 1, 1], size=200)[:, :, None]).sum(axis=1)
        points[::3] = some[::3, 0]
        away = lab.unit(rng, 200)
        away[::5] = np.eye(3)[rng.integers(3, size=40)]
        families[f"{far:g}"] = points - far * size * away, away
    rays, names = lab.batch_of(families)
    truth = build("naive", scene).trace(rays)[0]
    assert (truth.primitive >= 0).sum() > 900
    structure = build(name, scene, text)
    assert lab.differences(names, truth, structure.trace(rays)[0]) == {}


def test_the_log_of_a_far_ray_is_what_was_counted(build, lab):
    scene = lab.small_scene("soup")
    origin = 0.5 * (scene.lower + scene.upper) - 1e9 * np.array([[0.0, 0.6, 0.8]])
    rays = Rays.from_arrays(origin, np.array([[0.0, 0.6, 0.8]]))
    for name in ("grid", "macro_grid"):
        grid = build(name, scene)
        counters = grid.trace(rays)[1]
        assert counters["N_TS"][0] >= 3
        assert grid.record(rays, 0).tally() == {k: int(v) for k, v in counters.means().items()}


@pytest.mark.parametrize(("name", "text"), STRUCTURES)
def test_of_any_length(lab, build, name, text):
    for scale in (1e-90, 1.0, 1e90):
        rng = np.random.default_rng(2)
        triangles = rng.random((80, 1, 3)) + 0.2 * rng.normal(size=(80, 3, 3))
        scene = Scene.from_triangles(triangles * scale, "scaled")
        families = {}
        for length in (1e-190, 1e-150, 1e150, 1e190):
            origins = scale * 4 * rng.normal(size=(60, 3))
            targets = scene.triangles[rng.integers(80, size=60)].mean(axis=1)
            away = (targets - origins) / scale
            away[::4, 1] *= 1e-20
            families[f"{length:g}"] = origins, length * away / 20
        rays, names = lab.batch_of(families)
        truth = build("naive", scene).trace(rays)[0]
        # All are aimed at a triangle, and three in four hit one.
        assert (truth.primitive >= 0).sum() > len(rays) / 2
        structure = build(name, scene, text)
        assert lab.differences(names, truth, structure.trace(rays)[0]) == {}
