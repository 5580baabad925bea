"""Baked meshes hold exactly the cells that the display settings show, with their figures."""

from __future__ import annotations

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from accelscope.addon.drawing import selection  # noqa: E402
from accelscope.addon.drawing.drawable import make_drawable  # noqa: E402
from accelscope.addon.to_blender import bake  # noqa: E402
from accelscope.core.colours import INNER_COLOUR, depth_colours, ramp  # noqa: E402
from accelscope.core.contract.cells import NEVER, Cells, Polygons  # noqa: E402
from accelscope.core.errors import InputError  # noqa: E402
from accelscope.core.geometry.box_shape import SIDES, corners_of  # noqa: E402

pytestmark = pytest.mark.bpy


def display(**changed):
    settings = {
        "depth_min": 0, "depth_max": 100, "leaves_only": False, "hide_empty": False,
        "opacity": 0.5, "colour_by": "depth",
    }  # fmt: skip
    return SimpleNamespace(**(settings | changed))


@pytest.fixture(autouse=True)
def _empty_file():
    bpy.ops.wm.read_homefile(use_empty=True)


@pytest.fixture
def cells():
    rng = np.random.default_rng(5)
    n = 60
    # Eighths, so that single precision holds them exactly.
    lower = rng.integers(-40, 40, (n, 3)) / 8
    boxes = np.concatenate([lower, lower + rng.integers(1, 30, (n, 3)) / 8], axis=1)
    is_leaf = rng.random(n) < 0.6
    count = np.where(is_leaf, rng.integers(0, 4, n), 0)
    return Cells.sorted_by_depth(boxes, rng.integers(0, 6, n), is_leaf, count)


def baked(context, cells, display, name):
    """Return the object, made without a pause."""
    edges = bake.edges_of(make_drawable(cells), selection.Shown.by(display))
    making = bake.making(context.scene, edges, name)
    for _ in range(bake.steps_of(edges)):
        next(making)
    with pytest.raises(StopIteration) as stop:
        next(making)
    return stop.value.value


def read(collection, key, width=1, dtype=float):
    values = np.zeros(len(collection) * width, dtype)
    collection.foreach_get(key, values)
    return values.reshape(-1, width) if width > 1 else values


@pytest.mark.parametrize(
    "changed",
    [
        {},
        {"depth_min": 2, "depth_max": 3},
        {"leaves_only": True},
        {"hide_empty": True},
        {"leaves_only": True, "hide_empty": True, "depth_min": 1},
    ],
)
def test_geometry_and_attributes(cells, changed):
    made = baked(bpy.context, cells, display(**changed), "bvh")
    shown = selection.visible(cells, display(**changed))
    count = int(shown.sum())
    mesh = made.data
    assert (len(mesh.vertices), len(mesh.edges), len(mesh.polygons)) == (8 * count, 12 * count, 0)

    points = read(mesh.vertices, "co", 3).reshape(count, 8, 3)
    np.testing.assert_array_equal(points.min(axis=1), cells.boxes[shown, :3])
    np.testing.assert_array_equal(points.max(axis=1), cells.boxes[shown, 3:])
    assert all(len(np.unique(corners, axis=0)) == 8 for corners in points)

    # Every edge runs along one axis, and each box has four along each axis.
    edges = read(mesh.edges, "vertices", 2, np.int32)
    assert (edges // 8 == np.repeat(np.arange(count), 12)[:, None]).all()
    assert len(np.unique(edges, axis=0)) == 12 * count
    along = np.subtract(*points.reshape(-1, 3)[edges].swapaxes(0, 1)) != 0.0
    np.testing.assert_array_equal(along.reshape(count, 12, 3).sum(axis=1), np.full((count, 3), 4))
    assert (along.sum(axis=1) == 1).all()

    for name, values in (
        ("number", cells.numbers), ("depth", cells.depth),
        ("count", cells.count), ("is_leaf", cells.is_leaf),
    ):  # fmt: skip
        attribute = mesh.attributes[name]
        assert attribute.domain == "POINT"
        seen = read(attribute.data, "value", dtype=values.dtype)
        np.testing.assert_array_equal(seen, np.repeat(values[shown], 8), err_msg=name)
    assert not mesh.validate()


def test_colours_are_those_of_the_overlay(cells):
    made = baked(bpy.context, cells, display(), "bvh")
    colours = read(made.data.attributes["colour"].data, "color_srgb", 4)[::8]
    np.testing.assert_allclose(colours[:, :3], depth_colours(cells.depth, 5), atol=2e-3)
    empty = cells.is_leaf & (cells.count == 0)
    np.testing.assert_allclose(colours[:, 3], np.where(empty, 0.15, 0.5), atol=1e-6)
    assert made.data.attributes.active_color_name == "colour"

    made = baked(bpy.context, cells, display(colour_by="count"), "bvh")
    colours = read(made.data.attributes["colour"].data, "color_srgb", 4)[::8]
    inner = colours[~cells.is_leaf]
    np.testing.assert_allclose(inner, [[*INNER_COLOUR, 0.15]] * len(inner), atol=2e-3)


def test_collection_is_made_once_per_scene(cells):
    first = baked(bpy.context, cells, display(), "bvh")
    second = baked(bpy.context, cells, display(), "bvh")
    assert (first.name, second.name) == ("bvh", "bvh.001")
    collection = bpy.data.collections["AccelScope"]
    assert set(collection.objects) == {first, second}
    assert collection.name in bpy.context.scene.collection.children

    other = bpy.data.scenes.new("Other")
    context = SimpleNamespace(scene=other)
    third = baked(context, cells, display(), "bvh")
    fourth = baked(context, cells, display(), "bvh")
    assert set(other.collection.all_objects) == {third, fourth}
    assert set(collection.objects) == {first, second}
    assert len(bpy.data.collections) == 2


def test_collection_that_was_moved_is_found(cells):
    first = baked(bpy.context, cells, display(), "bvh")
    collection = first.users_collection[0]
    inner = bpy.data.collections.new("Mine")
    bpy.context.scene.collection.children.link(inner)
    bpy.context.scene.collection.children.unlink(collection)
    inner.children.link(collection)
    second = baked(bpy.context, cells, display(), "bvh")
    assert second.users_collection[0] == collection


def test_nothing_to_bake_is_said_and_leaves_nothing(cells):
    with pytest.raises(InputError, match="show no cell"):
        baked(bpy.context, cells, display(depth_min=50), "bvh")
    assert not bpy.data.meshes
    assert not bpy.data.objects
    assert not bpy.data.collections


def test_more_than_memory_holds_is_refused(cells, monkeypatch):
    monkeypatch.setattr("accelscope.core.memory.available_bytes", lambda: 1000)
    with pytest.raises(InputError, match="narrow the depth range"):
        baked(bpy.context, cells, display(), "bvh")
    assert not bpy.data.meshes


def test_a_hundred_thousand_boxes():
    n = 100_000
    lower = np.random.default_rng(6).integers(0, 1000, (n, 3)).astype(float)
    boxes = np.concatenate([lower, lower + 1.0], axis=1)
    cells = Cells.sorted_by_depth(
        boxes, np.arange(n) // 1000, np.ones(n, dtype=bool), np.ones(n, dtype=np.int32)
    )
    made = baked(bpy.context, cells, display(), "grid")
    points = read(made.data.vertices, "co", 3).reshape(n, 8, 3)
    np.testing.assert_array_equal(points.min(axis=1), lower)
    np.testing.assert_array_equal(points.max(axis=1), lower + 1.0)


def test_baked_cells_are_no_triangles_to_build_on(cells):
    made = baked(bpy.context, cells, display(), "bvh")
    made.data.calc_loop_triangles()
    assert len(made.data.loop_triangles) == 0


def test_polyhedra_are_baked_as_such():
    """A wedge: half of a cube, cut along a diagonal plane."""
    floor = [(0, 0, 0), (1, 0, 0), (1, 1, 0)]
    roof = [(0, 0, 1), (1, 0, 1), (1, 1, 1)]
    lists = [floor, roof, *([floor[i - 1], floor[i], roof[i], roof[i - 1]] for i in range(3))]
    offsets = np.concatenate([[0], np.cumsum([len(points) for points in lists])])
    faces = Polygons(np.concatenate(lists).astype(float), offsets, np.ones(5, dtype=np.int64))
    box = corners_of(np.array([(2.0, 0, 0, 3, 1, 1)]))[0][SIDES]
    faces = Polygons(
        np.concatenate([box.reshape(-1, 3), faces.points]),
        np.concatenate([4 * np.arange(6), 24 + faces.offsets]),
        np.concatenate([np.zeros(6, dtype=np.int64), faces.owners]),
    )
    boxes = np.array([(2.0, 0, 0, 3, 1, 1), (0, 0, 0, 1, 1, 1)])
    two = np.array([4, 7], dtype=np.int32)
    cells = Cells.sorted_by_depth(boxes, two, two > 0, two, faces=faces)
    mesh = baked(bpy.context, cells, display(), "bsp").data
    assert (len(mesh.vertices), len(mesh.edges), len(mesh.polygons)) == (8 + 6, 12 + 9, 0)
    count = read(mesh.attributes["count"].data, "value", dtype=np.int32)
    assert count.tolist() == [4] * 8 + [7] * 6
    edges = read(mesh.edges, "vertices", 2, np.int32)
    points = read(mesh.vertices, "co", 3)
    lengths = np.linalg.norm(np.subtract(*points[edges].swapaxes(0, 1)), axis=1)
    np.testing.assert_allclose(np.sort(lengths[12:]), [1] * 7 + [np.sqrt(2)] * 2, rtol=1e-6)
    assert not mesh.validate()


def test_colours_by_step_are_baked(cells):
    order = np.arange(len(cells), dtype=np.int32)
    cells = dataclasses.replace(cells, extra={"order": order}, replaced=np.full(len(cells), NEVER))
    made = baked(bpy.context, cells, display(colour_by="order"), "bvh")
    colours = read(made.data.attributes["colour"].data, "color_srgb", 4)[::8]
    np.testing.assert_allclose(colours[:, :3], ramp(order / order.max()), atol=2e-3)
