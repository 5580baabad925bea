"""What is said of how far elementary solids extend holds, and no more than is needed."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.clip import POLYGON_SIZE
from accelscope.core.geometry.geometry import clip_box, hulls_of, interval, overlaps, support
from accelscope.core.geometry.rays import make_ray
from accelscope.core.geometry.solids.description import Box, Cone, Disc, Placed, Polygon, Sphere
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.geometry.solids.mixed import can_be_clipped
from accelscope.core.kernels import call, kernel
from solids_reference import EVERY_KIND, distance, rays_of, trace

EPS = np.finfo(np.float64).eps
SHEAR = [[1.0, 0.5, 0.2, 1], [0.1, 0.7, -0.4, 2], [0.3, 0.2, 1.5, -1]]
TURN = np.linalg.qr(np.array([[1.0, 1, 0], [1, -1, 0], [1, 0, 1]]))[0][:, [1, 2, 0]]
"""A rotation whose third column, but for its sign, is along (1, 1, 1)."""
SOLIDS = {
    **EVERY_KIND,
    "ellipsoid": Placed(EVERY_KIND["sphere"], SHEAR),
    "sheared cone": Placed(EVERY_KIND["truncated cone"], SHEAR),
    "parallelepiped": Placed(EVERY_KIND["box"], SHEAR),
    "ellipse": Placed(EVERY_KIND["disc"], SHEAR),
}


@kernel
def supports(geometry, directions, out):
    for i in range(len(out)):
        out[i, 0], out[i, 1], out[i, 2] = support(
            geometry, 0, directions[i, 0], directions[i, 1], directions[i, 2]
        )


@kernel
def clip_all(geometry, cells, boxes, polygon, do_overlap):
    for i in range(len(cells)):
        do_overlap[i] = overlaps(geometry, 0, cells[i])
        clip_box(geometry, 0, cells[i], boxes[i], polygon)


@kernel
def all_intervals(geometry, rays, out):
    for i in range(len(out)):
        out[i, 0], out[i, 1] = interval(geometry, 0, make_ray(rays, i, geometry.reach))


def surface_points(item, count=4000, seed=0, time=0.0):
    """Points on the surface of an item: where rays hit it."""
    rng = np.random.default_rng(seed)
    geometry = mixed_of([item])
    low, high = geometry.boxes[0].reshape(2, 3)
    centre, size = 0.5 * (low + high), np.linalg.norm(high - low)
    origins = centre + size * rng.normal(size=(count, 3))
    inside = low + rng.random((count, 3)) * (high - low)
    if geometry.points.size:
        inside[::2] = (
            geometry.rows[0, 3] if geometry.kinds[0] != 2 else geometry.points.mean(axis=0)
        )
        inside[::2] += (
            0.3 * size * rng.normal(size=(len(inside[::2]), 3)) * [1e-3, 1e-1, 1][seed % 3]
        )
    rays = rays_of(origins, inside - origins, times=time)
    t, _ = trace(geometry, rays)
    hit = np.isfinite(t)
    return origins[hit] + t[hit, None] * rays.directions[hit]


def points_of(item):
    times = (0.0, 0.5, 1.0) if type(item).__name__ == "MovingTriangle" else (0.0,)
    return np.vstack([surface_points(item, 4000, seed, t) for seed in range(3) for t in times])


@pytest.mark.parametrize("name", SOLIDS)
def test_boxes_and_supports_and_hulls_hold_the_surface(name):
    item = SOLIDS[name]
    geometry = mixed_of([item])
    points = points_of(item)
    assert len(points) > 300
    slack = 16 * EPS * (np.abs(points).max() + np.abs(geometry.boxes).max()) * 10
    low, high = geometry.boxes[0].reshape(2, 3)
    assert (points >= low - slack).all()
    assert (points <= high + slack).all()
    directions = np.vstack([np.random.default_rng(1).normal(size=(200, 3)), np.eye(3), -np.eye(3)])
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    far = np.empty_like(directions)
    call(supports, geometry, directions, far)
    reach = (far * directions).sum(axis=1)
    assert ((points @ directions.T).max(axis=0) <= reach + slack).all()
    # They are points of the item, and so the box is as small as it can be.
    np.testing.assert_allclose(reach[-6:-3], high, rtol=64 * EPS, atol=64 * EPS)
    np.testing.assert_allclose(-reach[-3:], low, rtol=64 * EPS, atol=64 * EPS)
    if not isinstance(item, Placed):
        moment = np.minimum(distance(item, far, 0.0), distance(item, far, 1.0))
        assert moment.max() < 64 * EPS * np.abs(geometry.boxes).max()
    corners, offsets = hulls_of(geometry)
    np.testing.assert_array_equal(offsets, [0, len(corners)])
    hull = (corners.reshape(-1, 3) @ directions.T).max(axis=0)
    assert (hull >= reach - EPS * np.abs(geometry.boxes).max()).all()
    middle = 0.5 * (low + high) @ directions.T
    assert (hull - middle <= 1.13 * (reach - middle) + slack).all() or isinstance(
        item, Cone | Placed
    )


def test_hulls_of_many_items_are_in_their_order():
    geometry = mixed_of(list(SOLIDS.values()))
    corners, offsets = hulls_of(geometry)
    for index, item in enumerate(SOLIDS.values()):
        alone, _ = hulls_of(mixed_of([item]))
        np.testing.assert_array_equal(corners[offsets[index] : offsets[index + 1]], alone)


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", SOLIDS)
def test_a_clipped_box_holds_the_part_in_the_cell(name):
    item = SOLIDS[name]
    geometry = mixed_of([item])
    points = points_of(item)
    rng = np.random.default_rng(2)
    low, high = geometry.boxes[0].reshape(2, 3)
    bounds = low + (rng.random((400, 2, 3)) * 1.4 - 0.2) * (high - low)
    cells = np.concatenate([bounds.min(axis=1), bounds.max(axis=1)], axis=1)
    boxes, does_overlap = cells.copy(), np.empty(len(cells), bool)
    call(clip_all, geometry, cells, boxes, np.empty((2 * POLYGON_SIZE, 3)), does_overlap)
    assert (boxes[:, :3] <= boxes[:, 3:]).all()
    assert (boxes[:, :3] >= cells[:, :3]).all()
    assert (boxes[:, 3:] <= cells[:, 3:]).all()
    slack = 64 * EPS * np.abs(geometry.boxes).max()
    n_smaller = 0
    for cell, box, can in zip(cells, boxes, does_overlap, strict=True):
        inside = points[((points >= cell[:3]) & (points <= cell[3:])).all(axis=1)]
        if len(inside):
            assert can
            assert (inside.min(axis=0) >= box[:3] - slack).all()
            assert (inside.max(axis=0) <= box[3:] + slack).all()
        own = np.concatenate([np.maximum(cell[:3], low), np.minimum(cell[3:], high)])
        n_smaller += bool((np.abs(box - own) > slack).any() and (own[:3] < own[3:]).all())
    flat_or_round = {"Sphere", "Disc", "Polygon", "Triangle"}
    kind = type(item.solid if isinstance(item, Placed) else item).__name__
    assert can_be_clipped(geometry).all() == (kind != "MovingTriangle")
    if kind in flat_or_round and name not in ("level disc", "arrow"):
        assert n_smaller > 40


@pytest.mark.exhaustive
def test_clipped_boxes_of_closed_forms():
    items = [
        Sphere((0, 0, 0), 5),
        Disc((0, 0, 0), (0, 0, 1), 5),
        Polygon([(0, 0, 0), (4, 0, 0), (4, 4, 4), (2, 1, 1), (0, 4, 4)]),
        Box((0, 0, 0), (2, 2, 2)),
    ]
    cells = np.array(
        [[3, -9, -9, 9, 9, 9], [3, -9, -1, 9, 9, 1], [-1, 2, -9, 9, 9, 9], [1, 1, 1, 9, 9, 9.0]]
    )
    exact = np.array(
        [[3, -4, -4, 5, 4, 4], [3, -4, 0, 5, 4, 0], [0, 2, 2, 4, 4, 4], [1, 1, 1, 2, 2, 2.0]]
    )
    for item, cell, box in zip(items, cells, exact, strict=True):
        found = cell[None].copy()
        call(clip_all, mixed_of([item]), cell[None], found, np.empty((20, 3)), np.empty(1, bool))
        np.testing.assert_allclose(found[0], box, atol=1e-13)


@pytest.mark.exhaustive
def test_a_ball_overlaps_the_cells_that_are_as_near_as_its_radius():
    geometry = mixed_of([Sphere((0.25, 0, 0), 1)])
    rng = np.random.default_rng(3)
    corner = rng.uniform(-1.5, 1.5, (3000, 3))
    cells = np.hstack([corner, corner + rng.uniform(0, 0.5, (3000, 3))])
    does_overlap = np.empty(len(cells), bool)
    call(clip_all, geometry, cells, cells.copy(), np.empty((2 * POLYGON_SIZE, 3)), does_overlap)
    centre = np.array([0.25, 0, 0])
    nearest = np.clip(centre, cells[:, :3], cells[:, 3:])
    near = np.linalg.norm(nearest - centre, axis=1) <= 1
    assert 500 < near.sum() < 2500
    np.testing.assert_array_equal(does_overlap, near)


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "item",
    [
        Disc((0, 0, 0), (1, 1, 1), 3),
        Polygon([(3, -3, 0), (0, 3, -3), (-3, 0, 3)]),
        Cone((-1e-3, -1e-3, -1e-3), (1e-3, 1e-3, 1e-3), 3, 3),
        Placed(Box((-3, -3, -1e-3), (3, 3, 1e-3)), np.column_stack([TURN, np.zeros(3)])),
    ],
)
def test_a_plate_overlaps_no_cell_beside_it(item):
    """Though its box does: a plate across (1, 1, 1), and cells on both sides of its plane."""
    rng = np.random.default_rng(6)
    corner = rng.uniform(-1.5, 1, (2000, 3))
    cells = np.hstack([corner, corner + 0.25])
    does_overlap = np.empty(len(cells), bool)
    geometry = mixed_of([item])
    call(clip_all, geometry, cells, cells.copy(), np.empty((2 * POLYGON_SIZE, 3)), does_overlap)
    is_beside = (cells[:, :3].sum(axis=1) > 0.01) | (cells[:, 3:].sum(axis=1) < -0.01)
    assert is_beside.sum() > 1000
    assert not does_overlap[is_beside].any()
    through = (cells[:, :3].sum(axis=1) < -0.01) & (cells[:, 3:].sum(axis=1) > 0.01)
    inside = through & (np.abs(cells).max(axis=1) < 1)
    assert inside.sum() > 50
    assert does_overlap[inside].all()


@pytest.mark.parametrize("name", SOLIDS)
def test_intervals_begin_and_end_where_rays_hit(name):
    item = SOLIDS[name]
    geometry = mixed_of([item])
    rng = np.random.default_rng(4)
    low, high = geometry.boxes[0].reshape(2, 3)
    origins = low + (rng.random((500, 3)) * 3 - 1) * (high - low)
    targets = low + rng.random((500, 3)) * (high - low)
    if name == "needle":
        targets = np.array(item.base) + rng.random((500, 1)) * np.subtract(item.apex, item.base)
    rays = rays_of(origins, targets - origins)
    out = np.zeros((500, 2))
    call(all_intervals, geometry, rays.arrays(), out)
    near, far = out.T
    is_met = near <= far
    solid = item.solid if isinstance(item, Placed) else item
    if not (isinstance(solid, Sphere | Box) or (isinstance(solid, Cone) and solid.is_capped)):
        assert not is_met.any()
        return
    t, _ = trace(geometry, rays)
    first = np.where(near >= 0, near, np.where(far >= 0, far, np.inf))
    first[~is_met] = np.inf
    assert np.isfinite(first).sum() > 100
    np.testing.assert_allclose(t, first, rtol=1e-12)


@pytest.mark.exhaustive
def test_a_polygon_with_many_corners_is_as_its_triangles_are():
    """A comb: what is between its teeth is not hit, and clipping knows the teeth in a cell."""
    teeth = 40
    outline = [(0.0, -1.0, 0.0), (2.0 * teeth, -1.0, 0.0)]
    for k in range(teeth, 0, -1):
        outline += [
            (2.0 * k, 3.0, 0),
            (2.0 * k - 1, 3.0, 0),
            (2.0 * k - 1, 0.0, 0),
            (2.0 * k - 2, 0.0, 0),
        ]
    geometry = mixed_of([Polygon(outline)])
    x, y = np.meshgrid(np.arange(0.25, 2 * teeth, 0.5), [-0.5, 1.0, 2.5])
    origins = np.stack([x.ravel(), y.ravel(), np.full(x.size, -1.0)], axis=1)
    t, _ = trace(geometry, rays_of(origins, (0, 0, 1)))
    np.testing.assert_array_equal(np.isfinite(t), (y.ravel() < 0) | (x.ravel() % 2 > 1))
    cells = np.array([[2 * k + 0.25, 1, -1, 2 * k + 1.5, 2, 1] for k in range(teeth)])
    boxes = cells.copy()
    call(clip_all, geometry, cells, boxes, np.empty((20, 3)), np.empty(teeth, bool))
    np.testing.assert_allclose(boxes[:, 0], cells[:, 0] + 0.75, atol=1e-12)
    assert list(itertools.chain(*boxes[:, [2, 5]])) == [0.0] * (2 * teeth)
