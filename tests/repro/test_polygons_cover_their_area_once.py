"""Concave polygons, the same in OBJ, PLY, OFF and Blender: n - 2 triangles that cover them once.

A fan from the first corner covered what is outside, too.
"""

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.triangulation import triangulate
from accelscope.core.structures import structures

L = np.array([[3, 0], [3, 1], [1, 1], [1, 3], [0, 3], [0, 0]], float)


def areas(triangles):
    sides = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)


def outline_area(points):
    """The closed form: half the length of the sum of cross products of neighbouring corners."""
    points = points - points[0]
    return 0.5 * np.linalg.norm(np.cross(points, np.roll(points, -1, axis=0)).sum(axis=0))


def flat(outline, z=0.0):
    return np.column_stack([outline, np.full(len(outline), z)])


def cut(points):
    return triangulate(points, np.arange(len(points)), np.array([len(points)]))


def write(path, points):
    n = len(points)
    numbers = [" ".join(map(repr, map(float, point))) for point in points]
    if path.suffix == ".obj":
        lines = [f"v {text}" for text in numbers] + ["f " + " ".join(map(str, range(1, n + 1)))]
    else:
        ply = ["ply", "format ascii 1.0", f"element vertex {n}"]
        ply += [f"property double {axis}" for axis in "xyz"]
        ply += ["element face 1", "property list uchar int vertex_index", "end_header"]
        lines = (ply if path.suffix == ".ply" else ["OFF", f"{n} 1 0"]) + numbers
        lines.append(" ".join(map(str, (n, *range(n)))))
    path.write_text("\n".join(lines) + "\n")


@pytest.mark.parametrize("suffix", ["obj", "ply", "off"])
def test_the_same_in_every_format(cases, tmp_path, suffix):
    write(tmp_path / f"m.{suffix}", flat(L))
    scene = load_mesh_file(tmp_path / f"m.{suffix}")
    assert scene.triangles.tolist() == flat(L)[cut(flat(L))].tolist()
    assert areas(scene.triangles).sum() == 5.0
    arrays = np.load(cases / "polygon_concave_rays.npz")
    naive = structures()["naive"]
    rays = Rays.from_arrays(arrays["origins"], arrays["directions"])
    for one in (scene, load_mesh_file(cases / "polygon_concave.obj")):
        hits, _ = naive.build(one, naive.Settings()).trace(rays)
        assert (hits.primitive >= 0).tolist() == [True, True, True, False, False]


def test_the_same_in_blender(bpy):
    from accelscope.addon.from_blender import extraction

    outlines = [L, L[::-1], L[[0, 1, 2, 3]], np.array([[0, 0], [4, 0], [1, 1], [0, 4]], float)]
    for number, outline in enumerate(outlines):
        mesh = bpy.data.meshes.new("mesh")
        mesh.from_pydata(flat(outline, number), [], [range(len(outline))])
        bpy.context.collection.objects.link(bpy.data.objects.new(f"{number}", mesh))
    scene = extraction.extract(bpy.context, extraction.VISIBLE)
    wanted = [flat(each, n)[cut(flat(each))] for n, each in enumerate(outlines)]
    order = np.argsort(scene.triangles[:, 0, 2], kind="stable")
    assert np.array_equal(scene.triangles[order], np.concatenate(wanted))


def subdivided(outline, parts):
    following = np.roll(outline, -1, axis=0)
    steps = np.arange(parts)[:, None] / parts
    return np.concatenate([a + (b - a) * steps for a, b in zip(outline, following)])


def star(rng):
    n = int(rng.integers(5, 60))
    angles, radii = (np.arange(n) + 0.9 * rng.random(n)) * 2 * np.pi / n, rng.uniform(0.1, 1, n)
    return radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def comb(rng):
    """Teeth whose feet lie on one line."""
    teeth = [[(2 * i, 0), (2 * i, 5), (2 * i + 1, 5), (2 * i + 1, 0)] for i in range(6)]
    return np.array([*np.concatenate(teeth), (11, -1), (0, -1)], float)


def with_holes(rng):
    """A square with holes in a row, sewn to its outline by edges that are passed twice."""
    count = int(rng.integers(1, 9))
    below, above = [], []
    for x in np.linspace(1, 9, count):
        below += [(x - 0.3, 5), (x, 5.3), (x + 0.3, 5)]
        above += [(x - 0.3, 5), (x, 4.7), (x + 0.3, 5)]
    square = [(0, 0), (10, 0), (10, 10), (0, 10), (0, 5)]
    return np.array([*square, *below, *above[::-1], (0, 5)], float)


def spiral(rng):
    angle = np.linspace(0, 12 * np.pi, 60)
    arms = [(r + angle)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (3, 1)]
    return np.concatenate([arms[0], arms[1][::-1]])


OUTLINES = {
    "star": star,
    "comb": comb,
    "comb with corners on its sides": lambda rng: subdivided(comb(rng), int(rng.integers(2, 5))),
    "square with corners on its sides": lambda rng: subdivided(L[[0, 4, 5]], 7),
    "L": lambda rng: subdivided(L, int(rng.integers(1, 5))),
    "corners on top of each other": lambda rng: np.repeat(L, rng.integers(1, 4, len(L)), axis=0),
    "holes": with_holes,
    "holes with corners on all sides": lambda rng: subdivided(with_holes(rng), 3),
    "spiral": spiral,
}


@pytest.mark.parametrize("name", OUTLINES)
def test_areas_add_up(name):
    rng = np.random.default_rng(len(name))
    for turn in range(30):
        outline = np.roll(OUTLINES[name](rng), int(rng.integers(200)), axis=0)[:: (-1) ** turn]
        points = flat(outline)
        if turn > 9:
            rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            points = points @ rotation.T * 10.0 ** rng.uniform(-120, 120)
        triangles = cut(points)
        assert triangles.shape == (len(points) - 2, 3)
        scale = np.abs(points).max()
        total, wanted = areas(points[triangles] / scale).sum(), outline_area(points / scale)
        assert total == pytest.approx(wanted, rel=1e-9)


def test_a_corner_on_a_side_is_no_reason_for_a_triangle_without_area():
    points = flat(subdivided(np.array([[0, 0], [4, 0], [0, 4]], float), 4))
    assert areas(points[cut(points)]).min() > 0.1


def test_convex_polygons_are_fans_and_quads_are_cut_as_blender_does():
    angle = np.arange(7) * 2 * np.pi / 7
    heptagon = flat(np.column_stack([np.cos(angle), np.sin(angle)]))
    assert cut(heptagon).tolist() == [[0, i, i + 1] for i in range(1, 6)]
    dart = flat(np.array([[4, 0], [1, 1], [0, 4], [0, 0]], float))
    for first in range(4):
        inside = first % 2 == 1  # the diagonal from corner 0 is that from the dart's notch
        wanted = [[0, 1, 2], [0, 2, 3]] if inside else [[0, 1, 3], [1, 2, 3]]
        assert cut(np.roll(dart, -first, axis=0)).tolist() == wanted


@pytest.mark.parametrize("what", ["crossing", "one point", "one line", "nan", "infinite"])
def test_every_polygon_gives_n_less_two_triangles(what):
    rng = np.random.default_rng(5)
    for n in range(3, 40):
        points = rng.normal(size=(n, 3))
        if what == "one point":
            points[:] = points[0]
        elif what == "one line":
            points = points[:1] * np.arange(n)[:, None]
        elif what in ("nan", "infinite"):
            points[n // 2] = {"nan": np.nan, "infinite": -np.inf}[what]
        triangles = cut(points)
        assert triangles.shape == (n - 2, 3)
        assert set(triangles.ravel().tolist()) <= set(range(n))


def test_mixed_polygons_stand_in_their_order():
    """Sizes from nothing to many: each polygon's triangles are those it has alone."""
    rng = np.random.default_rng(3)
    positions = rng.normal(size=(500, 3)).astype(np.float32)
    sizes = rng.integers(0, 9, 300)
    corners = rng.integers(0, 500, sizes.sum()).astype(np.int32)
    wanted = [
        triangulate(positions, part, np.array([len(part)]))
        for part in np.split(corners, np.cumsum(sizes)[:-1])
        if len(part) > 2
    ]
    triangles = triangulate(positions, corners, sizes)
    assert triangles.dtype == np.int32
    assert np.array_equal(triangles, np.concatenate(wanted))
