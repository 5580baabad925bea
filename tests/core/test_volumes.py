"""Bounding volumes: they contain what is inside, have the areas of closed forms, lose no hit."""

import functools
import itertools
from fractions import Fraction

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry import half_spaces
from accelscope.core.geometry.box import Boxes
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.geometry.combined import (
    LINES,
    Intersection,
    Union,
    is_polyhedral,
    measured_by_lines,
)
from accelscope.core.geometry.fit import fit_all, sticking_out
from accelscope.core.geometry.kdop import DIRECTIONS, KDOPs
from accelscope.core.geometry.kinds import COMBINED, KINDS
from accelscope.core.geometry.obb import OBBs
from accelscope.core.geometry.rays import ALL, Rays
from accelscope.core.geometry.sphere import Spheres
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures import structures
from accelscope.core.structures.bvh import hierarchy

EPS = np.finfo(np.float64).eps


def fitted(kind, *objects):
    """Volumes of a kind around lists of triangles."""
    ends = np.cumsum([len(triangles) for triangles in objects])
    begins = ends - [len(triangles) for triangles in objects]
    return fit_all(kind, np.ascontiguousarray(np.concatenate(objects)), begins, ends, SILENT)


def hull_triangles(points):
    """All triangles of some points: their convex hull, and more inside."""
    return np.array([points[list(t)] for t in itertools.combinations(range(len(points)), 3)])


CUBE = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))
TETRAHEDRON = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
OCTAHEDRON = np.concatenate([np.eye(3), -np.eye(3)])


def turn(axis, angle):
    """A rotation as a (4, 4) matrix."""
    axis = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * -cross + (1 - np.cos(angle)) * cross @ cross
    return matrix


def awkward_objects():
    """Lists of triangles: near and far from the origin, large, small, thin and flat."""
    rng = np.random.default_rng(3)
    shapes = [rng.normal(size=(n, 3, 3)) for n in (1, 2, 5, 20)]
    shapes += [shape + 1e6 * rng.normal(size=3) for shape in shapes[:4]]
    shapes += [1e-9 * shapes[2], 1e9 * shapes[2], shapes[3] * [1e-6, 1.0, 1e3]]
    needle = rng.normal(size=(3, 3, 3))
    needle[:, 2] = needle[:, 1] + 1e-13
    flat = rng.normal(size=(4, 3, 3)) * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.3]
    point = np.repeat(rng.normal(size=(1, 1, 3)), 3, axis=1)
    return [*shapes, needle, flat, point, np.repeat(shapes[0], 3, axis=0)]


# ------------------------------------------------------------------------------------- containing


def excess(volumes, index, vertex):
    """How far outside, as an exact fraction (of squares for spheres); at most 0 inside."""
    p = [Fraction(x) for x in vertex]
    row = [Fraction(x) for x in volumes[0][index].tolist()]
    if isinstance(volumes, Spheres):
        return sum((a - b) ** 2 for a, b in zip(p, row[:3], strict=True)) - row[3] ** 2
    if isinstance(volumes, Boxes):
        strips = [([0] * i + [1] + [0] * (2 - i), row[i], row[3 + i]) for i in range(3)]
    elif isinstance(volumes, OBBs):
        strips = [(row[3 * i : 3 * i + 3], row[9 + i], row[12 + i]) for i in range(3)]
    else:
        normals = volumes.directions.astype(int).tolist()
        strips = [(n, row[2 * i], row[2 * i + 1]) for i, n in enumerate(normals)]
    along = [sum(a * b for a, b in zip(n, p, strict=True)) for n, _, _ in strips]
    return max(max(low - a, a - high) for a, (_, low, high) in zip(along, strips, strict=True))


@pytest.mark.parametrize("kind", KINDS)
def test_a_volume_contains_its_triangles_in_exact_arithmetic(kind):
    objects = awkward_objects()
    volumes = fitted(kind, *objects)
    for index, triangles in enumerate(objects):
        for vertex in triangles.reshape(-1, 3):
            assert excess(volumes, index, vertex) <= 0
        # And it is tight: something touches, but for rounding.
        size = np.abs(triangles).max()
        nearest = max(excess(volumes, index, v) for v in triangles.reshape(-1, 3))
        assert nearest > -Fraction(20 * EPS * size * (size if isinstance(volumes, Spheres) else 1))


@pytest.mark.parametrize("kind", [*KINDS, *COMBINED])
def test_no_triangle_sticks_out_and_a_small_volume_is_found(kind):
    objects = awkward_objects()
    ends = np.cumsum([len(triangles) for triangles in objects])
    begins = ends - [len(triangles) for triangles in objects]
    corners = np.concatenate(objects)
    volumes = fitted(kind, *objects)
    # One by one: the tolerance is that of the largest coordinate.
    for i in range(len(objects)):
        one = objects[i].copy()
        alone = fitted(kind, one)
        assert not len(sticking_out(alone, one, np.zeros(1, int), np.array([len(one)])))
        moved = one + 0.5 * np.ptp(one.reshape(-1, 3), axis=0).max() + 1e-3 * np.abs(one).max()
        assert len(sticking_out(alone, moved, np.zeros(1, int), np.array([len(one)])))
    assert len(sticking_out(volumes, corners, begins, ends)) == 0


# ---------------------------------------------------------------------------------------- spheres


def brute_force_radius(points):
    """The smallest radius of spheres through two, three or four points that contain all."""
    best = np.inf
    for count in (2, 3, 4):
        for chosen in itertools.combinations(points, count):
            a, others = chosen[0], np.array(chosen[1:]) - chosen[0]
            centre = a + np.linalg.lstsq(others, 0.5 * (others**2).sum(axis=1), rcond=None)[0]
            radius = np.linalg.norm(points - centre, axis=1).max()
            if radius <= np.linalg.norm(a - centre) * (1 + 1e-9):
                best = min(best, radius)
    return best


def test_the_smallest_sphere_is_the_smallest():
    rng = np.random.default_rng(1)
    for _ in range(60):
        points = rng.normal(size=(9, 3)) * rng.choice([1.0, 0.01], size=3)
        smallest = fitted("smallest_sphere", points.reshape(-1, 3, 3)).rows[0, 3]
        assert smallest == pytest.approx(brute_force_radius(points), rel=1e-9)
        assert fitted("sphere", points.reshape(-1, 3, 3)).rows[0, 3] >= smallest * (1 - 1e-12)


@pytest.mark.parametrize(
    ("points", "radius"),
    [(CUBE, 3**0.5), (TETRAHEDRON, 3**0.5), (OCTAHEDRON, 1.0), (CUBE * [1, 1, 0], 2**0.5)],
)
def test_smallest_spheres_of_regular_shapes(points, radius):
    sphere = fitted("smallest_sphere", hull_triangles(points))
    assert sphere.rows[0, 3] == pytest.approx(radius, rel=1e-14)
    assert np.abs(sphere.rows[0, :3]).max() < 1e-14


def test_the_smallest_sphere_of_many_points_is_held_by_few():
    rng = np.random.default_rng(2)
    triangles = rng.normal(size=(3000, 3, 3))
    centre, radius = np.split(fitted("smallest_sphere", triangles).rows[0], [3])
    distance = np.linalg.norm(triangles.reshape(-1, 3) - centre, axis=1)
    support = triangles.reshape(-1, 3)[distance > radius * (1 - 1e-10)]
    assert 2 <= len(support) <= 4
    # No way to go from the centre leads nearer to all of them.
    weights = np.linalg.lstsq(
        np.vstack([support.T, np.ones(len(support))]), np.append(centre, 1.0), rcond=None
    )[0]
    assert (weights > -1e-9).all()
    assert weights @ support == pytest.approx(centre, abs=1e-9)


# -------------------------------------------------------------------------------- areas of k-DOPs

AROUND_UNIT_SPHERE = {
    6: (24.0, 8.0, 8), 14: (16.076952, 5.358984, 24), 18: (15.264935, 5.088312, 32),
    26: (14.331896, 4.777299, 48),
}  # fmt: skip
"""k to surface, volume and number of corners, from a convex hull program."""


@pytest.mark.parametrize("k", DIRECTIONS)
def test_kdop_around_a_sphere(k):
    directions = np.array(DIRECTIONS[k], dtype=np.float64)
    reach = np.linalg.norm(directions, axis=1)
    volumes = KDOPs(np.stack([-reach, reach], axis=1).reshape(1, -1), directions)
    area, content, corners = AROUND_UNIT_SPHERE[k]
    assert volumes.areas()[0] == pytest.approx(area, rel=1e-6)
    assert volumes.contents()[0] == pytest.approx(content, rel=1e-6)
    assert volumes.areas()[0] == pytest.approx(3 * volumes.contents()[0], rel=1e-10)
    polygons = volumes.polygons(np.arange(1))
    assert len(polygons.owners) == k
    assert len(np.unique(np.round(polygons.points, 9), axis=0)) == corners


@pytest.mark.parametrize(
    ("points", "surface", "shares"),
    [
        (TETRAHEDRON, 8 * 3**0.5, (0.5773502692, 1.0, 0.5773502692, 1.0)),
        (OCTAHEDRON, 4 * 3**0.5, (0.2886751346, 1.0, 0.8164965809, 1.0)),
        (CUBE @ turn([0, 0, 1], np.pi / 4)[:3, :3].T, 24.0, (0.621320, 0.837179, 1.0, 1.0)),
    ],
)
def test_kdops_around_regular_shapes(points, surface, shares):
    for k, share in zip(DIRECTIONS, shares, strict=True):
        area = fitted(f"kdop{k}", hull_triangles(points)).areas()[0]
        assert surface / area == pytest.approx(share, rel=1e-6)


def test_flat_volumes_have_two_sides():
    square = hull_triangles(CUBE[[0, 2, 4, 6]] + np.array([3.0, 4.0, 5.0]))
    for kind in ("aabb", "obb", "kdop6", "kdop14", "kdop18", "kdop26"):
        assert fitted(kind, square).areas()[0] == pytest.approx(8.0, rel=1e-9), kind
    # Leaning, in the plane of a strip: the triangle itself is the 14-DOP.
    leaning = np.eye(3)[None]
    assert fitted("kdop14", leaning).areas()[0] == pytest.approx(3**0.5, rel=1e-9)


@pytest.mark.parametrize("k", [14, 18, 26])
def test_faces_that_cannot_meet_are_left_out_rightly(k):
    """Areas from neighbours only are those from all half-spaces, and those from edges are, too."""
    objects = awkward_objects()
    volumes = fitted(f"kdop{k}", *objects)
    n = len(objects)
    local = half_spaces.localised(volumes.half_spaces(np.arange(n)), volumes.boxes())
    room = half_spaces.make_room(k)
    areas, contents = np.empty(n), np.empty(n)
    half_spaces.measure_range(local, half_spaces.every_other(k), room, areas, contents)
    near = np.empty(n), np.empty(n)
    half_spaces.measure_range(local, volumes.neighbours(), room, *near)
    # A shell is left around every face.
    sizes = np.linalg.norm(volumes.boxes()[:, 3:] - volumes.boxes()[:, :3], axis=1)
    shell = 100 * k * (half_spaces.SHELL * sizes + 32 * EPS * np.abs(volumes.boxes()).max(axis=1))
    for some in (volumes.areas(), near[0]):
        assert (np.abs(some - areas) <= shell * sizes).all()
    for some in (volumes.contents(), near[1]):
        assert (np.abs(some - contents) <= shell * sizes**2).all()
    assert volumes.areas()[:4] == pytest.approx(areas[:4], rel=1e-9)
    assert volumes.contents()[:4] == pytest.approx(contents[:4], rel=1e-9)
    assert volumes.neighbours().shape[1] < k - 1


@pytest.mark.parametrize("kind", ["aabb", "obb", "kdop14", "kdop18", "kdop26", "obb_and_kdop14"])
def test_polygons_are_a_closed_surface(kind):
    volumes = fitted(kind, *awkward_objects()[2:4])
    polygons = volumes.polygons(np.array([1, 0]))
    areas, normals = np.zeros(2), np.zeros((2, 3))
    for begin, end, owner in zip(
        polygons.offsets[:-1], polygons.offsets[1:], polygons.owners, strict=True
    ):
        p = polygons.points[begin:end] - polygons.points[begin]
        normal = 0.5 * np.cross(p[1:-1], p[2:]).sum(axis=0)
        outwards = polygons.points[begin] - volumes.boxes()[1 - owner].reshape(2, 3).mean(axis=0)
        areas[owner] += np.linalg.norm(normal)
        normals[owner] += normal * np.sign(normal @ outwards)
    assert areas[::-1] == pytest.approx(volumes.areas(), rel=1e-8)
    assert np.abs(normals).max() < 1e-7


# --------------------------------------------------------------------------------- oriented boxes


def test_an_oriented_box_is_found():
    rng = np.random.default_rng(7)
    for _ in range(20):
        matrix = turn(rng.normal(size=3), rng.random() * 3)
        matrix[:3, 3] = rng.normal(size=3)
        corners = CUBE * [1.0, 2.0, 3.0] @ matrix[:3, :3].T + matrix[:3, 3]
        sides = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]
        faces = corners[[[s[0], s[i], s[i + 1]] for s in sides for i in (1, 2)]]
        box = fitted("obb", faces)
        assert box.areas()[0] == pytest.approx(88.0, rel=1e-12)
        assert box.contents()[0] == pytest.approx(48.0, rel=1e-12)
        assert np.sort(box.sizes()[0]) == pytest.approx([2.0, 4.0, 6.0], rel=1e-12)


def test_an_oriented_box_is_never_worse_than_an_aligned_one():
    objects = awkward_objects()
    oriented, aligned = fitted("obb", *objects).areas(), fitted("aabb", *objects).areas()
    assert (oriented <= aligned).all()
    assert (oriented < 0.9 * aligned).sum() > 2


# --------------------------------------------------------------------------------------- combining


def standard_error(areas, boxes):
    """Of measured areas: that of the share of lines through the ball around the box."""
    around = np.pi * ((boxes[:, 3:] - boxes[:, :3]) ** 2).sum(axis=1)
    share = areas / around
    return around * np.sqrt(share * (1 - share) / LINES)


@pytest.mark.parametrize("kind", [*KINDS, *COMBINED])
def test_random_lines_measure_areas(kind):
    volumes = fitted(kind, *awkward_objects()[1:4])
    measured, contents = measured_by_lines(volumes)
    if not isinstance(volumes, Union):
        error = standard_error(volumes.areas(), volumes.boxes())
        assert (np.abs(measured - volumes.areas()) < 4 * error).all()
        assert contents == pytest.approx(volumes.contents(), rel=0.1)


def test_a_sphere_in_a_cube_and_a_cube_in_a_sphere():
    cube, ball = Boxes(np.array([[-1.0, -1, -1, 1, 1, 1]])), Spheres(np.zeros((1, 4)))
    ball.rows[0, 3] = 1.0
    rays = Rays.from_arrays(*random_lines(-np.ones(3), np.ones(3), 200_000, 1))
    share = hits_of(ball, rays)
    assert abs(share - np.pi / 6) < 4 * np.sqrt(0.25 / len(rays))
    ball.rows[0, 3] = 3**0.5
    ratio = surface_area(cube.rows)[0] / ball.areas()[0]
    assert ratio == pytest.approx(2 / np.pi)
    measured = measured_by_lines(cube)[0][0] / measured_by_lines(ball)[0][0]
    assert abs(measured - 2 / np.pi) < 4 * np.sqrt(0.25 / LINES)


def hits_of(volumes, rays):
    """The share of rays that hit volume 0."""
    from accelscope.core.geometry.combined import cross_lines
    from accelscope.core.geometry.volume import MOST_STRIPS

    lengths = np.empty(len(rays))
    cross_lines(volumes, 0, rays.arrays(), np.ones(3), np.empty((MOST_STRIPS, 3)), lengths)
    return (lengths >= 0.0).mean()


def test_areas_and_contents_of_combinations():
    objects = awkward_objects()[1:4]
    both = fitted("obb_and_kdop14", *objects)
    assert is_polyhedral(both)
    for member in both:
        assert (both.areas() <= member.areas() * (1 + 1e-9)).all()
        assert (both.contents() <= member.contents() * (1 + 1e-9)).all()
    box, dop = fitted("aabb", *objects), fitted("kdop26", *objects)
    # A 26-DOP lies inside its box: sides that both have count once.
    for pair in (Intersection(box, dop), Intersection(dop, box), Intersection(dop, dop)):
        assert pair.areas() == pytest.approx(dop.areas(), rel=1e-9)
        assert pair.contents() == pytest.approx(dop.contents(), rel=1e-9)
    three = Intersection(box, Intersection(fitted("obb", *objects), dop))
    assert (three.areas() <= both.areas() * (1 + 1e-9)).all()
    cube, ball = Boxes(np.array([[-1.0, -1, -1, 1, 1, 1]])), Spheres(np.zeros((1, 4)))
    ball.rows[0, 3] = 1.2
    caps = 6 * np.pi * 0.2**2 * (3 * 1.2 - 0.2) / 3
    exact = ball.contents()[0] - caps
    assert Intersection(cube, ball).contents()[0] == pytest.approx(exact, rel=0.04)
    assert Union(cube, ball).contents()[0] == pytest.approx(8 + caps, rel=0.03)
    assert Union(cube, ball).areas()[0] > max(cube.areas()[0], ball.areas()[0])


def test_a_union_has_a_member_for_each_half():
    left, right = CUBE[None, :3], CUBE[None, :3] + [10.0, 0.0, 0.0]
    union = fitted("two_boxes", np.concatenate([left, right]))
    assert np.array_equal(union.first.rows, fitted("aabb", left).rows)
    assert np.array_equal(union.second.rows, fitted("aabb", right).rows)
    single = fitted("two_boxes", left)
    assert np.array_equal(single.first.rows, single.second.rows)


# ------------------------------------------------------------------------------------ no hit lost


def closest_points(p, a, b, c):
    """Distances of points from triangles, in the precision of the arrays."""

    def dot(u, v):
        return (u * v).sum(axis=1)

    def to_edge(a, b):
        along = b - a
        length2 = dot(along, along)
        share = dot(p - a, along) / np.where(length2 > 0, length2, 1)
        q = a + share.clip(0, 1)[:, None] * along
        return np.sqrt(dot(p - q, p - q))

    distance = np.minimum(np.minimum(to_edge(a, b), to_edge(b, c)), to_edge(c, a))
    n = np.cross(b - a, c - a)
    nn = np.where(dot(n, n) > 0, dot(n, n), 1)
    q = p - (dot(p - a, n) / nn)[:, None] * n
    corners = ((a, b), (b, c), (c, a))
    inside = np.all([dot(np.cross(v - u, q - u), n) >= 0 for u, v in corners], axis=0)
    return np.where(inside, np.minimum(distance, np.sqrt(dot(p - q, p - q))), distance)


def test_hits_lie_where_the_slack_of_volumes_expects_them(lab, scene_name):
    """The promise of triangles that volumes rely on: within 24 eps of coordinates; seen are 2."""
    rays, _, hits, _ = lab.truth(scene_name)
    scene = lab.small_scene(scene_name)
    hit = np.flatnonzero(hits.primitive >= 0)
    o, d, t, corners = (
        values.astype(np.longdouble)
        for values in (
            rays.origins[hit], rays.directions[hit], hits.t[hit],
            scene.triangles[hits.primitive[hit]],
        )
    )  # fmt: skip
    distance = closest_points(o + t[:, None] * d, *corners.transpose(1, 0, 2))
    reach = np.maximum(np.abs(scene.lower), np.abs(scene.upper))
    assert (distance <= 4 * EPS * (np.abs(o) + reach).sum(axis=1)).all()


@functools.cache
def out_of_proportion(lab):
    """Scenes that are thin, and far from the origin; rays, and what they hit."""
    soup = lab.small_scene("soup").triangles[:200]
    cases = []
    for change, shift in itertools.product(([1e-6, 1.0, 1e3], [1e5, 1.0, 1e-7]), (0.0, 1e4)):
        scene = Scene.from_triangles(soup * change + shift, "out of proportion")
        rays, names = lab.batch_of(lab.ray_families(scene, 40))
        naive = structures()["naive"]
        cases.append((scene, rays, names, naive.build(scene, naive.Settings()).trace(rays)[0]))
    return cases


@pytest.mark.parametrize("kind", [*KINDS, *COMBINED])
def test_no_hit_is_lost_in_scenes_out_of_proportion(lab, build, kind):
    """The slack is that of all axes together."""
    for scene, rays, names, want in out_of_proportion(lab):
        got, _ = build("sorted_volumes", scene, f"volume={kind},parts=200").trace(rays)
        assert lab.differences(names, want, got) == {}


# ------------------------------------------------------------------------------------ hierarchies


@pytest.mark.parametrize("k", [6, 14, 18, 26])
@pytest.mark.parametrize("sample", ["suzanne", "soup"])
def test_random_lines_visit_kdop_trees_as_the_areas_say(lab, build, sample, k):
    """A k-DOP tree is nested: a node is visited by the lines that hit its volume."""
    scene = lab.small_scene(sample)
    tree = build("bvh", scene, f"volume=kdop{k}")
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 50_000, 1))
    _, counters = tree.trace(rays, ALL)
    box = surface_area(np.concatenate([scene.lower, scene.upper]))
    visits, expected = counters["N_TS"], tree.areas.sum() / box
    assert abs(visits.mean() - expected) < 4 * visits.std() / np.sqrt(len(rays))


def test_a_6_dop_tree_is_a_tree_of_boxes(lab, build):
    scene = lab.small_scene("suzanne")
    rays = lab.batch_of({k: v for k, v in lab.ray_families(scene, 500).items() if k in lab.GENERIC})
    boxes, strips = (build("bvh", scene, f"volume={kind}") for kind in ("aabb", "kdop6"))
    assert np.array_equal(boxes.areas, strips.areas)
    counted = [tree.trace(rays[0])[1].values for tree in (boxes, strips)]
    assert np.array_equal(*counted)


def test_more_strips_fit_more_tightly(lab, build):
    scene = lab.small_scene("suzanne")
    areas = {k: build("bvh", scene, f"volume=kdop{k}").areas for k in DIRECTIONS}
    for k, more in ((6, 14), (6, 18), (14, 26), (18, 26)):
        assert (areas[more] <= areas[k] * (1 + 1e-9)).all()
        assert areas[more].sum() < 0.95 * areas[k].sum()


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "aabb"])
def test_damage_to_volumes_is_found(lab, build, kind):
    scene = lab.small_scene("soup")
    for node in (0, 7, -1):
        tree = build("bvh", scene, f"volume={kind}")
        assert tree.validate() == []
        # The last number is a radius, or the upper bound of a strip.
        tree.arrays.volumes.rows[node, -1] -= 0.01
        assert any("stick out" in text or "child" in text for text in tree.validate())


def test_cells_have_the_shape_of_volumes_up_to_a_number(lab, build, monkeypatch):
    from accelscope.core.contract.outlines import faces_of, wires_of

    monkeypatch.setattr(hierarchy, "MOST_SHAPES", 20)
    tree = build("bvh", lab.small_scene("soup"), "volume=kdop14")
    cells = tree.cells()
    places = np.arange(len(cells))
    assert cells.faces.owners.max() == 19
    wires, (triangles, owners) = wires_of(cells, places), faces_of(cells, places)
    edges = np.bincount(wires.edge_owners())
    assert (edges[:20] > 12).any()
    assert (edges[20:] == 12).all()
    assert (np.diff(wires.edge_owners()) >= 0).all()
    assert (np.diff(owners) >= 0).all()
    assert np.array_equal(np.unique(owners), places)
    assert len(triangles) == len(owners)
    assert np.array_equal(cells.attributes()["area"], tree.areas[cells.numbers])
