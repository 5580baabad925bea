"""The sample scenes: counts, boxes, areas, order, determinism, refusals."""

import dataclasses
import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.icosphere import icosphere, icosphere_triangle_count
from accelscope.core.geometry.triangles import Triangles
from accelscope.core.settings import describe
from accelscope.sample_scenes import make_sample, sample_named, samples
from accelscope.sample_scenes.catmull_clark import subdivide, triangulate
from accelscope.sample_scenes.mount import (
    MOUNTAIN_NUMBER,
    gauss,
    grid_hash,
    grow_mountain,
    sphere_centres,
)
from accelscope.sample_scenes.teapot_in_stadium import teapot

NAMES = list(samples())
SPD = {
    "balls", "gears", "jacks", "lattice", "mount", "rings", "shells", "sombrero", "teapot", "tetra",
    "tree",
}  # fmt: skip
"""Scenes of the Standard Procedural Databases."""


def areas(triangles):
    return np.linalg.norm(doubled_normals(triangles), axis=1) / 2.0


def doubled_normals(triangles):
    return np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])


def volume(triangles):
    """Enclosed volume, positive when the triangles turn counter-clockwise seen from outside."""
    return np.einsum("ij,ij->", triangles[:, 0], doubled_normals(triangles)) / 6.0


def numbered_vertices(triangles):
    """Number of the vertex, among the different ones, that each corner is, (n, 3).

    As opaque bytes: ten times faster than np.unique by rows. Adding 0 makes -0 a 0.
    """
    points = np.ascontiguousarray(triangles.reshape(-1, 3) + 0.0)
    _, index = np.unique(points.view(np.dtype((np.void, 24))).ravel(), return_inverse=True)
    return index.reshape(-1, 3)


def edge_uses(triangles):
    """How often each directed edge, named by its bit-exact ends, occurs; and reversed."""
    corners = numbered_vertices(triangles)
    forward = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2)
    key = forward[:, 0] * (corners.max() + 1) + forward[:, 1]
    reverse = forward[:, 1] * (corners.max() + 1) + forward[:, 0]
    return np.unique(key, return_counts=True)[1], np.isin(reverse, key)


def is_closed(triangles):
    once, matched = edge_uses(triangles)
    return bool((once == 1).all() and matched.all())


# All scenes ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_default_scene_is_small_and_as_large_as_announced(name):
    sample = sample_named(name)
    scene = make_sample(name)
    assert len(scene) == sample.count(sample.Settings()) <= 20_000
    assert scene.name == name
    assert scene.source == f"sample:{name}"
    assert scene.dropped == 0
    if isinstance(scene.geometry, Triangles):
        assert (areas(scene.triangles) > 0.0).all()
    assert len(scene.object_ids) == len(scene)
    assert set(scene.object_ids) == set(range(len(scene.object_names)))


@pytest.mark.parametrize("name", NAMES)
def test_generation_is_deterministic(name):
    first, second = make_sample(name).geometry, make_sample(name).geometry
    assert type(first) is type(second)
    for column, again in zip(first, second, strict=True):
        assert np.array_equal(column, again)


@pytest.mark.parametrize("name", NAMES)
def test_registry_says_what_a_menu_needs(name):
    sample = samples()[name]
    assert sample.name == name
    assert sample.label
    assert sample.summary
    assert all(row["label"] and row["description"] for row in describe(sample.Settings))
    assert dataclasses.is_dataclass(sample.Settings)


def test_own_cameras_see_their_scene():
    for name in (*sorted(SPD), "teapot_in_stadium"):
        scene = make_sample(name)
        assert scene.lights
        assert {light.kind for light in scene.lights} == {"point"}
        view = scene.camera.target - scene.camera.position
        boxes = scene.boxes()
        centres = (boxes[:, :3] + boxes[:, 3:]) / 2.0 - scene.camera.position
        if name == "teapot_in_stadium":
            # The whole stadium surrounds its camera; the teapot is what it has to see.
            centres = centres[scene.object_ids == 0]
        cosines = centres @ view / (np.linalg.norm(view) * np.linalg.norm(centres, axis=1))
        within = cosines > math.cos(math.radians(scene.camera.fov / 2.0))
        # The camera of the lattice stands inside of it.
        assert within.mean() > (0.25 if name == "lattice" else 0.75), name


def test_source_repeats_the_settings_that_differ_from_the_default():
    assert make_sample("tetra:size=3").source == "sample:tetra:size=3"
    assert make_sample("tetra:size=6").source == "sample:tetra"
    spec = "soup:count=7,edge=0.5,seed=3"
    scene = make_sample(spec)
    assert scene.source == f"sample:{spec}"
    again = make_sample(scene.source.removeprefix("sample:"))
    assert np.array_equal(scene.triangles, again.triangles)


# Refusals --------------------------------------------------------------------------------------


def test_unknown_sample_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"no sample scene 'tetrahedron'.*suzanne.*tetra.*soup"):
        make_sample("tetrahedron")


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ("tetra:dept=3", "sample scene tetra has no setting 'dept'.*size"),
        ("tetra:size=0", "size must be at least 1 and at most 12, not 0"),
        ("tetra:size=13", "size must be .*at most 12"),
        ("tetra:size=deep", "size takes a whole number, not 'deep'"),
        ("tetra:size=2.5", "size takes a whole number"),
        ("mount:size=8", "size must be .*at most 7"),
        ("mount:sphere_subdivisions=2", "sample scene mount has no setting 'sphere_subdivisions'"),
        ("balls:size=7", "size must be .*at most 6"),
        ("lattice:size=0", "size must be at least 1"),
        ("sombrero:size=0", "size must be at least 1"),
        ("suzanne:subdivisions=7", "subdivisions must be .*at most 6"),
        ("soup:edge=0", "edge must be at least 1e-06"),
        ("soup:edge=nan", "edge must be finite"),
        ("soup:count=0", "count must be at least 1"),
        ("soup:seed=-1", "seed must be at least 0"),
        ("teapot_in_stadium:size_ratio=1", "size_ratio must be at least 1.5"),
        ("teapot_in_stadium:stand_height=inf", "stand_height must be finite"),
        ("bunny:size=2", "sample scene bunny has no setting 'size'"),
    ],
)
def test_bad_setting_is_refused_by_name(spec, message):
    with pytest.raises(InputError, match=message):
        make_sample(spec)


def test_settings_made_in_code_are_checked_too():
    sample = sample_named("tetra")
    with pytest.raises(InputError, match="size must be"):
        sample.generate(sample.Settings(size=40))


@pytest.mark.parametrize("spec", ["soup:count=1000000000", "tetra:size=12", "sombrero:size=9"])
def test_scene_that_does_not_fit_is_refused_before_allocating(spec, monkeypatch):
    monkeypatch.setattr("accelscope.core.memory.available_bytes", lambda: 2**30)
    name = spec.partition(":")[0]
    with pytest.raises(InputError, match=rf"sample scene {name} with \d+ items needs .*lower"):
        make_sample(spec)


# tetra -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("size", [1, 2, 3, 4, 6])
def test_tetra_is_the_sierpinski_tetrahedron(size):
    scene = make_sample(f"tetra:size={size}")
    assert len(scene) == 4**size
    assert scene.lower.tolist() == [-1.0, -1.0, -1.0]
    assert scene.upper.tolist() == [1.0, 1.0, 1.0]

    # Every coordinate is an exact multiple of the half size of the smallest cube.
    scaled = scene.triangles * 2 ** (size - 1)
    assert np.array_equal(scaled, np.round(scaled))

    # 4^(size-1) regular tetrahedra of edge 2 sqrt(2) / 2^(size-1): the area stays, the
    # volume halves with every level.
    edge = math.sqrt(8.0) / 2 ** (size - 1)
    assert areas(scene.triangles) == pytest.approx(math.sqrt(3.0) / 4.0 * edge**2, rel=1e-14)
    assert areas(scene.triangles).sum() == pytest.approx(8.0 * math.sqrt(3.0), rel=1e-13)
    assert volume(scene.triangles) == pytest.approx(8.0 / 3.0 / 2 ** (size - 1), rel=1e-13)
    for tetrahedron in scene.triangles.reshape(-1, 4, 3, 3)[:16]:
        assert is_closed(tetrahedron)


def test_tetra_comes_in_the_order_of_its_recursion():
    """The corners of a triangle's cube, read as base-4 digits of its number."""
    size = 4
    triangles = make_sample(f"tetra:size={size}").triangles
    signs = [s for s in itertools.product((-1, 1), repeat=3) if math.prod(s) == 1]

    def cubes(centre, half, level):
        if level == size:
            yield centre, half
            return
        for s in signs:
            yield from cubes(centre + np.array(s) * half / 2, half / 2, level + 1)

    for number, (centre, half) in enumerate(cubes(np.zeros(3), 1.0, 1)):
        corners = {tuple(centre + np.array(s) * half) for s in signs}
        faces = triangles[4 * number : 4 * number + 4]
        assert {tuple(p) for p in faces.reshape(-1, 3)} == corners


# mount -----------------------------------------------------------------------------------------


def test_mountain_covers_its_square_and_has_no_cracks():
    triangles = grow_mountain(6)
    assert len(triangles) == 8192
    assert areas(triangles[:, :, [0, 1]] @ np.eye(2, 3)).sum() == pytest.approx(4.0, rel=1e-12)
    once, matched = edge_uses(triangles)
    assert (once == 1).all()
    assert np.count_nonzero(~matched) == 4 * 64  # the rim of the square, and nothing else


def test_mountain_agrees_with_a_scalar_recursion():
    """The rule as it is printed, one square at a time."""
    size = 4
    n = 2**size
    heights = {}
    roughness = math.sqrt((2.0 / math.exp(math.log(2.0) / 1.2)) ** 2 - 1.0)

    def displacement(x, y):
        seed = 21 + (((x << (23 - size)) + (y << (15 - size))
                      + (x << (7 - size))) & 0xFFFF)  # fmt: skip
        while True:
            a = (28411 + seed * 8121) % 134456
            seed = b = (28411 + a * 8121) % 134456
            u, v = 2.0 * a / 134456 - 1.0, 2.0 * b / 134456 - 1.0
            r = u * u + v * v
            if r < 1.0:
                return u * math.sqrt(-2.0 * math.log(r) / r)

    def grow(x, y, width, corners):
        heights.update(
            zip([(x, y), (x + width, y), (x + width, y + width), (x, y + width)], corners)
        )
        if width == 1:
            return
        half = width // 2
        rise = half * 2.0 / n * roughness
        places = [(x + half, y), (x + width, y + half), (x + half, y + width), (x, y + half)]
        a, b, c, d = corners
        e, f, g, h = (
            (p + q) / 2.0 + rise * displacement(*place)
            for (p, q), place in zip([(a, b), (b, c), (c, d), (d, a)], places)
        )
        m = sum(corners) / 4.0 + 1.4142136 * rise * displacement(x + half, y + half)
        grow(x, y, half, (a, e, m, h))
        grow(x + half, y, half, (e, b, f, m))
        grow(x + half, y + half, half, (m, f, c, g))
        grow(x, y + half, half, (h, m, g, d))

    grow(0, 0, n, (0.0, 0.0, 0.0, 0.0))
    triangles = grow_mountain(size)
    for x, y, z in triangles.reshape(-1, 3):
        place = (round((x + 1.0) * n / 2.0), round((y + 1.0) * n / 2.0))
        assert z == pytest.approx(heights[place], rel=1e-12, abs=1e-14)
    # Order of the recursion: the first quarter of the triangles is the lower left quarter.
    assert (triangles[: len(triangles) // 4, :, :2] <= 0.0).all()


def test_mount_random_numbers_are_normal_and_hash_is_16_bits():
    numbers = gauss(np.arange(134456, dtype=np.int64))
    assert abs(numbers.mean()) < 4.0 / math.sqrt(len(numbers))
    assert numbers.std() == pytest.approx(1.0, abs=0.01)
    x, y = np.meshgrid(np.arange(65), np.arange(65))
    hashed = grid_hash(x.ravel(), y.ravel(), 6)
    assert hashed.min() >= 0
    assert hashed.max() <= 0xFFFF
    assert MOUNTAIN_NUMBER == 21


def test_mount_spheres_touch_each_other():
    centres = sphere_centres()
    for a, b in itertools.combinations(centres, 2):
        assert np.linalg.norm(a - b) == pytest.approx(2 * 0.17, rel=1e-12)
    assert centres.mean(axis=0) == pytest.approx([-0.8, 0.8, 1.0], abs=1e-12)


@pytest.mark.parametrize("subdivisions", [1, 2, 3, 4])
def test_icosphere(subdivisions):
    triangles = icosphere(subdivisions)
    assert len(triangles) == icosphere_triangle_count(subdivisions) == 20 * 4 ** (subdivisions - 1)
    assert np.linalg.norm(triangles, axis=2) == pytest.approx(1.0, rel=1e-14)
    assert is_closed(triangles)
    if subdivisions == 1:
        edge = 1.0 / math.sin(2.0 * math.pi / 5.0)
        assert areas(triangles).sum() == pytest.approx(5.0 * math.sqrt(3.0) * edge**2, rel=1e-13)
    else:
        assert triangles.min(axis=(0, 1)) == pytest.approx([-1.0] * 3, abs=1e-15)
        assert triangles.max(axis=(0, 1)) == pytest.approx([1.0] * 3, abs=1e-15)
    sphere = 4.0 / 3.0 * math.pi
    assert sphere * (1.0 - 1.6 / 4 ** (subdivisions - 1)) < volume(triangles) < sphere


# sombrero --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("size", "count"), [(1, 1922), (2, 7938), (3, 32258), (4, 130050)])
def test_sombrero_counts_and_box(size, count):
    scene = make_sample(f"sombrero:size={size}")
    assert len(scene) == count
    assert scene.lower[:2].tolist() == [-4.0, -4.0]
    assert scene.upper[:2].tolist() == [4.0, 4.0]
    # The tip is sampled exactly; the first trough lies near r = 1/2.
    assert scene.upper[2] == 1.0
    assert -math.exp(-0.45) < scene.lower[2] <= -math.exp(-0.55)


def test_sombrero_samples_the_function():
    triangles = make_sample("sombrero").triangles
    # Sample i stands at -4 + 8 i / (W - 1) and was taken at -4 + 8 i / W.
    i = (triangles[..., 0] + 4.0) * 31 / 8
    j = (triangles[..., 1] + 4.0) * 31 / 8
    r = np.hypot(-4.0 + i / 4.0, -4.0 + j / 4.0)
    assert triangles[..., 2] == pytest.approx(np.cos(2 * np.pi * r) * np.exp(-r), abs=1e-12)
    assert (doubled_normals(triangles)[:, 2] > 0.0).all()
    # Seen from above it is the square.
    assert doubled_normals(triangles)[:, 2].sum() / 2.0 == pytest.approx(64.0, rel=1e-13)


# suzanne ---------------------------------------------------------------------------------------

# Vertices, faces, lower and upper corner of what Blender 5.2's Subdivision Surface modifier makes
# with "Use Limit Surface" off; Blender keeps float32. Of the 507 vertices of the base mesh, two of
# the eyes lie on two of the head.
BLENDERS_SUZANNE = {
    0: (505, 968, [-1.3671875, -0.8515625, -0.984375], [1.3671875, 0.8515625, 0.984375]),
    1: (2012, 3936, [-1.3369141, -0.8256836, -0.9746094], [1.3369141, 0.8007812, 0.9501953]),
    2: (7958, 15744, [-1.3306841, -0.8228964, -0.9730835], [1.3306841, 0.7838898, 0.9419556]),
    3: (31658, 62976, [-1.3294073, -0.8227298, -0.9721379], [1.3294072, 0.7796717, 0.9399147]),
}


@pytest.mark.parametrize("subdivisions", BLENDERS_SUZANNE)
def test_suzanne_is_as_blender_subdivides_it(subdivisions):
    scene = make_sample(f"suzanne:subdivisions={subdivisions}")
    vertices, triangles, lower, upper = BLENDERS_SUZANNE[subdivisions]
    assert len(scene) == triangles
    assert numbered_vertices(scene.triangles).max() + 1 == vertices
    assert scene.lower == pytest.approx(lower, abs=5e-7)
    assert scene.upper == pytest.approx(upper, abs=5e-7)
    # Four open rims, of the eyes (13 edges each) and of the holes behind them (8 each).
    _, matched = edge_uses(scene.triangles)
    assert np.count_nonzero(~matched) == 42 * 2**subdivisions


BLENDER_SUBDIVIDES = """
import sys
import bpy
import numpy as np

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.mesh.primitive_monkey_add()
monkey = bpy.context.object
meshes = {}
for level in (0, 1, 2):
    modifier = monkey.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels, modifier.use_limit_surface = level, False
    mesh = monkey.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    mesh.calc_loop_triangles()
    points = np.array([vertex.co for vertex in mesh.vertices])
    meshes[f"level{level}"] = points[[tuple(t.vertices) for t in mesh.loop_triangles]]
    monkey.modifiers.clear()
np.savez(sys.argv[1], **meshes)
"""


def places_of(points, others):
    """Return for each of some points which of the others is nearest, (n,)."""
    order = np.argsort(others[:, 0])
    others = others[order]
    # Only those with nearly the same x are looked at.
    first, last = (np.searchsorted(others[:, 0], points[:, 0] + shift) for shift in (-1e-5, 1e-5))
    nearest = [
        low + np.abs(others[low:high] - point).sum(axis=1).argmin()
        for point, low, high in zip(points, first, last, strict=True)
    ]
    return order[nearest]


@pytest.mark.bpy
def test_suzanne_agrees_with_blender_triangle_by_triangle(tmp_path):
    pytest.importorskip("bpy")
    # In a process of its own: Blender's state is one per process.
    file = tmp_path / "suzanne.npz"
    subprocess.run([sys.executable, "-c", BLENDER_SUBDIVIDES, str(file)], check=True)
    with np.load(file) as meshes:
        for level in (0, 1, 2):
            ours = make_sample(f"suzanne:subdivisions={level}").triangles
            theirs = meshes[f"level{level}"]
            assert len(ours) == len(theirs)
            if level == 2:
                # From here on Blender numbers the quads in rows across a face of the base mesh,
                # so that every triangle has to be looked for.
                theirs = theirs[places_of(ours.mean(axis=1), theirs.mean(axis=1))]
                assert len(np.unique(theirs, axis=0)) == len(ours)
                ours, theirs = np.sort(ours, axis=1), np.sort(theirs, axis=1)
            # The same triangles, up to Blender's float32.
            assert np.abs(ours - theirs).max() < 1e-6


CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
CUBE_CORNERS = np.array([0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3])


def test_catmull_clark_of_a_cube():
    points, corners, sizes = subdivide(CUBE, CUBE_CORNERS, np.full(6, 4))
    assert len(points) == 8 + 12 + 6
    assert len(sizes) == 24
    assert np.abs(points[:8]) == pytest.approx(5.0 / 9.0, rel=1e-14)
    assert np.sort(np.abs(points[8:20])) == pytest.approx(np.tile([0.0, 0.75, 0.75], (12, 1)))
    assert np.sort(np.abs(points[20:])) == pytest.approx(np.tile([0.0, 0.0, 1.0], (6, 1)))
    triangles = points[triangulate(points, corners, sizes)]
    assert is_closed(triangles)
    assert (np.einsum("ij,ij->i", triangles.mean(axis=1), doubled_normals(triangles)) > 0).all()


def test_catmull_clark_keeps_a_plane_flat_and_rounds_its_rim():
    points = np.array([(x, y, 2.0) for y in range(4) for x in range(4)], dtype=float)
    quads = [(i, i + 1, i + 5, i + 4) for i in (0, 1, 2, 4, 5, 6, 8, 9, 10)]
    finer, corners, sizes = subdivide(points, np.array(quads).ravel(), np.full(9, 4))
    assert (finer[:, 2] == 2.0).all()
    # A regular vertex inside stays where it is; a corner goes to 1/8, 3/4, 1/8.
    assert finer[5] == pytest.approx([1.0, 1.0, 2.0], abs=1e-15)
    assert finer[0] == pytest.approx([0.125, 0.125, 2.0], abs=1e-15)
    assert finer[1] == pytest.approx([1.0, 0.0, 2.0], abs=1e-15)
    assert len(corners) == 4 * len(sizes) == 4 * 36


def test_folded_quad_is_cut_along_its_other_diagonal():
    arrow = np.array([(0, 0, 0), (2, -1, 0), (0.5, 0, 0), (2, 1, 0)], dtype=float)
    assert triangulate(arrow, np.arange(4), np.array([4])).tolist() == [[0, 1, 2], [0, 2, 3]]
    # Started at the next corner, the fan's diagonal would run outside of the arrow.
    turned = np.array([1, 2, 3, 0])
    assert triangulate(arrow, turned, np.array([4])).tolist() == [[1, 2, 0], [2, 3, 0]]


def test_catmull_clark_takes_any_polygons():
    # A pyramid: one square and four triangles.
    points = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0), (0, 0, 1)], dtype=float)
    corners = np.array([3, 2, 1, 0, 0, 1, 4, 1, 2, 4, 2, 3, 4, 3, 0, 4])
    for expected in (16, 64):
        if expected == 16:
            sizes = np.array([4, 3, 3, 3, 3])
        points, corners, sizes = subdivide(points, corners, sizes)
        assert len(sizes) == expected
        assert is_closed(points[triangulate(points, corners, sizes)])
        assert volume(points[triangulate(points, corners, sizes)]) > 0.0


# bunny, teapot, soup ---------------------------------------------------------------------------


def test_bunny_is_the_scan():
    scene = make_sample("bunny")
    assert len(scene) == 3674
    assert len(np.unique(scene.triangles.reshape(-1, 3), axis=0)) == 1839
    assert is_closed(scene.triangles)
    assert scene.lower == pytest.approx([-4.958475, -3.810639, -0.003149], abs=1e-6)
    assert scene.upper == pytest.approx([4.94885, 3.729833, 9.654748], abs=1e-6)
    # Volume and area as trimesh computes them from the package's own numbers.
    assert volume(scene.triangles) == pytest.approx(194.28837, rel=1e-7)
    assert areas(scene.triangles).sum() == pytest.approx(218.68927, rel=1e-7)


@pytest.mark.parametrize(("n", "patches"), [(1, 57), (2, 244), (3, 561), (4, 1008)])
def test_teapot_counts(n, patches):
    # The database's teapot has n^2 squares of a checkered floor beside these.
    assert len(teapot(n)) == patches - n * n
    scene = make_sample(f"teapot_in_stadium:teapot_resolution={n}")
    assert np.bincount(scene.object_ids).tolist() == [patches - n * n, 10]
    assert scene.object_names == ("teapot", "stadium")


def test_teapot_stands_on_the_floor_and_is_symmetric():
    triangles = teapot(8)
    assert (areas(triangles) > 0.0).all()
    assert triangles.min(axis=(0, 1)) == pytest.approx([-3.0, -2.0, 0.0], abs=1e-12)
    assert triangles[..., 1:].max(axis=(0, 1)) == pytest.approx([2.0, 3.15], abs=1e-12)
    # Mirrored in y it has the same points, to the last bit: neighbouring patches share edges.
    points = np.unique(triangles.reshape(-1, 3) + 0.0, axis=0)
    mirrored = np.unique(triangles.reshape(-1, 3) * [1.0, -1.0, 1.0] + 0.0, axis=0)
    assert np.array_equal(points, mirrored)


def test_teapot_patches_meet_without_cracks():
    """Open edges are those of the model: the ends of body, lid, handle and spout."""
    n = 6
    _, matched = edge_uses(teapot(n))
    # Inner rim (4 patches), lid's rim (4), both ends of the handle and of the spout (2 each);
    # the bottom is closed and joined to the body.
    assert np.count_nonzero(~matched) == n * (4 + 4 + 2 * 2 + 2 * 2)


def test_stadium_grows_with_the_ratio_and_the_teapot_does_not():
    small, large = (make_sample(f"teapot_in_stadium:size_ratio={r}") for r in (10, 1000))
    assert np.array_equal(small.triangles[:-10], large.triangles[:-10])
    assert large.diagonal == pytest.approx(100.0 * small.diagonal, rel=1e-12)
    pitch = areas(large.triangles[-10:-8]).sum()
    assert pitch == pytest.approx((1000 * 6.525) ** 2 * 68 / 105, rel=1e-12)
    flat = make_sample("teapot_in_stadium:stand_height=0")
    assert flat.upper[2] == pytest.approx(3.15)


def test_soup_is_equilateral_uniform_and_seeded():
    count, edge = 20_000, 0.1
    scene = make_sample(f"soup:count={count},edge={edge}")
    t = scene.triangles
    for a, b in ((0, 1), (1, 2), (2, 0)):
        assert np.linalg.norm(t[:, a] - t[:, b], axis=1) == pytest.approx(edge, rel=1e-12)
    assert areas(t).sum() == pytest.approx(count * math.sqrt(3.0) / 4.0 * edge**2, rel=1e-12)
    centroids = t.mean(axis=1)
    assert centroids.min() >= -1e-15
    assert centroids.max() <= 1.0 + 1e-15
    # Five standard errors: of the mean position, and of the mean projected area along each axis,
    # which for uniform orientations is half the area (|cos| is uniform in [0, 1]).
    tolerance = 5.0 / math.sqrt(12.0 * count)
    assert centroids.mean(axis=0) == pytest.approx([0.5] * 3, abs=tolerance)
    cosines = np.abs(doubled_normals(t)) / (2.0 * areas(t)[:, None])
    assert cosines.mean(axis=0) == pytest.approx([0.5] * 3, abs=tolerance)
    other = make_sample(f"soup:count={count},edge={edge},seed=2")
    assert not np.array_equal(t, other.triangles)
