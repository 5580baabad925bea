"""How planes of a BSP tree are tried: what saves time changes nothing."""

import numpy as np
import pytest
from accelscope.core.kernels import kernel
from accelscope.core.structures.bsp.planes import BINS, Heuristic, cost_of, count_bins
from accelscope.core.structures.bsp.polyhedron import (
    clip,
    make_polyhedra,
    measure,
    measure_faces,
    measure_heights,
    side_areas,
)
from accelscope.core.structures.bsp.references import count_sides


def plain(function):
    """Return what is compiled as plain Python."""
    return getattr(function, "py_func", function)


def extents(name, rng):
    """Return the least and largest positions of polygons along a normal."""
    low = rng.random(300)
    if name == "everywhere":
        return low, low + 0.2 * rng.random(300) ** 3
    if name == "flat":
        return low, low.copy()
    if name == "on planes":
        low = rng.integers(0, BINS, 300) / BINS
        return low, low + rng.integers(0, 2, 300) / BINS
    return np.full(300, 0.3), np.full(300, 0.3)  # all in one plane


@pytest.mark.parametrize("name", ["everywhere", "flat", "on planes", "one plane"])
@pytest.mark.parametrize("shell", [0.0, 1e-12, 1e-3, 0.5])
def test_bins_are_counted_as_planes_are(name, shell):
    low, high = extents(name, np.random.default_rng(1))
    first = low.min()
    width = (high.max() - first) / BINS
    sides = np.empty((2, BINS + 2), np.int64)
    plain(count_bins)(low, high, len(low), first, width, shell, sides)
    for i in range(BINS + 1):
        want = plain(count_sides)(low, high, len(low), first + i * width, shell)
        assert (len(low) - sides[1, i], sides[0, i]) == want


@kernel
def cut_off(room, source, target, plane, sign):
    """Only kernels can call the kernels of polyhedra."""
    return clip(room, source, target, plane, sign, 0.0)


@kernel
def areas_of_sides(room, row, plane):
    measure_faces(room, row)
    measure_heights(room, row, plane)
    return side_areas(room, row, plane, 0.0)


@kernel
def area_of_row(room, row, box):
    return measure(room, row, box)


@kernel
def cost(rule, room, row, area, plane, below, above, best):
    measure_faces(room, row)
    bottom, top = measure_heights(room, row, plane)
    share = (0.0 - bottom) / (top - bottom)
    return cost_of(rule, room, row, area, plane, 0.0, share, below, above, best)


def some_plane(rng):
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    return np.append(normal, normal @ rng.random(3))


def some_cells(count):
    """Yield room whose row 1 has a convex cell, and a plane through it."""
    rng = np.random.default_rng(2)
    while count > 0:
        room = make_polyhedra(3, np.array([0.0, 0, 0, 1, 1, 1]))
        row = 0
        for _ in range(rng.integers(1, 7)):
            target = 2 if row == 1 else 1
            if not cut_off(room, row, target, some_plane(rng), rng.choice([-1.0, 1.0])):
                break
            row = target
        plane = some_plane(rng)
        corners = room.points[row, : room.starts[row, room.n_faces[row]]]
        heights = corners @ plane[:3] - plane[3]
        if row and heights.min() < -1e-3 and heights.max() > 1e-3:
            count -= 1
            yield room, row, plane


def test_areas_of_sides_are_those_of_the_parts():
    """Faces that are not crossed are taken as they are, which must not show."""
    box = np.empty(6)
    for room, row, plane in some_cells(300):
        got = areas_of_sides(room, row, plane)
        other = 2 if row == 1 else 1
        for area, sign in zip(got, (-1.0, 1.0), strict=True):
            assert cut_off(room, row, other, plane, sign)
            assert area == pytest.approx(area_of_row(room, other, box)[0], rel=1e-9)


def test_no_plane_is_passed_over_that_costs_less():
    """Without its area a plane is only left out where it cannot be the best."""
    rng = np.random.default_rng(3)
    box, left_out = np.empty(6), 0
    for room, row, plane in some_cells(600):
        rule = Heuristic(np.eye(3), 0, rng.random(), 1.0, rng.choice([0.8, 1.0]))
        below, above = rng.choice([0.0, 1.0, 7.0, 30.0], size=2)
        area = area_of_row(room, row, box)[0]
        whole = cost(rule, room, row, area, plane, below, above, np.inf)
        best = whole * rng.uniform(0.5, 1.5)
        got = cost(rule, room, row, area, plane, below, above, best)
        left_out += np.isinf(got)
        assert got == whole or (np.isinf(got) and whole >= best)
    assert left_out > 100
