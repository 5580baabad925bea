"""Mount: a fractal mountain with a pyramid of four glass spheres in front of it.

A square is divided in four; the heights of the midpoints of its edges and of its centre are the
means of their corners plus a random displacement proportional to the size of the square (midpoint
displacement; Fournier, Fussell and Carpenter, Computer rendering of stochastic models, CACM 25(6),
1982). The displacement of a point depends on its place in the grid alone, so that the two squares
beside an edge agree about it and the surface has no cracks.

Source: "mount" of the Standard Procedural Databases (``spd.py``), with its camera, light and
materials: spheres of glass, a matt mountain, before the sky. Its hash repeats itself over the
mountain; that flaw is kept, because published numbers were measured on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.geometry.solids.description import Sphere, Triangle
from ..core.scene import Camera, Scene, point_lights
from ..core.scene.material import Material, shine_of
from ..core.settings import setting
from .sample import Sample
from .spd import Described, scene_of

GLASS = Material(
    "glass spheres",
    (1.0, 1.0, 1.0),
    diffuse=0.1,
    specular=0.1,
    shine=shine_of(6.7),
    transmission=0.9,
    index_of_refraction=1.5,
)
ROCK = Material("mountain", (0.5, 0.45, 0.35))

MOUNTAIN_NUMBER = 21  # another number gives another mountain
FRACTAL_DIMENSION = 2.2
PYRAMID_CENTRE = (-0.8, 0.8, 1.0)
SPHERE_RADIUS = 0.17
CAMERA = Camera(
    position=np.array([-1.6, 1.6, 1.7]), target=np.zeros(3), up=np.array([0.0, 0.0, 1.0]), fov=45.0
)
LIGHTS = point_lights((-100.0, -100.0, 100.0))


@dataclass(frozen=True)
class Settings:
    """Settings of mount."""

    size: int = setting(
        6, "Size", "Size factor of the SPD, levels of subdivision: 2 * 4^size triangles",
        unit="levels", minimum=1, maximum=7,
    )  # fmt: skip


def count(settings: Settings) -> int:
    """Return the number of items: 2 * 4^size triangles and four spheres."""
    return 2 * 4**settings.size + 4


def items(settings: Settings) -> Described:
    """Yield the spheres, then the mountain in the order of its recursion."""
    for centre in sphere_centres():
        yield Sphere(centre, SPHERE_RADIUS), GLASS
    for corners in grow_mountain(settings.size):
        yield Triangle(corners), ROCK


def generate(settings: Settings) -> Scene:
    """Return the scene; the mountain covers [-1, 1]^2, z is up."""
    return scene_of(items(settings), "mount", CAMERA, LIGHTS)


def grow_mountain(size: int) -> np.ndarray:
    """Return the triangles of the mountain, (2 * 4**size, 3, 3) float64."""
    ratio = 2.0 / np.exp(np.log(2.0) / (FRACTAL_DIMENSION - 1.0))
    roughness = np.sqrt(ratio**2 - 1.0)
    width = 2**size  # of a square, in cells of the finest grid
    cell = 2.0 / width

    def displaced(x: np.ndarray, y: np.ndarray, mean: np.ndarray, rise: float) -> np.ndarray:
        return mean + rise * gauss(MOUNTAIN_NUMBER + grid_hash(x, y, size))

    # All squares of one level: grid place (x, y) of the lower left corner, heights of the corners
    # counter-clockwise from there.
    x = y = np.zeros(1, dtype=np.int64)
    z00 = z10 = z11 = z01 = np.zeros(1)
    while width > 1:
        half = width // 2
        rise = half * cell * roughness

        lower = displaced(x + half, y, (z00 + z10) / 2.0, rise)
        right = displaced(x + width, y + half, (z10 + z11) / 2.0, rise)
        upper = displaced(x + half, y + width, (z11 + z01) / 2.0, rise)
        left = displaced(x, y + half, (z01 + z00) / 2.0, rise)
        # The centre is further from its corners than the midpoint of an edge from its ends.
        middle = displaced(x + half, y + half, (z00 + z10 + z11 + z01) / 4.0, 1.4142136 * rise)

        # The four quarters, counter-clockwise; beside each other as in the recursion.
        x, y = _interleave(x, x + half, x + half, x), _interleave(y, y, y + half, y + half)
        z00, z10, z11, z01 = (
            _interleave(z00, lower, middle, left),
            _interleave(lower, z10, right, middle),
            _interleave(middle, right, z11, upper),
            _interleave(left, middle, upper, z01),
        )
        width = half

    x0, x1 = -1.0 + x * cell, -1.0 + (x + 1) * cell
    y0, y1 = -1.0 + y * cell, -1.0 + (y + 1) * cell
    corners = [(x0, y0, z00), (x1, y0, z10), (x1, y1, z11), (x0, y1, z01)]
    squares = np.stack([np.stack(corner, axis=1) for corner in corners], axis=1)
    return squares[:, [(0, 1, 2), (2, 3, 0)]].reshape(-1, 3, 3)


def grid_hash(x: np.ndarray, y: np.ndarray, size: int) -> np.ndarray:
    """Return the 16-bit hash of a grid place; the third term repeats x, as the original does."""
    return ((x << (23 - size)) + (y << (15 - size)) + (x << (7 - size))) & 0xFFFF


def gauss(seeds: np.ndarray) -> np.ndarray:
    """Return one normally distributed number per seed, (n,) float64.

    Marsaglia's polar method on a linear congruential generator, so that the numbers are the same
    on every machine.
    """
    state = seeds.copy()
    v1, square = np.zeros(len(seeds)), np.ones(len(seeds))
    outside = np.arange(len(seeds))  # pairs that do not lie in the unit circle yet
    while len(outside):
        first = (28411 + state[outside] * 8121) % 134456
        state[outside] = second = (28411 + first * 8121) % 134456
        v1[outside] = first * 2.0 / 134456 - 1.0
        v2 = second * 2.0 / 134456 - 1.0
        square[outside] = v1[outside] ** 2 + v2**2
        outside = outside[square[outside] >= 1.0]
    return v1 * np.sqrt(-2.0 * np.log(square) / square)


def sphere_centres() -> np.ndarray:
    """Return the centres of the four spheres, (4, 3) float64.

    They are the vertices of a regular tetrahedron with one on top; the spheres touch.
    """
    height = SPHERE_RADIUS * np.sqrt(1.5)  # of the top above the centre of the tetrahedron
    # cos and sin of the angle acos(-1/3) between two vertices seen from the centre.
    cosine, sine = -1.0 / 3.0, np.sqrt(8.0) / 3.0
    # The top turned about (1, 1, 0) points to (1, -1) in the plane: azimuth -45 degrees.
    azimuths = np.radians([-45.0, 75.0, 195.0])
    low = height * np.stack(
        [sine * np.cos(azimuths), sine * np.sin(azimuths), np.full(3, cosine)], axis=1
    )
    return np.array(PYRAMID_CENTRE) + np.concatenate([[(0.0, 0.0, height)], low])


def _interleave(*parts: np.ndarray) -> np.ndarray:
    return np.stack(parts, axis=1).reshape(-1)


SAMPLE = Sample(
    "mount",
    "Mount (SPD)",
    "Fractal mountain with four glass spheres in front of it: large items beside tiny ones",
    Settings,
    count,
    generate,
    items,
)
