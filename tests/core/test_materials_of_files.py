"""Materials of OBJ and glTF come with the triangles: what the picture's rays need of them."""

import base64
import json
import math
import struct

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.scene.material import MATT, principled

OBJ = """\
mtllib my mirrors.mtl
v 0 0 0
v 1 0 0
v 0 1 0
usemtl silver
f 1 2 3
usemtl bottle
f 1 2 3
f 1 3 2
usemtl there is none
f 1 2 3
"""

MTL = """\
# two of them
newmtl silver
Kd 0.1 0.2 0.3
Ks 0.8 0.4 0
Ns 200
illum 3
newmtl bottle
Kd 0.5
d 0.25
Ni 1.45
illum 9
Ks 0 0 0
newmtl plain
Ks 1 1 1
Kd nothing at all
map_Kd wood.png
illum 2
"""


def names_of(scene):
    return [scene.materials[k].name for k in scene.materials_of(np.arange(len(scene)))]


def test_a_library_says_what_mirrors_and_what_transmits(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    (tmp_path / "my mirrors.mtl").write_text(MTL)
    scene = load_mesh_file(tmp_path / "a.obj")
    assert names_of(scene) == ["silver", "bottle", "bottle", "matt"]
    silver, bottle, rest = scene.materials
    assert (silver.colour, silver.specular, silver.specular_colour) == (
        (0.1, 0.2, 0.3), 0.8, (1.0, 0.5, 0.0)
    )  # fmt: skip
    assert (silver.shine, silver.transmission) == (200.0, 0.0)
    assert (bottle.transmission, bottle.index_of_refraction) == (0.75, 1.45)
    assert (bottle.diffuse, bottle.specular, bottle.colour) == (0.25, 0.0, (0.5, 0.5, 0.5))
    assert rest == MATT
    assert scene.notes == (
        "not read of my mirrors.mtl: map_Kd",
        "not read of my mirrors.mtl: line 15",
    )


def test_without_its_library_a_file_is_read_as_before(tmp_path):
    (tmp_path / "a.obj").write_text(OBJ)
    scene = load_mesh_file(tmp_path / "a.obj")
    assert (scene.materials, scene.notes) == ((), ())
    assert len(scene) == 4


def test_dropped_triangles_take_no_material_with_them(tmp_path):
    lines = OBJ.replace("v 0 1 0", "v 0 1 0\nv nan 0 0").replace(
        "silver\nf 1 2 3", "silver\nf 1 2 4"
    )
    (tmp_path / "a.obj").write_text(lines)
    (tmp_path / "my mirrors.mtl").write_text(MTL)
    scene = load_mesh_file(tmp_path / "a.obj")
    assert scene.dropped == 1
    assert names_of(scene) == ["bottle", "bottle", "matt"]


@pytest.mark.parametrize("line", ["Ns -5", "Ns nan", "Ni 0", "d 7", "Kd -1 2 1e400", "illum 99"])
def test_numbers_beyond_what_can_be_are_limited(tmp_path, line):
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + OBJ.replace("mtllib my mirrors.mtl\n", ""))
    (tmp_path / "a.mtl").write_text(f"newmtl silver\nillum 9\n{line}\n")
    scene = load_mesh_file(tmp_path / "a.obj")
    assert names_of(scene)[0] == "silver"


def gltf(path, materials, of_primitives):
    buffer = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    primitives = [{"attributes": {"POSITION": 0}} | ({} if m is None else {"material": m})
                  for m in of_primitives]  # fmt: skip
    root = {
        "asset": {"version": "2.0"}, "materials": materials, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "name": "n"}], "meshes": [{"primitives": primitives}],
        "buffers": [{"byteLength": len(buffer), "uri": "data:application/octet-stream;base64,"
                     + base64.b64encode(buffer).decode()}],
        "bufferViews": [{"buffer": 0, "byteLength": len(buffer)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
    }  # fmt: skip
    path.write_text(json.dumps(root))
    return load_mesh_file(path)


def test_gltf_materials_are_read(tmp_path):
    scene = gltf(
        tmp_path / "a.gltf",
        [
            {"name": "gold", "pbrMetallicRoughness": {
                "baseColorFactor": [1, 0.5, 0, 1], "roughnessFactor": 0.0}},
            {"name": "glass", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
             "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1},
                            "KHR_materials_ior": {"ior": 1.7}, "KHR_materials_sheen": {}}},
            {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}, "alphaMode": "BLEND"},
        ],
        [1, 0, None, 2],
    )  # fmt: skip
    assert names_of(scene) == ["glass", "gold", "matt", "number 2"]
    glass, gold, _, rough = scene.materials
    assert gold == principled("gold", (1.0, 0.5, 0.0), 1.0, 0.0)
    assert glass == principled("glass", (1.0, 1.0, 1.0), 0.0, 0.0, 1.0, 1.7)
    assert glass.transmission == pytest.approx(1.0 - (0.7 / 2.7) ** 2)
    assert (rough.specular, rough.diffuse) == (0.0, 1.0)
    assert scene.notes == (
        "not read of the material glass: KHR_materials_sheen",
        "not read of the material number 2: baseColorTexture, alphaMode",
    )


@pytest.mark.parametrize("metallic", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("roughness", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("transmission", [0.0, 0.6, 1.0])
def test_no_material_makes_light(metallic, roughness, transmission):
    made = principled("a", (0.2, 0.9, 1.0), metallic, roughness, transmission, 1.5)
    assert made.diffuse + made.specular + made.transmission <= 1.0 + 1e-12
    assert math.isclose(made.diffuse + made.specular + made.transmission, 1.0, abs_tol=1e-12)


@pytest.mark.parametrize("value", [-3.0, 7.0, float("nan"), float("inf")])
def test_materials_of_odd_numbers_are_limited(value):
    principled("a", (value, value, value), value, value, value, value)
