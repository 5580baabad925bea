"""The overlay draws what the display settings ask for, where a NumPy projection says it belongs."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("gpu")

import bpy
import gpu
from accelscope.addon.drawing import overlay
from accelscope.core.colours import INNER_COLOUR, count_colours, depth_colours
from mathutils import Matrix
from overlay_canvas import (
    FROM_FRONT,
    HEIGHT,
    OBLIQUE,
    WIDTH,
    display,
    distances,
    edges_of,
    look_at,
    make_cells,
    orthographic,
    perspective,
    random_cells,
    row_of_boxes,
    set_cells,
)

pytestmark = pytest.mark.usefixtures("clean_overlay")

BOX = (-0.9, -0.7, -0.5, 0.8, 0.9, 0.6)


@pytest.mark.parametrize("line_width", [1.0, 2.0, 3.0, 7.0])
@pytest.mark.parametrize(
    ("view", "projection"),
    [
        (OBLIQUE, perspective()),
        (OBLIQUE, orthographic()),
        (look_at((0.1, 0.2, 0.1), (1.0, 0.3, 0.4)), perspective()),  # from inside
        (
            look_at((0.7, -1.5, 0.3), (0.7, 1.0, 0.5)),
            perspective(near=0.9),
        ),  # cut by the near plane
    ],
)
def test_lit_pixels_are_those_of_the_projection(canvas, line_width, view, projection):
    set_cells(make_cells([BOX]))
    picture = canvas.draw(display(line_width=line_width), view, projection)
    cover = picture.max(axis=2) / depth_colours([0], 1).max()
    distance = distances(edges_of(BOX), view, projection)
    # Caps are square: half a diagonal may stick out of the distance to a corner.
    assert cover[distance > 0.71 * line_width + 1.0].max() == 0.0
    assert cover[distance < 0.5 * line_width - 0.55].min(initial=1.0) > 0.98
    # The soft edge carries half of the light half a line width away.
    at_edge = cover[np.abs(distance - 0.5 * line_width) < 0.05]
    assert at_edge.size
    assert abs(np.median(at_edge) - 0.5) < 0.1


def test_wide_lines_are_as_wide_as_asked(canvas):
    set_cells(make_cells([(-0.5, 0, -0.5, 0.5, 0, 0.5)]))
    for width in (1.0, 2.0, 5.0):
        picture = canvas.draw(display(line_width=width), FROM_FRONT)
        middle_row = picture[HEIGHT // 2].max(axis=1) / depth_colours([0], 1).max()
        # Four edges of the flat box fall on two: covers add up like 1 - (1 - c)^2.
        single = 1.0 - np.sqrt(1.0 - np.clip(middle_row, 0.0, 1.0))
        assert single[: WIDTH // 2].sum() == pytest.approx(width, abs=0.08)


def lit(canvas, settings, boxes):
    """Return which of the boxes in a row are lit."""
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    columns = np.flatnonzero(picture.max(axis=(0, 2)))
    edges = (boxes[:, [0, 3]] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    return [bool(((columns > low - 2) & (columns < high + 2)).any()) for low, high in edges]


def test_filters_take_away_what_they_say_and_upload_nothing(canvas):
    boxes = row_of_boxes(8)
    depth = np.array([0, 1, 1, 2, 2, 2, 3, 3])
    is_leaf = np.array([0, 0, 1, 1, 1, 0, 1, 1], dtype=bool)
    count = np.array([0, 0, 3, 0, 2, 0, 0, 9])
    set_cells(make_cells(boxes, depth, is_leaf, count))
    before = overlay.uploads()
    for low in range(5):
        for high in range(5):
            for leaves_only in (False, True):
                for hide_empty in (False, True):
                    settings = display(
                        depth_min=low, depth_max=high,
                        leaves_only=leaves_only, hide_empty=hide_empty,
                        opacity=0.5 + 0.1 * low, colour_by=("depth", "count")[high % 2],
                    )  # fmt: skip
                    expected = (depth >= low) & (depth <= high)
                    expected &= is_leaf | (not leaves_only)
                    expected &= ~(is_leaf & (count == 0)) | (not hide_empty)
                    assert lit(canvas, settings, boxes) == expected.tolist()
    assert overlay.uploads() == before + 1
    assert lit(canvas, display(show=False), boxes) == [False] * 8


def test_uploads_are_lazy_and_only_for_new_geometry(canvas):
    before = overlay.uploads()
    set_cells(random_cells(50))
    assert overlay.uploads() == before
    for view in (OBLIQUE, FROM_FRONT):  # two viewports
        canvas.draw(display(), view)
    assert overlay.uploads() == before + 1
    set_cells(random_cells(50))
    canvas.draw(display())
    assert overlay.uploads() == before + 2
    overlay.set_cells(None)
    assert canvas.draw(display()).max() == 0.0
    assert overlay.uploads() == before + 2


def test_a_hundred_thousand_boxes_each_at_its_place(canvas):
    n = 100_000
    rng = np.random.default_rng(3)
    lower = rng.uniform(-1.0, 0.8, (n, 3))
    boxes = np.concatenate([lower, lower + 0.15], axis=1)
    set_cells(make_cells(boxes, depth=np.arange(n)))
    before = overlay.uploads()
    # A depth of its own for each cell: the depth range picks any single one.
    for i in [0, 1, 2047, 2048, 50_000, n - 1, *rng.integers(0, n, 4)]:
        cover = canvas.draw(display(depth_min=i, depth_max=i)).max(axis=2)
        distance = distances(edges_of(boxes[i]))
        assert cover[distance > 1.75].max() == 0.0
        assert cover[distance < 0.3].min() > 0.3
    everything = canvas.draw(display())
    assert overlay.uploads() == before + 1
    some = np.concatenate([edges_of(box) for box in boxes[::2000]])
    assert everything.max(axis=2)[distances(some) < 0.3].min() > 0.5
    assert overlay.shown_text(display()) == "showing 100 000 of 100 000 cells"


@pytest.mark.parametrize("colour_by", ["depth", "count"])
def test_colours_are_those_of_the_ramp(canvas, colour_by):
    boxes = row_of_boxes(5)
    depth = np.arange(5)
    is_leaf = np.array([False, True, True, True, True])
    count = np.array([0, 1, 0, 7, 40])
    set_cells(make_cells(boxes, depth, is_leaf, count))
    settings = display(line_width=5.0, opacity=0.8, colour_by=colour_by, depth_max=4)
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    if colour_by == "depth":
        colours, alpha = depth_colours(depth, 4), np.where(is_leaf & (count == 0), 0.3, 1.0)
    else:
        colours, alpha = count_colours(count, 40), np.where(count == 0, 0.3, 1.0)
        colours[0] = INNER_COLOUR
    # On the left edge at half height two edges lie behind each other.
    alpha = 1.0 - (1.0 - 0.8 * alpha) ** 2
    x = (boxes[:, 0] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    seen = picture[HEIGHT // 2, x.astype(int)]
    np.testing.assert_allclose(seen, colours * alpha[:, None], atol=0.012)


def wall(y):
    """Draw a black wall across the left half of the view from the front."""
    from gpu_extras.batch import batch_for_shader

    corners = [(-9, y, -9), (0, y, -9), (0, y, 9), (-9, y, -9), (0, y, 9), (-9, y, 9)]
    shader = gpu.shader.from_builtin("UNIFORM_COLOR")
    gpu.state.depth_test_set("LESS_EQUAL")
    gpu.state.depth_mask_set(True)
    shader.uniform_float("color", (0.0, 0.0, 0.0, 1.0))
    batch_for_shader(shader, "TRIS", {"pos": np.array(corners, np.float32)}).draw(shader)
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("NONE")


@pytest.mark.parametrize("projection", [perspective(near=0.01, far=1000.0), orthographic()])
def test_the_scene_hides_what_lies_behind_it(canvas, projection):
    set_cells(make_cells([(-1, -0.3, -0.5, 1, 0.3, 0.5)]))

    def halves(wall_y):
        picture = canvas.draw(display(), FROM_FRONT, projection, before=lambda: wall(wall_y))
        light = picture.max(axis=2)
        return light[:, : WIDTH // 2 - 2].sum(), light[:, WIDTH // 2 + 2 :].sum()

    left, right = halves(1.0)  # behind the box
    assert left == pytest.approx(right, rel=0.05)
    left, right = halves(-1.0)  # in front of the box
    assert left == 0.0
    assert right > 0.0
    left, right = halves(-0.3)  # in the plane of its front face: edges win
    assert 0.4 * right < left < 0.95 * right or projection[3][3]


def test_the_state_of_the_graphics_card_is_given_back(canvas):
    set_cells(random_cells(20))
    states = []

    def read():
        states.append(
            (gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get())
        )

    def set_something():
        gpu.state.blend_set("ADDITIVE")
        gpu.state.depth_test_set("GREATER")
        gpu.state.depth_mask_set(True)
        read()

    def draw():
        with canvas.offscreen.bind():
            set_something()
            overlay.draw(display())
            read()
            gpu.state.blend_set("NONE")
            gpu.state.depth_test_set("NONE")
            gpu.state.depth_mask_set(False)

    canvas.run(draw)
    assert states[0] == states[1]


def test_file_load_and_undo_leave_the_picture(canvas):
    overlay.enable()
    set_cells(random_cells(200))
    before = canvas.draw(display())
    uploads = overlay.uploads()
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="cube")
    bpy.data.objects.remove(bpy.context.object)
    bpy.ops.wm.read_homefile(use_empty=True)
    np.testing.assert_array_equal(canvas.draw(display()), before)
    assert before.max() > 0.0
    assert overlay.uploads() == uploads


@pytest.mark.parametrize("size", [1e-20, 1e-6, 1e6, 1e20])
def test_extreme_sizes_are_drawn(canvas, size):
    set_cells(make_cells([np.array(BOX) * size]))
    scaled = Matrix.Diagonal((1 / size, 1 / size, 1 / size, 1.0))
    overlay_picture = canvas.draw(display(), OBLIQUE @ scaled)
    set_cells(make_cells([BOX]))
    np.testing.assert_allclose(overlay_picture, canvas.draw(display()), atol=0.03)


def test_no_cells_draw_nothing(canvas):
    set_cells(make_cells(np.zeros((0, 6))))
    assert canvas.draw(display()).max() == 0.0
