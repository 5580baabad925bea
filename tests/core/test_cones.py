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
    with pytest.raises(InputError, match="cones meet with triangles only"):
        solids.cover(rays, 0, 0.1)
