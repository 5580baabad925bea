"""Windows show scenes and view layers of their own: each is told what is true of what it shows."""

from __future__ import annotations

import time
from types import SimpleNamespace
from typing import Any

import pytest


@pytest.fixture
def cube(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_cube_add()
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    return bpy.context.object


@pytest.fixture
def told(bpy: Any) -> Any:
    """What a panel says, which compares nothing by itself."""
    from accelscope.addon.results import session

    return lambda: session.current.status(bpy.context, at_once=False).text


@pytest.fixture
def compare(monkeypatch: pytest.MonkeyPatch, bpy: Any) -> Any:
    """Run the timer until it has come to its end."""
    from accelscope.addon.from_blender import watching

    monkeypatch.setattr(watching, "is_playing", lambda: False)

    def run() -> None:
        monkeypatch.setattr(watching, "_last_update", 0.0)
        end = time.monotonic() + 60.0
        while watching._compare() is not None:
            assert time.monotonic() < end

    return run


def other_layer(bpy: Any) -> Any:
    layer = bpy.context.scene.view_layers.new("Other")
    layer.layer_collection.exclude = False
    return layer


def test_no_moment_of_another_layer_with_the_verdict_of_the_first(
    bpy: Any, cube: Any, current: Any
) -> None:
    layer, look = other_layer(bpy), current.snapshot.look
    cube.hide_set(True, view_layer=layer)
    bpy.context.window.view_layer = layer
    cube.data.vertices[0].co.x = 3.0
    cube.data.update()
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=300, y_subdivisions=300)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    steps = 0
    while not look.compare(depsgraph, until=0.0):
        steps += 1
        assert not look.is_settled_for(layer)
    assert steps > 0
    assert look.is_settled_for(layer)


def test_hashes_of_one_layer_are_none_of_another(
    bpy: Any, cube: Any, current: Any, told: Any
) -> None:
    """A modifier follows an object that only one of the layers shows."""
    layer = other_layer(bpy)
    cube.modifiers.new("Bevel", "BEVEL")
    bpy.ops.accelscope.build()
    look = current.snapshot.look
    bpy.context.window.view_layer = layer
    assert not look.is_settled_for(layer)
    assert look.is_settled_for(bpy.context.scene.view_layers[0])
    assert set(look.layers) == {bpy.context.scene.view_layers[0].name}
    assert look.compare(bpy.context.evaluated_depsgraph_get())
    assert told() == "Up to date"
    # Both are known now, and an edit makes both uncertain.
    assert all(each.is_settled for each in look.layers.values())
    cube.location.x = 1.0
    bpy.context.view_layer.update()
    assert not any(each.is_settled for each in look.layers.values())


def test_going_back_and_forth_compares_nothing_anew(bpy: Any, cube: Any, current: Any) -> None:
    """Two windows with two layers would otherwise keep each other busy for ever."""
    layer, look = other_layer(bpy), current.snapshot.look
    cube.hide_set(True, view_layer=layer)
    windows = [
        SimpleNamespace(scene=bpy.context.scene, view_layer=each)
        for each in (bpy.context.scene.view_layers[0], layer)
    ]
    for window in windows:
        with bpy.context.temp_override(view_layer=window.view_layer):
            look.compare(bpy.context.evaluated_depsgraph_get())
    assert all(look.is_settled_for(window.view_layer) for window in windows)
    assert [look.change_in(window.view_layer) for window in windows] == ["", "Cube is hidden"]


def test_the_scene_of_the_window_is_compared(bpy: Any, cube: Any, told: Any, compare: Any) -> None:
    """In a timer, the current scene may be that of another window."""
    cube.location.x = 1.0
    bpy.context.view_layer.update()
    assert told() == "Comparing with the scene..."
    other = bpy.data.scenes.new("Elsewhere")
    with bpy.context.temp_override(scene=other, view_layer=other.view_layers[0]):
        assert bpy.context.scene == other
        compare()
    assert told() == "Out of date: Cube has moved"


def test_an_edit_just_after_the_scene_was_taken(bpy: Any, cube: Any, current: Any) -> None:
    """By work that takes frames later, too: it is watched from the first moment on."""
    from accelscope.addon.from_blender.watching import watched
    from accelscope.operators.build import ACCELSCOPE_OT_build
    from accelscope.operators.compare_over_timeline import ACCELSCOPE_OT_compare_over_timeline

    for operator in (ACCELSCOPE_OT_build, ACCELSCOPE_OT_compare_over_timeline):
        before = watched[0]
        operator.prepare(SimpleNamespace(), bpy.context)
        assert len(watched) >= 2
        (look,) = [each for each in watched if each is not before]
        assert look.is_settled
        cube.location.y += 1.0
        bpy.context.view_layer.update()
        assert not look.is_settled
        current.watch()


def test_what_is_said_is_said_anew_though_another_layer_is_shown_no_more(
    bpy: Any, cube: Any, current: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nobody compares such a layer: it stays uncertain for good, beside news of the others."""
    from accelscope.addon import jobs
    from accelscope.addon.from_blender import watching

    layer, look = other_layer(bpy), current.snapshot.look
    with bpy.context.temp_override(view_layer=layer):
        look.compare(bpy.context.evaluated_depsgraph_get())
    look.layers[layer.name].is_settled = False
    redrawn: list[int] = []
    app = SimpleNamespace(
        background=False, timers=SimpleNamespace(is_registered=lambda timer: True)
    )
    monkeypatch.setattr(watching, "bpy", SimpleNamespace(app=app))
    monkeypatch.setattr(jobs, "redraw_sidebars", lambda: redrawn.append(1))
    for x in (1.0, 2.0):
        cube.location.x = x
        bpy.context.view_layer.update()
        # The second edit finds nothing that was known.
        assert redrawn == [1]
