"""What lessons on beams share: the scene's own beam, and pieces as they lie in space."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from ..geometry.marks import stars
from ..probes.beam import Beam, camera_beam
from ..probes.beam_tree import BeamNode
from ..probes.polygonal import Polygonal, polygonal
from ..probes.visible import MISS
from ..progress import Progress
from ..scene import PERSPECTIVE, Camera, Scene
from .drawing import Colour, Faces, Lines, coloured, faint, outlines, tinted

MOST_POLYGONS = 3000
"""That a lesson takes: a beam through more is a grey mass."""

WIDTH, HEIGHT = 320, 240
"""Pixels of the picture."""

PAPER = 0.93
"""Grey of pixels in which nothing is seen."""

FROM = np.array([0.0, -1.15, 0.12])
"""Where the lessons' own eye is: from the scene's middle, in diagonals. Pictures are seen from the
front right, the beam so from the side."""

AHEAD = 0.3
"""How far before the eye the cross section is drawn, of the way to the scene's middle."""

FAR = 1.2
"""How far a beam is drawn where it meets nothing, in the scene's diagonals."""


def own_camera(scene: Scene) -> Camera:
    """Return the lessons' own camera."""
    middle = 0.5 * (scene.lower + scene.upper)
    return Camera(middle + FROM * scene.diagonal, middle, np.array([0.0, 0.0, 1.0]), 48.0)


def beam_of(scene: Scene, progress: Progress) -> tuple[Polygonal, Camera, Beam]:
    """Return a scene for beams, its camera or the lessons' own, and the beam of that.

    Raises
    ------
    InputError
        If the scene is none for beams, or too large for a lesson.
    Cancelled
        From `progress`.
    """
    if len(scene) > MOST_POLYGONS:
        raise InputError(
            f"a lesson on beams takes at most {MOST_POLYGONS} polygons, and {scene.name} has "
            f"{len(scene)}; choose a smaller scene",
            scene.name,
        )
    progress.report(0, 3, "Building a BSP tree")
    prepared = polygonal(scene, progress=progress)
    camera = scene.camera
    if camera is None or camera.kind != PERSPECTIVE:
        camera = own_camera(scene)
    return prepared, camera, camera_beam(camera, WIDTH, HEIGHT)


def depth_of_window(scene: Scene, beam: Beam) -> float:
    """Return how far before the eye the cross section is drawn."""
    middle = 0.5 * (scene.lower + scene.upper)
    away = float(np.linalg.norm(middle - beam.apex))
    return AHEAD * (away or scene.diagonal)


def placed(scene: Polygonal, node: BeamNode, piece: int) -> np.ndarray:
    """Return the corners of a piece where they lie on what is seen in it, (k, 3)."""
    corners, polygon = node.pieces.corners(piece), node.pieces.polygons[piece]
    if node.pieces.items[piece] == MISS:
        rays = node.beam.directions(corners)
        rays *= FAR * scene.scene.diagonal / np.linalg.norm(rays, axis=1, keepdims=True)
        return node.beam.apex + rays
    return node.beam.on_plane(corners, scene.convex.planes[polygon])


def fan(corners: np.ndarray) -> np.ndarray:
    """Return a convex polygon, (k, 3), as triangles."""
    numbers = np.arange(1, len(corners) - 1)
    return np.stack([np.broadcast_to(corners[0], (len(numbers), 3)), corners[numbers],
                     corners[numbers + 1]], axis=1)  # fmt: skip


def patch(corners: np.ndarray, colour: Colour, opacity: float = 0.45) -> tuple[Faces, Lines]:
    """Return a polygon in a colour, with its outline."""
    return tinted(fan(corners), colour, opacity), coloured(outlines(corners[None]), colour)


def frustum(begin: np.ndarray, end: np.ndarray, colour: Colour) -> list[Lines | Faces]:
    """Return a beam from one polygon to another with as many corners, (k, 3) each, or a point."""
    begin = np.broadcast_to(begin, end.shape)
    sides = np.stack([begin, end], axis=1)
    after = np.roll(sides, -1, axis=0)
    first = np.stack([sides[:, 0], sides[:, 1], after[:, 1]], axis=1)
    second = np.stack([sides[:, 0], after[:, 1], after[:, 0]], axis=1)
    return [
        tinted(np.concatenate([first, second]), colour, 0.10),
        coloured(sides, faint(colour, 0.7)),
    ]


def eye_mark(point: np.ndarray, scene: Scene, colour: Colour) -> Lines:
    """Return a star at the apex of a beam."""
    return coloured(stars(point[None], np.array([0.06 * scene.diagonal])), colour)
