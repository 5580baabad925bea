"""Teapot in a stadium: a small dense object on the floor of a huge scene of a few triangles.

A uniform grid divides the stadium into equal cells, and the whole teapot falls into one or two
of them: however fine the grid, most rays that matter test the whole teapot. Structures that adapt
to where the triangles are do not mind. The problem has gone by this name since the Ray Tracing News
of the 1980s.

The teapot is Martin Newell's of 1975: 32 bicubic Bezier patches (``data/README.md``), each
tessellated n x n. The stadium is a level pitch within four rising stands.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.scene import Camera, Scene, point_lights
from ..core.settings import setting
from .sample import Sample, load_data

TEAPOT_LENGTH = 6.525  # from the spout's control points to the handle's
STADIUM_TRIANGLES = 10


@dataclass(frozen=True)
class Settings:
    """Settings of the teapot in a stadium."""

    teapot_resolution: int = setting(
        10, "Teapot resolution", "Quads along each side of a patch n: 64 n^2 - 8 n triangles",
        minimum=1, maximum=1000,
    )  # fmt: skip
    size_ratio: float = setting(
        100.0, "Size ratio", "Length of the stadium's pitch divided by the length of the teapot",
        minimum=1.5, maximum=1e6,
    )  # fmt: skip
    stand_height: float = setting(
        0.2, "Stand height", "Height of the stands divided by the length of the pitch; 0 is flat",
        minimum=0.0, maximum=10.0,
    )  # fmt: skip


def triangle_count(settings: Settings) -> int:
    """Return the number of triangles: 64 n^2 - 8 n of the teapot, 10 of the stadium."""
    n = settings.teapot_resolution
    return 64 * n * n - 8 * n + STADIUM_TRIANGLES


def generate(settings: Settings) -> Scene:
    """Return the scene; z is up, the teapot stands in the middle and is 3.15 units high."""
    pot = teapot(settings.teapot_resolution)
    pitch_length = settings.size_ratio * TEAPOT_LENGTH
    surroundings = stadium(pitch_length, settings.stand_height * pitch_length)
    # Close to the teapot: seen from the stands it would be a pixel.
    camera = Camera(
        position=np.array([5.0, -9.0, 5.5]),
        target=np.array([0.2, 0.0, 1.3]),
        up=np.array([0.0, 0.0, 1.0]),
        fov=45.0,
    )
    mast = pitch_length / 2.0
    lights = point_lights((mast, -mast, mast), (-mast, -mast, mast))
    return Scene.from_triangles(
        np.concatenate([pot, surroundings]),
        "teapot_in_stadium",
        object_ids=np.repeat([0, 1], [len(pot), len(surroundings)]),
        object_names=("teapot", "stadium"),
        camera=camera,
        lights=lights,
    )


def teapot(n: int) -> np.ndarray:
    """Return the Utah teapot, every patch as n x n quads of two triangles.

    Returns
    -------
    (64 n^2 - 8 n, 3, 3) float64
        Patch after patch. The lid's knob and the centre of the bottom are poles, where an edge of
        the patch is a single point; the triangles of zero area there are left out.
    """
    data = load_data("teapot.npz")
    control = data["points"][data["patches"]]  # (32, 4, 4, 3)
    # Both parameters as weights of the four control points in their direction.
    weights = _bernstein(n)
    rows = _blend(np.moveaxis(control, 1, 0), weights)  # (n + 1, 32, 4, 3)
    grid = _blend(np.moveaxis(rows, 2, 0), weights)  # (n + 1, n + 1, 32, 3), second index first
    grid = np.transpose(grid, (2, 1, 0, 3))
    has_pole = (control[:, 0, :1] == control[:, 0]).all(axis=(1, 2))
    grid[has_pole, 0] = control[has_pole, 0, :1]  # rounding would spread the points of a pole

    p00, p01, p11, p10 = grid[:, :-1, :-1], grid[:, :-1, 1:], grid[:, 1:, 1:], grid[:, 1:, :-1]
    triangles = np.stack([p00, p01, p11, p00, p11, p10], axis=3).reshape(32, n, n, 2, 3, 3)
    kept = np.ones((32, n, n, 2), dtype=bool)
    kept[has_pole, 0, :, 0] = False  # p00 and p01 are both the pole
    return triangles[kept]


def _bernstein(n: int) -> np.ndarray:
    """Return the cubic Bernstein polynomials at i/n, (4, n + 1) float64.

    From integers, so that reversing the parameter gives exactly the reversed weights.
    """
    i = np.arange(n + 1, dtype=np.float64)
    m = n - i
    return np.stack([m * m * m, 3.0 * (m * i) * m, 3.0 * (m * i) * i, i * i * i]) / float(n) ** 3


def _blend(points: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the points of cubic Bezier curves; control points along the first axis of `points`.

    Summed from the outside to the inside: a curve and its reverse give bit-equal points, so that
    neighbouring patches meet without cracks.
    """
    w = weights.reshape(weights.shape + (1,) * (points.ndim - 1))
    return (w[0] * points[0] + w[3] * points[3]) + (w[1] * points[1] + w[2] * points[2])


def stadium(length: float, height: float) -> np.ndarray:
    """Return the pitch and four stands as triangles, (10, 3, 3) float64.

    Parameters
    ----------
    length : float
        Of the pitch, along x; its width is to its length as 68 to 105, as in football. The
        stands reach outward by half of the width.
    height : float
        Of the stands' upper edge above the pitch.
    """
    signs = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    half = np.array([length, length * 68.0 / 105.0]) / 2.0
    inner = np.column_stack([signs * half, np.zeros(4)])
    outer = np.column_stack([signs * (half + half[1]), np.full(4, height)])
    quads = [inner]
    for side in range(4):
        after = (side + 1) % 4
        quads.append(np.array([inner[side], outer[side], outer[after], inner[after]]))
    return np.concatenate([quad[[(0, 1, 2), (0, 2, 3)]] for quad in quads])


SAMPLE = Sample(
    "teapot_in_stadium",
    "Teapot in a stadium",
    "Small dense object in a huge scene: where uniform grids fail",
    Settings,
    triangle_count,
    generate,
)
