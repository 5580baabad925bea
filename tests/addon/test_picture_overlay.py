"""The picture of a lesson in a viewport: labels find room, faces and lines their places."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
gpu = pytest.importorskip("gpu")

from accelscope.addon.drawing import labels, picture_overlay, texts  # noqa: E402
from accelscope.addon.drawing.labels import Room  # noqa: E402
from accelscope.core.colours import luminance  # noqa: E402
from accelscope.core.lessons.picture import Image, Mark, Picture, Row  # noqa: E402
from mathutils import Matrix  # noqa: E402

pytestmark = pytest.mark.bpy

ROOM = Room(10.0, 20.0, 410.0, 320.0)


def overlap(one, other):
    return (
        one.left < other.right
        and other.left < one.right
        and one.bottom < other.top
        and other.bottom < one.top
    )


# ------------------------------------------------------------------------------------- labels


@pytest.mark.parametrize("seed", range(5))
def test_no_label_lies_on_another_or_outside(seed):
    rng = np.random.default_rng(seed)
    points = rng.uniform((0, 0), (420, 340), (60, 2))
    sizes = np.stack([rng.uniform(10, 90, 60), np.full(60, 12.0)], axis=1)
    taken = [Room(200.0, 20.0, 410.0, 120.0)]
    found = labels.place(points, sizes, ROOM, 6.0, taken)
    rooms = [each for each in found if each is not None]
    assert 10 < len(rooms) < 60
    for number, room in enumerate(rooms):
        assert ROOM.left <= room.left < room.right <= ROOM.right
        assert ROOM.bottom <= room.bottom < room.top <= ROOM.top
        assert not any(overlap(room, other) for other in rooms[:number] + taken)
    for room, (width, height) in zip(found, sizes, strict=True):
        if room is not None:
            np.testing.assert_allclose((room.right - room.left, room.top - room.bottom),
                                       (width, height))  # fmt: skip


def test_the_first_label_stands_at_the_right_of_its_point():
    (found,) = labels.place(np.array([[100.0, 100.0]]), np.array([[50.0, 10.0]]), ROOM, 6.0)
    assert found == (106.0, 95.0, 156.0, 105.0)
    # At the right edge there is no room but at the left.
    (found,) = labels.place(np.array([[400.0, 100.0]]), np.array([[50.0, 10.0]]), ROOM, 6.0)
    assert found.right <= 394.0 + 1e-9


def test_what_is_not_seen_has_no_label():
    points = np.array([[np.nan, np.nan], [0.0, 100.0], [100.0, 100.0]])
    found = labels.place(points, np.full((3, 2), 10.0), ROOM, 6.0)
    assert [each is None for each in found] == [True, True, False]


@pytest.mark.parametrize(
    ("y", "bottom"),
    [
        (100.0, 94.0),  # the last of three lines stands as one alone would
        (295.0, 280.0),  # as high as there is room
        (315.0, 280.0),
    ],
)
def test_a_column_stands_above_its_point_and_within_the_room(y, bottom):
    points, heights = np.array([[100.0, y], [np.nan, np.nan]]), np.array([40.0, 40.0])
    middles = labels.raised(points, heights, 12.0, ROOM.top)
    assert middles[0, 0] == 100.0
    assert np.isnan(middles[1]).all()
    sizes = np.stack([[50.0, 50.0], heights], axis=1)
    found, nowhere = labels.place(middles, sizes, ROOM, 6.0)
    assert nowhere is None
    assert found.left == 106.0
    assert (found.bottom, found.top) == (bottom, bottom + 40.0)


def test_points_behind_the_eye_have_no_place():
    projection = np.array([[1.5, 0, 0, 0], [0, 1.5, 0, 0], [0, 0, -1, -0.2], [0, 0, -1, 0]])
    found = labels.project(np.array([[0, 0, -2.0], [1, 0, -2], [0, 0, 2], [0, 0, 0]]),
                           projection, 200, 100)  # fmt: skip
    np.testing.assert_allclose(found[:2], [(100, 50), (175, 50)])
    assert np.isnan(found[2:]).all()


# ------------------------------------------------------------------------------------- colours


@pytest.mark.parametrize("behind", [(0.0, 0.0, 0.0), (0.24, 0.24, 0.24), (1.0, 1.0, 1.0)])
@pytest.mark.parametrize(
    "colour", [None, (0.03, 0.62, 0.93), (1.0, 0.57, 0.34), (0.96, 0.3, 0.4), (1, 1, 1), (0, 0, 0)]
)
def test_text_stands_out_from_any_background(behind, colour):
    screen = texts.Screen(12.0, behind)
    text = luminance(screen._legible(colour))
    assert abs(text - luminance(behind)) > 0.3


def test_a_long_caption_is_broken_into_lines():
    screen = texts.Screen(12.0, (0.0, 0.0, 0.0))
    text = "the cost of the tree is that of its nodes and of its leaves " * 4
    lines = screen.in_lines(text.strip(), 200.0)
    assert " ".join(lines) == text.strip()
    assert len(lines) > 3
    assert all(screen.size_of(line)[0] <= 200.0 for line in lines)


# ------------------------------------------------------------------------------------- drawing

SIZE = 200


@pytest.fixture(scope="module")
def offscreen():
    if bpy.app.version < (5, 2, 0):
        pytest.skip("Blender draws without a window from 5.2 on")
    gpu.init()
    yield gpu.types.GPUOffScreen(SIZE, SIZE)
    picture_overlay.hide()


def drawn(offscreen, picture, on_screen=False, is_bright=False, is_large=False, depth=1.0):
    """Return the picture over the background, (SIZE, SIZE, 3), lowest row first; x and z seen."""
    behind = (1.0, 1.0, 1.0) if is_bright else (0.0, 0.0, 0.0)
    shown = picture_overlay._Drawn(picture, "Heading")
    # Along y, so that from -1 to 1 is all that is seen.
    view = Matrix(((1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)))
    with offscreen.bind():
        frame_buffer = gpu.state.active_framebuffer_get()
        frame_buffer.clear(color=(*behind, 1.0), depth=depth)
        with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
            gpu.matrix.load_matrix(view)
            gpu.matrix.load_projection_matrix(Matrix.Diagonal((1.0, 1.0, -0.01, 1.0)))
            picture_overlay.draw_lines_and_faces(shown, 1.0, is_bright)
            if on_screen:
                scale = Matrix.Diagonal((2 / SIZE, 2 / SIZE, 1.0, 1.0))
                gpu.matrix.load_matrix(Matrix.Identity(4))
                gpu.matrix.load_projection_matrix(Matrix.Translation((-1.0, -1.0, 0.0)) @ scale)
                clip = np.array(Matrix.Diagonal((1.0, 1.0, -0.01, 1.0)) @ view)
                room = Room(0, 0, SIZE, SIZE)
                picture_overlay.draw_texts_and_images(
                    shown, clip, (SIZE, SIZE), room, 11.0, behind, is_large
                )
        buffer = gpu.types.Buffer("FLOAT", SIZE * SIZE * 4)
        frame_buffer.read_color(0, 0, SIZE, SIZE, 4, 0, "FLOAT", data=buffer)
    return np.array(buffer.to_list()).reshape(SIZE, SIZE, 4)[:, :, :3]


TRIANGLE = np.array([[[-0.5, 0.0, -0.5], [0.5, 0.0, -0.5], [-0.5, 0.0, 0.5]]])


def test_faces_have_their_colour_and_opacity(offscreen):
    picture = Picture("a", faces=TRIANGLE, face_colours=np.array([[1.0, 0.5, 0.25, 0.5]]))
    pixels = drawn(offscreen, picture)
    rows, columns = np.mgrid[:SIZE, :SIZE] + 0.5
    x, z = columns / (0.5 * SIZE) - 1.0, rows / (0.5 * SIZE) - 1.0
    inside = (x > -0.47) & (z > -0.47) & (x + z < -0.03)
    outside = (x < -0.53) | (z < -0.53) | (x + z > 0.03)
    half = np.broadcast_to((0.5, 0.25, 0.125), (inside.sum(), 3))
    np.testing.assert_allclose(pixels[inside], half, atol=0.01)
    assert pixels[outside].max() == 0.0


def test_what_is_hidden_shines_through_faintly(offscreen):
    segments = np.array([[[-0.8, 0.0, 0.0], [0.8, 0.0, 0.0]]])
    lines = Picture("a", segments, np.array([[1.0, 0.5, 0.25, 0.8]]))
    faces = Picture("a", faces=TRIANGLE, face_colours=np.array([[1.0, 0.5, 0.25, 0.8]]))
    place = SIZE // 2 - 1, SIZE // 2 - 20
    for picture, share in (
        (lines, picture_overlay.HIDDEN_OPACITY_OF_FEW), (faces, picture_overlay.HIDDEN_FACES)
    ):  # fmt: skip
        seen = drawn(offscreen, picture)[place]
        hidden = drawn(offscreen, picture, depth=0.0)[place]
        assert seen[0] > 0.5
        np.testing.assert_allclose(hidden, share * seen, atol=0.01)


def test_bright_lines_are_darker_on_a_bright_background(offscreen):
    segments = np.array([[[-0.8, 0.0, 0.0], [0.8, 0.0, 0.0]]])
    picture = Picture("a", segments, np.array([[1.0, 1.0, 0.2, 1.0]]))
    middle = drawn(offscreen, picture, is_bright=True)[SIZE // 2 - 2 : SIZE // 2 + 2, SIZE // 2]
    assert luminance(middle.min(axis=0)) < picture_overlay.DARK_ENOUGH + 0.1
    middle = drawn(offscreen, picture)[SIZE // 2 - 2 : SIZE // 2 + 2, SIZE // 2]
    assert luminance(middle.max(axis=0)) > 0.8


def test_marks_and_images_are_drawn(offscreen):
    pixels = np.zeros((40, 60, 3))
    pixels[:20] = (1.0, 0.0, 0.0)  # the upper half
    pixels[20:] = (0.0, 0.0, 1.0)
    picture = Picture(
        "A caption", marks=(Mark(np.array([-0.5, 0.0, 0.2]), "here", (0.2, 0.9, 0.3)),),
        rows=(Row("N", "12"),), images=(Image("map", pixels),),
    )  # fmt: skip
    found = drawn(offscreen, picture, on_screen=True)
    green = found[:, :, 1] - found[:, :, 0] > 0.3
    rows, columns = np.nonzero(green)
    assert 0.55 * SIZE < rows.mean() < 0.65 * SIZE
    assert 0.25 * SIZE < columns.min() < columns.max() < 0.5 * SIZE
    red = np.argwhere((found == (1.0, 0.0, 0.0)).all(axis=2))
    blue = np.argwhere((found == (0.0, 0.0, 1.0)).all(axis=2))
    assert len(red) == pytest.approx(len(blue), rel=0.1)
    assert red[:, 0].min() >= blue[:, 0].max()  # rows go upwards
    assert red[:, 1].min() > 0.5 * SIZE
    assert not np.array_equal(found, drawn(offscreen, picture, on_screen=True, is_large=True))
