"""STL: text that ends inside a solid is refused, as binary that is cut off; names are any words.

The last solid was left out without a word.
"""

import struct

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file

TRIANGLES = np.arange(18.0).reshape(2, 3, 3) ** 2
FACETS = "".join(
    "facet normal 0 0 nan\nouter loop\n"
    + "".join(f"vertex {x!r} {y!r} {z!r}\n" for x, y, z in triangle)
    + "endloop\nendfacet\n"
    for triangle in TRIANGLES.tolist()
)


def binary(head, count, triangles=TRIANGLES, extra=b""):
    body = b"".join(struct.pack("<12fH", 0, 0, 0, *t.ravel(), 7) for t in triangles)
    return head.ljust(80, b"\0") + struct.pack("<I", count) + body + extra


def refused(path):
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


def test_the_case(cases):
    assert "it ends inside the solid that begins in line 10" in refused(cases / "stl_cut.stl")


def test_text_cut_anywhere_is_refused(tmp_path):
    text = f"solid a\n{FACETS}endsolid a\nsolid b\n{FACETS}endsolid"
    path = tmp_path / "m.stl"
    path.write_text(text)
    assert len(load_mesh_file(path)) == 4
    first_solid = len(f"solid a\n{FACETS}endsolid")
    for length in range(len(text)):
        path.write_text(text[:length])
        # Cut between two solids it is a file of one.
        if not (first_solid <= length <= first_solid + 3):
            refused(path)


@pytest.mark.parametrize(
    "name",
    ["", " a", " two words", " facet normal 0 0 1", " vertex 1 2 3", " endsolid", " T\xfcr", "\ta"],
)
@pytest.mark.parametrize("end", ["endsolid", "endsolid other words", "  ENDSOLID a"])
def test_names_are_any_words(tmp_path, name, end):
    path = tmp_path / "m.stl"
    path.write_bytes(f"solid{name}\n{FACETS}{end}\n".encode("latin-1"))
    scene = load_mesh_file(path)
    assert np.array_equal(scene.triangles, TRIANGLES)
    assert scene.object_names == (" ".join(name.split()) or "m",)


@pytest.mark.parametrize("change", [
    lambda text: text.upper().replace("E+", "e+").replace("NAN", "nan"),
    lambda text: text.replace("\n", "\r\n"),
    lambda text: text.replace("\n", "\r"),
    lambda text: text.replace("\n", "\n\n\t "),
    lambda text: text.replace(" ", "\t  "),
    lambda text: "\ufeff" + text,
    lambda text: "\n\n" + text,
])  # fmt: skip
def test_blanks_and_cases(tmp_path, change):
    path = tmp_path / "m.stl"
    path.write_text(change(f"solid a\n{FACETS}endsolid a\n"), newline="", encoding="utf-8")
    assert np.array_equal(load_mesh_file(path).triangles, TRIANGLES)


def test_several_solids_are_pieces(tmp_path):
    path = tmp_path / "m.stl"
    path.write_text(f"solid a\n{FACETS}endsolid\nsolid e\nendsolid\n\nsolid b\n{FACETS}endsolid b")
    scene = load_mesh_file(path)
    assert np.array_equal(scene.triangles, np.concatenate([TRIANGLES, TRIANGLES]))
    assert [scene.object_names[k] for k in scene.object_ids] == ["a", "a", "b", "b"]


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("vertex 0.0 1.0 4.0", "vertex 0.0 1.0", "line 5: 'vertex' is no number"),
        ("vertex 0.0 1.0 4.0", "vertex 0 1 4 5", "line 4: '5' where 'vertex' has to stand"),
        ("vertex 0.0 1.0 4.0", "vertex 0 1,5 4", "line 4: '1,5' is no number"),
        ("vertex 0.0 1.0 4.0", "vertex 0 1_5 4", "line 4: '1_5' is no number"),
        ("endloop", "vertex 1 1 1\nendloop", "line 7: 'vertex' where 'endloop' has to stand"),
        ("endfacet\nends", "ends", "line 15: the solid ends inside a facet"),
        ("endsolid a", "solid b", "line 16: a solid begins within another"),
        ("endsolid a", "endsolid a\nvertex 1 1 1", "line 17: something stands behind the last"),
        ("solid a\nfacet", "endsolid a\nfacet", "it is neither text"),
    ],
)
def test_broken_text_is_refused_with_its_line(tmp_path, old, new, words):
    path = tmp_path / "m.stl"
    path.write_text(f"solid a\n{FACETS}endsolid a\n".replace(old, new, 1))
    message = refused(path)
    assert words in message or "as binary STL it announces" in message
    if not words.startswith("it is"):
        assert words in message


@pytest.mark.parametrize("head", [b"", b"solid a", b"solid a\nfacet normal 0 0 1\n", b"\xff\xfe"])
def test_binary_is_known_by_its_length(tmp_path, head):
    path = tmp_path / "m.stl"
    path.write_bytes(binary(head, 2))
    assert np.array_equal(load_mesh_file(path).triangles, TRIANGLES)
    path.write_bytes(binary(head, 2, extra=b"more"))
    if head != b"\xff\xfe":  # which begins text of another encoding
        scene = load_mesh_file(path)
        assert np.array_equal(scene.triangles, TRIANGLES)
        assert scene.notes == ("not read: 4 bytes behind the 2 announced triangles",)


@pytest.mark.parametrize("count", [3, 2**32 - 1])
def test_binary_that_announces_more_is_refused(tmp_path, count):
    path = tmp_path / "m.stl"
    path.write_bytes(binary(b"solid", count))
    assert f"announces {count} triangles, but ends after 2" in refused(path)
    path.write_bytes(binary(b"", 2)[:-1])
    assert "announces 2 triangles, but ends after 1" in refused(path)
