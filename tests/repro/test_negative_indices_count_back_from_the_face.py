"""OBJ: a negative index counts back from the last vertex above its own face.

Every face was given the last vertices of the file, and with normals or mixed signs others still.
"""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import structures


def naive_hits(scene, path):
    arrays = np.load(path)
    naive = structures()["naive"]
    rays = Rays.from_arrays(arrays["origins"], arrays["directions"])
    return naive.build(scene, naive.Settings()).trace(rays)[0]


def test_vertices_and_faces_in_turn(cases):
    scene = load_mesh_file(cases / "obj_negative_blocks.obj")
    hits = naive_hits(scene, cases / "obj_negative_blocks_rays.npz")
    assert hits.t.tolist() == [1.0, 1.5, 1.5]
    assert scene.object_names == ("floor/grey", "ceiling/grey", "right/red")


@pytest.mark.parametrize(
    "face",
    ["-3 -2 -1", "-3// -2// -1//", "-3/-3 -2/-2 -1/-1", "-3//-1 -2//-1 -1//-1", "4 -2 6",
     "-3/1/-1 5//1 -1/-1", "\t-3\t-2 -1 # comment", "-3 \\\n -2 \\\r\n-1"],
)  # fmt: skip
def test_every_form_of_a_corner(tmp_path, face):
    path = tmp_path / "m.obj"
    path.write_text(
        "v 9 9 9\nv 8 8 8\nv 7 7 7\nvt 0 0\nvt 1 0\nvt 0 1\nvn 0 0 1\n"
        f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\nv 6 6 6\nv 5 5 5\nv 4 4 4\n",
        newline="",
    )
    wanted = [[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]
    assert load_mesh_file(path).triangles.tolist() == wanted


@pytest.mark.parametrize(
    ("face", "words"),
    [
        ("-4 -2 -1", "line 4: a face names vertex -4 of 3 above it"),
        ("0 1 2", "line 4: a face names vertex 0 of 4"),
        ("1 2 5", "line 4: a face names vertex 5 of 4"),
        ("1 2 x", "line 4: 'x' is no corner of a face"),
        ("1 2 1_0", "line 4: '1_0' is no corner of a face"),
        ("1 2 3.0", "line 4: '3.0' is no corner of a face"),
        ("1 2 9999999999999999999999", "line 4: "),
    ],
)
def test_a_vertex_that_there_is_not_is_refused_with_its_line(tmp_path, face, words):
    path = tmp_path / "m.obj"
    path.write_text(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {face}\nv 1 1 1\n")
    with pytest.raises(InputError) as caught:
        load_mesh_file(path)
    assert words in str(caught.value)


def test_lines_are_counted_through_continuations(tmp_path):
    path = tmp_path / "m.obj"
    path.write_text("v 0 0 \\\n0\nv 1 0 0\nv 0 \\\n\\\n1 0\nf 1 2 7\n")
    with pytest.raises(InputError, match="line 7: a face names vertex 7 of 3"):
        load_mesh_file(path)
