"""Normals of solids: closed forms, and the surfaces around the points that rays hit."""

import numpy as np
import pytest
from accelscope.core.geometry.geometry import in_order, normals_at
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.solids.description import (
    Box,
    Cone,
    Disc,
    MovingTriangle,
    Placed,
    Polygon,
    Sphere,
    Triangle,
)
from accelscope.core.geometry.solids.making import mixed_of
from solids_reference import EVERY_KIND, distance, rays_of, trace

STEP = 1e-8
"""How far the surface is followed from a hit: less than any item's radius of curvature."""

SHEAR = np.array([[1.5, 0.3, 0.0, 2.0], [-0.2, 0.6, 0.4, -1.0], [0.1, 0.0, 0.9, 0.5]])


def normal_at(item, point, time=0.0):
    """The normal of one item at one point."""
    return normals_at(
        mixed_of([item]), np.zeros(1, int), np.array([point], float), np.array([time])
    )[0]


def same_line(a, b):
    """Whether two unit vectors are the same but for their sense."""
    return abs(np.dot(a, b)) == pytest.approx(1.0, abs=1e-15)


SLANT = Cone((0, 0, 0), (0, 0, 3), 4, 0)  # its mantle rises by 3 where it comes inward by 4
CYLINDER = Cone((0, 0, 0), (0, 0, 2), 1, 1)


@pytest.mark.parametrize(
    ("item", "point", "normal"),
    [
        (Sphere((1, 2, 3), 2), (1, 2, 1), (0, 0, -1)),
        (Sphere((0, 0, 0), 5), (3, 0, 4), (0.6, 0, 0.8)),
        (Placed(Sphere((0, 0, 0), 1), [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]]),
         (2 * 0.6, 0.8, 0), np.array([0.3, 0.8, 0]) / np.sqrt(0.73)),
        (CYLINDER, (0.6, 0.8, 1), (0.6, 0.8, 0)),
        (CYLINDER, (0.6, 0.1, 2), (0, 0, 1)),
        (CYLINDER, (0.6, 0.1, 0), (0, 0, -1)),
        (CYLINDER, (0.999999, 0, 2), (0, 0, 1)),
        (CYLINDER, (1, 0, 1.999999), (1, 0, 0)),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1, False), (0, -1, 2), (0, -1, 0)),
        (SLANT, (2, 0, 1.5), (0.6, 0, 0.8)),
        (SLANT, (0, -4e-9, 3 - 3e-9), (0, -0.6, 0.8)),
        (SLANT, (0, 0, 3), (0, 0, 1)),
        (SLANT, (1, 1, 0), (0, 0, -1)),
        (Box((0, 0, 0), (1, 2, 3)), (0.5, 2, 1), (0, 1, 0)),
        (Box((0, 0, 0), (1, 2, 3)), (0, 1.999999, 1), (-1, 0, 0)),
        (Box((0, 0, 0), (1, 2, 0)), (0.5, 1, 0), (0, 0, 1)),
        (Disc((1, 1, 1), (0, 3, 4), 2), (1, 1, 1), (0, 0.6, 0.8)),
        (Polygon([(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 2, 1)]), (0.2, 0.2, 1), (0, 0, 1)),
        (Triangle([(0, 0, 0), (1, 0, 0), (0, 1, 1)]), (0.1, 0.1, 0.1), (0, -(0.5**0.5), 0.5**0.5)),
    ],
)  # fmt: skip
@pytest.mark.parametrize("power", [0, 300, -300])
def test_closed_forms_at_any_size(item, point, normal, power):
    """A power of two changes no bit."""
    at = normal_at(sized(item, 2.0**power), 2.0**power * np.array(point, float))
    assert same_line(at, normal)
    assert np.linalg.norm(at) == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_array_equal(at, normal_at(sized(item, 1.0), point))


def sized(item, size):
    """An item scaled about the origin."""
    if isinstance(item, Polygon | Triangle):
        return type(item)(size * np.array(item.corners, float))
    solid, matrix = item if isinstance(item, Placed) else (item, np.eye(3, 4))
    return Placed(solid, size * np.array(matrix))


def test_solids_look_outward():
    for item in (Sphere((0, 0, 0), 1), CYLINDER, Box((-1, -1, 0), (1, 1, 2)), SLANT):
        geometry = mixed_of([item])
        directions = np.random.default_rng(3).normal(size=(200, 3))
        rays = rays_of(np.array([0.01, 0.02, 0.5]), directions)
        t, _ = trace(geometry, rays)
        points = rays.origins + t[:, None] * rays.directions
        normals = normals_at(geometry, np.zeros(200, int), points, np.zeros(200))
        assert ((normals * directions).sum(axis=1) > 0.0).all()


def test_a_moving_triangle_looks_where_it_is_at_the_time():
    turning = MovingTriangle([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (1, 0, 0), (0, 1, 2)])
    for time in (0.0, 0.25, 0.5, 1.0):
        normal = np.array([0.0, -2.0 * time, 1.0]) / np.hypot(2.0 * time, 1.0)
        assert same_line(normal_at(turning, (0.2, 0.0, 0.0), time), normal)


def test_far_away_the_broad_side_of_a_thin_box_is_not_taken_for_an_edge():
    """There, points are rounded by more than the box is thick."""
    away = 2.0**20
    plate = Placed(
        Box((-1, -1, -1), (1, 1, 1)), [[1, 0, 0, away], [0, 1, 0, away], [0, 0, 1e-11, away]]
    )
    ulp = np.spacing(away)
    for off in (-2 * ulp, 0.0, 2 * ulp):
        for beside in (0.0, 0.5, 1.0 - 16 * ulp):
            assert same_line(normal_at(plate, (away + beside, away, away + off)), (0, 0, 1))
    assert same_line(normal_at(plate, (away + 1.0, away + 0.5, away + 4 * ulp)), (1, 0, 0))


def aims_within(item, rng, n):
    """Points of which many are in or on an item, also in a needle."""
    if isinstance(item, Cone):
        base, apex = np.array(item.base), np.array(item.apex)
        radius = min(item.base_radius, item.apex_radius) or 0.3
        along = base + rng.uniform(size=(n, 1)) * (apex - base)
        return along + radius * rng.uniform(-0.7, 0.7, (n, 3))
    box = mixed_of([item]).boxes[0]
    return rng.uniform(box[:3], box[3:], (n, 3))


SOLIDS = [name for name, item in EVERY_KIND.items() if isinstance(item, Sphere | Cone | Box | Disc)]


@pytest.mark.parametrize(
    ("name", "is_placed"),
    [*((name, False) for name in EVERY_KIND), *((name, True) for name in SOLIDS)],
)
def test_the_surface_is_level_across_its_normal(name, is_placed):
    """A step from a hit, to any side at right angles, stays on the surface to the second order."""
    item = EVERY_KIND[name]
    rng = np.random.default_rng(11)
    n = 3000
    matrix = SHEAR if is_placed else np.eye(3, 4)
    linear, moved = matrix[:, :3], matrix[:, 3]
    aims = aims_within(item, rng, n) @ linear.T + moved
    origins = moved + rng.normal(size=(n, 3)) * 4.0
    geometry = mixed_of([Placed(item, matrix) if is_placed else item])
    time = 0.375 if isinstance(item, MovingTriangle) else 0.0
    rays = rays_of(origins, aims - origins, times=np.full(n, time))
    t, _ = trace(geometry, rays)
    hit = np.flatnonzero(np.isfinite(t))
    assert len(hit) > 20
    points = rays.origins[hit] + t[hit, None] * rays.directions[hit]
    normals = normals_at(geometry, np.zeros(len(hit), int), points, np.full(len(hit), time))
    np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1.0, rtol=1e-15)
    u = np.cross(normals, rng.normal(size=normals.shape))
    u /= np.linalg.norm(u, axis=1, keepdims=True)

    def off(moved_points):
        local = (moved_points - moved) @ np.linalg.inv(linear).T
        return distance(item, local, time)

    for side in (u, -u, np.cross(normals, u)):
        np.testing.assert_array_less(off(points + STEP * side), 1e-4 * STEP)
    # And along the normal it is left.
    assert (off(points + STEP * normals) > 0.3 * STEP).all()


def test_items_of_all_kinds_are_asked_at_once_and_instances_too():
    items = list(EVERY_KIND.values())
    geometry = mixed_of(items)
    rng = np.random.default_rng(5)
    primitives, points = rng.integers(len(items), size=500), rng.normal(size=(500, 3))
    times = rng.uniform(size=500)
    together = normals_at(geometry, primitives, points, times)
    alone = [
        normal_at(items[k], point, time)
        for k, point, time in zip(primitives, points, times, strict=True)
    ]
    np.testing.assert_array_equal(together, alone)
    ball = in_order(mixed_of([Sphere((0, 0, 0), 1)]), np.array([0]))
    places = instanced([ball], np.zeros(1, int), np.array([np.diag([2.0, 1.0, 1.0, 1.0])[:3]]))
    at = normals_at(places, np.zeros(1, int), np.array([[1.2, 0.8, 0.0]]), np.zeros(1))
    np.testing.assert_allclose(at[0], np.array([0.3, 0.8, 0]) / np.sqrt(0.73), atol=1e-15)
