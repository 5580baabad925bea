"""Independent witnesses: exact rational arithmetic, Embree, and closed surfaces."""

from fractions import Fraction

import numpy as np
import pytest
from accelscope.core.geometry.icosphere import icosphere
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample
from accelscope.sample_scenes.mount import SPHERE_RADIUS, sphere_centres

# ------------------------------------------------------------------------------ exact arithmetic


def exact_hit(corners, origin, direction):
    """Return the t of a closed triangle that is not seen edge-on, as a Fraction, or None."""
    a, b, c = ([Fraction(float(x)) for x in corner] for corner in corners)
    o = [Fraction(float(x)) for x in origin]
    d = [Fraction(float(x)) for x in direction]

    def minus(p, q):
        return [x - y for x, y in zip(p, q, strict=True)]

    def cross(p, q):
        return [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]

    def dot(p, q):
        return sum(x * y for x, y in zip(p, q, strict=True))

    normal = cross(minus(b, a), minus(c, a))
    slope = dot(normal, d)
    if slope == 0:
        return None
    t = dot(normal, minus(a, o)) / slope
    if t < 0:
        return None
    p = [x + t * y for x, y in zip(o, d, strict=True)]
    sides = [dot(normal, cross(minus(v, u), minus(p, u))) for u, v in ((a, b), (b, c), (c, a))]
    return t if min(sides) >= 0 else None


def exact_closest(scene, origin, direction):
    hits = [(exact_hit(corners, origin, direction), n) for n, corners in enumerate(scene.triangles)]
    return min(((t, n) for t, n in hits if t is not None), default=(None, -1))


def test_dyadic_rays_are_exact(lab, build):
    """Between dyadic points in 26 directions no rounding happens: the answers are exact."""
    scene = make_sample("tetra:size=2")
    vertices = np.unique(scene.triangles.reshape(-1, 3), axis=0)
    families = []
    for back in (0.0, 0.25, 2.0):
        for direction in lab.DIRECTIONS_26:
            families.append((vertices - back * direction, np.tile(direction, (len(vertices), 1))))
    rays = Rays.from_arrays(
        np.concatenate([o for o, _ in families]), np.concatenate([d for _, d in families])
    )
    hits, _ = build("naive", scene).trace(rays)
    n_hits = 0
    for i in range(len(rays)):
        t, n = exact_closest(scene, rays.origins[i], rays.directions[i])
        assert hits.primitive[i] == n, (rays.origins[i], rays.directions[i])
        assert hits.t[i] == (np.inf if t is None else float(t))
        n_hits += t is not None
    assert n_hits > 500


def test_generic_rays_agree_with_exact_arithmetic(lab, build):
    scene = lab.small_scene("soup")
    scene = Scene.from_triangles(scene.triangles[:25], "soup")
    families = lab.ray_families(scene, 12)
    # Of rays aimed at edges and corners rounding decides; all others have one right answer.
    kept = {name: families[name] for name in (*lab.GENERIC, "to faces", "inside to faces")}
    rays, _ = lab.batch_of(kept)
    hits, _ = build("naive", scene).trace(rays)
    for i in range(len(rays)):
        t, n = exact_closest(scene, rays.origins[i], rays.directions[i])
        assert hits.primitive[i] == n
        if t is not None:
            assert hits.t[i] == pytest.approx(float(t), rel=1e-12)


# --------------------------------------------------------------------------------------- Embree


def edge_distance(corners, points):
    """Return the least barycentric coordinate of points in their triangles; 0 is an edge."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    square = (normal * normal).sum(1)
    u = (np.cross(c - b, points - b) * normal).sum(1) / square
    v = (np.cross(a - c, points - c) * normal).sum(1) / square
    return np.minimum(np.minimum(u, v), 1 - u - v)


def test_embree_differs_only_by_its_single_precision(build, sample_of_triangles):
    pytest.importorskip("embreex")
    from accelscope.core.evaluation.embree import Embree
    from accelscope.core.evaluation.rays.workloads import random_lines

    # Both get the very same numbers: what single precision can hold.
    original = make_sample(sample_of_triangles)
    scene = Scene.from_triangles(original.triangles.astype(np.float32), original.name)
    count = 100_000
    o, d = random_lines(scene.lower, scene.upper, count, seed=3)
    rays = Rays.from_arrays(o.astype(np.float32), d.astype(np.float32))
    mine, _ = build("bvh", scene).trace(rays)
    embree = Embree(scene).trace(rays)

    # Rounding in single precision moves a ray by this much, at the distance it travels.
    blur = 16 * np.finfo(np.float32).eps * 2 * scene.diagonal
    hit = (mine.primitive >= 0) & (embree.primitive >= 0)
    same = mine.primitive == embree.primitive
    other = np.flatnonzero(~same)
    unexplained = []
    for i in other:
        near = []
        for hits in (mine, embree):
            n = hits.primitive[i]
            if n < 0:
                continue
            corners = scene.triangles[n]
            p = rays.origins[i] + hits.t[i] * rays.directions[i]
            edges = corners - np.roll(corners, 1, axis=0)
            height = (
                np.linalg.norm(np.cross(edges[0], edges[1])) / np.linalg.norm(edges, axis=1).max()
            )
            normal = np.cross(edges[0], edges[1])
            slope = abs(normal @ rays.directions[i]) / np.linalg.norm(normal)
            distance = edge_distance(corners[None], p[None])[0] * height
            near.append(abs(distance) * max(slope, 1e-3) < 40 * blur or slope < 1e-3)
        tie = hit[i] and abs(mine.t[i] - embree.t[i]) <= blur * 40
        if not (any(near) or tie):
            unexplained.append(int(i))
    assert unexplained == []
    agreeing = hit & same
    corners = scene.triangles[mine.primitive[agreeing]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    slope = np.abs((normal * rays.directions[agreeing]).sum(1))
    error = np.abs(mine.t[agreeing] - embree.t[agreeing]) * slope
    assert np.quantile(error, 0.999) < blur
    assert agreeing.sum() > 500
    # Ties apart, 30 per million at edges; the soup and the needles of the stadium have more edges.
    apart = np.where(hit, mine.t, 0.0) - np.where(hit, embree.t, 0.0)
    ties = hit & ~same & (np.abs(apart) <= 40 * blur)
    assert (~same & ~ties).sum() <= 30e-6 * count + 3


# ----------------------------------------------------------------------------- closed surfaces


def rays_at_all_weak_points(triangles, origins, rng, repeat):
    """Rays from inside through vertices, edge midpoints and points on edges of a closed mesh."""
    targets = [triangles.reshape(-1, 3)]
    for i in range(3):
        a, b = triangles[:, i], triangles[:, (i + 1) % 3]
        targets.append(0.5 * (a + b))
        for _ in range(2):
            targets.append(a + rng.random((len(a), 1)) * (b - a))
    targets = np.tile(np.concatenate(targets), (repeat, 1))
    o = origins[rng.integers(len(origins), size=len(targets))]
    return Rays.from_arrays(o, targets - o)


def test_no_ray_escapes_a_closed_sphere(build):
    rng = np.random.default_rng(1)
    # Four of them, as small and as far from the origin as those of the scene mount.
    for number, centre in enumerate(sphere_centres(), start=1):
        piece = centre + SPHERE_RADIUS * icosphere(5)
        sphere = Scene.from_triangles(piece, f"sphere {number}")
        inside = centre + 0.5 * SPHERE_RADIUS * (rng.random((1000, 3)) - 0.5)
        rays = rays_at_all_weak_points(piece, inside, rng, 5)
        for name in ("bvh", "grid"):
            hits, _ = build(name, sphere).trace(rays)
            assert (hits.primitive < 0).sum() == 0
        assert len(rays) > 200_000


def test_no_ray_escapes_the_pieces_of_tetra(build):
    """The smallest pieces are closed tetrahedra; rays start inside one and aim at it."""
    rng = np.random.default_rng(2)
    scene = make_sample("tetra:size=1")
    inside = rng.dirichlet([1, 1, 1, 1], size=500)
    vertices = np.unique(scene.triangles.reshape(-1, 3), axis=0)
    assert len(vertices) == 4
    rays = rays_at_all_weak_points(scene.triangles, inside @ vertices, rng, 3000)
    for name, text in (("bvh", "max_leaf_size=1"), ("grid", ""), ("grid", "resolution=9x8x7")):
        hits, _ = build(name, scene, text).trace(rays)
        assert (hits.primitive < 0).sum() == 0


def test_no_ray_escapes_the_bunny(build):
    rng = np.random.default_rng(3)
    scene = make_sample("bunny")
    tri = scene.triangles
    edges = np.concatenate([tri[:, [i, (i + 1) % 3]] for i in range(3)])
    key = {(e[0].tobytes(), e[1].tobytes()) for e in edges}
    assert all((b, a) in key for a, b in key), "the bunny is not closed: choose another mesh"
    normal = np.cross(tri[:, 1] - tri[:, 0], tri[:, 2] - tri[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    inside = tri.mean(axis=1) - 1e-4 * scene.diagonal * normal
    rays = rays_at_all_weak_points(tri, inside, rng, 4)
    for name in ("bvh", "grid"):
        hits, _ = build(name, scene).trace(rays)
        escaped = np.unique(rays.origins[hits.primitive < 0], axis=0)
        assert len(escaped) == 0
