"""Results stay what they are, and the status says whether they still belong to the scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def built(bpy: Any) -> Any:
    """A cube with a structure over it; what the status says after the next update."""
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="cube")
    bpy.ops.accelscope.build()
    return bpy.context.object


@pytest.fixture
def status(bpy: Any, current: Any) -> Any:
    def ask() -> str:
        bpy.context.view_layer.update()
        return current.status(bpy.context).text

    return ask


def test_up_to_date_after_a_build(built: Any, status: Any) -> None:
    assert status() == "Up to date"


def test_nothing_built(bpy: Any, status: Any) -> None:
    assert status() == "Nothing has been built yet"


def test_moved(built: Any, status: Any) -> None:
    built.location.x = 1
    assert status() == "Out of date: Cube has moved"


def test_edited(built: Any, status: Any) -> None:
    built.data.vertices[0].co.x = 3
    built.data.update()
    assert status() == "Out of date: the geometry of Cube has changed"


def test_modifier_added(built: Any, status: Any) -> None:
    built.modifiers.new("Bevel", "BEVEL")
    assert status() == "Out of date: the geometry of Cube has changed"


def test_object_added(bpy: Any, built: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    assert status() == "Out of date: Plane was added"


def test_object_deleted(bpy: Any, built: Any, status: Any, current: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.accelscope.build()
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    assert status() == "Out of date: Cube was removed"
    assert current.cells is not None


def test_last_object_deleted(bpy: Any, built: Any, status: Any, current: Any) -> None:
    bpy.data.objects.remove(built)
    assert status() == "Out of date: Cube was removed"
    assert bpy.ops.accelscope.trace() == {"FINISHED"}


def test_hidden(built: Any, status: Any) -> None:
    built.hide_set(True)
    assert status() == "Out of date: Cube is hidden"


def test_deselected_in_the_selected_scope(bpy: Any, root: Any, status: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    root.scope = "selected"
    bpy.ops.accelscope.build()
    assert status() == "Up to date"
    bpy.context.object.select_set(False)
    assert status() == "Out of date: Cube is no longer selected"


def test_camera_does_not_matter(bpy: Any, built: Any, status: Any) -> None:
    bpy.ops.object.camera_add()
    bpy.context.object.location.x = 3
    assert status() == "Up to date"


def test_lights_matter_to_what_is_built_from_them(
    bpy: Any, root: Any, status: Any, current: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.core.contract.needs import GEOMETRY, LIGHTS
    from accelscope.core.structures.naive import Naive

    monkeypatch.setattr(Naive, "needs", frozenset({GEOMETRY, LIGHTS}))
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.object.light_add(type="POINT", location=(0.0, 0.0, 5.0))
    lamp = bpy.context.object
    root.structure, root.workload = "naive", "random_lines"
    bpy.ops.accelscope.build()
    assert status() == "Up to date"
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    lamp.location.x = 1.0
    bpy.context.view_layer.update()
    assert status() == "Out of date: the lights were changed"
    with pytest.raises(RuntimeError, match="the lights were changed, and Naive is built from that"):
        bpy.ops.accelscope.trace()
    lamp.location.x = 0.0
    bpy.context.view_layer.update()
    assert status() == "Up to date"


def test_renaming_does_not_matter(built: Any, status: Any) -> None:
    built.name = "Dice"
    assert status() == "Up to date"


def test_settings_changed_and_changed_back(built: Any, root: Any, status: Any) -> None:
    root.structures.bvh.bins = 32
    assert status() == "Out of date: the settings were changed"
    root.structures.bvh.bins = 16
    assert status() == "Up to date"
    root.structure = "grid"
    assert status() == "Out of date: BVH was built"
    root.structure = "bvh"
    root.scope = "selected"
    assert status() == "Out of date: the scope was changed"
    root.display.depth_max = 3
    root.scope = "visible"
    assert status() == "Up to date"


def test_another_scene(bpy: Any, built: Any, current: Any) -> None:
    other = bpy.data.scenes.new("Other")
    bpy.context.window.scene = other
    assert current.status(bpy.context).text == "Built over another scene of this file"


def test_undo_brings_it_up_to_date_again(bpy: Any, built: Any, status: Any, current: Any) -> None:
    result = current.built
    built.location.x = 1
    bpy.ops.ed.undo_push(message="moved")
    assert status() == "Out of date: Cube has moved"
    bpy.ops.ed.undo()
    assert status() == "Up to date"
    bpy.ops.ed.redo()
    assert status() == "Out of date: Cube has moved"
    assert current.built is result
    assert current.cells is not None


def test_undoing_the_objects_away(bpy: Any, status: Any, current: Any) -> None:
    bpy.ops.ed.undo_push(message="empty")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="cube")
    bpy.ops.accelscope.build()
    bpy.ops.ed.undo()
    assert not bpy.data.objects
    assert status() == "Out of date: Cube was removed"
    bpy.ops.accelscope.trace()
    assert current.traced is not None


def test_file_load_drops_the_results(
    bpy: Any, built: Any, status: Any, current: Any, tmp_path: Path
) -> None:
    path = str(tmp_path / "cube.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    assert status() == "Up to date"
    bpy.ops.wm.open_mainfile(filepath=path)
    assert status() == "Nothing has been built yet"
    assert current.built is current.cells is current.snapshot is None


def test_changes_while_building_are_noticed(
    bpy: Any, built: Any, status: Any, current: Any
) -> None:
    from accelscope.addon.results.outcome import Outcome
    from accelscope.core.evaluation.records.experiment import build

    taken = current.take(bpy.context, "visible", "keep")
    structure = current.built.structure
    built.location.x = 1
    bpy.context.view_layer.update()
    snapshot = taken.snapshot()
    result = build(snapshot.scene, type(structure), structure.settings)
    current.set_built(Outcome.of(snapshot, result))
    assert status() == "Out of date: Cube has moved"


def test_the_first_picture_shows_the_top_levels(bpy: Any, root: Any, current: Any) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    display, deepest = root.display, current.drawable.extent.deepest
    assert display.depth_max == 5 < deepest
    # Leaves lie deeper.
    display.leaves_only = True
    assert display.depth_max == deepest
    # Whoever has chosen a depth keeps it.
    display.leaves_only = False
    display.depth_max = 3
    display.leaves_only = True
    assert display.depth_max == 3
