"""Instances say of themselves what DXR has beside their matrices: masks, numbers, flags."""

import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.instance_settings import InstanceSettings
from accelscope.core.geometry.instances import Instanced, instanced
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.scene.placing import FLATTEN, KEEP, OBJECTS, Mesh, PlacedMesh, scene_of
from accelscope.core.structures import structure_named

TRIANGLE = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
UNDER = "masks and what else instances say have no effect, for they are flattened"


def at(x, mesh=None, **descriptor):
    """An object of one triangle of its own, or of a mesh that others have, too."""
    own = Mesh(TRIANGLE.vertices.copy(), TRIANGLE.triangles) if mesh is None else mesh
    matrix = np.eye(4)
    matrix[0, 3] = x
    return PlacedMesh(str(x), own, matrix, descriptor=InstanceSettings(**descriptor))


def columns_of(scene):
    geometry = scene.geometry
    return {
        name: getattr(geometry, name).tolist()
        for name in ("masks", "instance_ids", "hit_groups", "flags")
    }


def hit_through(scene, mask):
    """Which of the objects 0, 2, 4, ... along x a ray with a mask hits."""
    count = 5
    starts = np.stack([2.0 * np.arange(count) + 0.25, *np.full((2, count), [[0.25], [9.0]])], 1)
    rays = Rays.from_arrays(starts, np.tile([0.0, 0, -1], (count, 1)), masks=mask)
    kind = structure_named("naive")
    hits, _ = kind.build(scene, kind.Settings()).trace(rays)
    return [2 * k for k in np.flatnonzero(hits.primitive >= 0)]


def test_flags_are_those_of_dxr():
    assert InstanceSettings(cull_disable=True).flags == 1
    assert InstanceSettings(front_ccw=True).flags == 2
    assert InstanceSettings(force_opaque=True).flags == 4
    assert InstanceSettings(force_non_opaque=True).flags == 8
    assert InstanceSettings(front_ccw=True, force_opaque=True).flags == 6


def test_what_objects_say_stands_in_columns():
    objects = [
        at(0, TRIANGLE, mask=1, id=7, hit_group=3, front_ccw=True),
        at(2, TRIANGLE), at(4, TRIANGLE, mask=6, id=2**24 - 1),
    ]  # fmt: skip
    scene = scene_of(objects, KEEP, "three")
    assert columns_of(scene) == {
        "masks": [1, 255, 6], "instance_ids": [7, 0, 2**24 - 1], "hit_groups": [3, 0, 0],
        "flags": [2, 0, 0],
    }  # fmt: skip
    assert hit_through(scene, 255) == [0, 2, 4]
    assert hit_through(scene, 1) == [0, 2]
    assert hit_through(scene, 2) == [2, 4]


def test_one_that_says_something_stands_for_itself():
    """Neighbours in world space that say the same are one mesh, and no others."""
    objects = [at(0), at(2), at(4, mask=1), at(6, mask=1), at(8)]
    scene = scene_of(objects, KEEP, "five")
    assert isinstance(scene.geometry, Instanced)
    assert columns_of(scene)["masks"] == [255, 1, 255]
    assert [len(mesh.ids) for mesh in scene.geometry.meshes] == [2, 2, 1]
    assert hit_through(scene, 2) == [0, 2, 8]
    assert [scene.object_of(primitive)[0] for primitive in range(5)] == ["0", "2", "4", "6", "8"]


def test_every_object_can_be_an_instance():
    objects = [at(0), at(2), at(4, TRIANGLE), at(6, TRIANGLE), at(8)]
    scene = scene_of(objects, OBJECTS, "five")
    assert scene.geometry.which.tolist() == [0, 1, 2, 2, 3]
    assert scene.geometry.matrices[:, 0, 3].tolist() == [0, 2, 4, 6, 8]
    for mesh in scene.geometry.meshes:
        np.testing.assert_array_equal(mesh.corners[0], TRIANGLE.vertices)
    flat = scene_of(objects, FLATTEN, "five")
    np.testing.assert_array_equal(scene.flat().triangles, flat.triangles)
    assert scene.object_names == flat.object_names
    # A matrix that makes a mesh flat leaves it in world space.
    flattened = at(4)._replace(matrix=np.diag([1.0, 1, 0, 1]))
    scene = scene_of([at(0), flattened], OBJECTS, "two")
    np.testing.assert_array_equal(scene.geometry.matrices[1], np.eye(3, 4))


def test_what_is_flattened_says_that_it_hides_nothing():
    scene = scene_of([at(0, mask=0), at(2)], FLATTEN, "two")
    assert scene.notes == (UNDER,)
    assert scene_of([at(0), at(2)], FLATTEN, "two").notes == ()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"mask": 256}, "mask must be at least 0 and at most 255, not 256"),
        ({"id": -1}, "id must be at least 0 and at most .*, not -1"),
        ({"hit_group": 2**24}, "hit_group must be at least 0 and at most"),
        ({"force_opaque": True, "force_non_opaque": True}, "opaque and non-opaque; choose one"),
    ],
)
def test_what_cannot_be_is_refused_by_the_name_of_the_object(wrong, message):
    with pytest.raises(InputError, match=f"4 as an instance.*{message}"):
        scene_of([at(4, **wrong)], KEEP, "one")


@pytest.mark.parametrize(
    ("column", "wrong", "message"),
    [
        ("masks", 256, "mask 256 is not from 0 to 255"),
        ("instance_ids", -1, "instance id -1 is not from 0 to 16777215"),
        ("hit_groups", 2**24, "hit group 16777216 is not"),
        ("flags", 256, "flags 256 is not"),
    ],
)
def test_columns_have_so_many_bits(column, wrong, message):
    mesh = all_triangles(TRIANGLE.vertices[TRIANGLE.triangles])
    with pytest.raises(InputError, match=message):
        instanced([mesh], [0, 0], np.stack([np.eye(3, 4)] * 2), **{column: np.array([0, wrong])})


@pytest.mark.parametrize(
    ("said", "flags"),
    [({"mask": 3, "hit_group": 2, "force_opaque": True}, 4), ({"mask": 3, "hit_group": 2}, 0)],
)
def test_a_node_of_a_gltf_file_says_it_among_its_extras(tmp_path, said, flags):
    path = tmp_path / "one.gltf"
    write_triangle(path, {"accelscope_instance": said, "author": "x"})
    scene = load_mesh_file(path)
    assert columns_of(scene) == {
        "masks": [3], "instance_ids": [0], "hit_groups": [2], "flags": [flags]
    }  # fmt: skip


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ({"mask": 300}, "node 0: accelscope_instance: mask must be at least 0 and at most 255"),
        ({"musk": 3}, "has no setting 'musk'"),
        (3, "its description is not as glTF wants it"),
    ],
)
def test_what_a_node_cannot_say_is_a_broken_file(tmp_path, said, message):
    path = tmp_path / "one.gltf"
    write_triangle(path, {"accelscope_instance": said})
    with pytest.raises(InputError, match=message):
        load_mesh_file(path)


def write_triangle(path, extras):
    import base64

    data = TRIANGLE.vertices.astype("<f4").tobytes()
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    root = {
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "scene": 0,
        "nodes": [{"mesh": 0, "extras": extras}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}],
        "buffers": [{"uri": uri, "byteLength": len(data)}],
    }  # fmt: skip
    path.write_text(json.dumps(root))
