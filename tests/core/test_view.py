"""Pictures: lines and translucent faces lie where a projection says, before and behind the mesh."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.evaluation.pages import view as view_module
from accelscope.core.evaluation.pages.picture_cameras import HEIGHT, MARGIN, WIDTH, camera_around
from accelscope.core.evaluation.pages.view import View
from accelscope.core.scene import Camera, Scene
from accelscope.core.scene.camera_rays import camera_axes

WALL = np.array([[[-9, 0, -9], [0, 0, -9], [0, 0, 9]], [[-9, 0, -9], [0, 0, 9], [-9, 0, 9]]], float)
"""Across the left half of the picture, five units from the camera."""

RED, BLUE = np.array([1.0, 0, 0]), np.array([0, 0, 1.0])
FOCAL = HEIGHT / 2 / np.tan(np.radians(30.0))
"""Pixels of the finished picture per unit, one unit from the camera."""


@pytest.fixture(scope="module")
def view():
    """Look along +y at the wall."""
    camera = Camera(np.array([0.0, -5, 0]), np.zeros(3), np.array([0.0, 0, 1]), 60.0)
    return View(Scene.from_triangles(WALL, "wall", camera=camera))


def quad(a, b, c, d):
    corners = np.array([a, b, c, d], dtype=float)
    return corners[[(0, 1, 2), (0, 2, 3)]]


def upright(x0, x1, z0, z1, y):
    """Return a rectangle that faces the camera."""
    return quad((x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1))


def small(image):
    """Return one subpixel of each pixel."""
    return image[::2, ::2]


# Where the middle of each pixel looks to, one unit from the camera.
Z = (HEIGHT / 2 - 0.5 - np.arange(HEIGHT)[:, None]) / FOCAL
X = (np.arange(WIDTH)[None] + 0.5 - WIDTH / 2) / FOCAL


def test_a_face_covers_the_pixels_of_its_projection(view):
    picture = small(view.with_faces(upright(-0.5, 1.0, -0.3, 0.7, -1.0), RED, 0.25))
    inside = (X > -0.5 / 4) & (X < 1.0 / 4) & (Z > -0.3 / 4) & (Z < 0.7 / 4)
    expected = np.where(inside[..., None], 0.75 * small(view.image) + 0.25 * RED, small(view.image))
    np.testing.assert_allclose(picture, expected, atol=1e-12)
    assert inside.sum() > 10_000


def test_the_mesh_hides_faces_behind_it(view):
    picture = small(view.with_faces(upright(-1, 1, -1, 1, 1.0), RED, 0.25))
    changed = (picture != small(view.image)).any(axis=2)
    inside = (abs(X) < 1 / 6) & (abs(Z) < 1 / 6) & (X > 0)
    np.testing.assert_array_equal(changed, inside)


def test_faces_mix_in_any_order(view):
    faces = np.concatenate([upright(-1, 1, -1, 1, -1.0), upright(-1, 1, -1, 1, -2.0)])
    colours = np.repeat([RED, BLUE], 2, axis=0)
    picture = view.with_faces(faces, colours, 0.5)
    np.testing.assert_allclose(
        picture[HEIGHT, WIDTH - 10], 0.25 * view.image[HEIGHT, WIDTH - 10] + 0.75 * (RED + BLUE) / 2
    )
    reverse = view.with_faces(faces[::-1], colours[::-1], 0.5)
    np.testing.assert_allclose(picture, reverse, atol=1e-12)


def test_faces_around_the_camera_are_cut_off(view):
    # A floor one unit below the camera, from far behind it to the wall.
    floor = quad((-2, -90, -1), (2, -90, -1), (2, 0, -1), (-2, 0, -1))
    changed = (small(view.with_faces(floor, RED, 0.25)) != small(view.image)).any(axis=2)
    depth = np.divide(-1.0, Z, out=np.full_like(Z, np.inf), where=Z < 0)
    inside = (depth < 5.0) & (abs(X * np.where(np.isfinite(depth), depth, 0.0)) < 2.0)
    assert (changed != inside).mean() < 1e-4
    assert inside.mean() > 0.2
    behind = upright(-1, 1, -1, 1, -9.0)
    np.testing.assert_array_equal(view.with_faces(behind, RED, 0.25), view.image)


def test_faces_in_small_portions(view, monkeypatch):
    rng = np.random.default_rng(2)
    faces = rng.uniform(-1, 1, (50, 3, 3))
    whole = view.with_faces(faces, RED, 0.1)
    monkeypatch.setattr(view_module, "PIXELS_AT_ONCE", 1000)
    np.testing.assert_allclose(view.with_faces(faces, RED, 0.1), whole, atol=1e-12)


def test_no_faces_and_no_lines(view):
    np.testing.assert_array_equal(view.with_faces(np.zeros((0, 3, 3)), RED, 0.5), view.image)
    picture = view.with_lines(np.zeros((0, 2, 3)), np.zeros((0, 3)))
    assert picture.shape == (HEIGHT, WIDTH, 3)


def line(view, colour, y=-1.0, **options):
    """Return the picture with a line across its middle."""
    segment = np.array([[[-1.0, y, 0], [1.0, y, 0]]])
    return view.with_lines(segment, np.array([colour], dtype=float), **options)


def ink(picture, column):
    """Return how much of a column of pixels is red, in pixels."""
    return (picture[:, column, 0] - picture[:, column, 1]).sum()


@pytest.mark.parametrize("width", [1, 2, 3])
def test_lines_are_as_wide_as_asked(view, width):
    picture = line(view, RED, width=width)
    plain = line(view, (*RED, 0.0))
    for column in (WIDTH // 2 - 50, WIDTH // 2 + 50):
        added = plain[:, column, 1] - picture[:, column, 1]
        assert added.sum() / plain[HEIGHT // 2, column, 1] == pytest.approx(width, abs=1e-9)


def test_lines_behind_the_mesh_are_faint(view):
    for hidden in (0.2, 0.5):
        picture = line(view, RED, y=1.0, hidden=hidden)
        assert ink(picture, WIDTH // 2 + 50) == pytest.approx(1.0, abs=0.02)
        assert ink(picture, WIDTH // 2 - 50) == pytest.approx(hidden, abs=0.02)


def test_of_coinciding_lines_the_last_is_seen(view):
    segments = np.array([[[-1, -1, 0.1], [1, -1, 0.1]]] * 3, dtype=float)
    segments[1] = segments[1, ::-1]
    picture = view.with_lines(segments, np.array([BLUE, BLUE, RED]))
    assert ink(picture, WIDTH // 2 + 50) == pytest.approx(1.0, abs=0.02)


def test_of_crossing_lines_the_nearer_is_seen(view):
    segments = np.array([[[-1, -1, 0], [1, -1, 0]], [[-1, -0.5, 0], [1, -0.5, 0]]], dtype=float)
    picture = view.with_lines(segments, np.array([RED, BLUE]))
    assert ink(picture, WIDTH // 2 + 50) == pytest.approx(1.0, abs=0.02)


def test_lines_over_faces(view):
    over = view.with_faces(upright(-1, 1, -1, 1, -1.0), BLUE, 0.5)
    picture = line(view, RED, over=over)
    np.testing.assert_allclose(picture[HEIGHT // 2 + 30, WIDTH // 2 + 50], over[HEIGHT + 60, WIDTH])


def test_a_camera_around_points_just_sees_them():
    rng = np.random.default_rng(3)
    for _ in range(20):
        points = rng.normal(size=(40, 3)) * rng.uniform(0.01, 10, 3) + rng.normal(size=3) * 30
        looking = Camera(np.zeros(3), rng.normal(size=3), np.array([0.0, 0, 1]), 50.0)
        camera = camera_around(looking, points)
        forward, right, up = camera_axes(camera)
        np.testing.assert_allclose(forward, camera_axes(looking)[0], atol=1e-12)
        x, y, z = ((points - camera.position) @ axis for axis in (right, up, forward))
        half = np.tan(np.radians(25.0))
        sides = np.array([x / z, -x / z, y / z * WIDTH / HEIGHT, -y / z * WIDTH / HEIGHT]) / half
        assert z.min() > 0
        reached = sides.max(axis=1)
        assert reached.max() < MARGIN * (1 + 1e-9)
        # Left and right are touched, or top and bottom.
        both = reached.reshape(2, 2).min(axis=1).max()
        assert both == pytest.approx(MARGIN, rel=1e-9)


def test_a_camera_around_one_point_looks_at_it():
    looking = Camera(np.zeros(3), np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), 50.0)
    camera = camera_around(looking, np.array([[3.0, 4, 5]]))
    ahead = np.array([3.0, 4, 5]) - camera.position
    np.testing.assert_allclose(ahead / np.linalg.norm(ahead), [1, 0, 0], atol=1e-12)


def test_what_is_seen(view):
    depth, slope = 4.0, np.tan(np.radians(30.0))
    y = depth - 5.0
    assert view.sees(np.array([[1.32 * depth * slope, y, 0], [0, y, 0.99 * depth * slope]]))
    for point in ([1.34 * depth * slope, y, 0], [0, y, 1.01 * depth * slope], [0, -6, 0]):
        assert not view.sees(np.array([point]))


def test_smaller_pictures(view):
    small_view = View(Scene.from_triangles(WALL, "wall"), view.camera, reduction=4.0)
    picture = line(small_view, RED)
    assert picture.shape == (HEIGHT // 4, WIDTH // 4, 3)
    faces = small_view.with_faces(upright(-1, 1, -1, 1, -1.0), RED, 0.25)
    assert faces.shape == (HEIGHT // 2, WIDTH // 2, 3)
