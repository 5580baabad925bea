"""A hit lies on its triangle, also where that is seen edge-on: cells of any shape rely on it."""

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene

EPS = np.finfo(np.float64).eps
MOST = 4.0
"""Distance allowed, in units of eps times the largest coordinates; before edge-on triangles had a
test of their own there were distances of 1e14 of these."""


def on_segment(p, a, b):
    """Points of the segments ab next to points p."""
    along = b - a
    length = (along * along).sum(axis=1)
    share = ((p - a) * along).sum(axis=1) / np.where(length > 0, length, 1)
    return a + np.clip(share, 0, 1)[:, None] * along


def distances(points, triangles):
    """Upper bounds of the distances of points from triangles: to points that lie on these."""
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    normal = np.cross(b - a, c - a)
    weights = np.stack(
        [
            (np.cross(second - first, points - first) * normal).sum(axis=1)
            for first, second in ((b, c), (c, a), (a, b))
        ],
        axis=1,
    )
    weights = np.clip(weights, 0, None)
    total = weights.sum(axis=1, keepdims=True)
    weights /= np.where(total > 0, total, 1)
    candidates = [on_segment(points, p, q) for p, q in ((a, b), (b, c), (c, a))]
    candidates.append((weights[:, :, None] * triangles).sum(axis=1))
    return np.sqrt(np.min([((points - q) ** 2).sum(axis=1) for q in candidates], axis=0))


@pytest.mark.skipif(np.finfo(np.longdouble).eps > 1e-18, reason="has no longer numbers to compare")
def test_hits_lie_on_their_triangles(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    every = lab.ray_families(scene, 150)
    edge_on = ("in planes of faces", "along edges", "into edges", "vertex to vertex")
    more = lab.ray_families(scene, 3000, seed=7)
    for family in edge_on:
        every[family] = more[family]
    rays, names = lab.batch_of(every)
    naive = build("naive", scene)
    hits, _ = naive.trace(rays)
    hit = hits.primitive >= 0
    assert hit.sum() > 1000
    long = np.longdouble
    origins = rays.origins[hit].astype(long)
    points = origins + hits.t[hit].astype(long)[:, None] * rays.directions[hit].astype(long)
    # Those of zero area are never hit, so that the scene's own corners are the right ones.
    far = distances(points, scene.triangles[hits.primitive[hit]].astype(long))
    scale = (np.abs(origins) + naive.triangles.reach).sum(axis=1)
    off = far / (EPS * scale)
    assert off.max() < MOST, (float(off.max()), names[hit][off.argmax()])


def test_a_ray_in_the_plane_of_a_triangle_hits_it_or_misses_it(build):
    """Rounding decides whether, but not where: never beside the triangle, never behind it."""
    rng = np.random.default_rng(3)
    triangles = rng.normal(size=(300, 3, 3))
    n_hits = 0
    for triangle in triangles:
        naive = build("naive", Scene.from_triangles(triangle[None], "one"))
        a, e, f = triangle[0], triangle[1] - triangle[0], triangle[2] - triangle[0]
        # In coordinates of the triangle's plane: where its three edges are crossed.
        o, d = 3 * rng.normal(size=(60, 2)), rng.normal(size=(60, 2))
        t = np.stack([-o[:, 0] / d[:, 0], -o[:, 1] / d[:, 1], (1 - o.sum(1)) / d.sum(1)])
        at = o + t[:, :, None] * d
        inside = (at > -1e-9).all(axis=2) & (at.sum(axis=2) < 1 + 1e-9)
        first = np.maximum(np.where(inside, t, np.inf).min(axis=0), 0.0)
        last = np.where(inside, t, -np.inf).max(axis=0)
        rays = Rays.from_arrays(
            a + o[:, :1] * e + o[:, 1:] * f, d[:, :1] * e + d[:, 1:] * f
        )  # fmt: skip
        got = naive.trace(rays)[0].t
        hit = np.isfinite(got)
        assert (last[hit] > -1e-9).all()
        assert (got[hit] > first[hit] - 1e-6).all()
        assert (got[hit] < last[hit] + 1e-6).all()
        n_hits += int(hit.sum())
    assert n_hits > 150
