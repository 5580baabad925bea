"""Planes that pass a corner of a polygon within rounding seem to cross its border many times.

The first two crossings were taken for the true ones, so that up to a twelfth of a triangle was
lost, and its hits with it.
"""

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structures


def through_one_point(n):
    """Return n triangles whose centroids are the origin, (n, 3, 3)."""
    corners = np.random.default_rng(3).normal(size=(n, 3, 3))
    corners[:, 2] = -0.5 * (corners[:, 0] + corners[:, 1])
    return corners


@pytest.mark.parametrize("name", [name for name in general_structures() if name != "naive"])
def test_triangles_through_one_point(build, name):
    scene = Scene.from_triangles(through_one_point(1500), "through one point")
    # At every triangle, from close by.
    rng = np.random.default_rng(4)
    points = (scene.triangles * rng.dirichlet([1, 1, 1], size=1500)[:, :, None]).sum(axis=1)
    edges = scene.triangles[:, 1:] - scene.triangles[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    rays = Rays.from_arrays(points + 1e-6 * normals, -normals, 2e-6)
    want, _ = build("naive", scene).trace(rays)
    assert (want.primitive >= 0).all()
    field = structures()[name].Settings.__dataclass_fields__.get("planes")
    for planes in field.metadata["choices"] if field else [""]:
        structure = build(name, scene, f"planes={planes}" if planes else "")
        assert structure.validate() == []
        got, _ = structure.trace(rays)
        assert got.primitive.tolist() == want.primitive.tolist()
