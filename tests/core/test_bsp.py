"""The cells of BSP trees: closed convex polyhedra, and what their areas say."""

import itertools

import numpy as np
import pytest
from accelscope.core.contract.events import VISIT_EMPTY, VISIT_INNER, VISIT_LEAF
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.rays import ALL
from accelscope.core.scene import Scene
from accelscope.core.structures.bsp.planes import directions_of
from bsp_trees import TREES, assert_mean, by_number, lines, tree_of, walked

# ------------------------------------------------------------------------------------- the cells


def diagonal_planes():
    """The six planes through opposite edges of the unit cube, one rectangle each."""
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=3)))
    triangles = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for side in ((0, 0), (0, 1)):
            ends = np.array([[side[0], side[1]], [1 - side[0], 1 - side[1]]], dtype=float)
            quad = np.zeros((4, 3))
            quad[:, u], quad[:, v] = ends[[0, 1, 1, 0], 0], ends[[0, 1, 1, 0], 1]
            quad[:, axis] = 0.0, 0.0, 1.0, 1.0
            triangles += [quad[[0, 1, 2]], quad[[0, 2, 3]]]
    assert np.isin(np.unique(np.concatenate(triangles)), corners).all()
    return Scene.from_triangles(np.array(triangles), "diagonal planes")


@pytest.mark.parametrize("candidates", [1, 4, 32])
def test_a_cube_cut_along_its_diagonals(build, candidates):
    """Six planes make 24 equal tetrahedra: over a quarter of a face, with the tip in the middle."""
    scene = diagonal_planes()
    text = f"planes=autopartition,max_leaf_size=0,padding=0,candidates={candidates}"
    tree = build("bsp", scene, text)
    assert tree.validate() == []
    cells, figures = tree.cells(), tree.statistics()
    leaf = cells.is_leaf
    assert figures.N_V == 24
    area = 0.25 + np.sqrt(0.5)
    assert cells.areas[leaf] == pytest.approx(np.full(24, area), rel=1e-9)
    assert cells.extra["volume"][leaf] == pytest.approx(np.full(24, 1 / 24), rel=1e-9)
    assert (cells.extra["faces"][leaf] == 4).all()
    assert figures.expected_leaves == pytest.approx(24 * area / 6, rel=1e-9)
    _, counters = tree.trace(lines(tree, 100_000), ALL)
    assert_mean(counters["N_ETS"], 4 * area)


def test_one_diagonal_cut(build):
    quad = np.array([[1.0, 0, 0], [0, 1, 0], [0, 1, 1], [1, 0, 1]])
    scene = Scene.from_triangles(quad[[[0, 1, 2], [0, 2, 3]]], "diagonal")
    tree = build("bsp", scene, "planes=autopartition,max_leaf_size=0,padding=0")
    cells = tree.cells()
    assert cells.areas == pytest.approx([6, 3 + np.sqrt(2), 3 + np.sqrt(2)], rel=1e-12)
    assert cells.attributes()["area"] is cells.areas
    assert sorted(cells.count) == [0, 0, 2]  # what lies in the plane is on one side
    cut = cells.planes
    assert cut.owners.tolist() == [0]
    assert len(cut.points) == 4
    assert np.allclose(cut.points[:, :2].sum(axis=1), 1)


def test_three_directions_make_boxes(lab, build, scene_name):
    tree = build("bsp", lab.small_scene(scene_name), "planes=fixed,directions=3,max_leaf_size=1")
    cells = tree.cells()
    assert cells.areas == pytest.approx(surface_area(cells.boxes), rel=1e-9)
    volumes = np.prod(cells.boxes[:, 3:] - cells.boxes[:, :3], axis=1)
    assert cells.extra["volume"] == pytest.approx(volumes, rel=1e-9)
    assert (cells.extra["faces"] == 6).all()
    assert tree.statistics().extra["oblique_planes"] == 0


@pytest.mark.parametrize("text", TREES)
def test_cells_are_closed_and_convex(lab, scene_name, text):
    tree = tree_of(lab, scene_name, text)
    assert tree.validate() == []
    cells, grown, shell = tree.cells(), tree.grown, tree.arrays.tree.shell
    points, offsets, owners = cells.faces
    following = np.arange(len(points)) + 1
    following[offsets[1:] - 1] = offsets[:-1]
    middles = 0.5 * (cells.boxes[:, :3] + cells.boxes[:, 3:])
    owner_of = np.repeat(owners, np.diff(offsets))
    p = points - middles[owner_of]
    twice = np.add.reduceat(np.cross(p, p[following]), offsets[:-1])
    # The normals of a closed surface sum up to zero, and the pyramids to its volume.
    around = np.zeros((len(cells), 3))
    np.add.at(around, owners, 0.5 * twice)
    assert (np.abs(around).max(axis=1) < 1e-8 * cells.areas).all()
    np.testing.assert_allclose(
        np.bincount(owners, 0.5 * np.linalg.norm(twice, axis=1)), cells.areas, rtol=1e-9
    )
    assert len(np.unique(owners)) == len(cells)
    # Each cell lies on its side of its parent's plane.
    place = np.empty(len(cells), np.int64)
    place[cells.numbers] = np.arange(len(cells))
    node = cells.numbers[owner_of]
    below_root = node > 0
    above = grown.parent[node]
    height = (grown.planes[above, :3] * points).sum(axis=1) - grown.planes[above, 3]
    height *= np.where(grown.link[above] == node, -1, 1)
    assert (height[below_root] > -2 * shell).all()
    # Polygons that are planes lie in them, and inside the cells.
    cut, cut_offsets, cut_owners = cells.planes
    assert np.array_equal(np.sort(cells.numbers[cut_owners]), np.flatnonzero(grown.link > 0))
    inside = np.repeat(cut_owners, np.diff(cut_offsets))
    number = cells.numbers[inside]
    height = (grown.planes[number, :3] * cut).sum(axis=1) - grown.planes[number, 3]
    assert (np.abs(height) <= 2 * shell).all()
    assert (cut >= cells.boxes[inside, :3] - 2 * shell).all()
    assert (cut <= cells.boxes[inside, 3:] + 2 * shell).all()
    # Made one after the other, parents first.
    order = by_number(cells, cells.extra["order"])
    assert order[0] == 0
    assert (order[1:] > order[grown.parent[1:]]).all()


@pytest.mark.parametrize("text", TREES)
def test_points_of_triangles_are_in_leaves_that_list_them(lab, scene_name, text):
    tree = tree_of(lab, scene_name, text)
    grown, shell = tree.grown, tree.arrays.tree.shell
    rng = np.random.default_rng(1)
    edges = tree.scene.triangles[:, 1:] - tree.scene.triangles[:, :1]
    some_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1) > 0
    which = rng.choice(np.flatnonzero(some_area), size=3000)
    weights = rng.dirichlet([1, 1, 1], size=3000)
    points = (tree.scene.triangles[which] * weights[:, :, None]).sum(axis=1)
    node, near = np.zeros(3000, np.int64), np.zeros(3000, bool)
    while (inner := grown.link[node] > 0).any():
        height = (grown.planes[node, :3] * points).sum(axis=1) - grown.planes[node, 3]
        near |= inner & (np.abs(height) <= 4 * shell)
        node = np.where(inner, grown.link[node] + (height > 0), node)
    leaf = -1 - grown.link[node]
    for i in np.flatnonzero(~near):
        begin, end = grown.offsets[leaf[i] : leaf[i] + 2]
        assert which[i] in grown.references[begin:end]


@pytest.mark.parametrize("count", [3, 7, 9, 13])
def test_fixed_directions(lab, build, count):
    directions = directions_of(count)
    assert directions.shape == (count, 3)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1)
    parallel = np.abs(directions @ directions.T) - np.eye(count)
    assert parallel.max() < 0.99
    tree = build("bsp", lab.small_scene("suzanne"), f"planes=fixed,directions={count}")
    used = tree.grown.planes[tree.grown.link > 0, :3]
    assert (np.abs(used @ directions.T).max(axis=1) > 1 - 1e-12).all()


# ------------------------------------------------------------------------------------ the figures


@pytest.mark.parametrize("text", TREES)
@pytest.mark.parametrize("sample", ["suzanne", "tetra", "soup", "teapot_in_stadium"])
def test_random_lines_visit_what_the_areas_say(lab, sample, text):
    tree = walked(tree_of(lab, sample, text), "recursive")
    figures = tree.statistics()
    assert figures.N_V == figures.N_IN + 1
    _, counters = tree.trace(lines(tree, 100_000), ALL)
    assert_mean(counters["N_TS"], figures.expected_inner + figures.expected_leaves)
    assert_mean(counters["N_ETS"], figures.expected_leaves)
    assert_mean(counters["N_EETS"], figures.extra["expected_empty"])
    assert_mean(counters["N_IT"], figures.expected_tests)


@pytest.mark.parametrize("text", TREES)
def test_each_cell_is_visited_as_its_area_says(lab, text):
    tree = walked(tree_of(lab, "mountain", text), "recursive")
    rays = lines(tree, 2500)
    visits = np.zeros(len(tree.grown.link), np.int64)
    for i in range(len(rays)):
        steps = tree.record(rays, i, ALL)
        np.add.at(
            visits, steps.cell[np.isin(steps.kind, (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY))], 1
        )
    share = tree.grown.area / tree.grown.area[0]
    error = np.sqrt(len(rays) * share * (1 - share))
    likely = len(rays) * share > 25  # where counts are as good as normally distributed
    off = np.abs(visits - len(rays) * share)[likely] / np.maximum(error[likely], 1e-9)
    assert visits[0] == len(rays)
    assert likely.sum() > 20
    assert off[1:].max() < 4


def test_oblique_planes_lower_the_cost(lab, build):
    """What the axes alone can do, all planes together can do better."""
    for sample in ("suzanne", "soup"):
        scene, text = lab.small_scene(sample), "max_leaf_size=2,empty_bonus=0"
        three = build("bsp", scene, f"planes=fixed,directions=3,{text}").statistics()
        every = build("bsp", scene, f"planes=sah,{text}").statistics()
        assert every.extra["oblique_planes"] > 0.1 * every.N_IN
        assert every.sah < three.sah


# ---------------------------------------------------------------------------------------- damage


def test_damage_is_found(lab, build):
    tree = build("bsp", lab.small_scene("soup"), "max_leaf_size=2")
    grown = tree.grown
    ids, counts = np.unique(grown.references, return_counts=True)
    place = int(np.flatnonzero(grown.references == ids[counts > 2][0])[1])
    offsets = grown.offsets.copy()
    offsets[np.searchsorted(offsets, place, side="right") :] -= 1
    references = np.delete(grown.references, place)
    tree.grown = grown._replace(references=references, offsets=offsets)
    tree.with_walk(tree.arrays.tree._replace(references=references, offsets=offsets))
    assert tree.validate() == ["the leaves that list a triangle do not cover it"]
    moved = grown.planes.copy()
    moved[0, 3] += 0.1
    tree.grown = grown._replace(planes=moved)
    tree.with_walk(tree.arrays.tree._replace(offsets=grown.offsets, references=grown.references))
    assert "the leaves do not fill the root" in tree.validate()
    tree.grown = grown._replace(area=1.01 * grown.area)
    assert tree.validate() == [
        "the areas that the builder reckoned with are not those of the cells"
    ]


def test_the_building_is_replayed_in_the_order_of_the_settings(lab, build):
    scene = lab.small_scene("soup")
    for order, level_by_level in (("fifo", True), ("depth_first", False)):
        cells = build("bsp", scene, f"order={order}", log=True).cells()
        depth = cells.depth[np.argsort(cells.extra["order"], kind="stable")]
        assert (np.diff(depth) >= 0).all() == level_by_level
