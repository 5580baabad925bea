"""Lesson "beam_tree": mirrored beams.

The slides "Generalized rays" and "Polygonal scene": where a beam sees a mirror, a beam goes on
(:mod:`..probes.beam_tree`). Orange is the beam that is looked at: from the mirror that it has come
from to the polygons that it sees. Its apex is the mirrored eye, from which it goes straight on, and
the blue lines lead there, behind the mirror, where nothing is. Unfolded, it is the scene that is
mirrored, and the eye looks into it through the mirror as through a window: the same pieces.

P. Heckbert, P. Hanrahan: Beam Tracing Polygonal Objects, SIGGRAPH 1984.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..probes.beam import preceded
from ..probes.beam_picture import colours_of, coverage, picture_of_tree
from ..probes.beam_tree import NOBODY, BeamNode, beam_tree
from ..probes.visible import MISS
from ..progress import Progress
from ..scene.camera_rays import window_of
from ..scene.whitted import lights_for
from ..settings import setting
from .beams import HEIGHT, WIDTH, beam_of, eye_mark, frustum, patch, placed
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
from .lesson import Lesson, Play, Subject
from .picture import Image, Mark, Picture, Row

DEPTH = 4

MOST_BEAMS = 200
"""That can be looked at: the first ones."""

MOST_DRAWN = 150
"""Pieces of a beam that are drawn, the largest first."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    beam: int = setting(1, "Beam", "Which one of the tree; 0 is that of the eye", minimum=0)
    unfolded: bool = setting(
        False, "Unfolded", "The scene is mirrored, and the beam goes straight on through the mirror"
    )


class Mirrors(Play):
    """A beam tree."""

    def __init__(self, subject: Subject, progress: Progress) -> None:
        self.prepared, self.camera, beam = beam_of(subject.scene, progress)
        self.scene = self.prepared.scene
        self.nodes = beam_tree(self.prepared, beam, DEPTH, progress)
        if len(self.nodes) == 1:
            raise InputError(
                f"no mirror is seen in {self.scene.name}; give a material a specular share"
            )
        progress.report(2, 3, "Making the picture")
        self.ends = {"beam": min(len(self.nodes), MOST_BEAMS) - 1}
        self.window = window_of(self.camera, WIDTH, HEIGHT)
        self.lights = lights_for(self.scene, self.camera)
        self.whole = picture_of_tree(
            self.prepared, self.nodes, self.lights, self.window, WIDTH, HEIGHT
        )

    def name(self, item: int) -> str:
        """Return what an item is called."""
        return "{} {}".format(*self.scene.object_of(item))

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one beam."""
        number, nodes = settings.beam, self.nodes
        node = nodes[number]
        pieces, beam = node.pieces, node.beam
        parts: list[Lines | Faces] = []
        shown = np.argsort(-pieces.areas, kind="stable")[:MOST_DRAWN]
        to_virtual = self.to_virtual(node) if settings.unfolded else np.eye(3, 4)
        apex = moved(to_virtual, beam.apex)
        for piece in np.sort(shown).tolist():
            if pieces.items[piece] == MISS and number:
                continue
            corners = moved(to_virtual, placed(self.prepared, node, piece))
            colour = GREY if pieces.items[piece] == MISS else ORANGE
            parts += patch(corners, colour, 0.35 if pieces.items[piece] != MISS else 0.03)
            begin = apex
            if number:
                plane = self.prepared.convex.planes[self.polygon_of(node)]
                there = beam.on_plane(pieces.corners(piece), plane)
                begin = moved(to_virtual, there)
            parts += frustum(begin, corners, colour)
        marks = [Mark(nodes[0].beam.apex, "eye")]
        parts.append(eye_mark(nodes[0].beam.apex, self.scene, GREY))
        if number:
            parent = nodes[node.parent]
            marks.append(Mark(apex, "apex of the beam", BLUE[:3]))
            parts.append(eye_mark(apex, self.scene, BLUE))
            plane = self.prepared.convex.planes[self.polygon_of(node)]
            for window in beam.windows[:MOST_DRAWN]:
                glass = moved(to_virtual, parent.beam.on_plane(window, plane))
                parts += patch(glass, BLUE, 0.5)
                sides = np.stack([np.broadcast_to(apex, glass.shape), glass], axis=1)
                parts.append(coloured(sides, faint(BLUE, 0.6)))
            marks.append(Mark(glass.mean(axis=0), self.name(node.item), BLUE[:3]))
            if settings.unfolded:
                parts.append(self.mirrored_scene(to_virtual))
        seen = np.unique(pieces.items[pieces.items != MISS])
        share = beam.area / nodes[0].beam.area
        sum_of = float(pieces.areas.sum())
        caption = f"Beam {number}, the eye's, sees {counted(len(seen), 'polygon', 'polygons')}"
        if number:
            caption = (
                f"Beam {number}, {node.kind} at {self.name(node.item)}, which beam {node.parent} "
                f"sees in {share:.1%} of the picture, sees "
                f"{counted(len(seen), 'polygon', 'polygons')}"
            )
            if settings.unfolded:
                caption += "; unfolded, its apex is the eye"
        rows = (
            Row("Beams", str(len(nodes)), f"Of the tree, {DEPTH} one after the other at most"),
            Row("Depth", str(node.depth), "Beams from the eye to this one"),
            Row("Goes on from", "none" if node.parent == NOBODY else f"beam {node.parent}",
                "Whose pieces are its cross section"),
            Row("Cross Section", f"{share:.3%}", "Of the picture"),
            Row("Pieces", str(len(pieces.items)), "Of its cross section"),
            Row("Sum of Pieces", f"{sum_of / beam.area:.15g}", "In its cross section, of 1"),
            Row("Weight", f"{float(node.weight.mean()):.3g}", "Share of it that comes to the eye"),
        )  # fmt: skip
        images = [self.image(node)]
        return picture_of(parts, caption, marks=marks, rows=rows, images=images)

    def polygon_of(self, node: BeamNode) -> int:
        """Return a convex polygon of the mirror that a beam goes on from."""
        return int(np.flatnonzero(self.prepared.convex.items == node.item)[0])

    def to_virtual(self, node: BeamNode) -> np.ndarray:
        """Return the map, (3, 4), from the scene to where it seems to be, seen by the eye."""
        eye = self.nodes[0].beam.matrix
        back = np.linalg.inv(eye[:, :3])
        return preceded(np.column_stack([back, -(back @ eye[:, 3])]), node.beam.matrix)

    def mirrored_scene(self, matrix: np.ndarray) -> Lines:
        """Return the outlines of what lies where a beam goes, where it seems to be."""
        geometry = self.prepared.convex
        offsets = geometry.offsets
        lines = [
            outlines(moved(matrix, geometry.points[first:end])[None])
            for first, end in itertools.pairwise(offsets)
            if end > first
        ]
        return coloured(np.concatenate(lines)[:15_000], faint(GREY, 0.8))

    def image(self, node: BeamNode) -> Image:
        """Return the picture of the tree; what this beam does not see is pale."""
        if node.parent == NOBODY:
            return Image("picture", np.clip(self.whole, 0.0, 1.0))
        colours = colours_of(self.prepared, node, self.lights)
        own = coverage(node.pieces, colours, self.window, WIDTH, HEIGHT)
        ones = np.ones((len(node.pieces.items), 1))
        share = coverage(node.pieces, ones, self.window, WIDTH, HEIGHT)
        pale = 0.65 + 0.35 * np.clip(self.whole, 0.0, 1.0)
        return Image("picture", np.clip(own + (1.0 - share) * pale, 0.0, 1.0))

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the eye's beam, the first mirrored one folded and unfolded, and the deepest."""
        last = self.ends["beam"]
        deepest = max(range(last + 1), key=lambda number: self.nodes[number].depth)
        return [Settings(0), Settings(1), Settings(1, True), Settings(deepest)]


def moved(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return points, (..., 3), moved by an affine map, (3, 4)."""
    there: np.ndarray = points @ matrix[:, :3].T + matrix[:, 3]
    return there


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Follow the beams."""
    return Mirrors(subject, progress)


LESSONS = (
    Lesson(
        name="beam_tree",
        label="Mirrored Beams",
        slide="Polygonal scene",
        begin="What a beam sees in a planar mirror is seen by a beam that comes from the mirrored "
        "eye, through the pieces in which the mirror is seen",
        look_for="The sides of the mirrored beam, made longer, meet in one point behind the "
        "mirror; unfolded, that is the eye, and nothing else has changed",
        question="Why does this not work for refraction, at glass that is just as flat?",
        answer="Refracted rays from one point do not meet in one point any more, so there is no "
        "apex; the beam of an apex that fits its middle ray is an approximation",
        source="probes.beam_tree",
        sample="room:mirrors=2,open=true",
        Settings=Settings,
        play=play,
        film="beam",
    ),
)
