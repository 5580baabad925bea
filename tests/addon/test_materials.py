"""Materials of Blender come with the scene: what the picture's rays need of them, and what not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest


@pytest.fixture
def extract(bpy: Any) -> Any:
    from accelscope.addon.from_blender import extraction

    return lambda instances="keep": extraction.extract(bpy.context, extraction.VISIBLE, instances)


def with_nodes(block: Any) -> None:
    if block.node_tree is None:  # up to 4.5
        block.use_nodes = True


def principled(bpy: Any, name: str, **sockets: Any) -> Any:
    material = bpy.data.materials.new(name)
    with_nodes(material)
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for socket, value in sockets.items():
        shader.inputs[socket.replace("_", " ")].default_value = value
    return material


def cube_of(bpy: Any, *materials: Any, location: Any = (0, 0, 0)) -> Any:
    bpy.ops.mesh.primitive_cube_add(location=location)
    cube = bpy.context.object
    for material in materials:
        cube.data.materials.append(material)
    return cube


def test_principled_sockets_are_read(bpy: Any, extract: Any) -> None:
    cube_of(bpy, principled(bpy, "Gold", Metallic=1.0, Roughness=0.0, Base_Color=(1, 0.5, 0, 1)))
    cube_of(bpy, principled(bpy, "Glass", Transmission_Weight=1.0, IOR=1.5, Roughness=0.0))
    scene = extract()
    assert [each.name for each in scene.materials] == ["Gold", "Glass"]
    gold, glass = scene.materials
    assert (gold.specular, gold.diffuse, gold.transmission) == (1.0, 0.0, 0.0)
    assert gold.specular_colour == pytest.approx((1.0, 0.735357, 0.0), abs=1e-6)
    assert glass.index_of_refraction == 1.5
    assert (glass.specular, glass.transmission) == pytest.approx((0.04, 0.96))
    assert scene.materials_of(np.array([0, 11, 12, 23])).tolist() == [0, 0, 1, 1]
    assert scene.notes == ()


def test_faces_have_the_material_of_their_slot(bpy: Any, extract: Any) -> None:
    cube = cube_of(bpy, bpy.data.materials.new("A"), bpy.data.materials.new("B"))
    for polygon in cube.data.polygons:
        polygon.material_index = polygon.index % 2
    scene = extract()
    names = [scene.materials[k].name for k in scene.materials_of(np.arange(12))]
    assert names == ["A", "A", "B", "B"] * 3


def test_a_material_may_be_the_objects_own(bpy: Any, extract: Any) -> None:
    """Linked duplicates share their mesh; they are instances, and may be of different materials."""
    a, b = bpy.data.materials.new("A"), bpy.data.materials.new("B")
    first = cube_of(bpy, a)
    second = first.copy()
    second.location = (5, 0, 0)
    bpy.context.collection.objects.link(second)
    second.material_slots[0].link = "OBJECT"
    second.material_slots[0].material = b
    for instances in ("keep", "flatten"):
        scene = extract(instances)
        of = [scene.materials[k].name for k in scene.materials_of(np.arange(24))]
        assert of == ["A"] * 12 + ["B"] * 12
    kept = extract()
    assert np.array_equal(kept.flat().material_ids, kept.materials_of(np.arange(24)))


def test_what_is_not_read_is_said_once(bpy: Any, extract: Any) -> None:
    worn = principled(bpy, "Worn", Coat_Weight=0.5, Alpha=0.25)
    tree = worn.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    tree.links.new(tree.nodes.new("ShaderNodeTexNoise").outputs[0], shader.inputs["Base Color"])
    cube_of(bpy, worn)
    cube_of(bpy, worn, location=(5, 0, 0))
    emitting = bpy.data.materials.new("Lamp")
    with_nodes(emitting)
    tree = emitting.node_tree
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(glow.outputs[0], tree.get_output_node("ALL").inputs["Surface"])
    cube_of(bpy, emitting, location=(0, 5, 0))
    bpy.data.materials.new("Unused")
    assert extract().notes == (
        "not read of the material Worn: nodes of Base Color, Alpha, Coat Weight",
        "not read of the material Lamp: its Emission, so that its colour in the viewport is taken",
    )


def test_what_has_no_material_is_matt_beside_what_has_one(bpy: Any, extract: Any) -> None:
    from accelscope.core.scene.material import MATT

    cube_of(bpy)
    assert extract().materials == ()
    cube_of(bpy, bpy.data.materials.new("A"), location=(5, 0, 0))
    scene = extract()
    assert scene.materials[scene.materials_of(np.array([0]))[0]] == MATT
    assert scene.materials[scene.materials_of(np.array([12]))[0]].name == "A"


def test_a_material_that_is_changed_is_seen_at_the_next_trace(
    bpy: Any, root: Any, current: Any
) -> None:
    """Structures do not depend on it: nothing is built anew, and nothing is out of date."""
    mirror = principled(bpy, "Mirror", Metallic=1.0, Roughness=0.0)
    cube_of(bpy, mirror)
    root.workload = "whitted"
    root.workloads.whitted.width = root.workloads.whitted.height = 16
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    built = current.built
    assert current.record["rays"]["classes"]["reflected"] > 0
    shader = next(node for node in mirror.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Metallic"].default_value = 0.0
    bpy.ops.accelscope.trace()
    assert current.built is built
    assert current.record["rays"]["classes"]["reflected"] == 0


def test_the_worlds_colour_is_the_background(bpy: Any, extract: Any) -> None:
    cube_of(bpy)
    world = bpy.context.scene.world or bpy.data.worlds.new("World")
    bpy.context.scene.world = world
    with_nodes(world)
    for node in world.node_tree.nodes:
        if node.type == "BACKGROUND":
            node.inputs["Color"].default_value = (0.0, 0.5, 1.0, 1.0)
    assert extract().background == pytest.approx((0.0, 0.735357, 1.0), abs=1e-6)


def test_a_mesh_that_is_mirrored_has_its_inside_within(bpy: Any, extract: Any) -> None:
    """A glass cube with a negative scale is entered and left like any other, kept or flattened."""
    import dataclasses

    from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
    from accelscope.core.evaluation.records.experiment import Built, trace
    from accelscope.core.scene import Camera
    from accelscope.core.structures import structures

    glass = principled(bpy, "Glass", Transmission_Weight=1.0, IOR=1.5, Roughness=0.0)
    cube = cube_of(bpy, glass)
    twin = cube.copy()
    bpy.context.collection.objects.link(twin)
    pictures = []
    for scale in (1.0, -1.0):
        cube.scale = twin.scale = (scale, 1.0, 1.0)
        twin.location = (5, 0, 0)
        bpy.context.view_layer.update()
        for instances in ("keep", "flatten"):
            scene = extract(instances)
            camera = Camera(np.array([3.0, -9, 3]), np.zeros(3), np.array([0.0, 0, 1]), 30.0)
            scene = dataclasses.replace(scene, camera=camera, background=(1.0, 0.5, 0.25))
            bvh = structures()["bvh"]
            built = Built(bvh.build(scene, bvh.Settings()), 0.0)
            result = trace(built, WhittedWorkload, WhittedSettings(width=24, height=24))
            pictures.append(result.outcome.picture)
    for other in pictures[1:]:
        np.testing.assert_allclose(other, pictures[0], atol=1e-9)


@pytest.mark.parametrize("name", ["balls", "mount", "gears", "tetra"])
def test_samples_send_as_many_rays_on_in_blender(bpy: Any, extract: Any, name: str) -> None:
    """As the scene that they were made of, of solids that meshes stand for."""
    import dataclasses

    from accelscope.addon.to_blender import sample_objects
    from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
    from accelscope.core.evaluation.records.experiment import Built, trace
    from accelscope.core.structures import structures
    from accelscope.sample_scenes import samples

    sample = samples()[name]
    settings = sample.Settings(size=1)
    made = sample.generate(settings)
    sample_objects.add_scene(bpy.context.scene, made, name, sample.items(settings))
    bpy.context.view_layer.update()
    taken = dataclasses.replace(extract(), camera=made.camera)
    bvh = structures()["bvh"]
    counts = []
    for scene in (made, taken):
        built = Built(bvh.build(scene, bvh.Settings()), 0.0)
        result = trace(built, WhittedWorkload, WhittedSettings(width=48, height=48))
        counts.append(np.bincount(result.rays.classes, minlength=4))
    np.testing.assert_allclose(counts[1], counts[0], rtol=0.005)
    for block in bpy.data.materials:
        assert tuple(block.diffuse_color[:3]) == pytest.approx((0.8, 0.8, 0.8))


@pytest.mark.parametrize(
    ("shape", "half_axes", "is_round"),
    [
        ("SQUARE", [[0.0, 1.0, 0.0], [-2.0, 0.0, 0.0]], False),
        ("RECTANGLE", [[0.0, 1.0, 0.0], [-3.0, 0.0, 0.0]], False),
        ("DISK", [[0.0, 1.0, 0.0], [-2.0, 0.0, 0.0]], True),
        ("ELLIPSE", [[0.0, 1.0, 0.0], [-3.0, 0.0, 0.0]], True),
    ],
)
def test_area_lights_have_their_shape(
    bpy: Any, extract: Any, shape: str, half_axes: Any, is_round: bool
) -> None:
    """Turned a quarter about z, and twice as high as wide."""
    cube_of(bpy)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.shape, lamp.data.size, lamp.data.size_y = shape, 2.0, 3.0
    lamp.rotation_euler, lamp.scale = (0, 0, np.pi / 2), (1, 2, 1)
    bpy.context.scene.collection.objects.link(lamp)
    (light,) = extract().lights
    assert light.is_round is is_round
    np.testing.assert_allclose(light.half_axes, half_axes, atol=1e-6)
