"""OBJ: tabs, indentation, marks, comments, continuation lines, odd line ends, mixed faces.

Vertices behind a tab were skipped, and faces of several forms beside each other became others.
"""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file, obj


@pytest.fixture(params=["python", "kernel"], autouse=True)
def reader(request, monkeypatch):
    """Python reads small files, a kernel large ones."""
    monkeypatch.setattr(obj, "LARGE", {"python": np.inf, "kernel": 0}[request.param])


TRIANGLE = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("name", "count", "area"),
    [("obj_tab", 2, 1.0), ("obj_bom", 1, 0.5), ("obj_comment", 1, 0.5), ("obj_mixed_faces", 5, 14)],
)
def test_cases(cases, name, count, area):
    triangles = load_mesh_file(cases / f"{name}.obj").triangles
    sides = triangles[:, 1:] - triangles[:, :1]
    assert len(triangles) == count
    assert 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() == area


PLAIN = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r"),
        PLAIN.replace("\n", "\n\n \t\n"),
        PLAIN.replace(" ", "\t"),
        PLAIN.replace("v", "  \tv"),
        PLAIN.removesuffix("\n"),
        PLAIN.replace("0\n", "0 1.0\n"),
        PLAIN.replace("0\n", "0 0.5 0.25 1\n"),
        PLAIN.replace("0\n", "0# c\n"),
        PLAIN.replace("0\n", "0 # v 9 9 9\n"),
        PLAIN.replace("3\n", "3 # f 3 2 1 \\\n"),
        "# v 9 9 9 \\\n" + PLAIN,
        "# C:\\models\\\n" + PLAIN,
        PLAIN.replace(" ", " \\\n"),
        PLAIN.replace(" ", "\\\n"),
        PLAIN.replace(" ", " \\\r\n \\\r\n\t"),
        PLAIN.replace(" ", " \\ \n"),
        PLAIN + "\\",
        PLAIN.replace("f 1 2 3", "f 1/ 2/ 3/"),
        PLAIN.replace("f 1 2 3", "f 1/7/8 2//9 3/4"),
        PLAIN.replace("f 1 2 3", "fo 1 2 3"),
        PLAIN.replace("f 1 2 3", "f +1 2 003"),
        PLAIN.replace("1", "1.").replace("f 1.", "f 1"),
        PLAIN.replace("1 0 0", "1e0 0E+0 -0"),
        "mtllib M\xfc ller.mtl\no T\xfcr\ng a b\nusemtl Stahl #25\ns off\nlod 1\n" + PLAIN,
        "f 1 2 3\n" + PLAIN.removesuffix("f 1 2 3\n"),
    ],
)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-32"])
def test_one_triangle(tmp_path, text, encoding):
    path = tmp_path / "m.obj"
    path.write_bytes(text.encode(encoding))
    scene = load_mesh_file(path)
    assert scene.triangles.tolist() == [TRIANGLE]
    assert scene.notes == ()
    assert scene.object_names == (("T\xfcr/a b/Stahl #25",) if "T\xfcr" in text else ("m",))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("v 1 0", "line 2: a vertex has 2 of three coordinates"),
        ("v 1 0 #0", "line 2: a vertex has 2 of three coordinates"),
        ("v 1,5 0 0", "line 2: '1,5 0 0' are no numbers"),
        ("v 1_0 0 0", "line 2: '1_0 0 0' are no numbers"),
        ("v x y z", "line 2: 'x y z' are no numbers"),
    ],
)
def test_a_bad_vertex_is_refused_with_its_line(tmp_path, line, words):
    path = tmp_path / "m.obj"
    path.write_text(PLAIN.replace("v 1 0 0", line))
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert words in str(caught.value)


def test_what_is_not_read_is_said_once(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text(
        PLAIN + "l 1 2\nl 2 3\np 1\nvp 0 0\ncstype bspline\ndeg 3\ncurv 0 1 1 2 3\nparm u 0 1\n"
        "end\nsurf 0 1 0 1 1 2\nF 1 2 3\nf 1 2\n"
    )
    scene = load_mesh_file(path)
    assert len(scene) == 1
    assert scene.notes == (
        "not read: 1 statement of points (p), 2 lines (l), 1 curve (curv), 1 free-form surface "
        "(surf)",
        "not read: 1 line with what OBJ does not have: 'F'",
        "1 face has fewer than three corners and no area",
    )


def test_runs_of_objects_groups_and_materials_are_pieces(tmp_path):
    path = tmp_path / "m.obj"
    lines = ["f 1 2 3", "o a", "g a", "f 1 2 3", "usemtl x", "usemtl y", "f 1 2 3", "f 1 2 3"]
    lines += ["usemtl y", "f 1 2 3", "g", "f 1 2 3", "o b", "g", "usemtl", "f 1 2 3", "o c"]
    path.write_text(PLAIN.removesuffix("f 1 2 3\n") + "\n".join(lines))
    scene = load_mesh_file(path)
    assert scene.object_names == ("m", "a", "a/y", "a/y", "b")
    assert scene.object_ids.tolist() == [0, 1, 2, 2, 2, 3, 4]
