"""The overlay: cells and ray paths over the scene in every 3D viewport.

Cells are uploaded once, at the first draw after :func:`set_cells`, in three sections: leaves with
primitives, inner nodes, empty leaves, each sorted by depth. So whatever the display settings ask
for is one run of cells per section, which is drawn with one call; moving a slider uploads nothing.

Nothing here holds a reference to Blender's data, so undo, file load and deleted objects do no harm.
"""

from __future__ import annotations

import traceback
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import gpu
import numpy as np

from . import overlay_shader

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

MAXIMUM_DRAWN = 500_000
"""Cells drawn at most; of more, leaves come first, then inner nodes, then the shallow ones."""

MAXIMUM_HELD = 4_000_000
"""Cells uploaded at most, 32 bytes each."""

PATH_WIDTH = 2.0
"""Width of paths in pixels beyond that of cells."""

HIDDEN_OPACITY = 0.25
"""Opacity of those parts of paths that lie behind something."""


class _Sections(NamedTuple):
    """Cells in the order of their upload.

    Attributes
    ----------
    order : (n,) int
        Index of each cell in `Cells`.
    depth : (n,) int32
        Ascending within each section.
    ends : (3,) int
        Where each section ends: leaves with primitives, inner nodes, empty leaves.
    total : int
        Cells there are, uploaded or not.
    """

    order: np.ndarray
    depth: np.ndarray
    ends: np.ndarray
    total: int


class _Tools(NamedTuple):
    """What the graphics card holds whatever there is to draw."""

    cells_shader: gpu.types.GPUShader
    paths_shader: gpu.types.GPUShader
    cube: gpu.types.GPUBatch
    colours: gpu.types.GPUTexture


class _Overlay:
    """The one overlay of this Blender."""

    def __init__(self) -> None:
        self.handler: Any = None
        self.failed = False
        self.uploads = 0
        self.cells: Cells | None = None
        self.sections: _Sections | None = None
        self.paths: tuple[np.ndarray, np.ndarray] | None = None
        # What is on the graphics card, None when it is to be uploaded at the next draw.
        self.tools: _Tools | None = None
        self.uploaded_cells: gpu.types.GPUTexture | None = None
        self.uploaded_paths: gpu.types.GPUBatch | None = None


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
    set_paths(None)


def set_cells(cells: Cells | None) -> None:
    """Show these cells from the next draw on, or none."""
    _overlay.failed = False
    _overlay.cells = cells
    _overlay.sections = None if cells is None else _sections(cells)
    _overlay.uploaded_cells = None
    tag_redraw()


def set_paths(segments: np.ndarray | None, colours: np.ndarray | None = None) -> None:
    """Show these thick lines from the next draw on, or none: ray paths, highlighted cells.

    Parameters
    ----------
    segments : (k, 2, 3) array_like of float, or None
        Both ends of each line in world space.
    colours : (k, 4) array_like of float
        sRGB and opacity of each line.
    """
    _overlay.failed = False
    _overlay.paths = None
    if segments is not None and len(segments):
        ends = np.asarray(segments, dtype=np.float32).reshape(-1, 2, 3)
        _overlay.paths = ends, np.asarray(colours, dtype=np.float32).reshape(len(ends), 4)
    _overlay.uploaded_paths = None
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
    sections = _overlay.sections
    if sections is None:
        return "no cells"
    wanted = sum(last - first for first, last in _runs(sections, display))
    shown = sum(last - first for first, last in _drawn_runs(sections, display))
    text = f"showing {_spaced(shown)} of {_spaced(sections.total)} cells"
    if shown < wanted or len(sections.order) < sections.total:
        text += f" (at most {_spaced(MAXIMUM_DRAWN)} are drawn)"
    return text


def visible(cells: Cells, display: Any) -> np.ndarray:
    """Return which cells the display settings let through, (n,) bool."""
    shown = (cells.depth >= display.depth_min) & (cells.depth <= display.depth_max)
    if display.leaves_only:
        shown &= cells.is_leaf
    if display.hide_empty:
        shown &= ~(cells.is_leaf & (cells.count == 0))
    return shown


def coloured_by_count(cells: Cells, display: Any) -> bool:
    """Say whether colours show counts: by choice, or because all cells have the same depth."""
    return display.colour_by == "count" or int(cells.depth.max(initial=0)) == 0


def colour_maximum(cells: Cells, display: Any) -> int:
    """Return the depth or count that gets the last colour of the ramp.

    The depth only up to the deepest that is shown: a few levels take the whole ramp.
    """
    if coloured_by_count(cells, display):
        return int(cells.count.max(initial=0))
    return max(min(int(cells.depth.max(initial=0)), display.depth_max), 0)


def _spaced(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _sections(cells: Cells) -> _Sections:
    """Sort cells into the three sections; within each they stay sorted by depth."""
    empty = cells.is_leaf & (cells.count == 0)
    parts = [np.flatnonzero(part) for part in (cells.is_leaf & ~empty, ~cells.is_leaf, empty)]
    order = np.concatenate(parts)[:MAXIMUM_HELD]
    ends = np.minimum(np.cumsum([len(part) for part in parts]), len(order))
    return _Sections(order, cells.depth[order], ends, len(cells))


def _runs(sections: _Sections, display: Any) -> list[tuple[int, int]]:
    """Return the cells to draw in each section as (first, last + 1)."""
    runs = []
    first = 0
    hidden = (False, display.leaves_only, display.hide_empty)
    for end, is_hidden in zip(sections.ends.tolist(), hidden):
        depth = sections.depth[first:end]
        low = int(np.searchsorted(depth, display.depth_min, side="left"))
        high = int(np.searchsorted(depth, display.depth_max, side="right"))
        runs.append((first, first) if is_hidden else (first + low, first + max(low, high)))
        first = end
    return runs


def _drawn_runs(sections: _Sections, display: Any) -> list[tuple[int, int]]:
    """Return the runs cut to MAXIMUM_DRAWN cells in all."""
    left = MAXIMUM_DRAWN
    runs = []
    for first, last in _runs(sections, display):
        last = min(last, first + left)
        left -= last - first
        runs.append((first, last))
    return runs


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
    """Draw cells and paths with the current matrices into the current frame buffer.

    Parameters
    ----------
    display : object
        Attributes show, depth_min, depth_max, leaves_only, hide_empty, opacity, line_width,
        colour_by ("depth" or "count").
    pixel_size : float
        Pixels per unit of line width: 2 on a screen of high resolution.
    """
    if not display.show or (_overlay.sections is None and _overlay.paths is None):
        return
    if _overlay.tools is None:
        _overlay.tools = _Tools(
            overlay_shader.cells_shader(), overlay_shader.paths_shader(),
            overlay_shader.cube_batch(), overlay_shader.ramp_texture(),
        )  # fmt: skip
    before = gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    # Without the soft edges of one line cutting holes into the next.
    gpu.state.depth_mask_set(False)
    try:
        if _overlay.sections is not None:
            _draw_cells(_overlay.tools, _overlay.sections, display, pixel_size)
        if _overlay.paths is not None:
            _draw_paths(_overlay.tools, _overlay.paths, display, pixel_size)
    finally:
        gpu.state.blend_set(before[0])
        gpu.state.depth_test_set(before[1])
        gpu.state.depth_mask_set(before[2])
        # Blender remembers the bound shader by its address, and skips part of the binding of a new
        # one that is made there after ours are gone (seen with Vulkan: wrong colours).
        gpu.shader.from_builtin("UNIFORM_COLOR").bind()


def _draw_cells(tools: _Tools, sections: _Sections, display: Any, pixel_size: float) -> None:
    runs = _drawn_runs(sections, display)
    if all(first == last for first, last in runs):
        return
    cells = _overlay.cells
    assert cells is not None
    if _overlay.uploaded_cells is None:
        _overlay.uploads += 1
        _overlay.uploaded_cells = overlay_shader.cells_texture(cells, sections.order)
    shader = tools.cells_shader
    by_count = coloured_by_count(cells, display)
    width = display.line_width * pixel_size
    gpu.state.depth_test_set("LESS_EQUAL")
    shader.bind()
    overlay_shader.set_view(shader, width)
    shader.uniform_float("opacity", display.opacity * min(width, 1.0))
    shader.uniform_int("by_count", by_count)
    shader.uniform_float("maximum", float(max(colour_maximum(cells, display), 1)))
    shader.uniform_sampler("cells", _overlay.uploaded_cells)
    shader.uniform_sampler("colours", tools.colours)
    # Backwards: what matters most comes last, and so on top.
    for first, last in reversed(runs):
        if last > first:
            # Our own offset: whether gl_InstanceID counts from instance_start differs.
            shader.uniform_int("first_cell", first)
            tools.cube.draw_instanced(shader, instance_count=last - first)


def _draw_paths(
    tools: _Tools, paths: tuple[np.ndarray, np.ndarray], display: Any, pixel_size: float
) -> None:
    if _overlay.uploaded_paths is None:
        _overlay.uploads += 1
        segments, colours = paths
        _overlay.uploaded_paths = overlay_shader.line_batch(segments[:, 0], segments[:, 1], colours)
    shader = tools.paths_shader
    shader.bind()
    overlay_shader.set_view(shader, (display.line_width + PATH_WIDTH) * pixel_size)
    for depth_test, opacity in (("GREATER", HIDDEN_OPACITY), ("LESS_EQUAL", 1.0)):
        gpu.state.depth_test_set(depth_test)
        shader.uniform_float("opacity", opacity)
        _overlay.uploaded_paths.draw(shader)
