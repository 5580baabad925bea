"""Pictures of exhibits: up to four frames of each, for the page beside the pictures of cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...geometry.box_shape import corners_of
from ...lessons.exhibit import Exhibit, Frame
from ...scene import Scene
from .picture_cameras import camera_around, own_camera, picture_camera
from .view import View

MOST_FRAMES = 4
"""Frames on the page of an exhibit that names none: first, last, even steps between."""

FEW_SEGMENTS = 2000
"""Segments up to which lines are drawn wide, and clearly behind the mesh, too."""

REDUCTION = 1.5
"""Pictures of frames are smaller than others, since several stand in a row."""


@dataclass(frozen=True)
class FramePicture:
    """A frame as a picture: its number, its caption, and the image (rows, columns, 3)."""

    number: int
    caption: str
    image: np.ndarray


class ExhibitPainter:
    """Draws the exhibits of one scene; the mesh seen by the usual camera is rendered once."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.corners = corners_of(np.concatenate([scene.lower, scene.upper])[None])[0]
        camera = picture_camera(scene)
        if own_camera(scene) is None:
            camera = camera_around(camera, self.corners)
        self.usual = View(scene, camera, REDUCTION)

    def pictures_of(self, exhibit: Exhibit) -> list[FramePicture]:
        """Draw some frames of an exhibit, all seen from the same place."""
        numbers = list(exhibit.on_page) or frames_to_show(exhibit.count)
        frames = [exhibit.frame(number) for number in numbers]
        view = self._view_of(frames)
        return [
            FramePicture(number, frame.caption, drawn(view, frame))
            for number, frame in zip(numbers, frames, strict=True)
        ]

    def _view_of(self, frames: list[Frame]) -> View:
        """Return the usual view if all is seen in it; charts often stand beside the model."""
        points = np.concatenate([frame.segments.reshape(-1, 3) for frame in frames])
        if self.usual.sees(points):
            return self.usual
        around = camera_around(self.usual.camera, np.concatenate([points, self.corners]))
        return View(self.scene, around, REDUCTION)


def drawn(view: View, frame: Frame) -> np.ndarray:
    """Draw one frame."""
    if len(frame.segments) > FEW_SEGMENTS:
        return view.with_lines(frame.segments, frame.colours)
    return view.with_lines(frame.segments, frame.colours, width=2, hidden=0.5)


def frames_to_show(count: int) -> list[int]:
    """Return the numbers of the frames that the page shows, ascending."""
    return sorted({round(i) for i in np.linspace(0, count - 1, min(count, MOST_FRAMES))})
