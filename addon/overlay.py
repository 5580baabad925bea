"""The overlay: cells, ray paths and exhibits over the scene in every 3D viewport.

Cells are uploaded once, at the first draw after :func:`set_cells`, in three sections: leaves with
primitives, inner nodes, empty leaves, each sorted by depth (:mod:`.selection`). So whatever the
display settings ask for is one run of cells per section, which is drawn with one call; moving a
slider uploads nothing. The same goes for the planes that cut cells, and for the faces of empty
leaves; both are uploaded when they are asked for the first time.

Nothing here holds a reference to Blender's data, so undo, file load and deleted objects do no harm.
"""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import gpu
import numpy as np

from ..core.colours import EMPTY_TINT, INNER_COLOUR, face_opacity
from . import overlay_shader, overlay_upload, selection

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

RAY, EXHIBIT, PLANE = "ray", "exhibit", "plane"
"""Layers of lines. Each is set for itself, and does not push the others out."""

LAYER_WIDTH = {EXHIBIT: 0.5, PLANE: 1.0, RAY: 2.0}
"""Width of lines in pixels beyond that of cells, by layer; the last is drawn on top."""

HIDDEN_OPACITY, HIDDEN_OPACITY_OF_FEW = 0.25, 0.5
"""Opacity of those parts of lines in layers that lie behind something, of many and of few."""

FEW_LINES = 2000
"""So many lines do not hide each other."""

TINT_COVER = 0.6
"""Share of the view that tinted empty leaves cover together, at full opacity."""

PLANE_COVER = 0.4
"""Share of the view that planes cover together, at full opacity."""


class _Tools(NamedTuple):
    """What the graphics card holds whatever there is to draw."""

    cells_shader: gpu.types.GPUShader
    faces_shader: gpu.types.GPUShader
    paths_shader: gpu.types.GPUShader
    cube: gpu.types.GPUBatch
    edge: gpu.types.GPUBatch
    triangle: gpu.types.GPUBatch
    colours: gpu.types.GPUTexture


class _Drawn:
    """The cells to draw, and what of them is on the graphics card: each part once it is needed."""

    def __init__(self, cells: Cells) -> None:
        self.cells = cells
        self.sections = selection.sections_of(cells)
        if cells.planes is not None:
            self.plane_depth = cells.depth[cells.planes.owners[: selection.MAXIMUM_FILLED]]

    @cached_property
    def steps(self) -> overlay_upload.Steps:
        """When cells were made and divided."""
        return overlay_upload.steps_of(self.cells)

    @cached_property
    def surface(self) -> float:
        """The surface of the box around all cells."""
        x, y, z = self.cells.boxes[:, 3:].max(axis=0) - self.cells.boxes[:, :3].min(axis=0)
        return float(2.0 * (x * y + y * z + z * x))

    @cached_property
    def lines(self) -> overlay_upload.Lines:
        """The edges of all cells, in the order of the sections."""
        _overlay.uploads += 1
        return overlay_upload.cell_lines(self.cells, self.sections.order, self.steps)

    @cached_property
    def plane_lines(self) -> overlay_upload.Lines:
        """The outlines of the planes."""
        _overlay.uploads += 1
        return overlay_upload.plane_lines(self.cells, self.steps, len(self.plane_depth))

    @cached_property
    def plane_faces(self) -> overlay_upload.Faces:
        """The planes."""
        _overlay.uploads += 1
        return overlay_upload.plane_faces(self.cells, self.steps, len(self.plane_depth))

    @cached_property
    def empty(self) -> np.ndarray:
        """Places of the empty leaves that may be tinted."""
        _, first, last = self.sections.ends
        return self.sections.order[first:last][: selection.MAXIMUM_FILLED]

    @cached_property
    def empty_faces(self) -> overlay_upload.Faces:
        """The faces of those leaves."""
        _overlay.uploads += 1
        return overlay_upload.cell_faces(self.cells, self.empty, self.steps)


class _Layer:
    """Thick lines of all colours, uploaded at the first draw."""

    def __init__(self, segments: np.ndarray, colours: np.ndarray) -> None:
        self.segments = np.asarray(segments, dtype=np.float32).reshape(-1, 2, 3)
        self.colours = np.asarray(colours, dtype=np.float32).reshape(len(self.segments), 4)

    @cached_property
    def batch(self) -> gpu.types.GPUBatch:
        """The lines."""
        _overlay.uploads += 1
        ends = self.segments[:, 0], self.segments[:, 1]
        return overlay_upload.line_batch(*ends, self.colours)


class _Overlay:
    """The one overlay of this Blender."""

    def __init__(self) -> None:
        self.handler: Any = None
        self.failed = False
        self.uploads = 0
        self.tools: _Tools | None = None
        self.drawn: _Drawn | None = None
        self.cells_hidden = False
        self.layers: dict[str, _Layer] = {}


_overlay = _Overlay()


# ------------------------------------------------------------------------------ what to show


def enable() -> None:
    """Start drawing into all 3D viewports; no effect if it is on already."""
    _overlay.failed = False
    if _overlay.handler is None:
        _overlay.handler = bpy.types.SpaceView3D.draw_handler_add(
            _draw_callback, (), "WINDOW", "POST_VIEW"
        )
    tag_redraw()


def disable() -> None:
    """Stop drawing and let go of everything; no effect if it is off already."""
    if _overlay.handler is not None:
        bpy.types.SpaceView3D.draw_handler_remove(_overlay.handler, "WINDOW")
        _overlay.handler = None
    _overlay.tools = None
    set_cells(None)
    hide_cells(False)
    for layer in LAYER_WIDTH:
        set_lines(layer, None)


def set_cells(cells: Cells | None) -> None:
    """Show these cells from the next draw on, or none."""
    _overlay.failed = False
    _overlay.drawn = None if cells is None else _Drawn(cells)
    tag_redraw()


def hide_cells(hidden: bool) -> None:
    """Leave out the cells from the next draw on, whatever the display settings say."""
    _overlay.cells_hidden = hidden
    tag_redraw()


def set_lines(layer: str, segments: np.ndarray | None, colours: np.ndarray | None = None) -> None:
    """Show these thick lines in a layer from the next draw on, or none.

    Parameters
    ----------
    layer : {RAY, EXHIBIT, PLANE}
    segments : (k, 2, 3) array_like of float, or None
        Both ends of each line in world space.
    colours : (k, 4) array_like of float
        sRGB and opacity of each line.
    """
    _overlay.failed = False
    _overlay.layers.pop(layer, None)
    if segments is not None and colours is not None and len(segments):
        _overlay.layers[layer] = _Layer(segments, colours)
    tag_redraw()


def points_of(layers: Sequence[str]) -> np.ndarray:
    """Return the ends of all lines in some layers, (n, 3) float32."""
    shown = [_overlay.layers[name].segments for name in layers if name in _overlay.layers]
    return np.concatenate([np.empty((0, 2, 3), np.float32), *shown]).reshape(-1, 3)


def uploads() -> int:
    """Return how many times geometry went to the graphics card since Blender started."""
    return _overlay.uploads


def tag_redraw() -> None:
    """Have all 3D viewports of all windows drawn again."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


def shown_text(display: Any) -> str:
    """Say how many cells the display settings show: ``"showing 1 203 of 4 096 cells"``."""
    drawn = _overlay.drawn
    if drawn and _overlay.cells_hidden:
        return "cells hidden while an exhibit is shown"
    return selection.shown_text(drawn.cells, drawn.sections, display) if drawn else "no cells"


# ---------------------------------------------------------------------------------- drawing


def _draw_callback() -> None:
    """Draw into the viewport that Blender is drawing; report the first failure and then stop."""
    if _overlay.failed:
        return
    context = bpy.context
    try:
        properties = getattr(context.scene, "accelscope", None)
        if properties is None or not context.space_data.overlay.show_overlays:
            return
        draw(properties.display, context.preferences.system.pixel_size)
    except Exception:
        # A failing callback would print its traceback again at every redraw of every viewport.
        # Its removal waits for disable(): Blender is walking through the list of callbacks.
        _overlay.failed = True
        traceback.print_exc()
        print("AccelScope: the overlay is off until there is something new to show")


def draw(display: Any, pixel_size: float = 1.0) -> None:
    """Draw cells and layers with the current matrices into the current frame buffer.

    Parameters
    ----------
    display : object
        Attributes show (cells and rays), depth_min, depth_max, leaves_only, hide_empty,
        tint_empty, planes, replay, step, opacity, line_width, colour_by ("depth", "count" or
        "order").
    pixel_size : float
        Pixels per unit of line width: 2 on a screen of high resolution.
    """
    drawn = None if _overlay.cells_hidden or not display.show else _overlay.drawn
    layers = [layer for layer in LAYER_WIDTH if layer in _overlay.layers]
    if not display.show and RAY in layers:
        layers.remove(RAY)
    if drawn is None and not layers:
        return
    if _overlay.tools is None:
        _overlay.tools = _Tools(
            overlay_shader.cells_shader(), overlay_shader.faces_shader(),
            overlay_shader.paths_shader(), overlay_upload.cube_batch(),
            overlay_upload.edge_batch(), overlay_upload.triangle_batch(),
            overlay_upload.ramp_texture(),
        )  # fmt: skip
    before = gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    # Without the soft edges of one line cutting holes into the next.
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("LESS_EQUAL")
    try:
        if drawn is not None:
            # Faces first: lines stay crisp on top of them.
            _draw_faces(_overlay.tools, drawn, display)
            _draw_lines(_overlay.tools, drawn, display, pixel_size)
        for name in layers:
            layer = _overlay.layers[name]
            # Rays run through cells: there the crispest line is the one in front.
            few = name != RAY and len(layer.segments) <= FEW_LINES
            width = (display.line_width + LAYER_WIDTH[name]) * pixel_size
            hidden = HIDDEN_OPACITY_OF_FEW if few else HIDDEN_OPACITY
            _draw_layer(_overlay.tools, layer, width, hidden)
    finally:
        gpu.state.blend_set(before[0])
        gpu.state.depth_test_set(before[1])
        gpu.state.depth_mask_set(before[2])
        # Blender remembers the bound shader by its address, and skips part of the binding of a new
        # one that is made there after ours are gone (seen with Vulkan: wrong colours).
        gpu.shader.from_builtin("UNIFORM_COLOR").bind()


def _draw_faces(tools: _Tools, drawn: _Drawn, display: Any) -> None:
    """Draw the planes, and the faces of empty leaves."""
    cells = drawn.cells
    if display.planes and cells.planes is not None:
        run = selection.depth_run(drawn.plane_depth, display)
        if run[1] > run[0]:
            by_count = selection.coloured_by(cells, display) == "count"
            colour = INNER_COLOUR if by_count else None
            _draw_some_faces(tools, drawn, display, drawn.plane_faces, run, PLANE_COVER, colour)
    if display.tint_empty:
        run = selection.depth_run(cells.depth[drawn.empty], display)
        if run[1] > run[0]:
            _draw_some_faces(tools, drawn, display, drawn.empty_faces, run, TINT_COVER, EMPTY_TINT)


def _draw_some_faces(
    tools: _Tools,
    drawn: _Drawn,
    display: Any,
    faces: overlay_upload.Faces,
    run: tuple[int, int],
    cover: float,
    colour: tuple[float, float, float] | None,
) -> None:
    """Draw a run of faces in one colour, or as cells are coloured."""
    shader = tools.faces_shader
    shader.bind()
    overlay_shader.set_view(shader)
    _set_colouring(shader, tools, drawn.cells, display)
    if colour is not None:
        shader.uniform_int("coloured_by", overlay_shader.COLOURINGS["plain"])
    shader.uniform_float("plain_colour", colour or INNER_COLOUR)
    area = faces.area(*run, selection.step_shown(drawn.cells, display))
    opacity = face_opacity(area, drawn.surface, cover * display.opacity)
    shader.uniform_float("opacity", opacity)
    shader.uniform_sampler("faces", faces.faces)
    _draw_run(shader, tools.triangle, faces.starts, *run)


def _draw_lines(tools: _Tools, drawn: _Drawn, display: Any, pixel_size: float) -> None:
    """Draw the outlines of planes, and the edges of cells."""
    cells = drawn.cells
    width = display.line_width * pixel_size
    shader = tools.cells_shader
    shader.bind()
    overlay_shader.set_view(shader, width)
    _set_colouring(shader, tools, cells, display)
    shader.uniform_float("opacity", display.opacity * min(width, 1.0))
    shader.uniform_int("leaves_only", 0)
    if display.planes and cells.planes is not None:
        first, last = selection.depth_run(drawn.plane_depth, display)
        if last > first:
            shader.uniform_sampler("cells", drawn.plane_lines.cells)
            shader.uniform_sampler("steps", drawn.plane_lines.steps)
            _draw_run(shader, tools.edge, drawn.plane_lines.starts, first, last)

    shader.uniform_int("leaves_only", display.leaves_only)
    replayed = selection.step_shown(cells, display) is not None
    # Backwards: what matters most comes last, and so on top.
    for first, last in reversed(selection.drawn_runs(drawn.sections, display, replayed)):
        if last > first:
            shader.uniform_sampler("cells", drawn.lines.cells)
            shader.uniform_sampler("steps", drawn.lines.steps)
            shape = tools.cube if drawn.lines.are_boxes else tools.edge
            _draw_run(shader, shape, drawn.lines.starts, first, last)


def _set_colouring(shader: gpu.types.GPUShader, tools: _Tools, cells: Cells, display: Any) -> None:
    """Set the uniforms that say what colours mean, and which step of the building is shown."""
    step = selection.step_shown(cells, display)
    shader.uniform_int("shown_step", -1 if step is None else step)
    colouring = selection.coloured_by(cells, display)
    shader.uniform_int("coloured_by", overlay_shader.COLOURINGS[colouring])
    shader.uniform_float("maximum", float(max(selection.colour_maximum(cells, display), 1)))
    shader.uniform_sampler("colours", tools.colours)


def _draw_run(
    shader: gpu.types.GPUShader, shape: gpu.types.GPUBatch, starts: np.ndarray, first: int,
    last: int,
) -> None:  # fmt: skip
    """Draw the shapes of the items first ... last - 1."""
    begin, end = int(starts[first]), int(starts[last])
    if end > begin:
        # Our own offset: whether gl_InstanceID counts from instance_start differs.
        shader.uniform_int("first", begin)
        shape.draw_instanced(shader, instance_count=end - begin)


def _draw_layer(tools: _Tools, layer: _Layer, width: float, hidden: float) -> None:
    """Draw the lines of a layer, faint where they lie behind something."""
    shader = tools.paths_shader
    shader.bind()
    overlay_shader.set_view(shader, width)
    for depth_test, opacity in (("GREATER", hidden), ("LESS_EQUAL", 1.0)):
        gpu.state.depth_test_set(depth_test)
        shader.uniform_float("opacity", opacity)
        layer.batch.draw(shader)
