"""PLY: strips, any bytes in comments, lists among properties in any order, both byte orders.

Strips and comments that are not ASCII were refused.
"""

import itertools
import struct

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5]]
WANTED = np.array(VERTICES, float)[[[0, 1, 2], [0, 2, 3], [4, 5, 6], [0, 3, 4]]]
LETTERS = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I",
           "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint32": "I",
           "float32": "f", "float64": "d"}  # fmt: skip


def header(kind, elements, extra=()):
    lines = ["ply", f"format {kind} 1.0", *extra]
    for name, properties, rows in elements:
        lines += [f"element {name} {len(rows)}", *(f"property {each}" for each in properties)]
    return "\n".join([*lines, "end_header"]) + "\n"


def rows_of(kind, elements):
    """Return the rows of elements (name, properties, rows); in a row a list is a list."""
    out = []
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[kind]
    for _, properties, rows in elements:
        for row in rows:
            words = []
            for prop, value in zip(properties, row, strict=True):
                types = prop.split()[:-1]
                values = [len(value), *value] if types[0] == "list" else [value]
                types = [types[1], *[types[2]] * len(value)] if types[0] == "list" else types
                words += [
                    str(v).encode() if not order else struct.pack(order + LETTERS[t], v)
                    for t, v in zip(types, values, strict=True)
                ]
            out.append(b"".join(words) if order else b" ".join(words) + b"\n")
    return b"".join(out)


def mesh(index="int", length="uchar", name="vertex_indices", position="float", faces=None):
    faces = [[0, 1, 2, 3], [4, 5, 6], [0, 3, 4]] if faces is None else faces
    return [
        ("vertex", [f"{position} {axis}" for axis in "xyz"], VERTICES),
        ("face", [f"list {length} {index} {name}"], [[face] for face in faces]),
    ]


KINDS = ["ascii", "binary_little_endian", "binary_big_endian"]


def written(path, kind, elements, extra=()):
    path.write_bytes(header(kind, elements, extra).encode() + rows_of(kind, elements))
    return path


def refused(path):
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_the_case(cases):
    wanted = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]]
    assert load_mesh_file(cases / "ply_tristrips.ply").triangles.tolist() == wanted


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["vertex_indices", "vertex_index"])
@pytest.mark.parametrize(
    ("index", "length", "position"),
    [("int", "uchar", "float"), ("uint", "int", "double"), ("short", "char", "short"),
     ("uint8", "uint32", "float64"), ("float", "ushort", "float32"), ("int8", "int16", "int8")],
)  # fmt: skip
def test_types(tmp_path, kind, name, index, length, position):
    elements = mesh(index, length, name, position)
    path = written(tmp_path / "m.ply", kind, elements)
    assert np.array_equal(load_mesh_file(path).triangles, WANTED)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("uniform", [True, False])
def test_other_properties_and_elements_stand_anywhere(tmp_path, kind, uniform):
    faces = [[0, 1, 2], [4, 5, 6], [0, 3, 4]] if uniform else [[0, 1, 2, 3], [4, 5, 6], [0, 3, 4]]
    elements = [
        ("camera", ["float x", "list uchar int vertex_indices"], [[1.0, [1, 2]]]),
        ("vertex", ["uchar red", "double z", "list int float weights", "float x", "uchar a",
                    "double y"],
         [[255, z, [0.5] * (0 if uniform else k % 3), x, 7, y]
          for k, (x, y, z) in enumerate(VERTICES)]),
        ("empty", ["int x"], []),
        ("face", ["list uchar float texcoord", "uchar flags", "list uchar int vertex_indices",
                  "double q"],
         [[[0.25] * (6 if uniform else 2 * k), 1, face, 2.5] for k, face in enumerate(faces)]),
        ("edge", ["int vertex1", "int vertex2"], [[0, 1], [1, 2]]),
    ]  # fmt: skip
    path = written(tmp_path / "m.ply", kind, elements)
    scene = load_mesh_file(path)
    wanted = WANTED[[0, 2, 3]] if uniform else WANTED
    assert np.array_equal(scene.triangles, wanted)
    assert scene.notes == ("not read: 2 elements 'edge'",)


@pytest.mark.parametrize("kind", KINDS)
def test_faces_before_vertices_and_strips_beside_faces(tmp_path, kind):
    strips = ("tristrips", ["list int int vertex_indices"], [[[0, 1, 3, 2, -1, 4, 5, 6, -1]]])
    vertex, face = mesh(faces=[[0, 3, 4]])
    path = written(tmp_path / "m.ply", kind, [strips, face, vertex])
    corners = [[0, 1, 3], [1, 2, 3], [4, 5, 6], [0, 3, 4]]
    assert np.array_equal(load_mesh_file(path).triangles, np.array(VERTICES, float)[corners])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("ending", ["\n", "\r\n", "\r"])
def test_line_ends_and_bytes_of_comments(tmp_path, kind, ending):
    """In binary the rows begin right behind the header, whatever their first byte is."""
    elements = mesh(position="char")
    elements[0][2][:1] = [[10, 13, 0]]
    extra = ["comment M\xfcller", "obj_info  x", "comment", "comment element face 9"]
    head = header(kind, elements, extra).replace("\n", ending).encode("latin-1")
    rows = rows_of(kind, elements)
    path = tmp_path / "m.ply"
    path.write_bytes(head + (rows.replace(b"\n", ending.encode()) if kind == "ascii" else rows))
    VERTICES[0] = [0, 0, 0]
    scene = load_mesh_file(path)
    assert scene.triangles[0].tolist() == [[10, 13, 0], [1, 0, 0], [1, 1, 0]]
    assert len(scene) == 4


def test_blank_lines_and_small_faces(tmp_path):
    path = written(tmp_path / "m.ply", "ascii", mesh(faces=[[0, 1, 2], [0, 1], [], [3, 4, 5]]))
    path.write_bytes(path.read_bytes().replace(b"end_header\n", b"end_header\n\n \n"))
    scene = load_mesh_file(path)
    assert len(scene) == 2
    assert scene.notes == ("2 faces have fewer than three corners and no area",)


@pytest.mark.parametrize("kind", KINDS)
def test_cut_anywhere_is_refused(tmp_path, kind):
    path = written(tmp_path / "m.ply", kind, mesh())
    data = path.read_bytes()
    last = len(data) - 1 if kind == "ascii" else len(data)
    # A digit of the last number may be missing without anybody seeing it.
    for length in itertools.chain(range(0, last - 2, 3), [last - 2]):
        path.write_bytes(data[:length])
        refused(path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("vertex 7", "vertex 1000000000000", "announces 1000000000000 times 'vertex', but ends"),
        ("face 3", "face 1000000000000", "announces 1000000000000 times 'face', but ends"),
        ("vertex 7", "vertex -7", "line 3: the count of an element is '-7', not a whole number"),
        ("float z", "float q", "its element 'vertex' has no property z"),
        ("vertex_indices", "corners", "'face' has no list vertex_indices or vertex_index"),
        ("float x", "quad x", "line 4: 'property quad x' is no property"),
        ("list uchar", "list float", "line 8: the length of a list is no float"),
        ("ascii 1.0\n", "utf8 1.0\n", "line 2: no format 'utf8 1.0' is known"),
        ("end_header", "end_of_header", "its header has no 'end_header'"),
        ("ply\n", "plyx\n", "it does not begin with the line 'ply'"),
        ("ply\n", "ply ", "it does not begin with the line 'ply'"),
        ("element face", "element the face", "line 7: 'element the face 3' cannot stand there"),
        ("element face", "element vertex", "has the element 'vertex' 2 times"),
    ],
)
def test_bad_headers_are_refused(tmp_path, kind, old, new, words):
    if "utf8" in new:
        old, new = f"{kind} 1.0\n", new
    path = written(tmp_path / "m.ply", kind, mesh())
    path.write_bytes(path.read_bytes().replace(old.encode(), new.encode(), 1))
    assert words in refused(path)


@pytest.mark.parametrize("kind", KINDS)
def test_bad_indices_are_refused(tmp_path, kind):
    for index in (7, -1):
        path = written(tmp_path / "m.ply", kind, mesh(faces=[[0, 1, 2], [0, index, 1]]))
        assert f"face 2 names vertex {index}, but the 7 vertices count from 0" in refused(path)


def test_bad_rows_of_text_are_refused_with_their_line(tmp_path):
    path = written(tmp_path / "m.ply", "ascii", mesh())
    good = path.read_text()
    for old, new, words in (
        ("1 1 0\n", "1 1\n", "line 12: 'vertex' takes 3 numbers, there are 2"),
        ("1 1 0\n", "1 1 0 0\n", "line 12: 'vertex' takes 3 numbers, there are 4"),
        ("1 1 0\n", "1 a 0\n", "'a' is no number"),
        ("4 0 1 2 3\n", "5 0 1 2 3\n", "line 17: 'face' takes 6 numbers, there are 5"),
        ("4 0 1 2 3\n", "4 0 1 2.0 3\n", "line 17: '2.0' is no whole number"),
        ("4 0 1 2 3\n", "-4 0 1 2 3\n", "line 17: the length of a list is '-4'"),
    ):
        path.write_text(good.replace(old, new))
        assert words in refused(path)


def test_lists_with_negative_lengths_are_refused(tmp_path):
    path = tmp_path / "m.ply"
    elements = mesh(length="char", faces=[[0, 1, 2], [3, 4, 5]])
    rows = bytearray(rows_of("binary_little_endian", elements))
    rows[-13] = 0xFF
    path.write_bytes(header("binary_little_endian", elements).encode() + bytes(rows))
    assert "'face' 2 of 2 is not whole" in refused(path)


def test_a_mark_of_utf_8_is_passed_over(tmp_path):
    path = written(tmp_path / "m.ply", "ascii", mesh())
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert np.array_equal(load_mesh_file(path).triangles, WANTED)


def test_unknown_lines_of_a_header_are_said(tmp_path):
    path = written(tmp_path / "m.ply", "ascii", mesh(), ["Created by hand"])
    assert load_mesh_file(path).notes == ("not read: line 3 of the header, 'Created by hand'",)
