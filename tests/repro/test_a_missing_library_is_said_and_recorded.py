"""What a linked library should have brought and did not is said by name, and is in the record."""

import pytest

ARGUMENTS = ("--structure", "bvh", "--rays", "random_lines:count=10", "--json", "-")
SAID = "the linked library //lib.blend cannot be read, so that these are left out: Object libtri"


def test_the_file_is_measured_and_the_library_named(bpy, cases, run):
    outcome = run("evaluate", cases / "missing_library.blend", *ARGUMENTS)
    assert outcome.code == 0
    assert f"accelscope: missing_library: {SAID}\n" in outcome.err
    (record,) = outcome.records
    assert record["scene"]["triangles"] == 1
    assert record["scene"]["notes"] == [SAID]


def test_build_in_blender_says_it(bpy, cases, current):
    bpy.ops.wm.open_mainfile(filepath=str(cases / "missing_library.blend"))
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert current.notes() == (SAID,)
    assert current.record["scene"]["notes"] == [SAID]
    bpy.ops.accelscope.trace()
    assert current.record["scene"]["notes"] == [SAID]


@pytest.fixture
def library(bpy, tmp_path):
    """A file with many objects, a second that links them and has one of its own, linked in turn."""
    names = [f"Part {n}" for n in range(8)]
    for name in names:
        bpy.ops.mesh.primitive_cube_add()
        bpy.context.object.name = name
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "parts.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "parts.blend"), link=True) as (_, taken):
        taken.objects = names
    group = bpy.data.collections.new("Group")
    for obj in taken.objects:
        group.objects.link(obj)
    bpy.context.scene.collection.children.link(group)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "group.blend"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with bpy.data.libraries.load(str(tmp_path / "group.blend"), link=True) as (_, taken):
        taken.collections = ["Group"]
    bpy.context.scene.collection.children.link(taken.collections[0])
    bpy.ops.mesh.primitive_plane_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    return tmp_path


def notes_of(run, folder):
    outcome = run("evaluate", folder / "scene.blend", *ARGUMENTS)
    assert outcome.code == 0
    (record,) = outcome.records
    for note in record["scene"]["notes"]:
        assert note in outcome.err
    return record["scene"]["triangles"], record["scene"]["notes"]


def test_with_all_libraries_there_is_nothing_to_say(library, run):
    assert notes_of(run, library) == (2 + 8 * 12, [])


def test_a_library_of_a_library_is_named(library, run):
    (library / "parts.blend").unlink()
    triangles, (note,) = notes_of(run, library)
    assert triangles == 2
    assert "parts.blend cannot be read" in note
    assert note.endswith("Object Part 0, Object Part 1, Object Part 2, Object Part 3, "
                         "Object Part 4 and 3 more")  # fmt: skip


def test_what_a_library_lacks_is_named(bpy, library, run):
    bpy.ops.wm.open_mainfile(filepath=str(library / "parts.blend"))
    bpy.data.objects.remove(bpy.data.objects["Part 3"])
    bpy.ops.wm.save_as_mainfile(filepath=str(library / "parts.blend"))
    triangles, (note,) = notes_of(run, library)
    assert triangles == 2 + 7 * 12
    assert "parts.blend lacks what is used: Object Part 3" in note
