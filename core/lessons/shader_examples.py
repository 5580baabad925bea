"""Lessons "ray_generation_shader" and "closest_hit_shader": the slides' HLSL beside our program.

Line by line: the line of the slide, the line of :mod:`..pipeline.programs.lecture`, and what it has
done for one pixel. The slides' lines are read from the comments of the program, which is run as it
stands; its picture is beside.

Lecture, slides "Ray Generation shader example" and "Closest Hit shader (color from barycentric)".
"""

from __future__ import annotations

import io
import tokenize
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..geometry.geometry import lines_of
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..geometry.triangles import Triangles
from ..kernels import has_numba, is_plain
from ..pipeline.launch import Pipeline
from ..pipeline.loading import program_named, source_of
from ..progress import Progress
from ..scene import Camera, Scene
from ..scene.camera_rays import camera_rays
from ..settings import setting
from .drawing import GREEN, GREY, ORANGE, Faces, Lines, coloured, column, extent_of, picture_of
from .lesson import Lesson, Play, Subject
from .one_ray import RAY
from .picture import Image, Mark, Picture, Row
from .pipeline_states import suits

WIDTH, PLAIN_WIDTH = 160, 32
"""Pixels in a row, and rows; fewer where nothing is compiled."""

SHOWN = 12
"""Pixels that can be looked at."""


FROM_LEFT = np.array([-0.3, -1.25, 0.6])
"""Where the lesson's own camera stands, seen from the middle of the scene, in diagonals."""


VIEW = np.array([0.55, -0.75, 0.42])
"""Where one looks from."""


class Line(NamedTuple):
    """A line of the slide and of the program."""

    hlsl: str
    python: str


def lines_of_shader(name: str) -> list[Line]:
    """Return the lines of one of the lecture's shaders, with those of the slide behind them."""
    source = source_of("lecture")
    begin = source.index(f"def {name}(")
    text = source[begin : source.index("\n\n\n", begin)]
    comments = {
        token.start[0]: token
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type == tokenize.COMMENT
    }
    found: list[Line] = []
    for number, row in enumerate(text.splitlines(), 1):
        comment = comments.get(number)
        code = row if comment is None else row[: comment.start[1]]
        told = "" if comment is None else comment.string.removesuffix("# fmt: skip")
        told = told.strip("# ")
        if told and code.strip():
            found.append(Line(told, code.strip()))
    return found


def camera_of(scene: Scene) -> Camera:
    """Return the scene's own camera, or one from the left, whose rays are seen from the right."""
    if scene.camera is not None and scene.camera.has_rays:
        return scene.camera
    centre = 0.5 * (scene.lower + scene.upper)
    return Camera(centre + FROM_LEFT * scene.diagonal, centre, np.array([0.0, 0.0, 1.0]), 45.0)


@dataclass(frozen=True)
class Settings:
    """The knobs of the lessons."""

    line: int = setting(
        0, "Line", "Line of the shader that is looked at; the first is 0", minimum=0
    )
    pixel: int = setting(0, "Pixel", "Which of some pixels whose rays hit something", minimum=0)


class ShaderExample(Play):
    """The lecture's program over a scene, and one of its shaders line by line."""

    def __init__(self, shader: str, subject: Subject, progress: Progress) -> None:
        self.shader, self.scene = shader, subject.scene
        self.lines = lines_of_shader(shader)
        size = WIDTH if has_numba() and not is_plain() else PLAIN_WIDTH
        self.rays = camera_rays(camera_of(self.scene), size, size)
        pipeline = Pipeline(subject.structures[0], program_named("lecture"))
        self.launched = pipeline.launch(self.rays, size, size, progress=progress)
        hits, _ = subject.structures[0].trace(self.rays, progress=progress)
        self.pixels = chosen(self.scene, hits.primitive)
        self.hits = []
        for number in self.pixels.tolist():
            states, _ = pipeline.record(self.rays, size, size, number)
            self.hits.append([state for state in states if state.name == "hit"])
        self.ends = {"line": len(self.lines) - 1, "pixel": len(self.pixels) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the shader with one line lit, and what it has done by then."""
        line, pixel = self.lines[settings.line], int(self.pixels[settings.pixel])
        before = " ".join(each.python for each in self.lines[: settings.line + 1])
        value = self._value(line.python, settings.pixel)
        texts = [
            (each.hlsl, ORANGE if k == settings.line else GREY) for k, each in enumerate(self.lines)
        ]
        parts, marks = self._drawn(before, settings.pixel)
        marks += column(self.scene, texts)
        rows = [
            Row(each.hlsl, ("▶ " if k == settings.line else "") + each.python)
            for k, each in enumerate(self.lines)
        ]
        caption = f"HLSL: {line.hlsl}   Here: {line.python}"
        if value:
            caption += f"; in pixel {self._name(pixel)}: {value}"
        return picture_of(parts, caption, marks=marks, rows=rows, images=[self._image(pixel)])

    def ray_shown(self, settings: Settings) -> Rays | None:
        """Return the ray of the pixel."""
        return self.rays.select(self.pixels[settings.pixel : settings.pixel + 1])

    def _name(self, pixel: int) -> str:
        return f"{pixel % self.launched.width},{pixel // self.launched.width}"

    def _image(self, pixel: int) -> Image:
        """Return the picture, with a frame around the pixel."""
        pixels = self.launched.picture.copy()
        y, x = divmod(pixel, self.launched.width)
        top, left = max(y - 3, 0), max(x - 3, 0)
        frame = np.ones(3)
        pixels[top : y + 4, [left, min(x + 3, pixels.shape[1] - 1)]] = frame
        pixels[[top, min(y + 3, pixels.shape[0] - 1)], left : x + 4] = frame
        return Image("lecture", pixels)

    def _value(self, python: str, which: int) -> str:
        """Return what a line has computed for a pixel, in words; empty if there is nothing new."""
        pixel = int(self.pixels[which])
        colour = self.launched.colours.reshape(-1, 4)[pixel]
        hits = self.hits[which]
        numbers = ", ".join(f"{each:.4f}" for each in colour)
        words = {
            "ray.origin": lambda: shown(self.rays.origins[pixel]),
            "ray.direction": lambda: shown(self.rays.directions[pixel]),
            "ray, payload": lambda: (
                f"triangle {hits[0].primitive} is hit" if hits else "nothing is hit"
            ),
            "output.color": lambda: f"({numbers})",
            "attr.barys[0], attr": lambda: f"{colour[0]:.4f}, {colour[1]:.4f}",
            "1.0 - attr": lambda: f"{colour[2]:.4f}, 1",
            "payload.hit_distance": lambda: f"{hits[0].t:.4f}" if hits else "",
        }
        return next((word() for start, word in words.items() if python.startswith(start)), "")

    def _drawn(self, before: str, which: int) -> tuple[list[Lines | Faces], list[Mark]]:
        """Return the ray, the triangle and its weights, as far as the lines so far go."""
        pixel, hits = int(self.pixels[which]), self.hits[which]
        origin, direction = self.rays.origins[pixel], self.rays.directions[pixel]
        size = 0.03 * extent_of(self.scene)
        is_hit_shader = self.shader == "closest_hit"
        end = hits[0].t if hits else 2.0 * self.scene.diagonal / float(np.linalg.norm(direction))
        begin = max(end - self.scene.diagonal / float(np.linalg.norm(direction)), 0.0)
        points = origin + np.array([[begin], [end]]) * direction
        parts: list[Lines | Faces] = []
        marks: list[Mark] = []
        if is_hit_shader or "ray.origin" in before:
            parts.append(coloured(stars(points[:1], np.array([size])), RAY))
        if is_hit_shader or "ray.direction" in before:
            parts.append(coloured(points[None], RAY))
        if not hits or not (is_hit_shader or "ray, payload" in before):
            return parts, marks
        number = np.array([hits[0].primitive])
        parts.append(coloured(lines_of(self.scene.geometry, number)[0], GREEN))
        parts.append(coloured(stars(points[1:], np.array([size])), GREEN))
        colour = self.launched.colours.reshape(-1, 4)[pixel]
        is_coloured = "output.color" in before or "1.0 - attr" in before
        geometry = self.scene.geometry
        if isinstance(geometry, Triangles):
            corners = geometry.corners[number[0]]
            if is_coloured:
                parts.append(Faces(corners[None], np.array([[*colour[:3], 0.85]])))
            if is_hit_shader:
                weights = colour[2], colour[0], colour[1]
                marks += [Mark(corner, f"{weight:.3f}") for corner, weight in zip(corners, weights)]
        if "hit_distance" in before:
            marks.append(Mark(0.5 * (points[0] + points[1]), f"t = {end:.4g}"))
        return parts, marks


def chosen(scene: Scene, primitives: np.ndarray) -> np.ndarray:
    """Return pixels whose triangles are large and seen from the front right, one of each.

    Parameters
    ----------
    primitives : (n,) int
        What the ray of each pixel hits; -1 for none.
    """
    hit = np.flatnonzero(primitives >= 0)
    if not len(hit):
        return np.array([len(primitives) // 2])
    # The middle one of those with the same triangle.
    order = hit[np.argsort(primitives[hit], kind="stable")]
    numbers, first, counts = np.unique(primitives[order], return_index=True, return_counts=True)
    pixels = order[first + counts // 2]
    if isinstance(scene.geometry, Triangles):
        corners = scene.geometry.corners[numbers]
        sizes = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) @ VIEW
        pixels = pixels[np.argsort(-sizes, kind="stable")]
    return pixels[:SHOWN]


def shown(vector: np.ndarray) -> str:
    """Return a vector in words."""
    return f"({', '.join(f'{each:.4g}' for each in vector)})"


def play_ray_generation(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Run the lecture's program."""
    return ShaderExample("ray_generation", subject, progress)


def play_closest_hit(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Run the lecture's program."""
    return ShaderExample("closest_hit", subject, progress)


LESSONS = (
    Lesson(
        name="ray_generation_shader",
        label="A Ray Generation Shader",
        slide="Ray Generation shader example",
        begin="One call for each pixel: it makes a ray, has it traced, and writes the colour",
        look_for="The shader knows nothing of triangles; what the ray has met comes back in the "
        "payload, which other shaders have filled",
        question="Who calls the closest hit shader, and which one?",
        answer="TraceRay does, when its search is over. Which one stands in a table: the index is "
        "the offset of the ray, plus the multiplier times the geometry's number, plus what the "
        "instance adds. Here that is 0 + 1 * geometry + 0",
        source="pipeline.programs.lecture",
        sample="suzanne:subdivisions=0",
        structures=("bvh",),
        suits=suits,
        Settings=Settings,
        play=play_ray_generation,
        film="line",
    ),
    Lesson(
        name="closest_hit_shader",
        label="A Closest Hit Shader",
        slide="Closest Hit shader",
        begin="Called once for a ray that hits, with the weights of the triangle's corners",
        look_for="Two weights come from the built-in test of triangles, the third is what is "
        "missing to 1; so every triangle has a red, a green and a blue corner",
        question="Why does the shader not get the point that was hit?",
        answer="It can be had in two ways: as origin plus t times direction, with RayTCurrent, or "
        "from the weights and the corners. The weights serve for all else that the corners have, "
        "such as normals and places in a texture",
        source="pipeline.programs.lecture",
        sample="suzanne:subdivisions=0",
        structures=("bvh",),
        suits=suits,
        Settings=Settings,
        play=play_closest_hit,
        film="line",
    ),
)
