"""Objects stand for solids: by a property of their own, or by what their mesh carries."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Box, Cone, Placed, Sphere
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.geometry.solids.mixed import CONE, SPHERE, TRIANGLE
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH

TURNED = (1, 2, 3), (0.3, -0.2, 0.9), (1.5, 0.5, 2.0)


@pytest.fixture
def extraction(bpy: Any) -> Any:
    from accelscope.addon.from_blender import extraction

    return extraction


def visible(bpy: Any, extraction: Any, instances: str = "keep") -> Any:
    return extraction.extract(bpy.context, extraction.VISIBLE, instances)


def same_items(scene: Scene, items: list[Any]) -> None:
    wanted = mixed_of(items)
    for name in ("kinds", "rows", "boxes"):
        np.testing.assert_array_equal(getattr(scene.geometry, name), getattr(wanted, name))


UNIT = {
    "sphere": ("uv_sphere", Sphere((0, 0, 0), 1)),
    "box": ("cube", Box((-1, -1, -1), (1, 1, 1))),
    "cylinder": ("cylinder", Cone((0, 0, -1), (0, 0, 1), 1, 1)),
    "cone": ("cone", Cone((0, 0, -1), (0, 0, 1), 1, 0)),
}


@pytest.mark.parametrize("kind", UNIT)
def test_a_primitive_stands_for_its_solid_where_its_transform_puts_it(
    bpy: Any, extraction: Any, kind: str
) -> None:
    primitive, solid = UNIT[kind]
    getattr(bpy.ops.mesh, f"primitive_{primitive}_add")()
    obj = bpy.context.object
    obj.location, obj.rotation_euler, obj.scale = TURNED
    obj.accelscope_solid.kind = kind
    # As Blender draws it: the size is that of the mesh, of sides that approach a circle.
    np.testing.assert_allclose(obj.accelscope_solid.size, 1.0, atol=1e-6)
    obj.accelscope_solid.size = (1, 1, 1)
    scene = visible(bpy, extraction)
    matrix = np.array(obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).matrix_world)
    same_items(scene, [Placed(solid, matrix[:3].astype(np.float64))])
    assert scene.object_names == (obj.name,)


def test_the_size_is_taken_from_the_mesh_and_may_be_another(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_ico_sphere_add(radius=3)
    group = bpy.context.object.accelscope_solid
    group.kind = "sphere"
    # The vertices of an icosphere reach its radius along z only.
    np.testing.assert_allclose(group.size, 3.0, atol=1e-6)
    np.testing.assert_array_equal(group.centre, 0.0)
    group.size, group.centre = (1, 2, 4), (0, 0, 5)
    np.testing.assert_array_equal(visible(bpy, extraction).geometry.boxes[0], [-1, -2, 1, 1, 2, 9])
    bpy.ops.mesh.primitive_cylinder_add(vertices=5, radius=2, depth=8)
    group = bpy.context.object.accelscope_solid
    group.kind = "cylinder"
    assert group.size[0] == group.size[1] == pytest.approx(2.0, rel=0.1)
    assert group.size[2] == 4.0
    np.testing.assert_array_equal(group.centre, 0.0)


def test_cones_are_truncated_and_opened(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cone_add()
    group = bpy.context.object.accelscope_solid
    group.kind, group.size, group.apex, group.is_capped = "cone", (1, 1, 1), 0.5, False
    same_items(
        visible(bpy, extraction),
        [Placed(Cone((0, 0, -1), (0, 0, 1), 1, 0.5, False), np.eye(3, 4))],
    )


def test_solids_stand_beside_triangles_in_the_order_of_their_objects(
    bpy: Any, extraction: Any
) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 3))
    bpy.context.object.accelscope_solid.kind = "sphere"
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    scene = visible(bpy, extraction)
    kinds = scene.geometry.kinds
    assert dict(zip(scene.object_names, np.bincount(scene.object_ids), strict=True)) == {
        "Plane": 2, "Sphere": 1, "Cube": 12,
    }  # fmt: skip
    for number, name in enumerate(scene.object_names):
        wanted = SPHERE if name == "Sphere" else TRIANGLE
        assert (kinds[scene.object_ids == number] == wanted).all()
    np.testing.assert_array_equal(scene.geometry.ids, np.arange(15))
    # What a ray hits is the ball, and not a face of its mesh.
    rays = Rays.from_arrays(np.array([[0.6, 0, 9]]), np.array([[0.0, 0, -1]]))
    hits, _ = BVH.build(scene, BVH.Settings()).trace(rays)
    assert hits.t[0] == pytest.approx(5.2, rel=1e-6)


def test_without_solids_all_is_as_before(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add()
    before = visible(bpy, extraction).triangles
    group = bpy.context.object.accelscope_solid
    group.kind = "sphere"
    assert len(visible(bpy, extraction)) == 1
    group.kind = "itself"
    np.testing.assert_array_equal(visible(bpy, extraction).triangles, before)


def test_every_instance_of_a_solid_is_one(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cylinder_add()
    inner = bpy.data.collections.new("Inner")
    obj = bpy.context.object
    obj.accelscope_solid.kind = "cylinder"
    inner.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    for x in (0, 4):
        empty = bpy.data.objects.new("Empty", None)
        empty.instance_type, empty.instance_collection, empty.location = (
            "COLLECTION",
            inner,
            (x, 0, 0),
        )
        bpy.context.scene.collection.objects.link(empty)
    bpy.ops.mesh.primitive_cube_add(location=(0, 9, 0))
    bpy.ops.object.duplicate(linked=True)
    scene = visible(bpy, extraction)
    assert (scene.geometry.kinds == CONE).sum() == 2
    assert len(scene) == 2 + 2 * 12
    assert any("flattened" in note for note in scene.notes)
    assert not any("flattened" in note for note in visible(bpy, extraction, "flatten").notes)


def test_triangles_beside_solids_that_are_no_numbers_are_dropped(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_plane_add()
    bpy.context.object.data.vertices[0].co.x = float("nan")
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 3))
    bpy.context.object.accelscope_solid.kind = "sphere"
    scene = visible(bpy, extraction)
    assert scene.dropped > 0
    assert len(scene) == 3 - scene.dropped == len(scene.primitive_ids)


CHANGES = {
    "kind": lambda group: setattr(group, "kind", "box"),
    "itself": lambda group: setattr(group, "kind", "itself"),
    "size": lambda group: setattr(group, "size", (1, 1, 2)),
    "centre": lambda group: setattr(group, "centre", (0, 0, 1)),
    "apex": lambda group: setattr(group, "apex", 0.25),
    "caps": lambda group: setattr(group, "is_capped", False),
}


@pytest.mark.parametrize("change", CHANGES)
def test_what_was_built_is_not_up_to_date_after_a_change(bpy: Any, change: str) -> None:
    from accelscope.addon.results import session

    bpy.ops.mesh.primitive_cone_add()
    group = bpy.context.object.accelscope_solid
    group.kind = "cone"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    bpy.context.evaluated_depsgraph_get()
    assert session.current.status(bpy.context).up_to_date
    group.kind = group.kind  # nothing
    bpy.context.view_layer.update()
    assert session.current.status(bpy.context).up_to_date
    CHANGES[change](group)
    bpy.context.view_layer.update()
    status = session.current.status(bpy.context)
    assert not status.up_to_date
    assert "Cone" in status.text


def test_undo_brings_back_what_an_object_stood_for(bpy: Any, extraction: Any) -> None:
    bpy.ops.mesh.primitive_cone_add()
    bpy.ops.ed.undo_push(message="before")
    bpy.context.object.accelscope_solid.kind = "cone"
    bpy.ops.ed.undo_push(message="after")
    assert len(visible(bpy, extraction)) == 1
    bpy.ops.ed.undo()
    assert bpy.context.object.accelscope_solid.kind == "itself"
    assert len(visible(bpy, extraction)) > 1


def test_a_file_keeps_it_and_the_command_line_reads_it(
    bpy: Any, extraction: Any, tmp_path: Path
) -> None:
    bpy.ops.mesh.primitive_uv_sphere_add(location=(0, 0, 3))
    bpy.context.object.accelscope_solid.kind = "sphere"
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "ball.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = extraction.load_blend(tmp_path / "ball.blend")
    assert (len(scene), scene.geometry.kinds[0]) == (1, SPHERE)
    assert scene.counted == "1 items"


# ------------------------------------------------------------------------- what a mesh carries


def sample(bpy: Any) -> Any:
    bpy.ops.accelscope.add_sample_scene(sample="jacks", jacks_size=1)
    return bpy.context.object


def test_items_move_with_the_object_that_carries_them(bpy: Any, extraction: Any) -> None:
    obj = sample(bpy)
    before = visible(bpy, extraction)
    obj.location, obj.scale = (1, 2, 3), (2, 2, 2)
    after = visible(bpy, extraction)
    assert len(after) == len(before) == 9
    wanted = 2.0 * before.geometry.boxes + np.tile([1.0, 2.0, 3.0], 2)
    np.testing.assert_allclose(after.geometry.boxes, wanted, atol=1e-12)


def test_a_duplicate_carries_them_too(bpy: Any, extraction: Any) -> None:
    sample(bpy)
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.object.duplicate()
    assert len(visible(bpy, extraction)) == 18


@pytest.mark.parametrize("way", ["edited", "modifier"])
def test_a_mesh_that_was_changed_is_its_triangles(bpy: Any, extraction: Any, way: str) -> None:
    obj = sample(bpy)
    if way == "edited":
        obj.data.vertices[0].co.x += 1.0
        obj.data.update()
    else:
        obj.modifiers.new("Array", "ARRAY").count = 2
    scene = visible(bpy, extraction)
    assert len(scene) == len(scene.triangles) > 100


def test_an_object_that_stands_for_a_solid_does_so_whatever_its_mesh_carries(
    bpy: Any, extraction: Any
) -> None:
    sample(bpy).accelscope_solid.kind = "box"
    assert len(visible(bpy, extraction)) == 1


def test_descriptions_that_are_damaged_are_refused(bpy: Any, extraction: Any) -> None:
    from accelscope.core.errors import InputError

    obj = sample(bpy)
    for text in ("", "[", '[["Ball",1]]', '[["Sphere",[0,0,0]]]', "3"):
        obj.data["accelscope_items"] = text
        with pytest.raises(InputError, match="description of items is damaged"):
            visible(bpy, extraction)
