"""The overlay: cells over the scene in every 3D viewport.

Cells are uploaded once, at the first draw after :func:`set_cells`, in three sections: leaves with
primitives, inner nodes, empty leaves, each sorted by depth (:mod:`.selection`). So whatever the
display settings ask for is one run of cells per section, which is drawn with one call; moving a
slider uploads nothing. The same goes for the planes that cut cells, and for the faces of empty
leaves; both are uploaded when they are asked for the first time. All of it comes prepared
(:mod:`.drawable`): drawing computes nothing that takes longer the more cells there are.

Nothing here holds a reference to Blender's data, so undo, file load and deleted objects do no harm.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import gpu
import numpy as np

from ...core.colours import EMPTY_TINT, INNER_COLOUR, face_opacity
from ...core.printing import print_lines, print_traceback
from . import overlay_shader, overlay_upload, selection, shown

if TYPE_CHECKING:
    from .drawable import Drawable, FaceBatch, LineBatch

FADED = 0.3
"""How opaque cells are that are not those of the scene any more."""

TINT_COVER = 0.6
"""Share of the view that tinted empty leaves cover together, at full opacity."""

PLANE_COVER = 0.4
"""Share of the view that planes cover together, at full opacity."""


class _Tools(NamedTuple):
    """What the graphics card holds whatever there is to draw."""

    cells_shader: gpu.types.GPUShader
    faces_shader: gpu.types.GPUShader
    cube: gpu.types.GPUBatch
    edge: gpu.types.GPUBatch
    triangle: gpu.types.GPUBatch
    colours: gpu.types.GPUTexture


class _LinesOnCard(NamedTuple):
    """Lines whose ends and steps are textures, see :class:`.drawable.LineBatch`."""

    ends: gpu.types.GPUTexture
    steps: gpu.types.GPUTexture
    starts: np.ndarray


class _Drawn:
    """The cells to draw, and what of them is on the graphics card: each part once it is needed."""

    def __init__(self, drawable: Drawable) -> None:
        self.drawable = drawable

    def _lines(self, lines: LineBatch) -> _LinesOnCard:
        _overlay.uploads += 1
        textures = overlay_upload.texture(lines.ends), overlay_upload.texture(lines.steps)
        return _LinesOnCard(*textures, lines.starts)

    def _faces(self, faces: FaceBatch) -> gpu.types.GPUTexture:
        _overlay.uploads += 1
        return overlay_upload.texture(faces.corners)

    @cached_property
    def boxes(self) -> _LinesOnCard:
        """The cells that are boxes, in the order of the sections."""
        return self._lines(self.drawable.boxes)

    @cached_property
    def edges(self) -> _LinesOnCard:
        """The edges of those that are not."""
        return self._lines(self.drawable.edges)

    @cached_property
    def plane_lines(self) -> _LinesOnCard:
        """The outlines of the planes."""
        return self._lines(self.drawable.plane_lines)

    @cached_property
    def plane_faces(self) -> gpu.types.GPUTexture:
        """The planes."""
        return self._faces(self.drawable.plane_faces)

    @cached_property
    def empty_faces(self) -> gpu.types.GPUTexture:
        """The faces of empty leaves."""
        return self._faces(self.drawable.empty_faces)


class _Overlay:
    """The one overlay of this Blender."""

    def __init__(self) -> None:
        self.handler: Any = None
        self.failed = False
        self.uploads = 0
        self.tools: _Tools | None = None
        self.drawn: _Drawn | None = None
        self.without_cells = 0
        self.is_stale: Callable[[bpy.types.Context], bool] = lambda context: False
        self.strength = 1.0


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
    hide_cells_in(0)


def set_cells(drawable: Drawable | None) -> None:
    """Show these cells from the next draw on, or none."""
    _overlay.failed = False
    _overlay.drawn = None if drawable is None else _Drawn(drawable)
    tag_redraw()


def fade_if(is_stale: Callable[[bpy.types.Context], bool]) -> None:
    """Draw cells faint where this says that they are not those of the scene any more."""
    _overlay.is_stale = is_stale


def hide_cells_in(owner: int) -> None:
    """Leave out the cells in one of Blender's scenes, by its session id; 0 is none of them."""
    _overlay.without_cells = owner
    tag_redraw()


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
    return shown.in_words(drawn.drawable, display) if drawn else "no cells"


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
        _overlay.strength = FADED if _overlay.is_stale(context) else 1.0
        has_cells = context.scene.session_uid != _overlay.without_cells
        draw(properties.display, context.preferences.system.pixel_size, has_cells)
    except Exception as error:  # whatever it is, Blender would go on calling
        # A failing callback would print its traceback again at every redraw of every viewport.
        # Its removal waits for disable(): Blender is walking through the list of callbacks.
        _overlay.failed = True
        print_traceback(error)
        print_lines("AccelScope: the overlay is off until there is something new to show", None)


def draw(display: Any, pixel_size: float = 1.0, has_cells: bool = True) -> None:
    """Draw the cells with the current matrices into the current frame buffer.

    Parameters
    ----------
    display : object
        Attributes show (cells and rays), depth_min, depth_max, leaves_only, hide_empty,
        tint_empty, planes, opacity, line_width, colour_by ("depth", "count" or "order").
    pixel_size : float
        Pixels per unit of line width: 2 on a screen of high resolution.
    has_cells : bool
        Whether cells are drawn.
    """
    drawn = _overlay.drawn
    if not has_cells or not display.show or drawn is None:
        return
    if _overlay.tools is None:
        _overlay.tools = _Tools(
            overlay_shader.cells_shader(), overlay_shader.faces_shader(),
            overlay_upload.cube_batch(),
            overlay_upload.edge_batch(), overlay_upload.triangle_batch(),
            overlay_upload.ramp_texture(),
        )  # fmt: skip
    before = gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    # Without the soft edges of one line cutting holes into the next.
    gpu.state.depth_mask_set(False)
    gpu.state.depth_test_set("LESS_EQUAL")
    try:
        # Faces first: lines stay crisp on top of them.
        _draw_faces(_overlay.tools, drawn, display)
        _draw_lines(_overlay.tools, drawn, display, pixel_size)
    finally:
        gpu.state.blend_set(before[0])
        gpu.state.depth_test_set(before[1])
        gpu.state.depth_mask_set(before[2])
        # Blender remembers the bound shader by its address, and skips part of the binding of a new
        # one that is made there after ours are gone (seen with Vulkan: wrong colours).
        gpu.shader.from_builtin("UNIFORM_COLOR").bind()


def _draw_faces(tools: _Tools, drawn: _Drawn, display: Any) -> None:
    """Draw the planes, and the faces of empty leaves."""
    drawable = drawn.drawable
    if display.planes:
        run = selection.depth_run(drawable.plane_faces.depth, display)
        if run[1] > run[0]:
            shader = _bind_faces(tools, drawable, drawable.plane_faces, display, PLANE_COVER)
            shader.uniform_sampler("faces", drawn.plane_faces)
            _draw_run(shader, tools.triangle, drawable.plane_faces.starts, *run)
    if display.tint_empty:
        run = selection.depth_run(drawable.empty_faces.depth, display)
        if run[1] > run[0]:
            shader = _bind_faces(tools, drawable, drawable.empty_faces, display, TINT_COVER)
            shader.uniform_int("coloured_by", overlay_shader.COLOURINGS["plain"])
            shader.uniform_float("plain_colour", EMPTY_TINT)
            shader.uniform_sampler("faces", drawn.empty_faces)
            _draw_run(shader, tools.triangle, drawable.empty_faces.starts, *run)


def _bind_faces(
    tools: _Tools, drawable: Drawable, faces: FaceBatch, display: Any, cover: float
) -> gpu.types.GPUShader:
    """Bind the shader of faces, to draw them coloured as cells and so opaque that all `cover`.

    Coloured by count they are plain: they have none, as inner nodes.
    """
    shader = tools.faces_shader
    shader.bind()
    overlay_shader.set_view(shader)
    _set_colouring(shader, tools, drawable.extent, display)
    shader.uniform_float("plain_colour", INNER_COLOUR)
    area = faces.areas.total(display.depth_min, display.depth_max)
    strength = display.opacity * _overlay.strength
    opacity = face_opacity(area, drawable.surface, cover * strength)
    shader.uniform_float("opacity", opacity)
    return shader


def _draw_lines(tools: _Tools, drawn: _Drawn, display: Any, pixel_size: float) -> None:
    """Draw the outlines of planes, and the edges of cells."""
    drawable = drawn.drawable
    width = display.line_width * pixel_size
    shader = tools.cells_shader
    shader.bind()
    overlay_shader.set_view(shader, width)
    _set_colouring(shader, tools, drawable.extent, display)
    shader.uniform_float("opacity", display.opacity * _overlay.strength * min(width, 1.0))
    if display.planes:
        first, last = selection.depth_run(drawable.plane_faces.depth, display)
        if last > first:
            _draw_some_lines(shader, tools.edge, drawn.plane_lines, first, last)

    # Backwards: what matters most comes last, and so on top.
    for first, last in reversed(selection.drawn_runs(drawable.sections, display)):
        if drawable.boxes.starts[last] > drawable.boxes.starts[first]:
            _draw_some_lines(shader, tools.cube, drawn.boxes, first, last)
        if drawable.edges.starts[last] > drawable.edges.starts[first]:
            _draw_some_lines(shader, tools.edge, drawn.edges, first, last)


def _draw_some_lines(
    shader: gpu.types.GPUShader, shape: gpu.types.GPUBatch, lines: _LinesOnCard, first: int,
    last: int,
) -> None:  # fmt: skip
    """Draw the lines of the items first ... last - 1."""
    shader.uniform_sampler("cells", lines.ends)
    shader.uniform_sampler("steps", lines.steps)
    _draw_run(shader, shape, lines.starts, first, last)


def _set_colouring(
    shader: gpu.types.GPUShader, tools: _Tools, extent: selection.Extent, display: Any
) -> None:
    """Set the uniforms that say what colours mean."""
    colouring = selection.coloured_by(extent, display)
    shader.uniform_int("coloured_by", overlay_shader.COLOURINGS[colouring])
    shader.uniform_float("maximum", float(max(selection.colour_maximum(extent, display), 1)))
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
