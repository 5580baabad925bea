"""The picture's rays: closed forms of optics, rules of the databases, and the same everywhere."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, make_record, trace
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Box, Polygon, Sphere, Triangle
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.scene import Camera, Scene, point_lights
from accelscope.core.scene.material import Material
from accelscope.core.scene.whitted.film import Film
from accelscope.core.scene.whitted.optics import mirrored, refracted, whole_power
from accelscope.core.structures import structures
from accelscope.sample_scenes import make_sample

PRIMARY, SHADOW, REFLECTED, REFRACTED = range(4)
MIRROR = Material("mirror", (1.0, 1.0, 1.0), diffuse=0.0, specular=1.0)
ROUTED = "routed:primary=image_directory,shadow=light_buffer,other=bvh"
"""The lecture's table: every class of rays has a structure made for it."""

BRIGHT = {"threshold": 1e-9, "compare": False}
"""What is glass, and reflects nothing, has reflected rays by the rules; they are not sent."""
MATT = Material("matt", (1.0, 0.5, 0.25))
Z = np.array([0.0, 0.0, 1.0])


def glass(index, specular=0.0, transmission=1.0):
    return Material("glass", (1.0,) * 3, 0.0, specular, 1.0, transmission, index)


def scene_of(items, materials, eye=(0.0, -5.0, 0.0), at=(0.0, 0.0, 0.0), lights=((3, -9, 7),)):
    scene = Scene.from_items(
        items, "made", materials=materials, material_ids=np.arange(len(items)),
        camera=Camera(np.array(eye, float), np.array(at, float), Z, 40.0),
        lights=point_lights(*lights),
    )  # fmt: skip
    return dataclasses.replace(scene, background=(1.0, 1.0, 1.0))


def traced(build, scene, structure="bvh", threads=0, **settings):
    name, _, text = structure.partition(":")
    settings = WhittedSettings(**{"width": 32, "height": 32, **settings})
    return trace(Built(build(name, scene, text), 0.0), WhittedWorkload, settings, threads)


def of_class(result, number):
    which = result.rays.classes == number
    return result.rays.select(which), result.hits.primitive[which]


def units(rng, n):
    v = rng.normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


# ---------------------------------------------------------------------------------------- optics


def towards(rng, n):
    normals, directions = units(rng, n), units(rng, n)
    directions *= -np.sign((normals * directions).sum(1))[:, None]
    return directions, normals


def test_the_mirror_turns_the_part_along_the_normal_round():
    directions, normals = towards(np.random.default_rng(1), 1000)
    mirrors = mirrored(directions, normals)
    along = (directions * normals).sum(1)
    np.testing.assert_allclose((mirrors * normals).sum(1), -along, atol=1e-14)
    across = directions - along[:, None] * normals
    np.testing.assert_allclose(
        mirrors - (mirrors * normals).sum(1)[:, None] * normals, across, atol=1e-14
    )
    assert np.array_equal(mirrored(-Z[None], Z[None]), Z[None])


@pytest.mark.parametrize("index", [1.0, 1.1, 1.5, 2.4, 0.75])
@pytest.mark.parametrize("is_inside", [False, True])
def test_snells_law(index, is_inside):
    directions, normals = towards(np.random.default_rng(2), 2000)
    ratio = index if is_inside else 1.0 / index
    through, is_total = refracted(directions, normals, np.full(2000, ratio))
    sines = np.linalg.norm(np.cross(directions, normals), axis=1)
    np.testing.assert_array_equal(is_total, 1.0 - (ratio * sines) ** 2 < 0.0)
    there = ~is_total
    beyond = np.linalg.norm(np.cross(through, normals), axis=1)
    np.testing.assert_allclose(beyond[there], ratio * sines[there], atol=1e-13)
    np.testing.assert_allclose(np.linalg.norm(through[there], axis=1), 1.0, atol=1e-12)
    assert ((through * normals).sum(1)[there] <= 0.0).all()
    # In the plane of incidence, and on the same side of the normal.
    plane = np.cross(directions, normals)
    assert np.abs((plane * through).sum(1)[there]).max() < 1e-13
    assert ((np.cross(through, normals) * plane).sum(1)[there] >= 0.0).all()


def test_total_reflection_begins_at_the_critical_angle():
    critical = np.arcsin(1.0 / 1.5)
    angles = critical + np.array([-1e-6, 1e-6])
    directions = np.stack([np.sin(angles), np.zeros(2), -np.cos(angles)], axis=1)
    _, is_total = refracted(directions, np.tile(Z, (2, 1)), np.full(2, 1.5))
    assert is_total.tolist() == [False, True]


def test_powers_are_products():
    bases = np.array([0.0, 0.3, 0.999, 1.0, 0.5])
    exponents = np.array([0, 3, 1000, 10**6, 2000])
    np.testing.assert_allclose(whole_power(bases, exponents), bases**exponents, rtol=1e-12)


# ----------------------------------------------------------------------------------- whole trees


def test_a_mirror_sphere_reflects_each_primary_ray_that_hits_it_once(build):
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [MIRROR]))
    primary, hit = of_class(result, PRIMARY)
    reflected, further = of_class(result, REFLECTED)
    assert len(reflected) == (hit >= 0).sum() > 100
    assert (further < 0).all()
    assert not len(of_class(result, REFRACTED)[0])
    # A mirrored ray, the ray and the centre lie in one plane, at equal angles.
    into = primary.directions[hit >= 0]
    into /= np.linalg.norm(into, axis=1, keepdims=True)
    normals = reflected.origins / np.linalg.norm(reflected.origins, axis=1, keepdims=True)
    np.testing.assert_allclose(reflected.directions, mirrored(into, normals), atol=1e-9)
    assert np.array_equal(reflected.pixels, primary.pixels[hit >= 0])
    assert (reflected.sources == 0).all()
    assert (reflected.targets == -1).all()
    # All light comes back: before a white sky the mirror is white as well.
    np.testing.assert_allclose(result.outcome.picture, 1.0, atol=1e-14)


@pytest.mark.parametrize("index", [1.0, 1.3, 1.5, 2.5])
def test_a_glass_sphere_loses_no_light(build, index):
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [glass(index)]), **BRIGHT)
    hits = (of_class(result, PRIMARY)[1] >= 0).sum()
    refracted_rays, inside = of_class(result, REFRACTED)
    assert len(refracted_rays) == 2 * hits  # in, and out again: never total from outside
    assert (inside[:hits] == 0).all()
    assert (inside[hits:] < 0).all()
    np.testing.assert_allclose(result.outcome.picture, 1.0, atol=1e-14)


def test_where_all_is_refracted_and_reflected_a_part_is_lost_with_the_depth(build):
    """R outside, then T R inside, which is cut off, then T T outside again."""
    scene = scene_of([Sphere((0, 0, 0), 1)], [glass(1.5, 0.3, 0.7)], lights=((0, 0, 50),))
    result = traced(build, scene, depth=3)
    seen = result.outcome.picture.reshape(-1, 3)[of_class(result, PRIMARY)[1] >= 0]
    highlight = 0.3  # at most, since the exponent is 1
    assert (seen >= 0.3 + 0.49 - 1e-12).all()
    assert (seen <= 0.3 + 0.49 + highlight).all()
    assert seen.min() == pytest.approx(0.79, abs=1e-12)


def test_glass_that_bends_nothing_is_passed_straight(build):
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [glass(1.0)]), **BRIGHT)
    primary, hit = of_class(result, PRIMARY)
    out, _ = of_class(result, REFRACTED)
    ways = primary.directions[hit >= 0]
    ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    np.testing.assert_allclose(out.directions[len(ways) :], ways, atol=1e-8)


def test_a_slab_shifts_rays_and_turns_none(build):
    slab = Box((-9, -0.5, -9), (9, 0.5, 9))
    result = traced(build, scene_of([slab], [glass(1.5)]), **BRIGHT)
    primary, hit = of_class(result, PRIMARY)
    assert (hit == 0).all()
    out, _ = of_class(result, REFRACTED)
    into, out = out.directions[: len(hit)], out.directions[len(hit) :]
    ways = primary.directions / np.linalg.norm(primary.directions, axis=1, keepdims=True)
    np.testing.assert_allclose(out, ways, atol=1e-12)
    np.testing.assert_allclose(into[:, [0, 2]], ways[:, [0, 2]] / 1.5, atol=1e-12)


def test_a_camera_within_glass_looks_out(build):
    """What it sees it leaves, at the sine times the index; beyond the critical angle nothing."""
    eye = (0.0, -0.95, 0.0)
    scene = scene_of([Sphere((0, 0, 0), 1)], [glass(1.5)], eye=eye, at=(0.3, -1.2, 0.0))
    result = traced(build, scene, depth=2, fov=100.0)
    primary, hit = of_class(result, PRIMARY)
    assert (hit == 0).all()
    d = primary.directions / np.linalg.norm(primary.directions, axis=1, keepdims=True)
    points = primary.origins + result.hits.t[: len(hit), None] * primary.directions
    sines = np.linalg.norm(np.cross(d, points), axis=1)
    out, seen = of_class(result, REFRACTED)
    is_total = 1.5 * sines > 1.0
    assert 0 < is_total.sum() < len(is_total)
    assert len(out) == (~is_total).sum()
    assert (seen < 0).all()
    beyond = np.linalg.norm(np.cross(out.directions, points[~is_total]), axis=1)
    np.testing.assert_allclose(beyond, 1.5 * sines[~is_total], atol=1e-7)
    # By Haines's rule each is reflected, too; where all of it is, with all of the weight.
    assert len(of_class(result, REFLECTED)[0]) == len(hit)


def test_an_opaque_face_lit_from_behind_the_viewer_is_lit_from_both_sides(build):
    square = Polygon([(-9, 0, -9), (9, 0, -9), (9, 0, 9), (-9, 0, 9)])
    for eye, lamp, is_lit in (
        ((0, -5, 0), (0, -5, 1), True), ((0, 5, 0), (0, 5, 1), True),
        ((0, -5, 0), (0, 5, 1), False), ((0, 5, 0), (0, -5, 1), False),
    ):  # fmt: skip
        result = traced(build, scene_of([square], [MATT], eye=eye, lights=(lamp,)))
        assert len(of_class(result, SHADOW)[0]) == (1024 if is_lit else 0)


def test_shadow_rays_end_at_their_light_and_name_it(build):
    lamps = ((3, -9, 7), (-4, -3, 1), (0, 9, 0))  # the last is behind
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [MATT], lights=lamps))
    shadow, blocked = of_class(result, SHADOW)
    ends = shadow.origins + shadow.directions
    np.testing.assert_allclose(ends, np.array(lamps, float)[shadow.targets], atol=1e-9)
    assert (blocked < 0).all()
    assert (shadow.t_max == 1.0).all()
    assert set(shadow.targets.tolist()) == {0, 1}


@pytest.mark.parametrize("lamp", [(0, -1, 0), (0, 0, 0), (0, -5, 0), (0, -1 - 1e-12, 0)])
def test_lights_on_and_in_surfaces_and_at_the_eye(build, lamp):
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [MATT], lights=(lamp,)))
    assert np.isfinite(result.outcome.picture).all()
    inside = np.linalg.norm(lamp) < 1.0 + 1e-9
    assert (len(of_class(result, SHADOW)[0]) == 0) == inside


def test_edge_on_faces_send_nothing_on(build):
    """A level triangle in the plane of the eye: hit or not, nothing of it is no number."""
    triangle = Triangle([(-1, -1, 0), (1, -1, 0), (0, 2, 0)])
    result = traced(build, scene_of([triangle], [MIRROR]), width=33, height=33)
    assert np.isfinite(result.outcome.picture).all()
    assert not len(of_class(result, REFLECTED)[0])


def test_grazing_rays_leave_their_face(build):
    """From a mirror seen at a hundredth of a degree, nothing comes back to the mirror."""
    floor = Polygon([(-9, -9, 0), (9, -9, 0), (9, 9, 0), (-9, 9, 0)])
    for height in (1e-3, 1e-6, 1e-9):
        scene = scene_of([floor], [MIRROR], eye=(0, -12, height), at=(0, 0, 0))
        result = traced(build, scene, width=65, height=65, fov=0.02)
        reflected, hit = of_class(result, REFLECTED)
        assert (hit < 0).all()
        assert np.isfinite(reflected.directions).all()


def test_all_that_descends_from_a_ray_has_its_pixel(build):
    result = traced(build, make_sample("mount:size=3"), samples=2)
    assert result.rays.pixels.max() == 32 * 32 - 1
    counts = np.bincount(result.rays.pixels[result.rays.classes == PRIMARY])
    assert (counts == 4).all()
    primary, hit = of_class(result, PRIMARY)
    may = set(primary.pixels[hit >= 0].tolist())
    assert set(result.rays.pixels[result.rays.classes != PRIMARY].tolist()) <= may


# -------------------------------------------------------------------------- the same everywhere


@pytest.mark.parametrize("name", ["balls:size=1", "gears:size=1", "mount:size=2", "tetra:size=3"])
def test_rays_hits_and_picture_are_the_same_for_all_structures_and_threads(build, name):
    scene = make_sample(name)
    settings = {"samples": 4, "adaptive": True, "compare": False, "width": 20, "height": 20}
    first = traced(build, scene, "naive", 1, **settings)
    others = [traced(build, scene, "bvh", threads, **settings) for threads in (1, 2, 8)]
    others += [traced(build, scene, structure, 2, **settings) for structure in ("kdtree", ROUTED)]
    for other in others:
        for field in dataclasses.fields(Rays):
            assert np.array_equal(getattr(first.rays, field.name), getattr(other.rays, field.name))
        shadow = first.rays.classes == SHADOW  # which one is in the way is not defined
        assert np.array_equal(first.hits.primitive < 0, other.hits.primitive < 0)
        assert np.array_equal(first.hits.primitive[~shadow], other.hits.primitive[~shadow])
        assert np.array_equal(first.hits.t[~shadow], other.hits.t[~shadow])
        assert np.array_equal(first.outcome.picture, other.outcome.picture)


def test_instances_are_seen_as_what_they_are_made_of(build):
    """Through a matrix that turns a sphere and makes it larger, refracted rays enter and leave."""
    from accelscope.core.geometry.instances import instanced

    ball = Scene.from_items([Sphere((0, 0, 0), 1)], "ball")
    matrix = np.array([[0.0, -2, 0, 0], [2, 0, 0, 0], [0, 0, 2, 0]])
    matrices = np.stack([matrix, matrix * [-1.0, 1, 1, 1]])
    matrices[1, 0, 3] = 9.0
    scene = Scene.from_instances(
        instanced([ball.geometry], np.array([0, 0]), matrices), "two",
        camera=Camera(np.array([4.5, -15.0, 0]), np.array([4.5, 0, 0]), Z, 60.0),
        lights=point_lights((3, -9, 7)),
    )  # fmt: skip
    scene = dataclasses.replace(
        scene, materials=(glass(1.5),), material_ids=np.zeros(1, np.int32),
        material_first=np.array([0, 2]), background=(1.0, 1.0, 1.0),
    )  # fmt: skip
    result = traced(build, scene, width=64, **BRIGHT)
    _, hit = of_class(result, PRIMARY)
    assert set(hit.tolist()) == {-1, 0, 1}
    assert len(of_class(result, REFRACTED)[0]) == 2 * (hit >= 0).sum()
    np.testing.assert_allclose(result.outcome.picture, 1.0, atol=1e-14)


# ---------------------------------------------------------------------------------- fewer rays


def test_the_threshold_spares_rays_and_its_error_has_a_bound(build):
    scene = make_sample("gears:size=1")
    whole = traced(build, scene)
    before = len(whole.rays)
    for threshold in (0.01, 0.1, 0.5):
        result = traced(build, scene, threshold=threshold)
        saved = result.outcome.saved
        assert len(result.rays) < before
        before = len(result.rays)
        assert saved.whole == len(whole.rays)
        assert saved.by_depth.sum() == len(whole.rays) - len(result.rays)
        assert (saved.by_depth >= 0).all()
        assert 0.0 < saved.rms_error <= saved.maximum_error
        off = np.minimum(whole.outcome.picture, 1) - np.minimum(result.outcome.picture, 1)
        assert np.abs(off).max() == saved.maximum_error
    assert traced(build, scene, threshold=0.1, compare=False).outcome.saved is None


def test_light_that_is_not_asked_for_arrives(build):
    """Of seven lights none adds as much as the threshold: no shadow ray is sent, and all is lit."""
    floor = Polygon(((-3, -3, -1), (3, -3, -1), (3, 3, -1), (-3, 3, -1)))
    lights = tuple((x, -4, 5) for x in range(-3, 4))
    scene = scene_of([floor, Sphere((0, 0, 0), 1)], [MATT, MATT], lights=lights)
    whole, lit = traced(build, scene), traced(build, scene, threshold=0.2)
    shadows = of_class(whole, SHADOW)[1]
    assert (shadows >= 0).any()
    assert not len(of_class(lit, SHADOW)[0])
    assert lit.outcome.spared[0, SHADOW] == len(shadows)
    # As bright as where nothing is in the way of any light, and there only.
    brighter = (lit.outcome.picture - whole.outcome.picture).max(axis=2).ravel()
    pixels = whole.rays.pixels[whole.rays.classes == SHADOW]
    shaded = np.zeros(len(brighter), bool)
    shaded[pixels[shadows >= 0]] = True
    assert (brighter[shaded] > 0.0).all()
    assert np.abs(brighter[~shaded]).max() < 1e-12


def test_with_threshold_one_only_what_is_seen_whole_is_sent(build):
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [MIRROR]), threshold=1.0)
    assert len(of_class(result, REFLECTED)[0]) == (of_class(result, PRIMARY)[1] >= 0).sum()
    dull = dataclasses.replace(MIRROR, specular=0.999)
    result = traced(build, scene_of([Sphere((0, 0, 0), 1)], [dull]), threshold=1.0)
    assert not len(of_class(result, REFLECTED)[0])
    assert result.outcome.spared[1, REFLECTED] == (of_class(result, PRIMARY)[1] >= 0).sum()


@pytest.mark.parametrize("samples", [2, 4, 8])
def test_adaptive_samples_are_some_of_the_fixed_ones(build, samples):
    scene = make_sample("balls:size=1")
    fixed = traced(build, scene, samples=samples, width=24, height=24)
    some = traced(build, scene, samples=samples, adaptive=True, width=24, height=24)
    all_of, chosen = (
        {tuple(d) for d in of_class(each, PRIMARY)[0].directions.tolist()} for each in (fixed, some)
    )
    assert chosen < all_of
    assert len(all_of) == (24 * samples) ** 2
    assert some.outcome.samples.sum() == len(chosen)
    assert some.outcome.samples.min() >= 1
    assert some.outcome.samples.max() <= samples**2
    assert some.outcome.saved.whole == len(fixed.rays)
    one = traced(build, scene, width=24, height=24)
    from accelscope.core.scene.whitted.film import error_of

    assert some.outcome.saved.rms_error < error_of(one.outcome.picture, fixed.outcome.picture)[0]


def test_where_all_cells_are_divided_the_picture_is_that_of_all_samples(build):
    """Every place sees another object: so all of them differ."""
    film = Film(3, 2, 4, is_adaptive=True)
    while True:
        places = film.places()
        film.see(np.arange(len(film)), places)
        if not film.divide(0.1):
            break
    assert np.array_equal(np.sort(film.places()), np.arange(3 * 2 * 16))
    assert (film.samples() == 16).all()
    film.add(np.arange(len(film)), np.repeat(film.places()[:, None], 3, axis=1).astype(float))
    blocks = np.arange(96.0).reshape(2, 4, 3, 4).mean(axis=(1, 3))
    np.testing.assert_allclose(film.picture()[:, :, 0], blocks, rtol=1e-14)


def test_a_picture_of_one_colour_takes_one_sample_of_each_pixel(build):
    scene = scene_of([Sphere((0, 90, 0), 1)], [MIRROR], at=(0, -9, 0))
    result = traced(build, scene, samples=8, adaptive=True)
    assert (result.outcome.samples == 1).all()
    assert result.outcome.saved.maximum_error == 0.0
    assert result.outcome.saved.by_depth.tolist() == [63 * 1024, 0, 0, 0, 0]


def test_records_hold_the_figures(build):
    from accelscope.core.evaluation.records.report import explained_figures, table

    scene = make_sample("gears:size=1")
    built = Built(build("bvh", scene), 0.0)
    settings = WhittedSettings(width=16, height=16, threshold=0.2)
    record = make_record(built, trace(built, WhittedWorkload, settings))
    outcome = record["outcome"]
    assert sum(sum(each[name] for name in record["rays"]["classes"])
               for each in outcome["generations"]) == record["rays"]["count"]  # fmt: skip
    assert outcome["not_sent"] == sum(each["not_sent"] for each in outcome["generations"]) > 0
    assert sum(outcome["saved"]["by_depth"]) == outcome["saved"]["rays"] > 0
    labels = {label: text for _, label, text, _ in explained_figures(record)}
    assert {"Rays saved", "Error of picture, RMS", "Samples", "Rays not sent"} <= set(labels)
    assert "whitted" in table([record])


def test_a_scene_without_a_light_has_one_over_the_shoulder(build):
    scene = Scene.from_triangles(np.array([[[-9.0, 0, -9], [9, 0, -9], [0, 0, 9]]]), "dark")
    settings = WhittedSettings(width=8, height=8)
    (light,) = WhittedWorkload.used(scene, settings)["lights"]
    assert light["name"] == "over the shoulder"
    assert len(of_class(traced(build, scene, width=8, height=8), SHADOW)[0]) > 0


# ------------------------------------------------------------------------------------- refusals


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"adaptive": True}, "adaptive needs samples of 2, 4, 8 or 16, not 1"),
        ({"adaptive": True, "samples": 3}, "adaptive needs samples of 2, 4, 8 or 16, not 3"),
        ({"width": 60000, "height": 60000}, "lower width, height or samples"),
        (
            {"width": 1000, "height": 700, "samples": 16, "adaptive": True},
            "comparing with 256 samples of 700000 pixels .*; set compare=false",
        ),
        ({"from_": (1.0, 0, 0), "at": (1.0, 0, 0)}, "rays whitted: 'from' and 'at' are the same"),
    ],
)
def test_what_cannot_be_is_refused(settings, words):
    with pytest.raises(InputError, match=words):
        WhittedWorkload.make(make_sample("tetra:size=2"), WhittedSettings(**settings))


def test_generations_that_do_not_fit_are_refused_by_the_setting(build, monkeypatch):
    from accelscope.core.memory import refuse_if_too_large
    from accelscope.core.scene.whitted import trees

    def refuse(needed, what, advice):
        refuse_if_too_large(needed * 10**9 if needed > 4000 * 520 else needed, what, advice)

    monkeypatch.setattr(trees, "refuse_if_too_large", refuse)
    with pytest.raises(InputError, match=r"the \d+ rays up to depth \d .*; lower depth, samples"):
        traced(build, make_sample("gears:size=1"))


@pytest.mark.parametrize(
    "changed",
    [{"specular": 1.5}, {"transmission": float("nan")}, {"index_of_refraction": 0.0},
     {"colour": (0.0, 2.0, 0.0)}, {"shine": float("inf")}],
)  # fmt: skip
def test_materials_that_cannot_be_are_refused(changed):
    with pytest.raises(InputError, match="material mirror"):
        dataclasses.replace(MIRROR, **changed)


class Stopping(Progress):
    def report(self, done, total, text):
        if text.startswith("Making"):
            raise Cancelled


def test_making_rays_can_be_stopped(build):
    built = Built(build("bvh", make_sample("tetra:size=2")), 0.0)
    with pytest.raises(Cancelled):
        trace(built, WhittedWorkload, WhittedSettings(width=8, height=8), 1, Stopping())


def test_structures_that_exist_answer_every_class():
    assert all(
        each.answers is None
        or set(each.answers) <= {"primary", "shadow", "reflected", "refracted", "ambient"}
        for each in structures().values()
    )
