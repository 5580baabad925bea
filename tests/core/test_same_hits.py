"""Every structure returns the very bits of brute force, on every ray we can think of."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, ULPS, Rays


def promised(name, text, names, lab):
    """Mask of the rays that a structure promises to get right."""
    if name in ("grid", "macro_grid") and "overlap=open" in text:
        return np.isin(names, lab.GENERIC)
    return np.ones(len(names), dtype=bool)


def skip_if_backs_are_culled(text):
    if "cull=true" in text:
        pytest.skip("what is hit from behind is missed, see test_back_faces.py")


def test_hits_are_those_of_brute_force(lab, build, variant, scene_name):
    name, text = variant
    skip_if_backs_are_culled(text)
    rays, names, want, _ = lab.truth(scene_name)
    mask = promised(name, text, names, lab)
    rays, names = rays.select(mask), names[mask]
    want = type(want)(want.t[mask], want.primitive[mask])
    structure = build(name, lab.small_scene(scene_name), text)
    assert structure.validate() == []
    closest, _ = structure.trace(rays, CLOSEST)
    assert lab.differences(names, want, closest) == {}
    everything, _ = structure.trace(rays, ALL)
    assert lab.differences(names, want, everything) == {}
    some, _ = structure.trace(rays, ANY)
    assert lab.any_differences(names, want, some) == {}


def test_rays_in_walls_of_cells(lab, build, variant, scene_name):
    name, text = variant
    skip_if_backs_are_culled(text)
    if name in ("grid", "macro_grid") and "overlap=open" in text:
        pytest.skip("an open grid may lose rays that run exactly in walls")
    scene = lab.small_scene(scene_name)
    structure = build(name, scene, text)
    rays, names = lab.batch_of(lab.wall_rays(structure, 150))
    want, _ = build("naive", scene).trace(rays)
    got, _ = structure.trace(rays)
    assert lab.differences(names, want, got) == {}


def test_brute_force_meets_every_family(lab, scene_name):
    """The comparison is worth something: most families of rays do hit."""
    _, names, hits, n_hit = lab.truth(scene_name)
    hit = set(names[hits.primitive >= 0])
    families = {name for name in names if not name.endswith((" t", " t-", " t/2"))}
    assert len(families - hit) <= (12 if scene_name in ("one", "flat") else 3), families - hit
    assert n_hit > 500


def test_a_ray_that_ends_at_its_hit_has_it_and_one_that_ends_before_has_not(lab, scene_name):
    rays, names, hits, n = lab.truth(scene_name)
    at, before, half = (slice(len(names) - k * n, len(names) - (k - 1) * n) for k in (3, 2, 1))
    assert (hits.t[at] == rays.t_max[at]).all()
    for ends in (before, half):
        nearer = hits.t[at] > rays.t_max[ends]  # t may be zero
        assert (hits.primitive[ends][nearer] == -1).all()


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
def test_grid_keeps_rays_whose_inverse_direction_overflows(lab, build, scene_name, name):
    """Beside a wall, such a ray gave 0 * inf for the crossing of that wall."""
    scene = lab.small_scene(scene_name)
    grid = build(name, scene, "resolution=6x6x6")
    reach = np.abs([scene.lower, scene.upper]).max(axis=0)
    rng = np.random.default_rng(5)
    origins, directions = [], []
    for axis in range(3):
        for place, sign in itertools.product(grid.walls(axis)[1:-1], (1.0, -1.0)):
            # Origins that the ray's own slack moves exactly onto the wall.
            o = place - sign * ULPS * (abs(place) + reach[axis])
            near = o + np.arange(-8, 9) * np.spacing(o)
            onto = near[near + sign * (ULPS * (np.abs(near) + reach[axis])) == place]
            for o in onto:
                start = scene.lower + rng.random((40, 3)) * (scene.upper - scene.lower)
                toward = rng.normal(size=(40, 3))
                start -= toward * scene.diagonal
                start[:, axis], toward[:, axis] = o, sign * 1e-310
                origins.append(start)
                directions.append(toward)
    rays = Rays.from_arrays(np.concatenate(origins), np.concatenate(directions))
    want, _ = build("naive", scene).trace(rays)
    got, _ = grid.trace(rays)
    np.testing.assert_array_equal(got.t, want.t)
    np.testing.assert_array_equal(got.primitive, want.primitive)
    assert scene_name == "one" or (want.primitive >= 0).sum() > 20
