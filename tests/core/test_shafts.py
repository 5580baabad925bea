"""5D shafts: classes of rays, cuts through the tree, the hits of naive, and fewer steps."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.kernels import call, kernel
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.core.structures import structures
from accelscope.core.structures.ray_classification.beam import MOST_PLANES, bound_beam
from accelscope.core.structures.ray_classification.ray_space import ROOTS, U, V
from accelscope.core.structures.shafts import Shafts, ShaftsSettings
from accelscope.core.structures.shafts.cut import PAYS, scratch_for
from accelscope.core.structures.shafts.walk import FROM_ROOT
from ray_space_cases import awkward, members, moving

VARIANTS = (
    "",
    "max_starts=1",
    "max_starts=2,origin_cells=3",
    "max_starts=200,origin_cells=5,direction_cells=7",
    "origin_cells=1,direction_cells=1",
)


def shafts_over(scene, **settings):
    return Shafts.build(scene, ShaftsSettings(**settings))


def rays_within(scene, count, seed=2):
    """Rays from points of the box to others."""
    begin, end = scene.lower + np.random.default_rng(seed).random((2, count, 3)) * (
        scene.upper - scene.lower
    )
    return Rays.from_arrays(begin, end - begin)


def on_borders(structure, count=400):
    """Rays that begin on borders of the grid's cells, and go along borders of squares."""
    rng = np.random.default_rng(9)
    classes = structure.arrays.classes
    low, high, n = classes.box[0, :3], classes.box[0, 3:], classes.squares
    origins = low + rng.integers(0, classes.grid + 1, (count, 3)) / classes.grid * (high - low)
    directions = 2.0 * rng.integers(0, n + 1, (count, 3)) / n - 1.0
    directions[np.arange(count), rng.integers(3, size=count)] = rng.choice([-1.0, 1.0], count)
    off = rng.choice([0.0, 1e-16, -1e-16, 1e-9], (count, 3))
    return Rays.from_arrays(origins * (1.0 + off), directions * (1.0 + off[::-1]))


# ------------------------------------------------------------------------------------- classes


@kernel
def planes_of(root, bounds, planes):
    """Return how many half-spaces bound a shaft."""
    return bound_beam(root, bounds, planes)


def test_members_of_a_class_lie_inside_all_half_spaces_of_its_shaft(lab):
    """200,000 rays of classes, from corners and edges as well, and points along them."""
    structure = shafts_over(lab.small_scene("sombrero"), origin_cells=6, direction_cells=5)
    rng = np.random.default_rng(4)
    numbers = rng.choice(len(structure.arrays.rows), 400)
    bounds, roots = structure.bounds_of(numbers)
    planes, slack = np.zeros((MOST_PLANES, 4)), structure.arrays.slack
    for ends, root in zip(bounds, roots.tolist(), strict=True):
        count = call(planes_of, root, ends, planes)
        origins, directions = members(rng, root, ends, 500)
        passed = origins + rng.exponential(1.0, (500, 1)) * directions
        heights = passed @ planes[:count, :3].T - planes[:count, 3]
        assert (heights <= slack).all()
        touched = (origins @ planes[:count, :3].T - planes[:count, 3]).max(axis=0)
        np.testing.assert_allclose(touched, 0.0, atol=slack)


@pytest.mark.parametrize("text", VARIANTS)
def test_a_ray_is_of_the_class_whose_intervals_hold_it(build, lab, text):
    structure = build("shafts", lab.small_scene("sombrero"), text)
    rays = rays_within(structure.scene, 3000)
    numbers = structure.classes_of(rays)
    bounds, roots = structure.bounds_of(numbers)
    axis = roots // 2
    row = np.arange(len(rays))
    along = rays.directions[row, axis]
    np.testing.assert_array_equal(along < 0.0, roots % 2 == 1)
    np.testing.assert_array_equal(np.abs(along), np.abs(rays.directions).max(axis=1))
    point = np.zeros((len(rays), 6))
    point[:, :3] = rays.origins
    for which, slope in ((1, U), (2, V)):
        point[:, slope] = rays.directions[row, (axis + which) % 3] / np.abs(along)
    assert (bounds[:, 0] <= point + 1e-12).all()
    assert (point <= bounds[:, 1] + 1e-12).all()


def test_classes_fill_ray_space(lab):
    """Each has a place of its own, and there are as many as the figures say."""
    structure = shafts_over(lab.small_scene("sombrero"), origin_cells=3, direction_cells=2)
    count = structure.statistics().extra["classes"]
    bounds, roots = structure.bounds_of(np.arange(count))
    assert len(np.unique(np.column_stack([bounds.reshape(count, -1), roots]), axis=0)) == count
    shares = (bounds[:, 1, :5] - bounds[:, 0, :5]).prod(axis=1)
    scene = structure.scene
    assert shares.sum() == pytest.approx(ROOTS * 4.0 * np.prod(scene.upper - scene.lower))
    # The middle of each is of that class.
    middle, row = bounds.mean(axis=1), np.arange(count)
    directions = np.empty((count, 3))
    directions[row, roots // 2] = np.where(roots % 2 == 0, 1.0, -1.0)
    directions[row, (roots // 2 + 1) % 3] = middle[:, U]
    directions[row, (roots // 2 + 2) % 3] = middle[:, V]
    numbers = structure.classes_of(Rays.from_arrays(middle[:, :3], directions))
    np.testing.assert_array_equal(numbers, row)


# --------------------------------------------------------------------------- the hits of naive


def check(build, structure):
    scene = structure.scene
    rays, naive = awkward(scene), build("naive", scene)
    some = on_borders(structure)
    rays = Rays.from_arrays(
        np.concatenate([rays.origins, some.origins]),
        np.concatenate([rays.directions, some.directions]),
        t_min=np.concatenate([rays.t_min, some.t_min]),
        times=np.concatenate([rays.times, some.times]),
    )
    want, _ = naive.trace(rays)
    # Rays that end at their hit, and right before it.
    t_max = np.where(np.isfinite(want.t), want.t, np.inf)
    for ends in (np.full(len(rays), np.inf), t_max, np.nextafter(t_max, 0.0)):
        rays.t_max[:] = np.maximum(ends, rays.t_min)
        want, _ = naive.trace(rays)
        for query in (None, ALL):
            hits, _ = structure.trace(rays, query)
            np.testing.assert_array_equal(hits.t, want.t)
            np.testing.assert_array_equal(hits.primitive, want.primitive)
        blocked, _ = structure.trace(rays, ANY)
        np.testing.assert_array_equal(blocked.primitive >= 0, want.primitive >= 0)
    assert structure.validate() == []


@pytest.mark.parametrize("text", VARIANTS)
def test_awkward_rays(build, lab, text):
    check(build, build("shafts", lab.small_scene("sombrero"), text))


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", VARIANTS)
def test_awkward_rays_of_every_sample(build, lab, scene_name, text):
    check(build, build("shafts", lab.small_scene(scene_name), text))


@pytest.mark.parametrize("own", ["volume=kdop14", "builder=sbvh,max_leaf_size=1", "volume=sphere"])
def test_awkward_rays_through_other_trees(build, lab, own):
    check(build, shafts_over(lab.small_scene("mess"), bvh_settings=own))


def test_what_moves(build):
    check(build, shafts_over(moving()))


@pytest.mark.parametrize("name", ["overlapping", "csg_plate"])
def test_instances_and_trees_of_solids(build, lab, name):
    check(build, shafts_over(lab.small_scene(name)))


def test_counters_are_those_of_the_ray_alone(build, lab):
    """Whatever threads, order, and rays before; and a recorded walk is what was counted."""
    scene = lab.small_scene("sombrero")
    rays = awkward(scene)
    shuffled = np.random.default_rng(1).permutation(len(rays))
    as_given, runs = np.arange(len(rays)), []
    for which, threads in ((as_given, 1), (shuffled, 2), (shuffled, 8)):
        structure = build("shafts", scene)
        hits, counts = structure.trace(rays.select(which), threads=threads)
        back = np.argsort(which)
        runs.append((hits.t[back], hits.primitive[back], counts.values[back]))
    in_parts = build("shafts", scene)
    for part in np.array_split(as_given, 5):
        made = in_parts.made().cells
        _, counts = in_parts.trace(rays.select(part))
        np.testing.assert_array_equal(counts.values, runs[0][2][part])
    assert in_parts.made().cells > made
    for run in runs[1:]:
        for values, expected in zip(run, runs[0], strict=True):
            np.testing.assert_array_equal(values, expected)
    for index in range(0, len(rays), 97):
        assert list(structure.record(rays, index).tally().values()) == runs[0][2][index].tolist()


# ---------------------------------------------------------------------------------------- cuts


def ancestors(structure):
    """The nodes above each node, and itself, (n_nodes, depth) int; -1 beyond the root."""
    parents = np.append(structure.bvh.parents(), -1)
    rows = [np.arange(len(parents) - 1)]
    while (rows[-1] >= 0).any():
        rows.append(parents[rows[-1]])
    return np.stack(rows, axis=1)


def leaf_of_items(structure):
    """The leaf of each item."""
    tree = structure.arrays.tree
    leaves = np.flatnonzero(tree.size > 0)
    leaf = np.empty(len(structure.geometry.ids), np.int64)
    for number in leaves.tolist():
        items = slice(tree.first[number], tree.first[number] + tree.size[number])
        leaf[structure.geometry.ids[items]] = number
    return leaf


def check_starts(build, structure, count, rays):
    """All that rays of random classes hit, one thing after the other, lies below a start."""
    structure.trace(rays)
    rng = np.random.default_rng(2)
    made = np.flatnonzero(structure.arrays.rows >= 0)
    numbers = rng.choice(made, min(count, len(made)), replace=False)
    bounds, roots = structure.bounds_of(numbers)
    each_class, own = zip(roots.tolist(), bounds, strict=True), max(20, 4000 // len(numbers))
    parts = [members(rng, root, ends, own) for root, ends in each_class]
    rays = Rays.from_arrays(*(np.concatenate(each) for each in zip(*parts, strict=True)))
    starts = structure.arrays.starts[structure.arrays.rows[np.repeat(numbers, own)]]
    above, leaf = ancestors(structure), leaf_of_items(structure)
    naive, left, met = build("naive", structure.scene), np.arange(len(rays)), 0
    while len(left):
        hits, _ = naive.trace(rays.select(left))
        is_hit = hits.primitive >= 0
        left, items, ts = left[is_hit], hits.primitive[is_hit], hits.t[is_hit]
        nodes = above[leaf[items]]
        below = (nodes[:, :, None] == starts[left][:, None, :]) & (nodes[:, :, None] >= 0)
        assert (below.sum(axis=(1, 2)) == 1).all()
        met += len(left)
        rays.t_min[left] = np.nextafter(ts, np.inf)
    return met


@pytest.mark.parametrize("text", VARIANTS)
def test_starts_are_conservative(build, lab, text):
    structure = build("shafts", lab.small_scene("sombrero"), text)
    assert check_starts(build, structure, 300, awkward(structure.scene)) > 500


@pytest.mark.exhaustive
def test_starts_are_conservative_for_a_million_rays(build, lab, sample_of_triangles):
    structure = build("shafts", lab.small_scene(sample_of_triangles))
    check_starts(build, structure, 50_000, rays_within(structure.scene, 200_000))


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", VARIANTS[1:])
def test_starts_of_any_setting_are_conservative_for_a_million_rays(build, lab, text):
    structure = build("shafts", lab.small_scene("sombrero"), text)
    check_starts(build, structure, 100_000, rays_within(structure.scene, 900_000))


def test_starts_are_in_order_and_opened_where_that_pays(lab):
    """No closed inner node is met by more than a third of the class, if there is room."""
    structure = shafts_over(lab.small_scene("sombrero"), max_starts=200, origin_cells=4)
    structure.trace(rays_within(structure.scene, 3000))
    boxes, size = structure.arrays.boxes, structure.arrays.tree.size
    made = np.flatnonzero(structure.arrays.rows >= 0)[::20]
    bounds, roots = structure.bounds_of(made)
    opened = 0
    for number, ends, root in zip(made.tolist(), bounds, roots.tolist(), strict=True):
        starts, axis = structure.starts_of(number), root // 2
        nearest = boxes[starts, axis] if root % 2 == 0 else -boxes[starts, 3 + axis]
        assert (np.diff(nearest) >= 0.0).all()
        places = scratch_for(1).places
        at = ends[0, :5] + places * (ends[1, :5] - ends[0, :5])
        directions = np.empty((len(at), 3))
        directions[:, axis] = 1.0 if root % 2 == 0 else -1.0
        directions[:, (axis + 1) % 3], directions[:, (axis + 2) % 3] = at[:, U], at[:, V]
        low, high = ((boxes[starts][:, None, side : side + 3] - at[:, :3]) / directions
                     for side in (0, 3))  # fmt: skip
        enter = np.minimum(low, high).max(axis=2).clip(0.0)
        chance = (enter <= np.maximum(low, high).min(axis=2)).mean(axis=1)
        assert (chance[size[starts] == 0] <= PAYS).all()
        opened += len(starts) > 1
    assert opened > 10


def test_a_cut_that_is_none_is_told(lab):
    structure = shafts_over(lab.small_scene("sombrero"), origin_cells=4)
    structure.trace(rays_within(structure.scene, 500))
    assert structure.validate() == []
    starts, tree = structure.arrays.starts, structure.arrays.tree
    row = FROM_ROOT + 1 + int(np.argmax((starts[FROM_ROOT + 1 :] >= 0).sum(axis=1)))
    before = starts[row].copy()
    starts[row, 1] = starts[row, 0]
    assert structure.validate() == ["a class has a start twice"]
    starts[row] = before
    starts[row, 1] = tree.root
    assert structure.validate() == ["a class has a start below another"]


# -------------------------------------------------------------------------------------- effort


def work_of(structure, rays):
    """Steps and volume tests of rays, in the mean."""
    means = structure.trace(rays)[1].means()
    return means["N_TS"] + means["volume_tests"]


def workloads_of(scene):
    """Rays from a camera, between points of the box, through it, and from what is hit first."""
    from accelscope.core.evaluation.rays.workloads import CameraSettings, camera_of, random_lines

    seen = camera_rays(camera_of(scene, CameraSettings()), 60, 60)
    within = rays_within(scene, 4000)
    lines = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 4000, 1))
    naive = structures()["bvh"].build(scene, structures()["bvh"].Settings())
    hits, _ = naive.trace(within)
    is_hit = hits.primitive >= 0
    places = within.origins[is_hit] + hits.t[is_hit, None] * within.directions[is_hit]
    ways = np.random.default_rng(5).normal(size=places.shape)
    again = [Rays.from_arrays(places, ways)] if len(places) else []
    shadow = Rays.from_arrays(within.origins, within.directions, t_max=1.0, queries=ANY)
    return [seen, within, lines, shadow, *again]


@pytest.mark.parametrize("name", ["sombrero", "mess"])
def test_no_more_work_than_from_the_root_and_less_with_longer_arrays(lab, name):
    scene = lab.small_scene(name)
    kinds = [shafts_over(scene, max_starts=most) for most in (1, 4, 16)]
    for rays in workloads_of(scene):
        from_root = work_of(kinds[0].bvh, rays)
        work = [work_of(kind, rays) for kind in kinds]
        assert from_root >= work[0] >= work[1] >= work[2]


@pytest.mark.exhaustive
def test_a_quarter_less_in_the_mean_over_samples(lab):
    shares = []
    for name in lab.SCENES:
        structure = shafts_over(lab.small_scene(name))
        for rays in workloads_of(structure.scene):
            shares.append(work_of(structure, rays) / work_of(structure.bvh, rays))
            assert shares[-1] <= 1.0, name
    assert np.mean(shares) < 0.75


# ------------------------------------------------------------------------------------ refusals


def test_what_cannot_be_is_said(lab):
    scene = lab.small_scene("one")
    for own, message in (
        ("arity=4", "walks start in binary trees; leave arity=4 out"),
        ("padding=1", "structure shafts, bvh_settings: bvh has no setting 'padding'"),
        ("builder", "'builder' in 'bvh:builder' is not of the form key=value"),
    ):
        with pytest.raises(InputError, match=message):
            shafts_over(scene, bvh_settings=own)
    with pytest.raises(InputError, match="lower origin_cells or direction_cells"):
        shafts_over(lab.small_scene("cubes"), origin_cells=256, direction_cells=256)
