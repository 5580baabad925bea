"""Rays sorted by where they enter the scene: results are those in the caller's order."""

import numpy as np
import pytest
from accelscope.addon import interface as accelscope
from accelscope.core.contract import ray_order
from accelscope.core.contract.ray_order import (
    AS_GIVEN,
    AUTOMATIC,
    CODES,
    LARGE,
    LARGE_SCENE,
    SORTED,
    are_out_of_order,
    encode_entries,
    order_of,
    sort_by_counting,
)
from accelscope.core.evaluation.rays.workloads import (
    CameraSettings,
    CameraWorkload,
    RandomLinesSettings,
    RandomLinesWorkload,
    random_lines,
)
from accelscope.core.evaluation.records.experiment import trace_rays
from accelscope.core.geometry.rays import ANY, CLOSEST, Rays
from accelscope.core.kernels import call, has_numba, plain
from accelscope.core.progress import SILENT
from accelscope.core.structures import general_structures, structures
from accelscope.sample_scenes import make_sample

needs_numba = pytest.mark.skipif(not has_numba(), reason="plain Python sorts no rays")


def box_of(scene):
    return np.concatenate([scene.lower, scene.upper])


def codes_of(rays, box):
    codes = np.full(len(rays), -1, np.int32)
    call(encode_entries, rays.arrays(), box, codes, 0, len(rays))
    return codes


@needs_numba
@pytest.mark.parametrize("spec", [*general_structures(), "grid:lazy=true", "octree:lazy=true",
                                  "kdtree:mailbox=true", "bvh:arity=8"])  # fmt: skip
def test_hits_and_counters_are_the_callers(lab, build, spec):
    scene = lab.small_scene("suzanne")
    rays, _ = lab.batch_of(lab.ray_families(scene, 30))
    name, _, text = spec.partition(":")
    found = {}
    for order in (AS_GIVEN, SORTED):
        for threads in (1, 2, 8):
            structure = build(name, scene, text)
            hits, counts = structure.trace(rays, threads=threads, ray_order=order)
            found[order, threads] = hits.t, hits.primitive, counts.values
    order = order_of(rays.arrays(), box_of(scene), 1, SORTED, 1, SILENT)
    assert (np.diff(order) != 1).any(), "nothing was sorted"
    want = found.pop((AS_GIVEN, 1))
    for got in found.values():
        for values, wanted in zip(got, want, strict=True):
            assert np.array_equal(values, wanted)


@needs_numba
def test_instances_masks_times_and_queries_go_with_their_rays():
    suzanne = make_sample("suzanne:subdivisions=0")
    places = np.tile(np.eye(3, 4), (5, 1, 1))
    places[:, 0, 3] = 3.0 * np.arange(5)
    scene = accelscope.instances([suzanne], np.zeros(5, np.int32), places, masks=[1, 2, 3, 4, 255])
    built = accelscope.build(scene, "bvh")
    rng, n = np.random.default_rng(1), 4000
    origins, directions = random_lines(scene.lower, scene.upper, n, 1)
    t_min = 25.0 + 10.0 * rng.random(n)  # the lines begin far away
    rays = Rays.from_arrays(
        origins, directions, t_min + 10.0 * rng.random(n), t_min=t_min,
        queries=rng.choice([CLOSEST, ANY], n), masks=rng.choice([1, 2, 4, 255], n),
        times=rng.random(n),
    )  # fmt: skip
    want, want_counts = built.structure.trace(rays, ray_order=AS_GIVEN)
    got, counts = built.structure.trace(rays, ray_order=SORTED)
    assert np.array_equal(got.t, want.t)
    assert np.array_equal(got.primitive, want.primitive)
    assert np.array_equal(counts.values, want_counts.values)
    assert 0 < np.isfinite(want.t).mean() < 1


def test_sorting_is_stable_and_complete():
    codes = np.random.default_rng(1).integers(CODES, size=5000).astype(np.int32)
    codes[:10], codes[10:20] = 0, CODES - 1
    order = np.empty(len(codes), np.int32)
    call(sort_by_counting, codes, np.zeros(CODES + 1, np.int64), order)
    assert np.array_equal(order, np.argsort(codes, kind="stable"))


def test_codes_say_where_a_ray_enters_and_whereto():
    box = np.array([0.0, 0, 0, 16, 16, 16])
    inside = np.array([[0.5, 0.5, 0.5], [15.5, 0.5, 0.5], [0.5, 15.5, 0.5], [0.5, 0.5, 15.5]])
    along_z = np.tile([0.0, 0.0, 1.0], (4, 1))
    assert codes_of(Rays.from_arrays(inside, along_z), box).tolist() == [
        1, 0b100100100100 << 3 | 1, 0b010010010010 << 3 | 1, 0b001001001001 << 3 | 1,
    ]  # fmt: skip
    # From outside it is where it enters, and t_min may lie behind that.
    outside = Rays.from_arrays(np.tile([0.5, 0.5, -9.0], (2, 1)), along_z[:2], t_min=[0.0, 24.5])
    assert codes_of(outside, box).tolist() == [1, 0b001001001001 << 3 | 1]
    backwards = Rays.from_arrays(np.array([[0.5, 0.5, 99.0]]), np.array([[0.0, 0.0, -1.0]]))
    assert codes_of(backwards, box).tolist() == [0b001001001001 << 3]


@pytest.mark.parametrize("name", ["suzanne", "flat", "one", "mess"])
def test_codes_of_awkward_rays_are_codes_and_the_same_in_plain_python(lab, name):
    scene = lab.small_scene(name)
    rays, _ = lab.batch_of(lab.ray_families(scene, 8))
    codes = codes_of(rays, box_of(scene))
    assert codes.min() >= 0
    assert codes.max() < CODES
    with plain(True):
        assert np.array_equal(codes_of(rays, box_of(scene)), codes)


@needs_numba
def test_large_batches_without_an_order_are_sorted():
    scene = make_sample("suzanne:subdivisions=0")
    lines = RandomLinesWorkload.make(scene, RandomLinesSettings(count=LARGE)).arrays()
    camera = CameraWorkload.make(scene, CameraSettings(width=200, height=200)).arrays()
    few = type(lines)(*(column[: LARGE - 1] for column in lines))
    box = box_of(scene)
    assert are_out_of_order(lines, box)
    assert not are_out_of_order(camera, box)
    assert order_of(camera, box, LARGE_SCENE, AUTOMATIC, 1, SILENT) is None
    assert order_of(lines, box, LARGE_SCENE - 1, AUTOMATIC, 1, SILENT) is None
    assert order_of(few, box, LARGE_SCENE, AUTOMATIC, 1, SILENT) is None
    assert order_of(lines, box, LARGE_SCENE, AS_GIVEN, 1, SILENT) is None
    order = order_of(lines, box, LARGE_SCENE, AUTOMATIC, 1, SILENT)
    assert order is not None
    assert np.array_equal(np.sort(order), np.arange(LARGE))
    with plain(True):
        assert order_of(lines, box, 1, SORTED, 1, SILENT) is None


@needs_numba
def test_the_setting_of_the_rays_decides(monkeypatch):
    built = accelscope.build(make_sample("suzanne:subdivisions=0"), "bvh")
    asked = []
    real = ray_order.order_of
    monkeypatch.setattr(
        "accelscope.core.contract.structure.order_of",
        lambda rays, box, items, choice, *more: (
            asked.append(choice) or real(rays, box, items, choice, *more)
        ),
    )
    for order in (AUTOMATIC, SORTED, AS_GIVEN):
        settings = RandomLinesSettings(count=100, order=order)
        rays = RandomLinesWorkload.make(built.structure.scene, settings)
        trace_rays(built, RandomLinesWorkload, settings, rays)
    accelscope.trace(built, accelscope.rays(rays.origins, rays.directions), order=SORTED)
    accelscope.trace(built, "random_lines:count=9,order=as_given")
    assert asked == [AUTOMATIC, SORTED, AS_GIVEN, SORTED, AS_GIVEN]


@needs_numba
def test_rays_go_through_in_their_order(monkeypatch):
    scene = make_sample("suzanne:subdivisions=0")
    structure = structures()["bvh"].build(scene, structures()["bvh"].Settings())
    rays = RandomLinesWorkload.make(scene, RandomLinesSettings(count=500))
    gone = []
    real = ray_order.taken
    monkeypatch.setattr(
        "accelscope.core.contract.structure.taken",
        lambda batch, numbers: gone.append(numbers.copy()) or real(batch, numbers),
    )
    structure.trace(rays, threads=1, ray_order=AS_GIVEN)
    assert not gone
    structure.trace(rays, threads=1, ray_order=SORTED)
    codes = codes_of(rays, box_of(scene))
    assert np.array_equal(np.concatenate(gone), np.argsort(codes, kind="stable"))
