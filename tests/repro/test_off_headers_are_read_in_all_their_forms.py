"""OFF: joined headers, variants, comments, the binary form; ``OFF6 2 0`` was refused."""

import struct

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 5], [1, 0, 5], [0, 1, 5]]
FACES = [[0, 1, 2, 3], [4, 5, 6]]
WANTED = np.array(VERTICES, float)[[[0, 1, 2], [0, 2, 3], [4, 5, 6]]]


def text(header, behind_vertices="", behind_faces=""):
    vertices = [" ".join(map(str, v)) + behind_vertices for v in VERTICES]
    faces = [" ".join(map(str, (len(f), *f))) + behind_faces for f in FACES]
    return "\n".join([header, *vertices, *faces]) + "\n"


def refused(path):
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_the_case(cases):
    assert load_mesh_file(cases / "off_joined.off").triangles[:, 0].tolist() == [
        [0, 0, 0],
        [0, 0, 5],
    ]


@pytest.mark.parametrize(
    "content",
    [
        text("OFF\n7 2 0"),
        text("OFF 7 2 0"),
        text("OFF7 2 0"),
        text("OFF\n7 2"),
        text("7 2 0"),
        text("  OFF  # a comment\n\n# another\n 7\t2 0 # and more"),
        text("# first\nOFF\n7 2 9"),
        text("COFF\n7 2 0", " 0.5 0.5 0.5 1"),
        text("COFF 7 2 0", " 255 0 0"),
        text("NOFF\n7 2 0", " 0 0 1"),
        text("CNOFF\n7 2 0", " 0 0 1 1 0 0 1"),
        text("NCOFF\n7 2 0", " 0 0 1 1 0 0 1"),
        text("STOFF\n7 2 0", " 0.5 0.5"),
        text("STCN4OFF\n7 2 0", " 1 0 0 1 1 1 1 1 0 0"),
        text("4OFF\n7 2 0", " 1"),
        text("nOFF\n3\n7 2 0"),
        text("nOFF 3\n7 2 0"),
        text("OFF\n7 2 0", " # v", " 255 0 0 # f"),
        text("OFF\n7 2 0", "", " 3"),
        text("OFF\n7 2 0\n", "\n\n", "\n \n"),
        text("OFF\n7 2 0").replace("\n", "\r\n"),
        text("OFF\n7 2 0").replace("\n", "\r"),
        text("OFF\n7 2 0 # \xe4"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16"])
def test_text(tmp_path, content, encoding):
    path = tmp_path / "m.off"
    path.write_bytes(content.encode(encoding))
    scene = load_mesh_file(path)
    assert np.array_equal(scene.triangles, WANTED)
    assert scene.notes == ()


def test_four_homogeneous_coordinates(tmp_path):
    path = tmp_path / "m.off"
    path.write_text("4OFF\n3 1 0\n2 4 6 2\n1 0 0 4\n0 -1 0 -0.5\n3 0 1 2\n")
    assert load_mesh_file(path).triangles.tolist() == [[[1, 2, 3], [0.25, 0, 0], [0, 2, 0]]]


@pytest.mark.parametrize("kind", ["", "C", "N", "CN", "STCN", "4", "n"])
def test_binary(tmp_path, kind):
    more = 3 * ("N" in kind) + 4 * ("C" in kind) + 2 * ("ST" in kind) + ("4" in kind)
    data = f"{kind}OFF BINARY\n".encode() + (struct.pack(">i", 3) if kind == "n" else b"")
    data += struct.pack(">3i", len(VERTICES), len(FACES), 0)
    data += b"".join(struct.pack(f">{3 + more}f", *v, *[1.0] * more) for v in VERTICES)
    for n, face in enumerate(FACES):
        colours = [0.5] * (3 * n)
        data += struct.pack(f">{1 + len(face)}i", len(face), *face)
        data += struct.pack(f">i{len(colours)}f", len(colours), *colours)
    path = tmp_path / "m.off"
    path.write_bytes(data)
    assert np.array_equal(load_mesh_file(path).triangles, WANTED)
    path.write_bytes(data[:-1])
    assert "face 2 of 2 is not whole" in refused(path)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (text("OFF\n8 2 0"), "announces 8 vertices and 2 faces, a line each, but has only 9 lines"),
        (text("OFF\n999999999999 2 0"), "announces 999999999999 vertices"),
        (text("OFF\n-7 2 0"), "line 2: a count is '-7', not a whole number"),
        (text("OFF\n7.0 2 0"), "line 2: a count is '7.0', not a whole number"),
        (text("5OFF\n7 2 0"), "does not begin with 'OFF'"),
        (text("nOFF\n4\n7 2 0"), "it has 4 dimensions, not three"),
        (text("OFF\n7 2 0").replace("4 0 1 2 3", "5 0 1 2 3"), "line 10: a face of 5 corners"),
        (text("OFF\n7 2 0").replace("4 0 1 2 3", "-4 0 1 2 3"), "line 10: the number of a face's"),
        (text("OFF\n7 2 0").replace("3 4 5 6", "3 4 5 7"), "face 2 names vertex 7"),
        (text("OFF\n7 2 0").replace("3 4 5 6", "3 4 5 -1"), "face 2 names vertex -1"),
        (text("OFF\n7 2 0").replace("3 4 5 6", "3 4 5.0 6"), "line 11: '5.0' is no whole number"),
        (text("OFF\n7 2 0").replace("1 1 0", "1 1"), "line 5: a vertex has 2 of 3 coordinates"),
        (text("OFF\n7 2 0").replace("1 1 0", "1 a 0"), "line 5: 'a' is no number"),
    ],
)  # fmt: skip
def test_what_is_broken_is_refused_with_its_place(tmp_path, content, words):
    path = tmp_path / "m.off"
    path.write_text(content)
    assert words in refused(path)


def test_lines_too_many_are_said(tmp_path):
    path = tmp_path / "m.off"
    path.write_text(text("OFF\n7 2 0") + "3 0 1 2\n")
    assert load_mesh_file(path).notes == ("not read: 1 line behind the last face",)


def test_binary_counts_may_be_cut_off_anywhere(tmp_path):
    for left in range(12):
        path = tmp_path / "a.off"
        path.write_bytes(b"OFF BINARY\n" + bytes([0, 0, 0, 3] * 3)[:left])
        with pytest.raises(InputError, match="the counts at its beginning are cut off"):
            load_mesh_file(path)
