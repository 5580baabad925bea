"""Structures built from lamps and a camera: refused without, drawn there, stale once moved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("bpy")

LAMP = 1.0, -1.0, 4.0


@pytest.fixture
def root(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.scene.accelscope


@pytest.fixture
def lamp(bpy: Any, root: Any) -> Any:
    bpy.ops.object.light_add(type="POINT", location=LAMP)
    return bpy.context.object


@pytest.fixture
def camera(bpy: Any, root: Any) -> Any:
    bpy.ops.object.camera_add(location=(0.0, -7.0, 0.5), rotation=(1.5, 0.0, 0.0))
    bpy.context.scene.camera = bpy.context.object
    return bpy.context.object


def build(bpy: Any, root: Any, name: str) -> None:
    root.structure = name
    assert bpy.ops.accelscope.build() == {"FINISHED"}


def test_without_a_lamp_one_line_says_what_to_do(bpy: Any, root: Any, current: Any) -> None:
    build(bpy, root, "bvh")
    before = current.built
    root.structure = "light_buffer"
    with pytest.raises(
        RuntimeError, match="has no light, and a light buffer stands in lights; add"
    ):
        bpy.ops.accelscope.build()
    assert current.built is before


def test_without_a_camera_the_picture_is_of_one_that_frames(bpy: Any, root: Any) -> None:
    from accelscope.addon.results import session

    build(bpy, root, "image_directory")
    root.workload = "camera"
    root.workloads.camera.width = root.workloads.camera.height = 16
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    assert not session.current.traced.counters["strangers"].any()


def test_cells_are_squares_around_the_lamp(bpy: Any, root: Any, lamp: Any, current: Any) -> None:
    from accelscope.addon.drawing import overlay, selection
    from accelscope.core.contract.outlines import wires_of

    build(bpy, root, "light_buffer")
    structure, cells = current.built.structure, current.drawable.cells
    away = cells.boxes.reshape(-1, 2, 3) - np.array(LAMP)
    half = structure.drawn_size
    # Every cell lies in a face of the cube, and none beyond its edges.
    np.testing.assert_allclose(np.abs(away).max(axis=(1, 2)), half, rtol=1e-6)
    flat = (np.ptp(away, axis=1) < 1e-9 * half).sum(axis=1)
    assert (flat == 1).all()
    assert cells.depth.max() > 2
    leaves = np.flatnonzero(cells.is_leaf)
    wires = wires_of(cells, leaves)
    assert (np.bincount(wires.edge_owners(), minlength=len(cells))[leaves] == 4).all()
    display = root.display
    display.depth_min, display.depth_max = 2, 3
    shown = selection.visible(cells, display)
    assert 0 < shown.sum() < len(cells)
    assert set(cells.depth[shown].tolist()) == {2, 3}
    assert overlay.shown_text(display).startswith(f"showing {shown.sum()} of ")


def test_the_record_names_who_answered(
    bpy: Any, root: Any, lamp: Any, camera: Any, current: Any
) -> None:
    routed = root.structures.routed
    routed.primary, routed.shadow = "image_directory", "light_buffer"
    build(bpy, root, "routed")
    root.workload = "camera"
    rays = root.workloads.camera
    rays.width, rays.height, rays.shadows = 40, 30, True
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    routes = current.record["trace"]["routes"]
    assert routes["primary"]["structure"] == "image_directory"
    assert routes["shadow"]["structure"] == "light_buffer"
    classes = current.record["rays"]["classes"]
    assert classes["primary"] == 1200
    assert classes["shadow"] > 50
    share = routes["shadow"]["share"]
    assert share == pytest.approx(classes["shadow"] / current.record["rays"]["count"])
    assert not current.traced.counters["strangers"].any()


def moved_and_back(bpy: Any, current: Any, thing: Any, what: str) -> None:
    """Move it, which is news to the session once, and back."""
    context = bpy.context

    def status() -> str:
        return current.status(context, at_once=False).text

    assert current.status(context).text == "Up to date"
    assert not current.look_at_view(context)
    thing.location.x += 1.0
    context.view_layer.update()
    assert current.look_at_view(context)
    assert status() == f"Out of date: {what}"
    assert current.is_stale(context)
    assert not current.look_at_view(context)
    thing.location.x -= 1.0
    context.view_layer.update()
    assert current.look_at_view(context)
    assert status() == "Up to date"
    assert not current.is_stale(context)
    thing.name = "Renamed"
    assert not current.look_at_view(context)


def test_a_moved_lamp_is_seen(bpy: Any, root: Any, lamp: Any, current: Any) -> None:
    build(bpy, root, "light_buffer")
    moved_and_back(bpy, current, lamp, "the lights were changed")


def test_a_moved_camera_is_seen(bpy: Any, root: Any, camera: Any, current: Any) -> None:
    build(bpy, root, "image_directory")
    moved_and_back(bpy, current, camera, "the camera was moved")


def test_another_lamp_is_seen(bpy: Any, root: Any, lamp: Any, current: Any) -> None:
    routed = root.structures.routed
    routed.shadow = "light_buffer"
    build(bpy, root, "routed")
    assert not current.look_at_view(bpy.context)
    bpy.ops.object.light_add(type="SUN")
    assert current.look_at_view(bpy.context)
    assert current.other_view == "the lights were changed"
    bpy.ops.object.delete()
    assert current.look_at_view(bpy.context)
    assert current.other_view == ""


def test_others_do_not_look(bpy: Any, root: Any, lamp: Any, current: Any) -> None:
    build(bpy, root, "bvh")
    assert not current.needs_view
    lamp.location.x += 1.0
    bpy.context.view_layer.update()
    assert not current.look_at_view(bpy.context)
