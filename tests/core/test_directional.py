"""Directional structures against brute force, their lists against rays, closed forms."""

import dataclasses
import itertools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import (
    CameraSettings,
    CameraWorkload,
    workload_named,
)
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.scene import ORTHOGRAPHIC, SPOT, SUN, Camera, Light, Scene
from accelscope.core.scene.camera_rays import CLASS_NAMES, SHADOW
from accelscope.core.scene.light import point_lights
from accelscope.core.settings import parse_spec
from accelscope.core.structures import structures
from accelscope.core.structures.directional.faces import cube, faces_of, picture_of
from accelscope.core.structures.directional.lists import NONE, cell_at
from accelscope.core.structures.directional.structure import Directional
from accelscope.sample_scenes import make_sample

LIGHT_BUFFER, IMAGE_DIRECTORY = "light_buffer", "image_directory"
DIRECTIONAL = [name for name, kind in structures().items() if issubclass(kind, Directional)]

SCENES = ["suzanne", "mess", "cubes", "flat", "one", "teapot", "balls", "gears", "jacks", "tree"]

SETTINGS = [
    "",
    "insert=box",
    "insert=cone",
    "full_occlusion=false",
    "max_list_size=1,max_depth=5",
    "division=uniform",
    "division=uniform,cells=1",
    "division=uniform,cells=7,insert=box",
    "division=uniform,cells=13,insert=cone,full_occlusion=false",
    "merge=equal",
    "merge=similar",
    "division=uniform,merge=similar",
]
RASTER = [
    "division=uniform,cells=6,insert=raster,pixels=1",
    "division=uniform,cells=6,insert=raster,dilation=2",
]
REMEMBERING = ["last_occluder=light", "last_occluder=cell"]


def combinations(texts):
    """All scenes with all settings; most of them are for long runs only."""
    return [
        pytest.param(name, text, marks=[] if text in QUICK and name in SHORT
                     else pytest.mark.exhaustive)
        for name in SCENES
        for text in texts
    ]  # fmt: skip


LONG = [pytest.param(name, marks=pytest.mark.exhaustive) for name in SCENES if name != "teapot"]
SHORT = ("suzanne", "mess", "cubes", "teapot", "gears")
QUICK = ("", "division=uniform,cells=7,insert=box", "last_occluder=cell")


def built(lab, name, scene, text=""):
    kind = structures()[name]
    return kind.build(scene, lab.settings_of(kind, text))


def lit(scene):
    """The scene with lights in every awkward place: far away, inside, on a vertex, on a face."""
    boxes = scene.boxes()
    middle = 0.5 * (scene.lower + scene.upper)
    corner = boxes[len(boxes) // 2, :3]
    places = [
        middle + scene.diagonal * np.array([0.6, -0.5, 0.9]),
        middle,
        corner,
        scene.upper,
        middle + 1e4 * scene.diagonal * np.array([0.3, 0.2, 1.0]),
    ]
    suns = [
        Light(SUN, direction=np.array(direction) / np.linalg.norm(direction))
        for direction in ((0.3, 0.2, -1.0), (0.0, 0.0, -1.0), (1.0, 1.0, 1.0))
    ]
    spot = Light(SPOT, position=places[0], direction=np.array([0.0, 0.0, -1.0]), angle=30.0)
    return dataclasses.replace(scene, lights=(*point_lights(*places), *suns, spot))


def shadow_rays_of(scene, seed=0, count=200):
    """Rays from all over the scene to every light, and along borders of cells and diagonals."""
    rng = np.random.default_rng(seed)
    size = scene.upper - scene.lower
    points = scene.lower + (rng.random((count, 3)) * 1.4 - 0.2) * size
    boxes = scene.boxes()
    points = np.concatenate([points, boxes[:40, :3], boxes[:40, 3:], [scene.lower, scene.upper]])
    origins, directions, targets, ends = [], [], [], []
    for number, light in enumerate(scene.lights):
        own = points
        if light.kind != SUN:
            # Along the edges, the diagonals and the middles of the faces of its cube.
            ways = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
            ways = np.concatenate([ways, ways * (1.0, 0.5, 0.25), ways * (0.0625, 1.0, -0.125)])
            ways = ways[np.abs(ways).sum(axis=1) > 0.0]
            own = np.concatenate([points, light.position + ways * 0.7 * scene.diagonal])
            own = own[(own != light.position).any(axis=1)]
            way = light.position - own
        else:
            way = np.broadcast_to(-light.direction, own.shape)
        origins.append(own)
        directions.append(way)
        targets.append(np.full(len(own), number))
        ends.append(np.full(len(own), np.inf if light.kind == SUN else 1.0))
    return Rays.from_arrays(
        np.concatenate(origins), np.concatenate(directions), np.concatenate(ends), queries=ANY,
        classes=1, class_names=CLASS_NAMES, targets=np.concatenate(targets),
    )  # fmt: skip


def same_hits(structure, truth, rays):
    """Closest hits are the same bits, any-hits the same answer; return the counters of those."""
    for query in (CLOSEST, ALL):
        (hits, _), (want, _) = structure.trace(rays, query), truth.trace(rays, query)
        assert hits.t.tobytes() == want.t.tobytes()
        assert hits.primitive.tobytes() == want.primitive.tobytes()
    hits, counts = structure.trace(rays, ANY)
    assert np.array_equal(hits.primitive >= 0, want.primitive >= 0)
    return counts


@pytest.mark.parametrize(("name", "text"), combinations([*SETTINGS, *RASTER, *REMEMBERING]))
def test_shadow_rays_are_those_of_brute_force(lab, name, text):
    scene = lit(lab.small_scene(name))
    rays = shadow_rays_of(scene)
    structure = built(lab, LIGHT_BUFFER, scene, text)
    assert structure.validate() == []
    counts = same_hits(structure, built(lab, "naive", scene), rays)
    assert not counts["strangers"].any()
    for index in range(0, len(rays), 211):
        tally = structure.record(rays, index, ANY).tally()
        assert tally == {key: int(values[index]) for key, values in counts.by_name().items()}


CAMERAS = {
    "outside": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 45.0),
    "wide": Camera(np.array([0.4, 0.1, 0.3]), np.ones(3), np.array([0.0, 0, 1]), 150.0),
    "shifted": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 60.0,
                      shift=(0.3, -0.2), pixel_aspect=2.0),
    "parallel": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 45.0,
                       ORTHOGRAPHIC, scale=3.0, shift=(0.1, 0.0)),
    "skew": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([-0.3, 0.2, 0.9]), 45.0,
                   right=np.array([-0.9, -0.7, -0.2])),
}  # fmt: skip


@pytest.mark.parametrize(("name", "text"), combinations(SETTINGS))
def test_primary_rays_are_those_of_brute_force(lab, name, text):
    scene = lab.small_scene(name)
    own = scene.camera
    for camera in (own, *CAMERAS.values()):
        scene = dataclasses.replace(scene, camera=camera)
        structure = built(
            lab, IMAGE_DIRECTORY, scene, f"width=24,height=16{',' * bool(text)}{text}"
        )
        assert structure.validate() == []
        for pixel in ("centre", "corner"):
            rays = CameraWorkload.make(scene, CameraSettings(width=24, height=16, pixel=pixel))
            counts = same_hits(structure, built(lab, "naive", scene), rays)
            assert not counts["strangers"].any()
        for index in range(0, len(rays), 97):
            tally = structure.record(rays, index, ANY).tally()
            assert tally == {key: int(values[index]) for key, values in counts.by_name().items()}


def changed(rays, **columns):
    return dataclasses.replace(rays, **columns)


@pytest.mark.parametrize("text", ["", "full_occlusion=false", "division=uniform"])
def test_strangers_are_tested_against_everything(lab, text):
    """Rays to no light, to another place, beyond the light; those that begin behind a cover."""
    scene = lit(lab.small_scene("cubes"))
    naive = built(lab, "naive", scene)
    structure = built(lab, LIGHT_BUFFER, scene, text)
    rays = shadow_rays_of(scene)
    lamps = rays.select(np.isfinite(rays.t_max))
    beyond = changed(lamps, t_max=np.full(len(lamps), 1.5))
    beside = changed(lamps, directions=lamps.directions * (1.0, 1.0 + 1e-9, 1.0))
    nowhere = changed(rays, targets=np.full(len(rays), NONE, np.int32))
    for strange in (beyond, nowhere):
        assert (same_hits(structure, naive, strange)["strangers"] == 1).all()
    same_hits(structure, naive, beside)
    short = changed(lamps, t_max=np.full(len(lamps), 0.3))
    late = changed(lamps, t_min=np.full(len(lamps), 0.6))
    for known in (short, late):
        same_hits(structure, naive, known)
    scene = dataclasses.replace(scene, camera=CAMERAS["outside"])
    structure = built(lab, IMAGE_DIRECTORY, scene, text)
    primary = CameraWorkload.make(scene, CameraSettings(width=16, height=16))
    turned = changed(primary, directions=-primary.directions)
    assert (same_hits(structure, naive, turned)["strangers"] == 1).all()
    moved = changed(primary, origins=primary.origins + 0.1)
    assert (same_hits(structure, naive, moved)["strangers"] == 1).all()
    for known in (
        changed(primary, t_min=np.full(len(primary), 4.5)),
        changed(primary, t_max=np.full(len(primary), 4.5)),
    ):
        same_hits(structure, naive, known)


@pytest.mark.parametrize("text", SETTINGS)
@pytest.mark.parametrize("name", ["teapot", *LONG])
def test_lists_hold_whatever_a_ray_of_their_cell_hits(lab, name, text):
    """Also of what lies behind the first hit: all hits of each ray, up to where the list ends."""
    scene = lit(lab.small_scene(name))
    structure = built(lab, LIGHT_BUFFER, scene, text)
    rng = np.random.default_rng(3)
    naive = built(lab, "naive", scene)
    origin = scene.lights[1].position
    ways = rng.normal(size=(400, 3))
    rays = Rays.from_arrays(np.tile(origin, (400, 1)), ways)
    begin = np.zeros(400)
    for _ in range(6):
        hits, _ = naive.trace(changed(rays, t_min=begin), CLOSEST)
        found = np.flatnonzero(hits.primitive >= 0)
        for index in found:
            cell = structure.cell_of(1, ways[index])
            lists = structure.lists
            listed = lists.references[lists.first[cell] : lists.last[cell]]
            distance = hits.t[index] * np.linalg.norm(ways[index])
            assert hits.primitive[index] in listed or distance > lists.far[cell]
        begin[found] = np.nextafter(hits.t[found], np.inf)
        rays, begin = rays.select(found), begin[found]
        ways = ways[found]
        if not len(found):
            break


@pytest.mark.parametrize("threads", [2, 8])
@pytest.mark.parametrize("text", ["", "last_occluder=cell"])
def test_threads_and_order_change_nothing(lab, text, threads):
    scene = lit(lab.small_scene("gears"))
    rays = shadow_rays_of(scene)
    structure = built(lab, LIGHT_BUFFER, scene, text)
    one, many = structure.trace(rays, threads=1), structure.trace(rays, threads=threads)
    sorted_ = structure.trace(rays, threads=threads, ray_order="sorted")
    for hits, counts in (many, sorted_):
        assert np.array_equal(hits.primitive >= 0, one[0].primitive >= 0)
        assert np.array_equal(counts.values, one[1].values)


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("name", "workload", "least", "most"),
    [("balls", "whitted", 0.154, 0.159), ("gears", "camera", 0.169, 0.192)],
)
def test_the_last_occluder_answers_as_many_shadow_rays_as_is_published(
    lab, name, workload, least, most
):
    """Ray Tracing News, at 200 x 200: 15.4 to 15.9% of balls, 16.9 to 17.8% of gears.

    Of gears that is reached only without its glass: of the shadow rays of the camera's hits alone
    it is 19.1%; of all, with those that start inside of glass and end at its next face, 33%.
    """
    scene = make_sample(name)
    kind = workload_named(workload)
    more = {"compare": False} if workload == "whitted" else {"shadows": True}
    settings = kind.Settings(width=200, height=200, **more)
    tree = built(lab, "bvh", scene)
    buffer = built(lab, LIGHT_BUFFER, scene, "last_occluder=light,full_occlusion=false")
    generations = kind.generations(scene, settings, kind.make(scene, settings))
    rays, sent, recalled = next(generations), 0, 0
    while rays is not None:
        hits, _ = tree.trace(rays)
        shadow = np.flatnonzero(rays.classes == rays.class_names.index(SHADOW))
        if len(shadow):
            own, counts = buffer.trace(rays.select(shadow))
            assert np.array_equal(own.primitive >= 0, hits.primitive[shadow] >= 0)
            sent, recalled = sent + len(shadow), recalled + int(counts["recalled"].sum())
        try:
            rays = generations.send(hits)
        except StopIteration:
            rays = None
    assert least <= recalled / sent <= most


def test_faces_of_a_cube_share_all_directions(lab):
    scene = lit(lab.small_scene("suzanne"))
    for text in SETTINGS:
        structure = built(lab, LIGHT_BUFFER, scene, text)
        weights = np.where(structure.lists.children < 0, structure.weights, 0.0)
        by_face = np.bincount(structure.squares.face, weights)
        is_cube = structure.is_of_cube
        assert np.allclose(by_face[is_cube], 1.0 / 6.0, rtol=1e-12)
        assert np.allclose(by_face[~is_cube], 1.0, rtol=1e-12)


def test_a_cell_of_a_cube_has_the_solid_angle_of_its_rays(lab):
    """Directions spread evenly over a sphere fall into cells as often as their angles say."""
    scene = lit(lab.small_scene("one"))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=2")
    ways = np.random.default_rng(1).normal(size=(24_000, 3))
    cells = np.array([structure.cell_of(0, way) for way in ways[:6000]])
    counts = np.bincount(cells, minlength=24)[:24]
    # All 24 have the same angle, by symmetry; a binomial count has this standard deviation.
    assert np.allclose(structure.weights[:24], 1.0 / 24.0)
    assert np.abs(counts - 250).max() < 4.5 * np.sqrt(6000 * (1 / 24) * (23 / 24))


def test_a_direction_comes_back_out_of_its_place():
    faces = cube(np.array([1.0, 2.0, 3.0]))
    rng = np.random.default_rng(2)
    for way in rng.normal(size=(100, 3)):
        axis = np.abs(way).argmax()
        face = 2 * axis + (way[axis] < 0.0)
        u, v, w = faces.axes[face] @ way
        assert w > 0.0
        assert max(abs(u), abs(v)) <= w
        back = u / w * faces.back[face, 0] + v / w * faces.back[face, 1] + faces.back[face, 2]
        assert np.allclose(back * w, way, rtol=1e-15)


def test_the_picture_is_the_cameras():
    for camera in CAMERAS.values():
        faces = picture_of(camera, 40, 30)
        scene = Scene.from_triangles(np.eye(3)[None], "one", camera=camera)
        rays = CameraWorkload.make(scene, CameraSettings(width=40, height=30, pixel="corner"))
        ends = rays.origins + rays.directions - faces.origins[0]
        a = ends @ faces.axes[0].T
        places = a[:, :2] if faces.is_parallel[0] else a[:, :2] / a[:, 2:]
        u, v = np.meshgrid(np.linspace(-1, 1, 40), np.linspace(1, -1, 30))
        assert np.allclose(places, np.stack([u.ravel(), v.ravel()], axis=1), atol=1e-12)


def test_one_item_covers_what_lies_behind_it(lab):
    """A large triangle before a small one: only the large one is listed, and it alone is tested."""
    near = np.array([[-50.0, -50, -1], [50, -50, -1], [0, 80, -1]])
    far = np.array([[-0.1, -0.1, -2], [0.1, -0.1, -2], [0, 0.1, -2]])
    scene = Scene.from_triangles(np.array([near, far]), "two", lights=point_lights((0.0, 0.0, 0.0)))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=3")
    middle = structure.cell_of(0, np.array([0.0, 0.0, -1.0]))
    assert structure.lists.cover[middle] == 0
    assert structure.lists.references[structure.lists.first[middle]] == 0
    assert structure.lists.last[middle] - structure.lists.first[middle] == 1
    # The corner of the cell is at (1/3, 1/3, -1).
    assert structure.lists.far[middle] == pytest.approx(np.sqrt(11.0) / 3.0, rel=1e-5)
    origins = np.array([[0.0, 0, -3], [0, 0, -0.5]])
    rays = Rays.from_arrays(origins, -origins, 1.0, queries=ANY, classes=1,
                            class_names=CLASS_NAMES, targets=0)  # fmt: skip
    hits, counts = structure.trace(rays)
    assert (hits.primitive >= 0).tolist() == [True, False]
    assert counts["covered"].tolist() == [1, 0]
    assert counts["N_IT"].tolist() == [1, 0]
    without = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=3,full_occlusion=false")
    assert without.lists.last[middle] - without.lists.first[middle] == 2
    assert not np.isfinite(without.lists.far).any()


def test_a_cell_up_to_the_border_of_an_item_is_not_covered(lab):
    """A ray along that border may pass beside the item; cells a little inside are covered."""
    triangle = np.array([[[0.0, -50, -1], [0, 50, -1], [90, 0, -1]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    for size, begin in ((2, 1), (3, 2)):
        structure = built(lab, LIGHT_BUFFER, scene, f"division=uniform,cells={size}")
        cover = structure.lists.cover.reshape(6, size, size)[5]
        # With two cells in a row the border of the item is that of the second one.
        is_inside = (np.arange(size) >= begin) & (size == 3)
        assert np.array_equal(cover == 0, np.tile(is_inside, (size, 1)))


def test_a_cell_whose_parts_would_list_as_much_is_not_divided(lab):
    """Twenty triangles on top of each other: all are seen through all parts of the face below."""
    plane = np.array([[-50.0, -50, -1], [50, -50, -1], [0, 80, -1]])
    scene = Scene.from_triangles(
        np.tile(plane, (20, 1, 1)), "twenty", lights=point_lights((0.0, 0.0, 0.0))
    )
    text = "full_occlusion=false,max_list_size=8,max_depth=3"
    structure = built(lab, LIGHT_BUFFER, scene, text)
    lists, squares = structure.lists, structure.squares
    below = squares.face == 5
    assert below.sum() == 1
    assert lists.last[below] - lists.first[below] == 20
    # To the sides they are seen through the lower half alone, and through all of that.
    for face in range(4):
        assert squares.depth[squares.face == face].tolist() == [0, 1, 1, 1, 1]


def test_exact_insertion_lists_no_cell_that_a_triangle_does_not_touch(lab):
    """A right triangle in the plane before the origin: cells on and below its long side."""
    triangle = np.array([[[-1.0, -1, 1], [1, -1, 1], [-1, 1, 1]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    structure = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=8,full_occlusion=false")
    squares, lists = structure.squares, structure.lists
    listed = (lists.last - lists.first) > 0
    up = squares.face == 4
    below = squares.u[up] + squares.v[up] <= 1e-9
    assert np.array_equal(listed[up], below)
    # Its border lies in the borders of other faces: there the cells along it see it, too.
    assert listed[~up].sum() == 2 * 8 + 2
    rectangle = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=8,insert=box")
    assert ((rectangle.lists.last - rectangle.lists.first)[up] == 1).all()


def test_lists_of_exact_insertion_are_the_shortest(lab):
    for name in ("suzanne", "teapot", "gears", "tree"):
        scene = lit(lab.small_scene(name))
        for text in ("", "division=uniform"):
            exact = built(lab, LIGHT_BUFFER, scene, text)
            assert exact.statistics().extra["list_over_exact"] == 1.0
            for how in ("box", "cone"):
                loose = built(lab, LIGHT_BUFFER, scene, f"{text}{',' * bool(text)}insert={how}")
                assert loose.statistics().extra["list_over_exact"] >= 1.0


def test_merged_lists_are_shorter_together_and_lack_nothing(lab):
    scene = lit(lab.small_scene("suzanne"))
    for text in ("", "division=uniform,"):
        plain, equal, similar = (
            built(lab, LIGHT_BUFFER, scene, f"{text}merge={how}").lists
            for how in ("none", "equal", "similar")
        )
        assert len(plain.references) > len(equal.references) > len(similar.references)
        for cell in np.flatnonzero(plain.children < 0).tolist():
            own = plain.references[plain.first[cell] : plain.last[cell]]
            same = equal.references[equal.first[cell] : equal.last[cell]]
            more = similar.references[similar.first[cell] : similar.last[cell]]
            assert np.array_equal(own, same)
            assert set(own) <= set(more)
            assert len(more) <= max(1.25 * len(own), len(own))


def test_what_was_drawn_misses_less_the_more_it_is_dilated(lab):
    """Rays of a mesh whose triangles are smaller than pixels; dilated cells overlook fewer."""
    scene = lit(lab.small_scene("suzanne"))
    rays = shadow_rays_of(scene, count=1000)
    overlooked = []
    for dilation in (0, 1, 4):
        text = f"division=uniform,cells=16,insert=raster,dilation={dilation}"
        structure = built(lab, LIGHT_BUFFER, scene, text)
        _, counts = structure.trace(rays)
        overlooked.append(int(counts["overlooked"].sum()))
        lists, drawn = structure.lists, structure.arrays.drawn
        for cell in range(0, len(drawn.first), 7):
            seen = drawn.references[drawn.first[cell] : drawn.last[cell]]
            listed = lists.references[lists.first[cell] : lists.last[cell]]
            assert dilation or set(seen) <= set(listed)
    assert overlooked[0] > overlooked[1] > overlooked[2]
    with pytest.raises(InputError, match="choose division=uniform"):
        built(lab, LIGHT_BUFFER, scene, "insert=raster")


def test_certain_pixels_are(lab):
    """Every ray through a cell that is certain has the hit that the list alone says."""
    scene = lab.small_scene("teapot")
    structure = built(lab, IMAGE_DIRECTORY, scene, "width=64,height=64")
    certain = structure.statistics().extra["certain_share"]
    assert 0.0 < certain < 1.0
    rays = CameraWorkload.make(scene, CameraSettings(width=64, height=64))
    _, counts = structure.trace(rays)
    alone = counts["N_IT"] <= 1
    # Pixel centres are spread evenly over the picture: about as many decide themselves.
    assert alone.mean() >= certain - 0.02


def test_what_is_needed_is_asked_for(lab):
    dark = dataclasses.replace(lab.small_scene("suzanne"), lights=())
    with pytest.raises(InputError, match="has no light, and a light buffer stands in lights"):
        built(lab, LIGHT_BUFFER, dark)
    odd = Camera(np.array([3.0, 0, 0]), np.zeros(3), np.eye(3)[2], 45.0, "panoramic", name="Eye")
    with pytest.raises(InputError, match="'Eye' is panoramic"):
        built(lab, IMAGE_DIRECTORY, dataclasses.replace(dark, camera=odd))
    scene = lit(dark)
    with pytest.raises(InputError, match="light_buffer answers shadow rays only, not primary"):
        built(lab, LIGHT_BUFFER, scene).trace(CameraWorkload.make(scene, CameraSettings()))


def test_lists_that_do_not_fit_are_refused_with_what_to_lower(lab, monkeypatch):
    from accelscope.core import memory

    scene = lit(lab.small_scene("suzanne"))
    monkeypatch.setattr(memory, "available_bytes", lambda: 1_500_000)
    for text, advice in (("division=uniform,cells=64", "lower cells"),
                         ("max_list_size=1,max_depth=12", "lower max_depth")):  # fmt: skip
        with pytest.raises(InputError, match=advice):
            built(lab, LIGHT_BUFFER, scene, text)


def test_routed_sends_each_class_to_its_directional_structure(lab):
    scene = lab.small_scene("gears")
    settings = CameraSettings(width=24, height=24, shadows=True)
    first = CameraWorkload.make(scene, settings)
    name, texts = parse_spec(f"routed:primary={IMAGE_DIRECTORY},shadow={LIGHT_BUFFER},other=bvh")
    routed = built(lab, name, scene, ",".join(f"{k}={v}" for k, v in texts.items()))
    naive = built(lab, "naive", scene)
    generations = CameraWorkload.generations(scene, settings, first)
    rays = next(generations)
    while True:
        hits, counts = routed.trace(rays)
        want, _ = naive.trace(rays)
        assert np.array_equal(hits.primitive >= 0, want.primitive >= 0)
        assert not counts["strangers"].any()
        shares = routed.answered(rays)
        assert {each["structure"] for each in shares.values()} <= set(DIRECTIONAL)
        try:
            rays = generations.send(want)
        except StopIteration:
            break


def test_a_ray_along_an_edge_of_the_cube_goes_through_the_first_of_its_faces(lab):
    """x before y before z, in the walk as where cells are asked for."""
    triangle = np.array([[[-3.0, -3, -2], [3, -3, -2], [0, 4, -2]]])
    scene = Scene.from_triangles(triangle, "one", lights=point_lights((0.0, 0.0, 0.0)))
    for text in ("", "division=uniform,cells=3"):
        structure = built(lab, LIGHT_BUFFER, scene, text)
        ways = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(way)])
        rays = Rays.from_arrays(ways, -ways, 1.0, queries=ANY, classes=1, class_names=CLASS_NAMES,
                                targets=0)  # fmt: skip
        for index, way in enumerate(ways):
            cell = structure.record(rays, index).cell[0]
            axis = int(np.abs(way).argmax())
            assert cell == structure.cell_of(0, way)
            assert structure.squares.face[cell] == 2 * axis + (way[axis] < 0.0)


def test_a_place_on_the_border_belongs_to_one_cell(lab):
    scene = lit(lab.small_scene("suzanne"))
    lists = built(lab, LIGHT_BUFFER, scene, "division=uniform,cells=7").lists
    for u, v in itertools.product((-1.0 - 1e-13, -1.0, 0.0, 1.0, 1.0 + 1e-13), repeat=2):
        assert 0 <= cell_at(lists, 2, u, v) - 2 * 49 < 49
    assert faces_of(np.zeros((1, 3)), np.eye(3)[None], np.zeros(1, bool)).spread[0] > np.sqrt(3.0)
