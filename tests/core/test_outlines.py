"""Edges and faces of cells: boxes and convex polyhedra."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.contract.cells import Cells, Polygons
from accelscope.core.contract.outlines import faces_of, outlines_of, triangles_of, wires_of
from accelscope.core.geometry.box_shape import SIDES, corners_of, surface_area
from accelscope.core.geometry.marks import arrows, stars


def polygons(lists, owners):
    """Return lists of points as polygons."""
    offsets = np.concatenate([[0], np.cumsum([len(points) for points in lists])])
    return Polygons(np.concatenate(lists), offsets, np.asarray(owners))


def cut(faces, normal, distance):
    """Return the part of a polyhedron with normal . p <= distance, and the cut as its last face."""
    kept, rim = [], []
    for face in faces:
        side = face @ normal - distance
        points = []
        for i in range(len(face)):
            a, b, sa, sb = face[i - 1], face[i], side[i - 1], side[i]
            if (sa < 0) != (sb < 0):
                points.append(a + (b - a) * sa / (sa - sb))
                rim.append(points[-1])
            if sb < 0:
                points.append(b)
        if len(points) > 2:
            kept.append(np.array(points))
    if not rim:
        return kept
    rim = np.array(rim)
    centre = rim.mean(axis=0)
    u = rim[0] - centre
    v = np.cross(normal, u)
    turn = np.argsort(np.arctan2((rim - centre) @ v, (rim - centre) @ u))
    rim = rim[turn]
    # Two faces bring the same corner: one in a million apart is the same.
    apart = np.linalg.norm(rim - np.roll(rim, 1, axis=0), axis=1) > 1e-9
    return [*kept, rim[apart]]


def random_polyhedra(count, seed=0):
    """Return cells, each what random planes leave of a box."""
    rng = np.random.default_rng(seed)
    lists, owners, boxes = [], [], []
    for owner in range(count):
        lower = rng.normal(size=3) * 100
        corners = corners_of(np.array([[*lower, *(lower + rng.uniform(1, 2, 3))]]))[0]
        faces = [corners[side] for side in SIDES]
        centre = corners.mean(axis=0)
        for _ in range(rng.integers(0, 6)):
            normal = rng.normal(size=3)
            normal /= np.linalg.norm(normal)
            faces = cut(faces, normal, centre @ normal + rng.uniform(0.1, 0.6))
        points = np.concatenate(faces)
        lists += faces
        owners += [owner] * len(faces)
        boxes.append(np.concatenate([points.min(axis=0), points.max(axis=0)]))
    n = np.ones(count, dtype=np.int32)
    return Cells.sorted_by_depth(
        np.array(boxes), rng.integers(0, 4, count), n == 1, n, faces=polygons(lists, owners)
    )


def test_a_box_has_twelve_edges_and_its_surface():
    boxes = np.array([[0, 0, 0, 1, 2, 3], [5, 5, 5, 6, 6, 7.0]])
    ones = np.ones(2, dtype=np.int32)
    cells = Cells.sorted_by_depth(boxes, ones, ones == 1, ones)
    wires = wires_of(cells, np.arange(2))
    lengths = np.linalg.norm(np.diff(wires.segments(), axis=1)[:, 0], axis=1)
    assert sorted(lengths[:12].tolist()) == [1.0] * 4 + [2.0] * 4 + [3.0] * 4
    assert wires.edge_owners().tolist() == [0] * 12 + [1] * 12
    triangles, owners = faces_of(cells, np.arange(2))
    np.testing.assert_allclose(
        np.bincount(owners, areas(triangles)), surface_area(boxes), rtol=1e-12
    )
    only = wires_of(cells, np.array([1]))
    np.testing.assert_array_equal(only.segments(), wires.segments()[12:])
    assert (only.owners == 1).all()


def areas(triangles):
    edges = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)


@pytest.mark.parametrize("seed", range(3))
def test_polyhedra_have_every_edge_once(seed):
    cells = random_polyhedra(50, seed)
    wires = wires_of(cells, np.arange(len(cells)))
    corners = np.bincount(wires.owners, minlength=50)
    edges = np.bincount(wires.edge_owners(), minlength=50)
    faces = np.bincount(cells.faces.owners, minlength=50)
    assert (corners - edges + faces == 2).all()  # Euler
    sides = np.bincount(np.repeat(cells.faces.owners, np.diff(cells.faces.offsets)), minlength=50)
    assert (sides == 2 * edges).all()
    assert (np.diff(wires.edge_owners()) >= 0).all()
    assert (wires.owners[wires.edges[:, 0]] == wires.owners[wires.edges[:, 1]]).all()


def test_a_part_of_the_polyhedra():
    cells = random_polyhedra(30)
    every = wires_of(cells, np.arange(30))
    places = np.array([3, 4, 17, 29])
    some = wires_of(cells, places)
    expected = every.segments()[np.isin(every.edge_owners(), places)]
    np.testing.assert_array_equal(some.segments(), expected)
    triangles, owners = faces_of(cells, places)
    assert set(owners) == set(places.tolist())
    assert len(wires_of(cells, places[:0]).edges) == len(faces_of(cells, places[:0])[0]) == 0
    assert len(triangles) == len(owners)


def test_polygons_as_triangles_keep_their_area():
    corners = np.arange(3, 9)
    lists, owners = [], []
    for place, n in enumerate(corners):
        turn = 2 * np.pi * np.arange(n) / n
        lists.append(np.stack([np.cos(turn), np.sin(turn), 0 * turn + place], axis=1))
        owners.append(10 + place)
    triangles, of = triangles_of(polygons(lists, owners))
    expected = 0.5 * corners * np.sin(2 * np.pi / corners)
    np.testing.assert_allclose(np.bincount(of, areas(triangles))[10:], expected, rtol=1e-12)
    outlines = outlines_of(polygons(lists, owners))
    np.testing.assert_array_equal(np.bincount(outlines.edge_owners())[10:], corners)
    sides = np.linalg.norm(np.diff(outlines.segments(), axis=1)[:, 0], axis=1)
    np.testing.assert_allclose(sides, np.repeat(2 * np.sin(np.pi / corners), corners), rtol=1e-12)


def test_marks():
    points = np.array([[1.0, 2, 3], [4, 5, 6]])
    star = stars(points, np.array([0.5, 2.0]))
    np.testing.assert_allclose(star.mean(axis=1), np.repeat(points, 3, axis=0))
    lengths = np.linalg.norm(star[:, 1] - star[:, 0], axis=1)
    np.testing.assert_allclose(lengths, [0.5] * 3 + [2.0] * 3)

    segments = np.array(
        [[[0, 0, 0], [0, 0, 2.0]], [[1, 1, 1], [4, 5, 1.0]], [[3, 3, 3], [3, 3, 3]]]
    )
    drawn = arrows(segments).reshape(5, 3, 2, 3)
    np.testing.assert_array_equal(drawn[0], segments)
    assert np.isfinite(drawn).all()
    length = np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1)
    for head in drawn[1:]:
        np.testing.assert_array_equal(head[:, 0], segments[:, 1])
        np.testing.assert_allclose(
            np.linalg.norm(head[:, 1] - head[:, 0], axis=1), 0.13 * length, atol=1e-12
        )
