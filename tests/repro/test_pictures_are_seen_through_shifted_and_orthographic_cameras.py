"""Lines and faces lie over the mesh where a shifted or an orthographic camera sees them."""

import numpy as np
import pytest
from accelscope.core.evaluation.pages.picture_cameras import MARGIN, camera_around, picture_camera
from accelscope.core.evaluation.pages.view import View
from accelscope.core.scene import Camera, Scene
from accelscope.core.scene.camera_rays import camera_axes

EYE, UP = np.array([0.0, -5.0, 0.0]), np.array([0.0, 0.0, 1.0])
CAMERAS = {
    "shifted": Camera(EYE, np.zeros(3), UP, 60.0, shift=(0.2, -0.1)),
    "orthographic": Camera(EYE, np.zeros(3), UP, 0.0, kind="orthographic", scale=6.0),
    "shifted orthographic": Camera(
        EYE, np.zeros(3), UP, 0.0, kind="orthographic", scale=6.0, shift=(-0.1, 0.2)
    ),
}
RED = np.array([1.0, 0.0, 0.0])


def rectangle(x0, x1, z0, z1, y):
    corners = np.array([(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)], dtype=float)
    return corners[[(0, 1, 2), (0, 2, 3)]]


@pytest.mark.parametrize("name", CAMERAS)
@pytest.mark.parametrize("y", [-3.5, 1.0])
def test_a_face_just_before_the_mesh_covers_it(name, y):
    mesh = rectangle(-0.7, 0.9, -0.4, 1.1, y)
    view = View(Scene.from_triangles(mesh, "wall", camera=CAMERAS[name]))
    seen = np.isfinite(view.depth)
    assert 0.01 < seen.mean() < 0.6
    np.testing.assert_allclose(view.depth[seen], y + 5.0, rtol=1e-12)
    covered = (view.with_faces(mesh, RED, 0.5) != view.image).any(axis=2)
    # The rays sample every subpixel, faces every pixel: they differ in the border only.
    assert (covered != seen).sum() < 2 * (covered ^ np.roll(covered, 1, 0)).sum() + 2 * (
        covered ^ np.roll(covered, 1, 1)
    ).sum()
    rows, columns = np.nonzero(covered)
    mesh_rows, mesh_columns = np.nonzero(seen)
    for found, right in ((rows, mesh_rows), (columns, mesh_columns)):
        assert abs(found.min() - right.min()) <= 2
        assert abs(found.max() - right.max()) <= 2


@pytest.mark.parametrize("name", CAMERAS)
def test_points_of_the_mesh_lie_on_it_and_lines_through_them_are_drawn_there(name):
    wall = rectangle(-9, 9, -9, 9, 1.0)
    view = View(Scene.from_triangles(wall, "wall", camera=CAMERAS[name]))
    points, widths = view.points(3, 4)
    assert len(points) == 12
    np.testing.assert_allclose(points[:, 1], 1.0, atol=1e-12)
    assert view.sees(points)
    half = np.array([0.1, 0.0, 0.0])
    for point in points - (0, 0.01, 0):
        picture = view.with_lines(np.array([[point - half, point + half]]), RED[None], width=2)
        plain = view.with_lines(np.zeros((0, 2, 3)), np.zeros((0, 3)))
        rows, columns = np.nonzero((picture != plain).any(axis=2))
        column, row = view._pixels(*(np.array([(point - EYE) @ axis]) for axis in view.axes))
        assert columns.mean() == pytest.approx(column[0] / 2, abs=1.5)
        assert rows.mean() == pytest.approx(row[0] / 2, abs=1.5)
    # From border to border of the picture at that depth.
    left, right = points[0] - (widths[0], 0, 0), points[0] + (widths[0], 0, 0)
    assert not view.sees(left[None])
    assert not view.sees(right[None])


@pytest.mark.parametrize("name", CAMERAS)
def test_a_camera_around_points_just_sees_them(name):
    rng = np.random.default_rng(4)
    points = rng.normal(size=(30, 3)) * (3, 2, 1) + (50, 20, -7)
    camera = camera_around(CAMERAS[name], points)
    assert camera.kind == CAMERAS[name].kind
    np.testing.assert_allclose(camera_axes(camera)[0], (0, 1, 0), atol=1e-12)
    view = View(Scene.from_triangles(points.reshape(-1, 3, 3), "points"), camera)
    column, row = view._pixels(*((points - camera.position) @ axis for axis in view.axes))
    sides = np.abs([column / view.width - 0.5, row / view.height - 0.5]).max(axis=1)
    assert sides.max() == pytest.approx(MARGIN / 2, rel=1e-9)
    assert view.sees(points)


def test_the_picture_of_an_own_camera_is_not_mirrored_and_has_square_pixels():
    own = Camera(EYE, np.zeros(3), UP, 60.0, pixel_aspect=2.0, right=np.array([-1.0, 0, 0]))
    camera = picture_camera(Scene.from_triangles(rectangle(-1, 1, -1, 1, 0), "wall", camera=own))
    np.testing.assert_array_equal(camera_axes(camera)[1], (1, 0, 0))
    view = View(Scene.from_triangles(rectangle(-1, 1, -1, 1, 0), "wall"), camera)
    rows, columns = np.nonzero(np.isfinite(view.depth))
    assert np.ptp(rows) == np.ptp(columns)
