"""Shadow rays go to point, sun, spot and area lights, and only where these shine."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import CameraSettings, CameraWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.geometry.rays import ANY
from accelscope.core.scene import Camera, Light, Scene
from accelscope.core.structures.naive import Naive


def square(x0, x1, z):
    """Return two triangles, 20 wide along y."""
    corners = np.array([(x0, -10, z), (x1, -10, z), (x1, 10, z), (x0, 10, z)], dtype=float)
    return corners[[(0, 1, 2), (0, 2, 3)]]


FLOOR = square(-10, 10, 0)
"""Seen from above, all of the picture."""

CANOPY = square(1, 10, 1)
"""One unit above the part of the floor where x > 1."""

N = 40


def traced(triangles, *lights):
    """Return the shadow rays, the points of the floor they start from, and which are blocked."""
    eye = Camera(np.array([0.0, 0, 0.9]), np.zeros(3), np.array([0.0, 1, 0]), 150.0)
    scene = Scene.from_triangles(triangles, "floor", camera=eye, lights=lights)
    naive = Built(Naive.build(scene, Naive.Settings()), 0.0)
    lit = trace(naive, CameraWorkload, CameraSettings(width=N, height=N, shadows=True))
    rays, hits = lit.rays, lit.hits
    shadow = rays.classes == 1
    assert (rays.queries[shadow] == ANY).all()
    assert (hits.primitive[: N * N] >= 0).all()
    return rays.select(shadow), rays.origins[shadow], hits.primitive[shadow] >= 0


def light(kind, position=(0.0, 0.0, 4.0), direction=(0.0, 0.0, -1.0), **values):
    return Light(kind, np.array(position), np.array(direction), **values)


def test_a_suns_rays_are_parallel_and_endless():
    slanted = np.array([1.0, 0.0, -1.0]) / np.sqrt(2.0)
    rays, points, blocked = traced(np.concatenate([FLOOR, CANOPY]), light("sun", direction=slanted))
    assert len(rays) == N * N
    assert (rays.directions == -slanted).all()
    assert np.isinf(rays.t_max).all()
    # The light comes from -x at 45 degrees: the canopy one unit above shades what lies one unit on.
    np.testing.assert_array_equal(blocked, points[:, 0] > 2.0)
    assert 0.1 < blocked.mean() < 0.4


def test_a_sun_from_below_lights_nothing():
    rays, _, _ = traced(FLOOR, light("sun", direction=(0.0, 0.0, 1.0)), light("point"))
    assert len(rays) == N * N
    assert (rays.t_max == 1.0).all()


def test_a_spot_has_rays_within_its_cone_only():
    rays, points, _ = traced(FLOOR, light("spot", angle=60.0))
    everywhere = traced(FLOOR, light("point"))[1]
    within = np.hypot(everywhere[:, 0], everywhere[:, 1]) < 4.0 * np.tan(np.radians(30.0))
    np.testing.assert_array_equal(points, everywhere[within])
    assert (rays.t_max == 1.0).all()
    assert 0.05 < within.mean() < 0.9


def test_an_area_light_shines_from_its_centre_to_its_front():
    ahead = np.array([1.0, 0.0, 0.0])
    rays, points, _ = traced(FLOOR, light("area", direction=ahead, angle=180.0))
    assert (points[:, 0] > 0.0).all()
    assert len(rays) == N * N // 2
    np.testing.assert_allclose(
        rays.origins + rays.directions, (0, 0, 4.0) * np.ones((len(rays), 3)), atol=1e-12
    )


def test_lights_take_turns_at_every_hit():
    rays, points, _ = traced(FLOOR, light("point"), light("sun"))
    assert len(rays) == 2 * N * N
    np.testing.assert_array_equal(points[0::2], points[1::2])
    np.testing.assert_array_equal(np.isinf(rays.t_max), np.tile([False, True], N * N))


def test_without_a_light_the_kinds_are_named():
    with pytest.raises(InputError, match=r"add a light \(point, sun, spot, area\)"):
        traced(FLOOR)


# ------------------------------------------------------------------------------------ in Blender


@pytest.fixture
def lights(bpy):
    """Add a lamp of some type to a cube, and return the scene's lights and notes."""
    from accelscope.addon.from_blender import extraction

    bpy.ops.mesh.primitive_cube_add()

    def add(kind, scale=(1, 1, 1), rotation=(0.0, 0.0, 0.0), **values):
        lamp = bpy.data.objects.new(f"A {kind}", bpy.data.lights.new(kind, kind))
        for name, value in values.items():
            setattr(lamp.data, name, value)
        lamp.location, lamp.scale, lamp.rotation_euler = (1, 2, 3), scale, rotation
        bpy.context.scene.collection.objects.link(lamp)
        scene = extraction.extract(bpy.context, extraction.VISIBLE)
        return scene.lights, scene.notes

    return add


@pytest.mark.parametrize("kind", ["POINT", "SUN", "SPOT", "AREA"])
def test_every_type_of_lamp_is_taken(lights, kind):
    # Turned a quarter about x, what shone down shines along y.
    values = {"spot_size": np.radians(50.0)} if kind == "SPOT" else {}
    (found,), notes = lights(kind, rotation=(np.pi / 2, 0.0, 0.0), **values)
    assert (found.kind, found.name, notes) == (kind.lower(), f"A {kind}", ())
    np.testing.assert_allclose(found.position, (1, 2, 3))
    if kind != "POINT":
        np.testing.assert_allclose(found.direction, (0, 1, 0), atol=1e-6)
    angles = {"POINT": 360.0, "SUN": 360.0, "SPOT": 50.0, "AREA": 180.0}
    assert found.angle == pytest.approx(angles[kind], rel=1e-6)


def test_what_cannot_be_taken_as_it_is_is_said(lights):
    found, (note,) = lights("SUN", scale=(0, 0, 0))
    assert found == ()
    assert note == "the light A SUN is nowhere or has a scale of zero and is left out"


@pytest.mark.parametrize("values", [{"use_square": True}, {"scale": (1, 2, 1)}])
def test_a_cone_that_is_not_round_is_said(lights, values):
    (found,), (note,) = lights("SPOT", **values)
    assert found.kind == "spot"
    assert "the cone of the spot light A SPOT is square or unevenly scaled" in note


def test_hidden_lamps_are_none(bpy, lights):
    lights("SUN")
    bpy.data.objects["A SUN"].hide_viewport = True
    (found,), _ = lights("POINT")
    assert found.kind == "point"


def test_the_record_holds_the_lights(bpy, lights, evaluate, tmp_path):
    lights("SUN")
    lights("SPOT")
    path = tmp_path / "lit.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    (record,) = evaluate(
        path, "--structure", "bvh", "--rays", "camera:width=9,height=9,shadows=true"
    )
    sun, spot = sorted(record["scene"]["lights"], key=lambda each: each["kind"] != "sun")
    assert sun == {"name": "A SUN", "kind": "sun", "direction": [0.0, 0.0, -1.0]}
    assert spot["position"] == [1.0, 2.0, 3.0]
    assert spot["angle"] == pytest.approx(45.0)
    assert record["rays"]["classes"]["shadow"] > 0
