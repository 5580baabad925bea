"""Scenes of any size that is accepted, and of any thinness: the same hits, figures, no alarm."""

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.kinds import KINDS
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures

CASES = Path(__file__).parent / "cases"

STRUCTURES = [
    *((name, "") for name in general_structures() if name not in ("naive", "bvh")),
    ("grid", "assignment=exact"), ("macro_grid", "resolution=16x16x16"),
    ("macro_grid", "rule=regular,density=0.1,regions=octant"), ("octree", "planes=adaptive"),
    ("bsp", "planes=fixed"), ("sorted_volumes", "volume=obb_and_kdop14"), ("bvh", "builder=sbvh"),
    *(("bvh", f"volume={kind}") for kind in KINDS),
]  # fmt: skip


def shape(rng):
    """Triangles scattered in a cube of about the unit size."""
    return rng.random((100, 1, 3)) + 0.15 * rng.normal(size=(100, 3, 3))


def families(rng, scene, count=60):
    """Rays from outside, from inside and from vertices, to points of faces and along axes."""
    triangles, size = scene.triangles, (scene.upper - scene.lower).max()

    def on_faces():
        some = triangles[rng.integers(len(triangles), size=count)]
        return (some * rng.dirichlet([1, 1, 1], size=count)[:, :, None]).sum(axis=1)

    outside = scene.lower + 3 * size * rng.normal(size=(count, 3))
    inside = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    vertices = triangles[rng.integers(len(triangles), size=count), 0]
    axis = np.eye(3)[rng.integers(3, size=count)]
    return {
        "outside": (outside, on_faces() - outside),
        "inside": (inside, on_faces() - inside),
        "vertices": (vertices, rng.normal(size=(count, 3))),
        "in the plane": (vertices, on_faces() - vertices),
        "axis": (on_faces() - 3 * size * axis, axis),
    }


def check(lab, build, scene, name, text, rays, names):
    truth = build("naive", scene).trace(rays)[0]
    # Half of them at least are aimed at a triangle; in the thinnest scenes some pass beside it.
    assert (truth.primitive >= 0).sum() > len(rays) / 4
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        structure = build(name, scene, text)
        assert lab.differences(names, truth, structure.trace(rays)[0]) == {}
        assert structure.validate() == []
        json.dumps(structure.statistics().to_json(), allow_nan=False)
        structure.cells()


@pytest.mark.parametrize(("name", "text"), STRUCTURES)
def test_sizes(lab, build, name, text):
    for scale in (1e-90, 1e-60, 1e60, 1e90, 1e99):
        for stretch in ([1, 1, 1], [1, 1, 0], [1e-30, 1, 1]):
            rng = np.random.default_rng(1)
            scene = Scene.from_triangles(shape(rng) * scale * stretch, "scaled")
            rays, names = lab.batch_of(families(rng, scene))
            check(lab, build, scene, name, text, rays, names)


@pytest.mark.parametrize(("name", "text"), STRUCTURES)
def test_thin_axes(lab, build, name, text):
    for thickness in (1e-12, 1e-40, 1e-99, 1e-101, 1e-290, 1e-310, 5e-324):
        rng = np.random.default_rng(2)
        scene = Scene.from_triangles(shape(rng) * [1, 1, thickness], "thin")
        rays, names = lab.batch_of(families(rng, scene))
        check(lab, build, scene, name, text, rays, names)
    rng = np.random.default_rng(3)
    scene = Scene.from_triangles(shape(rng) * [1, 1e-40, 1e-80], "thinner and thinner")
    rays, names = lab.batch_of(families(rng, scene))
    check(lab, build, scene, name, text, rays, names)


@pytest.mark.parametrize(("name", "text"), STRUCTURES)
@pytest.mark.parametrize("case", ["subnormal_axis", "big_1e90"])
def test_the_cases(lab, build, case, name, text):
    scene = load_mesh_file(CASES / f"{case}.off")
    rng = np.random.default_rng(4)
    some = families(rng, scene)
    if case == "subnormal_axis":
        with np.load(CASES / f"{case}_rays.npz") as arrays:
            some["file"] = arrays["origins"], arrays["directions"]
    rays, names = lab.batch_of(some)
    check(lab, build, scene, name, text, rays, names)


def test_what_is_too_thin_is_flat_and_said():
    scene = load_mesh_file(CASES / "subnormal_axis.off")
    assert scene.upper[2] == scene.lower[2] == 0.0
    assert (scene.triangles[:, :, 2] == 0.0).all()
    assert len(scene.notes) == 1
    assert "taken as flat" in scene.notes[0]
    # A millionth of a millionth is thin, but not flat.
    rng = np.random.default_rng(5)
    triangles = shape(rng) * [1, 1e-12, 1]
    scene = Scene.from_triangles(triangles, "thin")
    assert np.array_equal(scene.triangles, triangles)
    assert scene.notes == ()


def test_a_scene_that_is_thin_along_two_axes_is_refused():
    triangles = shape(np.random.default_rng(6)) * [1, 1e-150, 1e-310]
    with pytest.raises(InputError, match="zero area"):
        Scene.from_triangles(triangles, "line")


def test_areas_and_volumes_scale(build):
    """By a power of two, to the last bit."""
    triangles = shape(np.random.default_rng(7))
    for kind in KINDS:
        one = build("bvh", Scene.from_triangles(triangles, "one"), f"volume={kind}")
        for power in (-200, 200, 300):
            scaled = Scene.from_triangles(triangles * 2.0**power, "scaled")
            other = build("bvh", scaled, f"volume={kind}")
            assert np.array_equal(other.areas, np.ldexp(one.areas, 2 * power)), kind
            assert other.statistics().sah == one.statistics().sah
