"""Macro-cells: exact distances, and a walk that is the plain grid's with steps left out."""

import itertools

import numpy as np
import pytest
from accelscope.core.contract.events import JUMP, VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.macro_grid import FARTHEST, OCTANTS, measure_distances

RESOLUTIONS = ["", "16x16x16", "1x1x60", "40x3x17"]
SCENES = ["suzanne", "tetra", "soup", "teapot_in_stadium", "cubes", "mess"]
REGIONS = ["chessboard", "octant"]


def text_of(resolution, more="padding=0,assignment=exact"):
    return f"resolution={resolution},{more}" if resolution else more


def distances_of(occupied, regions):
    """Distances of a boolean block (nx, ny, nz), one block per map."""
    maps = measure_distances(occupied.ravel(), np.array(occupied.shape), regions, SILENT)
    assert maps.dtype == np.uint8
    return maps.reshape(-1, *occupied.shape).astype(np.int64)


def brute_force(occupied, regions):
    """The same from the definition: every cell against every occupied one."""
    cells = np.stack(np.indices(occupied.shape), axis=-1).reshape(-1, 1, 3)
    away = np.argwhere(occupied)[None] - cells
    if regions == "chessboard":
        maps = [np.abs(away).max(axis=2)]
    else:
        # An occupied cell ends a cube that reaches it, if it lies in this octant at all.
        maps = [
            np.where((away * signs >= 0).all(axis=2), (away * signs).max(axis=2), FARTHEST)
            for signs in OCTANTS
        ]
    return np.stack(
        [np.minimum(each.min(axis=1), FARTHEST).reshape(occupied.shape) for each in maps]
    )


# ------------------------------------------------------------------------------------- distances


@pytest.mark.parametrize("regions", REGIONS)
@pytest.mark.parametrize("shape", [(1, 1, 1), (7, 5, 9), (1, 1, 40), (30, 1, 1), (2, 33, 3)])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.6, 1.0])
def test_distances_are_those_of_brute_force(regions, shape, share):
    rng = np.random.default_rng(3)
    for _ in range(5):
        occupied = rng.random(shape) < share
        occupied[tuple(rng.integers(shape))] = True
        assert np.array_equal(distances_of(occupied, regions), brute_force(occupied, regions))


@pytest.mark.parametrize("regions", REGIONS)
@pytest.mark.parametrize("resolution", ["9x8x7", "1x1x60"])
@pytest.mark.parametrize("sample", SCENES)
def test_distances_in_scenes(lab, build, sample, resolution, regions):
    text = f"{text_of(resolution)},regions={regions}"
    structure = build("macro_grid", lab.small_scene(sample), text)
    occupied = (np.diff(structure.arrays.offsets) > 0).reshape(tuple(structure.arrays.resolution))
    wanted = brute_force(occupied, regions)
    assert np.array_equal(structure.arrays.distances, wanted.reshape(len(wanted), -1))
    assert structure.validate() == []


def test_a_single_obstacle_gives_the_maximum_norm():
    shape = np.array([21, 12, 33])
    cells = np.stack(np.indices(shape), axis=-1)
    for p in ((0, 0, 0), (20, 11, 32), (10, 3, 17)):
        occupied = np.zeros(shape, dtype=bool)
        occupied[p] = True
        away = np.array(p) - cells
        assert np.array_equal(distances_of(occupied, "chessboard")[0], np.abs(away).max(axis=-1))
        for signs, got in zip(OCTANTS, distances_of(occupied, "octant"), strict=True):
            ahead = (away * signs >= 0).all(axis=-1)
            assert np.array_equal(got, np.where(ahead, np.abs(away).max(axis=-1), FARTHEST))


def test_the_least_of_the_octants_is_the_chessboard_distance():
    occupied = np.random.default_rng(8).random((40, 23, 31)) < 0.002
    directed, one = distances_of(occupied, "octant"), distances_of(occupied, "chessboard")
    assert np.array_equal(directed.min(axis=0), one[0])
    assert directed.mean() > 1.5 * one.mean()


@pytest.mark.parametrize("axis", range(3))
def test_distances_end_at_a_byte(axis):
    shape = np.ones(3, dtype=np.int64)
    shape[axis] = 700
    occupied = np.zeros(shape, dtype=bool)
    occupied.ravel()[[0, 699]] = True
    ramp = np.minimum(np.arange(700), np.arange(699, -1, -1))
    got = distances_of(occupied, "chessboard").ravel()
    assert np.array_equal(got, np.minimum(ramp, 255))
    assert got.max() == FARTHEST == 255


# ------------------------------------------------------------------------------------------ walk


def all_rays(lab, sample, structure, n=80):
    """Every family of rays, those along the cells' walls, edges and corners too."""
    families = lab.ray_families(lab.small_scene(sample), n)
    rays, names = lab.batch_of({**families, **lab.wall_rays(structure, 2 * n)})
    t_max = np.where(np.arange(len(names)) % 7 == 0, 0.5, np.inf)
    return Rays.from_arrays(rays.origins, rays.directions, t_max)


def cells_skipped(steps):
    """For each visit, the empty cells that are passed with it."""
    visits = np.isin(steps.kind, (VISIT_EMPTY, VISIT_LEAF))
    jumps = steps.kind == JUMP
    # A jump follows the visit of the cell that it starts from.
    assert (steps.kind[np.flatnonzero(jumps) - 1] == VISIT_EMPTY).all()
    assert (steps.primitive[jumps] > 0).all()
    skipped = np.zeros(visits.sum(), dtype=np.int64)
    skipped[np.cumsum(visits)[jumps] - 1] = steps.primitive[jumps]
    return skipped


def columns(steps, which):
    return np.stack([steps.kind, steps.cell, steps.primitive, steps.t_enter, steps.t_exit], axis=1)[
        which
    ]


@pytest.mark.parametrize("regions", REGIONS)
@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("sample", SCENES)
def test_hits_and_tests_are_those_of_the_plain_grid(lab, build, sample, resolution, regions):
    for more in ("padding=0,assignment=exact", "padding=0.001,mailbox=true"):
        text, scene = text_of(resolution, more), lab.small_scene(sample)
        plain = build("grid", scene, text)
        macro = build("macro_grid", scene, f"{text},regions={regions}")
        rays = all_rays(lab, sample, plain)
        assert len(rays) > 3000
        for query in (CLOSEST, ANY, ALL):
            want, before = plain.trace(rays, query)
            got, after = macro.trace(rays, query)
            assert np.array_equal(want.t.view(np.int64), got.t.view(np.int64))
            assert np.array_equal(want.primitive, got.primitive)
            for name in ("N_IT", "mailbox_hits", "volume_tests"):
                assert np.array_equal(before[name], after[name])
            occupied = before["N_ETS"] - before["N_EETS"]
            assert np.array_equal(occupied, after["N_ETS"] - after["N_EETS"])
            assert np.array_equal(after["N_TS"], after["N_ETS"])
            assert np.array_equal(before["N_TS"], after["N_TS"] + after["cells_skipped"])
            assert (after["cells_skipped"] >= 0).all()


@pytest.mark.parametrize("regions", REGIONS)
@pytest.mark.parametrize("resolution", RESOLUTIONS)
@pytest.mark.parametrize("sample", SCENES)
def test_the_walk_is_the_plain_one_with_steps_left_out(lab, build, sample, resolution, regions):
    """Event by event: same cells at the same t, and what is left out is empty and in the box."""
    text, scene = text_of(resolution), lab.small_scene(sample)
    plain = build("grid", scene, text)
    macro = build("macro_grid", scene, f"{text},regions={regions}")
    occupied = np.diff(macro.arrays.offsets) > 0
    shape = tuple(macro.arrays.resolution)
    box, size = macro.arrays.box[0], macro.arrays.cell_size
    rays = all_rays(lab, sample, plain)
    left_out = 0
    for i in range(0, len(rays), 29):
        query = (ALL, CLOSEST)[i % 2]
        want, got = plain.record(rays, i, query), macro.record(rays, i, query)
        useful = columns(want, want.kind != VISIT_EMPTY)
        assert np.array_equal(useful, columns(got, ~np.isin(got.kind, (VISIT_EMPTY, JUMP))))
        cells = want.cell[np.isin(want.kind, (VISIT_LEAF, VISIT_EMPTY))]
        visits = np.isin(got.kind, (VISIT_LEAF, VISIT_EMPTY))
        if not visits.any():
            assert not len(cells)
            continue
        skipped = cells_skipped(got)
        assert (skipped[got.kind[visits] == VISIT_LEAF] == 0).all()
        place = np.concatenate([[0], np.cumsum(skipped[:-1] + 1)])
        assert place[-1] + skipped[-1] + 1 == len(cells)
        enter = want.t_enter[np.isin(want.kind, (VISIT_LEAF, VISIT_EMPTY))]
        assert np.array_equal(got.cell[visits], cells[place])
        assert np.array_equal(got.t_enter[visits], enter[place])
        assert np.array_equal(got.t_enter[visits][1:], got.t_exit[visits][:-1])
        ends = np.append(place[1:], len(cells))
        for first, last in zip(place, ends, strict=True):
            if last - first < 2:
                continue
            assert not occupied[cells[first:last]].any()
            region = macro.region(cells[first], rays.directions[i]).reshape(2, 3)
            low, high = np.rint((region - box[:3]) / size).astype(int)
            index = np.stack(np.unravel_index(cells[first:last], shape), axis=1)
            assert ((low <= index) & (index < high)).all()
            left_out += last - first - 1
            if last < len(cells):  # the next cell is the first one outside
                after = np.array(np.unravel_index(cells[last], shape))
                assert not ((low <= after) & (after < high)).all()
    if occupied.mean() < 0.5 and len(occupied) > 1000:
        assert left_out > 20


@pytest.mark.parametrize("regions", REGIONS)
def test_regions_are_empty_and_touch_what_stops_them(lab, build, regions):
    macro = build(
        "macro_grid", lab.small_scene("suzanne"),
        f"resolution=20x15x18,assignment=exact,regions={regions}",
    )  # fmt: skip
    shape, size = tuple(macro.arrays.resolution), macro.arrays.cell_size
    occupied = (np.diff(macro.arrays.offsets) > 0).reshape(shape)
    rng = np.random.default_rng(6)
    for cell in rng.choice(np.flatnonzero(~occupied.ravel()), 300):
        direction = rng.normal(size=3)
        region = macro.region(cell, direction).reshape(2, 3) - macro.arrays.box[0, :3]
        low, high = np.rint(region / size).astype(int)
        block = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
        assert not occupied[block].any()
        index = np.array(np.unravel_index(cell, shape))
        assert ((low <= index) & (index < high)).all()
        # One layer more, where the region grows, and it is not empty; or there is no obstacle.
        signs = np.where(direction > 0, 1, -1)
        row = int((signs > 0) @ [4, 2, 1]) if regions == "octant" else 0
        distance = int(macro.arrays.distances[row, cell])
        ends = np.sort([index + signs * distance, index - signs * distance], axis=0)
        if regions == "octant":
            ends = np.sort([index + signs * distance, index], axis=0)
        larger = tuple(slice(max(a, 0), b + 1) for a, b in ends.T)
        assert occupied[larger].any() == (distance < FARTHEST)
    assert macro.region(int(np.flatnonzero(occupied)[0]), np.ones(3)) is None


def test_steps_are_saved_in_the_stadium(lab, build):
    scene = lab.small_scene("teapot_in_stadium")
    text = "resolution=90x70x20,assignment=exact"
    rays, _ = lab.batch_of({"lines": lab.ray_families(scene, 2000)["random lines"]})
    steps = [build("grid", scene, text).trace(rays, ALL)[1]["N_TS"]]
    for regions in REGIONS:
        macro = build("macro_grid", scene, f"{text},regions={regions}")
        steps.append(macro.trace(rays, ALL)[1]["N_TS"])
    plain, chessboard, octant = (each.mean() for each in steps)
    assert chessboard < plain / 2
    assert octant < chessboard
    # What is longer for every ray alone is not shorter for one of them.
    assert (steps[1] <= steps[0]).all()


@pytest.mark.parametrize("query", [CLOSEST, ANY, ALL])
@pytest.mark.parametrize("regions", REGIONS)
def test_recording_equals_counting(lab, build, regions, query):
    scene = lab.small_scene("teapot_in_stadium")
    text = f"resolution=30x20x9,assignment=exact,regions={regions}"
    macro, plain = build("macro_grid", scene, text), build("grid", scene, text[: text.rindex(",")])
    rays = all_rays(lab, "teapot_in_stadium", macro, n=12)
    _, counters = macro.trace(rays, query)
    _, before = plain.trace(rays, query)
    for i in range(len(rays)):
        steps = macro.record(rays, i, query)
        assert steps.tally() == {name: int(counters[name][i]) for name in steps.tally()}
        assert (steps.kind == VOLUME_TEST).sum() == 1
        assert before["N_TS"][i] - counters["N_TS"][i] == cells_skipped(steps).sum()


def directions_that_overflow(rng, n):
    """Components that are so small that their inverse is infinite, and others."""
    sizes = rng.choice([1.0, 5e-324, 1e-310, 1e-308, 1e-300, 1e300], size=(n, 3))
    return rng.choice([-1, 0, 1], size=(n, 3)) * sizes


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
def test_directions_whose_inverse_overflows(lab, build, name):
    scene = lab.small_scene("tetra")
    structure = build(name, scene, "resolution=12x7x9,padding=0,assignment=exact")
    rng, n = np.random.default_rng(9), 4000
    walls = structure.arrays.walls[np.arange(3), rng.integers(0, 7, (n, 3))]
    inside = scene.lower + rng.random((n, 3)) * (scene.upper - scene.lower)
    origins = np.where(rng.random((n, 3)) < 0.4, walls, inside)
    directions = directions_that_overflow(rng, n)
    usable = directions.any(axis=1)
    rays = Rays.from_arrays(origins[usable], directions[usable])
    want, _ = build("naive", scene).trace(rays)
    got, _ = structure.trace(rays)
    assert lab.differences(np.full(len(rays), name), want, got) == {}
    assert (want.primitive >= 0).sum() > 500


# ------------------------------------------------------------------------- scenes that grids hate


def through_one_point(n, rng):
    triangles = np.full((n, 3, 3), 0.3)
    triangles[:, 1:] = rng.normal(size=(n, 2, 3))
    return triangles


def a_million_times_longer_than_wide(rng):
    triangles = rng.random((1500, 1, 3)) + 0.01 * rng.normal(size=(1500, 3, 3))
    return triangles * [1e6, 1.0, 1.0]


def in_a_wall(rng):
    """Flat, and in the plane of a wall that halves the box of another triangle."""
    triangles = rng.random((800, 1, 3)) + 0.05 * rng.normal(size=(800, 3, 3))
    triangles[..., 1] = 0.5
    triangles[0, :, 1] = 0.0, 1.0, 0.5
    return triangles


HATED = {
    "through one point": lambda rng: through_one_point(2000, rng),
    "long": a_million_times_longer_than_wide,
    "flat": lambda rng: in_a_wall(rng)[1:],
    "in a wall": in_a_wall,
}


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
@pytest.mark.parametrize("scene_kind", HATED)
@pytest.mark.parametrize("text", ["", "assignment=exact,mailbox=true", "resolution=16x16x16"])
def test_scenes_that_grids_hate(lab, build, name, scene_kind, text):
    scene = Scene.from_triangles(HATED[scene_kind](np.random.default_rng(4)), scene_kind)
    rays, names = lab.batch_of(lab.ray_families(scene, 30))
    want, _ = build("naive", scene).trace(rays)
    structure = build(name, scene, text)
    got, _ = structure.trace(rays)
    assert structure.validate() == []
    assert lab.differences(names, want, got) == {}
    assert (want.primitive >= 0).sum() > 200


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
def test_a_hundred_thousand_triangles_through_one_point(build, name):
    rng = np.random.default_rng(4)
    scene = Scene.from_triangles(through_one_point(100_000, rng), "fan")
    rays = Rays.from_arrays(4 * rng.normal(size=(60, 3)), rng.normal(size=(60, 3)))
    want, _ = build("naive", scene).trace(rays)
    got, _ = build(name, scene).trace(rays)
    assert np.array_equal(want.t.view(np.int64), got.t.view(np.int64))
    assert np.array_equal(want.primitive, got.primitive)


# ----------------------------------------------------------------------------- what is reported


@pytest.mark.parametrize("regions", REGIONS)
def test_figures_and_cells(lab, build, regions):
    scene = lab.small_scene("suzanne")
    text = "resolution=14x10x12,assignment=exact"
    plain, macro = (
        build("grid", scene, text),
        build("macro_grid", scene, f"{text},regions={regions}"),
    )
    figures, distances = macro.statistics(), macro.arrays.distances
    extra = figures.extra
    assert {**plain.statistics().to_json(), **extra} == figures.to_json()
    assert extra["distance_bytes"] == distances.nbytes == 14 * 10 * 12 * len(distances)
    assert macro.memory() == plain.memory() + distances.nbytes
    empty = np.diff(macro.arrays.offsets) == 0
    assert extra["mean_distance"] == pytest.approx(distances[:, empty].mean(), rel=1e-12)
    assert extra["max_distance"] == distances.max()
    attributes = macro.cells().attributes()
    assert np.array_equal(attributes["distance"] == 0, attributes["count"] > 0)
    assert set(plain.cells().attributes()) < set(attributes)
    if regions == "octant":
        names = ["distance_" + "".join(each) for each in itertools.product("np", repeat=3)]
        assert np.array_equal(np.stack([attributes[name] for name in names]), distances)
        assert np.array_equal(attributes["distance"], distances.min(axis=0))
    else:
        assert np.array_equal(attributes["distance"], distances[0])


@pytest.mark.parametrize("regions", REGIONS)
def test_damage_is_found(lab, build, regions):
    macro = build("macro_grid", lab.small_scene("soup"), f"resolution=9x8x7,regions={regions}")
    assert macro.validate() == []
    distances = macro.arrays.distances
    empty = int(np.flatnonzero(distances[0] > 0)[0])
    for cell, value, words in (
        (empty, 0, "zero in an empty"), (int(macro.arrays.distances[0].argmin()), 1, "zero"),
        (empty, distances[0, empty] + 1, "neighbours"),
    ):  # fmt: skip
        damaged = distances.copy()
        damaged[-1 if value == 0 else 0, cell] = value
        macro.arrays = macro.arrays._replace(distances=damaged)
        assert words in " ".join(macro.validate())
    macro.arrays = macro.arrays._replace(distances=distances, offsets=macro.arrays.offsets + 1)
    assert "partition" in " ".join(macro.validate())


@pytest.mark.parametrize("regions", REGIONS)
def test_distances_count_when_a_grid_is_refused(lab, build, monkeypatch, regions):
    scene, text = lab.small_scene("tetra"), "resolution=30x20x10"
    taken = 64 * 6000 + 24 * 30
    monkeypatch.setattr("accelscope.core.memory.available_bytes", lambda: (taken + 6000) / 0.8 + 1)
    build("grid", scene, text)
    if regions == "chessboard":
        build("macro_grid", scene, text)
    else:
        with pytest.raises(InputError, match=r"a grid of 30x20x10 = 6e\+03 cells needs 422.6 KiB"):
            build("macro_grid", scene, f"{text},regions=octant")
