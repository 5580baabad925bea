"""Faces of k-DOPs and BSP cells far from the origin: no more corners than there is room for."""

import numpy as np
import pytest
from accelscope.core.geometry import half_spaces

TEXT = "volume=kdop26,arity=4,optimise=reinsert,max_leaf_size=20,C_trav=10"


def test_the_case_is_drawn(cases, run, tmp_path):
    outcome = run(
        "evaluate", cases / "far_cells.off", "--structure", f"bvh:{TEXT}", "--rays",
        "random_lines:count=10", "--pictures", tmp_path / "far", "--quiet",
    )  # fmt: skip
    assert outcome.code == 0


@pytest.mark.parametrize("offset", [1e9, 1e12, 1e14])
def test_faces_have_the_most_corners_at_most_and_stay_near(build, lab, offset):
    scene = lab.small_scene("soup")
    far = type(scene).from_triangles(scene.triangles + offset, "far")
    volumes = build("bvh", far, "volume=kdop26,max_leaf_size=1").arrays.volumes
    numbers = np.arange(len(volumes.rows))
    faces = volumes.polygons(numbers)
    assert np.diff(faces.offsets).max() <= half_spaces.most_corners(26)
    owner = np.repeat(faces.owners, np.diff(faces.offsets))
    boxes, room = volumes.boxes()[owner], 1e-13 * offset
    assert (faces.points >= boxes[:, :3] - room).all()
    assert (faces.points <= boxes[:, 3:] + room).all()


def test_a_cut_adds_one_corner_at_most():
    """Whatever the polygon: this one is no more convex than rounding can make it."""
    room = half_spaces.make_room(3)
    zigzag = np.array([[x, 1e-16 * (-1) ** i, 0.0] for i, x in enumerate(np.linspace(0, 1, 6))])
    room.points[0, :6] = zigzag
    cut = getattr(half_spaces.cut_polygon, "py_func", half_spaces.cut_polygon)
    row, count = cut(np.array([0.0, 1.0, 0.0, 0.0]), 0.0, room, 0, 6)
    assert row == 1
    assert count <= 7
