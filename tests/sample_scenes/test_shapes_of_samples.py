"""Shapes of sample scenes: counts, boxes, areas, order, as their sources say."""

import itertools
import math

import numpy as np
import pytest
from accelscope.core.geometry.icosphere import icosphere, icosphere_triangle_count
from accelscope.sample_scenes import make_sample
from accelscope.sample_scenes.mount import (
    MOUNTAIN_NUMBER,
    gauss,
    grid_hash,
    grow_mountain,
    sphere_centres,
)
from accelscope.sample_scenes.teapot_in_stadium import teapot
from mesh_measures import areas, doubled_normals, edge_uses, is_closed, volume

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
