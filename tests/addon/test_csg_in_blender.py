"""Boolean modifiers are trees of solids; the witness is the mesh of Blender's exact solver."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from accelscope.core.geometry.csg.trees import Csg
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangles import Triangles
from accelscope.core.sah.line_sample import random_lines
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH

RAYS = 100_000


@pytest.fixture
def extraction(bpy: Any) -> Any:
    from accelscope.addon.from_blender import extraction

    return extraction


def visible(bpy: Any, extraction: Any) -> Scene:
    return extraction.extract(bpy.context, extraction.VISIBLE, "keep")


def add(bpy: Any, primitive: str, name: str, **options: Any) -> Any:
    getattr(bpy.ops.mesh, f"primitive_{primitive}_add")(**options)
    bpy.context.object.name = name
    return bpy.context.object


def boolean(obj: Any, operation: str, operand: Any) -> Any:
    modifier = obj.modifiers.new(operation.title(), "BOOLEAN")
    modifier.operation, modifier.solver = operation, "EXACT"
    if hasattr(operand, "all_objects"):
        modifier.operand_type, modifier.collection = "COLLECTION", operand
    else:
        modifier.object = operand
    return modifier


def collected(bpy: Any, name: str, objects: list[Any]) -> Any:
    collection = bpy.data.collections.new(name)
    for obj in objects:
        collection.objects.link(obj)
        obj.hide_set(True)
    bpy.context.scene.collection.children.link(collection)
    return collection


def evaluated(bpy: Any, obj: Any) -> Scene:
    """What Blender makes of an object, in world space."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    there = obj.evaluated_get(depsgraph)
    mesh = there.to_mesh()
    mesh.calc_loop_triangles()
    corners = np.array([v.co for v in mesh.vertices])[
        np.array([t.vertices for t in mesh.loop_triangles])
    ]
    matrix = np.array(there.matrix_world)
    there.to_mesh_clear()
    return Scene.from_triangles(corners @ matrix[:3, :3].T + matrix[:3, 3], "witness")


def far_apart(tree: Scene, witness: Scene, count: int = RAYS) -> tuple[int, float]:
    """How many rays disagree by more than 1e-6 of the size; and the share of hits.

    Blender rounds vertices to float32. So one that passes an edge, or skims a face, agrees if what
    rays hit that are moved sideways by as much lies around its hit.
    """
    rays = Rays.from_arrays(*random_lines(witness.lower, witness.upper, count, 5))
    built = [BVH.build(each, BVH.Settings()) for each in (tree, witness)]
    t, other = (each.trace(rays)[0].t for each in built)
    slack = 1e-6 * tree.diagonal
    with np.errstate(invalid="ignore"):
        differs = (np.isfinite(t) != np.isfinite(other)) | (np.abs(t - other) > slack)
    off = np.flatnonzero(differs)
    low, high, rng = t[off].copy(), t[off].copy(), np.random.default_rng(1)
    for _ in range(64 if len(off) else 0):
        aside = rng.normal(size=(len(off), 3))
        aside *= slack / np.linalg.norm(aside, axis=1)[:, None]
        moved = Rays.from_arrays(rays.origins[off] + aside, rays.directions[off])
        beside = built[0].trace(moved)[0].t
        low, high = np.minimum(low, beside), np.maximum(high, beside)
    is_around = (low - slack <= other[off]) & (other[off] <= high + slack)
    assert len(off) < 2e-4 * count
    return int((~is_around).sum()), float(np.isfinite(other).mean())


def cube_and_cutter(bpy: Any) -> tuple[Any, Any]:
    """A cube, and a cube that is turned and reaches out of it."""
    cube = add(bpy, "cube", "Cube", size=2)
    cutter = add(bpy, "cube", "Cutter", location=(0.7, 0.4, 0.6), rotation=(0.3, 0.5, 0.2))
    cutter.hide_set(True)
    return cube, cutter


@pytest.mark.parametrize("operation", ["DIFFERENCE", "UNION", "INTERSECT"])
def test_polyhedra_are_those_of_the_exact_solver(bpy: Any, extraction: Any, operation: str) -> None:
    cube, cutter = cube_and_cutter(bpy)
    boolean(cube, operation, cutter)
    scene = visible(bpy, extraction)
    assert isinstance(scene.geometry, Csg)
    assert scene.object_names == ("Cube",)
    others, hits = far_apart(scene, evaluated(bpy, cube))
    assert others == 0
    assert hits > 0.3


def test_nested_modifiers_collections_and_moved_objects(bpy: Any, extraction: Any) -> None:
    """A block without balls, one of which is hollow, and with a peg; all turned and scaled."""
    block = add(bpy, "cube", "Block", location=(1, 2, 3), rotation=(0.2, 0.1, 0.7))
    block.scale = (2, 1, 0.7)
    balls = [
        add(bpy, "ico_sphere", f"Ball {n}", subdivisions=2, radius=0.5,
            location=(0.1 + 1.1 * n, 1.6 + 0.4 * n, 3.3)) for n in range(3)
    ]  # fmt: skip
    core = add(bpy, "cube", "Core", size=0.4, location=(0.13, 1.63, 3.33), rotation=(1, 2, 3))
    core.hide_set(True)
    boolean(balls[0], "DIFFERENCE", core)
    peg = add(bpy, "cylinder", "Peg", vertices=9, radius=0.3, depth=3, location=(1.2, 2.1, 3.1))
    peg.hide_set(True)
    boolean(block, "DIFFERENCE", collected(bpy, "Balls", balls))
    boolean(block, "UNION", peg)
    scene = visible(bpy, extraction)
    assert isinstance(scene.geometry, Csg)
    assert (scene.geometry.nodes.kind < 3).sum() == 6
    others, hits = far_apart(scene, evaluated(bpy, block))
    assert others == 0
    assert hits > 0.3


def test_curved_solids_are_approached_fourfold(bpy: Any, extraction: Any) -> None:
    """A ball of which a cylinder is taken away, by two tessellations of the witness."""
    distances = []
    for segments in (32, 64):
        for obj in list(bpy.data.objects):
            bpy.data.objects.remove(obj)
        ball = add(bpy, "uv_sphere", "Ball", segments=segments, ring_count=segments // 2)
        hole = add(bpy, "cylinder", "Hole", vertices=segments, radius=0.5, depth=4)
        hole.hide_set(True)
        boolean(ball, "DIFFERENCE", hole)
        witness = evaluated(bpy, ball)
        ball.accelscope_solid.kind, hole.accelscope_solid.kind = "sphere", "cylinder"
        ball.accelscope_solid.size, hole.accelscope_solid.size = (1, 1, 1), (0.5, 0.5, 2)
        scene = visible(bpy, extraction)
        assert scene.geometry.n_primitives == 2
        rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, RAYS, 5))
        t, other = (BVH.build(each, BVH.Settings()).trace(rays)[0].t for each in (scene, witness))
        both = np.isfinite(t) & np.isfinite(other)
        points = rays.origins[both] + other[both, None] * rays.directions[both]
        # How far hits of the tessellation lie off the ball and the cylinder, the nearer one.
        off = np.minimum(
            np.abs(np.linalg.norm(points, axis=1) - 1),
            np.abs(np.linalg.norm(points[:, :2], axis=1) - 0.5),
        )
        distances.append(off.mean())
    assert distances[0] / distances[1] == pytest.approx(4.0, rel=0.1)


def test_materials_of_operands_are_those_of_their_surfaces(bpy: Any, extraction: Any) -> None:
    cube, cutter = cube_and_cutter(bpy)
    for obj, name in ((cube, "Steel"), (cutter, "Brass")):
        obj.data.materials.append(bpy.data.materials.new(name))
    boolean(cube, "DIFFERENCE", cutter)
    scene = visible(bpy, extraction)
    names = [scene.materials[n].name for n in scene.materials_of(np.arange(24))]
    assert names == ["Steel"] * 12 + ["Brass"] * 12


def test_what_is_no_tree_is_said_and_is_its_mesh(bpy: Any, extraction: Any) -> None:
    cube, cutter = cube_and_cutter(bpy)
    boolean(cube, "DIFFERENCE", cutter)
    bevel = cube.modifiers.new("Round Edges", "BEVEL")
    scene = visible(bpy, extraction)
    assert isinstance(scene.geometry, Triangles)
    assert any("Cube: the modifier Round Edges stands beside" in note for note in scene.notes)
    bevel.show_viewport = False
    plane = add(bpy, "plane", "Open")
    plane.hide_set(True)
    boolean(cube, "DIFFERENCE", plane)
    (note,) = visible(bpy, extraction).notes
    assert note.startswith("Cube: the mesh of Open is open: 4 of its 4 edges have")


def test_wires_that_are_operands_are_no_objects(bpy: Any, extraction: Any) -> None:
    cube, cutter = cube_and_cutter(bpy)
    boolean(cube, "DIFFERENCE", cutter)
    cutter.hide_set(False)
    assert visible(bpy, extraction).object_names == ("Cube", "Cutter")
    cutter.display_type = "WIRE"
    assert visible(bpy, extraction).object_names == ("Cube",)


def test_a_moved_operand_makes_the_build_out_of_date(bpy: Any, extraction: Any) -> None:
    from accelscope.addon.from_blender.snapshot import Taken

    cube, cutter = cube_and_cutter(bpy)
    boolean(cube, "DIFFERENCE", cutter)
    layer = bpy.context.view_layer
    look = Taken.at(bpy.context, extraction.VISIBLE).look

    def change() -> str:
        depsgraph = bpy.context.evaluated_depsgraph_get()
        look.note_updates(depsgraph)
        look.note_everything()
        assert look.compare(depsgraph)
        return look.change_in(layer)

    assert change() == ""
    cutter.location.x += 0.25
    assert change() == "the geometry of Cube has changed"
    cutter.location.x -= 0.25
    assert change() == ""


@pytest.mark.parametrize(
    "name", ["csg_classic", "csg_rook", "csg_plate:holes=3", "csg_chain:size=9"]
)
def test_samples_come_back_as_they_were_made(bpy: Any, extraction: Any, name: str) -> None:
    """Objects, modifiers and what they stand for: the same tree, but for float32 matrices."""
    from accelscope.addon.to_blender.sample_objects import add_scene
    from accelscope.sample_scenes import make_sample, sample_and_settings

    sample, settings = sample_and_settings(name)
    made = make_sample(name)
    add_scene(bpy.context.scene, made, sample.label, sample.items(settings))
    back = visible(bpy, extraction)
    assert back.notes == ()
    assert len(back) == len(made)
    assert back.geometry.n_primitives == made.geometry.n_primitives
    others, hits = far_apart(made, back, 20_000)
    assert others == 0
    assert hits > 0.1
