"""Solids as triangles: on the surface, closed where the solid is, of nearly its volume."""

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
)
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.geometry.solids.tessellation import CIRCLE, tessellated

CORNERS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])


def pieces(*items):
    """Return the triangles of each item."""
    corners, owners = tessellated(mixed_of(items))
    assert (np.diff(owners) >= 0).all()
    return [corners[owners == number] for number in range(len(items))]


def volume(triangles):
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return (triangles[:, 0] * normals).sum() / 6.0


def area(triangles):
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    return np.linalg.norm(normals, axis=1).sum() / 2.0


def is_closed(triangles):
    ends = np.round(triangles, 9) + 0.0
    edges = {
        (tuple(a), tuple(b)) for t in ends for a, b in zip(t, np.roll(t, -1, axis=0), strict=True)
    }
    return len(edges) == 3 * len(triangles) and all(edge[::-1] in edges for edge in edges)


def test_items_of_all_kinds_come_in_their_order():
    items = [
        Triangle(CORNERS), Sphere((0, 0, 9), 2.0), MovingTriangle(CORNERS, CORNERS + 1.0),
        Polygon([*CORNERS, (-1.0, 0.0, 0.0)]), Disc((0, 0, 0), (0, 1, 1), 3.0),
        Box((0, 0, 0), (1, 2, 3)), Cone((0, 0, 0), (0, 0, 5), 2.0, 1.0),
        Cone((0, 0, 0), (0, 0, 5), 2.0, 1.0, is_capped=False),
    ]  # fmt: skip
    counts = [len(piece) for piece in pieces(*items)]
    assert counts == [1, 80, 1, 2, CIRCLE - 2, 12, 4 * CIRCLE - 4, 2 * CIRCLE]
    assert np.array_equal(pieces(*items)[2], CORNERS[None])


def test_a_sphere_is_closed_and_all_its_corners_are_on_it():
    centre = np.array([3.0, -2.0, 1.0])
    (ball,) = pieces(Sphere(centre, 0.5))
    assert np.linalg.norm(ball - centre, axis=2) == pytest.approx(0.5, rel=1e-12)
    assert is_closed(ball)
    assert 0.85 < volume(ball - centre) / (4.0 / 3.0 * np.pi * 0.125) < 1.0


@pytest.mark.parametrize(("base_radius", "apex_radius"), [(2.0, 2.0), (2.0, 0.7), (0.7, 2.0)])
def test_a_capped_cone_is_a_closed_frustum_of_a_pyramid(base_radius, apex_radius):
    base, apex = np.array([1.0, 2.0, 3.0]), np.array([4.0, -1.0, 3.5])
    (cone,) = pieces(Cone(base, apex, base_radius, apex_radius))
    assert is_closed(cone)
    height = np.linalg.norm(apex - base)
    share = CIRCLE / 2.0 * np.sin(2.0 * np.pi / CIRCLE)  # area of the polygon in the unit circle
    radii = base_radius**2 + base_radius * apex_radius + apex_radius**2
    assert volume(cone - base) == pytest.approx(share * height / 3.0 * radii)
    (side,) = pieces(Cone(base, apex, base_radius, apex_radius, is_capped=False))
    assert np.array_equal(side, cone[: 2 * CIRCLE])
    along = (side - base) @ (apex - base) / height
    away = np.linalg.norm(side - base - along[..., None] * (apex - base) / height, axis=2)
    assert away == pytest.approx(base_radius + (apex_radius - base_radius) * along / height)


def test_boxes_and_what_is_placed_have_their_volume():
    box, placed = pieces(
        Box((1, 1, 1), (2, 4, 6)),
        Placed(Box((0, 0, 0), (1, 1, 1)), [(2, 1, 0, 5), (0, 3, 0, 5), (0, 0, 4, 5)]),
    )
    assert is_closed(box)
    assert is_closed(placed)
    assert volume(box) == pytest.approx(15.0)
    assert volume(placed) == pytest.approx(24.0)


def test_a_concave_polygon_keeps_its_area():
    star = [
        ((2.0 - i % 2) * np.cos(np.pi * i / 5), (2.0 - i % 2) * np.sin(np.pi * i / 5), 1.0)
        for i in range(10)
    ]
    (piece,) = pieces(Polygon(star))
    assert len(piece) == 8
    assert area(piece) == pytest.approx(10 * 2.0 * np.sin(np.pi / 5) / 2.0)
