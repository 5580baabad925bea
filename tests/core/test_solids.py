"""Elementary solids: closed forms, a witness with longer numbers, and nothing that rays break."""

import itertools
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.box import span_box
from accelscope.core.geometry.geometry import boxes_around, in_order
from accelscope.core.geometry.rays import make_ray
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
from accelscope.core.geometry.triangles import Triangles
from accelscope.core.kernels import call, kernel
from solids_reference import EVERY_KIND, LONG, distance, first_crossing, rays_of, trace

EPS = np.finfo(np.float64).eps
OFF = 4.0
"""How far a hit may be off its surface, in units of eps times the largest coordinates, summed over
the axes: as far as off a triangle."""
BESIDE = 32.0
"""How far a ray is moved, in the same units, to see whether it hits for sure."""

has_long_numbers = pytest.mark.skipif(
    np.finfo(np.longdouble).eps > 1e-18, reason="has no longer numbers to compare"
)


def hit_at(item, origin, direction, **others):
    """The t at which one ray hits an item."""
    t, _ = trace(mixed_of([item]), rays_of(origin, [direction], **others))
    return t[0]


# ----------------------------------------------------------------------------------- closed forms


@pytest.mark.parametrize(
    ("item", "origin", "direction", "t"),
    [
        (Sphere((0, 0, 0), 1), (0, 0, -5), (0, 0, 1), 4),
        (Sphere((0, 0, 0), 1), (0, 0, -5), (0, 0, 2), 2),
        (Sphere((0, 0, 0), 1), (0, 0, 0), (0, 1, 0), 1),
        (Sphere((0, 0, 0), 1), (0, 0, 5), (0, 0, 1), np.inf),
        (Sphere((0, 0, 0), 1), (1, 0, -5), (0, 0, 1), 5),
        (Sphere((0, 0, 0), 5), (3, 0, -9), (0, 0, 1), 5),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1), (0, 0, -3), (0, 0, 1), 3),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1), (0, 0, 1), (0, 0, 1), 1),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1), (-4, 0, 1), (1, 0, 0), 3),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1), (0, 0, 1), (0, -1, 0), 1),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1), (-4, 0, 2.5), (1, 0, 0), np.inf),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1, False), (0, 0, -3), (0, 0, 1), np.inf),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1, False), (0, 0, -1), (1, 0, 1), 1),
        (Cone((0, 0, 0), (0, 0, 2), 1, 1, False), (-3, 0, -1.5), (2, 0, 1), 2),
        (Cone((0, 0, 0), (0, 0, 2), 1, 0), (0, 0, 5), (0, 0, -1), 3),
        (Cone((0, 0, 0), (0, 0, 2), 1, 0), (0.5, 0, 5), (0, 0, -1), 4),
        (Cone((0, 0, 0), (0, 0, 2), 1, 0), (-3, 0, 1), (1, 0, 0), 2.5),
        (Cone((0, 0, 0), (0, 0, 2), 1, 0), (-3, 0, 2.5), (1, 0, 0), np.inf),
        (Cone((0, 0, 0), (0, 0, 2), 2, 1), (-3, 0, 1), (1, 0, 0), 1.5),
        (Cone((0, 0, 0), (0, 0, 2), 2, 1), (0, 0, 3), (0, 0, -1), 1),
        (Cone((0, 0, 0), (0, 0, 2), 2, 1), (1.5, 0, 3), (0, 0, -1), 2),
        (Box((0, 0, 0), (1, 2, 3)), (0.5, 1, -1), (0, 0, 1), 1),
        (Box((0, 0, 0), (1, 2, 3)), (0.5, 1, 1), (0, 0, 1), 2),
        (Box((0, 0, 0), (1, 2, 3)), (0, 0, -1), (0, 0, 1), 1),
        (Box((0, 0, 0), (1, 2, 3)), (2, 1, -1), (0, 0, 1), np.inf),
        (Box((0, 0, 1), (1, 2, 1)), (0.5, 1, -1), (0, 0, 1), 2),
        (Disc((0, 0, 0), (0, 0, 1), 1), (0.5, 0.5, 2), (0, 0, -1), 2),
        (Disc((0, 0, 0), (0, 0, -7), 1), (1, 0, 2), (0, 0, -1), 2),
        (Disc((0, 0, 0), (0, 0, 1), 1), (0.75, 0.75, 2), (0, 0, -1), np.inf),
        (Disc((0, 0, 0), (0, 0, 1), 1), (-2, 0, 0), (1, 0, 0), np.inf),
        (EVERY_KIND["arrow"], (0.75, 0, 0), (0, 0, 1), 0.5),
        (EVERY_KIND["arrow"], (0, 0, 0), (0, 0, 1), np.inf),
        (EVERY_KIND["arrow"], (0, -0.5, 0), (0, 0, 1), 0.5),
        (EVERY_KIND["arrow"], (0, -1, 0), (0, 0, 1), 0.5),
        (EVERY_KIND["arrow"], (1, 0, 0), (0, 0, 1), 0.5),
        (Placed(Sphere((0, 0, 0), 1), [[2, 0, 0, 1], [0, 3, 0, 0], [0, 0, 4, 0]]),
         (1, 0, -9), (0, 0, 1), 5),
        (Placed(Cone((0, 0, 0), (0, 0, 1), 1, 1), [[1, 0, 1, 0], [0, 1, 0, 0], [0, 0, 1, 0]]),
         (-4, 0, 0.5), (1, 0, 0), 3.5),
        (Placed(Box((0, 0, 0), (1, 1, 1)), [[0, -2, 0, 0], [2, 0, 0, 0], [0, 0, 2, 0]]),
         (-5, 1, 1), (1, 0, 0), 3),
    ],
)  # fmt: skip
def test_hits_are_where_geometry_says(item, origin, direction, t):
    assert hit_at(item, origin, direction) == t


@pytest.mark.parametrize("name", EVERY_KIND)
def test_the_first_hit_is_from_t_min_on(name):
    """Where a ray goes on behind its first hit, it meets what is next, or nothing."""
    item, rng = EVERY_KIND[name], np.random.default_rng(5)
    points, _ = special_points(item)
    some = points[rng.integers(len(points), size=(2, 2000))]
    origins = 4 * rng.normal(size=(2000, 3))
    directions = some[0] + rng.random((2000, 1)) * (some[1] - some[0]) - origins
    directions += 1e-4 * rng.normal(size=(2000, 3))
    geometry = mixed_of([item])
    first, _ = trace(geometry, rays_of(origins, directions))
    hit = np.flatnonzero(np.isfinite(first) & (first > 0))
    assert len(hit) > 5
    origins, directions, first = origins[hit], directions[hit], first[hit]
    at_once, _ = trace(geometry, rays_of(origins, directions, t_min=first))
    np.testing.assert_array_equal(at_once, first)
    later, _ = trace(geometry, rays_of(origins, directions, t_min=first * (1 + 1e-9)))
    moved, _ = trace(
        geometry, rays_of(origins + (first * (1 + 1e-9))[:, None] * directions, directions)
    )
    np.testing.assert_array_equal(np.isfinite(later), np.isfinite(moved))
    both = np.isfinite(later)
    np.testing.assert_allclose(later[both] - first[both], moved[both], atol=1e-8)


@pytest.mark.parametrize(
    ("item", "surface"),
    [
        (Sphere((0.1, 0.2, 0), 0.7), 4 * math.pi * 0.49),
        (Cone((0, 0, -0.6), (0, 0, 0.6), 0.5, 0.5), 2 * math.pi * 0.5 * 1.7),
        (Cone((0.1, -0.2, -0.5), (-0.3, 0.4, 0.5), 0.5, 0.2),
         math.pi * (0.25 + 0.04 + 0.7 * math.sqrt(0.16 + 0.36 + 1 + 0.09))),
        (Cone((0, 0, 0), (0.6, 0, 0.6), 0.5, 0),
         math.pi * (0.25 + 0.5 * math.sqrt(0.72 + 0.25))),
        (Box((-0.5, -0.4, -0.1), (0.3, 0.2, 0.6)), 2 * (0.8 * 0.6 + 0.6 * 0.7 + 0.7 * 0.8)),
        (Disc((0.1, 0, 0.2), (1, 2, 3), 0.6), 2 * math.pi * 0.36),
    ],
)  # fmt: skip
def test_lines_hit_a_convex_solid_in_proportion_to_its_surface(item, surface):
    """Of uniform lines through a ball, the share p = S_i / S hits a convex solid inside."""
    rng = np.random.default_rng(11)
    ends = rng.normal(size=(2, 200_000, 3))
    ends /= np.linalg.norm(ends, axis=2, keepdims=True)
    t, _ = trace(mixed_of([item]), rays_of(ends[0], ends[1] - ends[0]))
    p = surface / (4 * math.pi)
    assert abs(np.isfinite(t).mean() - p) < 4 * math.sqrt(p * (1 - p) / len(t))


# ------------------------------------------------------------------------------------ the witness


def special_points(item):
    """Points on rims, edges, corners and tips, and directions of axes and sides."""
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
    if isinstance(item, Sphere):
        return np.array(item.centre) + item.radius * np.array(
            [d for d in itertools.product((-1, 0, 1), repeat=3) if np.abs(d).sum() == 1]
        ), np.eye(3)
    if isinstance(item, Cone | Disc):
        ends = [item.centre] if isinstance(item, Disc) else [item.base, item.apex]
        radii = [item.radius] if isinstance(item, Disc) else [item.base_radius, item.apex_radius]
        axis = np.array(item.normal if isinstance(item, Disc) else np.subtract(*ends), float)
        u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
        u /= np.linalg.norm(u)
        v = np.cross(axis / np.linalg.norm(axis), u)
        rims = [np.array(e) + r * circle @ [u, v] for e, r in zip(ends, radii, strict=True)]
        along = [axis, u, v, *([] if len(rims) == 1 else rims[1] - rims[0])]
        return np.vstack([*rims, ends]), np.array(along)
    if isinstance(item, Box):
        corners = np.array(list(itertools.product(*zip(item.lower, item.upper, strict=True))))
        middles = 0.5 * (corners[:, None] + corners[None]).reshape(-1, 3)
        return np.vstack([corners, middles]), np.eye(3)
    corners = np.array(item.start if isinstance(item, MovingTriangle) else item.corners, float)
    edges = np.roll(corners, -1, axis=0) - corners
    return np.vstack([corners, corners + 0.5 * edges]), edges


def awkward_rays(item, seed=2):
    """Families of rays: origins and directions."""
    rng = np.random.default_rng(seed)
    points, along = special_points(item)
    n = 600
    some = points[rng.integers(len(points), size=n)]
    axes = along[rng.integers(len(along), size=n)] * rng.choice([-1.0, 1.0], size=(n, 1))
    within = some + rng.random((n, 1)) * (rng.permutation(some) - some)
    unit = np.eye(3)[rng.integers(3, size=n)] * rng.choice([-1.0, 1.0], size=(n, 1))
    away = rng.normal(size=(n, 3))
    middle = points.mean(axis=0)
    aside = np.cross(away, some - middle)
    nearby = 10.0 ** rng.uniform(-15, -1, size=(n, 1)) * rng.normal(size=(n, 3))
    inside = middle + 0.2 * rng.normal(size=(n, 3))
    return {
        "generic": (3 * away, within + 1e-4 * rng.normal(size=(n, 3)) - 3 * away),
        "through rims and tips": (some - away, away),
        "next to rims and tips": (some - away + nearby, away),
        "from rims and tips": (some, away),
        "parallel to axes": (inside - 4 * unit, unit),
        "parallel to axes, through rims and tips": (some - 4 * unit, unit),
        "along its axes": (inside - 4 * axes, axes),
        "along its axes, through rims and tips": (some - 4 * axes, axes),
        "tangent": (some - aside, aside),
        "from inside": (inside, away),
        "along from inside": (inside, axes),
        "from far away": (inside - 1e6 * away, away),
        "long directions": (inside - 3 * away, 1e200 * away),
        "short directions": (inside - 3 * away, 1e-200 * away),
    }


@has_long_numbers
@pytest.mark.parametrize("name", EVERY_KIND)
def test_a_witness_with_longer_numbers_agrees(name):
    """Hits lie on the surface; and they are those that a ray moved a little aside has as well."""
    item, time = EVERY_KIND[name], 0.375
    geometry = mixed_of([item])
    for family, (origins, directions) in awkward_rays(item).items():
        rays = rays_of(origins, directions, times=time)
        t, _ = trace(geometry, rays)
        assert not np.isnan(t).any()
        scale = EPS * (np.abs(rays.origins) + geometry.reach).sum(axis=1)
        hit = np.isfinite(t)
        points = rays.origins[hit] + t[hit, None].astype(LONG) * rays.directions[hit]
        off = distance(item, points, time) / scale[hit]
        assert off.max(initial=0) < OFF, (family, off.max(), off.argmax())
        moves = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)])
        length = np.linalg.norm(rays.directions.astype(LONG), axis=1)
        room = BESIDE * scale / length
        around = np.stack([
            first_crossing(item, rays.origins + BESIDE * scale[:, None].astype(LONG) * move,
                           rays.directions, time)
            for move in moves
        ])  # fmt: skip
        # A hit nearer than those is on the surface, too: that has been seen above.
        is_sure = (np.isfinite(around) & (around > room)).all(axis=0)
        assert hit[is_sure].all(), (family, np.flatnonzero(is_sure & ~hit)[:3])
        # Moved aside, a ray meets a slanted side later; the next side is much farther.
        assert (t <= around.max(axis=0) + 32 * room)[is_sure].all(), family
        if family == "generic":
            assert is_sure.sum() > 60


# --------------------------------------------------------------------------------------- no crack


def test_no_ray_passes_between_polygons_that_share_edges():
    """A closed surface of concave and convex polygons in many planes: hit from inside always."""
    rng = np.random.default_rng(1)
    ring = [(math.cos(k), math.sin(k)) for k in np.arange(9) * 2 * math.pi / 9]
    # A star with a concave outline at the bottom, shifted at the top; its sides are triangles.
    low = [(x * (1 + k % 2), y * (1 + k % 2), -1.0) for k, (x, y) in enumerate(ring)]
    high = [(1.1 * x + 0.1, 1.3 * y, 1.0) for x, y in ring]
    items = [Polygon(low), Polygon(high)]
    for k in range(9):
        a, b, c, d = low[k], low[(k + 1) % 9], high[(k + 1) % 9], high[k]
        items += [Polygon([a, b, c]), Polygon([a, c, d])]
    corners = np.array(low + high)
    start = np.array([0.05, 0.02, 0.1])
    ends = corners[rng.integers(18, size=(2, 20_000))]
    towards = ends[0] + rng.random((20_000, 1)) * (ends[1] - ends[0])
    t, _ = trace(mixed_of(items), rays_of(start, np.vstack([towards, corners]) - start))
    assert np.isfinite(t).all()


@pytest.mark.parametrize(
    "item", [EVERY_KIND["capped cylinder"], EVERY_KIND["cone"], EVERY_KIND["truncated cone"],
             EVERY_KIND["upright cylinder"], EVERY_KIND["box"], EVERY_KIND["plate"],
             EVERY_KIND["needle"], EVERY_KIND["sphere"]],
)  # fmt: skip
def test_no_ray_leaves_a_closed_solid_unseen(item):
    """Also where it passes a rim, an edge or a tip."""
    rng = np.random.default_rng(8)
    points, _ = special_points(item)
    middle = points.mean(axis=0)
    some = points[rng.integers(len(points), size=5000)]
    nudges = rng.choice([0, 1e-17, 1e-16, 1e-15], size=(5000, 1)) * rng.normal(size=(5000, 3))
    t, _ = trace(mixed_of([item]), rays_of(middle, some + nudges - middle))
    assert np.isfinite(t).all()


# ------------------------------------------------------------------------------- boxes, ids, order


@kernel
def spans_of(boxes, rays, reach, out):
    for i in range(len(out)):
        out[i, 0], out[i, 1] = span_box(boxes, 0, make_ray(rays, i, reach), np.inf)


@pytest.mark.parametrize("name", EVERY_KIND)
def test_a_hit_is_within_the_interval_of_its_own_box(name):
    item = EVERY_KIND[name]
    geometry = mixed_of([item])
    for family, (origins, directions) in awkward_rays(item, seed=9).items():
        rays = rays_of(origins, directions, times=0.75)
        t, _ = trace(geometry, rays)
        spans = np.empty((len(t), 2))
        call(spans_of, boxes_around(geometry), rays.arrays(), geometry.reach, spans)
        hit = np.isfinite(t)
        assert (spans[hit, 0] <= t[hit]).all(), family
        assert (t[hit] <= spans[hit, 1]).all(), family


def test_boxes_are_those_of_closed_forms():
    """Exact where the numbers are round, else at most some units in the last place larger."""
    shear = [[1, 0, 1, 0], [0, 1, 0, 0], [0, 0, 1, 0]]
    root = math.sqrt(0.5)
    boxes = mixed_of(
        [
            Sphere((1, 2, 3), 0.5),
            Cone((0, 0, 0), (0, 0, 2), 1, 0.5),
            Cone((1, 2, 3), (4, 2, 3), 0.25, 0),
            Box((0.1, 0.2, 0.3), (0.4, 0.5, 0.6)),
            Disc((1, 1, 1), (0, -3, 0), 2),
            Disc((0, 0, 0), (1, 1, 0), 1),
            Placed(Sphere((0, 0, 0), 1), shear),
            Placed(Box((0, 0, 0), (1, 1, 1)), shear),
            EVERY_KIND["moving triangle"],
            EVERY_KIND["arrow"],
        ]
    ).boxes
    exact = np.array([
        [0.5, 1.5, 2.5, 1.5, 2.5, 3.5], [-1, -1, 0, 1, 1, 2], [1, 1.75, 2.75, 4, 2.25, 3.25],
        [0.1, 0.2, 0.3, 0.4, 0.5, 0.6], [-1, 1, -1, 3, 1, 3], [-root, -root, -1, root, root, 1],
        [-2 * root, -1, -1, 2 * root, 1, 1], [0, 0, 0, 2, 1, 1],
        [-0.9, -0.3, -0.6, 0.9, 0.9, 0.6], [-1, -1, 0.5, 1, 1, 0.5],
    ])  # fmt: skip
    sure = [0, 1, 2, 3, 4, 7, 8, 9]
    np.testing.assert_array_equal(boxes[sure], exact[sure])
    outward = np.array([-1, -1, -1, 1, 1, 1]) * (boxes - exact)
    assert (outward >= -EPS).all()
    assert (outward <= 32 * EPS).all()


def test_triangles_at_rest_are_hit_as_triangles_are():
    """The same bits, also among other items, and as one that moves from where it is to there."""
    rng = np.random.default_rng(4)
    corners = rng.normal(size=(60, 3, 3))
    corners[7, 2] = 0.5 * (corners[7, 0] + corners[7, 1])
    rays = rays_of(3 * rng.normal(size=(3000, 3)), rng.normal(size=(3000, 3)), times=0.3)
    resting = mixed_of([Triangle(one) for one in corners])
    moving = mixed_of([MovingTriangle(one, one) for one in corners])
    plain = Triangles(corners, np.arange(60, dtype=np.int32), resting.reach)
    expected = trace(in_order(plain, np.arange(60)), rays)
    assert np.isfinite(expected[0]).sum() > 300
    np.testing.assert_array_equal(trace(resting, rays), expected)
    np.testing.assert_array_equal(trace(moving, rays), expected)


def test_of_equal_hits_the_lowest_id_wins_in_any_order():
    items = [Sphere((0, 0, 0), 1), Box((-1, -1, -1), (1, 1, 1)), Sphere((0, 0, 0), 1)]
    geometry = mixed_of(items)
    rays = rays_of((0, 0, -5), [(0, 0, 1)])
    for order in itertools.permutations(range(3)):
        t, primitive = trace(in_order(geometry, np.array(order)), rays)
        assert (t[0], primitive[0]) == (4.0, 0)


# ---------------------------------------------------------------------------------------- hostile


@pytest.mark.parametrize("size", [1e-30, 1e-15, 1e15, 1e30])
def test_size_does_not_matter(size):
    for name, item in EVERY_KIND.items():
        origins, directions = awkward_rays(item)["generic"]
        t, _ = trace(mixed_of([item]), rays_of(origins, directions))
        scaled, _ = trace(mixed_of([scale(item, size)]), rays_of(origins * size, directions * size))
        np.testing.assert_allclose(scaled, t, rtol=1e-9, atol=1e-9, err_msg=name)


def scale(item, size):
    lengths = {
        "centre", "radius", "base", "apex", "base_radius", "apex_radius", "lower", "upper",
        "corners", "start", "end",
    }  # fmt: skip
    changed = {f: np.multiply(getattr(item, f), size) for f in item._fields if f in lengths}
    return item._replace(**changed)


def test_what_has_no_extent_is_never_hit():
    singular = [[1, 0, 0, 0], [0, 1, 0, 0], [1, 1, 0, 0]]
    items = [
        Sphere((0, 0, 0), 0), Cone((0, 0, 0), (0, 0, 1), 0, 0), Disc((0, 0, 0), (0, 0, 1), 0),
        Box((0, 0, 0), (1, 0, 0)), Box((0, 0, 0), (0, 0, 0)), Triangle(np.zeros((3, 3))),
        Polygon([(0, 0, 0), (1, 1, 1), (2, 2, 2), (0.5, 0.5, 0.5)]), Polygon(np.ones((4, 3))),
        Placed(Sphere((0, 0, 0), 1), singular), Placed(Cone((0, 0, 0), (0, 0, 1), 1, 1), singular),
        Placed(Box((0, 0, 0), (1, 1, 1)), np.zeros((3, 4))),
        MovingTriangle(np.zeros((3, 3)), np.ones((3, 3))),
    ]  # fmt: skip
    rng = np.random.default_rng(0)
    origins = np.vstack([np.zeros((100, 3)), rng.integers(-2, 3, (2000, 3))])
    directions = rng.integers(-2, 3, (2100, 3)) + 0.0
    directions[~directions.any(axis=1)] = 1
    geometry = mixed_of(items)
    assert not np.isnan(geometry.boxes).any()
    t, _ = trace(geometry, rays_of(origins, directions))
    assert np.isinf(t).all()


def test_no_number_breaks_the_arithmetic():
    """Items and rays of sizes that have nothing to do with each other: a t or none, never NaN."""
    rng = np.random.default_rng(6)

    def numbers(*shape):
        return rng.choice([-1.0, 0.0, 1.0], shape) * 10.0 ** rng.uniform(-30, 30, shape)

    items = []
    for _ in range(30):
        a, b, c = numbers(3), numbers(3), numbers(3)
        r, s = np.abs(numbers(2))
        items += [
            Sphere(a, r), Cone(a, b + 1e-31, r, s), Cone(a, b + 1e-31, r, s, False),
            Box(np.minimum(a, b), np.maximum(a, b)), Disc(a, b + 1e-30, r),
            Triangle([a, b, c]), MovingTriangle([a, b, c], [b, c, a]), Polygon([a, b, c]),
            Placed(Sphere(a, r), numbers(3, 4)), Placed(Cone(a, b + 1e-31, r, s), numbers(3, 4)),
            Placed(Box(np.minimum(a, b), np.maximum(a, b)), numbers(3, 4)),
            Placed(Disc(a, b + 1e-30, r), numbers(3, 4)),
        ]  # fmt: skip
    directions = numbers(300, 3)
    directions[~directions.any(axis=1)] = 1.0
    for item in items:
        t, primitive = trace(mixed_of([item]), rays_of(numbers(300, 3), directions, times=0.5))
        assert ((t >= 0) & (np.isfinite(t) == (primitive == 0))).all()


@pytest.mark.parametrize(
    ("item", "message"),
    [
        (Sphere((0, 0, np.nan), 1), "item 1: the centre must be finite and below 1e\\+100"),
        (Sphere((0, 0, 0), np.inf), "item 1: the radius must be finite"),
        (Sphere((0, 0, 0), -1), "item 1: a radius must not be negative"),
        (Sphere((0, 0), 1), "item 1: the centre must be 3 numbers"),
        (Sphere((0, 0, 0), (1, 2)), "item 1: the radius must be one number"),
        (Cone((0, 0, 0), (0, 0), 1, 1), "item 1: an end of the axis must be 3 numbers"),
        (Cone((0, 0, 0), (0, 0, 0), 1, 1), "item 1: the axis of a cone is zero"),
        (Cone((0, 0, 0), (0, 0, 1), 1, -1), "item 1: a radius must not be negative"),
        (Box((0, 0, 1), (1, 1, 0)), "item 1: the lower corner"),
        (Disc((0, 0, 0), (0, 0, 0), 1), "item 1: the normal of a disc is zero"),
        (Polygon([(0, 0, 0), (1, 0, 0)]), "item 1: a polygon needs three corners, it has 2"),
        (Polygon([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 1e-3)]), "item 1: .* in a plane"),
        (Polygon([(0, 0, 0), (1, 0, 0), (1, 1, np.inf)]), "item 1: corners must be finite"),
        (Triangle([(0, 0, 0), (1, 0, 0)]), "item 1: a triangle must be 3 x 3 numbers"),
        (Placed(Sphere((0, 0, 0), 1), np.eye(3)), "item 1: the matrix must be 3 x 4 numbers"),
        (Placed(Polygon(np.eye(3)), np.eye(3, 4)), "item 1 is a Polygon; a matrix places one of"),
        ("sphere", "item 1 is a str; a scene is made of one of Sphere"),
    ],
)  # fmt: skip
def test_bad_items_are_refused_by_number(item, message):
    with pytest.raises(InputError, match=message):
        mixed_of([Sphere((0, 0, 0), 1), item, Sphere((0, 0, 0), 1)])


def test_a_polygon_of_three_corners_lies_in_a_plane():
    """However thin it is, and wherever."""
    rng = np.random.default_rng(12)
    corners = rng.normal(size=(2000, 3, 3)) + 10.0 ** rng.uniform(-3, 6, (2000, 1, 1))
    share, thin = rng.random((2000, 1)), 10.0 ** rng.uniform(-18, 0, (2000, 1))
    on_edge = corners[:, 0] + share * (corners[:, 1] - corners[:, 0])
    corners[:, 2] = on_edge + thin * (corners[:, 2] - on_edge)
    assert len(mixed_of([Polygon(one) for one in corners]).ids) == 2000


WITHOUT_NUMBA = """
import numpy as np
from solids_reference import EVERY_KIND, rays_of, trace
from accelscope.core.geometry.solids.making import mixed_of
rng = np.random.default_rng(3)
origins = 3 * rng.normal(size=(40, 3))
rays = rays_of(origins, rng.normal(scale=0.5, size=(40, 3)) - origins, times=0.5)
print(*(t.hex() for item in EVERY_KIND.values() for t in trace(mixed_of([item]), rays)[0]))
"""


def test_plain_python_has_the_same_bits():
    path = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    compiled, plain = (
        subprocess.run(
            [sys.executable, "-c", WITHOUT_NUMBA], check=True, capture_output=True, text=True,
            env=os.environ | {"PYTHONPATH": path, **without},
        ).stdout
        for without in ({}, {"NUMBA_DISABLE_JIT": "1"})
    )  # fmt: skip
    assert compiled == plain
    assert compiled.count("inf") < 0.9 * len(compiled.split())
