"""Beam trees: mirrors are exact, refraction is where it says so, and all pieces add up."""

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.geometry.solids.description import Polygon
from accelscope.core.probes.beam import (
    EYE,
    MIRRORED,
    REFRACTED,
    Beam,
    camera_beam,
    refracted_beam,
    scaled_along,
)
from accelscope.core.probes.beam_picture import colours_of, picture_of_tree, share_of
from accelscope.core.probes.beam_tree import NOBODY, beam_tree, onward
from accelscope.core.probes.polygonal import polygonal
from accelscope.core.probes.visible import MISS, visible
from accelscope.core.scene import Scene, point_lights
from accelscope.core.scene.camera_rays import window_of
from accelscope.core.scene.material import Material
from accelscope.core.scene.whitted.optics import mirrored, refracted
from accelscope.core.scene.whitted.shading import Surfacing
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample
from beam_scenes import HEIGHT, TREES, WIDTH, by_item, camera_at, square

MATT = Material("matt", (0.5, 0.4, 0.3))
MIRROR = Material("mirror", (0.0, 0.0, 0.0), diffuse=0.0, specular=0.75)
GLASS = Material(
    "glass", (0.0, 0.0, 0.0), diffuse=0.0, specular=0.1, transmission=0.9, index_of_refraction=1.5
)


def made(items, materials, camera=None):
    """A scene whose items have materials of their own."""
    scene = Scene.from_items(items, "made", materials=materials, material_ids=np.arange(len(items)))
    return dataclasses.replace(scene, camera=camera or camera_at())


@functools.cache
def tree_of(spec, depth, tree="autopartition"):
    scene = make_sample(spec)
    prepared = polygonal(scene, TREES[tree])
    return prepared, beam_tree(prepared, camera_beam(scene.camera, WIDTH, HEIGHT), depth)


@pytest.mark.parametrize("spec", ["room", "facade:floors=2,bays=3"])
def test_the_pieces_of_every_beam_add_up_to_it(spec):
    _, nodes = tree_of(spec, 4)
    assert [nodes[0].kind, nodes[0].parent, nodes[0].depth] == [EYE, NOBODY, 1]
    assert len(nodes) > 1
    for number, node in enumerate(nodes):
        assert abs(node.pieces.areas.sum() - node.beam.area) <= 1e-9 * node.beam.area
        if number:
            parent = nodes[node.parent]
            assert node.depth == parent.depth + 1 <= 4
            seen = parent.pieces.areas[parent.pieces.items == node.item].sum()
            assert node.beam.area == pytest.approx(seen, rel=1e-12)
            # Nothing is seen in a mirror that lies in its plane or behind it.
            assert node.item not in node.pieces.items


@pytest.mark.parametrize("tree", TREES)
def test_what_is_seen_in_a_mirror_is_the_mirrored_scene(tree):
    """Seen by the eye through the mirror, as through a window."""
    scene, (eye, *others) = tree_of("room:mirrors=2", 2, tree)
    geometry = scene.scene.geometry
    loops = np.split(geometry.points, geometry.first[1:])
    seen = set()
    assert len(others) == 2
    for node in others:
        matrix = scaled_along(scene.convex.planes[node.item], -1.0)
        mirror_images = [Polygon(loop @ matrix[:, :3].T + matrix[:, 3]) for loop in loops]
        there = polygonal(Scene.from_items(mirror_images, "mirrored"), TREES[tree])
        # The half-space before the mirror is mirrored as well.
        window = Beam(eye.beam.matrix, node.beam.windows, -node.beam.bounds)
        pieces = visible(there, window)
        seen |= set(pieces.items.tolist())
        np.testing.assert_allclose(
            by_item(node.pieces, len(loops)), by_item(pieces, len(loops)), rtol=0, atol=1e-13
        )
        # A mirrored polygon begins at another corner, so regions are cut elsewhere: of each
        # polygon all pieces together are the same, pixel by pixel.
        frame = window_of(scene.scene.camera, WIDTH, HEIGHT)
        for item in set(pieces.items.tolist()):
            maps = [share_of(each, [item], frame, WIDTH, HEIGHT) for each in (pieces, node.pieces)]
            np.testing.assert_allclose(*maps, rtol=0, atol=1e-9)
    assert len(seen) > 5


def piece_at(pieces, point, margin=1e-9):
    """The piece that a point lies in, none near a border."""
    for piece in range(len(pieces.items)):
        corners = pieces.corners(piece)
        edges = np.roll(corners, -1, axis=0) - corners
        sides = point - corners
        h = edges[:, 0] * sides[:, 1] - edges[:, 1] * sides[:, 0]
        if (h > margin * np.linalg.norm(edges, axis=1)).all():
            return piece
    return None


@pytest.mark.parametrize("spec", ["room", "facade:floors=2,bays=3"])
def test_reflected_rays_hit_what_mirrored_beams_see(spec):
    scene, nodes = tree_of(spec, 4)
    naive = structure_named("naive")
    truth = naive.build(scene.scene, naive.Settings())
    rng, looked = np.random.default_rng(2), 0
    for node in nodes[1:]:
        assert node.kind == MIRRORED
        for _ in range(12):
            window = node.beam.windows[rng.integers(len(node.beam.windows))]
            weights = rng.dirichlet(np.ones(len(window)))
            point = weights @ window
            piece = piece_at(node.pieces, point)
            if piece is None:
                continue
            # A ray along the whole chain of mirrors.
            chain = [node]
            while chain[0].parent != NOBODY:
                chain.insert(0, nodes[chain[0].parent])
            origin, direction = chain[0].beam.apex, chain[0].beam.directions(point[None])[0]
            for each in chain[1:]:
                plane = scene.convex.planes[each.item]
                t = (plane[3] - plane[:3] @ origin) / (plane[:3] @ direction)
                origin = origin + t * direction
                direction = mirrored(direction[None], plane[None, :3])[0]
            ray = Rays.from_arrays(origin[None], direction[None], t_min=1e-9)
            (hit,) = truth.trace(ray)[0].primitive
            assert hit == node.pieces.items[piece]
            looked += 1
    assert looked > 5


def test_between_two_mirrors_each_image_is_smaller():
    """Parallel squares 6 apart, the eye 2 before one: images at distances of 2, 8, 14, 20, ..."""
    camera = camera_at((0.0, 0.0, 2.0), (0.0, 0.0, 0.0), fov=60.0)
    scene = made([square(1.0), square(1.0, 6.0)], [MIRROR, MIRROR], camera)
    nodes = beam_tree(polygonal(scene), camera_beam(camera, 1, 1), depth=6)
    assert [node.item for node in nodes] == [MISS, 0, 1, 0, 1, 0]
    for k, node in enumerate(nodes):
        seen = by_item(node.pieces, 2)[1 + k % 2]
        assert seen == pytest.approx((2.0 / (2.0 + 6.0 * k)) ** 2, rel=1e-13)
        assert node.weight == pytest.approx(np.full(3, 0.75**k))
        # The apex is mirrored again and again.
        expected = [2.0, -2.0, 14.0, -14.0, 26.0, -26.0][k]
        assert node.beam.apex == pytest.approx([0.0, 0.0, expected], abs=1e-13)


def test_under_water_depths_are_three_quarters_straight_from_above():
    surface, stone = square(9.0), square(0.5, -4.0)
    water = dataclasses.replace(GLASS, index_of_refraction=4.0 / 3.0)
    nodes = beam_tree(polygonal(made([surface, stone], [water, MATT])), beam_of_eye(), depth=2)
    assert [node.kind for node in nodes] == [EYE, MIRRORED, REFRACTED]
    through = nodes[2]
    assert through.weight == pytest.approx(np.full(3, 0.9))
    assert by_item(through.pieces, 2)[2] == pytest.approx((1.0 / (5.0 + 3.0)) ** 2, rel=1e-13)


def beam_of_eye(camera=None):
    return camera_beam(camera or camera_at(), 1, 1)


@pytest.mark.parametrize("degrees", [5.0, 40.0, 75.0])
@pytest.mark.parametrize("ratio", [1.0 / 1.5, 1.2, 1.0])
def test_the_ray_in_the_middle_is_refracted_exactly(degrees, ratio):
    angle = np.radians(degrees)
    camera = camera_at((0.0, -np.sin(angle), np.cos(angle)), up=(1.0, 0.0, 0.3), fov=10.0)
    beam, plane = beam_of_eye(camera), np.array([0.0, 0.0, 1.0, 0.0])
    through = refracted_beam(beam, plane, beam.windows, ratio)
    along = beam.directions(np.zeros((1, 2)))
    along /= np.linalg.norm(along)
    expected, is_total = refracted(along, plane[None, :3], np.array([ratio]))
    assert (through is None) == is_total[0]
    if through is None:
        return
    got = through.directions(np.zeros((1, 2)))
    got /= np.linalg.norm(got)
    np.testing.assert_allclose(got, expected, rtol=0, atol=1e-13)
    # All rays go on from where they met the surface; beyond, others are off a little.
    corners = beam.windows[0]
    np.testing.assert_allclose(
        through.on_plane(corners, plane), beam.on_plane(corners, plane), rtol=0, atol=1e-13
    )
    assert (through.bounds == [[0.0, 0.0, -1.0, -0.0]]).all()


def test_what_cannot_get_out_is_reflected():
    """From below the surface, at 60 degrees: the sine is 1.3."""
    camera = camera_at((0.0, -3.0, -np.sqrt(3.0)), up=(1.0, 0.0, 0.0), fov=8.0)
    scene = polygonal(made([square(9.0), square(9.0, -5.0)], [GLASS, MATT], camera))
    (eye, *others) = beam_tree(scene, beam_of_eye(camera), depth=2)
    assert [node.kind for node in others] == [MIRRORED]
    assert others[0].weight == pytest.approx(np.ones(3))
    assert onward(scene, Surfacing.of(scene.scene), eye, 1) == []


def test_colours_are_those_of_flat_shading():
    """A light straight above the middle of a square, which fills the view."""
    scene = polygonal(made([square(9.0)], [MATT]))
    nodes = beam_tree(scene, beam_of_eye(), depth=1)
    lights = point_lights((0.0, 0.0, 3.0))
    # Ambient light and the source have an intensity of 1 / 2 each.
    right = np.array([0.5, 0.4, 0.3])
    np.testing.assert_allclose(colours_of(scene, nodes[0], lights), right[None], rtol=1e-14)
    window = window_of(camera_at(), 4, 4)
    picture = picture_of_tree(scene, nodes, lights, window, 4, 4)
    np.testing.assert_allclose(picture, np.broadcast_to(right, (4, 4, 3)), rtol=1e-12)


def test_the_facade_has_500_polygons_and_its_panes_mirror():
    scene = make_sample("facade")
    assert len(scene) == 500
    prepared = polygonal(scene)
    beam = camera_beam(scene.camera, 320, 240)
    nodes = beam_tree(prepared, beam, depth=2)
    pieces = nodes[0].pieces
    assert abs(pieces.areas.sum() - beam.area) <= 1e-12 * beam.area
    panes = np.flatnonzero(np.isin(scene.materials_of(np.arange(500)), [2]))
    assert len(panes) == 49
    assert {node.item for node in nodes[1:]} == set(panes) & set(pieces.items)
    for node in nodes[1:]:
        assert abs(node.pieces.areas.sum() - node.beam.area) <= 1e-9 * node.beam.area
