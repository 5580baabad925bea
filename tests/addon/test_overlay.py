"""The overlay draws what the display settings ask for, where a NumPy projection says it belongs.

Blender can draw without a window from 5.2 on; older ones can inside the render callback of an
engine that asks for a GPU context, so that is where the drawing is done there.
"""

from __future__ import annotations

import dataclasses
import gc
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")
gpu = pytest.importorskip("gpu")

from accelscope.addon.drawing import overlay, selection  # noqa: E402
from accelscope.addon.drawing.drawable import make_drawable  # noqa: E402
from accelscope.core.colours import (  # noqa: E402
    EMPTY_TINT,
    INNER_COLOUR,
    count_colours,
    depth_colours,
    face_opacity,
    ramp,
)
from accelscope.core.contract.cells import NEVER, Cells, Polygons, rectangles  # noqa: E402
from mathutils import Matrix, Vector  # noqa: E402

pytestmark = pytest.mark.bpy

WIDTH, HEIGHT = 240, 160


def display(**changed):
    settings = {
        "show": True, "depth_min": 0, "depth_max": 1_000_000, "leaves_only": False,
        "hide_empty": False, "tint_empty": False, "planes": False,
        "opacity": 1.0, "line_width": 1.0, "colour_by": "depth",
    }  # fmt: skip
    return SimpleNamespace(**(settings | changed))


def make_cells(boxes, depth=0, is_leaf=True, count=1):
    n = len(boxes)
    return Cells.sorted_by_depth(
        np.asarray(boxes, dtype=float),
        np.broadcast_to(depth, n),
        np.broadcast_to(is_leaf, n).astype(bool),
        np.broadcast_to(count, n),
    )


def set_cells(cells):
    overlay.set_cells(make_drawable(cells))


def random_cells(n, seed=0):
    rng = np.random.default_rng(seed)
    lower = rng.random((n, 3))
    is_leaf = rng.random(n) < 0.6
    count = np.where(is_leaf, rng.integers(0, 4, n), 0)
    boxes = np.concatenate([lower, lower + 0.1 * rng.random((n, 3))], axis=1)
    return make_cells(boxes, rng.integers(0, 12, n), is_leaf, count)


@pytest.fixture(autouse=True)
def _clean():
    yield
    overlay.disable()


# ------------------------------------------------------------------------- what is to be drawn


@pytest.mark.parametrize("leaves_only", [False, True])
@pytest.mark.parametrize("hide_empty", [False, True])
@pytest.mark.parametrize("depths", [(0, 100), (3, 7), (5, 5), (7, 3), (11, 11), (12, 90), (0, 0)])
def test_runs_are_the_visible_cells(leaves_only, hide_empty, depths):
    cells = random_cells(700)
    settings = display(
        depth_min=depths[0], depth_max=depths[1], leaves_only=leaves_only, hide_empty=hide_empty
    )
    sections = selection.sections_of(cells)
    runs = selection.drawn_runs(sections, settings)
    drawn = np.concatenate([sections.order[first:last] for first, last in runs])
    np.testing.assert_array_equal(
        np.sort(drawn), np.flatnonzero(selection.visible(cells, settings))
    )
    assert len(runs) == 3  # draw calls, whatever the cells


def test_shown_text():
    settings = display(depth_max=1)
    assert overlay.shown_text(settings) == "no cells"
    set_cells(make_cells(np.zeros((4096, 6)), depth=(np.arange(4096) >= 1203) * 2))
    assert overlay.shown_text(settings) == "showing 1 203 of 4 096 cells"
    set_cells(make_cells(np.zeros((0, 6))))
    assert overlay.shown_text(settings) == "showing 0 of 0 cells"


def test_too_many_cells_are_cut_in_order_of_importance(monkeypatch):
    cells = random_cells(1000)
    leaves = int((cells.is_leaf & (cells.count > 0)).sum())
    inner = int((~cells.is_leaf).sum())
    monkeypatch.setattr(selection, "MAXIMUM_DRAWN", leaves + 10)
    set_cells(cells)
    runs = selection.drawn_runs(selection.sections_of(cells), display())
    assert [last - first for first, last in runs] == [leaves, 10, 0]
    assert (
        overlay.shown_text(display())
        == f"showing {leaves + 10} of 1 000 cells (at most {leaves + 10} are drawn)"
    )
    assert "most" not in overlay.shown_text(display(leaves_only=True, hide_empty=True))

    monkeypatch.setattr(selection, "MAXIMUM_HELD", leaves + inner + 5)
    # There the empty leaves find room, and what they leave is halved.
    sections, empty = selection.sections_of(cells), 1000 - leaves - inner
    half = (leaves + inner + 5 - empty) // 2
    ends = np.cumsum([leaves + inner + 5 - empty - half, half, empty])
    assert sections.ends.tolist() == ends.tolist()
    set_cells(cells)
    assert overlay.shown_text(display(hide_empty=True)).endswith(
        f"of 1 000 cells (at most {leaves + inner + 5} are kept, {leaves + 10} are drawn)"
    )


def test_enable_and_disable_are_idempotent():
    overlay.enable()
    handler = overlay._overlay.handler
    overlay.enable()
    assert overlay._overlay.handler is handler
    overlay.disable()
    overlay.disable()
    assert overlay._overlay.handler is None
    overlay.tag_redraw()


def test_disable_lets_go_of_the_cells():
    cells = random_cells(10)
    alive = weakref.ref(cells)
    set_cells(cells)
    del cells
    gc.collect()
    assert alive() is not None
    overlay.disable()
    gc.collect()
    assert alive() is None


def fake_blender(monkeypatch, settings, show_overlays=True):
    context = SimpleNamespace(
        scene=SimpleNamespace(accelscope=SimpleNamespace(display=settings), session_uid=1),
        space_data=SimpleNamespace(overlay=SimpleNamespace(show_overlays=show_overlays)),
        preferences=SimpleNamespace(system=SimpleNamespace(pixel_size=2.0)),
        window_manager=SimpleNamespace(windows=[]),
    )
    monkeypatch.setattr(overlay, "bpy", SimpleNamespace(context=context, types=bpy.types))
    return context


def test_callback_honours_show_overlays_and_missing_properties(monkeypatch):
    drawn = []
    settings = display()
    monkeypatch.setattr(overlay, "draw", lambda *arguments: drawn.append(arguments))
    fake_blender(monkeypatch, settings, show_overlays=False)
    overlay._draw_callback()
    context = fake_blender(monkeypatch, settings)
    overlay._draw_callback()
    del context.scene.accelscope  # the extension is being disabled
    overlay._draw_callback()
    assert drawn == [(settings, 2.0, True)]


def test_a_failure_is_reported_once_and_switches_off(monkeypatch, capsys):
    def fail(*arguments):
        raise RuntimeError("no graphics card today")

    monkeypatch.setattr(overlay, "draw", fail)
    fake_blender(monkeypatch, display())
    overlay.enable()
    for _ in range(3):
        overlay._draw_callback()
    assert capsys.readouterr().err.count("Error: no graphics card today") == 1
    set_cells(random_cells(3))  # something new to show: another attempt
    overlay._draw_callback()
    assert capsys.readouterr().err.count("Error: no graphics card today") == 1


# ------------------------------------------------------------------------------ what is drawn


def look_at(eye, target):
    towards_eye = Vector(eye) - Vector(target)
    pose = towards_eye.to_track_quat("Z", "Y").to_matrix().to_4x4()
    pose.translation = Vector(eye)
    return pose.inverted()


def perspective(near=0.1, far=100.0, aspect=WIDTH / HEIGHT):
    a, b = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    return Matrix(((1.5 / aspect, 0, 0, 0), (0, 1.5, 0, 0), (0, 0, a, b), (0, 0, -1, 0)))


def orthographic(size=2.0, aspect=WIDTH / HEIGHT):
    return Matrix.Diagonal((1 / size / aspect, 1 / size, -0.01, 1.0))


FROM_FRONT = look_at((0, -5, 0), (0, 0, 0))
OBLIQUE = look_at((2.5, -3.0, 1.8), (0, 0, 0))


class WithGPU(bpy.types.RenderEngine):
    """Runs a function where the GPU may be used: the way without a window before Blender 5.2."""

    bl_idname = "ACCELSCOPE_WITH_GPU"
    bl_label = "With GPU"
    bl_use_gpu_context = True
    function = None
    outcome = None

    def render(self, depsgraph):
        try:
            WithGPU.outcome = WithGPU.function(), None
        except Exception as error:
            WithGPU.outcome = None, error

    @classmethod
    def run(cls, function):
        """Return what the function returns; raise what it raises."""
        scene = bpy.context.scene
        if scene.camera is None:
            scene.camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
        scene.render.engine = cls.bl_idname
        scene.render.resolution_x = scene.render.resolution_y = 8
        cls.function = staticmethod(function)
        bpy.ops.render.render()
        result, error = cls.outcome
        if error:
            raise error
        return result


class Canvas:
    """A frame buffer without a window."""

    def __init__(self, run):
        self.run = run
        self.offscreen = run(lambda: gpu.types.GPUOffScreen(WIDTH, HEIGHT))

    def draw(self, *arguments, **options):
        """Return the picture of the overlay over black, (HEIGHT, WIDTH, 3), lowest row first."""
        return self.run(lambda: self._draw(*arguments, **options))

    def _draw(self, settings, view=OBLIQUE, projection=None, before=None):
        with self.offscreen.bind():
            frame_buffer = gpu.state.active_framebuffer_get()
            frame_buffer.clear(color=(0.0, 0.0, 0.0, 1.0), depth=1.0)
            with gpu.matrix.push_pop(), gpu.matrix.push_pop_projection():
                gpu.matrix.load_matrix(view)
                gpu.matrix.load_projection_matrix(projection or perspective())
                if before:
                    before()
                overlay.draw(settings)
            buffer = gpu.types.Buffer("FLOAT", WIDTH * HEIGHT * 4)
            frame_buffer.read_color(0, 0, WIDTH, HEIGHT, 4, 0, "FLOAT", data=buffer)
        return np.array(buffer.to_list()).reshape(HEIGHT, WIDTH, 4)[:, :, :3]


@pytest.fixture(scope="module")
def canvas():
    if bpy.app.version >= (5, 2, 0):
        gpu.init()
        yield Canvas(lambda function: function())
    else:
        bpy.utils.register_class(WithGPU)
        yield Canvas(WithGPU.run)
        bpy.utils.unregister_class(WithGPU)


def edges_of(box):
    corners = np.array([[box[3 * (i >> axis & 1) + axis] for axis in range(3)] for i in range(8)])
    return np.array(
        [(corners[i], corners[i | 1 << axis]) for i in range(8) for axis in range(3)
         if not i >> axis & 1]
    )  # fmt: skip


def distances(segments, view=OBLIQUE, projection=None):
    """Return every pixel's distance to the nearest projected segment, (HEIGHT, WIDTH)."""
    matrix = np.array((projection or perspective()) @ view)
    clip = np.concatenate([segments, np.ones((*segments.shape[:2], 1))], axis=2) @ matrix.T
    rows, columns = np.mgrid[:HEIGHT, :WIDTH] + 0.5
    nearest = np.full((HEIGHT, WIDTH), np.inf)
    for p, q in clip:
        behind = p[2] + p[3], q[2] + q[3]
        if max(behind) <= 0.0:
            continue
        if min(behind) < 0.0:
            cut = p + (q - p) * behind[0] / (behind[0] - behind[1])
            p, q = (cut, q) if behind[0] < 0.0 else (p, cut)
        a, b = ((e[:2] / e[3] + 1.0) * 0.5 * (WIDTH, HEIGHT) for e in (p, q))
        along = b - a
        offset = np.stack([columns - a[0], rows - a[1]], axis=-1)
        fraction = np.clip(offset @ along / max(along @ along, 1e-12), 0.0, 1.0)
        distance = np.linalg.norm(offset - fraction[..., None] * along, axis=-1)
        nearest = np.minimum(nearest, distance)
    return nearest


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


def row_of_boxes(n):
    left = np.linspace(-2.5, 2.5, n, endpoint=False)
    width = 0.6 * 5.0 / n
    box = np.array([0.0, -0.05, -0.3, width, 0.05, 0.3])
    return box + left[:, None] * [1, 0, 0, 1, 0, 0]


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


def test_a_few_levels_take_the_whole_ramp():
    cells = make_cells(np.zeros((9, 6)), depth=np.arange(9), count=np.arange(9))
    extent = selection.extent_of(cells)
    assert selection.colour_maximum(extent, display()) == 8
    assert selection.colour_maximum(extent, display(depth_max=3)) == 3
    assert selection.colour_maximum(extent, display(depth_max=3, colour_by="count")) == 8
    assert (
        selection.colour_maximum(selection.extent_of(make_cells(np.zeros((0, 6)))), display()) == 0
    )


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


# --------------------------------------------------------- polyhedra, planes, empty leaves, steps


def prisms():
    """Return the two halves of a cube, cut along a diagonal plane."""
    low = [(-1, -1), (1, -1), (1, 1)]
    high = [(-1, -1), (1, 1), (-1, 1)]
    lists = []
    for base in (low, high):
        floor = [(*corner, -1) for corner in base]
        roof = [(*corner, 1) for corner in base]
        sides = [[floor[i - 1], floor[i], roof[i], roof[i - 1]] for i in range(3)]
        lists += [floor, roof, *sides]
    offsets = np.concatenate([[0], np.cumsum([len(points) for points in lists])])
    faces = Polygons(np.concatenate(lists).astype(float), offsets, np.repeat([0, 1], 5))
    boxes = np.tile((-1.0, -1, -1, 1, 1, 1), (2, 1))
    return boxes, faces


def edges_of_prism(faces, owner):
    polygons = np.split(faces.points, faces.offsets[1:-1])
    return np.array(
        [(face[i - 1], face[i]) for face, of in zip(polygons, faces.owners) if of == owner
         for i in range(len(face))]
    )  # fmt: skip


def test_polyhedra_are_drawn_as_what_they_are(canvas):
    boxes, faces = prisms()
    # The second is deeper but fuller: sections turn the order around.
    cells = Cells.sorted_by_depth(
        boxes, np.array([0, 1]), np.array([True, True]), np.array([0, 3]), faces=faces
    )
    set_cells(cells)
    view = look_at((4, -6, 3), (0, 0, 0))
    before = overlay.uploads()
    for owner in (0, 1):
        settings = display(depth_min=owner, depth_max=owner, colour_by="count", line_width=3.0)
        light = canvas.draw(settings, view).max(axis=2)
        distance = distances(edges_of_prism(faces, owner), view)
        assert light[distance > 0.71 * 3.0 + 1.0].max() == 0.0
        # Edges of empty leaves are faint.
        assert light[distance < 0.9].min() > (0.2 if owner == 0 else 0.7)
    assert overlay.uploads() == before + 1


def pixel(picture, x, z):
    """Return the colour at a place in front of FROM_FRONT, orthographic."""
    column = (x / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    return picture[int((z / 2.0 + 1.0) * 0.5 * HEIGHT), int(column)]


def test_empty_leaves_are_tinted(canvas):
    boxes = row_of_boxes(4)
    depth = np.array([1, 1, 2, 2])
    set_cells(make_cells(boxes, depth, np.array([1, 1, 1, 0]), np.array([0, 2, 0, 0])))
    settings = display(tint_empty=True, hide_empty=True, opacity=0.8)
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    before = overlay.uploads()
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    x, y, z = (boxes[0, 3:] - boxes[0, :3]).tolist()
    area = 2 * 2 * (x * y + y * z + z * x)
    width, (y, z) = boxes[3, 3] - boxes[0, 0], (y, z)
    around = 2 * (width * y + y * z + z * width)
    alpha = face_opacity(area, around, overlay.TINT_COVER * 0.8)
    # Through the front and the back.
    tint = (1.0 - (1.0 - alpha) ** 2) * np.array(EMPTY_TINT)
    for place, expected in zip(middle, (tint, 0 * tint, tint, 0 * tint)):
        np.testing.assert_allclose(pixel(picture, place, 0.0), expected, atol=0.01)

    deeper = canvas.draw(display(tint_empty=True, depth_min=2), FROM_FRONT, orthographic())
    assert pixel(deeper, middle[0], 0.0).max() == 0.0
    assert pixel(deeper, middle[2], 0.0).max() > 0.1
    assert overlay.uploads() == before


def cells_with_planes():
    """Return a row of four inner nodes, each cut by an upright plane that faces the viewer."""
    boxes = row_of_boxes(4)
    corners = np.stack(
        [boxes[:, [0, 1, 2]], boxes[:, [3, 1, 2]], boxes[:, [3, 1, 5]], boxes[:, [0, 1, 5]]], axis=1
    )
    depth = np.array([0, 1, 2, 3])
    nothing = np.zeros(4, dtype=np.int32)
    planes = rectangles(corners, np.arange(4))
    return boxes, Cells.sorted_by_depth(boxes, depth, nothing == 1, nothing, planes=planes)


@pytest.mark.parametrize("colour_by", ["depth", "count"])
def test_planes_are_drawn_within_their_cells(canvas, colour_by):
    boxes, cells = cells_with_planes()
    set_cells(cells)
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    settings = display(planes=True, leaves_only=True, depth_max=3, colour_by=colour_by)
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    before = overlay.uploads()
    colours = depth_colours(cells.depth, 3) if colour_by == "depth" else [INNER_COLOUR] * 4
    alpha = pixel(picture, middle[0], 0.0).max() / max(colours[0])
    assert 0.05 < alpha < overlay.PLANE_COVER + 0.01
    for place, colour in zip(middle, colours):
        seen = pixel(picture, place, 0.0)
        np.testing.assert_allclose(seen, np.array(colour) * alpha, atol=0.01)
        assert pixel(picture, place, 0.35).max() == 0.0
    assert pixel(picture, 0.5 * (boxes[0, 3] + boxes[1, 0]), 0.0).max() == 0.0
    # They have outlines.
    settings.line_width = 5.0
    outlined = canvas.draw(settings, FROM_FRONT, orthographic())
    assert pixel(outlined, middle[1], 0.34).max() > 0.1

    some = canvas.draw(
        display(planes=True, leaves_only=True, depth_min=1, depth_max=2), FROM_FRONT, orthographic()
    )
    shown = [pixel(some, place, 0.0).max() > 0.02 for place in middle]
    assert shown == [False, True, True, False]
    without = canvas.draw(display(leaves_only=True), FROM_FRONT, orthographic())
    assert without.max() == 0.0
    assert overlay.uploads() == before


def stepped_cells():
    """Return a row of boxes: four cells in the order in which they are made, and divided.

    Each is divided by the next step into the next one, as far as boxes go: same box one level down.
    """
    boxes = row_of_boxes(4)
    order = np.array([0, 1, 2, 3], dtype=np.int32)
    return boxes, Cells.sorted_by_depth(
        np.concatenate([boxes, boxes[:3]]),
        np.array([0, 0, 0, 0, 1, 1, 1]),
        np.array([False, False, False, True, True, True, True]),
        np.array([0, 0, 0, 5, 2, 2, 2]),
        {"order": np.concatenate([order, order[:3] + 4])},
        replaced=np.concatenate([order[:3] + 4, np.full(4, NEVER)]),
    )


def test_colours_by_order(canvas):
    boxes, cells = stepped_cells()
    set_cells(cells)
    x = (boxes[:, 0] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    for depth, steps in ((0, np.arange(4)), (1, np.arange(4, 7))):
        settings = display(colour_by="order", line_width=5.0, depth_min=depth, depth_max=depth)
        row = canvas.draw(settings, FROM_FRONT, orthographic())[HEIGHT // 2, x.astype(int)]
        np.testing.assert_allclose(row[: len(steps)], ramp(steps / 6), atol=0.012)
    plain = make_cells(boxes, depth=np.arange(4))
    extent = selection.extent_of(plain)
    assert selection.coloured_by(extent, display(colour_by="order")) == "depth"


def test_planes_have_the_colour_of_the_step_that_cuts_their_cell(canvas):
    boxes, cells = stepped_cells()
    corners = np.stack(
        [boxes[:, [0, 1, 2]], boxes[:, [3, 1, 2]], boxes[:, [3, 1, 5]], boxes[:, [0, 1, 5]]], axis=1
    )
    cells = dataclasses.replace(cells, planes=rectangles(corners[:3], np.arange(3)))
    set_cells(cells)
    # Leaves lie one level down: what is seen of the first are outlines of planes.
    settings = display(
        planes=True, leaves_only=True, colour_by="order", depth_max=0, line_width=5.0
    )
    x = (boxes[:3, 0] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    row = canvas.draw(settings, FROM_FRONT, orthographic())[HEIGHT // 2, x.astype(int)]
    np.testing.assert_allclose(row, ramp(np.arange(4, 7) / 6), atol=0.012)


def test_a_hundred_thousand_empty_leaves_are_a_tint_of_the_first(monkeypatch, canvas):
    monkeypatch.setattr(selection, "MAXIMUM_FILLED", 3)
    boxes = row_of_boxes(4)
    set_cells(make_cells(boxes, depth=np.arange(4), count=0))
    picture = canvas.draw(display(tint_empty=True, hide_empty=True), FROM_FRONT, orthographic())
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    assert [pixel(picture, place, 0.0).max() > 0.02 for place in middle] == [True] * 3 + [False]
