"""A mesh whose faces name vertices that do not exist is refused before anything follows them."""

import struct
import subprocess
import sys

import numpy as np
import pytest
from accelscope.core.errors import InputError


def test_the_file_is_refused_in_one_line(bpy, cases, run):
    outcome = run(
        "evaluate", cases / "invalid_mesh.blend", "--structure", "bvh", "--rays", "random_lines"
    )
    assert (outcome.code, outcome.out) == (2, "")
    # Blender 4.5 adds a line of its own: the file is of a newer Blender.
    (line,) = [line for line in outcome.err.splitlines() if not line.startswith("Warning: File ")]
    assert line == (
        "accelscope: error: the mesh of bad is invalid: a face names vertex 7 of 3; repair it in "
        "Blender: bpy.data.meshes['bad'].validate() in the Python Console, then Mesh > Clean Up"
    )


def broken_mesh(bpy, corners=(0, 1, 7), starts=(0,)):
    """Make a mesh of three vertices with faces as they are given, and an object of it."""
    mesh = bpy.data.meshes.new("broken")
    mesh.vertices.add(3)
    mesh.vertices.foreach_set("co", [0.0, 0, 0, 1, 0, 0, 0, 1, 0])
    mesh.loops.add(len(corners))
    mesh.loops.foreach_set("vertex_index", np.array(corners, dtype=np.int32))
    mesh.polygons.add(len(starts))
    mesh.polygons.foreach_set("loop_start", np.array(starts, dtype=np.int32))
    return bpy.data.objects.new("Wrong", mesh)


FAULTS = [
    ((0, 1, 7), (0,), "a face names vertex 7 of 3"),
    ((0, 1, 3), (0,), "a face names vertex 3 of 3"),
    ((-5, 1, 2), (0,), "a face names vertex -5 of 3"),
    ((0, 1, 2**30), (0,), "a face names vertex 1073741824 of 3"),
    ((0, 1, 2, 0, 1), (0, 3), "fewer than 3 corners"),
    ((0, 1, 2, 0, 1, 2), (3, 3), "or none of its own"),
]


@pytest.mark.parametrize(("corners", "starts", "fault"), FAULTS)
def test_every_fault_of_the_arrays_is_found(bpy, corners, starts, fault):
    from accelscope.addon.from_blender import extraction

    bpy.context.collection.objects.link(broken_mesh(bpy, corners, starts))
    with pytest.raises(InputError, match="the mesh of Wrong is invalid") as caught:
        extraction.extract(bpy.context, extraction.VISIBLE)
    assert fault in str(caught.value)


def test_every_vertex_may_be_named(bpy):
    from accelscope.addon.from_blender import extraction

    bpy.context.collection.objects.link(broken_mesh(bpy, (2, 1, 0)))
    assert len(extraction.extract(bpy.context, extraction.VISIBLE)) == 1


def test_build_in_blender_reports_it_and_keeps_what_was_built(bpy, current):
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.accelscope.build()
    built = current.built
    bpy.context.collection.objects.link(broken_mesh(bpy))
    with pytest.raises(RuntimeError, match="the mesh of Wrong is invalid"):
        bpy.ops.accelscope.build()
    assert current.built is built


def test_a_hidden_mesh_is_no_affair(bpy):
    from accelscope.addon.from_blender import extraction

    bpy.ops.mesh.primitive_cube_add()
    wrong = broken_mesh(bpy)
    bpy.context.collection.objects.link(wrong)
    wrong.hide_viewport = True
    assert len(extraction.extract(bpy.context, extraction.VISIBLE)) == 12


GOOD, BAD = (struct.pack("<3i", 37, 11, last) for last in (29, 2**30))
"""The only face of a mesh as it stands in a file, and with a vertex that does not exist."""


@pytest.fixture
def damaged(bpy, tmp_path):
    """Save a file whose mesh, under a modifier, is damaged afterwards."""
    mesh = bpy.data.meshes.new("broken")
    mesh.from_pydata(np.random.default_rng(1).random((40, 3)).tolist(), [], [(37, 11, 29)])
    obj = bpy.data.objects.new("Wrong", mesh)
    obj.modifiers.new("Triangulate", "TRIANGULATE")
    bpy.ops.mesh.primitive_cube_add()

    def save(way):
        holder = bpy.context.scene.collection
        if way == "instance":
            inner, outer = bpy.data.collections.new("inner"), bpy.data.collections.new("outer")
            inner.objects.link(obj)
            for name, held, place in (("In", inner, outer), ("Out", outer, holder)):
                empty = bpy.data.objects.new(name, None)
                empty.instance_type, empty.instance_collection = "COLLECTION", held
                place.objects.link(empty)
        else:
            holder.objects.link(obj)
        if way == "operand":
            boolean = bpy.context.object.modifiers.new("Boolean", "BOOLEAN")
            boolean.object = obj
        obj.hide_viewport = way in ("operand", "hidden")
        path = tmp_path / "damaged.blend"
        bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=False)
        content = path.read_bytes()
        assert GOOD in content
        path.write_bytes(content.replace(GOOD, BAD))
        return path

    return save


def evaluated(path):
    """Run a process of its own: a Blender that evaluates such a mesh ends."""
    command = ["evaluate", path, "--structure", "bvh", "--rays", "random_lines:count=10"]
    return subprocess.run(
        [sys.executable, "-m", "accelscope", *command], capture_output=True, text=True
    )


@pytest.mark.parametrize("way", ["object", "instance", "operand"])
def test_modifiers_do_not_run_into_it(damaged, way):
    done = evaluated(damaged(way))
    assert done.returncode == 2
    assert "the mesh of Wrong is invalid: a face names vertex 1073741824 of 40" in done.stderr
    assert "Traceback" not in done.stderr


def test_one_that_is_not_evaluated_is_no_affair(damaged):
    done = evaluated(damaged("hidden"))
    assert done.returncode == 0
    assert "invalid" not in done.stderr
