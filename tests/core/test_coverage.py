"""Shares that triangles cover of cones and pyramids, and lights that are seen in part."""

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.cones import ROUND, SQUARE, Spread
from accelscope.core.geometry.rays import Rays
from accelscope.core.probes.coverage import Covering, areas_in_circle, beam_around
from accelscope.core.probes.soft_shadow import share_seen, shares_seen
from accelscope.core.probes.visible import MISS, Pieces
from accelscope.core.scene import AREA, POINT, Light, Scene
from accelscope.core.structures import structure_named

ACROSS = np.array([1.0, 0.0, 0.0])


def over(corners, name="naive"):
    kind = structure_named(name)
    scene = Scene.from_triangles(np.asarray(corners, float), "made")
    return Covering(kind.build(scene, kind.Settings()))


def down(origin=(0.0, 0.0, 0.0), t_max=np.inf):
    return Rays.from_arrays(np.array([origin]), np.array([[0.0, 0.0, -1.0]]), t_max)


def half_plane(c, z=-1.0, far=50.0):
    """All of a plane where x > c, seen one unit before the eye; two triangles."""
    z = -abs(z)
    a, b, d, e = (c * -z, -far, z), (far, -far, z), (far, far, z), (c * -z, far, z)
    return [(a, b, d), (a, d, e)]


@functools.cache
def soup(name="naive"):
    rng = np.random.default_rng(4)
    corners = rng.normal(size=(120, 1, 3)) * 2.0 + rng.normal(size=(120, 3, 3)) * 0.7
    return over(corners, name)


def spread_of(shape, angle, other, across=ACROSS):
    return Spread(angle, other, shape, across)


@pytest.mark.parametrize("c", [-0.9, -0.3, 0.0, 0.5, 0.99, 1.2])
def test_a_half_plane_covers_a_segment_of_a_circle_and_a_strip_of_a_square(c):
    """In half-widths: the edge is at x = c, whatever the half-width and the distance."""
    for wide, high, z in ((0.1, 0.1, -1.0), (0.4, 0.05, -3.0)):
        scene = over(half_plane(c * wide, z))
        angles = np.arctan(wide), np.arctan(high)
        d = min(max(c, -1.0), 1.0)
        segment = (np.arccos(d) - d * np.sqrt(1.0 - d * d)) / np.pi
        for shape, expected in ((ROUND, segment), (SQUARE, 0.5 * (1.0 - d))):
            got = scene.coverage(down(), 0, spread_of(shape, *angles))
            assert got.shares.sum() == pytest.approx(expected, abs=1e-13)
            assert (got.shares > 0.0).all()


def test_what_is_hidden_covers_nothing_and_what_crosses_is_divided():
    near, far = half_plane(0.0, -1.0), half_plane(-9.0, -2.0)
    for order in (near + far, far + near):
        got = over(order).coverage(down(), 0, spread_of(SQUARE, 0.3, 0.2))
        first = [n for n, item in enumerate(order) if item in near]
        share = dict(zip(got.items.tolist(), got.shares.tolist(), strict=True))
        assert sum(share.get(n, 0.0) for n in first) == pytest.approx(0.5, abs=1e-13)
        assert got.shares.sum() == pytest.approx(1.0, abs=1e-13)
    # Beyond the cone's end nothing is met, and before it all is.
    scene = over(half_plane(-9.0, -2.0))
    assert scene.coverage(down(t_max=1.9), 0, spread_of(ROUND, 0.1, 0.1)).shares.sum() == 0.0
    whole = scene.coverage(down(t_max=2.1), 0, spread_of(ROUND, 0.1, 0.1))
    assert whole.shares.sum() == pytest.approx(1.0, abs=1e-13)


def test_the_area_in_a_circle_is_the_lens_of_two():
    """A polygon of 4,000 corners is a circle: of two unit ones, that is the lens."""
    angle = 2.0 * np.pi * np.arange(4000) / 4000
    for apart in (0.0, 0.5, 1.3, 1.99, 2.5):
        for radius in (1.0, 0.4):
            points = radius * np.column_stack([np.cos(angle), np.sin(angle)]) + (apart, 0.0)
            pieces = Pieces(
                points, np.array([0, 4000]), np.zeros(1, int), np.zeros(1, int), np.ones(1)
            )
            r, d = radius, max(apart, 1e-300)
            if d >= 1.0 + r:
                lens = 0.0
            elif d <= 1.0 - r:
                lens = np.pi * r * r
            else:
                a = np.arccos((d * d + 1.0 - r * r) / (2.0 * d))
                b = np.arccos((d * d + r * r - 1.0) / (2.0 * d * r))
                lens = a - 0.5 * np.sin(2.0 * a) + r * r * (b - 0.5 * np.sin(2.0 * b))
            # A polygon of n corners lacks 2 pi^2 / (3 n^2) of its circle.
            lacking = np.pi * r * r * 2.0 * np.pi**2 / (3.0 * 4000**2)
            assert lens - lacking - 1e-13 <= areas_in_circle(pieces)[0] <= lens + 1e-13


@pytest.mark.parametrize("shape", [ROUND, SQUARE])
def test_shares_are_within_the_error_of_rays_through_the_cone(shape):
    """Each of 4,096 rays hits one item: its share is a mean of yes and no."""
    scene, rng = soup(), np.random.default_rng(1)
    looked = 0
    for _ in range(12):
        origin = rng.normal(size=3) * 4.0
        rays = Rays.from_arrays(origin[None], -origin[None] + rng.normal(size=3) * 0.3)
        spread = spread_of(shape, 0.25, 0.1, rng.normal(size=3))
        got = scene.coverage(rays, 0, spread)
        x, y = 2.0 * rng.random((2, 4096)) - 1.0
        if shape == ROUND:
            x, y = np.sqrt(rng.random(4096)) * np.array([np.cos(np.pi * x), np.sin(np.pi * x)])
        (across,), (above,) = spread.axes(rays.directions)
        wide, high = spread.half_widths()
        axis = rays.directions[0] / np.linalg.norm(rays.directions[0])
        ways = axis + x[:, None] * wide * across + y[:, None] * high * above
        many = Rays.from_arrays(np.broadcast_to(origin, ways.shape), ways)
        hits = scene.structure.trace(many)[0].primitive
        for item in set(got.items.tolist()) | set(hits[hits >= 0].tolist()):
            share = got.shares[got.items == item].sum()
            error = np.sqrt(max(share * (1.0 - share), 1e-4) / len(hits))
            assert abs((hits == item).mean() - share) < 5.0 * error
            looked += share > 0.01
    assert looked > 30


@pytest.mark.parametrize("name", ["bvh", "grid", "octree", "kdtree", "sorted_volumes"])
def test_every_structure_gives_the_same_shares(name):
    naive, other, rng = soup(), soup(name), np.random.default_rng(7)
    for _ in range(8):
        origin = rng.normal(size=3) * 4.0
        rays = Rays.from_arrays(origin[None], -origin[None])
        for shape in (ROUND, SQUARE):
            spread = spread_of(shape, 0.2, 0.3, rng.normal(size=3))
            expected, got = (each.coverage(rays, 0, spread) for each in (naive, other))
            np.testing.assert_array_equal(got.items, expected.items)
            np.testing.assert_array_equal(got.shares, expected.shares)


def test_where_nothing_is_met_the_whole_cross_section_is_free():
    scene, spread = over(half_plane(5.0)), spread_of(ROUND, 0.1, 0.1)
    assert scene.coverage(down(), 0, spread).shares.sum() == 0.0
    pieces = scene.pieces(np.empty(0, int), beam_around(down(), 0, spread))
    assert pieces.items.tolist() == [MISS]
    assert pieces.areas.tolist() == [4.0]


# --------------------------------------------------------------------------------- soft shadows


def light_of(is_round, half=0.5, other=0.5, height=4.0):
    axes = np.array([(half, 0.0, 0.0), (0.0, other, 0.0)])
    place = np.array([0.0, 0.0, height])
    return Light(AREA, place, angle=180.0, half_axes=axes, is_round=is_round)


def roof(x, height=2.0, far=99.0):
    """All of a level plane beyond x."""
    a, b, c, d = (x, -far, height), (far, -far, height), (far, far, height), (x, far, height)
    return [(a, b, c), (a, c, d)]


@pytest.mark.parametrize("x", [-0.6, -0.2, 0.0, 0.1, 0.24, 0.3])
def test_behind_the_edge_of_a_half_plane_a_segment_of_the_light_is_seen(x):
    """Half-way up, the edge at x hides of the light, seen from below its middle, all beyond 2 x."""
    scene, point = over(roof(x)), np.zeros(3)
    d = min(max(2.0 * x / 0.5, -1.0), 1.0)
    segment = (np.arccos(-d) + d * np.sqrt(1.0 - d * d)) / np.pi
    assert share_seen(scene, point, light_of(True)) == pytest.approx(segment, abs=1e-12)
    assert share_seen(scene, point, light_of(False)) == pytest.approx(0.5 + 0.5 * d, abs=1e-12)
    # Elsewhere below, the light is seen aslant, and where it is divided moves by as much.
    for y in (-1.5, 2.0):
        aside = share_seen(scene, np.array([0.0, y, 0.0]), light_of(True))
        assert aside == pytest.approx(segment, abs=1e-12)
    moved = share_seen(scene, np.array([0.1, 0.3, 0.0]), light_of(False))
    e = min(max((0.1 + 2.0 * (x - 0.1)) / 0.5, -1.0), 1.0)
    assert moved == pytest.approx(0.5 + 0.5 * e, abs=1e-12)


@pytest.mark.parametrize("is_round", [True, False])
def test_shares_of_a_light_are_within_the_error_of_shadow_rays(is_round):
    scene, rng = soup(), np.random.default_rng(3)
    light = dataclasses.replace(
        light_of(is_round), position=np.array([2.0, 3.0, 8.0]),
        half_axes=np.array([(1.5, 0.2, 0.1), (-0.2, 0.9, 0.5)]),
    )  # fmt: skip
    points = rng.normal(size=(25, 3)) * (3.0, 3.0, 1.0) - (0.0, 0.0, 4.0)
    shares = shares_seen(scene, points, light)
    x, y = 2.0 * rng.random((2, 4096)) - 1.0
    if is_round:
        x, y = np.sqrt(rng.random(4096)) * np.array([np.cos(np.pi * x), np.sin(np.pi * x)])
    on_light = light.position + x[:, None] * light.half_axes[0] + y[:, None] * light.half_axes[1]
    for point, share in zip(points, shares.tolist(), strict=True):
        ways = on_light - point
        rays = Rays.from_arrays(np.broadcast_to(point, ways.shape), ways, 1.0)
        seen = (scene.structure.trace(rays)[0].primitive < 0).mean()
        assert abs(seen - share) < 5.0 * np.sqrt(max(share * (1.0 - share), 1e-4) / 4096)
    assert ((shares > 0.05) & (shares < 0.95)).sum() > 5


HEXAGON = np.column_stack([np.cos(np.pi * np.arange(6) / 3), np.sin(np.pi * np.arange(6) / 3)])
ARROW = np.array([(0.0, 1.0), (-1.0, -1.0), (0.0, -0.3), (1.0, -1.0)])


def area_beyond(outline, x):
    """Area of what of a polygon lies where its first coordinate is above x, by shearing edges."""
    kept = []
    for a, b in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if a[0] >= x:
            kept.append(a)
        if (a[0] >= x) != (b[0] >= x):
            kept.append(a + (x - a[0]) / (b[0] - a[0]) * (b - a))
    if not kept:
        return 0.0
    u, v = np.array(kept).T
    return 0.5 * abs(np.sum(u * np.roll(v, -1) - np.roll(u, -1) * v))


@pytest.mark.parametrize(
    "outline", [HEXAGON, ARROW, HEXAGON[::-1]], ids=["hexagon", "arrow", "back"]
)
@pytest.mark.parametrize("x", [-0.6, -0.2, 0.0, 0.1, 0.31])
def test_of_a_polygon_of_light_a_half_plane_hides_what_lies_beyond(outline, x):
    """Half-way up, the edge at x hides all beyond 2 x, whatever the polygon's shape and turn."""
    light = np.column_stack([0.5 * outline, np.full(len(outline), 4.0)])
    for turn in (0, 1, 3):
        share = share_seen(over(roof(x)), np.zeros(3), np.roll(light, turn, axis=0))
        whole = area_beyond(outline, -9.0)
        assert share == pytest.approx(1.0 - area_beyond(outline, 4.0 * x) / whole, abs=1e-12)


def test_a_rectangle_is_the_same_as_a_polygon():
    scene, rng = soup(), np.random.default_rng(6)
    light = dataclasses.replace(
        light_of(False), position=np.array([2.0, 3.0, 8.0]),
        half_axes=np.array([(1.5, 0.2, 0.1), (-0.2, 0.9, 0.5)]),
    )  # fmt: skip
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    points = rng.normal(size=(25, 3)) * (3.0, 3.0, 1.0) - (0.0, 0.0, 4.0)
    want = shares_seen(scene, points, light)
    got = shares_seen(scene, points, light.position + signs @ light.half_axes)
    np.testing.assert_allclose(got, want, atol=1e-12)
    assert ((want > 0.05) & (want < 0.95)).sum() > 5


@pytest.mark.parametrize(
    ("corners", "text"),
    [
        ([(0, 0, 0), (1, 0, 0)], "three corners or more"),
        ([(0, 0, 0), (1, 0, 0), (0, np.nan, 0)], "is not finite"),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], "has no area"),
        ([(0, 0, 0), (1, 0, 0), (1, 1, 0.1), (0, 1, 0)], "is not flat"),
    ],
)
def test_what_is_no_polygon_of_light_is_refused(corners, text):
    with pytest.raises(InputError, match=text):
        share_seen(over(roof(0.0)), np.zeros(3), np.array(corners, float))


def test_what_lies_behind_the_light_or_the_point_hides_nothing():
    above, below = roof(-99.0, 4.5), roof(-99.0, -0.5)
    scene = over(above + below + roof(-99.0, 0.0))
    assert share_seen(scene, np.zeros(3), light_of(True)) == 1.0
    assert share_seen(over(roof(-99.0)), np.zeros(3), light_of(True)) == 0.0
    # Seen edge-on, there is nothing to be seen of it.
    assert share_seen(scene, np.array([3.0, 0.0, 4.0]), light_of(True)) == 0.0


def test_a_point_light_is_refused():
    with pytest.raises(InputError, match="has no area; choose an area light"):
        share_seen(over(roof(0.0)), np.zeros(3), Light(POINT, np.array([0.0, 0.0, 4.0])))
