"""The operators, as a script or a headless Blender calls them."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from accelscope.core.contract.within import cells_with_instances
from accelscope.core.geometry.csg.trees import Csg
from accelscope.core.geometry.instances import Instanced
from accelscope.core.geometry.solids.mixed import Mixed
from accelscope.core.structures import general_structures, structures
from accelscope.sample_scenes import samples


@pytest.fixture
def monkey(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


@pytest.fixture
def traced(bpy: Any, monkey: Any, root: Any) -> Any:
    root.workload = "random_lines"
    root.workloads.random_lines.count = 500
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    return monkey


@pytest.mark.parametrize("name", general_structures())
def test_build_makes_what_the_settings_say(
    bpy: Any, monkey: Any, root: Any, current: Any, name: str
) -> None:
    root.structure = name
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert current.built.structure.name == name
    assert current.built.structure.settings == structures()[name].Settings()
    assert current.record["scene"]["triangles"] == 968
    assert current.built.structure.validate() == []
    assert len(current.cells) == len(cells_with_instances(current.built.structure))
    assert current.traced is None


def test_build_uses_settings_and_scope(bpy: Any, monkey: Any, root: Any, current: Any) -> None:
    bpy.ops.mesh.primitive_cube_add()
    root.scope = "selected"
    root.structures.bvh.max_leaf_size = 1
    bpy.ops.accelscope.build()
    assert current.record["scene"]["triangles"] == 12
    assert current.record["structure"]["settings"]["max_leaf_size"] == 1


def test_trace_counts_what_embree_would_hit(bpy: Any, traced: Any, current: Any) -> None:
    assert current.record["rays"]["count"] == 500
    assert current.record["trace"]["hits"] == int((current.traced.hits.primitive >= 0).sum())
    assert current.record["trace"]["hits"] > 0


def lesson() -> Any:
    """Return what is shown of a lesson."""
    from accelscope.addon.results import lesson_view

    return lesson_view.current


def test_cells_that_rays_make_are_shown(bpy: Any, monkey: Any, root: Any, current: Any) -> None:
    root.structure, root.workload = "grid", "random_lines"
    root.structures.grid.lazy = True
    root.workloads.random_lines.count = 5
    bpy.ops.accelscope.build()
    assert not current.cells.extra["is_made"].any()
    bpy.ops.accelscope.trace()
    made = current.record["trace"]["lazy"]["cells"]
    assert current.cells.extra["is_made"].sum() == made > 0
    assert current.record["statistics"]["cells_made"] == made
    root.lessons.ray.ray = 2
    bpy.ops.accelscope.step_ray()
    tally = lesson().play.walk.steps.tally()
    assert tally == {name: current.traced.counters[name][2] for name in tally}
    assert current.built.structure.made().cells == made
    root.lessons.ray.cone = 17.0
    assert current.built.structure.made().cells > made
    assert current.cells.extra["is_made"].sum() == current.built.structure.made().cells


def test_the_picture_of_whitted_is_kept_on_demand(
    bpy: Any, traced: Any, root: Any, current: Any
) -> None:
    assert not bpy.ops.accelscope.keep_picture.poll()
    root.workload = "whitted"
    own = root.workloads.whitted
    own.width, own.height, own.samples, own.adaptive = 24, 16, 2, True
    bpy.ops.accelscope.trace()
    assert current.record["outcome"]["samples"] == current.traced.outcome.samples.sum()
    bpy.ops.accelscope.keep_picture()
    images = {image.name: image for image in bpy.data.images}
    assert set(images) == {"picture", "samples"}
    assert tuple(images["picture"].size) == (24, 16)
    texels = np.empty(24 * 16 * 4, dtype=np.float32)
    images["picture"].pixels.foreach_get(texels)
    shown = texels.reshape(16, 24, 4)[::-1, :, :3]
    right = np.minimum(current.traced.outcome.picture, 1.0)
    np.testing.assert_allclose(shown, right, atol=0.5 / 255 + 1e-6)


def test_trace_uses_the_camera_where_it_is_now(
    bpy: Any, monkey: Any, root: Any, current: Any
) -> None:
    bpy.ops.object.camera_add(location=(0, -10, 0), rotation=(np.pi / 2, 0, 0))
    camera = bpy.context.scene.camera = bpy.context.object
    root.workloads.camera.width = root.workloads.camera.height = 8
    bpy.ops.accelscope.build()
    camera.location = (0, 10, 0)
    camera.rotation_euler = (np.pi / 2, 0, np.pi)
    bpy.ops.accelscope.trace()
    np.testing.assert_allclose(current.traced.rays.origins[0], (0, 10, 0))
    assert current.record["trace"]["hits"] > 0
    assert current.status(bpy.context).up_to_date


def test_step_ray_records_what_the_batch_counted(
    bpy: Any, traced: Any, root: Any, current: Any
) -> None:
    for index in np.flatnonzero(current.traced.hits.primitive >= 0)[:3]:
        root.lessons.ray.ray = index
        assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
        assert lesson().subject.structures[0] is current.built.structure
        tally = lesson().play.walk.steps.tally()
        assert tally == {name: int(current.traced.counters[name][index]) for name in tally}


def test_the_number_of_the_ray_ends_with_the_rays(bpy: Any, traced: Any, root: Any) -> None:
    bpy.ops.accelscope.step_ray()
    root.lessons.ray.ray = 500
    assert root.lessons.ray.ray == 499


def test_what_was_built_is_stepped_through_though_it_is_out_of_date(
    bpy: Any, traced: Any, root: Any, current: Any
) -> None:
    traced.location.x = 5.0
    bpy.context.view_layer.update()
    assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
    assert lesson().subject.structures[0] is current.built.structure
    current.lesson_look.compare(bpy.context.evaluated_depsgraph_get())
    assert "has moved" in current.lesson_change(bpy.context)


def test_path_ends_at_the_hit_and_shows_the_nodes(bpy: Any, traced: Any, current: Any) -> None:
    from accelscope.core.lessons.ray_path import Walk, segments_of

    structure, rays = current.built.structure, current.traced.rays
    for index in range(0, 500, 50):
        t = current.traced.hits.t[index]
        steps = structure.record(rays, index)
        walk = Walk(structure, current.cells, rays, index, t, steps)
        segments, colours = segments_of(walk)
        assert segments.shape == (len(colours), 2, 3)
        assert np.isfinite(segments).all()
        tally = steps.tally()
        is_hit = bool(np.isfinite(t))
        # A BVH enters no node twice: one ray, 12 edges a node, 3 a triangle, the hit once more
        # with its star.
        assert len(segments) == 1 + 12 * tally["N_TS"] + 3 * tally["N_IT"] + 6 * is_hit
        np.testing.assert_array_equal(segments[0, 0], rays.origins[index])
        if is_hit:
            np.testing.assert_allclose(
                segments[0, 1], rays.origins[index] + t * rays.directions[index]
            )


@pytest.mark.parametrize("name", samples())
def test_add_sample_scene_adds_the_scene_of_the_core(bpy: Any, name: str) -> None:
    from accelscope.addon.from_blender import extraction

    assert bpy.ops.accelscope.add_sample_scene(sample=name) == {"FINISHED"}
    sample = samples()[name]
    expected = sample.generate(sample.Settings())
    scene = extraction.extract(bpy.context, extraction.VISIBLE)
    assert len(scene) == len(expected)
    assert type(scene.geometry) is type(expected.geometry)
    for number, object_name in enumerate(scene.object_names):
        here = np.flatnonzero(scene.object_ids == number)
        there = np.flatnonzero(expected.object_ids == expected.object_names.index(object_name))
        if isinstance(expected.geometry, Instanced):
            # One mesh in many places, each object linked to it.
            (here,), (there,) = here, there
            found, wanted = scene.geometry, expected.geometry
            np.testing.assert_allclose(
                found.matrices[here], wanted.matrices[there], atol=1e-6 * expected.diagonal
            )
            np.testing.assert_array_equal(
                found.meshes[found.which[here]].corners,
                wanted.meshes[wanted.which[there]].corners.astype(np.float32),
            )
            continue
        if isinstance(expected.geometry, Csg):
            np.testing.assert_allclose(
                scene.geometry.boxes[here], expected.geometry.boxes[there],
                atol=1e-6 * expected.diagonal,
            )  # fmt: skip
            continue
        found, wanted = scene.items(here), expected.items(there)
        if isinstance(expected.geometry, Mixed):
            # Not as they are drawn, but to the last bit as they are.
            for field in ("kinds", "rows", "size", "boxes"):
                np.testing.assert_array_equal(getattr(found, field), getattr(wanted, field))
        else:
            np.testing.assert_array_equal(found.corners, wanted.corners.astype(np.float32))
    assert len(scene.lights) == len(expected.lights)
    for light, original in zip(scene.lights, expected.lights, strict=True):
        assert light.kind == original.kind == "point"
        np.testing.assert_allclose(light.position, original.position, rtol=1e-6)
    if expected.camera:
        forward = expected.camera.target - expected.camera.position
        np.testing.assert_allclose(scene.camera.position, expected.camera.position, rtol=1e-5)
        np.testing.assert_allclose(
            scene.camera.target - scene.camera.position,
            forward / np.linalg.norm(forward),
            atol=1e-5,
        )
        np.testing.assert_allclose(scene.camera.fov, expected.camera.fov, rtol=1e-5)


def test_add_sample_scene_takes_settings_and_is_undone(bpy: Any) -> None:
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.accelscope.add_sample_scene(sample="tetra", tetra_size=3)
    assert len(bpy.data.objects["tetra"].data.polygons) == 64
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert "tetra" not in bpy.data.objects


def test_export_writes_the_record(bpy: Any, traced: Any, current: Any, tmp_path: Path) -> None:
    bpy.ops.accelscope.export(filepath=str(tmp_path / "a.json"), format="JSON")
    written = json.loads((tmp_path / "a.json").read_text())
    assert written == {"schema": "accelscope/2", "records": [current.record]}
    bpy.ops.accelscope.export(filepath=str(tmp_path / "b"), format="CSV")
    with (tmp_path / "b.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert float(row["trace.N_IT"]) == current.record["trace"]["N_IT"]


def test_export_says_when_there_is_no_name(bpy: Any, traced: Any) -> None:
    for place in ("", "/"):
        with pytest.raises(RuntimeError, match="Name the file to write"):
            bpy.ops.accelscope.export(filepath=place, format="JSON")


def test_export_says_when_it_cannot_write(bpy: Any, traced: Any, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RuntimeError, match="cannot write"):
        bpy.ops.accelscope.export(filepath=str(tmp_path / "file" / "a.json"), format="JSON")


def test_export_on_a_full_disk_leaves_the_old_file(
    bpy: Any, traced: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.json"
    path.write_text("old")

    def no_space(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", no_space)
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.accelscope.export(filepath=str(path), format="JSON")
    assert str(raised.value) == (
        f"Error: cannot write {path}: No space left on device; choose another place\n"
    )
    assert [each.read_text() for each in tmp_path.iterdir()] == ["old"]


def test_bake_makes_an_object(bpy: Any, traced: Any) -> None:
    assert bpy.ops.accelscope.bake() == {"FINISHED"}
    collection = bpy.data.collections["AccelScope"]
    (obj,) = collection.objects
    assert len(obj.data.edges) > 0


# -------------------------------------------------------------------------------------- refusals


def test_nothing_can_be_done_before_there_is_something(bpy: Any) -> None:
    possible = {
        verb for verb in dir(bpy.ops.accelscope) if getattr(bpy.ops.accelscope, verb).poll()
    }
    to_begin_with = {
        "add_sample_scene", "copy_program", "explain_figure", "read_source", "step_lesson", "teach",
    }  # fmt: skip
    assert possible == to_begin_with


def test_error_leaves_the_previous_result(bpy: Any, traced: Any, root: Any, current: Any) -> None:
    before = (current.built, current.traced, current.record, current.cells)
    root.structure = "grid"
    root.structures.grid.resolution = (10_000, 10_000, 10_000)
    with pytest.raises(RuntimeError, match="can be numbered"):
        bpy.ops.accelscope.build()
    root.workload = "file"
    root.workloads.file.path = "missing.npz"
    with pytest.raises(RuntimeError, match="there is no file"):
        bpy.ops.accelscope.trace()
    assert before == (current.built, current.traced, current.record, current.cells)
    # What was built is still watched.
    traced.location.x = 1
    bpy.context.view_layer.update()
    assert "Suzanne has moved" in current.status(bpy.context).text


def test_empty_mesh_is_refused_with_a_message(bpy: Any, current: Any) -> None:
    obj = bpy.data.objects.new("Nothing", bpy.data.meshes.new("Nothing"))
    bpy.context.collection.objects.link(obj)
    with pytest.raises(RuntimeError, match="no mesh with faces is visible"):
        bpy.ops.accelscope.build()
    assert current.built is None


def test_clear_drops_everything(bpy: Any, traced: Any, current: Any) -> None:
    bpy.ops.accelscope.clear()
    assert current.built is current.traced is current.cells is current.record is None
    assert current.status(bpy.context).text == "Nothing has been built yet"


# ------------------------------------------------------------------------ a walk event by event


def test_the_recorded_ray_event_by_event(bpy: Any, traced: Any, root: Any, current: Any) -> None:
    knobs = root.lessons.ray
    knobs.ray = int(np.flatnonzero(current.traced.hits.primitive >= 0)[0])
    bpy.ops.accelscope.step_ray()
    last = len(lesson().play.walk.steps) - 1
    knobs.event = 0
    first = lesson().picture.caption
    knobs.event = 10**6  # there are no more than there are
    assert knobs.event == last
    assert lesson().picture.caption != first
    knobs.whole = True
    assert len(lesson().picture.segments) > 10
