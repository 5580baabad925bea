"""A ray from so far away that it leaves a leaf and the root at the same t is in more than one leaf.

Two clusters span 10^10 of their sizes; from 10^6 sizes of all of it away, a ray meets the planes
round a cluster at the same t as the face of the root behind it.
"""

import numpy as np
import pytest
from accelscope.core.geometry.rays import CLOSEST, Rays
from accelscope.core.scene import Scene

MARCHING = [
    *((name, walk) for name in ("kdtree", "octree")
      for walk in ("walk=march", "walk=neighbours", "walk=neighbours,links=stored")),
    ("bsp", "walk=march"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text"), MARCHING)
@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_it_goes_on(build, name, text, axis, sign):
    rng = np.random.default_rng(axis)
    triangles = rng.random((60, 1, 3)) + 0.3 * (rng.random((60, 3, 3)) - 0.5)
    triangles[30:] -= sign * 4e10 * np.array([0.9, 0.4, 1.0])
    scene = Scene.from_triangles(triangles, "two clusters")
    origins = triangles[:30].mean(axis=1)
    origins[:, axis] = -sign * 4e16
    directions = np.tile(sign * np.eye(3)[axis], (30, 1))
    rays = Rays.from_arrays(origins, directions)
    want, _ = build("naive", scene).trace(rays, CLOSEST)
    found, _ = build(name, scene, text).trace(rays, CLOSEST)
    assert (want.primitive >= 0).all()
    assert found.t.tobytes() == want.t.tobytes()
    assert np.array_equal(found.primitive, want.primitive)
