"""Sections of cells: what a plane cuts of leaves fills what it cuts of the root, once."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import section
from accelscope.core.lessons.lesson import build
from accelscope.core.lessons.section import Plane, contour, section_of, sideways, walls_in
from accelscope.sample_scenes import make_sample

SPECS = "grid:resolution=5x6x7", "octree", "kdtree", "bsp:max_depth=8"


def area_of(triangles):
    edges = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum()


def planes(scene):
    centre = 0.5 * (scene.lower + scene.upper)
    oblique = Plane.through_ray(centre, np.array([1.0, 2.0, -0.5]))
    tilted = Plane(centre, np.array([1.0, 2.0, 2.0]) / 3.0)
    return Plane.across(scene, 0.31), oblique, tilted


@pytest.mark.parametrize("spec", SPECS)
def test_leaves_fill_the_section_of_the_root(spec):
    scene = make_sample("suzanne:subdivisions=0")
    structure = build(scene, spec)
    cells = structure.cells().own()
    leaves = np.flatnonzero(cells.is_leaf)
    around = structure.arrays.box[0] if spec.startswith("grid") else cells.boxes[0]
    size = around[3:] - around[:3]
    for plane in planes(scene):
        cut = section_of(cells, leaves, plane)
        assert cut.left_out == 0
        assert np.abs(plane.above(cut.segments)).max() <= 1e-12 * size.max()
        white = np.ones((len(cells), 4))
        # The root's section, by cutting its box.
        root = section_of(one_cell(around), np.array([0]), plane)
        whole = area_of(root.faces(np.ones((1, 4))).triangles)
        assert area_of(cut.faces(white).triangles) == pytest.approx(whole, rel=1e-9)
    across = area_of(section_of(cells, leaves, planes(scene)[0]).faces(white).triangles)
    assert across == pytest.approx(size[0] * size[2], rel=1e-9)


def one_cell(box):
    from accelscope.core.contract.cells import Cells

    zero = np.zeros(1, np.int32)
    return Cells(box[None], zero, zero, np.ones(1, bool), zero)


def test_the_largest_cells_are_kept(monkeypatch):
    monkeypatch.setattr(section, "MOST_SIDES", 80)
    scene = make_sample("suzanne:subdivisions=0")
    cells = build(scene, "octree").cells()
    leaves = np.flatnonzero(cells.is_leaf)
    plane = Plane.across(scene, 0.5)
    cut = section_of(cells, leaves, plane, 2)
    monkeypatch.undo()
    everything = section_of(cells, leaves, plane)
    kept, all_cut = np.unique(cut.owners), np.unique(everything.owners)
    assert len(kept) == 10
    assert cut.left_out == len(all_cut) - 10
    left = np.setdiff1d(all_cut, kept)
    assert cells.depth[kept].max() <= cells.depth[left].min()


def test_the_contour_lies_in_plane_and_surface():
    """A cube's contour is a square, whose length is known."""
    corners = np.array([[0, 0], [4, 0], [4, 4], [0, 4]], float)
    walls = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        for y in range(20):  # in strips, so that there are more than a few triangles
            low, high = 0.2 * y, 0.2 * (y + 1)
            p, q = np.array([a[0], low, a[1]]), np.array([b[0], low, b[1]])
            r, s = np.array([b[0], high, b[1]]), np.array([a[0], high, a[1]])
            walls += [(p, q, r), (p, r, s)]
    from accelscope.core.scene import Scene

    scene = Scene.from_triangles(np.array(walls), "tube")
    lines = contour(scene, Plane.across(scene, 0.37))
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1).sum() == pytest.approx(16.0)
    np.testing.assert_allclose(lines[..., 1], 0.37 * 4.0)


def test_walls_are_cut_where_they_stand():
    box = np.array([0.0, 0, 0, 1, 2, 3])
    plane = Plane.through_ray(np.array([0.0, 0.5, 1.0]), np.array([1.0, 1.0, 0.2]))
    x = np.array([0.25, 0.5])
    lines = walls_in(box, 0, x, plane)
    np.testing.assert_allclose(lines[:, :, 0], np.repeat(x[:, None], 2, axis=1))
    np.testing.assert_allclose(lines[:, :, 1], lines[:, :, 0] + 0.5)
    assert sideways(plane, np.array([-1.0, -1.0, 0.0])) @ np.array([1.0, 1.0, 0.0]) < 0.0
