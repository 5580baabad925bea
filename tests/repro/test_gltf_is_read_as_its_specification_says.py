"""glTF: numbers, modes, poses, instances and references as the specification has them.

Sparse and normalized numbers, fans, instances, morph targets, skins, nodes of cameras and required
extensions were read wrongly without a word.
"""

import base64
import json
import struct
import urllib.parse

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDTHS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}
TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


class Builder:
    """A glTF file in the making: one mesh, numbers in one buffer."""

    def __init__(self):
        self.data = b""
        self.root = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": [],
                     "meshes": [{"primitives": []}], "nodes": [{"mesh": 0}],
                     "scenes": [{"nodes": [0]}], "scene": 0}  # fmt: skip

    def view(self, data, **more):
        self.data += bytes(-len(self.data) % 4)
        self.root["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        )
        self.data += data
        return len(self.root["bufferViews"]) - 1

    def accessor(self, values, dtype="f4", **more):
        array = np.asarray(values, dtype="<" + dtype)
        array = array.reshape(len(array), -1)
        entry = {"bufferView": self.view(array.tobytes()), "componentType": COMPONENTS[dtype],
                 "count": len(array), "type": WIDTHS[array.shape[1]], **more}  # fmt: skip
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def primitive(self, vertices=None, indices=None, *, dtype="u2", position=None, **more):
        position = self.accessor(vertices) if position is None else position
        entry = {"attributes": {"POSITION": position}, **more}
        if indices is not None:
            entry["indices"] = self.accessor(indices, dtype)
        self.root["meshes"][0]["primitives"].append(entry)
        return entry

    def save(self, path, **buffer):
        buffer = buffer or {
            "uri": "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        }
        self.root["buffers"] = [{"byteLength": len(self.data), **buffer}]
        path.write_text(json.dumps(self.root))
        return path

    def load(self, folder):
        return load_mesh_file(self.save(folder / "m.gltf"), "flatten")


@pytest.fixture
def built():
    return Builder()


def refused(builder, folder):
    with pytest.raises(InputError) as caught:
        builder.load(folder)
    return str(caught.value)


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


# ---------------------------------------------------------------------------------------- broken


def change(*keys, value):
    def apply(root):
        for key in keys[:-1]:
            root = root[key]
        root[keys[-1]] = value

    return apply


@pytest.mark.parametrize(
    ("apply", "words"),
    [
        (change("asset", "version", value="1.0"), "it is of version 1.0 of glTF, only 2.0 is read"),
        (change("accessors", 0, "count", value=4), "accessor 0 ends beyond bufferView 0"),
        (change("accessors", 0, "count", value=10**12), "accessor 0 ends beyond bufferView 0"),
        (change("accessors", 0, "count", value=-1), "the count of accessor 0 is -1"),
        (change("accessors", 0, "count", value="3"), "the count of accessor 0 is '3'"),
        (change("accessors", 0, "byteOffset", value=4), "accessor 0 ends beyond bufferView 0"),
        (change("accessors", 0, "byteOffset", value=-4), "the byteOffset of accessor 0 is -4"),
        (change("accessors", 0, "type", value="VEC2"), "accessor 0 is of type VEC2, not VEC3"),
        (change("accessors", 0, "componentType", value=5), "accessor 0 has the componentType 5"),
        (change("accessors", 0, "bufferView", value=9), "it refers to number 9 of 2 bufferViews"),
        (change("accessors", 0, "bufferView", value=-1), "a number of bufferViews is -1"),
        (change("bufferViews", 0, "byteLength", value=99), "bufferView 0 ends beyond its buffer"),
        (change("bufferViews", 0, "byteStride", value=16), "accessor 0 ends beyond bufferView 0"),
        (change("bufferViews", 1, "byteLength", value=4), "accessor 1 ends beyond bufferView 1"),
        (change("bufferViews", 0, "buffer", value=1), "it refers to number 1 of 1 buffers"),
        (change("meshes", 0, "primitives", 0, "mode", value=7), "mesh 0 has a primitive of mode 7"),
        (change("meshes", 0, "primitives", 0, "indices", value=0), "accessor 0 is of type VEC3"),
        (change("nodes", 0, "mesh", value=-1), "a number of meshes is -1"),
        (change("nodes", 0, "mesh", value=1), "it refers to number 1 of 1 meshes"),
        (change("nodes", 0, "children", value=[0]), "node 0 is in the tree of the scene twice"),
        (change("nodes", 0, "children", value=[5]), "it refers to number 5 of 1 nodes"),
        (change("nodes", 0, "rotation", value=[0, 0, 1]), "the rotation of node 0 is not 4"),
        (change("nodes", 0, "matrix", value=[1]), "the matrix of node 0 is not 16 numbers"),
        (change("nodes", 0, "skin", value=0), "it refers to number 0 of 0 skins"),
        (change("scenes", 0, "nodes", value=[0, 0]), "node 0 is in the tree of the scene twice"),
        (change("scene", value=3), "it refers to number 3 of 1 scenes"),
        (change("nodes", value=5), "not as glTF wants it"),
        (change("meshes", value={"a": 1}), "its 'meshes' are no list"),
        (change("meshes", 0, "primitives", value=None), "not as glTF wants it"),
    ],
)
def test_what_is_broken_is_refused_by_name(built, tmp_path, apply, words):
    built.primitive(TRIANGLE, [0, 1, 2])
    apply(built.root)
    message = refused(built, tmp_path)
    assert words in message
    assert "m.gltf" in message


def test_indices_that_no_vertex_has(built, tmp_path):
    built.primitive(TRIANGLE, [0, 1, 3])
    assert "primitive 0 of mesh 0 names vertex 3 of 3" in refused(built, tmp_path)


def test_corners_left_over(built, tmp_path):
    built.primitive(TRIANGLE, [0, 1, 2, 0])
    assert "has 4 corners, no multiple of three" in refused(built, tmp_path)


def test_zeros_without_end_are_refused_before_they_are_made(built, tmp_path):
    built.root["accessors"] = [{"componentType": 5126, "count": 10**12, "type": "VEC3"}]
    built.primitive(position=0)
    assert "of memory" in refused(built, tmp_path)


@pytest.fixture
def little_memory(monkeypatch):
    """A machine with 100 MiB."""
    monkeypatch.setattr("accelscope.core.memory.available_bytes", lambda: 100 << 20)


def test_zeros_that_fit_but_once(little_memory, built, tmp_path):
    """They are turned into other numbers, and those into vertices."""
    built.root["accessors"] = [{"componentType": 5126, "count": 3_000_000, "type": "VEC3"}]
    built.primitive(position=0)
    assert "of memory" in refused(built, tmp_path)


@pytest.mark.parametrize("times", ["primitives", "weights", "instances"])
def test_a_few_lines_that_name_the_same_numbers_again_and_again(
    little_memory, built, tmp_path, times
):
    """A file of a hundred kilobytes, and gigabytes that nobody has announced."""
    vertices = np.zeros((30_000, 3))
    vertices[:3] = TRIANGLE
    position, first = built.accessor(vertices), built.accessor([0, 1, 2], "u1")
    for _ in range(1000 if times == "primitives" else 1):
        built.primitive(position=position)["indices"] = first
    if times == "weights":
        built.root["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": position}]
        built.root["nodes"] = [{"mesh": 0, "weights": [0.001 * k]} for k in range(1000)]
        built.root["scenes"][0]["nodes"] = list(range(1000))
    if times == "instances":
        built.root["meshes"][0]["primitives"][0]["indices"] = len(built.root["accessors"])
        built.root["accessors"].append({"componentType": 5121, "count": 0, "type": "SCALAR"})
        attributes = {"TRANSLATION": position}
        instancing = {"EXT_mesh_gpu_instancing": {"attributes": attributes}}
        built.root["nodes"] = [{"mesh": 0, "extensions": instancing} for _ in range(100)]
        built.root["scenes"][0]["nodes"] = list(range(100))
    what = "instances at its nodes" if times == "instances" else "shapes of its nodes"
    assert f"the {what} needs" in refused(built, tmp_path)


@pytest.mark.parametrize("uri", ["/etc/hostname", "%2Fetc/hostname", r"\\machine\folder\file",
                                 "C:/file"])  # fmt: skip
def test_numbers_from_anywhere_else(built, tmp_path, uri):
    built.primitive(TRIANGLE)
    path = built.save(tmp_path / "m.gltf", uri=uri)
    with pytest.raises(InputError, match="is not beside it; only files are read"):
        load_mesh_file(path)


def test_halves_of_letters_in_names(built, tmp_path, run):
    """JSON can have them, CSV and pages cannot."""
    built.primitive(TRIANGLE)
    built.root["extensionsUsed"] = ["ACME_\ud800"]
    path = built.save(tmp_path / "m.gltf")
    outcome = run("evaluate", path, "--structure", "naive", "--rays", "random_lines:count=5",
                  "--csv", tmp_path / "a.csv", "--json", tmp_path / "a.json",
                  "--pictures", tmp_path / "p", "--quiet")  # fmt: skip
    assert (outcome.code, outcome.err) == (0, "")
    assert "the extensions ACME_\N{REPLACEMENT CHARACTER} say" in (tmp_path / "a.csv").read_text()
    (record,) = json.loads((tmp_path / "a.json").read_text())["records"]
    assert record["scene"]["notes"] == ["not read: what the extensions ACME_\ud800 say"]


@pytest.mark.parametrize("depth", [900, 980, 990, 5000, 100_000])
def test_lists_in_lists(built, tmp_path, depth):
    """Just as deep as can be read may be deeper than can be told of."""
    built.primitive(TRIANGLE)
    path = built.save(tmp_path / "m.gltf")
    text = path.read_text().replace('"2.0"', "[" * depth + "]" * depth)
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert len(str(caught.value)) < 400


def test_compressed_numbers_are_refused_where_there_is_nothing_else(built, tmp_path):
    primitive = built.primitive(TRIANGLE)
    primitive["extensions"] = {"KHR_draco_mesh_compression": {"bufferView": 0}}
    assert built.load(tmp_path).triangles.tolist() == [TRIANGLE]
    del built.root["accessors"][0]["bufferView"]
    assert "compressed with KHR_draco_mesh_compression" in refused(built, tmp_path)
    other = Builder()
    other.primitive(TRIANGLE)
    meshopt = {"EXT_meshopt_compression": {"buffer": 1}}
    other.root["bufferViews"][0]["extensions"] = meshopt
    assert other.load(tmp_path).triangles.tolist() == [TRIANGLE]
    other.save(tmp_path / "m.gltf")
    other.root["buffers"][0] = {"byteLength": 36, "extensions": {"EXT_meshopt_compression":
                                                                 {"fallback": True}}}  # fmt: skip
    (tmp_path / "m.gltf").write_text(json.dumps(other.root))
    with pytest.raises(InputError, match="compressed with EXT_meshopt_compression"):
        load_mesh_file(tmp_path / "m.gltf")
