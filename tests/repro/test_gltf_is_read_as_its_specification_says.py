"""glTF: numbers, modes, poses, instances and references as the specification has them.

Sparse and normalized numbers, fans, instances, morph targets, skins, nodes of cameras and required
extensions were read wrongly without a word.
"""

import json
import struct
import urllib.parse

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from gltf_builder import TRIANGLE, Builder, refused


@pytest.fixture
def built():
    return Builder()


@pytest.mark.parametrize(
    ("name", "count", "upper"),
    [
        ("sparse", 1, (1, 7, 0)), ("fan", 3, (1, 1, 5)), ("normalized", 1, (1, 1, 0)),
        ("instancing", 3, None), ("percent", 1, None), ("morph", 1, (1, 3, 0)),
    ],
)  # fmt: skip
def test_cases(cases, name, count, upper):
    scene = load_mesh_file(cases / f"gltf_{name}.gltf")
    assert len(scene) == count
    assert upper is None or tuple(scene.upper) == upper
    assert scene.notes == ()


def test_a_required_extension_is_refused_by_name(cases, built, tmp_path):
    with pytest.raises(InputError, match="it requires ACME_geometry_made_of_soup, which is not"):
        load_mesh_file(cases / "gltf_unknown_required.gltf")
    built.primitive(TRIANGLE)
    for name in ("KHR_draco_mesh_compression", "EXT_meshopt_compression", "MSFT_lod"):
        built.root["extensionsRequired"] = ["KHR_mesh_quantization", name]
        assert f"it requires {name}, which is not read; export it again, without that" in refused(
            built, tmp_path
        )
    built.root["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]
    assert built.load(tmp_path).triangles.tolist() == [TRIANGLE]


# --------------------------------------------------------------------------------------- numbers


@pytest.mark.parametrize("dtype", ["u1", "i1", "u2", "i2"])
@pytest.mark.parametrize("normalized", [True, False])
def test_quantized_positions(built, tmp_path, dtype, normalized):
    top, bottom = np.iinfo(dtype).max, np.iinfo(dtype).min
    values = np.array([[0, 0, 0], [top, 0, bottom], [0, top // 2, 0]])
    built.primitive(position=built.accessor(values, dtype, normalized=normalized))
    built.root["extensionsRequired"] = ["KHR_mesh_quantization"]
    wanted = np.maximum(values / top, -1.0) if normalized else values
    assert np.array_equal(built.load(tmp_path).triangles, wanted[None])


def test_interleaved_numbers_with_a_stride(built, tmp_path):
    rows = np.zeros(4, [("normal", "<i1", 4), ("position", "<i2", 3), ("pad", "<i2")])
    rows["position"] = [[9, 9, 9], *TRIANGLE]
    view = built.view(rows.tobytes(), byteStride=rows.itemsize)
    built.root["accessors"].append(
        {"bufferView": view, "byteOffset": 4 + rows.itemsize, "componentType": 5122, "count": 3,
         "type": "VEC3"}
    )  # fmt: skip
    built.primitive(position=0)
    assert built.load(tmp_path).triangles.tolist() == [TRIANGLE]


@pytest.mark.parametrize("has_base", [True, False])
def test_sparse_numbers(built, tmp_path, has_base):
    """Without a view the numbers that are not replaced are zero."""
    places = built.view(np.array([2, 3], "<u1").tobytes())
    values = built.view(np.array([[1, 0, 0], [0, 1, 0]], "<f4").tobytes())
    position = built.accessor([[0, 0, 0], [5, 5, 5], [9, 9, 9], [9, 9, 9]])
    built.root["accessors"][position]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": places, "componentType": 5121},
        "values": {"bufferView": values},
    }
    if not has_base:
        del built.root["accessors"][position]["bufferView"]
    built.primitive(position=position, indices=[0, 2, 3, 0, 1, 2])
    second = [0, 0, 0] if not has_base else [5, 5, 5]
    wanted = [TRIANGLE, [[0, 0, 0], second, [1, 0, 0]]]
    assert built.load(tmp_path).triangles.tolist() == wanted


@pytest.mark.parametrize("dtype", ["u1", "u2", "u4"])
@pytest.mark.parametrize(
    ("mode", "wanted"),
    [
        (4, [[0, 2, 1], [3, 4, 0]]),
        (5, [[0, 2, 1], [2, 3, 1], [1, 3, 4], [3, 0, 4]]),
        (6, [[2, 1, 0], [1, 3, 0], [3, 4, 0], [4, 0, 0]]),
    ],
)
def test_modes_in_the_order_of_the_specification(built, tmp_path, dtype, mode, wanted):
    vertices = np.random.default_rng(1).integers(0, 99, (5, 3)).astype(float)
    built.primitive(vertices, [0, 2, 1, 3, 4, 0], dtype=dtype, mode=mode)
    assert np.array_equal(built.load(tmp_path).triangles, vertices[wanted])


def test_points_and_lines_are_said(built, tmp_path):
    for mode in (0, 1, 2, 3, 4):
        built.primitive(TRIANGLE, mode=mode)
    assert built.load(tmp_path).notes == (
        "not read: 1 primitive of points",
        "not read: 3 primitives of lines",
    )


# ------------------------------------------------------------------------------ poses, instances


@pytest.mark.parametrize(("place", "weights"), [("mesh", [0.5, 0.25]), ("node", [0.25, 1])])
def test_weights_of_morph_targets(built, tmp_path, place, weights):
    """A node's weights stand instead of its mesh's."""
    up, side = np.zeros((3, 3)), np.zeros((3, 3))
    up[:, 2], side[1, 0] = 8.0, 4.0
    targets = [{"POSITION": built.accessor(up)}, {"POSITION": built.accessor(side)}]
    built.primitive(TRIANGLE, targets=targets)
    built.root["meshes"][0]["weights"] = [0.5, 0.25]
    if place == "node":
        built.root["nodes"][0]["weights"] = weights
        built.root["nodes"].append({"mesh": 0, "name": "second"})
        built.root["scenes"][0]["nodes"] = [0, 1]
    scene = built.load(tmp_path)
    wanted = np.array(TRIANGLE) + weights[0] * up + weights[1] * side
    assert np.array_equal(scene.triangles[0], wanted)
    if place == "node":
        assert np.array_equal(scene.triangles[1], np.array(TRIANGLE) + 0.5 * up + 0.25 * side)


def test_skins(built, tmp_path):
    """Every vertex moves with its joints, not with its node; joints may be anywhere."""
    inverse = np.tile(np.eye(4), (2, 1, 1))
    inverse[1, :3, 3] = (0, 0, -5)
    matrices = built.accessor(inverse.transpose(0, 2, 1).reshape(2, 16))
    joints = built.accessor([[0, 0, 0, 0], [1, 0, 0, 0], [0, 1, 0, 0]], "u1")
    weights = built.accessor([[255, 0, 0, 0], [255, 0, 0, 0], [51, 204, 0, 0]], "u1",
                             normalized=True)  # fmt: skip
    primitive = built.primitive(TRIANGLE)
    primitive["attributes"] |= {"JOINTS_0": joints, "WEIGHTS_0": weights}
    built.root["skins"] = [{"joints": [1, 2], "inverseBindMatrices": matrices}]
    built.root["nodes"] = [
        {"mesh": 0, "skin": 0, "translation": [100, 100, 100]},
        {"translation": [10, 0, 0], "children": [2]},
        {"translation": [0, 0, 7], "scale": [2, 2, 2]},
    ]
    built.root["scenes"][0]["nodes"] = [0, 1]
    # Joint 0: +(10, 0, 0). Joint 1: 2 (v - (0, 0, 5)) + (10, 0, 7).
    first, second = np.array([10, 1, 0.0]), np.array([10, 2, -3.0])
    wanted = [[10, 0, 0], [12, 0, -3], 0.2 * first + 0.8 * second]
    assert np.allclose(built.load(tmp_path).triangles[0], wanted, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("dtype", ["f4", "i2"])
def test_instances(built, tmp_path, dtype):
    """World = node * translation * rotation * scale of the instance."""
    built.primitive(TRIANGLE)
    quarter = np.array([[0, 0, 0, 1], [0, 0, 0.70710678, 0.70710678], [1, 0, 0, 0]])
    rotation = (
        built.accessor(quarter)
        if dtype == "f4"
        else built.accessor(np.round(quarter * 32767), "i2", normalized=True)
    )
    attributes = {
        "TRANSLATION": built.accessor([[0, 0, 0], [1, 2, 3], [0, 0, 9]]), "ROTATION": rotation,
        "SCALE": built.accessor([[1, 1, 1], [2, 1, 1], [1, -1, 1]]),
    }  # fmt: skip
    built.root["nodes"][0] |= {
        "translation": [0, 0, 100], "name": "n",
        "extensions": {"EXT_mesh_gpu_instancing": {"attributes": attributes}},
    }  # fmt: skip
    built.root["extensionsRequired"] = ["EXT_mesh_gpu_instancing"]
    scene = built.load(tmp_path)
    wanted = [
        [[0, 0, 100], [1, 0, 100], [0, 1, 100]],
        [[1, 2, 103], [1, 4, 103], [0, 2, 103]],
        [[0, 0, 109], [1, 0, 109], [0, 1, 109]],
    ]
    assert np.allclose(scene.triangles, wanted, atol=1e-7)
    assert scene.object_names == ("n/0", "n/1", "n/2")


def test_meshes_at_and_below_nodes_of_cameras_and_lights(built, tmp_path):
    built.primitive(TRIANGLE)
    built.root["cameras"] = [{"type": "perspective", "perspective": {"yfov": 1, "znear": 1}}]
    built.root["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point"}]}}
    built.root["extensionsUsed"] = ["KHR_lights_punctual"]
    light = {"extensions": {"KHR_lights_punctual": {"light": 0}}}
    built.root["nodes"] = [
        {"mesh": 0, "camera": 0, "children": [1]},
        {"translation": [0, 0, 1], "children": [2], **light},
        {"mesh": 0, "translation": [0, 0, 1]},
    ]
    scene = built.load(tmp_path)
    assert scene.triangles[:, 0].tolist() == [[0, 0, 0], [0, 0, 2]]
    assert scene.notes == ("not read: 1 camera and 1 light",)


def test_the_scene_that_is_shown(built, tmp_path):
    built.primitive(TRIANGLE)
    built.root["nodes"] = [{"mesh": 0, "translation": [0, 0, k]} for k in range(4)]
    built.root["scenes"] = [{"nodes": [0]}, {"nodes": [2, 1]}]
    built.root["scene"] = 1
    built.root["animations"] = [{}]
    scene = built.load(tmp_path)
    assert scene.triangles[:, 0, 2].tolist() == [2, 1]
    assert scene.notes == (
        "2 nodes with a mesh are not in the scene that the file shows, or hidden",
        "not read: 1 animation; what they move stands at rest",
    )
    del built.root["scene"]
    assert built.load(tmp_path).triangles[:, 0, 2].tolist() == [0]
    del built.root["scenes"]
    assert built.load(tmp_path).triangles[:, 0, 2].tolist() == [0, 1, 2, 3]


def test_hidden_nodes_and_unknown_optional_extensions(built, tmp_path):
    built.primitive(TRIANGLE)
    hidden = {"extensions": {"KHR_node_visibility": {"visible": False}}}
    built.root["nodes"] = [{"mesh": 0}, {"children": [2], **hidden}, {"mesh": 0}]
    built.root["scenes"] = [{"nodes": [0, 1]}]
    built.root["extensionsUsed"] = ["KHR_node_visibility", "KHR_materials_sheen", "ACME_soup"]
    scene = built.load(tmp_path)
    assert len(scene) == 1
    assert scene.notes == (
        "1 node with a mesh is not in the scene that the file shows, or hidden",
        "not read: what the extensions ACME_soup say",
    )


def test_a_deep_tree(built, tmp_path):
    """Deeper than Python may recurse; each node is one unit above the one before."""
    built.primitive(TRIANGLE)
    built.root["nodes"] = [{"translation": [0, 0, 1], "children": [k + 1]} for k in range(5000)]
    built.root["nodes"].append({"mesh": 0})
    assert built.load(tmp_path).triangles[0, 0].tolist() == [0, 0, 5000]


# ----------------------------------------------------------------------------------------- files


@pytest.mark.parametrize(
    "name", ["my mesh.bin", "M\xfcller.bin", "50%.bin", "a%20b.bin", "#1.bin", "../up/x.bin"]
)
@pytest.mark.parametrize("is_encoded", [True, False])
def test_files_beside_it(built, tmp_path, name, is_encoded):
    built.primitive(TRIANGLE)
    folder = tmp_path / "down"
    folder.mkdir()
    (tmp_path / "up").mkdir()
    (folder / name).write_bytes(built.data)
    uri = urllib.parse.quote(name) if is_encoded else name
    path = built.save(folder / "m.gltf", uri=uri)
    assert load_mesh_file(path).triangles.tolist() == [TRIANGLE]


def test_data_in_the_uri_need_not_be_base64(built, tmp_path):
    built.primitive(TRIANGLE)
    path = built.save(tmp_path / "m.gltf", uri="data:," + urllib.parse.quote(built.data))
    assert load_mesh_file(path).triangles.tolist() == [TRIANGLE]


def glb(root, *chunks, version=2, length=None):
    text = json.dumps(root).encode()
    text += b" " * (-len(text) % 4)
    body = b"".join(struct.pack("<I4s", len(d), k) + d for k, d in [(b"JSON", text), *chunks])
    return struct.pack("<4sII", b"glTF", version, length or 12 + len(body)) + body


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_chunks(built, tmp_path, suffix):
    """Chunks that nobody knows are passed over; what is in the file counts, not its suffix."""
    built.primitive(TRIANGLE)
    built.root["buffers"] = [{"byteLength": len(built.data)}]
    binary = (b"BIN\0", built.data + bytes(-len(built.data) % 4))
    path = tmp_path / f"m.{suffix}"
    path.write_bytes(glb(built.root, (b"what", b"1234"), binary, (b"what", b"")))
    assert load_mesh_file(path).triangles.tolist() == [TRIANGLE]
    for data, words in (
        (glb(built.root, binary)[:-4], "bytes, but ends after"),
        (glb(built.root, binary, version=1), "it is of version 1 of binary glTF, not 2"),
        (glb(built.root, binary, length=60), "a chunk of it is cut off"),
        (glb(built.root), "buffer 0 has no data"),
        (glb(built.root, (b"BIN\0", built.data[:8])), "bufferView 0 ends beyond its buffer"),
    ):
        path.write_bytes(data)
        with pytest.raises(InputError) as caught:
            load_mesh_file(path)
        assert words in str(caught.value)
