"""A frame buffer that the overlay draws into, cells to draw, and where a projection says they are.

Blender can draw without a window from 5.2 on; older ones can inside the render callback of an
engine that asks for a GPU context, so that is where the drawing is done there.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("gpu")

import bpy
import gpu
from accelscope.addon.drawing import overlay
from accelscope.addon.drawing.drawable import make_drawable
from accelscope.core.contract.cells import Cells
from mathutils import Matrix, Vector

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


# ------------------------------------------------------------------------------------ the canvas


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


def row_of_boxes(n):
    left = np.linspace(-2.5, 2.5, n, endpoint=False)
    width = 0.6 * 5.0 / n
    box = np.array([0.0, -0.05, -0.3, width, 0.05, 0.3])
    return box + left[:, None] * [1, 0, 0, 1, 0, 0]


def pixel(picture, x, z):
    """Return the colour at a place in front of FROM_FRONT, orthographic."""
    column = (x / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    return picture[int((z / 2.0 + 1.0) * 0.5 * HEIGHT), int(column)]
