"""Pages of pictures work over solids, polygons and instances: shaded, with the items of a walk."""

import numpy as np
import pytest
from accelscope.core.geometry.geometry import lines_of
from accelscope.core.geometry.instances import instanced, lines_of_items
from accelscope.core.geometry.rays import Rays
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
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.lessons.ray_path import Walk, segments_of
from accelscope.core.lessons.walk_in_words import event_text, legend
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH

CORNERS = np.array([(0.0, 0, 0), (1, 0, 0), (0, 1, 0)])
SHEARED = np.array([[2.0, 0.5, 0, 1], [0, 1, 0, 2], [0, 0, 0.5, 3]])
ITEMS = [
    Sphere((1, 2, 3), 2),
    Cone((0, 0, -1), (0, 0, 1), 2, 0.5),
    Placed(Box((-1, -1, -1), (1, 1, 1)), SHEARED),
    Disc((0, 0, 4), (0, 0, 1), 3),
    Polygon([(0, 0, 0), (4, 0, 0), (4, 4, 0), (1, 1, 0), (0, 4, 0)]),
    Polygon([(0, 0, 0), (1, 0, 0), (2, 0, 0)]),
    Triangle(CORNERS),
    MovingTriangle(CORNERS, CORNERS + 2.0),
]


def lines(number, time=0.0):
    """The ends of the lines that show an item, in its own scene."""
    segments, owners = lines_of(mixed_of(ITEMS), np.array([number]), time)
    assert (owners == 0).all()
    return segments


def test_lines_lie_on_the_surface_and_reach_as_far_as_it_does():
    boxes = mixed_of(ITEMS).boxes
    for number in (0, 1, 2, 3, 4, 6):
        points = lines(number).reshape(-1, 3)
        np.testing.assert_allclose(points.min(axis=0), boxes[number, :3], atol=1e-12)
        np.testing.assert_allclose(points.max(axis=0), boxes[number, 3:], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(lines(0) - [1, 2, 3], axis=2), 2.0)
    rho = np.hypot(lines(1)[..., 0], lines(1)[..., 1])
    np.testing.assert_allclose(rho, 1.25 - 0.75 * lines(1)[..., 2])
    np.testing.assert_allclose(np.hypot(*lines(3)[..., :2].T), 3.0)
    np.testing.assert_array_equal(lines(4)[:, 0], np.array(ITEMS[4].corners))
    np.testing.assert_array_equal(lines(4)[:, 1], np.roll(ITEMS[4].corners, -1, axis=0))
    assert len(lines(5)) == 0  # without area it has no corners
    np.testing.assert_array_equal(lines(7, 0.25)[:, 0], CORNERS + 0.5)


def test_lines_come_in_the_order_they_are_asked_for_in():
    wanted = np.array([7, 0, 4, 0, 6])
    segments, owners = lines_of(mixed_of(ITEMS), wanted, 0.5)
    assert (np.diff(owners) >= 0).all()
    for place, number in enumerate(wanted):
        np.testing.assert_array_equal(segments[owners == place], lines(number, 0.5))


def test_lines_of_instances_are_those_of_their_meshes_moved():
    meshes = [all_triangles(CORNERS[None] + k) for k in range(2)]
    places = instanced(meshes, np.array([1, 0]), np.array([SHEARED, np.eye(3, 4)]))
    segments, owners = lines_of(places, np.array([1, 0]))
    np.testing.assert_array_equal(owners, [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(segments[:3, 0], CORNERS)
    np.testing.assert_allclose(segments[3:, 0], (CORNERS + 1) @ SHEARED[:, :3].T + SHEARED[:, 3])
    assert lines_of_items(places, np.array([0])).shape == (12, 2, 3)


def test_a_walk_through_solids_is_told_and_drawn():
    scene = Scene.from_items([Sphere((k, 0, 0), 0.25) for k in range(9)], "row")
    structure = BVH.build(scene, BVH.Settings(max_leaf_size=1))
    rays = Rays.from_arrays(np.array([[-3.0, 0.1, 0.1]]), np.array([[1.0, 0, 0]]))
    hits, _ = structure.trace(rays)
    steps = structure.record(rays, 0)
    walk = Walk(structure, structure.cells(), rays, 0, float(hits.t[0]), steps)
    segments, colours = segments_of(walk)
    assert len(segments) == len(colours) > 72  # a ball is three circles
    assert any("tested" in text and "item" in text for _, text in legend(walk))
    texts = [event_text(steps, event, scene.primitive_name) for event in range(len(steps))]
    assert any(text.startswith("test item 0") for text in texts)
    assert not any("triangle" in text for text in texts)


@pytest.mark.parametrize("sample", ["jacks:size=1", "gears:size=1"])
def test_a_page_over_solids_is_made(evaluate, tmp_path, sample):
    folder = tmp_path / "page"
    evaluate(
        f"sample:{sample}", "--structure", "bvh:builder=sweep_sah", "--structure", "octree",
        "--rays", "random_lines:count=10", "--pictures", str(folder),
    )  # fmt: skip
    page = (folder / "index.html").read_text(encoding="utf-8")
    assert page.count("<img") > 20
    assert 'class="failed"' not in page
    assert "leaves with items" in page
