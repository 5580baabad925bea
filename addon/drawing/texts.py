"""Texts on the screen: set by Blender, each with a backdrop, legible whatever is behind."""

from __future__ import annotations

import blf
import gpu
from gpu_extras.batch import batch_for_shader

from ...core.colours import luminance
from .labels import Room

BRIGHT = 0.4
"""Luminance from which on a background is bright."""

DARK_TEXT, BRIGHT_TEXT = 0.3, 0.55
"""Luminance that coloured text has at most on a bright background, and at least on a dark one."""

BACKDROP = 0.72
"""Opacity of what is behind a text."""

Colour = tuple[float, float, float]


class Screen:
    """Texts of one size with backdrops, gathered and then drawn at once."""

    def __init__(self, text_size: float, behind: Colour) -> None:
        self.text_size, self.behind = text_size, behind
        self.is_bright = luminance(behind) > BRIGHT
        self._texts: list[tuple[str, float, float, Colour]] = []
        self._rectangles: list[Room] = []

    def inside(self, room: Room) -> Room:
        """Return a room without its edge, where no text stands."""
        edge = 0.8 * self.text_size
        return Room(room.left + edge, room.bottom + edge, room.right - edge, room.top - edge)

    @property
    def line(self) -> float:
        """From one line to the next."""
        return 1.45 * self.text_size

    def size_of(self, text: str) -> tuple[float, float]:
        """Return width and height of a text, whatever letters it has."""
        # Blender's font has one size at a time, and there may be a screen of another.
        blf.size(0, self.text_size)
        return blf.dimensions(0, text)[0], self.text_size

    def add(self, text: str, left: float, bottom: float, colour: Colour | None = None) -> Room:
        """Add a text; return what it takes."""
        width, height = self.size_of(text)
        margin = 0.3 * self.text_size
        place = Room(left - margin, bottom - margin, left + width + margin, bottom + height)
        self._rectangles.append(place)
        self._texts.append((text, left, bottom, self._legible(colour)))
        return place

    def _legible(self, colour: Colour | None) -> Colour:
        """Return a colour that stands out from the background."""
        if colour is None:
            return (0.05, 0.05, 0.05) if self.is_bright else (0.95, 0.95, 0.95)
        found, (red, green, blue) = luminance(colour), colour
        if self.is_bright:
            share = min(1.0, DARK_TEXT / max(found, 1e-3))
            return share * red, share * green, share * blue
        share = max(0.0, (BRIGHT_TEXT - found) / (1.0 - found + 1e-3))
        return red + share * (1 - red), green + share * (1 - green), blue + share * (1 - blue)

    def draw(self) -> None:
        """Draw all of it."""
        if not self._texts:
            return
        corners: list[tuple[float, float]] = []
        triangles: list[tuple[int, int, int]] = []
        for room in self._rectangles:
            first = len(corners)
            corners += [(room.left, room.bottom), (room.right, room.bottom),
                        (room.right, room.top), (room.left, room.top)]  # fmt: skip
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
        shader = gpu.shader.from_builtin("UNIFORM_COLOR")
        batch = batch_for_shader(shader, "TRIS", {"pos": corners}, indices=triangles)
        before = gpu.state.blend_get()
        gpu.state.blend_set("ALPHA")
        shader.bind()
        shader.uniform_float("color", (*self.behind, BACKDROP))
        batch.draw(shader)
        blf.size(0, self.text_size)
        for text, left, bottom, colour in self._texts:
            blf.position(0, left, bottom, 0.0)
            blf.color(0, *colour, 1.0)
            blf.draw(0, text)
        gpu.state.blend_set(before)

    def in_lines(self, text: str, width: float) -> list[str]:
        """Return a text in lines that are no wider than `width`, unless a word is."""
        lines = [""]
        for word in text.split(" "):
            longer = f"{lines[-1]} {word}".strip()
            if lines[-1] and self.size_of(longer)[0] > width:
                lines.append(word)
            else:
                lines[-1] = longer
        return lines
