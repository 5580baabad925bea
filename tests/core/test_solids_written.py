"""Descriptions of items survive being written as text, to the last bit."""

import numpy as np
import pytest
from accelscope.core.geometry.solids.description import (
    Box,
    Cone,
    Disc,
    MovingTriangle,
    Placed,
    Polygon,
    Sphere,
    Triangle,
    moved_item,
)
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.geometry.solids.writing import from_json, to_json

RNG = np.random.default_rng(2)
CORNERS = RNG.normal(size=(3, 3))
ITEMS = [
    Sphere(RNG.normal(size=3), 1.0 / 3.0),
    Cone((0.1, 0.2, 0.3), RNG.normal(size=3), 0.7, 1e-300, False),
    Cone((0, 0, 0), (0, 0, 1), 1, 1),
    Box((-1, -2, -3), (1e9, 2, 3)),
    Disc((1, 2, 3), RNG.normal(size=3), 2),
    Polygon([(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0)]),
    Triangle(CORNERS),
    MovingTriangle(CORNERS, CORNERS + 1.0),
    Placed(Cone((0, 0, -1), (0, 0, 1), 1, 0.5), RNG.normal(size=(3, 4))),
]


def assert_same(one, other):
    for a, b in zip(mixed_of(one), mixed_of(other), strict=True):
        np.testing.assert_array_equal(a, b)


def test_what_is_read_is_what_was_written():
    again = from_json(to_json(ITEMS))
    assert [type(item) for item in again] == [type(item) for item in ITEMS]
    assert_same(again, ITEMS)
    assert to_json(again) == to_json(ITEMS)


def test_nothing_changes_where_nothing_moves():
    assert all(moved_item(item, np.eye(4)) is item for item in ITEMS)


@pytest.mark.parametrize("item", ITEMS, ids=lambda item: type(item).__name__)
def test_boxes_move_with_their_items(item):
    shift = np.eye(4)
    shift[:3, 3] = 1.0, -2.0, 0.5
    shift[:3, :3] *= 2.0
    size = 1e-14 * max(1.0, np.abs(mixed_of([item]).boxes).max())
    before, after = mixed_of([item]).boxes[0], mixed_of([moved_item(item, shift)]).boxes[0]
    np.testing.assert_allclose(
        after, 2.0 * before + np.tile(shift[:3, 3], 2), rtol=1e-14, atol=size
    )
