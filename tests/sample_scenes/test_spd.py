"""Scenes of the Standard Procedural Databases: counts, boxes, order, what their rules say."""

import functools
import itertools
import math

import numpy as np
import pytest
from accelscope.core.geometry.solids.description import Cone, Polygon, Sphere, Triangle
from accelscope.core.scene.material import shine_of
from accelscope.sample_scenes import (
    balls,
    gears,
    jacks,
    lattice,
    mount,
    rings,
    shells,
    teapot,
    tree,
)

SCENES = {
    module.__name__.rpartition(".")[2]: module
    for module in (balls, gears, jacks, lattice, mount, rings, shells, teapot, tree)
}


@functools.cache
def described(name, size=None):
    """Return the items of a scene, and the material of each."""
    module = SCENES[name]
    settings = module.Settings() if size is None else module.Settings(size=size)
    items, materials = zip(*module.items(settings), strict=True)
    assert len(items) == module.count(settings)
    return items, materials


def box(items):
    """Return the box around items, in closed form: that of a cone is that of its two rims."""
    spheres, cones, corners = [], [], [np.empty((0, 3))]
    for item in items:
        if isinstance(item, Sphere):
            spheres.append((*item.centre, item.radius))
        elif isinstance(item, Cone):
            cones.append((*item.base, *item.apex, item.base_radius, item.apex_radius))
        else:
            corners.append(np.asarray(item.corners))
    spheres, cones = np.reshape(spheres, (-1, 4)), np.reshape(cones, (-1, 8))
    axes = cones[:, 3:6] - cones[:, :3]
    # How far a circle reaches along an axis: radius times the sine of the angle to it.
    sines = np.sqrt(1.0 - np.minimum(1.0, axes**2 / (axes**2).sum(axis=1, keepdims=True)))
    centres = np.concatenate([spheres[:, :3], cones[:, :3], cones[:, 3:6], *corners])
    reach = np.zeros_like(centres)
    n, m = len(spheres), len(cones)
    reach[:n] = spheres[:, 3:]
    reach[n : n + m], reach[n + m : n + 2 * m] = cones[:, 6:7] * sines, cones[:, 7:] * sines
    return (centres - reach).min(axis=0), (centres + reach).max(axis=0)


def kinds(items):
    """Return how many of the items are of each kind."""
    return {kind: sum(isinstance(item, kind) for item in items) for kind in set(map(type, items))}


# All of them -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "totals"),
    {
        "balls": (11, 92, 821, 7382),
        "gears": (147, 1169, 3943, 9345),
        "jacks": (9, 81, 657, 5265),
        "lattice": (20, 81, 208, 425),
        "mount": (12, 36, 132, 516),
        "rings": (61, 301, 841, 1801),
        "shells": (361, 721, 1441, 2881),
        "teapot": (57, 244, 561, 1008),
        "tree": (7, 15, 31, 63),
    }.items(),
)
def test_totals_are_the_published_ones(name, totals):
    for size, total in enumerate(totals, start=1):
        if total < 2000:
            assert len(described(name, size)[0]) == total
        assert SCENES[name].count(SCENES[name].Settings(size=size)) == total


@pytest.mark.parametrize(
    ("name", "size", "published"),
    [
        ("balls", 4, {Sphere: 7381, Polygon: 1}),
        ("gears", 4, {Polygon: 9345}),
        ("jacks", 4, {Sphere: 585 * 6, Cone: 585 * 3}),
        ("lattice", 12, {Sphere: 2197, Cone: 6084}),
        ("mount", 6, {Sphere: 4, Triangle: 8192}),
        ("rings", 7, {Sphere: 4200, Cone: 4200, Polygon: 1}),
        ("shells", 5, {Sphere: 5761}),
        ("teapot", 12, {Triangle: 9120, Polygon: 144}),
        ("tree", 11, {Sphere: 4095, Cone: 4095, Polygon: 1}),
    ],
)
def test_default_sizes_and_what_they_are_made_of(name, size, published):
    assert SCENES[name].Settings().size == size
    items, _ = described(name)
    assert kinds(items) == published
    # As in the Neutral File Format: cones and cylinders are open.
    assert not any(item.is_capped for item in items if isinstance(item, Cone))


@pytest.mark.parametrize(
    ("name", "published"),
    {
        "balls": (24.0, 24.0, 1.3306),
        "gears": (4.0, 4.0, 1.0),
        "lattice": (1.0417, 1.0417, 1.0417),
        "mount": (2.1596, 2.1596, 2.0812),
        "rings": (19.6778, 19.2514, 19.6778),
        "teapot": (8.0, 8.0, 3.15),
        "tree": (100.0, 100.0, 3.1375),
    }.items(),
)
def test_boxes_are_the_published_ones(name, published):
    """Of the programs' output, whose coordinates have six digits."""
    lower, upper = box(described(name)[0])
    assert upper - lower == pytest.approx(published, abs=1e-4)


def test_what_a_generation_adds_comes_behind_what_it_grows_from():
    """Items stand in the order of a recursion: the first descends to the last generation first."""
    radii = [item.radius for item in described("balls", 2)[0][1:]]
    assert radii[:11] == pytest.approx([1 / 2, 1 / 6, *[1 / 18] * 9])
    radii = [item.radius for item in described("tree", 2)[0] if isinstance(item, Sphere)]
    assert radii == pytest.approx([0.15 * 0.67**n for n in (1, 2, 3, 3, 2, 3, 3)])
    radii = [item.radius for item in described("jacks", 3)[0] if isinstance(item, Sphere)]
    assert radii[::6][:11] == pytest.approx([0.15, 0.075, *[0.0375] * 8, 0.075])


def test_a_highlight_has_half_its_strength_where_it_is_said_to():
    for degrees in (6.7, 10.0, 37.0, 89.0):
        assert math.cos(math.radians(degrees)) ** shine_of(degrees) == pytest.approx(0.5)


# One by one ------------------------------------------------------------------------------------


def test_balls_touch_the_one_they_sit_on_and_nine_sit_on_each():
    spheres = described("balls", 3)[0][1:]
    centres = np.array([sphere.centre for sphere in spheres])
    radii = np.array([sphere.radius for sphere in spheres])
    for radius in (1 / 2, 1 / 6, 1 / 18):
        parents, children = np.isclose(radii, radius), np.isclose(radii, radius / 3.0)
        away = np.linalg.norm(centres[parents][:, None] - centres[children], axis=2)
        assert (np.isclose(away, radius * 4.0 / 3.0).sum(axis=1) >= 9).all()
        assert np.isclose(away.min(axis=0), radius * 4.0 / 3.0).all()
    # The first generation: a trio further up every 120 degrees, a hexagon around.
    first = centres[np.isclose(radii, 1 / 6)] / (2.0 / 3.0)
    assert np.sort(first[:, 2]) == pytest.approx([0.0] * 6 + [math.sqrt(2.0 / 3.0)] * 3, abs=1e-12)
    azimuths = np.degrees(np.arctan2(first[:, 1], first[:, 0])) % 360.0
    upper = first[:, 2] > 0.5
    assert np.sort(azimuths[upper]) == pytest.approx([45.0, 165.0, 285.0])
    assert np.sort(azimuths[~upper]) == pytest.approx([15.0, 75.0, 135.0, 195.0, 255.0, 315.0])


def test_gears_are_closed_and_have_the_volume_of_their_outline():
    n = 2
    items, materials = described("gears", n)
    radius, thickness = 1.0 / (2.0 - 0.05), 0.1
    # Triangles between the axis and each edge of the outline, of a tooth and the valley after it.
    tips, rise, valley, fall = np.diff([-0.19, 0.19, 0.3, 0.7, 0.81]) * 2.0 * math.pi / 36.0
    outer, inner = 0.995 * radius, 0.9 * radius
    area = 18.0 * (
        outer**2 * math.sin(tips)
        + outer * inner * (math.sin(rise) + math.sin(fall))
        + inner**2 * math.sin(valley)
    )
    for number in range(n**3):
        polygons = items[1 + 146 * number :][:146]
        assert [len(polygon.corners) for polygon in polygons] == [144] + [4] * 144 + [144]
        edges, volume = set(), 0.0
        for polygon in polygons:
            corners = np.round(polygon.corners, 9) + 0.0
            after = np.roll(corners, -1, axis=0)
            edges.update((tuple(a), tuple(b)) for a, b in zip(corners, after, strict=True))
            volume += np.cross(corners, after).sum(axis=0) @ corners[0] / 6.0
        assert len(edges) == 2 * 144 + 4 * 144  # each once
        assert all(edge[::-1] in edges for edge in edges)
        # Its normals point outwards: the volume is positive.
        assert volume == pytest.approx(area * thickness, rel=1e-6)
        assert len({id(polygon) for polygon in polygons}) == 146
        assert len(set(materials[1 + 146 * number :][:146])) == 1
    assert len(set(materials)) == 1 + n**3


def test_gears_lie_in_their_cube_and_mesh_without_touching():
    n = 3
    polygons = [np.asarray(item.corners) for item in described("gears", n)[0][1:]]
    tops = [top for top in polygons[::146] if len(top) == 144]
    assert len(tops) == n**3
    for (ix, iy), top in zip(itertools.product(range(n), repeat=2), tops, strict=False):
        # The first layer, x varying fastest; every neighbour is turned by half a tooth.
        tip = top[0] - top.mean(axis=0)
        turn = math.degrees(math.atan2(tip[1], tip[0])) / 10.0
        assert turn == pytest.approx(-0.19 + (ix + iy) % 2 / 2.0)
        assert (top[:, 2] == 1.0).all()
    lower, upper = box([Polygon(top) for top in tops])
    assert lower[:2] == pytest.approx([-1.0, -1.0], abs=0.01)
    assert upper[:2] == pytest.approx([1.0, 1.0], abs=0.01)


def test_every_fifth_gear_transmits():
    _, materials = described("gears")
    glass = [material for material in materials[1::146] if material.transmission]
    assert len(glass) == sum(
        (4 * x + 2 * y + z) % 5 == 0 for x, y, z in itertools.product(range(4), repeat=3)
    )
    assert {(m.diffuse, m.transmission, m.index_of_refraction) for m in glass} == {(0.2, 0.8, 1.1)}
    assert all(max(material.colour) == 1.0 for material in materials)
    # The first of all: fractions 5/7, 3/7 and 2/7, a hundredth more each.
    assert materials[1].colour == pytest.approx([1.0, 3.07 / 5.07, 2.07 / 5.07])


def test_jacks_are_three_crossed_rods_with_a_ball_on_each_end():
    items, _ = described("jacks", 2)
    for start in range(0, len(items), 9):
        rods, spheres = items[start : start + 3], items[start + 3 : start + 9]
        arms = np.array([np.subtract(rod.apex, rod.base) / 2.0 for rod in rods])
        length = np.linalg.norm(arms[0])
        assert arms @ arms.T == pytest.approx(length**2 * np.eye(3), abs=1e-12)
        assert np.linalg.det(arms) > 0.0
        ends = [rod.apex for rod in rods] + [rod.base for rod in rods]
        for sphere, end in zip(spheres, ends, strict=True):
            assert sphere.centre == pytest.approx(end, abs=1e-12)
            assert (sphere.radius, rods[0].base_radius) == pytest.approx(
                (0.2 * length, 0.1 * length)
            )
    # Turned about y first, then about x: the y axis stays in the plane x = 0.
    turned = np.subtract(items[1].apex, items[1].base) / 1.5
    assert turned == pytest.approx([0.0, math.cos(math.pi / 6.0), -0.5], abs=1e-12)
    # Octant by octant, z varying fastest, seen along the first jack's own rods.
    rods = np.array([np.subtract(rod.apex, rod.base) for rod in items[:3]])
    centres = np.array([np.add(items[n].base, items[n].apex) / 2.0 for n in range(9, 81, 9)])
    assert np.sign(centres @ rods.T).tolist() == [
        list(map(float, signs)) for signs in itertools.product((-1, 1), repeat=3)
    ]
    assert np.linalg.norm(centres, axis=1) == pytest.approx(0.5 * math.sqrt(3.0))


@pytest.mark.parametrize("n", [1, 3, 4])
def test_lattice_joins_every_point_with_its_neighbours(n):
    items, materials = described("lattice", n)
    spheres = [item for item in items if isinstance(item, Sphere)]
    points = np.array([sphere.centre for sphere in spheres])
    assert {sphere.radius for sphere in spheres} == {0.25 / n}
    assert (points * n).tolist() == [list(p) for p in itertools.product(range(n + 1), repeat=3)]
    for rod, material in zip(items, materials, strict=True):
        if isinstance(rod, Cone):
            axis = "xyz".index(material.name[-1])
            across = np.delete(np.subtract(rod.apex, rod.base), axis)
            assert (across == 0.0).all()
            # It begins and ends inside the spheres that it joins, by a hair.
            gap = 0.99 * 0.25 / n * (1.0 - math.sqrt(0.25))
            ends = rod.base[axis] * n, rod.apex[axis] * n
            assert ends[0] - gap * n == pytest.approx(round(ends[0]), abs=1e-12)
            assert ends[1] + gap * n == pytest.approx(round(ends[0]) + 1.0, abs=1e-12)
            assert rod.base_radius == rod.apex_radius == 0.0625 / n


def closest(p, q, r, s):
    """Return how near the segments p to q and r to s come to each other."""
    a, b = q - p, s - r
    best = np.inf
    # Lines that are not parallel meet the shortest way once; else an end is the nearest.
    matrix = np.array([[a @ a, -a @ b], [a @ b, -b @ b]])
    if abs(np.linalg.det(matrix)) > 1e-12:
        u, v = np.linalg.solve(matrix, [a @ (r - p), b @ (r - p)])
        if 0.0 <= u <= 1.0 and 0.0 <= v <= 1.0:
            return np.linalg.norm(p + u * a - r - v * b)
    for point, start, way in ((p, r, b), (q, r, b), (r, p, a), (s, p, a)):
        along = np.clip((point - start) @ way / (way @ way), 0.0, 1.0)
        best = min(best, np.linalg.norm(point - start - along * way))
    return best


def test_the_rings_of_a_knot_would_just_touch_each_other_before_it_is_scaled():
    pentagons = rings.knot()
    assert np.linalg.norm(pentagons, axis=2) == pytest.approx(1.0 / 1.07412)
    sides = np.linalg.norm(pentagons - np.roll(pentagons, 1, axis=1), axis=2)
    assert sides == pytest.approx(2.0 * math.sin(math.pi / 5.0) / 1.07412)
    nearest = min(
        closest(a[i], a[i - 1], b[j], b[j - 1])
        for a, b in itertools.combinations(pentagons, 2)
        for i, j in itertools.product(range(5), repeat=2)
    )
    assert 1.07412 * nearest == pytest.approx(2.0 * rings.TUBE_RADIUS, rel=1e-4)
    # The corners are the middles of a dodecahedron's edges: 30, with their opposites.
    corners = pentagons.reshape(-1, 3)
    apart = np.linalg.norm(corners[:, None] - corners, axis=2) + 9.0 * np.eye(30)
    assert apart.min() > 0.5
    assert np.abs(corners[:, None] + corners).sum(axis=2).min(axis=1).max() < 1e-12


def test_rings_are_closed_pentagons_in_six_colours_and_the_wall_fills_the_view():
    items, materials = described("rings", 3)
    for number in range(1, len(items), 10):
        cylinders, joints = items[number : number + 10 : 2], items[number + 1 : number + 10 : 2]
        for i in range(5):
            assert np.array_equal(cylinders[i].base, joints[i].centre)
            assert np.array_equal(cylinders[i].apex, joints[i - 1].centre)
        assert len(set(materials[number : number + 10])) == 1
        assert (
            materials[number].name.split()[0]
            == (["red", "green", "blue", "cyan", "magenta", "yellow"][number // 10 % 6])
        )
    corners = np.array(items[0].corners) - rings.CAMERA.position
    assert corners[:, [0, 2]] == pytest.approx(
        np.outer(1.01 * corners[:, 1] * math.tan(math.pi / 8.0), [1.0, 1.0])
        * [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    )
    # The first knot of the last layer is the one with the least x and z.
    first = np.mean([item.centre for item in items[1 + 60 * 5 :][1:60:2]], axis=0)
    assert first == pytest.approx([-2.0, 3.0 / math.sin(math.pi / 8.0), -2.0])


def test_shells_spiral_has_its_closed_forms():
    spheres, _ = described("shells")
    centres = np.array([sphere.centre for sphere in spheres])
    radii = np.array([sphere.radius for sphere in spheres])
    largest = math.exp(0.15 * 6.0 * math.pi)
    assert radii[-1] == pytest.approx(largest)
    assert radii[0] == pytest.approx(math.exp(-0.15 * 12.0 * math.pi))
    assert radii[1:] / radii[:-1] == pytest.approx(math.exp(0.15 * 18.0 * math.pi / 5760))
    # Two thirds of the way the angle is 0 and the radius 1.
    assert radii[3840] == 1.0
    assert centres[3840].tolist() == [0.0, 1.0, -2.0]
    # Every centre is at one angle to the axis, the spheres lie in a cone.
    assert np.linalg.norm(centres, axis=1) == pytest.approx(math.sqrt(5.0) * radii)
    lower, upper = box(spheres)
    assert lower[2] == pytest.approx(-3.0 * largest)
    assert upper[2] == pytest.approx(-radii[0])
    assert upper[1] == pytest.approx(2.0 * largest)
    # x - radius is least where its derivative 0.15 (sin a - 1) + cos a is 0.
    a = 6.0 * math.pi - math.pi / 2.0 + 2.0 * math.atan(0.15)
    assert 0.15 * (math.sin(a) - 1.0) + math.cos(a) == pytest.approx(0.0, abs=1e-12)
    assert lower[0] == pytest.approx(math.exp(0.15 * a) * (math.sin(a) - 1.0), rel=1e-4)


@pytest.mark.parametrize("n", [1, 3, 4])
def test_teapot_stands_on_a_chessboard(n):
    items, materials = described("teapot", n)
    squares = np.array([item.corners for item in items[: n * n]])
    assert (squares[..., 2] == 0.0).all()
    places = np.round((squares.mean(axis=1)[:, :2] / 4.0 + 1.0) * n / 2.0 - 0.5).astype(int)
    assert len(set(map(tuple, places))) == n * n
    white = [material.name == "white squares" for material in materials[: n * n]]
    assert (places.sum(axis=1) % 2 == np.array(white)).all()
    assert white == sorted(white, reverse=True)
    # Counter-clockwise from above, 8 units wide in all.
    sides = squares[:, 1:3] - squares[:, :2]
    assert np.cross(sides[:, 0], sides[:, 1])[:, 2] == pytest.approx(64.0 / n**2)


def test_branches_of_the_tree_lean_and_shrink_as_the_rule_says():
    cones = [item for item in described("tree", 5)[0] if isinstance(item, Cone)]
    axes = {}
    for cone in cones:
        foot, axis = tuple(np.round(cone.base, 9)), np.subtract(cone.apex, cone.base)
        assert cone.apex_radius == pytest.approx(0.67 * cone.base_radius)
        axes[tuple(np.round(cone.apex, 9))] = axis
        if foot in axes:
            parent = axes[foot]
            length, parent_length = np.linalg.norm(axis), np.linalg.norm(parent)
            lean = math.degrees(math.acos(axis @ parent / (length * parent_length)))
            shape = (round(length / parent_length, 6), round(lean, 6))
            assert shape in ((0.65, 40.0), (0.7, 25.0))
    assert len(axes) == len(cones) == 2**6 - 1
    # Of the first fork, turned about the trunk by 90 and by 230 degrees: RotX takes +z to -y.
    for cone, degrees, length, lean in ((cones[1], 90, 0.65, 40), (cones[32], 230, 0.7, 25)):
        azimuth = math.radians(degrees - 90)
        across = length * math.sin(math.radians(lean))
        assert cone.apex == pytest.approx(
            [
                across * math.cos(azimuth),
                across * math.sin(azimuth),
                1.0 + length * math.cos(math.radians(lean)),
            ],
            abs=1e-12,
        )
