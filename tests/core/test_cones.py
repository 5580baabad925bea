# SPDX-License-Identifier: GPL-3.0-or-later
"""Cones and pyramids through all structures that take them: the same items, and the right ones."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import TEST
from accelscope.core.errors import InputError
from accelscope.core.geometry.cones import ROUND, SQUARE, Cone, Spread
from accelscope.core.geometry.kinds import KINDS
from accelscope.core.geometry.rays import Ray, Rays
from accelscope.core.geometry.solids.description import Placed, Sphere, Triangle
from accelscope.core.geometry.solids.mixed import CENTRE, SPHERE
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structure_named
from accelscope.sample_scenes import make_sample

ANGLES = [0.001, 0.05, 0.3, 0.9, 1.5]
SPECS = [
    ("grid", {}),
    ("grid", {"resolution": (7, 1, 3), "mailbox": False}),
    ("grid", {"lazy": True, "mailbox": True}),
    ("bvh", {"arity": "4"}),
    ("sorted_volumes", {}),
    ("octree", {}),
    ("kdtree", {}),
    *(
        pytest.param(name, {"walk": walk, **more}, marks=pytest.mark.exhaustive)
        for name in ("octree", "kdtree")
        for walk, more in (
            ("march", {}),
            ("segments", {}),
            ("heap", {"mailbox": True}),
            ("neighbours", {}),
            ("neighbours", {"links": "stored"}),
        )
    ),
    ("bvh", {"volume": "aabb"}),
    *(
        pytest.param("bvh", {"volume": volume}, marks=pytest.mark.exhaustive)  # a walk each
        for volume in sorted(set(KINDS) - {"aabb"})
    ),
]


def soup(count=150, seed=3):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(count, 1, 3)) * 2.0 + rng.normal(size=(count, 3, 3)) * 0.4
    return Scene.from_triangles(corners, "soup")


def cones(count=40, seed=5):
    """Axes with their angles; every other cone has two ends."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(count, 3)) * 3.0
    directions = rng.normal(size=(count, 3)) - 0.3 * origins
    is_cut = np.arange(count) % 2 == 1
    rays = Rays.from_arrays(
        origins, directions, np.where(is_cut, 2.0, np.inf), t_min=np.where(is_cut, 0.3, 0.0)
    )
    return rays, rng.choice(ANGLES, count)


def spreads(angle, seed):
    """A round cone, an elliptic one and a pyramid with that angle and another one."""
    rng = np.random.default_rng(seed)
    across, other = rng.normal(size=3), float(rng.choice(ANGLES))
    return [
        angle,
        Spread(float(angle), other, across=across),
        Spread(float(angle), other, SQUARE, across),
    ]


def built(name, scene, **changes):
    kind = structure_named(name)
    return kind.build(scene, dataclasses.replace(kind.Settings(), **changes))


@pytest.mark.parametrize(("name", "changes"), SPECS, ids=lambda value: str(value))
def test_every_structure_finds_what_naive_finds(name, changes):
    scene = soup()
    naive, structure = built("naive", scene), built(name, scene, **changes)
    rays, angles = cones()
    fewer = 0
    for index, angle in enumerate(angles):
        for spread in spreads(angle, index):
            expected, _ = naive.cover(rays, index, spread)
            items, steps = structure.cover(rays, index, spread)
            np.testing.assert_array_equal(items, expected)
            tests = steps.events_of(TEST)
            assert steps.tally()["N_IT"] == len(tests)
            fewer += len(tests) < len(scene)
    assert fewer > 20 or structure.name == "naive" or "resolution" in changes


def test_what_is_met_has_a_point_in_the_cone():
    """Points spread over every triangle are looked at: none in a cone may be missed."""
    scene = soup()
    naive = built("naive", scene)
    rays, angles = cones()
    share = np.linspace(0.0, 1.0, 50)
    a, b = (grid.ravel() for grid in np.meshgrid(share, share))
    weights = np.stack([1.0 - a - b, a, b], axis=1)[a + b <= 1.0]
    points = np.einsum("wk,nkc->nwc", weights, scene.triangles)
    for kind in range(3):
        unseen = total = 0
        for index, angle in enumerate(angles):
            spread = spreads(angle, index)[kind]
            if kind == 0:
                spread = Spread(float(spread))
            length = np.linalg.norm(rays.directions[index])
            seen = points - rays.origins[index]
            along = seen @ (rays.directions[index] / length)
            across, above = spread.axes(rays.directions[index : index + 1])
            wide, high = spread.half_widths()
            x, y = seen @ across[0] / wide, seen @ above[0] / high
            far = np.maximum(abs(x), abs(y)) if spread.shape == SQUARE else np.hypot(x, y)
            inside = far <= along
            inside &= (along >= rays.t_min[index] * length) & (along <= rays.t_max[index] * length)
            expected = set(np.flatnonzero(inside.any(axis=1)).tolist())
            items = set(naive.cover(rays, index, spread)[0].tolist())
            assert expected <= items
            unseen, total = unseen + len(items - expected), total + len(items)
        # Those that are only grazed, between two of the points.
        assert unseen <= 0.02 * total


def test_a_pyramid_reaches_into_its_corners_and_a_cone_does_not():
    """A small triangle near the corner (1, 1) of the square of 45 degrees, before the eye."""
    corner = np.array([[[0.9, 0.9, -1.0], [0.95, 0.9, -1.0], [0.9, 0.95, -1.0]]])
    naive = built("naive", Scene.from_triangles(corner, "corner"))
    axis = Rays.from_arrays(np.zeros((1, 3)), np.array([[0.0, 0.0, -2.0]]))
    across = np.array([1.0, 0.0, 0.0])
    angle = np.pi / 4.0
    for shape, expected in ((SQUARE, [0]), (ROUND, [])):
        assert list(naive.cover(axis, 0, Spread(angle, shape=shape, across=across))[0]) == expected
    # Turned by 45 degrees, its sides pass at a distance of 1 from the axis, the corner at 1.27.
    turned = Spread(angle, shape=SQUARE, across=np.array([1.0, 1.0, 0.0]))
    assert list(naive.cover(axis, 0, turned)[0]) == []
    narrow = Spread(np.arctan(0.9) * (1.0 - 1e-12), angle, SQUARE, across)
    assert list(naive.cover(axis, 0, narrow)[0]) == []
    wide = Spread(np.arctan(0.9) * (1.0 + 1e-12), angle, SQUARE, across)
    assert list(naive.cover(axis, 0, wide)[0]) == [0]


def test_a_square_beside_the_axis_is_met_from_its_angle_on():
    square = np.array([[[2.0, 1.0, -9.0], [2.0, 1.0, 9.0], [2.0, 5.0, 0.0]]])
    naive = built("naive", Scene.from_triangles(square, "square"))
    axis = Rays.from_arrays(np.zeros((1, 3)), np.array([[3.0, 0.0, 0.0]]))
    exact = np.arctan(0.5)  # its nearest point is (2, 1, 0)
    assert list(naive.cover(axis, 0, exact * (1.0 + 1e-12))[0]) == [0]
    assert list(naive.cover(axis, 0, exact * (1.0 - 1e-12))[0]) == []


def test_a_triangle_around_the_axis_is_met_by_the_thinnest_cone():
    around = np.array([[[2.0, -1.0, -1.0], [2.0, 2.0, 0.0], [2.0, -1.0, 1.0]]])
    naive = built("naive", Scene.from_triangles(around, "around"))
    axis = Rays.from_arrays(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), 5.0)
    assert list(naive.cover(axis, 0, 1e-9)[0]) == [0]
    short = Rays.from_arrays(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]), 1.5)
    assert list(naive.cover(short, 0, 1e-9)[0]) == []


def test_a_cone_has_all_that_a_ray_has():
    assert Cone._fields[: len(Ray._fields)] == Ray._fields


def test_refusals():
    rays, _ = cones(1)
    for name, kind in general_structures().items():
        structure = kind.build(soup(20), kind.Settings())
        if not structure.takes_cones:
            with pytest.raises(InputError, match=f"cones do not go through {name}; choose"):
                structure.cover(rays, 0, 0.1)
    naive = built("naive", soup(20))
    for angle in (0.0, np.pi / 2.0, np.nan):
        with pytest.raises(InputError, match="angle of a cone"):
            naive.cover(rays, 0, angle)
        with pytest.raises(InputError, match="angle of a pyramid"):
            naive.cover(rays, 0, Spread(0.1, angle, SQUARE))
    with pytest.raises(InputError, match="choose another 'across'"):
        naive.cover(rays, 0, Spread(0.1, across=rays.directions[0]))
    solids = built("naive", make_sample("balls:size=1"))
    with pytest.raises(InputError, match="cones meet with triangles and spheres only"):
        solids.cover(rays, 0, 0.1)
    balls = built("naive", spheres_and_triangles())
    for spread in (Spread(0.1, 0.2), Spread(0.1, shape=SQUARE)):
        with pytest.raises(InputError, match="ellipses and pyramids meet with triangles only"):
            balls.cover(rays, 0, spread)
    stretched = Placed(Sphere((0.0, 0.0, 0.0), 1.0), np.hstack([np.diag([1, 1, 2.0]), [[0]] * 3]))
    with pytest.raises(InputError, match="cones meet with triangles and spheres only"):
        built("naive", Scene.from_items([stretched], "egg")).cover(rays, 0, 0.1)


def spheres_and_triangles(count=120, seed=8):
    rng = np.random.default_rng(seed)
    places, radii = rng.normal(size=(count, 3)) * 2.0, rng.random(count) * 0.5 + 0.01
    spheres = [Sphere(*each) for each in zip(places, radii, strict=True)]
    # Some that a matrix has turned and scaled are spheres as well.
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    placed = [Placed(each, np.column_stack([1.7 * turn, (0.1, 0.2, 0.3)])) for each in spheres[:9]]
    return Scene.from_items(
        [*placed, *spheres[9:], *map(Triangle, soup(40).triangles)], "spheres and triangles"
    )


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("bvh", {}),
        ("grid", {"mailbox": True}),
        *(
            pytest.param(name, changes, marks=pytest.mark.exhaustive)
            for name, changes in (
                ("bvh", {"arity": "4"}),
                ("bvh", {"volume": "sphere"}),
                ("bvh", {"volume": "kdop14"}),
                ("octree", {}),
                ("kdtree", {}),
                ("sorted_volumes", {}),
            )
        ),
    ],
    ids=lambda value: str(value),
)
def test_round_cones_meet_spheres_through_every_structure(name, changes):
    scene = spheres_and_triangles()
    naive, structure = built("naive", scene), built(name, scene, **changes)
    rays, angles = cones()
    balls = triangles = 0
    for index, angle in enumerate(angles):
        expected, _ = naive.cover(rays, index, angle)
        items, _ = structure.cover(rays, index, angle)
        np.testing.assert_array_equal(items, expected)
        balls, triangles = balls + (items < 120).sum(), triangles + (items >= 120).sum()
    assert balls > 100
    assert triangles > 30


def test_a_sphere_is_met_where_a_point_of_it_lies_in_the_cone():
    """No point of a sphere in a cone is missed; and where none is near, it is not met."""
    scene = spheres_and_triangles()
    naive = built("naive", scene)
    rays, angles = cones()
    number = np.arange(20_000) + 0.5
    z, turn = 1.0 - number / 10_000.0, np.pi * (1.0 + 5.0**0.5) * number
    unit = np.column_stack(
        [np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z]
    )
    is_sphere = np.flatnonzero(scene.geometry.kinds == SPHERE)
    centres = scene.geometry.rows[is_sphere, CENTRE]
    radii = np.linalg.norm(scene.geometry.points[scene.geometry.first[is_sphere]], axis=1)
    met = grazed = 0
    for index, angle in enumerate(angles):
        items = set(naive.cover(rays, index, angle)[0].tolist())
        length = np.linalg.norm(rays.directions[index])
        axis, slope = rays.directions[index] / length, np.tan(angle)
        low, high = rays.t_min[index] * length, rays.t_max[index] * length
        for item, centre, radius in zip(is_sphere.tolist(), centres, radii, strict=True):
            points = centre + radius * unit - rays.origins[index]
            along = points @ axis
            across = np.linalg.norm(points - along[:, None] * axis, axis=1)
            # How far each is outside: of the side, and of the two ends.
            out = np.maximum.reduce(
                [(across - along * slope) * np.cos(angle), low - along, along - high]
            )
            if (out <= 0.0).any():
                assert item in items
                met += 1
            # Of 20,000 points the next is within 0.02 radii, or in a narrow cone not.
            elif out.min() > 0.03 * radius:
                assert item not in items
            else:
                grazed += item in items
    assert met > 150
    # Those between the points and the tolerance: 2 of 1,310.
    assert grazed < 0.01 * met
