"""What Blender's own importers make of a file, and its exporters write, is what is read from it.

Triangle k is compared with triangle k, in single precision, as Blender keeps its meshes. Where
Blender differs it is said in what and why: what is mended there fails here.
"""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import READERS, load_mesh_file

ALONG = {"forward_axis": "Y", "up_axis": "Z"}
"""Axes are taken as they stand in the file. Only glTF has an up of its own, which is y."""

WITHOUT_IMPORTER = {".off"}

TURNED = {
    "gltf_fan.gltf": "triangle i of a fan is (i + 1, i + 2, 0) by the specification; Blender "
    "begins with corner 0",
    "ply_tristrips.ply": "every other triangle of a strip is turned round; which corner comes "
    "first then is nowhere said",
}
"""The same triangles in the same order, with another corner first."""

FAULTS = {
    "obj_bom.obj": (
        "a byte order mark makes Blender lose the first vertex, and with it the face",
        0,
    ),
    "stl_cut.stl": ("what ends inside a solid is read up to there, without a word", 2),
}
"""Why Blender reads something else, and how many triangles."""

REFUSED = {
    "stl_cut.stl": "it ends inside the solid that begins in line 10",
    "gltf_unknown_required.gltf": "it requires ACME_geometry_made_of_soup",
}
"""What we refuse, and for what."""

REFUSED_BY_BLENDER = {"gltf_unknown_required.gltf": "ACME_geometry_made_of_soup is not available"}


@pytest.fixture
def importers(bpy):
    """Blender's importers by suffix; that of glTF is an add-on."""
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    return {
        ".obj": lambda path: bpy.ops.wm.obj_import(filepath=str(path), **ALONG),
        ".ply": lambda path: bpy.ops.wm.ply_import(filepath=str(path), **ALONG),
        ".stl": lambda path: bpy.ops.wm.stl_import(filepath=str(path), **ALONG),
        ".gltf": lambda path: bpy.ops.import_scene.gltf(filepath=str(path)),
        ".glb": lambda path: bpy.ops.import_scene.gltf(filepath=str(path)),
    }


@pytest.fixture
def exporters(bpy, importers):
    """Every way in which Blender writes the formats that we read."""
    wm = bpy.ops.wm
    return {
        "obj": lambda path: wm.obj_export(filepath=path, **ALONG),
        "text.ply": lambda path: wm.ply_export(filepath=path, ascii_format=True, **ALONG),
        "binary.ply": lambda path: wm.ply_export(filepath=path, ascii_format=False, **ALONG),
        "text.stl": lambda path: wm.stl_export(filepath=path, ascii_format=True, **ALONG),
        "binary.stl": lambda path: wm.stl_export(filepath=path, ascii_format=False, **ALONG),
        "glb": lambda path: bpy.ops.export_scene.gltf(filepath=path, export_format="GLB"),
        "gltf": lambda path: bpy.ops.export_scene.gltf(
            filepath=path, export_format="GLTF_SEPARATE"
        ),
    }


def triangles_in_blender(bpy):
    """Return the triangles of all objects, (n, 3, 3), as the add-on builds over them."""
    from accelscope.addon.from_blender import extraction

    if not any(len(mesh.polygons) for mesh in bpy.data.meshes if mesh.users):
        return np.zeros((0, 3, 3))
    return extraction.extract(bpy.context, extraction.VISIBLE, "flatten").triangles


def read(path):
    """Return the triangles of a file as Blender places them, with z up."""
    triangles = load_mesh_file(path, "flatten").triangles
    if path.suffix not in (".gltf", ".glb"):
        return triangles
    x, y, z = np.moveaxis(triangles, -1, 0)
    return np.stack([x, -z, y], axis=-1)


def least_corner_first(triangles):
    """Turn every triangle so that its first corner is the least, by x, then y, then z."""
    turned = [
        min(np.roll(triangle, -k, axis=0).tolist() for k in range(3)) for triangle in triangles
    ]
    return np.array(turned)


def assert_same(found, right):
    assert found.shape == right.shape
    np.testing.assert_allclose(found, right, rtol=0.0, atol=1e-6 * np.abs(right).max())


def test_every_case_is_what_blender_imports(bpy, importers, cases):
    paths = [
        path for path in sorted(cases.iterdir()) if path.suffix in READERS.keys() - WITHOUT_IMPORTER
    ]
    names = {path.name for path in paths}
    assert len(names) >= 17
    assert TURNED.keys() | FAULTS.keys() | REFUSED.keys() <= names
    for path in paths:
        for obj in list(bpy.data.objects):
            bpy.data.objects.remove(obj)
        if path.name in REFUSED_BY_BLENDER:
            with pytest.raises(RuntimeError, match=REFUSED_BY_BLENDER[path.name]):
                importers[path.suffix](path)
        else:
            assert importers[path.suffix](path) == {"FINISHED"}, path.name
        if path.name in REFUSED:
            with pytest.raises(InputError, match=REFUSED[path.name]):
                load_mesh_file(path)
        if path.name in FAULTS:
            assert len(triangles_in_blender(bpy)) == FAULTS[path.name][1]
        elif path.name in TURNED:
            ours, theirs = read(path), triangles_in_blender(bpy)
            assert not np.array_equal(ours, theirs)
            assert_same(least_corner_first(ours), least_corner_first(theirs))
        elif path.name not in REFUSED:
            assert_same(read(path), triangles_in_blender(bpy))


def test_a_sample_that_blender_writes_is_read_as_it_was(bpy, exporters, importers, tmp_path):
    bpy.ops.accelscope.add_sample_scene(sample="bunny")
    right = triangles_in_blender(bpy)
    assert len(right) == 3674
    for name, write in exporters.items():
        path = tmp_path / f"bunny.{name}"
        assert write(str(path)) == {"FINISHED"}
        assert_same(read(path), right)
    for path in sorted(tmp_path.glob("bunny*")):
        if path.suffix in importers:
            bpy.data.objects.remove(bpy.data.objects[0])
            assert importers[path.suffix](path) == {"FINISHED"}
            assert_same(triangles_in_blender(bpy), right)


def test_polygons_that_blender_writes_are_cut_as_in_blender(bpy, exporters, tmp_path):
    """Triangles, quads and a polygon of 32 corners, moved, turned and scaled."""
    ops = bpy.ops.mesh
    ops.primitive_monkey_add(location=(1, 2, 3), rotation=(0.3, 0.4, 0.5), scale=(1, 2, 0.5))
    ops.primitive_cylinder_add(vertices=32, location=(5, 0, 0), rotation=(1, 0, 2))
    right = triangles_in_blender(bpy)
    assert len(right) == 968 + 2 * 30 + 2 * 32
    for name, write in exporters.items():
        path = tmp_path / f"polygons.{name}"
        assert write(str(path)) == {"FINISHED"}
        ours = read(path)
        if path.suffix in (".obj", ".ply"):
            assert_same(ours, right)
        else:  # these formats hold triangles, which are Blender's own
            assert len(ours) == len(right)
            np.testing.assert_allclose(areas(ours).sum(), areas(right).sum(), rtol=1e-5)
            assert_same(np.unique(ours.round(4).reshape(-1, 3), axis=0).mean(axis=0),
                        np.unique(right.round(4).reshape(-1, 3), axis=0).mean(axis=0))  # fmt: skip


def areas(triangles):
    sides = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
