"""Counts of thousands of digits, numbers beyond any: one line says where, no traceback."""

import copy
import json

import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

LONG = "9" * 5000
OFF = "OFF\n{0} {1} 0\n0 0 0\n1 0 0\n0 1 0\n{2} 0 1 {3}\n"
PLY = (
    "ply\nformat {4} 1.0\nelement vertex {0}\nproperty float x\nproperty float y\n"
    "property float z\nelement face {1}\nproperty list int int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n{2} 0 1 {3}\n"
)
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 {4}\nf {0} {1} {2}/{3}\n"
TEXTS = {
    "off": (OFF, [3, 1, 3, 2]), "ply": (PLY, [3, 1, 3, 2, "ascii"]), "obj": (OBJ, [1, 2, 3, 1, 0]),
}  # fmt: skip
HOSTILE = [LONG, f"-{LONG}", f"0{LONG}", str(2**63), str(2**64 + 3), str(-(2**63)), "1e999", "nan",
           "1_0", "0x3", "\u0663"]  # fmt: skip


def outcome(path):
    """Return the triangles of a file, or the line that says why there are none."""
    try:
        return load_mesh_file(path).triangles
    except InputError as error:
        line = " ".join(str(error).split())
        assert "int string conversion" not in line
        assert len(line) < 300 + len(str(path)), line
        return line


@pytest.mark.parametrize("suffix", TEXTS)
def test_in_text(tmp_path, suffix):
    text, right = TEXTS[suffix]
    path = tmp_path / f"mesh.{suffix}"
    path.write_text(text.format(*right))
    assert len(outcome(path)) == 1
    for place in range(len(right)):
        for word in HOSTILE:
            words = [word if k == place else right[k] for k in range(len(right))]
            path.write_text(text.format(*words), encoding="utf-8")
            outcome(path)


@pytest.mark.parametrize("suffix", ["off", "ply"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_counts_of_thousands_of_digits_are_named(tmp_path, suffix, place):
    text, right = TEXTS[suffix]
    path = tmp_path / f"mesh.{suffix}"
    path.write_text(text.format(*right[:place], LONG, *right[place + 1 :]))
    assert "'9999999999999999999999999999999999999999...', more than any file can" in outcome(path)


def leaves(part, path=()):
    """Yield the paths to all numbers in a description."""
    if isinstance(part, dict | list):
        for key, value in part.items() if isinstance(part, dict) else enumerate(part):
            yield from leaves(value, (*path, key))
    elif isinstance(part, int | float):
        yield path


def placed(root, path, value):
    """Return a copy of a description with another value at a path."""
    root = copy.deepcopy(root)
    part = root
    for key in path[:-1]:
        part = part[key]
    part[path[-1]] = value
    return root


NUMBERS = [10**400, -(10**400), 2**63, 1e300, float("inf"), float("nan"), 0.5]


@pytest.mark.parametrize("case", ["sparse", "morph", "instancing", "normalized", "fan"])
def test_in_gltf(cases, tmp_path, case):
    root = json.loads((cases / f"gltf_{case}.gltf").read_text())
    root["nodes"][0].setdefault("scale", [1, 1, 1])
    path = tmp_path / "mesh.gltf"
    for place in leaves(root):
        for number in NUMBERS:
            # JSON has no infinity, but 1e999 is read as one.
            path.write_text(json.dumps(placed(root, place, number)).replace("Infinity", "1e999"))
            outcome(path)


@pytest.mark.parametrize(
    ("place", "text", "line"),
    [
        (("nodes", 0, "scale"), "[1, 1e999, 1]", "in the scale of node 0 is inf, no finite number"),
        (("nodes", 0, "scale"), f"[1, 1{'0' * 400}, 1]", "of node 0 is 100000000000"),
        (("nodes", 0, "scale"), f"[1, {LONG}, 1]", "a number of thousands of digits"),
        (("nodes", 0, "mesh"), "9223372036854775808", "more than any file can have"),
        (("accessors", 0, "count"), "1e300", "more than any file can have"),
        (("meshes", 0, "weights"), "[1e999]", "a weight of mesh 0 is inf, no finite number"),
    ],
)
def test_numbers_of_gltf_are_named(cases, tmp_path, place, text, line):
    root = json.loads((cases / "gltf_morph.gltf").read_text())
    path = tmp_path / "mesh.gltf"
    path.write_text(json.dumps(placed(root, place, "HERE")).replace('"HERE"', text))
    assert line in outcome(path)
