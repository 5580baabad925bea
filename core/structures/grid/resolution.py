"""How many cells a grid gets where the resolution is left open.

A rule gives as many cells as there are triangles, times a density. Where triangles are large or
long, each is in many cells, and more cells only make more references. How many there will be is
known beforehand: a convex body K with extents w and projected areas A along the axes meets, for a
random place of a grid of cells s,

    E = 1 + w_x / s_x + w_y / s_y + w_z / s_z + A_x / (s_y s_z) + A_y / (s_z s_x) + A_z / (s_x s_y)
        + V / (s_x s_y s_z)

of its cells (the volume of the Minkowski sum of K and a cell, over that of a cell). So the
resolution is lowered until the sum over all triangles, or over their boxes, is no more than
REFERENCES_PER_CELL for every cell that the rule aims at.

A. Woo: Ray Tracing Polygons Using Spatial Subdivision, Graphics Interface 1992.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from ...geometry.geometry import boxes_around
from ...geometry.triangles import Triangles

REFERENCES_PER_CELL, USUAL_DENSITY = 20, 3.0
"""So at the usual density, or less, there are about 60 references per triangle at most. Scans,
interiors and a machine have 2 to 10."""

STEP = 0.9
"""Factor by which the resolution is lowered at a time."""


def resolution_by_rule(size: np.ndarray, count: int, rule: str, density: float) -> np.ndarray:
    """Return the resolution (3,) that a rule gives for a box of `size` with `count` triangles."""
    cells = density * count
    if rule == "regular":
        wanted = np.full(3, cells ** (1 / 3))
    elif rule == "woo":
        wanted = size / size.max() * cells ** (1 / 3)
    else:
        # A flat side would ask for infinitely many cells along the others.
        x, y, z = np.maximum(size, 1e-6 * size.max())
        nx = np.floor((cells * x * x / (y * z)) ** (1 / 3) + 0.5)
        ny = np.floor(np.sqrt(cells * y / (max(nx, 1) * z)) + 0.5)
        nz = np.floor(cells / (max(nx, 1) * max(ny, 1)) + 0.5)
        wanted = np.array([nx, ny, nz])
    return np.maximum(np.floor(wanted), 1)


def reference_terms(geometry: Any, size: np.ndarray, is_exact: bool) -> np.ndarray:
    """Return (2, 2, 2) terms, of which [a, b, c] times nx^a ny^b nz^c add up to the references.

    Parameters
    ----------
    geometry : NamedTuple of arrays
    size : (3,) float64
        Of the grid, all positive.
    is_exact : bool
        Whether triangles are assigned exactly, or like all other items by their boxes.
    """
    boxes = boxes_around(geometry)
    extents = (boxes[:, 3:] - boxes[:, :3]) / size
    terms = np.zeros((2, 2, 2))
    for powers in itertools.product((0, 1), repeat=3):
        chosen = np.flatnonzero(powers)
        terms[powers] = extents[:, chosen].prod(axis=1).sum()
    if is_exact and isinstance(geometry, Triangles):
        corners = geometry.corners
        edges = (corners[:, 1:] - corners[:, :1]) / size
        areas = 0.5 * np.abs(np.cross(edges[:, 0], edges[:, 1])).sum(axis=0)
        terms[0, 1, 1], terms[1, 0, 1], terms[1, 1, 0] = areas
        terms[1, 1, 1] = 0.0
    return terms


def expected_references(terms: np.ndarray, resolution: np.ndarray) -> float:
    """Return how many references a grid of a resolution, (3,), will have."""
    powers = [np.array([1.0, n]) for n in resolution]
    return float(np.einsum("abc,a,b,c", terms, *powers))


def lowered(
    resolution: np.ndarray, is_open: np.ndarray, terms: np.ndarray, most: float
) -> np.ndarray:
    """Return the resolution, (3,), lowered along its open axes to at most `most` references."""
    result, scale = resolution, 1.0
    while expected_references(terms, result) > most and (result[is_open] > 1).any():
        scale *= STEP
        result = np.where(is_open, np.maximum(np.floor(scale * resolution), 1), resolution)
    return result
