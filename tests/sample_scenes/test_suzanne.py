"""Suzanne as Blender subdivides it, and the Catmull-Clark subdivision that does so."""

import itertools
import subprocess
import sys

import numpy as np
import pytest
from accelscope.sample_scenes import make_sample
from accelscope.sample_scenes.catmull_clark import subdivide, triangulate
from mesh_measures import doubled_normals, edge_uses, is_closed, numbered_vertices, volume

# Vertices, faces, lower and upper corner of what Blender 5.2's Subdivision Surface modifier makes
# with "Use Limit Surface" off; Blender keeps float32. Of the 507 vertices of the base mesh, two of
# the eyes lie on two of the head.
BLENDERS_SUZANNE = {
    0: (505, 968, [-1.3671875, -0.8515625, -0.984375], [1.3671875, 0.8515625, 0.984375]),
    1: (2012, 3936, [-1.3369141, -0.8256836, -0.9746094], [1.3369141, 0.8007812, 0.9501953]),
    2: (7958, 15744, [-1.3306841, -0.8228964, -0.9730835], [1.3306841, 0.7838898, 0.9419556]),
    3: (31658, 62976, [-1.3294073, -0.8227298, -0.9721379], [1.3294072, 0.7796717, 0.9399147]),
}


@pytest.mark.parametrize("subdivisions", BLENDERS_SUZANNE)
def test_suzanne_is_as_blender_subdivides_it(subdivisions):
    scene = make_sample(f"suzanne:subdivisions={subdivisions}")
    vertices, triangles, lower, upper = BLENDERS_SUZANNE[subdivisions]
    assert len(scene) == triangles
    assert numbered_vertices(scene.triangles).max() + 1 == vertices
    assert scene.lower == pytest.approx(lower, abs=5e-7)
    assert scene.upper == pytest.approx(upper, abs=5e-7)
    # Four open rims, of the eyes (13 edges each) and of the holes behind them (8 each).
    _, matched = edge_uses(scene.triangles)
    assert np.count_nonzero(~matched) == 42 * 2**subdivisions


BLENDER_SUBDIVIDES = """
import sys
import bpy
import numpy as np

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
monkey = bpy.context.object
meshes = {}
for level in (0, 1, 2):
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.use_limit_surface = level, False
    mesh = monkey.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    points = np.array([vertex.co for vertex in mesh.vertices])
    meshes[f"level{level}"] = points[[tuple(t.vertices) for t in mesh.loop_triangles]]
    monkey.modifiers.clear()
np.savez(sys.argv[1], **meshes)
"""


def places_of(points, others):
    """Return for each of some points which of the others is nearest, (n,)."""
    order = np.argsort(others[:, 0])
    others = others[order]
    # Only those with nearly the same x are looked at.
    first, last = (np.searchsorted(others[:, 0], points[:, 0] + shift) for shift in (-1e-5, 1e-5))
    nearest = [
        low + np.abs(others[low:high] - point).sum(axis=1).argmin()
        for point, low, high in zip(points, first, last, strict=True)
    ]
    return order[nearest]


@pytest.mark.bpy
def test_suzanne_agrees_with_blender_triangle_by_triangle(tmp_path):
    pytest.importorskip("bpy")
    # In a process of its own: Blender's state is one per process.
    file = tmp_path / "suzanne.npz"
    subprocess.run([sys.executable, "-c", BLENDER_SUBDIVIDES, str(file)], check=True)
    with np.load(file) as meshes:
        for level in (0, 1, 2):
            ours = make_sample(f"suzanne:subdivisions={level}").triangles
            theirs = meshes[f"level{level}"]
            assert len(ours) == len(theirs)
            if level == 2:
                # From here on Blender numbers the quads in rows across a face of the base mesh,
                # so that every triangle has to be looked for.
                theirs = theirs[places_of(ours.mean(axis=1), theirs.mean(axis=1))]
                assert len(np.unique(theirs, axis=0)) == len(ours)
                ours, theirs = np.sort(ours, axis=1), np.sort(theirs, axis=1)
            # The same triangles, up to Blender's float32.
            assert np.abs(ours - theirs).max() < 1e-6


CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
CUBE_CORNERS = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])


def test_catmull_clark_of_a_cube():
    points, corners, sizes = subdivide(CUBE, CUBE_CORNERS, np.full(6, 4))
    assert len(points) == 8 + 12 + 6
    assert len(sizes) == 24
    assert np.abs(points[:8]) == pytest.approx(5.0 / 9.0, rel=1e-14)
    assert np.sort(np.abs(points[8:20])) == pytest.approx(np.tile([0.0, 0.75, 0.75], (12, 1)))
    assert np.sort(np.abs(points[20:])) == pytest.approx(np.tile([0.0, 0.0, 1.0], (6, 1)))
    triangles = points[triangulate(points, corners, sizes)]
    assert is_closed(triangles)
    assert (np.einsum("ij,ij->i", triangles.mean(axis=1), doubled_normals(triangles)) > 0).all()


def test_catmull_clark_keeps_a_plane_flat_and_rounds_its_rim():
    points = np.array([(x, y, 2.0) for y in range(4) for x in range(4)], dtype=float)
    quads = [(i, i + 1, i + 5, i + 4) for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
    finer, corners, sizes = subdivide(points, np.array(quads).ravel(), np.full(9, 4))
    assert (finer[:, 2] == 2.0).all()
    # A regular vertex inside stays where it is; a corner goes to 1/8, 3/4, 1/8.
    assert finer[5] == pytest.approx([1.0, 1.0, 2.0], abs=1e-15)
    assert finer[0] == pytest.approx([0.125, 0.125, 2.0], abs=1e-15)
    assert finer[1] == pytest.approx([1.0, 0.0, 2.0], abs=1e-15)
    assert len(corners) == 4 * len(sizes) == 4 * 36


def test_folded_quad_is_cut_along_its_other_diagonal():
    arrow = np.array([(0, 0, 0), (2, -1, 0), (0.5, 0, 0), (2, 1, 0)], dtype=float)
    assert triangulate(arrow, np.arange(4), np.array([4])).tolist() == [[0, 1, 2], [0, 2, 3]]
    # Started at the next corner, the fan's diagonal would run outside of the arrow.
    turned = np.array([1, 2, 3, 0])
    assert triangulate(arrow, turned, np.array([4])).tolist() == [[1, 2, 0], [2, 3, 0]]


def test_catmull_clark_takes_any_polygons():
    # A pyramid: one square and four triangles.
    points = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)], dtype=float)
    corners = np.array([3, 2, 1, 0, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4])
    for expected in (16, 64):
        if expected == 16:
            sizes = np.array([4, 3, 3, 3, 3])
        points, corners, sizes = subdivide(points, corners, sizes)
        assert len(sizes) == expected
        assert is_closed(points[triangulate(points, corners, sizes)])
        assert volume(points[triangulate(points, corners, sizes)]) > 0.0
