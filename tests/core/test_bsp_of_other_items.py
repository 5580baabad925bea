"""BSP trees over polygons, solids and instances: what planes cut, and what they only send on.

That all samples of solids and all instances have the hits of naive is asserted with the other
structures (test_structures_over_samples.py, test_instances.py).
"""

import numpy as np
import pytest
from accelscope.core.geometry.rays import ALL, Rays
from accelscope.core.geometry.shapes import areas_and_lengths, convex_loop, shapes_of
from accelscope.core.geometry.solids.description import Polygon, Sphere
from accelscope.core.scene import Scene
from bsp_trees import TREES, assert_mean, lines

SHELL = 2.0**-42


def test_a_cube_cut_along_its_diagonals_by_polygons(build):
    """One rectangle for each of the six planes makes the 24 tetrahedra that its triangles make."""
    rectangles = [[(x, 0, 0), (1 - x, 1, 0), (1 - x, 1, 1), (x, 0, 1)] for x in (0, 1)]
    turned = [[tuple(np.roll(c, k)) for c in r] for r in rectangles for k in range(3)]
    scene = Scene.from_items([Polygon(corners) for corners in turned], "diagonal planes")
    tree = build("bsp", scene, "planes=autopartition,max_leaf_size=0,padding=0")
    assert tree.validate() == []
    cells, figures = tree.cells(), tree.statistics()
    area = 0.25 + np.sqrt(0.5)
    assert figures.N_V == 24
    assert cells.areas[cells.is_leaf] == pytest.approx(np.full(24, area), rel=1e-9)
    assert cells.extra["volume"][cells.is_leaf] == pytest.approx(np.full(24, 1 / 24), rel=1e-9)
    _, counters = tree.trace(lines(tree, 100_000), ALL)
    assert_mean(counters["N_ETS"], 4 * area)


ARROW = [(-1, -1, 0.5), (1, -1, 0.5), (1, 1, 0.5), (0, -0.5, 0.5), (-1, 1, 0.5)]


def test_a_hollow_polygon_stands_for_its_hull():
    shapes = shapes_of(
        Scene.from_items([Polygon(ARROW), Sphere((0, 0, 3), 1)], "two").items(), SHELL
    )
    assert shapes.is_cut.tolist() == [True, False]
    assert shapes.size[0] == 4
    areas, lengths = areas_and_lengths(shapes)
    assert (areas[0], lengths[0]) == (4.0, 8.0)


def test_the_loop_around_points_has_each_corner_once():
    rng = np.random.default_rng(3)
    inside = rng.random((50, 2)) * 0.9 + 0.05
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    doubled = np.concatenate([inside, square, square, [[0.5, 0.0], [0.0, 0.5]]])
    loop = doubled[convex_loop(doubled)]
    np.testing.assert_array_equal(loop, square)


def bent(count, bend):
    """Squares at random places, each with one corner off its plane."""
    rng = np.random.default_rng(1)
    items = []
    for _ in range(count):
        frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        flat = np.array([[0, 0, 0], [1, 0, 0], [1, 1, bend], [0, 1, 0.0]])
        items.append(Polygon((flat @ frame * 0.3 + rng.random(3)).tolist()))
    return Scene.from_items(items, "bent")


def edge_on(scene, count):
    """Rays nearly in the planes of the squares, aimed at what lies off these."""
    rng = np.random.default_rng(2)
    geometry = scene.geometry
    which = rng.integers(len(scene), size=count)
    corners = geometry.points[geometry.first[which][:, None] + np.arange(4)]
    targets = corners[:, 2] + 10.0 ** rng.uniform(-9, 0, (count, 1)) * (
        corners[:, 0] - corners[:, 2]
    )
    directions = corners[:, 1] - corners[:, 3] + 1e-6 * rng.normal(size=(count, 3))
    return Rays.from_arrays(targets - 2 * directions, directions)


@pytest.mark.parametrize("text", TREES)
def test_bent_polygons_are_not_cut_and_not_missed(build, text):
    scene = bent(60, 5e-7)
    assert not shapes_of(scene.items(), SHELL).is_cut.any()
    assert shapes_of(bent(60, 0.0).items(), SHELL).is_cut.all()
    rays = edge_on(scene, 20_000)
    tree = build("bsp", scene, f"{text},max_leaf_size=1")
    assert tree.validate() == []
    hits, want = tree.trace(rays)[0], build("naive", scene).trace(rays)[0]
    assert (want.primitive >= 0).mean() > 0.5
    np.testing.assert_array_equal(hits.primitive, want.primitive)
    np.testing.assert_array_equal(hits.t, want.t)
