"""glTF: what is broken, endless, compressed or elsewhere is refused in a line that names it."""

import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from gltf_builder import TRIANGLE, Builder, refused


@pytest.fixture
def built():
    return Builder()


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
