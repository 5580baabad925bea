"""Two levels: naive's hits over every bottom level, what is counted, what figures say, refits."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import ENTER, IN_VAIN, MASKED
from accelscope.core.contract.within import cells_with_instances
from accelscope.core.errors import InputError
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import ALL, ANY, Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.scene import Scene
from accelscope.core.scene.placing import by_objects
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.core.structures.two_level.settings import BOTTOMS
from accelscope.sample_scenes import make_sample
from test_instances import matrices, rays_through, scene_of


def built(spec, scene):
    name, texts = parse_spec(spec)
    kind = structure_named(name)
    return kind.build(scene, parse(kind.Settings, texts, spec))


def same_hits(structure, naive, rays, query=None):
    (hits, counts), (want, _) = structure.trace(rays, query), naive.trace(rays)
    np.testing.assert_array_equal(hits.t, want.t)
    np.testing.assert_array_equal(hits.primitive, want.primitive)
    return hits, counts


def check(spec, scene, rays):
    structure, naive = built(spec, scene), built("naive", scene)
    for query in (None, ALL):
        hits, counts = same_hits(structure, naive, rays, query)
        for index in range(3):
            steps = structure.record(rays, index, query)
            each = {name: int(values[index]) for name, values in counts.by_name().items()}
            assert steps.tally() == each
    any_hits, _ = structure.trace(rays, ANY)
    np.testing.assert_array_equal(any_hits.primitive >= 0, hits.primitive >= 0)
    assert structure.validate() == []
    return structure


SPECS = [
    "two_level", "two_level:rebraid=partial", "two_level:rebraid=partial,budget=3,room=0,extent=0",
]  # fmt: skip
MORE_SPECS = [
    *(f"two_level:blas={name}" for name in BOTTOMS if name != "bvh"),
    *(f"two_level:blas=kdtree,blas_settings='walk={walk},mailbox=true'"
      for walk in ("march", "segments", "neighbours", "heap", "recursive")),
    "two_level:blas=grid,blas_settings='mailbox=true,resolution=9x5x7'",
    "two_level:blas=octree,blas_settings='mailbox=true,assignment=box'",
    "two_level:shared=false", "two_level:shared=false,rebraid=partial",
    "two_level:blas_settings='volume=kdop14'", "two_level:blas_settings='volume=box_and_sphere'",
    "two_level:blas_settings='arity=8'", "two_level:blas_settings='builder=sbvh,max_leaf_size=1'",
    "two_level:tlas_settings='arity=4'", "two_level:tlas_settings='volume=sphere'",
    "two_level:tlas_settings='builder=ploc,max_leaf_size=1'",
]  # fmt: skip


@pytest.mark.parametrize(
    ("spec", "levels"),
    [
        *((spec, 1) for spec in SPECS),
        pytest.param(SPECS[1], 2, marks=pytest.mark.exhaustive),
        *(
            pytest.param(spec, levels, marks=pytest.mark.exhaustive)
            for spec in (SPECS[0], *MORE_SPECS)
            if "volume=box" not in spec
            for levels in (1, 2)
            if spec not in SPECS or levels > 1
        ),
    ],
)
def test_hits_are_naives(spec, levels):
    """Over mirrored, sheared and singular instances of two meshes."""
    scene = scene_of(levels)
    check(spec, scene, rays_through(scene))


def test_a_mailbox_within_takes_each_entry_for_another_ray():
    """Else the second instance of a mesh would read as met already."""
    scene = scene_of(1)
    spec = "two_level:blas=grid,blas_settings='mailbox=true,resolution=4x4x4'"
    structure = check(spec, scene, rays_through(scene, 500))
    _, counts = structure.trace(rays_through(scene, 500), ALL)
    assert counts["mailbox_hits_1"].sum() > 0
    assert (counts["instances_entered"] > 1).any()


@pytest.mark.parametrize("far", [1e3, 1e6, 1e9])
def test_rays_from_afar_lose_nothing_where_instances_are_opened(far):
    """Beyond some million sizes moving a ray rounds by more than boxes have room for."""
    scene = scene_of(1)
    rng = np.random.default_rng(3)
    structure = built("two_level:rebraid=partial,extent=0", scene)
    assert len(structure.braid.opened) > 0
    corners = scene.flat().triangles
    targets = corners[rng.integers(0, len(corners), 4000)]
    weights = rng.dirichlet(np.ones(3), 4000)
    weights[::2, 0] = 0.0  # on edges, whose boxes are grazed
    targets = (weights[:, :, None] * targets).sum(axis=1) / weights.sum(axis=1)[:, None]
    origins = targets + far * scene.diagonal * rng.normal(size=(4000, 3))
    hits, _ = same_hits(
        structure, built("naive", scene), Rays.from_arrays(origins, targets - origins)
    )
    assert (hits.primitive >= 0).mean() > 0.3


def test_threads_make_no_odds():
    scene = scene_of(1)
    rays = rays_through(scene, 2000)
    for spec in ("two_level:rebraid=partial", "two_level"):
        structure = built(spec, scene)
        want, counted = structure.trace(rays, threads=1)
        for threads in (2, 8):
            hits, counts = structure.trace(rays, threads=threads)
            np.testing.assert_array_equal(hits.t, want.t)
            np.testing.assert_array_equal(hits.primitive, want.primitive)
            np.testing.assert_array_equal(counts.values, counted.values)


# ------------------------------------------------------------------------------- closed forms

SQUARE = np.array([[[0.0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]])


def row(count, masks=255, step=2.0):
    """Squares at z = 0, 1, 2 ... above each other, moved by `step` along x from one to the next."""
    places = np.tile(np.eye(3, 4), (count, 1, 1))
    places[:, 0, 3], places[:, 2, 3] = step * np.arange(count), np.arange(count)
    return Scene.from_instances(
        instanced([all_triangles(SQUARE)], np.zeros(count, int), places, masks), "row"
    )


def down(x, count, mask=255):
    """Rays straight down at some x."""
    origins = np.tile([x, 0.6, 50.0], (count, 1))
    return Rays.from_arrays(origins, np.tile([0.0, 0, -1.0], (count, 1)), masks=mask)


@pytest.mark.parametrize("spec", ["two_level", "bvh", "two_level:rebraid=partial", "naive"])
def test_one_instance_apart_is_entered_once_and_not_in_vain(spec):
    _, counts = built(spec, row(5)).trace(down(4.3, 1))
    assert counts["instances_entered"].tolist() == [1]
    assert counts["entered_in_vain"].tolist() == [0]
    assert counts["masked_out"].tolist() == [0]
    assert counts["N_IT_1"].tolist() == [2]


def test_above_each_other_only_the_nearest_is_entered():
    """Its hit ends the search. Without stopping, all five are, and four of them in vain or not."""
    structure = built("two_level", row(5, step=0.0))
    for query, entered in ((None, 1), (ALL, 5)):
        _, counts = structure.trace(down(0.3, 3), query)
        assert counts["instances_entered"].tolist() == [entered] * 3
        assert counts["entered_in_vain"].tolist() == [0] * 3


def test_boxes_may_be_met_and_triangles_missed():
    """Of a triangle only: the other half of its box is empty."""
    mesh = all_triangles(SQUARE[:1])
    places = np.tile(np.eye(3, 4), (3, 1, 1))
    places[:, 2, 3] = [0.0, 1.0, 2.0]
    scene = Scene.from_instances(instanced([mesh], [0, 0, 0], places), "corners")
    for spec in ("two_level", "naive", "two_level:rebraid=partial"):
        _, counts = built(spec, scene).trace(down(0.3, 1))
        assert counts["instances_entered"].tolist() == [3]
        assert counts["entered_in_vain"].tolist() == [3]


def test_what_is_masked_out_is_counted_and_not_entered():
    scene = row(6, np.array([1, 2, 4, 1, 2, 4]), step=0.0)
    structure = built("naive", scene)  # it asks them all
    _, counts = structure.trace(down(0.3, 1, mask=2), ALL)
    assert counts["masked_out"].tolist() == [4]
    assert counts["instances_entered"].tolist() == [2]
    for spec in ("two_level", "two_level:rebraid=partial"):
        hits, counts = built(spec, scene).trace(down(0.3, 1, mask=2), ALL)
        assert hits.primitive[0] // 2 == 4  # each square is two triangles
        assert counts["masked_out"].tolist() == [4]
    steps = built("two_level", scene).record(down(0.3, 1, mask=2), 0, ALL)
    assert len(steps.events_of(MASKED)) == 4
    assert sorted(steps.primitive[steps.events_of(ENTER)].tolist()) == [1, 4]
    assert len(steps.events_of(IN_VAIN)) == 0


def test_counters_are_those_of_both_levels_apart():
    scene = scene_of(1)
    rays = rays_through(scene)
    names = built("two_level:blas=grid", scene).counters
    assert [each.name for each in names[4:]] == [
        "instances_entered", "entered_in_vain", "masked_out", "N_TS_1", "N_ETS_1", "N_EETS_1",
        "N_IT_1", "volume_tests_1", "mailbox_hits_1", "postponed_hits_1",
    ]  # fmt: skip
    _, two = built("two_level", scene).trace(rays)
    _, one = built("bvh", scene).trace(rays)
    np.testing.assert_array_equal(two.values, one.values)  # it has two levels, too


# ------------------------------------------------------------------------------------- figures


def test_the_cost_of_both_levels_is_what_random_lines_measure():
    """Inner nodes of both levels and tests, in the mean over lines that do not stop."""
    scene = make_sample("overlapping:spheres=6,segments=8,turned=true")
    from accelscope.core.sah.line_sample import random_lines

    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 20_000, 4))
    for spec, key in (("two_level", "sah_two_levels"), (SPECS[1], "sah_rebraided")):
        structure = built(spec, scene)
        _, counts = structure.trace(rays, ALL)
        inner = counts["N_TS"] - counts["N_ETS"] + counts["N_TS_1"] - counts["N_ETS_1"]
        cost = 1.2 * inner + counts["N_IT_1"]
        expected = structure.statistics().extra[key]
        error = cost.std() / np.sqrt(len(cost))
        assert abs(cost.mean() - expected) < 4 * error


def test_figures_of_instances_apart():
    structure = built("two_level", row(5))
    figures = structure.statistics().extra
    boxes = structure.scene.geometry.boxes
    root = surface_area(np.concatenate([structure.scene.lower, structure.scene.upper])[None])[0]
    assert figures["n_instances"] == 5
    assert figures["bottom_levels"] == 1
    assert figures["instances_overlapped"] == 0.0
    assert figures["expected_instances"] == pytest.approx(surface_area(boxes).sum() / root)
    assert figures["bytes_top"] + figures["bytes_bottom"] == structure.memory()
    assert "sah_rebraided" not in figures
    assert built("two_level", row(5, step=0.0)).statistics().extra["instances_overlapped"] == 0.0
    places = np.tile(np.eye(3, 4), (4, 1, 1))
    heap = Scene.from_instances(instanced([all_triangles(SQUARE)], [0] * 4, places), "heap")
    assert built("two_level", heap).statistics().extra["instances_overlapped"] == 3.0
    apart = built("two_level:shared=false", row(5))
    assert apart.statistics().extra["bottom_levels"] == 5
    assert apart.bytes_of_bottoms() > 4 * structure.bytes_of_bottoms()


def test_a_hundred_thousand_instances_take_no_more_than_200_bytes_each():
    """Measured over fewer, of which each takes as much."""
    count = 20_000
    rng = np.random.default_rng(9)
    mesh = all_triangles(make_sample("tetra:size=4").triangles)
    scene = Scene.from_instances(instanced([mesh], np.zeros(count), matrices(rng, count)), "many")
    structure = built("two_level", scene)
    assert structure.bytes_of_top() / count < 200.0


# -------------------------------------------------------------------------------- objects, refits


def test_objects_of_a_scene_of_triangles_are_instances():
    flat = make_sample("teapot_in_stadium:teapot_resolution=3")
    scene = by_objects(flat)
    assert len(scene) == 2
    assert by_objects(scene) is scene
    rays = rays_through(scene, 500)
    naive = built("naive", flat)
    for spec in SPECS:
        structure = built(spec, flat)
        assert len(structure.scene) == 2
        hits, _ = same_hits(structure, naive, rays)
    for primitive in np.unique(hits.primitive[hits.primitive >= 0])[:20].tolist():
        assert structure.scene.object_of(primitive)[0] == flat.object_of(primitive)[0]
    # Objects whose triangles do not follow each other are as many instances as they have runs.
    mixed = dataclasses.replace(flat, object_ids=(np.arange(len(flat)) // 100 % 2).astype(np.int32))
    assert len(by_objects(mixed)) == -(-len(flat) // 100)
    same_hits(built("two_level", mixed), built("naive", mixed), rays)


@pytest.mark.parametrize("spec", [SPECS[0], SPECS[1], "two_level:blas=grid"])
def test_a_refit_keeps_what_is_the_same_and_has_naives_hits(spec):
    before = scene_of(1)
    structure = built(spec, before)
    geometry = before.geometry
    moved = geometry.matrices + 0.3 * np.random.default_rng(5).normal(size=geometry.matrices.shape)
    bent = geometry.meshes[1].corners * [1.0, 1.1, 0.8]
    meshes = [all_triangles(geometry.meshes[0].corners.copy()), all_triangles(bent)]
    after = Scene.from_instances(instanced(meshes, geometry.which, moved), "moved")
    refitted = structure.refitted(after)
    assert refitted.bottoms[0][1] is structure.bottoms[0][1]
    assert refitted.bottoms[1][1] is not structure.bottoms[1][1]
    assert refitted.validate() == []
    same_hits(refitted, built("naive", after), rays_through(after))
    with pytest.raises(InputError, match="a refit needs the same ones"):
        structure.refitted(scene_of(1, np.random.default_rng(8)))


# -------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("two_level:tlas_settings='leaf=3'", "tlas_settings: bvh has no setting 'leaf'"),
        ("two_level:blas=grid,blas_settings='builder=ploc'", "blas_settings: grid has no setting"),
        ("two_level:blas=grid,blas_settings='lazy=true'", "choose lazy=false"),
        ("two_level:blas=octree,blas_settings='storage=hash'", "storage=pointer"),
        ("two_level:blas=kdtree,blas_settings='walk=neighbours,links=stored'", "links=found"),
        ("two_level:rebraid=partial,blas_settings='arity=4'", "leave volume and arity out"),
        ("two_level:rebraid=partial,blas_settings='volume=sphere'", "leave volume and arity out"),
    ],
)
def test_what_cannot_be_is_said(spec, message):
    with pytest.raises(InputError, match=message):
        built(spec, scene_of(1))


@pytest.mark.parametrize("blas", BOTTOMS)
def test_cells_within_are_drawn_of_every_bottom_level(blas):
    scene = scene_of(1)
    structure = built(f"two_level:blas={blas}", scene)
    cells = cells_with_instances(structure)
    within = cells.extra["level"] == 1
    stored = sum(len(bottom.cells()) for _, bottom in structure.bottoms)
    assert within.sum() == stored
    assert cells.is_dashed.sum() == len(scene)
    # Every one of them has a parent but the roots, whose parents are boxes of instances.
    numbers = {int(number): place for place, number in enumerate(cells.numbers)}
    for place in np.flatnonzero(within)[:: max(stored // 50, 1)]:
        parent = numbers[int(cells.parents[place])]
        assert cells.is_dashed[parent] or cells.extra["level"][parent] == 1
