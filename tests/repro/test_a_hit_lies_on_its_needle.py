"""A hit lies on its triangle, be the corners collinear but for rounding and the ray parallel to it.

The witness is exact: fractions, not numbers.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.files import load_mesh_file
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene

CASES = Path(__file__).parent / "cases"
EPS = Fraction(2) ** -52


def dot(u, v):
    return sum(x * y for x, y in zip(u, v, strict=True))


def minus(u, v):
    return [x - y for x, y in zip(u, v, strict=True)]


def cross(u, v):
    return [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ]


def squared_distance(p, triangle):
    """Of a point from a triangle, all fractions."""
    a, b, c = ([Fraction(x) for x in corner] for corner in triangle.tolist())
    normal, edges = cross(minus(b, a), minus(c, a)), ((a, b), (b, c), (c, a))
    square = dot(normal, normal)
    if square and all(dot(cross(minus(q, o), minus(p, o)), normal) >= 0 for o, q in edges):
        return dot(normal, minus(p, a)) ** 2 / square
    found = []
    for o, q in edges:
        along = minus(q, o)
        length = dot(along, along)
        share = min(max(dot(minus(p, o), along) / length, 0), 1) if length else 0
        away = minus(p, [x + share * y for x, y in zip(o, along, strict=True)])
        found.append(dot(away, away))
    return min(found)


def error_of(origin, direction, t, triangle):
    """Distance of a hit from its triangle, in eps of the coordinates involved."""
    o, d = [Fraction(x) for x in origin.tolist()], [Fraction(x) for x in direction.tolist()]
    p = [x + Fraction(float(t)) * y for x, y in zip(o, d, strict=True)]
    reach = np.abs(triangle).max(axis=0).tolist()
    scale = sum(abs(x) + Fraction(r) for x, r in zip(o, reach, strict=True))
    return float(squared_distance(p, triangle) / (EPS * scale) ** 2) ** 0.5


def needles(rng, count):
    """Triangles with corners on a line, but for their rounding or a little more."""
    along = rng.normal(size=(count, 1, 3))
    corners = rng.normal(size=(count, 1, 3)) + rng.uniform(-1, 2, size=(count, 3, 1)) * along
    corners[::3] += 1e-16 * rng.normal(size=corners[::3].shape)
    wide = 10.0 ** rng.uniform(-17, -8, size=(len(corners[1::3]), 1, 1))
    corners[1::3] += wide * rng.normal(size=corners[1::3].shape)
    return corners


def rays_at(rng, triangle, count):
    """Rays parallel to a needle, nearly so, in its plane, through corners, and across it."""
    along = triangle[1] - triangle[0]
    length = np.linalg.norm(along)
    low, size = triangle.min(axis=0), np.ptp(triangle, axis=0)
    on = triangle[0] + rng.random((count, 1)) * along
    corner = triangle[rng.integers(3, size=count)]
    unit = np.tile(along / length, (count, 1))
    unit_off = unit * (1.0 + 2.0**-52 * rng.integers(-2, 3, size=(count, 3)))
    nearly = along + 10.0 ** rng.uniform(-16, -3, size=(count, 1)) * rng.normal(size=(count, 3))
    any_way = rng.normal(size=(count, 3))
    inside = low + rng.random((count, 3)) * size
    pairs = [
        (inside, unit), (inside - 2 * length * unit, unit_off), (on - 2 * unit, unit),
        (on - 2 * nearly, nearly), (on - any_way, any_way), (corner - any_way, any_way),
        (corner - 3 * along, np.tile(along, (count, 1))),
    ]  # fmt: skip
    return np.concatenate([o for o, _ in pairs]), np.concatenate([d for _, d in pairs])


def test_hits_are_within_four_ulps_of_their_needle_in_exact_arithmetic(build):
    rng = np.random.default_rng(11)
    hits = 0
    for triangle in needles(rng, 400):
        try:
            naive = build("naive", Scene.from_triangles(triangle[None], "needle"))
        except InputError:
            continue  # no area at all
        origins, directions = rays_at(rng, triangle, 40)
        t = naive.trace(Rays.from_arrays(origins, directions))[0].t
        for i in np.flatnonzero(np.isfinite(t)):
            assert error_of(origins[i], directions[i], t[i], triangle) < 4
        hits += int(np.isfinite(t).sum())
    assert hits > 10_000


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("naive", ""), ("grid", ""), ("octree", ""), ("kdtree", ""), ("bvh", ""),
        ("bvh", "volume=obb"), ("bvh", "volume=kdop18"),
    ],
)  # fmt: skip
def test_a_ray_beside_a_needle_and_parallel_to_it_misses(build, name, text):
    scene = load_mesh_file(CASES / "needle.off")
    with np.load(CASES / "needle_ray.npz") as arrays:
        rays = Rays.from_arrays(arrays["origins"], arrays["directions"])
    assert build(name, scene, text).trace(rays)[0].primitive.tolist() == [-1]


EVERYWHERE = [
    ("grid", "resolution=16x16x16,assignment=exact"), ("octree", "assignment=exact"),
    ("kdtree", "max_leaf_size=1"), ("bsp", "max_leaf_size=2"), ("bvh", "builder=sbvh"),
    ("bvh", "volume=kdop26"), ("bvh", "volume=obb"), ("bvh", "volume=smallest_sphere"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text"), EVERYWHERE)
def test_every_structure_hits_the_same_needles(lab, build, name, text):
    """Exact assignment had lost needles whose computed normal is rounding error alone."""
    rng = np.random.default_rng(12)
    triangles = needles(rng, 200)
    scene = Scene.from_triangles(triangles, "needles")
    families = {str(i): rays_at(rng, triangle, 8) for i, triangle in enumerate(triangles)}
    rays, names = lab.batch_of(families)
    truth = build("naive", scene).trace(rays)[0]
    assert (truth.primitive >= 0).sum() > 2000
    structure = build(name, scene, text)
    assert lab.differences(names, truth, structure.trace(rays)[0]) == {}
    assert structure.validate() == []


def test_the_overlap_test_finds_needles_in_exact_arithmetic(build):
    """Every cell through which a needle passes, by fractions, lists it."""
    rng = np.random.default_rng(13)
    triangles = needles(rng, 60)
    scene = Scene.from_triangles(triangles, "needles")
    grid = build("grid", scene, "resolution=9x9x9,assignment=exact")
    listed = set()
    for cell in range(9**3):
        begin, end = grid.arrays.offsets[cell : cell + 2]
        listed |= {(cell, int(n)) for n in grid.arrays.references[begin:end]}
    checked = 0
    for n, triangle in enumerate(scene.triangles):
        for share in np.linspace(0.0, 1.0, 50):
            point = triangle[0] + share * (triangle[1] - triangle[0])
            index = [
                int(np.searchsorted(grid.walls(a), point[a], side="right")) - 1 for a in range(3)
            ]
            walls = [grid.walls(a)[index[a] : index[a] + 2] for a in range(3)]
            if min(abs(w - x) for pair, x in zip(walls, point, strict=True) for w in pair) < 1e-12:
                continue
            checked += 1
            assert ((index[0] * 9 + index[1]) * 9 + index[2], n) in listed
    assert checked > 2000
