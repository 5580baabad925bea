# SPDX-License-Identifier: GPL-3.0-or-later
"""Unions of two volumes lost hits on solids, and `validate` had nothing against them.

Each member was fitted to a half of the triangles of the item's hull, but the surface of what is
round, and what moves, lies between them: outside of both.
"""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.fit import sticking_out
from accelscope.core.geometry.geometry import hulls_of
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Cone, MovingTriangle, Sphere, Triangle
from accelscope.core.sah.volume_around import volume_around
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named

CORNERS = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
UP = np.array([0.0, 0.0, 1.0])


def scenes():
    moving = MovingTriangle(CORNERS, CORNERS + 8.0 * UP)
    several = [Sphere((2.5 * n, 0.0, 0.0), 1.0) for n in range(3)]
    return {
        "sphere": Scene.from_items([Sphere((0.0, 0.0, 0.0), 1.0)], "sphere"),
        "cylinder": Scene.from_items([Cone((0, 0, -2), (0, 0, 2), 1.0, 1.0)], "cylinder"),
        "moving": Scene.from_items([moving], "moving"),
        "three": Scene.from_items([*several, Triangle(CORNERS + 3.0 * UP)], "three"),
    }


@pytest.mark.parametrize("volume", ["two_boxes", "two_spheres"])
@pytest.mark.parametrize("name", scenes())
def test_unions_around_solids_lose_no_hit(name, volume):
    scene, rng = scenes()[name], np.random.default_rng(1)
    size = scene.upper - scene.lower
    ends = scene.lower + size * (1.4 * rng.random((2, 4000, 3)) - 0.2)
    rays = Rays.from_arrays(ends[0], ends[1] - ends[0], times=rng.random(4000))
    naive, kind = structure_named("naive"), structure_named("sorted_volumes")
    want, _ = naive.build(scene, naive.Settings()).trace(rays)
    made = kind.build(scene, dataclasses.replace(kind.Settings(), volume=volume, parts=1))
    assert made.validate() == []
    got, _ = made.trace(rays)
    assert (want.primitive >= 0).sum() > 400
    np.testing.assert_array_equal(got.primitive, want.primitive)
    np.testing.assert_array_equal(got.t, want.t)


def test_a_hull_that_two_members_share_sticks_out():
    """What was built before would be found now: one half in the one, one in the other."""
    scene = scenes()["sphere"]
    corners, places = hulls_of(scene.geometry)
    union = volume_around(scene, "two_boxes")
    node = np.zeros(1, int), np.ones(1, int)
    assert len(sticking_out(union, corners, *node, places)) == 0
    halved = union._replace(
        first=union.first._replace(rows=np.array([[-2.0, -2, -2, 0, 2, 2]])),
        second=union.second._replace(rows=np.array([[0.0, -2, -2, 2, 2, 2]])),
    )
    assert len(sticking_out(halved, corners, *node, places)) == 1
    # As triangles of their own, each of them lies in one.
    assert len(sticking_out(halved, corners, np.zeros(1, int), np.full(1, len(corners)))) == 0
