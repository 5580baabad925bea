"""The picture of a lesson over its scene: lines and faces in space, texts and images on the screen.

It is drawn into the viewports of one scene alone. Nothing here holds a reference to Blender's data.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import gpu
import numpy as np

from ...core.colours import luminance
from ...core.printing import print_lines, print_traceback
from . import labels, overlay_shader, overlay_upload
from .labels import Room
from .overlay import tag_redraw
from .texts import BRIGHT, Colour, Screen
from .viewport import room_in
from .words import IMAGE_GAP, Words, room_of_images, words_of

if TYPE_CHECKING:  # only the types: their modules bring Numba in
    from ...core.lessons.picture import Mark, Picture

LINE_WIDTH = 1.8
"""Width of lines, in pixels on a screen of ordinary resolution."""

HIDDEN_OPACITY, HIDDEN_OPACITY_OF_FEW = 0.25, 0.5
"""Opacity of those parts of lines that lie behind something, of many and of few."""

FEW_LINES = 2000
"""So many lines do not hide each other."""

HIDDEN_FACES = 0.4
"""Opacity of those parts of faces that lie behind something."""

DARK_ENOUGH = 0.55
"""Luminance that lines on a bright background have at most."""

LARGE = 1.7
"""How much larger large text is."""

MOST_FOR_FIGURES, LEAST_HEIGHT = 0.4, 0.3
"""Share of the viewport's width that is kept free for figures at most, and of its height that is
left below them at least."""


class _Tools(NamedTuple):
    """What the graphics card holds whatever there is to draw."""

    lines: gpu.types.GPUShader
    panes: gpu.types.GPUShader
    image: gpu.types.GPUShader


class _Drawn:
    """A picture, and what of it is on the graphics card."""

    def __init__(self, picture: Picture, heading: str) -> None:
        from ...core.lessons.picture import in_columns

        self.picture, self.heading = picture, heading
        self.columns = in_columns(picture.marks)
        lowest = [np.asarray(column[-1].position, float) for column in self.columns]
        self.positions = np.array(lowest)

    @cached_property
    def lines(self) -> gpu.types.GPUBatch:
        """The lines."""
        segments = self.picture.segments
        return overlay_upload.line_batch(segments[:, 0], segments[:, 1], self.picture.colours)

    @cached_property
    def panes(self) -> gpu.types.GPUBatch:
        """The faces."""
        return overlay_upload.pane_batch(self.picture.faces, self.picture.face_colours)

    @cached_property
    def images(self) -> list[gpu.types.GPUTexture]:
        """The images."""
        return [overlay_upload.image_texture(image.pixels) for image in self.picture.images]


class _State:
    """The one picture of this Blender."""

    def __init__(self) -> None:
        self.handlers: list[Any] = []
        self.tools: _Tools | None = None
        self.drawn: _Drawn | None = None
        self.owner = 0
        self.failed = False
        # Where the first image was drawn last, by the address of the region.
        self.image_places: dict[int, Room] = {}


_state = _State()


# ------------------------------------------------------------------------------ what to show


def show(picture: Picture, owner: int, heading: str = "") -> None:
    """Show a picture from the next draw on.

    Parameters
    ----------
    owner : int
        Session id of the Blender scene over which it is drawn.
    heading : str
        What stands above it where text is large.
    """
    _state.failed = False
    _state.drawn, _state.owner = _Drawn(picture, heading), owner
    _state.image_places.clear()
    if not _state.handlers:
        add = bpy.types.SpaceView3D.draw_handler_add
        for callback, when in ((_draw_in_space, "POST_VIEW"), (_draw_on_screen, "POST_PIXEL")):
            _state.handlers.append(add(callback, (), "WINDOW", when))
    tag_redraw()


def hide() -> None:
    """Show none, and let go of everything."""
    while _state.handlers:
        bpy.types.SpaceView3D.draw_handler_remove(_state.handlers.pop(), "WINDOW")
    _state.drawn = _state.tools = None
    tag_redraw()


def pixel_at(region: bpy.types.Region, x: float, y: float) -> tuple[float, float] | None:
    """Return where a point of a region lies in the image that is drawn there; None if beside it.

    Returns
    -------
    across, down : float
        Shares of its width and height, from its upper left corner.
    """
    place = _state.image_places.get(region.as_pointer())
    if place is None or not (place.left <= x < place.right and place.bottom <= y < place.top):
        return None
    across = (x - place.left) / (place.right - place.left)
    return across, (place.top - y) / (place.top - place.bottom)


# ---------------------------------------------------------------------------------- drawing


def _draw_in_space() -> None:
    _guarded(_lines_and_faces)


def _draw_on_screen() -> None:
    _guarded(_texts_and_images)


def _guarded(draw: Any) -> None:
    """Draw where the picture belongs; report the first failure and then stop."""
    context, drawn = bpy.context, _state.drawn
    if drawn is None or _state.failed or context.scene.session_uid != _state.owner:
        return
    if not context.space_data.overlay.show_overlays:
        return
    try:
        draw(context, drawn)
    except Exception as error:  # whatever it is, Blender would go on calling
        _state.failed = True
        print_traceback(error)
        print_lines("AccelScope: the lesson is not drawn until there is something new", None)


def _lines_and_faces(context: bpy.types.Context, drawn: _Drawn) -> None:
    is_bright = luminance(background(context)) > BRIGHT
    draw_lines_and_faces(drawn, context.preferences.system.pixel_size, is_bright)


def _texts_and_images(context: bpy.types.Context, drawn: _Drawn) -> None:
    region, is_large = context.region, context.scene.accelscope.teaching.large_text
    draw_texts_and_images(
        drawn,
        np.array(context.region_data.perspective_matrix),
        (region.width, region.height),
        room_in(context.area),
        text_size(context, is_large),
        background(context),
        is_large,
    )


def text_size(context: bpy.types.Context, is_large: bool) -> float:
    """Return the size of texts in pixels."""
    points = context.preferences.ui_styles[0].widget.points
    return points * context.preferences.system.ui_scale * (LARGE if is_large else 1.0)


def rooms_for_lines(context: bpy.types.Context, area: bpy.types.Area, is_large: bool) -> list[Room]:
    """Return what of a viewport words and images leave for lines and faces, in pixels.

    That has corners, so there are several rectangles in it: any of them will do.
    """
    room = room_in(area)
    if _state.drawn is None:
        return [room]
    screen, picture = Screen(text_size(context, is_large), (0.0, 0.0, 0.0)), _state.drawn.picture
    inner, taken, rooms = screen.inside(room), [], [room]
    if picture.images:
        corner = room_of_images(screen, picture.images, inner)
        taken.append(corner)
        rooms = [room._replace(right=corner.left), room._replace(bottom=corner.top)]
    if is_large:
        lines = max((len(column) for column in _state.drawn.columns), default=1)
        # In space there is room for one line; those of a column need more, and stand above.
        legend = (lines - 1) * screen.line
        screen, words = words_of(screen, picture, _state.drawn.heading, inner, taken)
        top = inner.top - screen.line
        rooms = [
            each._replace(top=max(each.top - legend, 0.5 * (each.bottom + each.top)))
            for one in rooms
            for each in _beside_words(one, words, top)
        ]
    return rooms


def _beside_words(room: Room, words: Words, top: float) -> tuple[Room, Room]:
    """Return what is right of the figures, and what is below; the caption is below both.

    Parameters
    ----------
    top : float
        Where the heading ends, which is short.
    """
    right = max((each.right for each in words.figures), default=room.left)
    right = min(right, room.left + MOST_FOR_FIGURES * (room.right - room.left))
    below = min((each.bottom for each in words.figures), default=top)
    floor = max([room.bottom, *(each.top for each in words.caption)])
    above = max(below, floor + LEAST_HEIGHT * (top - floor))
    return Room(right, floor, room.right, top), Room(room.left, floor, room.right, above)


def background(context: bpy.types.Context) -> Colour:
    """Return what the viewport has behind everything, in sRGB."""
    shading = context.space_data.shading
    if shading.type in ("SOLID", "WIREFRAME"):
        if shading.background_type == "VIEWPORT":
            return from_linear(shading.background_color)
        if shading.background_type == "WORLD" and context.scene.world is not None:
            return from_linear(context.scene.world.color)
    gradients = context.preferences.themes[0].view_3d.space.gradients
    high, low = tuple(gradients.high_gradient), tuple(gradients.gradient)
    if gradients.background_type == "SINGLE_COLOR":
        low = high
    red, green, blue = (0.5 * (one + other) for one, other in zip(high, low, strict=True))
    return red, green, blue


def from_linear(colour: Sequence[float]) -> Colour:
    """Return a linear colour in sRGB."""
    red, green, blue = (
        12.92 * value if value < 0.0031308 else 1.055 * min(value, 1.0) ** (1 / 2.4) - 0.055
        for value in colour
    )
    return red, green, blue


def draw_lines_and_faces(drawn: _Drawn, pixel_size: float, is_bright: bool) -> None:
    """Draw what is in space with the current matrices into the current frame buffer."""
    if _state.tools is None:
        _state.tools = _Tools(
            overlay_shader.paths_shader(), overlay_shader.panes_shader(),
            overlay_shader.image_shader(),
        )  # fmt: skip
    picture, brightest = drawn.picture, DARK_ENOUGH if is_bright else 1.0
    before = gpu.state.blend_get(), gpu.state.depth_test_get(), gpu.state.depth_mask_get()
    gpu.state.blend_set("ALPHA")
    gpu.state.depth_mask_set(False)
    try:
        if len(picture.faces):
            shader = _state.tools.panes
            shader.bind()
            overlay_shader.set_view(shader)
            overlay_shader.draw_twice(shader, drawn.panes, HIDDEN_FACES)
        if len(picture.segments):
            few = len(picture.segments) <= FEW_LINES
            shader = _state.tools.lines
            shader.bind()
            overlay_shader.set_view(shader, LINE_WIDTH * pixel_size)
            hidden = HIDDEN_OPACITY_OF_FEW if few else HIDDEN_OPACITY
            overlay_shader.draw_twice(shader, drawn.lines, hidden, brightest)
    finally:
        gpu.state.blend_set(before[0])
        gpu.state.depth_test_set(before[1])
        gpu.state.depth_mask_set(before[2])
        gpu.shader.from_builtin("UNIFORM_COLOR").bind()  # see overlay.draw


def draw_texts_and_images(
    drawn: _Drawn, matrix: np.ndarray, size: tuple[int, int], room: Room, text_size: float,
    behind: Colour, is_large: bool,
) -> None:  # fmt: skip
    """Draw what stands on the screen, in pixels from the lower left of a region.

    Parameters
    ----------
    matrix : (4, 4) float64
        From the world to clip space.
    size : (width, height)
        Of the region.
    room : Room
        What of it is not covered.
    text_size : float
        In pixels.
    behind : (3,) of float
        What the viewport has behind everything.
    is_large : bool
        For a projector: heading, figures and caption stand in the viewport, too.
    """
    screen = Screen(text_size, behind)
    inner = screen.inside(room)
    taken = []
    if drawn.picture.images:
        taken.append(_draw_images(screen, drawn, inner))
    if is_large:
        screen_of_words, words = words_of(screen, drawn.picture, drawn.heading, inner, taken)
        screen_of_words.draw()
        taken += [*words.heading, *words.figures, *words.caption]
    if drawn.columns:
        seen = labels.project(drawn.positions, matrix, *size)
        sizes = np.array([_size_of(screen, column) for column in drawn.columns])
        seen = labels.raised(seen, sizes[:, 1], text_size, inner.top)
        found = labels.place(seen, sizes, inner, 0.5 * text_size, taken)
        for column, place in zip(drawn.columns, found, strict=True):
            if place is None:
                continue
            for mark in column:
                bottom = place.top - text_size - mark.line * screen.line
                screen.add(mark.text, place.left, bottom, mark.colour)
    screen.draw()


def _size_of(screen: Screen, column: Sequence[Mark]) -> tuple[float, float]:
    """Return width and height of texts below each other."""
    width = max(screen.size_of(mark.text)[0] for mark in column)
    return width, screen.text_size + (len(column) - 1) * screen.line


def _draw_images(screen: Screen, drawn: _Drawn, room: Room) -> Room:
    """Draw the images one above the other in the lower right corner; return what they take."""
    assert _state.tools is not None
    taken = room_of_images(screen, drawn.picture.images, room)
    left, bottom, width = taken.left, taken.bottom, taken.right - taken.left
    for image, texture in zip(drawn.picture.images, drawn.images, strict=True):
        height = width * image.pixels.shape[0] / image.pixels.shape[1]
        shader = _state.tools.image
        shader.bind()
        shader.uniform_sampler("image", texture)
        overlay_upload.image_batch(left, bottom, room.right, bottom + height).draw(shader)
        if image is drawn.picture.images[0]:
            region = bpy.context.region
            place = Room(left, bottom, room.right, bottom + height)
            _state.image_places[region.as_pointer() if region else 0] = place
        name = image.name.replace("_", " ").capitalize()
        label = screen.add(name, left + 0.3 * screen.text_size, bottom + height + IMAGE_GAP)
        bottom = label.top + screen.text_size
    return taken
