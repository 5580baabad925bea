# SPDX-License-Identifier: GPL-3.0-or-later
"""What a sphere covers of a round cone, against closed forms, an integral and rays."""

import itertools
import math

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.cones import Spread
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Sphere, Triangle
from accelscope.core.probes.coverage import Covering
from accelscope.core.probes.lens import segment_of_conic, share_of_sphere
from accelscope.core.probes.soft_shadow import share_seen
from accelscope.core.scene import Scene
from accelscope.core.scene.as_triangles import as_triangles_and_spheres
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

NODES, WEIGHTS = np.polynomial.legendre.leggauss(200)


def lens_of_circles(apart, a, b):
    """The area that two circles of radii a and b have in common."""
    if apart >= a + b:
        return 0.0
    if apart <= abs(a - b):
        return math.pi * min(a, b) ** 2
    u = math.acos((apart**2 + a**2 - b**2) / (2.0 * apart * a))
    v = math.acos((apart**2 + b**2 - a**2) / (2.0 * apart * b))
    return a * a * (u - math.sin(u) * math.cos(u)) + b * b * (v - math.sin(v) * math.cos(v))


def by_integral(along, across, radius, slope):
    """The share ring by ring: of each around the axis an arc lies in the sphere's angle."""
    distance = math.hypot(along, across)
    if distance <= radius:
        return 1.0
    half, way = math.asin(radius / distance), math.atan2(across, along)

    def arc(ring):
        angle = math.atan(ring)
        a, b, c = (math.sin(0.5 * each) ** 2 for each in (half, way, angle))
        over = (2.0 * (b + c - a) - 4.0 * b * c) / math.cos(angle)
        under = ring * math.sin(way)
        return math.acos(min(max(over / under, -1.0), 1.0)) if under else math.pi * (over <= 0.0)

    # Between rings that touch the conic, where the arc begins like a root.
    touching = {abs(math.tan(way - half)), math.tan(way + half)}
    ends = [0.0, *sorted(ring for ring in touching if 0.0 < ring < slope), slope]
    total = 0.0
    for a, b in itertools.pairwise(ends):
        turn = 0.5 * math.pi * (NODES + 1.0)
        rings = a + 0.5 * (b - a) * (1.0 - np.cos(turn))
        arcs = np.array([2.0 * ring * arc(ring) for ring in rings.tolist()])
        total += 0.25 * math.pi * (b - a) * float(WEIGHTS @ (np.sin(turn) * arcs))
    return total / (math.pi * slope * slope)


def test_a_sphere_on_the_axis_covers_the_square_of_the_ratio():
    for slope in (1e-3, 0.1, 1.0, 30.0):
        for radius in (1e-4, 0.01, 0.05, 0.4):
            expected = (radius**2 / (1.0 - radius**2)) / slope**2
            got = share_of_sphere(1.0, 0.0, radius, slope)
            assert got == pytest.approx(min(expected, 1.0), rel=1e-12)


def test_of_small_angles_it_is_the_lens_of_two_circles():
    """The relative error is of the order of the angles' squares."""
    slope = 1e-5
    for apart in (0.0, 0.3, 0.8, 1.0, 1.4, 1.9, 2.4, 3.1):
        for size in (0.2, 0.7, 1.0, 2.0):
            expected = lens_of_circles(apart, 1.0, size) / math.pi
            got = share_of_sphere(1.0, apart * slope, size * slope, slope)
            assert got == pytest.approx(expected, abs=1e-8)


def test_it_is_the_integral_at_all_angles():
    rng, partly = np.random.default_rng(1), 0
    for _ in range(300):
        half_cone = rng.choice([0.001, 0.05, 0.3, 0.9, 1.4, 1.55])
        way, distance = rng.random() * min(2.2 * half_cone, 3.0), 0.5 + 2.5 * rng.random()
        radius = distance * min(math.sin(rng.random() * min(1.57, 2.0 * half_cone)), 0.999999)
        place = distance * math.cos(way), distance * math.sin(way)
        got = share_of_sphere(*place, radius, math.tan(half_cone))
        assert got == pytest.approx(by_integral(*place, radius, math.tan(half_cone)), abs=2e-14)
        partly += 0.0 < got < 1.0
    assert partly > 150


def test_segments_of_ellipses_parabolas_and_hyperbolas():
    # A circle of radius 1: y^2 = x (2 - x); half of it, and all.
    assert segment_of_conic(1.0, 2.0, -1.0) == pytest.approx(0.5 * math.pi, rel=1e-15)
    assert segment_of_conic(2.0, 2.0, -1.0) == pytest.approx(math.pi, rel=1e-15)
    # y^2 = 3 x up to x = 5, and x^2 - y^2 = 1 up to x = 1 + h.
    assert segment_of_conic(5.0, 3.0, 0.0) == pytest.approx(4 / 3 * 3**0.5 * 5**1.5, rel=1e-14)
    for h in (0.3, 0.99, 1.01, 40.0):
        area = (1.0 + h) * math.sqrt(h * (h + 2.0)) - math.acosh(1.0 + h)
        assert segment_of_conic(h, 2.0, 1.0) == pytest.approx(area, rel=1e-13)
    # A thin one is that of the parabola: nothing cancels.
    assert segment_of_conic(1e-9, 2.0, 1.0) == pytest.approx(4 / 3 * 2**0.5 * 1e-9**1.5, rel=1e-8)


def covering(items, name="naive"):
    kind = structure_named(name)
    return Covering(kind.build(Scene.from_items(items, "made"), kind.Settings()))


def down(origin=(0.0, 0.0, 0.0)):
    return Rays.from_arrays(np.array([origin]), np.array([[0.0, 0.0, -1.0]]))


def test_spheres_are_composited_from_front_to_back():
    """Each alone covers a quarter; the second is seen of what the first leaves."""
    spread = Spread(math.atan(0.2))
    quarter = [Sphere((0.0, 0.0, -z), z * math.sin(math.atan(0.1))) for z in (1.0, 2.0, 4.0)]
    for order in ([0, 1, 2], [2, 0, 1], [1, 2, 0]):
        got = covering([quarter[n] for n in order]).coverage(down(), 0, spread)
        expected = [0.25 * 0.75**n for n in order]
        np.testing.assert_allclose(got.shares, expected, rtol=1e-12)


def test_triangles_beside_each_other_hide_what_they_cover_together():
    """Two that share an edge are a wall: of a sphere behind nothing is seen, in front a quarter."""
    a, b, c, d = (-9.0, -9.0, -3.0), (9.0, -9.0, -3.0), (9.0, 9.0, -3.0), (-9.0, 9.0, -3.0)
    wall = [Triangle((a, b, c)), Triangle((a, c, d))]
    spread = Spread(math.atan(0.2))
    behind = Sphere((0.0, 0.0, -6.0), 6.0 * math.sin(math.atan(0.1)))
    got = covering([*wall, behind]).coverage(down(), 0, spread)
    assert got.items.tolist() == [0, 1]
    np.testing.assert_allclose(got.shares, [0.5, 0.5], rtol=1e-12)
    before = Sphere((0.0, 0.0, -2.0), 2.0 * math.sin(math.atan(0.1)))
    got = covering([before, *wall]).coverage(down(), 0, spread)
    np.testing.assert_allclose(got.shares, [0.25, 0.375, 0.375], rtol=1e-12)


def test_a_sphere_around_the_eye_is_behind_what_is_in_it():
    """A quarter is seen of what stands before the dome, and the dome beside it, as rays see it."""
    quarter = Sphere((0.0, 0.0, -2.0), 2.0 * math.sin(math.atan(0.1)))
    dome = Sphere((0.0, 0.0, 1.0), 9.0)
    wall = [(-9.0, -9.0, -12.0), (9.0, -9.0, -12.0), (0.0, 9.0, -12.0)]
    got = covering([dome, quarter, Triangle(wall)]).coverage(down(), 0, Spread(math.atan(0.2)))
    assert got.items.tolist() == [0, 1]
    np.testing.assert_allclose(got.shares, [0.75, 0.25], rtol=1e-12)


def test_spheres_in_the_way_of_a_light_are_refused():
    seen = covering([Sphere((0.0, 0.0, 2.0), 0.5)])
    light = np.array([(-1.0, -1.0, 4.0), (1.0, -1.0, 4.0), (0.0, 1.0, 4.0)])
    with pytest.raises(InputError, match="there are spheres; make them triangles"):
        share_seen(seen, np.zeros(3), light)


def test_one_sphere_covers_what_rays_find():
    """Each of 4,096 rays through a cone hits or misses: its share is a mean of yes and no."""
    rng, partly = np.random.default_rng(5), 0
    for _ in range(20):
        seen = covering([Sphere(rng.normal(size=3), 0.3 + rng.random())])
        origin = 4.0 * rng.normal(size=3)
        rays = Rays.from_arrays(origin[None], -origin[None] + rng.normal(size=3) * 0.5)
        spread = Spread(0.2)
        turn, size = 2.0 * np.pi * rng.random(4096), np.sqrt(rng.random(4096)) * np.tan(0.2)
        (across,), (above,) = spread.axes(rays.directions)
        axis = rays.directions[0] / np.linalg.norm(rays.directions[0])
        ways = axis + np.outer(size * np.cos(turn), across) + np.outer(size * np.sin(turn), above)
        many = Rays.from_arrays(np.broadcast_to(origin, ways.shape), ways)
        found = (seen.structure.trace(many)[0].primitive == 0).mean()
        share = seen.coverage(rays, 0, spread).shares.sum()
        assert abs(found - share) < 5.0 * np.sqrt(max(share * (1.0 - share), 1e-4) / 4096)
        partly += 0.02 < share < 0.98
    assert partly > 6


def test_shares_are_at_most_the_whole_and_the_same_through_every_structure():
    scene = make_sample("balls:size=2")
    scene = as_triangles_and_spheres(scene, "this test")
    assert (len(scene), "its 1 items are seen as 2 triangles" in scene.notes[-1]) == (93, True)
    made = {
        name: Covering(structure_named(name).build(scene, structure_named(name).Settings()))
        for name in ("naive", "bvh")
    }
    rng = np.random.default_rng(2)
    for _ in range(60):
        origin = rng.normal(size=3) * 2.0 + (0.0, 0.0, 2.0)
        rays = Rays.from_arrays(origin[None], rng.normal(size=(1, 3)) * 0.4 - origin)
        spread = Spread(float(rng.choice([0.01, 0.1, 0.5])))
        expected, got = (each.coverage(rays, 0, spread) for each in made.values())
        np.testing.assert_array_equal(got.items, expected.items)
        np.testing.assert_array_equal(got.shares, expected.shares)
        assert got.shares.sum() <= 1.0 + 1e-12
