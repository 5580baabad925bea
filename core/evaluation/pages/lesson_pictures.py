"""Pictures of lessons: lines and faces over the mesh, with their text.

All pictures of a lesson are seen from the same place, from where everything in them is seen.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...colours import luminance
from ...geometry.box_shape import corners_of
from ...lessons.picture import Picture
from ...scene import Scene
from .lettering import INK, Letters, lettered
from .picture_cameras import camera_around, own_camera, picture_camera
from .view import View

FEW_SEGMENTS = 2000
"""Segments up to which lines are drawn wide, and clearly behind the mesh, too."""

MOST_OPAQUE = 0.95
"""Opacity of faces at most: light gets through all of them."""

ROOM = 28
"""Pixels around what is to be seen: half a line of text, and some paper."""

AROUND = 1.08
"""What is framed, in sizes of what is to be seen: text stands beside it."""


class LessonPainter:
    """Paints pictures of a lesson over one scene.

    Parameters
    ----------
    pictures : sequence of Picture
        All of them are seen whole.
    reduction : float
        See :class:`.view.View`.
    """

    def __init__(self, scene: Scene, pictures: Sequence[Picture], reduction: float = 1.0) -> None:
        corners = corners_of(np.concatenate([scene.lower, scene.upper])[None])[0]
        points = np.concatenate([corners, *(picture.points() for picture in pictures)])
        centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
        camera = picture_camera(scene)
        if own_camera(scene) is None or not View(scene, camera, 16.0).sees(points):
            camera = camera_around(camera, centre + AROUND * (points - centre))
        self.view = View(scene, camera, reduction)
        self.crop = self._crop(points)

    def _crop(self, points: np.ndarray) -> tuple[slice, slice]:
        """Return rows and columns of the picture around some points, with room for text."""
        places = self.view.places(points)
        low, high = np.nanmin(places, axis=0), np.nanmax(places, axis=0)
        first = np.maximum(np.floor(low - ROOM), 0).astype(int)
        last = np.ceil(high + ROOM).astype(int)
        return slice(int(first[1]), int(last[1])), slice(int(first[0]), int(last[0]))

    def paint(self, picture: Picture) -> np.ndarray:
        """Return a picture as an image, (rows, columns, 3) float64 from 0 to 1.

        Images that belong to it stand to its right.
        """
        view, over = self.view, None
        if len(picture.faces):
            opacity = np.minimum(picture.face_colours[:, 3], MOST_OPAQUE)
            over = view.with_faces(picture.faces, picture.face_colours[:, :3], opacity)
        if len(picture.segments) > FEW_SEGMENTS:
            image = view.with_lines(picture.segments, picture.colours, over=over)
        else:
            image = view.with_lines(
                picture.segments, picture.colours, over=over, width=2, hidden=0.5
            )
        # Cut first: so no text is.
        image = lettered(image[self.crop], self._letters(picture))
        return np.concatenate(
            [image, *(as_high_as(image, each.pixels) for each in picture.images)], 1
        )

    def _letters(self, picture: Picture) -> list[Letters]:
        """Return the text of a picture, where it is seen in what is cut out of the view."""
        if not picture.marks:
            return []
        places = self.view.places(np.array([mark.position for mark in picture.marks], float))
        places = places - (self.crop[1].start, self.crop[0].start)
        return [
            Letters(float(column), float(row), mark.text, on_paper(mark.colour))
            for mark, (column, row) in zip(picture.marks, places, strict=True)
            if np.isfinite(column)
        ]


def as_high_as(image: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return another image, scaled to the height of an image; its pixels stay squares."""
    rows = image.shape[0]
    columns = max(round(rows * other.shape[1] / other.shape[0]), 1)
    row = (np.arange(rows) * other.shape[0]) // rows
    column = (np.arange(columns) * other.shape[1]) // columns
    return other[row[:, None], column]


def on_paper(colour: tuple[float, float, float] | None) -> tuple[float, float, float]:
    """Return a text's colour so dark that it is read on white."""
    if colour is None:
        return INK
    red, green, blue = (float(channel) for channel in colour)
    dim = min(1.0, 0.42 / max(luminance((red, green, blue)), 1e-9))
    return red * dim, green * dim, blue * dim
