"""Lesson "beam_clipping": one beam, clipped from front to back.

The slide "Polygonal scene": a pyramid with a polygonal cross section looks at a scene of polygons.
The cross section stands before the eye. What the tree says is in front is taken out of it first,
piece by piece (:mod:`..probes.visible`): blue are the pieces that are taken, orange is the last one
with its part of the beam, up to the polygon that is seen in it, and grey outlines are what is still
free. Beside the model is the picture as far as it is known.

P. Heckbert, P. Hanrahan: Beam Tracing Polygonal Objects, SIGGRAPH 1984.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..probes.beam import EYE
from ..probes.beam_picture import colours_of, coverage
from ..probes.beam_tree import NOBODY, BeamNode
from ..probes.visible import MISS, visible
from ..progress import Progress
from ..scene.camera_rays import window_of
from ..scene.whitted import lights_for
from ..settings import setting
from .beams import (
    HEIGHT,
    PAPER,
    WIDTH,
    beam_of,
    depth_of_window,
    eye_mark,
    frustum,
    patch,
    placed,
)
from .drawing import (
    BLUE,
    GREY,
    ORANGE,
    Faces,
    Lines,
    coloured,
    counted,
    faint,
    outlines,
    picture_of,
)
from .heat_map import viridis
from .lesson import Lesson, Play, Subject
from .picture import Image, Mark, Picture, Row

MOST_OUTLINES = 1500
"""Pieces that are outlined in the cross section."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    pieces: int = setting(
        12, "Pieces", "How many are taken out of the cross section", minimum=0, unit="pieces"
    )
    colours: str = setting(
        "scene", "Colours", "What the picture shows",
        choices={
            "scene": "What is seen, in its colours",
            "order": "Which piece was taken when: dark ones first",
        },
    )  # fmt: skip


class Clipping(Play):
    """The beam of a picture, and its pieces in their order."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        self.prepared, self.camera, beam = beam_of(subject.scene, progress)
        self.scene = self.prepared.scene
        progress.report(1, 3, "Clipping the beam")
        pieces = visible(self.prepared, beam)
        self.node = BeamNode(beam, pieces, EYE, NOBODY, MISS, 1, np.ones(3))
        self.taken = int((pieces.items != MISS).sum())
        self.ends = {"pieces": self.taken}
        progress.report(2, 3, "Making the picture")
        window = window_of(self.camera, WIDTH, HEIGHT)
        lights = lights_for(self.scene, self.camera)
        self.images = {}
        order = viridis(np.arange(len(pieces.items)) / len(pieces.items))
        for key, colours in (("scene", colours_of(self.prepared, self.node, lights)),
                             ("order", order)):  # fmt: skip
            self.images[key] = np.clip(colours, 0.0, 1.0)
        self.window, there = window, self.ahead(pieces.points)
        self.sections = [there[first:end] for first, end in itertools.pairwise(pieces.offsets)]

    def image(self, settings: Settings) -> Image:
        """Return the picture of the pieces that are taken, by exact areas."""
        colours = self.images[settings.colours].copy()
        colours[settings.pieces :] = PAPER
        pixels = coverage(self.node.pieces, colours, self.window, WIDTH, HEIGHT)
        return Image("picture", np.clip(pixels, 0.0, 1.0))

    def picture(self, settings: Settings) -> Picture:
        """Return the beam after some pieces."""
        node, n = self.node, settings.pieces
        pieces, apex = node.pieces, node.beam.apex
        shares = pieces.areas / node.beam.area
        taken, free = float(shares[:n].sum()), float(shares[n:].sum())
        parts: list[Lines | Faces] = []
        drawn = self.sections[:MOST_OUTLINES]
        for number, section in enumerate(drawn):
            if number < n:
                parts += patch(section, BLUE, 0.3)
            else:
                parts.append(coloured(outlines(section[None]), faint(GREY, 0.45)))
        marks = [Mark(apex, "eye")]
        parts.append(eye_mark(apex, self.scene, BLUE))
        caption = "Nothing is taken yet: the whole cross section is free"
        if n:
            last = n - 1
            corners = placed(self.prepared, node, last)
            parts += patch(corners, ORANGE, 0.6)
            parts += frustum(apex, corners, ORANGE)
            parts += patch(self.sections[last], ORANGE, 0.6)
            name, number = self.scene.object_of(int(pieces.items[last]))
            marks.append(Mark(corners.mean(axis=0), f"{name} {number}", ORANGE[:3]))
            caption = (
                f"{counted(n, 'piece', 'pieces')} taken, {taken:.1%} of the cross section; the "
                f"last sees {name} {number} and is {shares[last]:.2%}"
            )
        frame = self.ahead(node.beam.windows[0])
        parts.append(coloured(outlines(frame[None]), GREY))
        parts.append(coloured(np.stack([np.broadcast_to(apex, frame.shape), frame], axis=1),
                              faint(GREY, 0.5)))  # fmt: skip
        seen = np.unique(pieces.items[:n])
        rows = (
            Row("Pieces", f"{n} of {self.taken}", "Convex regions that see one polygon each"),
            Row("Polygons Seen", f"{len(seen)} of {len(self.scene)}", "In the pieces so far"),
            Row("Taken", f"{taken:.4%}", "Of the area of the cross section"),
            Row("Free", f"{free:.4%}", "What is behind may still be seen there"),
            Row("Sum", f"{taken + free:.15g}", "Exact but for rounding"),
            Row("Parts", str(len(self.prepared.convex.offsets) - 1),
                "Into which the tree's planes have cut the polygons"),
        )  # fmt: skip
        return picture_of(parts, caption, marks=marks, rows=rows, images=[self.image(settings)])

    def ahead(self, points: np.ndarray) -> np.ndarray:
        """Return where points of the cross section, (n, 2), are drawn before the eye, (n, 3)."""
        beam, depth = self.node.beam, depth_of_window(self.scene, self.node.beam)
        forward = np.linalg.norm(beam.directions(np.zeros((1, 2))))
        return beam.apex + depth / forward * beam.directions(points)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first piece, some, and all of them."""
        some: Sequence[int] = sorted({1, self.taken // 3, self.taken})
        return [Settings(n) for n in some] + [Settings(self.taken, "order")]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Build the tree and clip the beam."""
    return Clipping(subject, progress)


LESSONS = (
    Lesson(
        name="beam_clipping",
        label="A Beam, Clipped from Front to Back",
        slide="Polygonal scene",
        begin="Where a scene is made of flat polygons, one beam sees a whole picture: what is in "
        "front is cut out of its cross section first, and what is left over looks farther",
        look_for="The areas of all pieces add up to the cross section, and where nothing is free "
        "any more, nothing behind is looked at",
        question="Why is the order of the polygons' distances not enough, and a BSP tree is?",
        answer="Polygons may overlap in a circle, each before the next: then there is no order. "
        "The planes of the tree cut one of them, and its parts have their places",
        source="probes.visible",
        sample="room:open=true",
        Settings=Settings,
        play=play,
        film="pieces",
    ),
)
