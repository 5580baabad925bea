"""Shadow rays start from solids of every kind, and do not hit the one they start from."""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import CameraSettings, CameraWorkload
from accelscope.core.geometry.solids.description import Box, Cone, Placed, Sphere
from accelscope.core.scene import Camera, Scene, point_lights
from accelscope.core.structures.bvh import BVH

CONVEX = {
    "sphere": Sphere((0, 0, 0), 1),
    "cylinder": Cone((0.2, -0.3, -1), (-0.1, 0.3, 1), 0.7, 0.7),
    "cone": Cone((0, 0, -1), (0.25, 0, 1), 1, 0),
    "truncated cone": Cone((0, 0, -1), (0.25, 0, 1), 0.3, 0.9),
    "box": Box((-1, -0.8, -0.5), (1, 0.8, 0.75)),
}
EYE, LAMPS = np.array([3.0, -5, 2]), np.array([(9.0, -3, 4), (-7, -6, -5), (4, -0.5, 3)])
TURNED = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])


@pytest.mark.parametrize("power", [None, 0, 20, 36])
@pytest.mark.parametrize("widths", [(1, 1, 1), (1.5, 0.25, 0.75), (1, 1, 0.001)])
@pytest.mark.parametrize("name", CONVEX)
def test_a_convex_solid_never_shades_itself(name, widths, power):
    away = np.zeros(3) if power is None else 2.0**power * np.array([-1.0, 1.0, -1.0])
    solid = Placed(CONVEX[name], np.column_stack([TURNED * widths, away]))
    scene = Scene.from_items(
        [solid], "alone", camera=Camera(away + EYE, away, np.array([0.0, 0, 1]), 40.0),
        lights=point_lights(*(away + LAMPS)),
    )  # fmt: skip
    batches = CameraWorkload.generations(
        scene, settings := CameraSettings(width=150, height=150, shadows=True),
        CameraWorkload.make(scene, settings),
    )  # fmt: skip
    structure = BVH.build(scene, BVH.Settings())
    primary, _ = structure.trace(next(batches))
    shadow, _ = structure.trace(batches.send(primary))
    assert (primary.primitive >= 0).sum() > 100
    assert len(shadow.primitive) > 100
    assert (shadow.primitive < 0).all()
