"""The lecture's K B + sum p_i I_i < sum I_i at every node, and the overlap of siblings."""

import numpy as np
import pytest
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh.figures.efficiency import hierarchy_efficiency
from accelscope.core.structures.bvh.figures.overlap import sibling_overlap


def one_by_one(areas, first, size, width, C_trav, C_isect):
    """References, E, gain and expected gain of every node, by recursion as the slide says."""
    found = {}

    def visit(node):
        if width[node] == 0:
            found[node] = size[node], C_isect * size[node], 0.0, 0.0
            return
        children = range(first[node], first[node] + width[node])
        for child in children:
            visit(child)
        p = [areas[i] / areas[node] if areas[node] > 0.0 else 1.0 for i in children]
        count = [found[i][0] for i in children]
        inside = [found[i][1] for i in children]
        objects = [C_isect * each for each in count]
        expected = C_trav + sum(a * b for a, b in zip(p, inside, strict=True))
        left = C_trav + sum(a * b for a, b in zip(p, objects, strict=True))
        found[node] = sum(count), expected, sum(objects) - left, sum(inside) - expected

    visit(0)
    return np.array([found[node] for node in range(len(size))]).T


def test_against_recursion(lab, build, scene_name):
    structure = build("bvh", lab.small_scene(scene_name), "C_trav=1.7,C_isect=0.6,max_leaf_size=2")
    arrays = structure.arrays
    got = structure.efficiency()
    want = one_by_one(
        arrays.volumes.areas(), arrays.first, arrays.size, structure.width(), 1.7, 0.6
    )
    for a, b in zip(got, want, strict=True):
        assert np.allclose(a, b, rtol=1e-12, atol=1e-9)


def test_expected_time_of_the_root_is_the_sah_cost(lab, build, scene_name):
    structure = build("bvh", lab.small_scene(scene_name), "C_trav=3")
    if structure.arrays.volumes.areas()[0] > 0.0:
        assert structure.efficiency().expected[0] == pytest.approx(structure.statistics().sah)
    assert structure.efficiency().references[0] == len(structure.scene)


def test_nodes_of_any_width():
    # A root with three children, one of which has four leaves.
    first = np.array([1, 0, 4, 7, 1, 3, 4, 6])
    first[2] = 4
    size = np.array([0, 1, 0, 2, 2, 1, 2, 1])
    width = np.array([3, 0, 4, 0, 0, 0, 0, 0])
    areas = np.array([10.0, 4.0, 8.0, 1.0, 4.0, 2.0, 6.0, 2.0])
    got = hierarchy_efficiency(areas, first, size, width, 1.2, 1.0)
    want = one_by_one(areas, first, size, width, 1.2, 1.0)
    for a, b in zip(got, want, strict=True):
        assert np.allclose(a, b, rtol=1e-14)
    # By hand, as on the slide: K B = 1.2, p = 0.4, 0.8, 0.1, I = 1, 6, 2 triangles.
    assert got.gain[0] == pytest.approx(9 - (1.2 + 0.4 * 1 + 0.8 * 6 + 0.1 * 2))


def test_dear_volumes_do_not_pay(lab, build):
    scene = lab.small_scene("tetra")
    for cost in ("0", "0.01"):
        cheap = build("bvh", scene, f"C_trav={cost}").statistics()
        assert cheap.extra["nodes_not_paying"] == cheap.extra["nodes_not_paying_expected"] == 0
    # Splits are forced down to four triangles, whatever they cost.
    structure = build("bvh", scene, "C_trav=1e6")
    dear, arrays = structure.statistics(), structure.arrays
    assert dear.extra["nodes_not_paying"] == dear.N_IN > 0
    # Further up a volume saves the dear ones below it.
    inner = np.flatnonzero(arrays.size == 0)
    first = arrays.first[inner]
    lowest = inner[(arrays.size[first] > 0) & (arrays.size[first + 1] > 0)]
    assert (structure.efficiency().expected_gain[lowest] < 0).all()
    assert len(lowest) <= dear.extra["nodes_not_paying_expected"] < dear.N_IN


def test_overlap_by_hand():
    # Two cubes that share a quarter of each, side by side, and one apart; then two that touch.
    boxes = np.array(
        [
            [0, 0, 0, 4, 2, 2],
            [0, 0, 0, 2, 2, 2],
            [1.5, 0, 0, 3.5, 2, 2],
            [3.75, 0, 0, 4, 2, 2],
            [0, 0, 0, 1, 2, 2],
            [1, 0, 0, 2, 2, 2],
        ]
    )
    first, width = np.array([1, 4, 0, 0, 0, 0]), np.array([3, 2, 0, 0, 0, 0])
    got = sibling_overlap(boxes, first, width)
    shared = 2 * (0.5 * 2 + 2 * 2 + 2 * 0.5)
    assert got.tolist() == pytest.approx([shared / 40, 8 / 24, 0, 0, 0, 0])


def test_overlap_of_boxes_apart_is_zero(build):
    triangle = np.array([[[0.0, 0, 0], [1, 0, 0], [0, 1, 1]]])
    scene = Scene.from_triangles(np.concatenate([triangle, triangle + 5.0]), "two")
    assert build("bvh", scene, "max_leaf_size=1").statistics().extra["overlap"] == 0.0


def test_figures_of_cells_and_statistics_agree(lab, build):
    structure = build("bvh", lab.small_scene("soup"))
    cells, figures = structure.cells(), structure.statistics()
    inner = ~cells.is_leaf
    attributes = cells.attributes()
    assert (attributes["gain"][inner] <= 0).sum() == figures.extra["nodes_not_paying"]
    assert attributes["overlap"][inner].mean() == pytest.approx(figures.extra["overlap"])
    assert 0.0 < figures.extra["overlap"] < 1.0
