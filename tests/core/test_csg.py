"""Trees of solids: closed forms, identities, and that nothing changes a hit that must not."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.csg.description import (
    ClosedMesh,
    Difference,
    HalfSpace,
    Intersection,
    Union,
    mesh_of_triangles,
    moved_node,
)
from accelscope.core.geometry.csg.settings import CUT, NONE, UPWARD, CuttingSettings
from accelscope.core.geometry.geometry import normals_at
from accelscope.core.geometry.icosphere import icosphere
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Box, Cone, Disc, Polygon, Sphere, Triangle
from accelscope.core.geometry.solids.making import mixed_of_triangles
from accelscope.core.scene import Scene
from csg_trees import awkward_rays, box_mesh, is_inside, some_tree

CUBE, BALL = Box((-1, -1, -1), (1, 1, 1)), Sphere((0, 0, 0), 1.3)


def scene_of(*trees, **cutting):
    return Scene.from_trees(trees, "trees", cutting=CuttingSettings(**cutting))


@pytest.fixture
def hits_of(build):
    def trace(scene, rays, name="bvh", text=""):
        return build(name, scene, text).trace(rays)[0]

    return trace


def same(first, second):
    return (first.t.view(np.int64) == second.t.view(np.int64)) & (
        first.primitive == second.primitive
    )


def lines_through(scene, count=4000, seed=1):
    return Rays.from_arrays(*random_lines(scene.lower, scene.upper, count, seed))


def along_x(*starts, **others):
    origins = np.array([(x, 0.1, 0.2) for x in starts])
    return Rays.from_arrays(origins, np.tile([1.0, 0, 0], (len(starts), 1)), **others)


# --------------------------------------------------------------------------------- closed forms


def test_from_outside_the_entry_and_from_inside_the_exit(hits_of):
    """A cube with a hole along z, from both ends, from within the wall, and from the hole."""
    scene = scene_of(Difference([CUBE, Cone((0, 0, -3), (0, 0, 3), 0.5, 0.5)]))
    rays = along_x(-3.0, -0.8, 0.0, 0.8, 3.0)
    hits = hits_of(scene, rays)
    rim = np.sqrt(0.25 - 0.01)
    np.testing.assert_allclose(hits.t, [2.0, 0.8 - rim, rim, 0.2, np.inf], rtol=1e-12)
    assert hits.primitive.tolist() == [0, 1, 1, 0, -1]
    points = rays.origins[:4] + hits.t[:4, None] * rays.directions[:4]
    normals = normals_at(scene.geometry, hits.primitive[:4], points, np.zeros(4))
    # Out of what is left: into the hole, where the cylinder is taken away.
    assert np.sign(normals[:, 0]).tolist() == [-1, 1, -1, 1]
    np.testing.assert_allclose(normals[[0, 3]], [[-1, 0, 0], [1, 0, 0]])


def test_a_later_boundary_from_t_min_on(hits_of):
    scene = scene_of(Difference([CUBE, Box((-0.5, -2, -2), (0.5, 2, 2))]))
    hits = hits_of(scene, along_x(-3.0, -3.0, -3.0, -3.0, t_min=[0.0, 2.1, 2.6, 3.6]))
    np.testing.assert_array_equal(hits.t, [2.0, 2.5, 3.5, 4.0])


def test_faces_in_one_plane_leave_no_sliver(hits_of):
    """What ends where it is taken away; two halves that touch; a notch open at the side."""
    low, high = Box((-1, -1, -1), (0, 1, 1)), Box((0, -1, -1), (1, 1, 1))
    rays = along_x(-3.0, -0.5, 0.5)
    assert np.isinf(hits_of(scene_of(Difference([low, CUBE])), rays).t).all()
    np.testing.assert_array_equal(hits_of(scene_of(Union([low, high])), rays).t, [2.0, 1.5, 0.5])
    assert np.isinf(hits_of(scene_of(Intersection([low, high])), rays).t).all()
    np.testing.assert_array_equal(
        hits_of(scene_of(Difference([CUBE, low])), rays).t, [3.0, 0.5, 0.5]
    )


def test_half_spaces_cut_and_bound(hits_of):
    """An octahedron of eight half-spaces has no bound of its own; in a cube it has the cube's."""
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T
    eight = [HalfSpace(normal / 3.0, normal) for normal in signs]
    with pytest.raises(InputError, match="item 0 has no end"):
        scene_of(Intersection(eight))
    scene = scene_of(Intersection([Box((-2, -2, -2), (2, 2, 2)), *eight]))
    hits = hits_of(scene, along_x(-3.0))
    np.testing.assert_allclose(hits.t, [3.0 - 0.7], rtol=1e-12)
    upright = scene_of(Difference([CUBE, HalfSpace((0.25, 0, 0), (1, 0, 0))]))
    np.testing.assert_array_equal(hits_of(upright, along_x(-3.0, 0.5)).t, [3.25, 0.5])


def test_a_point_is_inside_between_an_entry_and_an_exit(hits_of):
    """Just before and behind each hit, closed forms say otherwise; at random places, the same."""
    rng = np.random.default_rng(11)
    right: list[np.ndarray] = []
    for seed in range(12):
        tree = some_tree(rng, int(rng.integers(1, 5)))
        scene = scene_of(tree)
        rays = lines_through(scene, 300, seed)
        t = hits_of(scene, rays).t
        hit = np.isfinite(t)
        near, far = (rays.origins + (t[:, None] + step) * rays.directions for step in (-1e-6, 1e-6))
        right.append(~is_inside(tree, near[hit]) & is_inside(tree, far[hit]))
        # Nothing is inside before the hit.
        share = rng.random(len(rays)) * np.where(hit, t, 2 * scene.diagonal)
        assert not is_inside(tree, rays.origins + share[:, None] * rays.directions).any()
    assert len(np.concatenate(right)) > 1000
    assert np.concatenate(right).mean() > 0.998  # a needle may be thinner than the step


# -------------------------------------------------------------------------------------- identities


def test_nothing_is_left_of_what_is_taken_from_itself(hits_of):
    for leaf in (BALL, CUBE, mesh_of_triangles(icosphere(1)), Cone((0, 0, 0), (1, 1, 1), 1, 0.5)):
        scene = scene_of(Difference([leaf, leaf]))
        assert np.isinf(hits_of(scene, lines_through(scene)).t).all()


def test_de_morgan_in_a_box(hits_of):
    """box - (A or B) is (box - A) and (box - B); box - (A and B) is (box - A) or (box - B)."""
    box, other = Box((-2, -2, -2), (2, 2, 2)), Sphere((0.7, 0.2, 0.1), 0.9)
    pairs = [
        (Difference([box, Union([BALL, other])]),
         Intersection([Difference([box, BALL]), Difference([box, other])])),
        (Difference([box, Intersection([BALL, other])]),
         Union([Difference([box, BALL]), Difference([box, other])])),
    ]  # fmt: skip
    rays = awkward_rays(scene_of(box), 300)
    for first, second in pairs:
        one, two = hits_of(scene_of(first), rays), hits_of(scene_of(second), rays)
        assert np.isfinite(one.t).sum() > 1000
        np.testing.assert_array_equal(one.t, two.t)


@pytest.mark.parametrize("operation", [Union, Intersection])
def test_operands_commute(hits_of, operation):
    mesh = mesh_of_triangles(0.9 * icosphere(1) + 0.3)
    forth, back = scene_of(operation([CUBE, mesh])), scene_of(operation([mesh, CUBE]))
    rays = awkward_rays(forth, 300)
    one, two = hits_of(forth, rays), hits_of(back, rays)
    np.testing.assert_array_equal(one.t, two.t)
    # The cube's number goes from first to last.
    hit = one.primitive >= 0
    n_triangles = len(mesh.triangles)
    np.testing.assert_array_equal(one.primitive[hit], (two.primitive[hit] + 1) % (n_triangles + 1))


def test_a_moved_tree_is_hit_by_moved_rays(hits_of):
    rng = np.random.default_rng(2)
    matrix = np.column_stack([rng.normal(size=(3, 3)), rng.normal(size=3)])
    matrix[:, 0] *= np.sign(np.linalg.det(matrix[:, :3])) * -1.0  # a mirror
    tree = some_tree(rng, 3)
    scene, moved = scene_of(tree), scene_of(moved_node(tree, matrix))
    rays = lines_through(scene)
    there = Rays.from_arrays(
        rays.origins @ matrix[:, :3].T + matrix[:, 3], rays.directions @ matrix[:, :3].T
    )
    here, gone = hits_of(scene, rays), hits_of(moved, there)
    both = np.isfinite(here.t) & np.isfinite(gone.t)
    assert both.sum() > 500
    assert (np.isfinite(here.t) != np.isfinite(gone.t)).mean() < 2e-3
    assert np.isclose(here.t[both], gone.t[both], rtol=1e-9).mean() > 0.998


# ---------------------------------------------------------------------------------- closed meshes


def test_a_mesh_is_the_box_it_is_drawn_as(hits_of):
    """Along edges and diagonals of its triangles too: no ray passes through between two."""
    rng = np.random.default_rng(4)
    for _ in range(5):
        low, high = -rng.integers(1, 4, 3), rng.integers(1, 4, 3)
        ball = Sphere(rng.normal(size=3), 1.5)
        box, mesh = Box(low, high), box_mesh(low, high)
        exact, drawn = (scene_of(Difference([each, ball])) for each in (box, mesh))
        rays = awkward_rays(exact, 400)
        one, two = hits_of(exact, rays), hits_of(drawn, rays)
        # Whether a ray that starts in a side has left the side behind it, rounding decides.
        chosen = ~((rays.origins == low) | (rays.origins == high)).any(axis=1)
        assert chosen.sum() > 2000
        np.testing.assert_allclose(one.t[chosen], two.t[chosen], rtol=1e-9, atol=1e-9)


def test_crossings_of_a_closed_mesh_are_even_whatever_the_line(hits_of):
    """A ball of triangles in a box: through vertices, along edges, in planes, from very far away.

    If a crossing was lost or counted twice, a line would leave the ball behind it, and be in the
    box around it where it is in the ball.
    """
    ball = mesh_of_triangles(icosphere(2))
    corners = ball.vertices[ball.triangles]
    rng = np.random.default_rng(5)
    pick = corners[rng.integers(len(corners), size=2000)]
    share = rng.choice([0.0, 0.5, 0.25], size=(2000, 1))
    on_edges = pick[:, 0] + share * (pick[:, 1] - pick[:, 0])
    other = corners[rng.integers(len(corners), size=2000), 1]
    axis = np.eye(3)[rng.integers(3, size=2000)]
    families = [
        (on_edges - 5 * axis, axis), (3 * other, on_edges - 3 * other),
        (pick[:, 0] - 3 * (pick[:, 1] - pick[:, 0]), pick[:, 1] - pick[:, 0]),
        (1e6 * other, on_edges - 1e6 * other),
    ]  # fmt: skip
    origins, directions = (np.concatenate(each) for each in zip(*families, strict=True))
    # Behind the ball along the line: outside of it, and so in what it is taken from.
    ends = (
        origins
        + 2.0
        * (np.abs(origins).max(axis=1) / np.abs(directions).max(axis=1) + 2.0)[:, None]
        * directions
    )
    rays = Rays.from_arrays(ends, directions)
    shell = scene_of(Difference([Box((-1e8, -1e8, -1e8), (1e8, 1e8, 1e8)), ball]))
    hits = hits_of(shell, rays)
    assert (hits.primitive == 0).all()  # the box's far side, and no triangle of the ball


@pytest.mark.parametrize(
    ("taken", "what"),
    [
        (1, "3 of its 30 edges have"),
        (20, "has no faces"),
    ],
)
def test_open_meshes_are_refused(taken, what):
    mesh = mesh_of_triangles(icosphere(0))
    with pytest.raises(InputError, match=what):
        scene_of(ClosedMesh(mesh.vertices, mesh.triangles[taken:]))


def test_other_leaves_without_an_inside_are_refused():
    triangle = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
    for leaf, what in (
        (Disc((0, 0, 0), (0, 0, 1), 1), "disc"),
        (Polygon(triangle), "polygon"),
        (Triangle(triangle), "triangle"),
        (Cone((0, 0, 0), (0, 0, 1), 1, 1, False), "cone without its ends"),
    ):
        with pytest.raises(InputError, match=f"item 1: a {what} has no inside"):
            scene_of(CUBE, Difference([CUBE, leaf]))
    with pytest.raises(InputError, match="has no operands"):
        scene_of(Union([]))


# ---------------------------------------------------------------------------- beside other items


def test_plain_items_are_hit_as_in_any_other_scene(hits_of):
    """Solids and surfaces beside trees: bit for bit those of a scene without any."""
    rng = np.random.default_rng(6)
    plain = [BALL, Disc((0, 0, 2), (0, 1, 1), 1.0), Cone((2, 0, 0), (2, 2, 0), 1, 0, False)]
    corners = rng.normal(size=(20, 3, 3))
    far = Difference([Box((50, 50, 50), (51, 51, 51)), Sphere((50, 50, 50), 0.5)])
    beside = Scene.from_trees([*plain, mixed_of_triangles(corners), far], "beside")
    alone = Scene.from_items([*plain, *map(Triangle, corners)], "alone")
    rays = lines_through(alone)
    one, two = hits_of(beside, rays), hits_of(alone, rays)
    assert (two.primitive >= 0).sum() > 1000
    np.testing.assert_array_equal(one.primitive, two.primitive)
    np.testing.assert_allclose(one.t, two.t, rtol=1e-13)


def test_primitives_have_objects_and_materials(hits_of):
    mesh = mesh_of_triangles(icosphere(0))
    scene = Scene.from_trees(
        [Difference([CUBE, BALL]), Difference([Box((3, -1, -1), (5, 1, 1)), mesh])], "two",
        object_names=("first", "second"), material_ids=np.array([5, 6, 7, 8]),
    )  # fmt: skip
    every = np.arange(scene.geometry.n_primitives)
    assert scene.objects_of(every).tolist() == [0, 0] + [1] * 21
    assert scene.materials_of(every).tolist() == [5, 6, 7] + [8] * 20
    assert scene.object_of(4) == ("second", 2)
    assert scene.objects_of(np.array([-1])).tolist() == [-1]


# --------------------------------------------------------------------------- what changes no hit


BOUNDS = [(CUT, "aabb"), (UPWARD, "aabb"), (CUT, "kdop14"), (CUT, "sphere"), (CUT, "obb")]


@pytest.mark.parametrize(
    ("bounds", "volume"),
    [
        *BOUNDS,
        *(
            pytest.param(bounds, volume, marks=pytest.mark.exhaustive)
            for bounds in (CUT, UPWARD)
            for volume in ("aabb", "kdop14", "kdop18", "kdop26", "sphere", "obb")
            if (bounds, volume) not in BOUNDS
        ),
    ],
)
def test_cutting_changes_no_hit(hits_of, bounds, volume):
    rng = np.random.default_rng(8)
    for seed in range(15):
        trees = [some_tree(rng, int(rng.integers(1, 6))) for _ in range(3)]
        scene = scene_of(*trees, csg_bounds=NONE)
        rays = awkward_rays(scene, 200, seed)
        want = hits_of(scene, rays, "naive")
        cut = scene.with_cutting(CuttingSettings(bounds, volume))
        got = hits_of(cut, rays, "naive")
        assert same(want, got).all()


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("bvh", ""),
        *(
            pytest.param(*case, marks=pytest.mark.exhaustive)  # each compiles a walk of its own
            for case in (
                ("bvh", "volume=obb"), ("bvh", "arity=4"), ("grid", ""), ("macro_grid", ""),
                ("octree", ""), ("kdtree", ""), ("bsp", ""), ("sorted_volumes", ""),
                ("routed", ""),
            )
        ),
    ],
)  # fmt: skip
def test_every_structure_has_the_hits_of_naive(build, name, text):
    rng = np.random.default_rng(7)
    trees = [
        moved_node(some_tree(rng, int(rng.integers(4))), np.column_stack([np.eye(3), at]))
        for at in 4 * rng.normal(size=(30, 3))
    ]
    corners = 4 * rng.normal(size=(50, 1, 3)) + rng.normal(size=(50, 3, 3))
    scene = Scene.from_trees([*trees, mixed_of_triangles(corners)], "many")
    rays = awkward_rays(scene, 300)
    structure = build(name, scene, text)
    assert structure.validate() == []
    want = build("naive", scene).trace(rays)[0]
    hits, counts = structure.trace(rays)
    assert same(want, hits).all()
    for index in range(0, len(rays), 500):
        values = {name: int(each[index]) for name, each in counts.by_name().items()}
        assert structure.record(rays, index).tally() == values


def test_instances_of_trees_and_their_pieces_are_refused(build):
    scene = scene_of(Difference([CUBE, BALL]))
    with pytest.raises(InputError, match="trees of solids"):
        build("bvh", scene, "builder=sbvh")
