"""Rays of pictures do not depend on what the processor can do: with and without its wide registers.

Scenes are of numbers that every machine reads alike. Those of some samples are not: they are turned
by products of matrices, whose last digits are the library's affair.
"""

import os
import subprocess
import sys

import pytest

PROGRAM = """
import hashlib, math
import numpy as np
from accelscope.core.evaluation.rays.workloads import *
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.geometry.solids.description import *
from accelscope.core.scene import Camera, Light, Scene, point_lights
from accelscope.core.scene.material import Material
from accelscope.core.structures import structures

glass = Material("glass", (0.9, 0.8, 1.0), 0.1, 0.2, 30.0, 0.7, 1.5)
mirror = Material("mirror", (1.0, 0.5, 0.2), 0.5, 0.5, 77.0)
items = [Sphere((0.1, 0.2, 0.3), 0.7), Cone((1, 0, 0), (1.3, 0.4, 1), 0.5, 0.2),
         Box((-2, -1, -0.4), (-1, 0.3, 0.6)), Triangle([(-3, 3, 0), (3, 3, 0.2), (0, 3, 4)]),
         Polygon([(-9, -9, -0.5), (9, -9, -0.5), (9, 9, -0.5), (-9, 9, -0.5)]),
         Disc((0, 1.5, 1), (0.3, 1, 0.2), 0.8)]
lamp = Light("area", np.array([1.0, -1, 5]), np.array([0.0, 0, -1]), 180.0, "lamp",
             np.array([[0.5, 0, 0], [0, 0.7, 0]]), True)
scene = Scene.from_items(
    items, "made", materials=(glass, mirror), material_ids=np.array([0, 1, 0, 1, 1, 1]),
    camera=Camera(np.array([0.3, -6.0, 2.0]), np.zeros(3), np.array([0.0, 0, 1]), 60.0),
    lights=(lamp, *point_lights((3, -2, 6))),
)
bvh = structures()["bvh"]
built = Built(bvh.build(scene, bvh.Settings()), 0.0)
picture = dict(samples=4, adaptive=True, compare=False, light_samples=2)
for workload, settings in ((WhittedWorkload, picture), (AmbientWorkload, dict(count=3))):
    result = trace(built, workload, workload.Settings(width=48, height=48, **settings))
    digest = hashlib.sha256()
    for column in (result.rays.origins, result.rays.directions, result.rays.pixels, result.hits.t):
        digest.update(column.tobytes())
    print(workload.name, len(result.rays), digest.hexdigest())
"""

NARROW = {
    # By the names of NumPy before 2.4 and from there on; others are passed over.
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512F AVX512CD AVX512_SKX AVX512_CNL AVX512_ICL "
    "AVX2 FMA3",
    "OPENBLAS_CORETYPE": "Nehalem",
}


@pytest.mark.exhaustive
def test_wide_registers_and_fused_products_change_no_ray():
    told = [
        subprocess.run(
            [sys.executable, "-c", PROGRAM], env=os.environ | more, check=True, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        ).stdout
        for more in ({}, NARROW)
    ]  # fmt: skip
    assert told[0].count("\n") == 2
    assert told[0] == told[1]
