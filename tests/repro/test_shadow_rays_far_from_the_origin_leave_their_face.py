"""A shadow ray does not hit the face it starts from, however far from the origin that lies."""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import CameraSettings, CameraWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.geometry.icosphere import icosphere
from accelscope.core.scene import Camera, Scene, point_lights
from accelscope.core.structures.bvh import BVH
from accelscope.sample_scenes import make_sample

FINEST = 2.0**-12
"""All coordinates are multiples of this, which moving by a power of two leaves as they are."""

UP = np.array([0.0, 0.0, 1.0])


def rounded(points):
    return np.round(np.asarray(points, dtype=float) / FINEST) * FINEST


def lit(scene, size):
    """Return the rays of a camera and their shadow rays, and what they hit."""
    bvh = Built(BVH.build(scene, BVH.Settings()), 0.0)
    settings = CameraSettings(width=size, height=size, shadows=True)
    traced = trace(bvh, CameraWorkload, settings)
    return traced.rays, traced.hits


def blocked(triangles, eye, at, light, away):
    """Return how many primary rays hit, and which of their shadow rays are blocked."""
    eye, at, light = (rounded(point) + away for point in (eye, at, light))
    scene = Scene.from_triangles(
        rounded(triangles) + away, "far", camera=Camera(eye, at, UP, 40.0),
        lights=point_lights(light),
    )  # fmt: skip
    rays, hits = lit(scene, 150)
    hit = hits.primitive >= 0
    return int(hit[rays.classes == 0].sum()), hit[rays.classes == 1]


# At 2^40 a unit in the last place is FINEST; 2^38 leaves room for the roundings of a hit.
@pytest.mark.parametrize("power", [0, 14, 27, 32, 36])
@pytest.mark.parametrize("axes", [(1, 0, 0), (-1, 1, -1)])
def test_a_convex_body_never_shades_itself(power, axes):
    away = 2.0**power * np.array(axes, float)
    seen, shadows = blocked(icosphere(2), (3, -5, 2), (0, 0, 0), (9, -3, 4), away)
    assert seen > 3000
    assert len(shadows) > 2000
    assert shadows.sum() == 0


def test_tetra_moved_away_is_shaded_as_before():
    tetra = make_sample("tetra:size=5")
    eye, at = tetra.camera.position, tetra.camera.target
    light = tetra.lights[0].position
    seen, shadows = blocked(tetra.triangles, eye, at, light, np.zeros(3))
    assert shadows.sum() > 300
    far_seen, far_shadows = blocked(
        tetra.triangles, eye, at, light, np.array([2.0**27, 0, 2.0**27])
    )
    # Rays that pass within rounding of an edge may fall to either side of it.
    assert abs(far_seen - seen) <= 5
    assert abs(len(far_shadows) - len(shadows)) <= 5
    assert abs(far_shadows.sum() - shadows.sum()) <= 5


def test_a_camera_far_away_from_a_scene_at_the_origin():
    eye = np.array([2.0**27, -(2.0**27), 0.0])
    camera = Camera(eye, np.zeros(3), UP, float(np.degrees(4.0 / 2.0**27.5)))
    scene = Scene.from_triangles(
        icosphere(2), "near", camera=camera, lights=point_lights((9.0, -3.0, 4.0))
    )
    rays, hits = lit(scene, 100)
    shadow = rays.classes == 1
    assert shadow.sum() > 1000
    assert (hits.primitive[shadow] < 0).all()


@pytest.mark.parametrize("scale", [2.0**-300, 2.0**300])
def test_the_size_of_the_scene_changes_no_count(scale):
    sphere = icosphere(2)
    lamp = np.array([9.0, -3.0, 4.0])

    def classes(factor):
        camera = Camera(np.array([3.0, -5, 2]) * factor, np.zeros(3), UP, 40.0)
        scene = Scene.from_triangles(
            sphere * factor, "sized", camera=camera, lights=point_lights(lamp * factor)
        )
        return lit(scene, 60)[0].classes

    np.testing.assert_array_equal(classes(scale), classes(1.0))
