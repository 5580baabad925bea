"""Figures that have a closed form, and identities of random lines within four standard errors."""

import itertools

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.rays import ALL, Rays
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample


def lines(scene, count, seed=1):
    return Rays.from_arrays(*random_lines(scene.lower, scene.upper, count, seed))


def assert_mean(values, expected):
    """Assert that the mean is right within four standard errors, and that these are small."""
    error = values.std() / np.sqrt(len(values))
    assert abs(values.mean() - expected) < 4 * error + 1e-12, (values.mean(), expected, error)
    assert error < 0.02 * max(expected, 0.05)


# -------------------------------------------------------------------------------- trees of tetra


@pytest.mark.parametrize("bins", [2, 4, 6, 8, 10, 12, 16, 20, 24, 31, 32, 63, 64])
@pytest.mark.parametrize("s", [2, 3, 4, 5, 6])
@pytest.mark.parametrize(("c_trav", "c_isect"), [(1, 1), (1.2, 1.0), (3, 1), (0.125, 1), (1, 2)])
def test_cost_of_a_bvh_over_tetra(build, s, bins, c_trav, c_isect):
    scene = make_sample(f"tetra:size={s}")
    text = f"bins={bins},C_trav={c_trav},C_isect={c_isect}"
    figures = build("bvh", scene, f"{text},max_leaf_size=4").statistics()
    assert figures.sah == pytest.approx(c_trav * 7 / 3 * (s - 1) + 4 * c_isect, rel=1e-12)
    assert (4 ** (s - 1), 4 ** (s - 1) - 1) == (figures.N_V, figures.N_IN)
    assert figures.leaf_sizes.tolist() == [0, 0, 0, 0, 4 ** (s - 1)]
    assert figures.expected_inner == pytest.approx(7 / 3 * (s - 1), rel=1e-12)
    if (c_trav, c_isect) == (1, 1):
        single = build("bvh", scene, f"{text},max_leaf_size=1").statistics()
        # Four equal boxes: the last two levels have area 1 + 2 over the leaf's parent.
        assert single.sah == pytest.approx(7 / 3 * (s - 1) + 3 + 4, rel=1e-12)


@pytest.mark.parametrize("bins", [3, 5, 7])
def test_few_odd_bins_cannot_be_cheaper_than_the_closed_form(build, bins):
    """They have no border in the middle, where the two halves meet."""
    for s in (3, 4, 5, 6):
        figures = build("bvh", make_sample(f"tetra:size={s}"), f"bins={bins}").statistics()
        assert figures.sah >= 1.2 * 7 / 3 * (s - 1) + 4 - 1e-12


def test_published_cost_of_tetra(build):
    scene = make_sample("tetra:size=6")
    figures = build("bvh", scene, "C_trav=1,C_isect=1").statistics()
    assert (figures.N_IN, figures.N_V) == (1023, 1024)
    assert figures.sah == pytest.approx(47 / 3, rel=1e-12)
    assert build("bvh", scene, "C_trav=1,C_isect=1,max_leaf_size=1").statistics().sah == (
        pytest.approx(56 / 3, rel=1e-12)
    )


def test_splits_without_gain_are_not_taken(build):
    scene = make_sample("tetra:size=3")
    for c_trav in (1e-9, 1.0, 1e9):
        figures = build("bvh", scene, f"max_leaf_size=4,C_trav={c_trav}").statistics()
        assert figures.N_V == 16
    # Where one step costs more than all tests, one leaf is best, if it may be that large.
    one = build("bvh", scene, "max_leaf_size=64,C_trav=1e9").statistics()
    assert (one.N_IN, one.N_V, one.sah) == (0, 1, 64.0)


# ------------------------------------------------------------------------------------ any tree


def test_tree_figures(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    single = build("bvh", scene, "max_leaf_size=1")
    figures = single.statistics()
    areas = surface_area(boxes_of(scene.triangles))
    assert figures.N_V == figures.N_IN + 1 == len(scene)
    assert figures.expected_tests == pytest.approx(areas.sum() / single_root(scene), rel=1e-9)
    assert figures.N_EV == 0
    assert len(scene) == figures.N_OIV
    assert figures.sah == pytest.approx(1.2 * figures.expected_inner + figures.expected_tests)
    large = build("bvh", scene, "max_leaf_size=32").statistics()
    assert large.N_V == large.N_IN + 1
    assert len(scene) == large.N_OIV
    assert len(large.leaf_sizes) <= 33
    assert large.mean_leaf_size == len(scene) / large.N_V
    assert large.depths.sum() == large.N_V
    assert len(large.depths) == large.max_depth + 1


def single_root(scene):
    return float(surface_area(np.concatenate([scene.lower, scene.upper])))


def test_naive_is_one_leaf(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    figures = build("naive", scene, "C_trav=7,C_isect=3").statistics()
    assert (0, 1, len(scene)) == (figures.N_IN, figures.N_V, figures.N_OIV)
    assert figures.sah == pytest.approx(3 * len(scene), rel=1e-12)


@pytest.mark.parametrize("sample", ["suzanne", "bunny", "tetra", "soup", "teapot_in_stadium"])
@pytest.mark.parametrize("text", ["", "max_leaf_size=1", "max_leaf_size=32,bins=3"])
def test_random_lines_visit_what_the_areas_say(lab, build, sample, text):
    scene = lab.small_scene(sample)
    tree = build("bvh", scene, text)
    figures = tree.statistics()
    _, counters = tree.trace(lines(scene, 200_000), ALL)
    assert_mean(counters["N_TS"], figures.expected_inner + figures.expected_leaves)
    assert_mean(counters["N_ETS"], figures.expected_leaves)
    assert_mean(counters["N_IT"], figures.expected_tests)
    # One test for the root, and two for the children of every inner node that is entered.
    inner = counters["N_TS"] - counters["N_ETS"]
    assert np.array_equal(counters["volume_tests"], 1 + 2 * inner)


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
@pytest.mark.parametrize(
    "text", ["padding=0", "padding=0,assignment=exact", "padding=0,density=20"]
)
@pytest.mark.parametrize("sample", ["suzanne", "tetra", "soup"])
def test_random_lines_cross_a_grid_as_the_areas_say(lab, build, sample, text, name):
    scene = lab.small_scene(sample)
    grid = build(name, scene, text)
    figures = grid.statistics()
    _, counters = grid.trace(lines(scene, 100_000), ALL)
    # Cells that macro-cells skip are crossed all the same.
    skipped = counters["cells_skipped"] if name == "macro_grid" else 0
    assert_mean(counters["N_TS"] + skipped, figures.expected_leaves)
    assert_mean(counters["N_IT"], figures.expected_tests)
    assert np.array_equal(counters["N_TS"], counters["N_ETS"])


def box_scene(a, b, c):
    """Two triangles that span the box a x b x c."""
    return Scene.from_triangles(
        np.array([[[0, 0, 0], [a, 0, 0], [a, b, c]], [[0, 0, 0], [0, b, 0], [a, b, c]]]), "box"
    )


@pytest.mark.parametrize("n", [1, 2, 5, 16, 40])
def test_a_grid_of_n_cubed_cells_costs_n_cells_per_line(build, n):
    scene = make_sample("tetra:size=1")
    grid = build("grid", scene, f"resolution={n}x{n}x{n},padding=0")
    _, counters = grid.trace(lines(scene, 200_000), ALL)
    if n == 1:
        assert (counters["N_TS"] == 1).all()
    else:
        assert_mean(counters["N_TS"], n)
    assert grid.statistics().expected_leaves == pytest.approx(n, rel=1e-9)


@pytest.mark.parametrize(
    ("size", "cells"), [((4, 2, 1), (10, 7, 5)), ((1, 1, 8), (3, 9, 2)), ((3, 2, 5), (1, 1, 17))]
)
def test_cells_of_a_box_per_line(build, size, cells):
    scene = box_scene(*size)
    words = "x".join(map(str, cells))
    grid = build("grid", scene, f"resolution={words},padding=0")
    a, b, c = size
    across = np.array([b * c, a * c, a * b])
    expected = 1 + ((np.array(cells) - 1) * across).sum() / across.sum()
    if size == (4, 2, 1):
        assert expected == pytest.approx(6.28571, abs=1e-5)
    _, counters = grid.trace(lines(scene, 200_000), ALL)
    assert_mean(counters["N_TS"], expected)
    assert grid.statistics().expected_leaves == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("cells", [(8, 8, 8), (5, 9, 13), (1, 30, 2)])
def test_steps_between_cells_are_the_differences_of_their_indices(build, cells):
    scene = box_scene(*map(float, cells))
    grid = build("grid", scene, "resolution={}x{}x{},padding=0".format(*cells))
    rng = np.random.default_rng(4)
    a, b = rng.integers(cells, size=(2, 20_000, 3))
    start, end = a + rng.uniform(0.01, 0.99, a.shape), b + rng.uniform(0.01, 0.99, b.shape)
    rays = Rays.from_arrays(start, end - start, 1.0)
    _, counters = grid.trace(rays, ALL)
    assert np.array_equal(counters["N_TS"], 1 + np.abs(a - b).sum(axis=1))


@pytest.mark.parametrize("name", ["grid", "bvh"])
def test_cells_visited_are_the_cells_a_line_passes(lab, build, name):
    """N_TS of a line that never stops, counted once more with nothing but the boxes."""
    scene = lab.small_scene("suzanne")
    structure = build(name, scene)
    cells = structure.cells()
    rays = lines(scene, 300)
    _, counters = structure.trace(rays, ALL)
    with np.errstate(divide="ignore", invalid="ignore"):
        for i in range(len(rays)):
            t0 = (cells.boxes[:, :3] - rays.origins[i]) / rays.directions[i]
            t1 = (cells.boxes[:, 3:] - rays.origins[i]) / rays.directions[i]
            inside = np.minimum(t0, t1).max(axis=1) <= np.maximum(t0, t1).min(axis=1)
            # Up to equality, because nodes around axis-parallel triangles are flat. A grid's walls
            # stand a hair lower than drawn: generic lines do not notice.
            assert counters["N_TS"][i] == inside.sum()
            assert counters["N_ETS"][i] == (inside & cells.is_leaf).sum()
            empty = (inside & cells.is_leaf & (cells.count == 0)).sum()
            assert counters.by_name().get("N_EETS", np.zeros(len(rays)))[i] == empty
            assert counters["N_IT"][i] == cells.count[inside].sum()


# -------------------------------------------------------------------------------- random lines


def sphere_chords(o, d, radius):
    """Chord lengths through a sphere around the origin, 0 for a miss."""
    middle = (o * d).sum(1)
    rest = radius**2 - ((o * o).sum(1) - middle**2)
    return 2 * np.sqrt(np.maximum(rest, 0.0))


def box_chords(o, d, half):
    t0, t1 = (-half - o) / d, (half - o) / d
    enter, leave = np.minimum(t0, t1).max(axis=1), np.maximum(t0, t1).min(axis=1)
    return np.maximum(leave - enter, 0.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_random_lines_hit_convex_bodies_by_their_area(seed):
    one = np.ones(3)
    o, d = random_lines(-one, one, 400_000, seed)
    assert np.allclose(np.linalg.norm(d, axis=1), 1.0, atol=1e-14)
    assert_mean((sphere_chords(o, d, 1.0) > 0).astype(float), np.pi / 6)
    for ratio in (0.9, 0.5, 0.25):
        assert_mean((box_chords(o, d, ratio * one) > 0).astype(float), ratio**2)
    slab = np.array([1.0, 1.0, 0.1])
    assert_mean((box_chords(o, d, slab) > 0).astype(float), (8 + 8 * 0.2) / 24)
    # Mean chord 4 V / S, of the lines that hit.
    chords = box_chords(o, d, one)
    assert (chords > 0).all()
    assert_mean(chords, 4 * 8 / 24)
    inner = sphere_chords(o, d, 0.7)
    assert_mean(inner[inner > 0], 4 / 3 * 0.7)


def test_random_lines_are_isotropic_and_uniform_in_a_long_box():
    lower, upper = np.array([-1.0, 5.0, 0.0]), np.array([9.0, 6.0, 0.5])
    o, d = random_lines(lower, upper, 400_000, 7)
    half, centre = (upper - lower) / 2, (lower + upper) / 2
    assert_mean(box_chords(o - centre, d, half), 4 * np.prod(2 * half) / single_area(2 * half))
    # The part of the box below any plane across is hit in proportion to its area.
    for share in (0.1, 0.5):
        part = half * [share, 1, 1]
        moved = o - (centre - half * [1 - share, 0, 0])
        hit = (box_chords(moved, d, part) > 0).astype(float)
        assert_mean(hit, single_area(2 * part) / single_area(2 * half))


def single_area(size):
    return 2 * sum(x * y for x, y in itertools.combinations(size, 2))


def test_random_lines_start_outside_and_repeat_by_seed():
    lower, upper = np.zeros(3), np.array([1.0, 2.0, 3.0])
    o, d = random_lines(lower, upper, 1000, 1)
    assert ((o < lower) | (o > upper)).any(axis=1).all()
    assert (((o + 4 * d) * d).sum(1) > (o * d).sum(1)).all()
    again = random_lines(lower, upper, 1000, 1)
    assert np.array_equal(o, again[0])
    assert np.array_equal(d, again[1])
    assert not np.array_equal(o, random_lines(lower, upper, 1000, 2)[0])
