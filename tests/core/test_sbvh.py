"""SBVH: chopping is conservative, the bound holds, nothing is lost, and it pays."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.kernels import kernel
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders.spatial import sbvh
from accelscope.core.structures.bvh.builders.spatial.chop import BOTH, LEFT, RIGHT, References, chop
from accelscope.core.structures.bvh.builders.spatial.spatial_split import (
    OBJECT,
    SIDES,
    SPATIAL,
    best_split,
    make_bins,
    overlap_of,
    side_of,
)
from accelscope.core.structures.bvh.builders.top_down import binned_sah
from accelscope.core.structures.bvh.builders.top_down.recursion import enclose_boxes, limits_of
from accelscope.core.structures.bvh.topology.pieces import pieces_of
from accelscope.core.structures.bvh.topology.tree import Primitives
from accelscope.sample_scenes import make_sample

# Inner kernels can be called by kernels only.


@kernel
def run_chop(corners, slack, triangle, boxes, row, axis, plane, parts):
    chop(corners, slack, triangle, boxes, row, axis, plane, parts)


@kernel
def run_best_split(references, count, kind, bounds, used, bins, limits):
    enclose_boxes(references.boxes, 0, count, bounds)
    found = best_split(references, 0, count, 2 * count, kind, bounds, used, bins, limits, 0, np.inf)
    return found, overlap_of(bins.parts)


@kernel
def run_side_of(boxes, row, parts, n_left, n_right):
    return side_of(boxes, row, parts, n_left, n_right)


def sticks(n=30, seed=4):
    """Long thin triangles in all directions."""
    rng = np.random.default_rng(seed)
    middle, along = rng.random((n, 3)), rng.normal(size=(n, 3))
    along *= 0.6 / np.linalg.norm(along, axis=1)[:, None]
    return np.stack([middle - along, middle + along, middle + 0.01 * rng.normal(size=(n, 3))], 1)


def thicket(n=300):
    """Small triangles, and sticks across them: what object splits cannot tell apart."""
    rng = np.random.default_rng(5)
    leaves = rng.random((n, 1, 3)) + 0.02 * rng.normal(size=(n, 3, 3))
    return np.concatenate([leaves, sticks(n // 20)])


def grouped(corners, builder=sbvh, **changes):
    settings = dataclasses.replace(BVHSettings(builder="sbvh"), **changes)
    return builder.BUILDER.build(
        Primitives(all_triangles(corners), boxes_of(corners)), settings, SILENT
    )


def references_of(corners, room):
    boxes, triangle = np.full((room, 6), np.nan), np.full(room, -1, np.int32)
    boxes[: len(corners)], triangle[: len(corners)] = boxes_of(corners), np.arange(len(corners))
    slack = 16 * np.finfo(float).eps / 2 * np.abs(corners).max(axis=(0, 1))
    return References(all_triangles(corners), slack, triangle, boxes)


def cost_of(tree):
    areas = surface_area(tree.boxes)
    return (1.2 * areas[tree.size == 0].sum() + (areas * tree.size).sum()) / areas[0]


# ---------------------------------------------------------------------------------------- one plane


def exact_parts(triangle, axis, plane):
    """Return the corners of what is below and above a plane, in exact arithmetic."""
    corners = [[Fraction(float(x)) for x in corner] for corner in triangle]
    plane = Fraction(float(plane))
    below, above = [], []
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        if a[axis] <= plane:
            below.append(a)
        if a[axis] >= plane:
            above.append(a)
        if (a[axis] - plane) * (b[axis] - plane) < 0:
            share = (plane - a[axis]) / (b[axis] - a[axis])
            crossing = [p + share * (q - p) for p, q in zip(a, b, strict=True)]
            below.append(crossing)
            above.append(crossing)
    return below, above


def test_chopping_is_conservative_and_tight():
    """In exact arithmetic, whatever the distance from the origin and the shape."""
    rng = np.random.default_rng(1)
    reached = [0, 0]
    for trial in range(400):
        shape = rng.random((3, 3)) * 10.0 ** rng.integers(-8, 3, size=3)
        corners = (rng.choice([0.0, 1.0, 1e6]) * rng.normal(size=3) + shape)[None]
        references = references_of(corners, 1)
        box = references.boxes[0]
        axis = int(rng.integers(3))
        plane = box[axis] + rng.random() * (box[3 + axis] - box[axis])
        if trial % 7 == 0:
            plane = corners[0, rng.integers(3), axis]
        parts = np.empty((6, 6))
        run_chop(corners, references.slack, 0, references.boxes, 0, axis, plane, parts)
        width = references.slack * 2
        for side, points in zip((LEFT, RIGHT), exact_parts(corners[0], axis, plane), strict=True):
            if not points:
                assert (parts[side, :3] > parts[side, 3:]).any()
                continue
            reached[side] += 1
            for k in range(3):
                low, high = min(p[k] for p in points), max(p[k] for p in points)
                assert parts[side, k] <= low
                assert high <= parts[side, 3 + k]
                assert parts[side, k] >= float(low) - width[k]
                assert parts[side, 3 + k] <= float(high) + width[k]
    assert min(reached) > 300


def test_a_part_stays_in_the_box_of_its_reference():
    """The two halves of a square's diagonal triangle, of which only a corner is meant."""
    corners = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])
    references = references_of(corners, 1)
    references.boxes[0] = [0, 0, 0, 1, 1, 0]
    parts = np.empty((6, 6))
    run_chop(corners, references.slack, 0, references.boxes, 0, 0, 0.5, parts)
    assert np.array_equal(parts[LEFT], [0, 0, 0, 0.5, 1, 0])
    assert np.array_equal(parts[RIGHT], [0.5, 0, 0, 1, 1, 0])


def test_a_split_is_what_it_says():
    """Counts and boxes of the best plane, and the cheapest one, against a slow search."""
    corners = sticks(40)
    references = references_of(corners, 80)
    bounds, bins = np.empty((3, 6)), make_bins(16)
    limits = limits_of(BVHSettings())
    for kind in (OBJECT, SPATIAL):
        found, overlap = run_best_split(references, 40, kind, bounds, 16, bins, limits)
        axis, last_left, n_left, n_right, cost = found
        sides = bins.parts[SIDES:].copy()
        assert cost == n_left * surface_area(sides[0]) + n_right * surface_area(sides[1])
        assert (n_left + n_right == 40) == (kind == OBJECT)
        for other in range(3):
            extent = bounds[kind, 3 + other] - bounds[kind, other]
            for border in range(1, 16):
                plane = bounds[kind, other] + border * extent / (16 * (1 - 1e-6))
                own = boxes_of(corners)
                if kind == OBJECT:
                    below = own[:, other] + own[:, 3 + other] < plane
                    left, right = own[below], own[~below]
                else:
                    halves = []
                    for i in range(40):
                        parts = np.empty((6, 6))
                        run_chop(corners, references.slack, i, own, i, other, plane, parts)
                        halves.append(parts[:2])
                    left = np.array([h[0] for h in halves if (h[0, :3] <= h[0, 3:]).all()])
                    right = np.array([h[1] for h in halves if (h[1, :3] <= h[1, 3:]).all()])
                if len(left) in (0, 40) or len(right) in (0, 40):
                    continue
                around = [
                    surface_area(np.concatenate([s[:, :3].min(0), s[:, 3:].max(0)]))
                    for s in (left, right)
                ]
                slow = len(left) * around[0] + len(right) * around[1]
                assert cost <= slow * (1 + 1e-9)
                if (other, border - 1) == (axis, last_left):
                    assert (len(left), len(right)) == (n_left, n_right)
                    assert slow == pytest.approx(cost, rel=1e-9)
        if kind == OBJECT:
            common = [*np.maximum(*sides[:, :3]), *np.minimum(*sides[:, 3:])]
            assert overlap == surface_area(np.array(common)) > 0.1 * surface_area(bounds[0])
        else:
            assert sides[0, 3 + axis] <= sides[1, axis]


def test_unsplitting_takes_the_cheapest_of_three():
    rng = np.random.default_rng(3)
    seen = set()
    for _ in range(300):
        low = rng.random((3, 3)) * rng.choice([0.1, 1.0])
        boxes = np.concatenate([low, low + rng.random((3, 3))], axis=1)
        parts = np.empty((6, 6))
        parts[SIDES:] = boxes[:2]
        n_left, n_right = (int(n) for n in rng.integers(1, 6, size=2))
        left, right = surface_area(boxes[:2])
        with_it = [
            surface_area(np.concatenate([np.minimum(b, boxes[2])[:3], np.maximum(b, boxes[2])[3:]]))
            for b in boxes[:2]
        ]
        costs = {
            int(BOTH): left * n_left + right * n_right,
            int(LEFT): with_it[0] * n_left + right * (n_right - 1),
            int(RIGHT): left * (n_left - 1) + with_it[1] * n_right,
        }
        side = int(run_side_of(boxes, 2, parts, n_left, n_right))
        assert costs[side] == pytest.approx(min(costs.values()), rel=1e-12)
        seen.add(side)
    assert seen == {LEFT, RIGHT, BOTH}


# ---------------------------------------------------------------------------------------- the tree


def test_without_room_it_is_binned_sah():
    """Not one reference more than triangles: the same tree, node for node."""
    for corners in (thicket(), make_sample("suzanne:subdivisions=1").triangles):
        ours, theirs = grouped(corners, duplication=1.0), grouped(corners, binned_sah)
        assert np.array_equal(ours.order, theirs.order)
        assert np.array_equal(ours.tree.boxes, theirs.tree.boxes)
        assert np.array_equal(ours.tree.first, theirs.tree.first)
        assert ours.figures == {"duplication": 1.0, "spatial_splits": []}


@pytest.mark.parametrize("duplication", [1.001, 1.1, 1.5, 2.0, 16.0])
@pytest.mark.parametrize("max_leaf_size", [1, 4])
def test_the_bound_holds(duplication, max_leaf_size):
    corners = thicket()
    grouping = grouped(corners, duplication=duplication, max_leaf_size=max_leaf_size)
    tree = grouping.tree
    assert len(grouping.order) <= duplication * len(corners)
    assert np.array_equal(np.unique(grouping.order), np.arange(len(corners)))
    assert tree.size.sum() == len(grouping.order)
    assert tree.size.max() <= max_leaf_size
    assert grouping.figures["duplication"] == len(grouping.order) / len(corners)
    assert (sum(grouping.figures["spatial_splits"]) > 0) == (duplication > 1.01)
    # A leaf of two parts of one triangle would be a waste.
    for first, size in zip(tree.first[tree.size > 0], tree.size[tree.size > 0], strict=True):
        assert len(set(grouping.order[first : first + size])) == size


def test_it_pays():
    """Sticks are in the way of object splits everywhere."""
    without, few, many = (cost_of(grouped(thicket(), duplication=d).tree) for d in (1, 1.1, 2))
    assert many < few < without
    assert many < 0.8 * without


def test_every_point_of_a_triangle_is_in_a_box_of_its_own():
    rng = np.random.default_rng(6)
    for corners in (thicket(), 1e6 + thicket()):
        grouping = grouped(corners, max_leaf_size=1, duplication=3.0)
        tree, leaves = grouping.tree, grouping.tree.size > 0
        boxes, ids = tree.boxes[leaves], grouping.order[tree.first[leaves]]
        assert len(ids) > 1.1 * len(corners)
        slack = 4 * np.finfo(float).eps * np.abs(corners).max()  # points are rounded
        for triangle in range(len(corners)):
            points = rng.dirichlet([1, 1, 1], size=200) @ corners[triangle]
            own = boxes[ids == triangle][:, None]
            inside = (points >= own[..., :3] - slack) & (points <= own[..., 3:] + slack)
            assert inside.all(axis=2).any(axis=0).all()


def area_of_triangles(corners):
    edges = corners[:, 1:] - corners[:, :1]
    return 0.5 * np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)


def test_pieces_cover_their_triangle_and_stay_in_their_boxes():
    corners = thicket()
    grouping = grouped(corners, max_leaf_size=1)
    tree, pieces = grouping.tree, pieces_of(corners[grouping.order], grouping.parts, SILENT)
    sizes = np.diff(pieces.offsets)
    assert sizes.min() >= 1
    owner = np.repeat(np.arange(len(sizes)), sizes)
    covered = np.bincount(grouping.order[owner], area_of_triangles(pieces.corners), len(corners))
    whole = area_of_triangles(corners)
    assert (covered >= whole * (1 - 1e-12)).all()
    # Boxes of two parts overlap a little where the triangle is slanted.
    assert covered.sum() < 1.2 * whole.sum()
    leaves = np.flatnonzero(tree.size > 0)
    box = np.empty((len(sizes), 6))
    box[tree.first[leaves]] = tree.boxes[leaves]
    own = boxes_of(pieces.corners)
    assert (own[:, :3] >= box[owner, :3] - 1e-14).all()
    assert (own[:, 3:] <= box[owner, 3:] + 1e-14).all()


def test_threads_and_the_size_of_subtrees_change_nothing(monkeypatch):
    corners = thicket(2000)
    whole = grouped(corners)
    for subtree, threads in ((50, 1), (50, 2), (300, 3)):
        monkeypatch.setattr(sbvh, "SUBTREE", subtree)
        monkeypatch.setattr(sbvh, "core_count", lambda threads=threads: threads)
        other = grouped(corners)
        assert np.array_equal(other.order, whole.order)
        for name in ("boxes", "first", "size"):
            assert np.array_equal(getattr(other.tree, name), getattr(whole.tree, name))
        assert other.figures == whole.figures


@pytest.mark.parametrize(
    "corners",
    [
        np.repeat(sticks(1), 50, axis=0),
        np.arange(1.0, 90)[:, None, None] * sticks(1),
        np.concatenate([sticks(50) * [1, 1, 0], sticks(1) * [1, 1, 0] * 1e9]),
        np.zeros((20, 3, 3)),
        sticks(1),
        1e-300 * sticks(60),
        1e90 * sticks(60),
    ],
    ids=["identical", "nested", "flat", "points", "one", "tiny", "huge"],
)
@pytest.mark.parametrize("max_leaf_size", [1, 4])
def test_degenerate_triangles(corners, max_leaf_size):
    grouping = grouped(corners, max_leaf_size=max_leaf_size, duplication=16.0)
    assert np.array_equal(np.unique(grouping.order), np.arange(len(corners)))
    assert grouping.tree.size.max() <= max_leaf_size


@pytest.mark.parametrize("arity", [2, 4, 8])
@pytest.mark.parametrize("settings", ["", "max_leaf_size=1,duplication=8", "duplication=1.1"])
def test_hits_are_those_of_brute_force(lab, build, arity, settings):
    from accelscope.core.scene import Scene

    scene = Scene.from_triangles(thicket(), "s")
    rays, names = lab.batch_of(lab.ray_families(scene, 200))
    want, _ = build("naive", scene).trace(rays)
    structure = build("bvh", scene, f"builder=sbvh,arity={arity},{settings}".rstrip(","))
    assert structure.validate() == []
    assert len(structure.triangles.ids) > len(scene)
    got, _ = structure.trace(rays)
    assert lab.differences(names, want, got) == {}
    rays, names = lab.batch_of(lab.wall_rays(structure, 200))
    want, _ = build("naive", scene).trace(rays)
    got, _ = structure.trace(rays)
    assert lab.differences(names, want, got) == {}


def test_axes_in_turn():
    """Without room, it is binned SAH with the axes in turn."""
    for axis in ("best", "round_robin"):
        ours = grouped(thicket(), duplication=1.0, axis=axis)
        theirs = grouped(thicket(), binned_sah, axis=axis)
        assert np.array_equal(ours.tree.boxes, theirs.tree.boxes)


def test_damage_is_found(build):
    from accelscope.core.scene import Scene

    structure = build("bvh", Scene.from_triangles(thicket(), "s"), "builder=sbvh,max_leaf_size=1")
    assert structure.validate() == []
    ids = structure.triangles.ids
    numbers, counts = np.unique(ids, return_counts=True)
    several = numbers[counts > 2][0]
    other = ids.copy()
    other[np.flatnonzero(ids == several)[0]] = numbers[counts > 2][1]
    structure.geometry = structure.triangles._replace(ids=other)
    assert "the parts of a triangle do not cover it" in structure.validate()
