"""Ray coherence: the bound, the lists of cells, and the hits of naive."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import workload_named
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.geometry.solids.description import Sphere
from accelscope.core.kernels import call, kernel
from accelscope.core.scene import SUN, Scene
from accelscope.core.structures.directional.faces import cube
from accelscope.core.structures.ray_coherence.condition import (
    EXACT,
    LECTURE,
    Window,
    cosine,
    meets_window,
    solid_angle,
)
from accelscope.core.structures.ray_coherence.making import mark_items
from accelscope.sample_scenes import make_sample, samples
from coherence_cases import CLASSES, COHERENCE, area_light, unit
from directional_cases import lit, shadow_rays_of
from ray_space_cases import moving

# --------------------------------------------------------------------------------- the bound


def rays_between(rng, one, other, count):
    """Rays from points of one ball to points of another, each a centre and a radius."""
    ends = [
        ball[:3] + ball[3] * unit(rng, count) * rng.choice([1.0, rng.random()], (count, 1))
        for ball in (one, other)
    ]
    return ends[0], ends[1] - ends[0]


def test_the_bound_is_attained():
    """REFERENCE.md 0.1: R = 1 and 2, d = 10."""
    assert cosine(3.0, 10.0, EXACT) == pytest.approx(0.95394, abs=5e-6)
    assert cosine(3.0, 10.0, LECTURE) == pytest.approx(0.83666, abs=5e-6)
    assert cosine(3.0, 3.0, EXACT) == cosine(3.0, 2.0, LECTURE) == -1.0
    rng, way = np.random.default_rng(1), np.array([0.0, 0.0, 1.0])
    _, d = rays_between(rng, np.array([0, 0, 0, 1.0]), np.array([0, 0, 10, 2.0]), 200_000)
    cosines = d @ way / np.linalg.norm(d, axis=1)
    assert 0.95394 < cosines.min() < 0.955
    # The common inner tangent: at right angles to both radii, which point away from each other.
    sine, least = 0.3, float(cosine(3.0, 10.0, EXACT))
    begin = np.array([least, 0.0, sine])
    end = np.array([0.0, 0.0, 10.0]) - 2.0 * begin
    tangent = end - begin
    assert tangent @ begin == pytest.approx(0.0, abs=1e-12)
    assert tangent @ way / np.linalg.norm(tangent) == pytest.approx(least, abs=1e-15)


@pytest.mark.parametrize(("share", "times"), [(0.1, 10.2), (0.2, 5.2), (0.5, 2.2)])
def test_without_the_square_the_cap_is_so_many_times_as_large(share, times):
    caps = [float(solid_angle(cosine(share, 1.0, bound))) for bound in (LECTURE, EXACT)]
    assert caps[0] / caps[1] == pytest.approx(times, abs=0.05)


# --------------------------------------------------------------------------------- the cells


@kernel
def look(window, x, y, z, squared):
    """Return whether a cell has a direction within an angle."""
    return meets_window(window, x, y, z, squared)


def directions_through(face, u, v):
    back = cube(np.zeros(3)).back[face]
    d = u[..., None] * back[0] + v[..., None] * back[1] + back[2]
    return d / np.linalg.norm(d, axis=-1, keepdims=True)


def test_a_cell_meets_a_cap_if_one_of_its_directions_is_in_it():
    """Against the nearest of many directions of the cell; between them it may be a little less."""
    rng, seen, grid = np.random.default_rng(2), 0, np.linspace(0.0, 1.0, 33)
    for _ in range(1000):
        face, (u0, u1), (v0, v1) = int(rng.integers(6)), *np.sort(rng.uniform(-1, 1, (2, 2)))
        u, v = np.meshgrid(u0 + grid * (u1 - u0), v0 + grid * (v1 - v0))
        way = unit(rng, 1)[0]
        if rng.random() < 0.5:  # near the cell
            way = directions_through(face, u, v)[rng.integers(33), rng.integers(33)]
            way = way + rng.choice([0.01, 0.3]) * unit(rng, 1)[0]
        angle = rng.uniform(0.0, 0.5) * np.pi * rng.choice([1.0, 0.1])
        cosines = directions_through(face, u, v) @ (way / np.linalg.norm(way))
        least = float(np.arccos(np.clip(cosines.max(), -1.0, 1.0)))
        window = Window(face, float(u0), float(v0), float(u1), float(v1))
        is_met = call(look, window, *(7.0 * way).tolist(), float(np.sin(angle) ** 2))
        if least <= angle:
            assert is_met
        if is_met:
            assert least <= angle + 0.06
        seen += is_met
    assert 200 < seen < 800


@pytest.mark.parametrize("bound", [EXACT, LECTURE])
@pytest.mark.parametrize("name", ["mess", "suzanne", "balls", "one"])
def test_the_tree_finds_what_all_pairs_do(build, lab, name, bound):
    scene = lit(lab.small_scene(name))
    structure = build(COHERENCE, scene, f"cells=3,light_cells=3,bound={bound}")
    cubes = structure.arrays
    for sphere in (0, len(scene) // 2, len(scene) - 1, len(scene), len(scene) + 1):
        found = np.zeros((54, len(scene)), np.bool_)
        for cell in range(54):
            call(mark_items, cubes, sphere, cell, bound == EXACT, found[cell])
        distances = np.linalg.norm(cubes.balls[: len(scene), :3] - cubes.balls[sphere, :3], axis=1)
        gaps = distances - cubes.balls[: len(scene), 3] - cubes.balls[sphere, 3]
        for cell in range(54):
            items, nearest = structure.list_of(sphere, cell)
            assert sorted(items.tolist()) == np.flatnonzero(found[cell]).tolist()
            assert (np.diff(nearest) >= 0.0).all()
            assert (nearest <= gaps[items]).all()
    assert structure.validate() == []


def test_spheres_hold_their_items(build, lab):
    """Those of triangles touch two corners or three, that of a ball is itself."""
    scene = lab.small_scene("suzanne")
    balls = build(COHERENCE, scene).arrays.balls[: len(scene)]
    away = np.linalg.norm(scene.triangles - balls[:, None, :3], axis=2) / balls[:, 3:]
    assert away.max() <= 1.0
    assert (np.sort(away, axis=1)[:, 1] > 1.0 - 1e-9).all()
    ball = Scene.from_items([Sphere(np.array([1.0, 2.0, 3.0]), 0.5)], "ball")
    np.testing.assert_allclose(build(COHERENCE, ball).arrays.balls, [[1, 2, 3, 0.5]], rtol=1e-11)


# --------------------------------------------------------------------------- the hits of naive

VARIANTS = ("", "cells=1,light_cells=1", "cells=5,bound=lecture,light_cells=7",
            "cells=4,most_references=9000", "cells=32")  # fmt: skip


def leaving(scene, structure, count=300):
    """Rays that leave items: from inside, from the border of the sphere, along borders of cells.

    Some go along common inner tangents, some say that they leave what they do not leave.
    """
    rng = np.random.default_rng(8)
    balls = structure.arrays.balls[: len(scene)]
    parts = []
    for kind in range(6):
        own, other = balls[rng.integers(len(scene), size=(2, count))]
        sources = rng.integers(len(scene), size=count)
        own = balls[sources]
        radius = rng.choice([0.0, 1.0, rng.random()], count)
        origins = own[:, :3] + (radius * own[:, 3])[:, None] * unit(rng, count)
        slopes = rng.integers(-8, 9, (count, 3)) / 8.0
        slopes[np.arange(count), rng.integers(3, size=count)] = rng.choice([-1.0, 1.0], count)
        directions = unit(rng, count) * 10.0 ** rng.integers(-3, 4, (count, 1))
        if kind in (1, 2):
            directions = slopes
        elif kind == 3:
            directions = tangents(rng, own, other, origins)
        elif kind == 4:
            corners = scene.boxes()[rng.integers(len(scene), size=count)].reshape(-1, 2, 3)[:, 0]
            directions = corners - origins
        elif kind == 5:
            sources = rng.integers(-1, len(scene) + 3, size=count)
        directions[~directions.any(axis=1)] = 1.0
        parts.append((origins, directions, sources))
    origins, directions, sources = (np.concatenate(each) for each in zip(*parts, strict=True))
    total = len(origins)
    if len(structure.arrays.starts):  # the first primitive of each instance
        sources = np.append(structure.arrays.starts, [-1] * 4)[sources]
    starts = np.where(rng.random(total) < 0.2, rng.random(total), 0.0)
    ends = np.where(rng.random(total) < 0.2, starts + rng.random(total), np.inf)
    return Rays.from_arrays(
        origins, directions, ends, t_min=starts, sources=sources, times=rng.random(total),
        class_names=CLASSES,
    )  # fmt: skip


def tangents(rng, own, other, origins):
    """Directions along common inner tangents of spheres; the origins are moved to these."""
    way = other[:, :3] - own[:, :3]
    distance = np.linalg.norm(way, axis=1, keepdims=True)
    radii = own[:, 3:] + other[:, 3:]
    apart = (distance > 1.001 * radii)[:, 0]
    with np.errstate(all="ignore"):
        way, sine = way / distance, radii / distance
        across = np.cross(way, unit(rng, len(way)))
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        radius = np.sqrt(1.0 - sine * sine) * across + sine * way
        tangent = np.sqrt(1.0 - sine * sine) * way - sine * across
    origins[apart] = (own[:, :3] + own[:, 3:] * radius)[apart]
    return np.where(apart[:, None], tangent, unit(rng, len(way)))


def same_hits(structure, naive, rays):
    """Closest hits are the same bits, any-hits the same answer; return the counters of those."""
    for query in (CLOSEST, ALL):
        hits, want = structure.trace(rays, query)[0], naive.trace(rays, query)[0]
        np.testing.assert_array_equal(hits.t.view(np.int64), want.t.view(np.int64))
        np.testing.assert_array_equal(hits.primitive, want.primitive)
    hits, counts = structure.trace(rays, ANY)
    np.testing.assert_array_equal(hits.primitive >= 0, want.primitive >= 0)
    return counts


def check(build, scene, text):
    """Rays that leave items, and shadow rays to lights in awkward places."""
    scene = lit(scene)
    structure, naive = build(COHERENCE, scene, text), build("naive", scene)
    rays = leaving(scene, structure)
    counts = same_hits(structure, naive, rays)
    is_own = np.arange(len(rays)) < 5 * len(rays) // 6
    assert not counts["strangers"][is_own].any()
    for index in range(0, len(rays), 311):
        expected = {name: int(each[index]) for name, each in counts.by_name().items()}
        assert structure.record(rays, index, ANY).tally() == expected
    shadows = shadow_rays_of(scene)
    strangers = same_hits(structure, naive, shadows)["strangers"]
    is_sun = np.array([light.kind == SUN for light in scene.lights])[shadows.targets]
    np.testing.assert_array_equal(strangers, is_sun)
    assert structure.validate() == []
    return structure


@pytest.mark.parametrize("text", VARIANTS)
@pytest.mark.parametrize("name", ["suzanne", "mess"])
def test_awkward_rays(build, lab, name, text):
    structure = check(build, lab.small_scene(name), text)
    figures = structure.statistics().extra
    assert 0.0 < figures["made_share"] <= 1.0
    assert (
        figures["list_over_exact"] > 1.0
        if "lecture" in text
        else (figures["list_over_exact"] == 1.0)
    )
    if "most_references" in text:
        assert figures["times_dropped"] > 0


@pytest.mark.exhaustive
@pytest.mark.parametrize("text", VARIANTS)
@pytest.mark.parametrize("sample", samples())
def test_awkward_rays_of_every_sample(build, lab, sample, text):
    check(build, lab.small_scene(sample), text)


def test_what_moves(build):
    check(build, moving(), "")


def test_what_rays_leave_in_instances_is_found(build, lab):
    """Their primitives are counted on from instance to instance."""
    scene = lab.small_scene("crowd")
    structure, naive = build(COHERENCE, scene), build("naive", scene)
    rng = np.random.default_rng(2)
    begin = scene.lower + rng.random((2000, 3)) * (scene.upper - scene.lower)
    first = Rays.from_arrays(begin, unit(rng, 2000))
    hits, _ = naive.trace(first)
    hit = np.flatnonzero(hits.primitive >= 0)
    rays = Rays.from_arrays(
        begin[hit] + hits.t[hit, None] * first.directions[hit], unit(rng, len(hit)),
        t_min=1e-6, sources=hits.primitive[hit], class_names=CLASSES,
    )  # fmt: skip
    assert not same_hits(structure, naive, rays)["strangers"].any()


def test_every_point_of_an_area_light_is_in_its_sphere(build, lab):
    scene = lab.small_scene("suzanne")
    light = area_light(scene)
    scene = dataclasses.replace(scene, lights=(light,))
    structure, naive = build(COHERENCE, scene), build("naive", scene)
    rng = np.random.default_rng(3)
    begin = scene.lower + rng.random((2000, 3)) * (scene.upper - scene.lower)
    end = light.position + rng.choice([-1.0, 1.0, rng.random()], (2000, 2)) @ light.half_axes
    rays = Rays.from_arrays(begin, end - begin, 1.0, targets=0, classes=1, class_names=CLASSES)
    assert not same_hits(structure, naive, rays)["strangers"].any()


def test_neither_order_nor_threads_nor_other_rays_make_a_difference(build, lab):
    scene = lab.small_scene("suzanne")
    rays = leaving(scene, build(COHERENCE, scene))
    shuffled = np.random.default_rng(1).permutation(len(rays))
    runs = []
    for which, threads, text in (
        (np.arange(len(rays)), 1, ""), (shuffled, 2, ""), (shuffled, 8, ""),
        (shuffled, 2, "most_references=700"),
    ):  # fmt: skip
        structure = build(COHERENCE, scene, text)
        structure.trace(rays.select(which[:100]))
        hits, counts = structure.trace(rays.select(which), threads=threads)
        back = np.argsort(which)
        runs.append((hits.t[back], hits.primitive[back], counts.values[back]))
    for run in runs[1:]:
        for values, expected in zip(run, runs[0], strict=True):
            np.testing.assert_array_equal(values, expected)


# ---------------------------------------------------------------------------------- workloads


def check_workload(build, scene, name, **more):
    """All rays of a picture but the primary ones hit what naive says."""
    kind = workload_named(name)
    settings = kind.Settings(width=16, height=16, **more)
    naive, structure = build("naive", scene), build(COHERENCE, scene)
    generations = kind.generations(scene, settings, kind.make(scene, settings))
    rays, n_rays = next(generations), 0
    while rays is not None:
        hits, _ = naive.trace(rays)
        own = rays.select(rays.classes != rays.class_names.index("primary"))
        if len(own):
            n_rays += len(own)
            counts = same_hits(structure, naive, own)
            is_sun = np.array([light.kind == SUN for light in scene.lights] + [False])[own.targets]
            assert not counts["strangers"][~is_sun].any()
        try:
            rays = generations.send(hits)
        except StopIteration:
            rays = None
    return structure, n_rays


WHITTED = {"compare": False, "depth": 3}


@pytest.mark.parametrize("name", ["balls", "gears"])
def test_secondary_rays_of_pictures(build, lab, name):
    assert check_workload(build, lab.small_scene(name), "whitted", **WHITTED)[1] > 100
    assert check_workload(build, lab.small_scene(name), "ambient", count=2)[1] > 100


SPD = ("balls", "gears", "jacks", "lattice", "mount", "rings", "shells", "sombrero", "teapot",
       "tetra", "tree")  # fmt: skip


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", SPD)
def test_secondary_rays_of_pictures_of_all_databases(build, lab, name):
    assert name in lab.SMALL
    assert check_workload(build, lab.small_scene(name), "whitted", **WHITTED)[1] > 50
    assert check_workload(build, lab.small_scene(name), "ambient", count=8)[1] > 100


# ------------------------------------------------------------------------------ published shapes


def rays_off_spheres(scene, count=2000):
    """Rays from points on the surfaces of a scene's spheres, outward."""
    rng = np.random.default_rng(1)
    sources, outward, ways = (
        rng.integers(len(scene), size=count),
        unit(rng, count),
        unit(rng, count),
    )
    ways *= np.sign((ways * outward).sum(axis=1))[:, None]
    boxes = scene.boxes()[sources]
    middles, radii = 0.5 * (boxes[:, :3] + boxes[:, 3:]), 0.5 * (boxes[:, 3] - boxes[:, 0])
    origins = middles + radii[:, None] * (1.0 + 1e-9) * outward
    return Rays.from_arrays(origins, ways, sources=sources, class_names=CLASSES)


def cloud(count, share=0.05):
    """Spheres at random places of a cube, smaller the more there are."""
    middles = np.random.default_rng(1).random((count, 3))
    return Scene.from_items([Sphere(each, share / np.cbrt(count)) for each in middles], "cloud")


def test_tests_per_ray_stay_nearly_constant_as_a_sparse_cloud_grows(build):
    """With as many cells for each sphere: the square of cells along an edge grows as they do.

    With cells as large as before, what is seen through one would grow as well; and the steps of a
    hierarchy do.
    """
    tests, steps = [], []
    for count, cells in ((125, 3), (500, 6), (2000, 12)):
        scene = cloud(count)
        rays = rays_off_spheres(scene)
        hits, counts = build(COHERENCE, scene, f"cells={cells}").trace(rays)
        want, of_tree = build("bvh", scene).trace(rays)
        np.testing.assert_array_equal(hits.primitive, want.primitive)
        tests.append(counts["N_IT"].mean())
        steps.append(of_tree["N_TS"].mean())
    assert max(tests) < 1.15 * min(tests)
    assert steps[0] * 2.0 < steps[2]


def test_shells_are_the_bad_case(build, lab):
    """Where spheres overlap, each cell sees them: twice as many, and a ray tests twice as many."""
    tests, shares = [], []
    for size in (1, 2):
        scene = lab.small_scene("shells") if size == 1 else make_sample("shells:size=2")
        structure = build(COHERENCE, scene)
        tests.append(structure.trace(rays_off_spheres(scene))[1]["N_IT"].mean())
        shares.append(structure.statistics().extra["list_share"])
    assert min(shares) > 0.15
    assert tests[1] > 1.5 * tests[0]
    sparse = build(COHERENCE, cloud(len(scene)))
    sparse.trace(rays_off_spheres(sparse.scene))
    assert sparse.statistics().extra["list_share"] < 0.1 * min(shares)


def test_what_does_not_fit_is_refused_with_what_to_lower(build, lab, monkeypatch):
    from accelscope.core import memory

    scene = lab.small_scene("suzanne")
    many = build(COHERENCE, scene, "cells=128")
    rays = leaving(scene, many)
    monkeypatch.setattr(memory, "available_bytes", lambda: 4_000_000)
    with pytest.raises(InputError, match=r"cells of ray_coherence .*; lower cells, or light_cells"):
        many.trace(rays)


def test_rays_of_no_known_class_are_refused(build, lab):
    scene = lab.small_scene("suzanne")
    with pytest.raises(InputError, match="answers shadow, reflected, refracted and ambient rays"):
        build(COHERENCE, scene).trace(Rays.from_arrays([[0.0, 0, 0]], [[1.0, 0, 0]]))
