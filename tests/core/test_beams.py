"""Beams: pieces that add up, that are what rays see, and closed forms of what is seen."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.solids.description import Polygon, Sphere
from accelscope.core.kernels import has_numba, plain
from accelscope.core.probes.beam import beam_through, camera_beam
from accelscope.core.probes.beam_picture import coverage, seen_at_centres, share_of
from accelscope.core.probes.polygonal import polygonal
from accelscope.core.probes.visible import MISS, visible
from accelscope.core.scene import ORTHOGRAPHIC, Camera, Scene
from accelscope.core.scene.camera_rays import camera_rays, window_of
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample
from beam_scenes import (
    HEIGHT,
    NAMES,
    TREES,
    WIDTH,
    by_item,
    camera_at,
    looked_at,
    prepared,
    scene_named,
    square,
)


def seen(items, camera=None, **settings):
    """What the beam of a camera sees of some items."""
    scene = Scene.from_items(items, "made")
    beam = camera_beam(camera or camera_at(), 1, 1)
    return beam, visible(polygonal(scene), beam)


@pytest.mark.parametrize("tree", TREES)
@pytest.mark.parametrize("name", NAMES)
def test_pieces_are_convex_and_add_up_to_the_beam(name, tree):
    beam, pieces = looked_at(name, tree)
    assert abs(pieces.areas.sum() - beam.area) <= 1e-12 * beam.area
    assert (pieces.areas > 0.0).all()
    for piece in range(len(pieces.items)):
        corners = pieces.corners(piece)
        edges = np.roll(corners, -1, axis=0) - corners
        after = np.roll(edges, -1, axis=0)
        turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
        assert (turns >= -1e-13).all()


@pytest.mark.parametrize("name", NAMES)
def test_no_two_pieces_overlap(name):
    """A point at random lies in one piece, in whichever order pieces are looked at."""
    beam, pieces = looked_at(name)
    (window,) = beam.windows
    points = window[0] + np.random.default_rng(1).random((2000, 2)) * (window[2] - window[0])
    inside = np.zeros(len(points), int)
    for piece in range(len(pieces.items)):
        corners = pieces.corners(piece)
        after = np.roll(corners, -1, axis=0)
        edges, seen_from = after - corners, points[:, None] - corners
        h = edges[:, 0] * seen_from[..., 1] - edges[:, 1] * seen_from[..., 0]
        inside += (h > 0.0).all(axis=1)
    assert (inside == 1).all()


@pytest.mark.parametrize("name", [name for name in NAMES if name != "apex"])
def test_the_picture_is_that_of_rays_at_the_centres_of_pixels(name):
    """At all of them; few lie on a border, where a ray is asked."""
    scene, (_, pieces) = scene_named(name), looked_at(name)
    got = seen_at_centres(prepared(name), pieces, scene.camera, WIDTH, HEIGHT)
    naive = structure_named("naive")
    hits, _ = naive.build(scene, naive.Settings()).trace(camera_rays(scene.camera, WIDTH, HEIGHT))
    expected = hits.primitive.reshape(HEIGHT, WIDTH)
    np.testing.assert_array_equal(got.items, expected)
    assert got.is_asked.mean() < 0.06
    assert len(np.unique(expected)) > 2


@pytest.mark.parametrize("tree", [tree for tree in TREES if tree != "autopartition"])
@pytest.mark.parametrize("name", NAMES)
def test_what_is_seen_does_not_depend_on_the_tree(name, tree):
    count = len(scene_named(name))
    (beam, expected), (_, pieces) = looked_at(name), looked_at(name, tree)
    np.testing.assert_allclose(
        by_item(pieces, count), by_item(expected, count), rtol=0, atol=1e-11 * beam.area
    )
    window = window_of(scene_named(name).camera, WIDTH, HEIGHT)
    for item in np.unique(expected.items):
        maps = [share_of(each, [item], window, WIDTH, HEIGHT) for each in (pieces, expected)]
        np.testing.assert_allclose(*maps, rtol=0, atol=1e-10)


def test_a_square_before_the_eye_has_the_area_of_its_image():
    beam, pieces = seen([square(1.0)])
    # At 5 units it is 2 / 5 wide in the window.
    assert by_item(pieces, 1) == pytest.approx([beam.area - 0.16, 0.16], rel=1e-14)


def test_what_is_behind_the_eye_is_not_seen():
    beam, pieces = seen([square(9.0, 5.0 + 1e-3), square(9.0, 7.0)])
    assert by_item(pieces, 2).tolist() == [beam.area, 0.0, 0.0]


def test_a_floor_that_reaches_behind_the_eye_is_seen_up_to_its_far_end():
    # One unit below the eye, from 3 units behind it to 10 before it, wider than the view.
    floor = Polygon(
        [(-99.0, -1.0, 8.0), (99.0, -1.0, 8.0), (99.0, -1.0, -5.0), (-99.0, -1.0, -5.0)]
    )
    beam, pieces = seen([floor])
    half = np.tan(np.radians(25.0))
    expected = 2.0 * half * (half - 1.0 / 10.0)  # y from -half to -1 / 10
    assert by_item(pieces, 1)[1] == pytest.approx(expected, rel=1e-14)
    assert pieces.areas.sum() == pytest.approx(beam.area, rel=1e-14)


def test_of_two_in_one_plane_the_lower_number_is_seen():
    for order in ([square(1.0), square(1.0, x=1.0)], [square(1.0, x=1.0), square(1.0)]):
        _, pieces = seen([*order, square(1.0)])
        # In the window they are 0.4 wide and overlap by half.
        assert by_item(pieces, 3)[1:] == pytest.approx([0.16, 0.08, 0.0], rel=1e-14)


def test_between_two_that_touch_nothing_is_seen():
    beam, pieces = seen([square(2.0, 0.0, -2.0), square(2.0, 0.0, 2.0), square(4.0, -1.0)])
    areas = by_item(pieces, 3)
    half = np.tan(np.radians(25.0))
    assert areas[1] == areas[2] == pytest.approx(0.8 * half, rel=1e-14)
    assert pieces.areas.sum() == pytest.approx(beam.area, rel=1e-14)


def test_a_cycle_is_cut_so_that_three_equal_bars_are_equally_seen():
    _, pieces = looked_at("cycle")
    areas = by_item(pieces, 4)[1:4]
    np.testing.assert_allclose(areas, areas[0], rtol=1e-13)
    _, alone = seen([scene_item("cycle", 0)])
    assert areas[0] < 0.999 * by_item(alone, 1)[1]


def scene_item(name, number):
    geometry = scene_named(name).geometry
    first, size = geometry.first[number], geometry.size[number]
    return Polygon(geometry.points[first : first + size])


def test_crossing_squares_are_seen_to_where_they_cross():
    # One across the view, one that comes through it along x = 0.25, aslant.
    through = Polygon(
        [(-0.75, -9.0, -1.0), (-0.75, 9.0, -1.0), (1.25, 9.0, 1.0), (1.25, -9.0, 1.0)]
    )
    beam, pieces = seen([square(9.0), through])
    half = np.tan(np.radians(25.0))
    # From x = 0.25 at z = 0 to x = 1.25 at z = 1, at distances of 5 and 4.
    expected = 2.0 * half * (1.25 / 4.0 - 0.25 / 5.0)
    assert by_item(pieces, 2)[1:] == pytest.approx([beam.area - expected, expected], rel=1e-13)


def test_a_polygon_whose_plane_passes_through_the_eye_covers_nothing():
    beam, pieces = looked_at("apex")
    areas = by_item(pieces, 6)
    assert areas[[1, 3, 4, 6]].tolist() == [0.0, 0.0, 0.0, 0.0]
    # One that lies 1e-9 above the eye hides all that is higher, but for a strip at its far edge,
    # of the square a half.
    assert areas[2] == pytest.approx(0.5 * beam.area, rel=1e-9)
    # And what is seen of the square in that strip, 1e-9 in 1.
    assert areas[5] == pytest.approx(0.5 * (2.0 / 6.0) ** 2, rel=2e-9)


def test_hollow_polygons_are_seen_as_they_are():
    _, pieces = seen([scene_item("hollow", 0)])
    assert by_item(pieces, 1)[1] == pytest.approx(3.0 / 25.0, rel=1e-14)


def test_what_hides_everything_ends_the_beam():
    """Behind a wall nothing is clipped: there are as many pieces as without what is there."""
    many = [square(0.3, -z, 0.1 * z) for z in range(1, 20)]
    _, pieces = seen([square(9.0), *many])
    assert set(pieces.items.tolist()) == {0}


def test_a_beam_through_a_polygon_sees_what_lies_in_it():
    apex, corners = np.array([0.3, -0.2, 4.0]), np.array(square(1.0).corners)
    beam = beam_through(apex, corners)
    pieces = visible(polygonal(Scene.from_items([square(1.0), square(9.0, -1.0)], "two")), beam)
    # All of it, but for what rounding leaves at its sides.
    assert by_item(pieces, 2) == pytest.approx([0.0, beam.area, 0.0], abs=1e-12)
    with pytest.raises(InputError, match="wholly on one side of its apex"):
        beam_through(np.zeros(3), np.array([(1.0, 0, 0), (-1.0, 1, 0), (0, -1.0, 0)]))


@pytest.mark.parametrize("name", NAMES)
def test_coverage_is_of_exact_areas(name):
    scene, (beam, pieces) = scene_named(name), looked_at(name)
    window = window_of(scene.camera, WIDTH, HEIGHT)
    ones = coverage(pieces, np.ones((len(pieces.items), 1)), window, WIDTH, HEIGHT)
    np.testing.assert_allclose(ones, 1.0, rtol=0, atol=1e-11)
    pixel = beam.area / (WIDTH * HEIGHT)
    for item in np.unique(pieces.items):
        share = share_of(pieces, [item], window, WIDTH, HEIGHT)
        assert share.sum() * pixel == pytest.approx(pieces.areas[pieces.items == item].sum())
        assert share.min() >= 0.0


def test_an_edge_covers_of_a_pixel_what_is_on_its_side():
    """A half plane, aslant, over one pixel: the closed form of what is left of a unit square."""
    # The pixel's half width at 5 units; the edge goes through (0, h) and (w, 0) of the pixel.
    half = 5.0 * np.tan(np.radians(25.0))
    for w, h in ((1.0, 0.5), (0.25, 0.75), (0.9, 0.9)):
        below = np.array([(-1, -1), (2 * w - 1, -1), (-1, 2 * h - 1)]) * half
        _, pieces = seen([Polygon(np.column_stack([below, np.zeros(3)]))])
        window = window_of(camera_at(), 1, 1)
        share = share_of(pieces, [0], window, 1, 1)
        assert share[0, 0] == pytest.approx(0.5 * w * h, rel=1e-12)


def test_coverage_is_within_the_error_of_256_rays_a_pixel():
    scene, (_, pieces) = scene_named("room"), looked_at("room")
    columns, rows, side = 15, 11, 16
    naive = structure_named("bvh")
    rays = camera_rays(scene.camera, columns * side, rows * side)
    hits, _ = naive.build(scene, naive.Settings()).trace(rays)
    # The window is that of the finer picture, whose sides are as one to the other the same.
    window = window_of(scene.camera, columns, rows)
    pieces = visible(prepared("room"), camera_beam(scene.camera, columns, rows))
    found = hits.primitive.reshape(rows, side, columns, side)
    for item in np.unique(pieces.items):
        exact = share_of(pieces, [item], window, columns, rows)
        sampled = (found == item).mean(axis=(1, 3))
        # On a grid of 16 x 16 a straight edge is off by half a sample in each row at most.
        assert np.abs(sampled - exact).max() <= 2.0 / side
        inner = (exact == 0.0) | (exact >= 1.0 - 1e-12)
        assert np.array_equal(sampled[inner], np.round(exact[inner]))
        assert abs((sampled - exact).mean()) < 0.002


@pytest.mark.skipif(not has_numba(), reason="there is nothing to compare with")
@pytest.mark.parametrize("name", ["room", "mess"])
def test_plain_python_gives_the_same_bits(name):
    beam, expected = looked_at(name)
    with plain(True):
        pieces = visible(prepared(name), beam)
    for column, right in zip(pieces, expected, strict=True):
        np.testing.assert_array_equal(column, right)


def test_instances_are_looked_at_as_the_triangles_they_are():
    scene = make_sample("overlapping:spheres=3,segments=5")
    assert len(polygonal(scene).convex.items) == len(scene.flat())


def test_refusals():
    ball = Scene.from_items([square(1.0), Sphere((0.0, 0.0, 0.0), 1.0)], "ball")
    with pytest.raises(InputError, match="beams meet flat polygons only, and ball holds other"):
        polygonal(ball)
    flat = Camera(np.zeros(3), np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0]), 50.0)
    flat = Camera(flat.position, flat.target, flat.up, 50.0, kind=ORTHOGRAPHIC)
    with pytest.raises(InputError, match="a beam has an apex, which the orthographic camera has"):
        camera_beam(flat, 4, 3)


def test_miss_is_seen_where_there_is_nothing():
    _, pieces = seen([square(1.0)])
    assert MISS in pieces.items
    assert len(pieces.of(MISS)) == (pieces.items == MISS).sum()
