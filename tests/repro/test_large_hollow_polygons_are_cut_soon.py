"""Hollow polygons of 100,000 corners are cut in seconds, into the triangles of the plain search."""

import time

import numpy as np
import pytest
from accelscope.core.geometry import ears
from accelscope.core.geometry.triangulation import triangulate


def star(n, rng):
    angles, radii = (np.arange(n) + 0.9 * rng.random(n)) * 2 * np.pi / n, rng.uniform(0.1, 1, n)
    return radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def comb(n, rng):
    x = np.arange(n // 2 + 1, dtype=float)
    teeth = np.column_stack([x, np.where(x % 2, 50.0, rng.uniform(0, 40, len(x)))])
    return np.concatenate([teeth, teeth[::-1][: n - len(x)] - [0, 60]])


def spiral(n, rng):
    angle = np.sqrt(np.linspace(100, 4 * n, n // 2))
    arms = [(r + angle)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (3, 1)]
    return np.concatenate([arms[0], arms[1][::-1]])


def coast(n, rng):
    """A random walk around a circle: clusters of corners of all sizes."""
    angles = np.arange(n) * 2 * np.pi / n
    wander = np.cumsum(rng.normal(size=n))
    wander -= np.linspace(0, wander[-1], n)
    radii = 2 + wander / np.abs(wander).max()
    return radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])


def spike(n, rng):
    """All corners but one in a thousandth of the polygon's extent."""
    outline = star(n, rng) * 1e-3
    outline[0] = 1.0, 0.0
    return outline


OUTLINES = {"star": star, "comb": comb, "spiral": spiral, "coast": coast, "spike": spike}


def cut(outline):
    points = np.zeros((len(outline), 3))
    points[:, :2] = outline
    points[:, 2] = 0.3 * outline[:, 0] - 0.7 * outline[:, 1]
    return triangulate(points, np.arange(len(points)), np.array([len(points)]))


def area(outline, triangles):
    a, b, c = (outline[triangles[:, k]] for k in range(3))
    u, v = b - a, c - a
    return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()


def own_area(outline):
    following = np.roll(outline, -1, axis=0)
    x, y = outline.T
    return 0.5 * abs((x * following[:, 1] - y * following[:, 0]).sum())


@pytest.mark.parametrize("name", OUTLINES)
@pytest.mark.parametrize("n", [60, 2000])
def test_the_triangles_of_the_plain_search(monkeypatch, name, n):
    outline = OUTLINES[name](n, np.random.default_rng(n))
    monkeypatch.setattr(ears, "LARGE", 8)
    by_buckets = cut(outline)
    monkeypatch.setattr(ears, "LARGE", n + 1)
    assert np.array_equal(by_buckets, cut(outline))


@pytest.mark.parametrize(
    "name",
    [
        "star",
        *(pytest.param(name, marks=pytest.mark.exhaustive) for name in OUTLINES if name != "star"),
    ],
)
def test_100_000_corners(name):
    cut(star(2000, np.random.default_rng(1)))  # compiles
    outline = OUTLINES[name](100_000, np.random.default_rng(1))
    start = time.process_time()
    triangles = cut(outline)
    # Mostly a third of a second; with every corner tried against every hollow one, half a minute.
    assert time.process_time() - start < 10
    assert len(triangles) == len(outline) - 2
    assert area(outline, triangles) == pytest.approx(own_area(outline), rel=1e-9)


def test_one_that_comes_back_to_the_same_places_ends(monkeypatch):
    """No kernel can be stopped: at a fraction of its corners' square any corner is an ear."""
    outline = np.tile([[0.0, 0.0], [1.0, 0.0], [0.3, 0.2], [0.0, 1.0]], (5000, 1))
    monkeypatch.setattr(ears, "LOOKS", 0)
    cut(outline[:8])  # compiles
    start = time.process_time()
    triangles = cut(outline)
    assert time.process_time() - start < 10
    assert len(triangles) == len(outline) - 2
    assert np.array_equal(np.unique(triangles), np.arange(len(outline)))
