"""5D ray classification: beams, cells, lists, and the hits of naive."""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.whitted import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, by_class, trace
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.geometry.shapes import shapes_of
from accelscope.core.kernels import call, kernel
from accelscope.core.scene import Scene
from accelscope.core.structures.ray_classification.beam import (
    MOST_PLANES,
    blocks_beam,
    bound_beam,
    reaches_beam,
)
from accelscope.core.structures.ray_classification.making import scratch_for
from accelscope.core.structures.ray_classification.ray_space import (
    NO_LIST,
    ROOTS,
    TIME,
    U,
    V,
)
from accelscope.sample_scenes import make_sample
from ray_space_cases import awkward, members, moving

# ------------------------------------------------------------------------------------- beams


@kernel
def planes_of(root, bounds, planes):
    """Return how many half-spaces bound a beam."""
    return bound_beam(root, bounds, planes)


@kernel
def look(shapes, item, root, bounds, planes, polygon, ray, slack):
    """Return whether an item reaches into a beam, and whether it blocks it."""
    count = bound_beam(root, bounds, planes)
    return (
        reaches_beam(shapes, item, bounds, planes, count, slack, polygon),
        blocks_beam(shapes, item, root, bounds, slack, ray),
    )


def random_cell(rng):
    """Return a root and the intervals of a cell of a scene in the unit cube; some are points."""
    ends = np.sort(rng.random((2, 6)), axis=0)
    ends[:, U : V + 1] = np.sort(rng.choice([-1.0, -0.5, 0.0, 0.5, 1.0, *rng.uniform(-1, 1, 4)],
                                            (2, 2)), axis=0)  # fmt: skip
    if rng.random() < 0.2:
        axis = rng.integers(3)
        ends[1, axis] = ends[0, axis]
    return int(rng.integers(ROOTS)), ends


def is_member(point, root, ends):
    """Say whether some ray of a cell passes a point: whether there is a t for all conditions."""
    a, sign = root // 2, 1.0 if root % 2 == 0 else -1.0
    low, high = -np.inf, np.inf
    along = sorted((sign * ends[0, a], sign * ends[1, a]))
    low, high = max(0.0, sign * point[a] - along[1]), sign * point[a] - along[0]
    for axis, slope in (((a + 1) % 3, U), ((a + 2) % 3, V)):
        # O0 + t u0 <= x <= O1 + t u1, linear in t.
        for rate, rest in (
            (ends[0, slope], point[axis] - ends[0, axis]),
            (-ends[1, slope], ends[1, axis] - point[axis]),
        ):
            if rate > 0.0:
                high = min(high, rest / rate)
            elif rate < 0.0:
                low = max(low, rest / rate)
            elif rest < 0.0:
                return False
    return low <= high


def test_a_beam_is_the_intersection_of_its_half_spaces():
    """Members lie inside, each half-space is touched, and what lies inside of all is a member."""
    rng = np.random.default_rng(4)
    planes = np.zeros((MOST_PLANES, 4))
    inside = 0
    for _ in range(400):
        root, ends = random_cell(rng)
        count = call(planes_of, root, ends, planes)
        normals, positions = planes[:count, :3], planes[:count, 3]
        origins, directions = members(rng, root, ends, 500)
        passed = origins + rng.exponential(1.0, (500, 1)) * directions
        assert ((passed @ normals.T - positions) <= 1e-12 * (1 + np.abs(passed).max())).all()
        np.testing.assert_allclose((origins @ normals.T).max(axis=0), positions, atol=1e-12)
        points = rng.uniform(-1, 2, (300, 3))
        heights = (points @ normals.T - positions).max(axis=1)
        for point, height in zip(points, heights, strict=True):
            if abs(height) > 1e-9:
                assert is_member(point, root, ends) == (height < 0.0)
                inside += height < 0.0
    assert inside > 5000


def hits_of(triangle, origins, directions):
    """Return whether lines from origins on hit a triangle, by Cramer's rule."""
    e, f = triangle[1] - triangle[0], triangle[2] - triangle[0]
    p = np.cross(directions, f)
    det = p @ e
    s = origins - triangle[0]
    with np.errstate(all="ignore"):
        u = (s * p).sum(axis=1) / det
        q = np.cross(s, e)
        v = (directions * q).sum(axis=1) / det
        t = q @ f / det
    return (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0)


def test_what_blocks_a_beam_is_hit_by_all_of_its_rays_and_what_is_beside_by_none():
    rng = np.random.default_rng(5)
    blocked, beside = 0, 0
    for _ in range(3000):
        root, ends = random_cell(rng)
        ends[1] = ends[0] + rng.choice([0.02, 0.2, 1.0]) * (ends[1] - ends[0])
        middle, way = ends.mean(axis=0), np.empty(3)
        a = root // 2
        way[a] = 1.0 if root % 2 == 0 else -1.0
        way[(a + 1) % 3], way[(a + 2) % 3] = middle[U], middle[V]
        place = middle[:3] + rng.uniform(-0.5, 2.0) * way
        triangle = place + rng.choice([0.3, 3.0]) * rng.normal(size=(3, 3))
        shapes = shapes_of(Scene.from_triangles(triangle[None], "one").items(), 1e-12)
        scratch = scratch_for(shapes)
        reaches, blocks = call(
            look, shapes, 0, root, ends, scratch.planes, scratch.polygon, scratch.ray, 1e-12
        )
        hit = hits_of(triangle, *members(rng, root, ends, 400))
        assert not (blocks and not hit.all())
        assert not (hit.any() and not reaches)
        blocked, beside = blocked + blocks, beside + (not reaches)
    assert blocked > 100
    assert beside > 500


# -------------------------------------------------------------------------- the hits of naive

VARIANTS = (
    "",
    "min_rays=1,max_list_size=2",
    "min_rays=4,merge=similar,max_depth=40",
    "min_rays=2,merge=none,truncate=false,max_depth=9",
    "min_rays=1,most_references=3000,max_depth=15",
    "dimensions=6,min_rays=2",
)


def check(build, scene, text):
    rays = awkward(scene)
    structure, naive = build("ray_classification", scene, text), build("naive", scene)
    want = naive.trace(rays)[0]
    hits, counts = structure.trace(rays)
    np.testing.assert_array_equal(hits.t, want.t)
    np.testing.assert_array_equal(hits.primitive, want.primitive)
    assert structure.validate() == []
    everything, _ = structure.trace(rays, ALL)
    np.testing.assert_array_equal(everything.primitive, want.primitive)
    blocked, _ = structure.trace(rays, ANY)
    np.testing.assert_array_equal(blocked.primitive >= 0, want.primitive >= 0)
    return structure, rays, hits, counts


@pytest.mark.parametrize("text", VARIANTS)
def test_awkward_rays(build, lab, text):
    structure, *_ = check(build, lab.small_scene("sombrero"), text)
    figures = structure.statistics().extra
    assert 0.0 < figures["made_share"] <= 1.0
    if "most_references" in text:
        assert figures["references_kept"] <= 3000
        assert figures["lists_dropped"] > 0


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", VARIANTS)
def test_awkward_rays_of_every_sample(build, lab, scene_name, text):
    check(build, lab.small_scene(scene_name), text)


@pytest.mark.parametrize("text", ["dimensions=5,min_rays=2", "dimensions=6,min_rays=2"])
def test_what_moves(build, text):
    check(build, moving(), text)


def test_time_as_a_dimension_makes_lists_shorter(build):
    """Without it no cell is small enough to tell items apart that pass one place in turn."""
    tests = {}
    for dimensions in "56":
        text = f"dimensions={dimensions},min_rays=1,max_list_size=1,max_depth=40"
        _, _, _, counts = check(build, moving(), text)
        tests[dimensions] = counts["N_IT"].mean()
    assert tests["6"] < 0.95 * tests["5"]


def test_neither_order_nor_threads_make_a_difference(build, lab):
    scene = lab.small_scene("sombrero")
    rays = awkward(scene)
    shuffled = np.random.default_rng(1).permutation(len(rays))
    runs = []
    for which, threads in ((np.arange(len(rays)), 1), (shuffled, 2), (shuffled, 8)):
        structure = build("ray_classification", scene, "min_rays=4")
        hits, counts = structure.trace(rays.select(which), threads=threads)
        back = np.argsort(which)
        runs.append((hits.t[back], hits.primitive[back], counts.values[back]))
        # The same rays once more divide nothing any more.
        made = structure.made().cells
        _, same = structure.trace(rays.select(which), threads=threads)
        np.testing.assert_array_equal(same.values, counts.values)
        assert structure.made().cells == made
    for run in runs[1:]:
        for values, expected in zip(run, runs[0], strict=True):
            np.testing.assert_array_equal(values, expected)


def test_a_recorded_walk_is_what_was_counted(build, lab):
    scene = lab.small_scene("sombrero")
    rays = awkward(scene, 100)
    structure = build("ray_classification", scene, "min_rays=2")
    _, counts = structure.trace(rays)
    for index in range(0, len(rays), 37):
        expected = {name: int(each[index]) for name, each in counts.by_name().items()}
        assert structure.record(rays, index).tally() == expected


# ---------------------------------------------------------------------------------------- lists


def leaves_with_lists(structure):
    arrays = structure.arrays
    return np.flatnonzero((arrays.children < 0) & (arrays.first != NO_LIST))


LISTS = "min_rays=4,truncate=false,max_list_size=3"


def check_lists(build, scene, count, text=LISTS):
    """Rays of random cells hit only what their cell lists; of what lies in front, everything."""
    structure = build("ray_classification", scene, text)
    structure.trace(awkward(scene))
    rng, arrays = np.random.default_rng(2), structure.arrays
    leaves = rng.choice(leaves_with_lists(structure), count)
    parts = [members(rng, structure.known.root[leaf], structure.known.bounds[leaf], 20)
             for leaf in leaves]  # fmt: skip
    rays = Rays.from_arrays(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    cells = np.repeat(leaves, 20)
    left, met = np.arange(len(rays)), 0
    naive = build("naive", scene)
    # Hit after hit, each from right behind the one before.
    while len(left):
        hits, _ = naive.trace(rays.select(left))
        is_hit = hits.primitive >= 0
        left, items, ts = left[is_hit], hits.primitive[is_hit], hits.t[is_hit]
        for ray, item in zip(left, items, strict=True):
            listed = arrays.references[arrays.first[cells[ray]] : arrays.last[cells[ray]]]
            assert item in listed
        met += len(left)
        rays.t_min[left] = np.nextafter(ts, np.inf)
    return met


def test_lists_are_conservative(build, lab):
    assert check_lists(build, lab.small_scene("sombrero"), 300) > 1000


@pytest.mark.exhaustive
def test_lists_are_conservative_for_a_million_rays(build, lab, sample_of_triangles):
    check_lists(build, lab.small_scene(sample_of_triangles), 5000)


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", [
    "", "max_list_size=1", "min_rays=1", "merge=none", "merge=similar", "max_depth=3",
    "dimensions=6",
])  # fmt: skip
def test_lists_of_any_setting_are_conservative_for_a_million_rays(build, lab, text):
    """A list is truncated behind what blocks its beam: nothing that lies there is met first."""
    for name in ("suzanne", "balls"):
        scene = lab.small_scene(name)
        check_lists(build, scene, 25_000, ",".join(filter(None, [text, "truncate=false"])))


def test_nothing_is_listed_behind_a_wall(build):
    """A wall across the scene: cells in front of it need not be divided for what is behind."""
    wall = np.array([[[-9, -9, 0.5], [9, -9, 0.5], [0, 20, 0.5]]])
    rng = np.random.default_rng(3)
    behind = rng.random((200, 1, 3)) * [1, 1, 0.2] + [0, 0, 0.7] + 0.02 * rng.random((200, 3, 3))
    before = rng.random((3, 1, 3)) * [1, 1, 0.2] + 0.02 * rng.random((3, 3, 3))
    scene = Scene.from_triangles(np.concatenate([wall, behind, before]), "wall")
    up = Rays.from_arrays(
        np.column_stack([rng.random((2000, 2)), np.zeros(2000)]),
        np.column_stack([0.1 * rng.normal(size=(2000, 2)), np.ones(2000)]),
    )
    made = {}
    for truncate in ("false", "true"):
        text = f"min_rays=1,max_list_size=4,max_depth=60,truncate={truncate}"
        structure = build("ray_classification", scene, text)
        hits, _ = structure.trace(up)
        assert set(hits.primitive) <= {0, 201, 202, 203}
        made[truncate] = structure.made().cells
    assert made["true"] < 0.7 * made["false"]


def test_the_time_of_a_root_is_all_of_it(build):
    structure = build("ray_classification", moving())
    np.testing.assert_array_equal(structure.known.bounds[:, :, TIME], [[0.0, 1.0]] * ROOTS)


# ------------------------------------------------------------------------------ published shapes


def test_memory_and_gain_by_class_and_scene_are_as_published(build):
    """Beside a BSP tree: more memory on balls, most gain for primary and shadow rays, on teapot.

    A gain is the number of tests per ray of the one divided by that of the other. Arvo and Kirk
    1987; R. Jones and J. Davis as well.
    """
    gains, size = {}, WhittedSettings(width=128, height=128)
    for name in ("balls:size=3", "teapot:size=4"):
        scene, tests = make_sample(name), {}
        for kind in ("ray_classification", "bsp"):
            structure = build(kind, scene)
            tests[kind] = by_class(trace(Built(structure, 0.0), WhittedWorkload, size))
            if kind == "ray_classification":
                memory = structure.memory()
        if name.startswith("balls"):
            assert memory > 50 * structure.memory()
        gains[name.split(":")[0]] = {
            each: tests["bsp"][each]["N_IT"]["mean"]
            / tests["ray_classification"][each]["N_IT"]["mean"]
            for each in ("primary", "shadow", "reflected")
        }
    for gain in gains.values():
        assert min(gain["primary"], gain["shadow"]) > 1.2 * gain["reflected"]
    for each, gain in gains["balls"].items():
        assert gains["teapot"][each] > 2.0 * gain
