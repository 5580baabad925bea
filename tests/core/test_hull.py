"""Areas of convex hulls: known bodies, flat ones, and what must hold of any."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.hull import hull_area, hull_faces

CUBE = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
LATTICE = np.array(list(itertools.product(np.linspace(0.0, 1.0, 7), repeat=3)))


def turned(points):
    """Turned about all axes, so that nothing lies in an axis."""
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    return points @ q.T + [5.0, -7.0, 3.0]


@pytest.mark.parametrize(
    ("move", "scale"),
    [(lambda p: p, 1.0), (turned, 1.0), (lambda p: 1e-6 * p, 1e-6), (lambda p: 1e9 * p - 1e9, 1e9)],
)
@pytest.mark.parametrize(
    ("points", "area"),
    [
        (CUBE, 6.0),
        (np.repeat(CUBE, 3, axis=0), 6.0),
        (LATTICE, 6.0),
        (np.concatenate([-np.eye(3), np.eye(3)]), 4 * np.sqrt(3)),
        (np.concatenate([np.zeros((1, 3)), np.eye(3)]), 1.5 + np.sqrt(3) / 2),
        (LATTICE * [1, 1, 0], 2.0),  # both sides of a square
        (LATTICE * [1, 0, 0], 0.0),
        (np.zeros((5, 3)), 0.0),
        (np.zeros((1, 3)), 0.0),
    ],
)
def test_known_areas(points, area, move, scale):
    unit = scale**2
    assert hull_area(move(points)) == pytest.approx(area * unit, rel=1e-9, abs=1e-12 * unit)


def test_a_fine_sphere():
    n = 3000
    z = 1.0 - (2.0 * np.arange(n) + 1.0) / n
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(n)
    r = np.sqrt(1.0 - z**2)
    points = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    faces = hull_faces(points)
    assert len(faces) == 2 * n - 4  # Euler: every point is a corner
    assert 0.995 < hull_area(points) / (4 * np.pi) < 1.0


def test_everything_is_inside_a_closed_surface(lab, scene_name):
    points = lab.small_scene(scene_name).triangles.reshape(-1, 3)
    faces = hull_faces(points)
    if np.linalg.matrix_rank(points[:2000] - points[0], tol=1e-9) < 3:
        return
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    length = np.linalg.norm(normals, axis=1)
    faces, normals = faces[length > 0], normals[length > 0] / length[length > 0, None]
    beyond = points @ normals.T - (normals * faces[:, 0]).sum(axis=1)
    # Slivers have normals of few digits, but then their area counts for nothing.
    weight = np.linalg.norm(np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0]), axis=1)
    assert (beyond * weight).max() < 1e-9 * np.ptp(points) ** 3
    assert hull_area(points) == pytest.approx(hull_area(points[::-1]), rel=1e-9)
    # A closed surface: the normals, weighted by area, add up to nothing.
    assert np.abs((normals * weight[:, None]).sum(axis=0)).max() < 1e-9 * weight.sum()
