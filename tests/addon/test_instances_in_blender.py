"""What Blender has in several places stays one mesh, and is still watched place by place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from accelscope.core.geometry.instances import Instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures.bvh import BVH

UP_TO_DATE = "Up to date"


@pytest.fixture
def taken(bpy: Any) -> Callable[..., Any]:
    """Return the scene that is open, its instances kept or flattened."""
    from accelscope.addon.from_blender import extraction

    return lambda how="keep": extraction.extract(bpy.context, extraction.VISIBLE, how)


@pytest.fixture
def status(bpy: Any) -> Callable[[], str]:
    from accelscope.addon.results import session

    return lambda: session.current.status(bpy.context).text


def monkey(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_monkey_add()
    return bpy.context.object


def linked(bpy: Any, obj: Any, name: str = "Twin", **transform: Any) -> Any:
    """Add an object that shares the mesh of another."""
    twin = bpy.data.objects.new(name, obj.data)
    for key, value in transform.items():
        setattr(twin, key, value)
    bpy.context.collection.objects.link(twin)
    return twin


def collection_instances(bpy: Any) -> None:
    obj = monkey(bpy)
    source = bpy.data.collections.new("Source")
    source.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    for number in range(3):
        empty = bpy.data.objects.new(f"Place{number}", None)
        empty.instance_type, empty.instance_collection = "COLLECTION", source
        empty.location, empty.rotation_euler = (3.0 * number, number, 0.0), (number, 0.5, 0.0)
        bpy.context.scene.collection.objects.link(empty)


def linked_duplicates(bpy: Any) -> None:
    obj = monkey(bpy)
    linked(bpy, obj, "Mirrored", scale=(-1, 1, 1), location=(3, 0, 0))
    linked(bpy, obj, "Sheared", rotation_euler=(0.3, 0.4, 0.5), location=(0, 4, 0)).parent = linked(
        bpy, obj, "Parent", scale=(1, 2, 0.5), location=(0, 0, 3)
    )


def geometry_nodes(bpy: Any) -> None:
    source = monkey(bpy)
    source.hide_set(True)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=1, y_subdivisions=2, size=8)
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    inside, outside = (tree.nodes.new(f"NodeGroup{kind}") for kind in ("Input", "Output"))
    info = tree.nodes.new("GeometryNodeObjectInfo")
    info.inputs["Object"].default_value = source
    scatter = tree.nodes.new("GeometryNodeInstanceOnPoints")
    scatter.inputs["Rotation"].default_value = (0.2, 0.3, 0.4)
    scatter.inputs["Scale"].default_value = (1.0, 0.5, 1.5)
    tree.links.new(inside.outputs[0], scatter.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], scatter.inputs["Instance"])
    tree.links.new(scatter.outputs[0], outside.inputs[0])
    bpy.context.object.modifiers.new("Scatter", "NODES").node_group = tree


def particles(bpy: Any) -> None:
    source = monkey(bpy)
    source.location.z = 9.0
    bpy.ops.mesh.primitive_plane_add(size=10)
    settings = bpy.context.object.modifiers.new("Grass", "PARTICLE_SYSTEM").particle_system.settings
    settings.type, settings.count = "HAIR", 6
    settings.render_type, settings.instance_object = "OBJECT", source
    settings.particle_size = 0.3


@pytest.mark.parametrize(
    ("make", "instances", "meshes"),
    [
        (collection_instances, 3, 1), (linked_duplicates, 4, 1), (geometry_nodes, 6, 1),
        (particles, 8, 2),
    ],
)  # fmt: skip
def test_every_kind_of_instance_stays_one(
    bpy: Any, taken: Callable[..., Any], make: Callable[[Any], None], instances: int, meshes: int
) -> None:
    """And rays hit the same either way."""
    make(bpy)
    kept, flat = taken(), taken("flatten")
    assert isinstance(kept.geometry, Instanced)
    assert (len(kept), len(kept.geometry.meshes)) == (instances, meshes)
    assert kept.object_names == flat.object_names
    assert kept.geometry.first[-1] == len(flat)
    assert np.allclose(kept.flat().triangles, flat.triangles, atol=1e-14 * flat.diagonal)
    random = np.random.default_rng(0)
    shares = random.dirichlet((1, 1, 1), 400)[:, :, None]
    targets = (flat.triangles[random.integers(len(flat), size=400)] * shares).sum(axis=1)
    origins = targets + flat.diagonal * random.normal(size=(400, 3))
    rays = Rays.from_arrays(origins, targets - origins)
    (near, _), (far, _) = (BVH.build(each, BVH.Settings()).trace(rays) for each in (kept, flat))
    same = near.primitive == far.primitive
    assert same.mean() > 0.99
    # A direction is as long as the way to its target, where the scene is: so t is a share of that.
    assert np.allclose(near.t[same], far.t[same], rtol=1e-12, atol=1e-12)


def test_a_mesh_in_one_place_is_triangles(bpy: Any, taken: Callable[..., Any]) -> None:
    monkey(bpy)
    bpy.ops.mesh.primitive_cube_add()
    assert len(taken().triangles) == len(taken("flatten").triangles)
    # Equal, but another mesh.
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    assert not isinstance(taken().geometry, Instanced)


def test_zero_scale_and_a_mesh_of_no_faces(bpy: Any, taken: Callable[..., Any]) -> None:
    obj = monkey(bpy)
    linked(bpy, obj, "Gone", scale=(0, 0, 0), location=(3, 0, 0))
    linked(bpy, obj, "Flat", scale=(1, 1, 0), location=(0, 3, 0))
    bpy.context.collection.objects.link(bpy.data.objects.new("No", bpy.data.meshes.new("No")))
    kept, flat = taken(), taken("flatten")
    assert (len(kept), len(kept.geometry.meshes)) == (3, 2)
    rays = Rays.from_arrays(
        np.random.default_rng(1).uniform((-1, -1, 5), (4, 4, 6), (500, 3)), [[0.01, 0.02, -1]] * 500
    )
    (near, _), (far, _) = (BVH.build(each, BVH.Settings()).trace(rays) for each in (kept, flat))
    assert np.array_equal(near.primitive, far.primitive)


# ------------------------------------------------------------------------------------ up to date


def test_one_place_and_the_mesh_are_watched(bpy: Any, status: Callable[[], str]) -> None:
    obj = monkey(bpy)
    twin = linked(bpy, obj, location=(3, 0, 0))
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE
    twin.location.x = 4.0
    assert status() == "Out of date: Twin has moved"
    twin.location.x = 3.0
    assert status() == UP_TO_DATE
    obj.data.vertices[0].co.x += 1.0
    obj.data.update()
    assert "the geometry of" in status()
    obj.data.vertices[0].co.x -= 1.0
    obj.data.update()
    third = linked(bpy, obj, "Third", location=(9, 0, 0))
    assert status() == "Out of date: Third was added"
    bpy.data.objects.remove(third)
    assert status() == UP_TO_DATE


def test_the_setting_matters_where_there_are_instances(bpy: Any, status: Callable[[], str]) -> None:
    root = bpy.context.scene.accelscope
    obj = monkey(bpy)
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    root.instances = "flatten"
    assert status() == UP_TO_DATE
    linked(bpy, obj, location=(3, 0, 0))
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE
    root.instances = "keep"
    assert status() == "Out of date: instances were flattened"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE
    root.instances = "flatten"
    assert status() == "Out of date: instances were kept"


# ------------------------------------------------------------------- what is for triangles only


def test_what_divides_triangles_says_what_to_choose_in_the_panel(
    bpy: Any, status: Callable[[], str]
) -> None:
    linked(bpy, monkey(bpy), location=(3, 0, 0))
    root = bpy.context.scene.accelscope
    root.structure, root.structures.bvh.builder = "bvh", "sbvh"
    with pytest.raises(RuntimeError, match="holds instances; choose Instances Flatten"):
        bpy.ops.accelscope.build()
    root.instances = "flatten"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE


def test_a_refit_follows_instances(bpy: Any, status: Callable[[], str]) -> None:
    from accelscope.addon.results import session

    obj = monkey(bpy)
    twin = linked(bpy, obj, location=(3, 0, 0))
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    twin.location.x, twin.rotation_euler.z = 5.0, 1.0
    obj.data.vertices[0].co.x += 0.5
    obj.data.update()
    assert bpy.ops.accelscope.refit() == {"FINISHED"}
    assert status() == UP_TO_DATE
    refitted = session.current.built.structure
    assert refitted.validate() == []
    anew = BVH.build(refitted.scene, refitted.settings)
    starts = np.random.default_rng(2).uniform((-2, -9, -1), (7, -8, 1), (300, 3))
    rays = Rays.from_arrays(starts, np.tile([0.0, 1.0, 0.0], (300, 1)))
    (near, _), (far, _) = refitted.trace(rays), anew.trace(rays)
    assert np.array_equal(near.t, far.t)
    assert np.array_equal(near.primitive, far.primitive)
    bpy.data.objects.remove(twin)
    with pytest.raises(RuntimeError, match="a refit needs the same ones"):
        bpy.ops.accelscope.refit()


def test_frames_of_the_timeline_are_triangles(bpy: Any, status: Callable[[], str]) -> None:
    """A mesh may be deformed from frame to frame: then it is in one place only."""
    from accelscope.addon.results import session

    bpy.context.scene.frame_end = 2
    linked(bpy, monkey(bpy), location=(3, 0, 0))
    assert bpy.ops.accelscope.compare_over_timeline() == {"FINISHED"}
    assert session.current.record["scene"]["triangles"] == len(
        session.current.built.structure.scene
    )
    assert status() == "Out of date: instances were flattened"


def test_a_recorded_ray_names_the_instance_and_the_triangle_of_its_mesh(bpy: Any) -> None:
    from accelscope.addon.results import session

    linked(bpy, monkey(bpy), location=(30, 0, 0))
    root = bpy.context.scene.accelscope
    root.workload = "random_lines"
    root.workloads.random_lines.count = 2000
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    found = session.current.traced.hits.primitive
    number = int(np.flatnonzero(found >= 968)[0])
    root.lessons.ray.ray = number
    assert bpy.ops.accelscope.step_ray() == {"FINISHED"}
    from accelscope.addon.results import lesson_view

    within = found[number] - 968
    names = session.current.built.structure.scene.object_names
    hit = {row.label: row.text for row in lesson_view.current.picture.rows}["Hit"]
    assert f" {within} of {names[1]} at t = " in hit


# ----------------------------------------------------------------------------------- what is drawn


@pytest.mark.parametrize("structure", ["bvh", "grid"])
def test_boxes_of_instances_and_trees_of_meshes_are_shown_and_baked(
    bpy: Any, structure: str
) -> None:
    from accelscope.addon.drawing import overlay
    from accelscope.addon.results import session
    from accelscope.core.contract.outlines import DASHES

    obj = monkey(bpy)
    for number in range(3):
        linked(bpy, obj, location=(3.0 * number, 3, 0), rotation_euler=(number, 0.5, 0))
    root = bpy.context.scene.accelscope
    root.structure = structure
    root.display.hide_empty = False
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    drawable = session.current.drawable
    cells = drawable.cells
    assert cells.n_own is not None
    assert cells.is_dashed.sum() == 4
    within = len(cells) - cells.n_own - 4
    text = overlay.shown_text(root.display)
    assert f"of {len(cells):,} cells".replace(",", " ") in text
    assert "in their shape" not in text
    # A cell is drawn as a box or edge by edge, never as both.
    as_boxes = int(np.diff(drawable.boxes.starts).sum())
    edges = np.diff(drawable.edges.starts)
    assert as_boxes + (edges > 0).sum() == len(cells)
    assert (edges == 12 * DASHES).sum() == 4
    root.display.colour_by, root.display.depth_max = "depth", 1000
    assert bpy.ops.accelscope.bake() == {"FINISHED"}
    (baked,) = bpy.data.collections["AccelScope"].objects
    assert len(baked.data.edges) == 12 * (cells.n_own + within) + 12 * DASHES * 4
    # Only what is in the meshes: deeper than the boxes of instances.
    root.display.depth_min = int(cells.depth[cells.is_dashed][0]) + 1
    assert bpy.ops.accelscope.bake() == {"FINISHED"}
    inner = next(o for o in bpy.data.collections["AccelScope"].objects if o is not baked)
    assert len(inner.data.edges) == 12 * within
    root.display.leaves_only = True
    assert bpy.ops.accelscope.bake() == {"FINISHED"}


@pytest.mark.parametrize("name", ["levels", "split_plane", "ray"])
def test_lessons_are_about_instances(bpy: Any, name: str) -> None:
    from accelscope.addon.results import lesson_view

    linked(bpy, monkey(bpy), location=(3, 0, 0))
    bpy.context.scene.accelscope.teaching.lesson = name
    bpy.ops.object.select_all(action="DESELECT")
    assert bpy.ops.accelscope.use_my_mesh() == {"FINISHED"}
    view = lesson_view.current
    assert view.lesson.name == name
    assert len(view.subject.scene) == 2
    assert np.isfinite(view.picture.points()).all()
    view.clear()


# ----------------------------------------------------------------------------------- what they say


def test_objects_say_of_themselves_what_instances_do(
    bpy: Any, taken: Callable[..., Any], status: Callable[[], str]
) -> None:
    obj = monkey(bpy)
    twin = linked(bpy, obj, location=(3, 0, 0))
    said = twin.accelscope_instance
    said.mask, said.id, said.hit_group, said.front_ccw = 6, 9, 2, True
    geometry = taken().geometry
    assert geometry.masks.tolist() == [255, 6]
    assert (geometry.instance_ids[1], geometry.hit_groups[1], geometry.flags[1]) == (9, 2, 2)
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE
    said.mask = 7
    assert status() == "Out of date: what Twin says of itself as an instance has changed"
    said.mask = 6
    assert status() == UP_TO_DATE
    said.force_opaque = said.force_non_opaque = True
    with pytest.raises(RuntimeError, match="Twin as an instance cannot be forced to be opaque and"):
        bpy.ops.accelscope.build()


def test_what_instances_an_object_speaks_for_it(bpy: Any, taken: Callable[..., Any]) -> None:
    collection_instances(bpy)
    places = [bpy.data.objects[f"Place{number}"] for number in range(3)]
    bpy.data.objects["Suzanne"].accelscope_instance.mask = 2
    places[1].accelscope_instance.mask = 5
    assert taken().geometry.masks.tolist() == [2, 5, 2]


def test_every_object_is_an_instance_if_asked_for(
    bpy: Any, taken: Callable[..., Any], status: Callable[[], str]
) -> None:
    monkey(bpy)
    bpy.ops.mesh.primitive_cube_add(location=(5, 0, 0))
    scene = taken("objects")
    assert isinstance(scene.geometry, Instanced)
    assert {len(mesh.ids) for mesh in scene.geometry.meshes} == {12, 968}
    assert scene.object_names == taken("flatten").object_names
    root = bpy.context.scene.accelscope
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    root.instances = "flatten"
    assert status() == UP_TO_DATE
    root.instances = "objects"
    assert status() == "Out of date: objects were no instances"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert status() == UP_TO_DATE
    root.instances = "keep"
    assert status() == "Out of date: every object was an instance"
