"""The kinds of bounding volumes by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .box import Boxes
from .combined import Intersection, Union
from .kdop import DIRECTIONS, KDOPs
from .obb import OBBs
from .sphere import SmallestSpheres, Spheres


def make_kdops(count: int, k: int) -> KDOPs:
    """Return room for k-DOPs."""
    return KDOPs(np.empty((count, k)), np.array(DIRECTIONS[k], dtype=np.float64))


KINDS: dict[str, tuple[str, Callable[[int], Any]]] = {
    "aabb": ("Axis-aligned box", lambda count: Boxes(np.empty((count, 6)))),
    "sphere": ("Sphere, found fast (Ritter 1990)", lambda count: Spheres(np.empty((count, 4)))),
    "smallest_sphere": ("The smallest sphere", lambda count: SmallestSpheres(np.empty((count, 4)))),
    "obb": (
        "Box along the directions of the surface (Gottschalk 1996)",
        lambda count: OBBs(np.empty((count, 15))),
    ),
    "kdop6": ("Three strips: an axis-aligned box", lambda count: make_kdops(count, 6)),
    "kdop14": ("Seven strips: a box without its corners", lambda count: make_kdops(count, 14)),
    "kdop18": ("Nine strips: a box without its edges", lambda count: make_kdops(count, 18)),
    "kdop26": ("Thirteen strips: neither corners nor edges", lambda count: make_kdops(count, 26)),
}
"""For each kind of volume one sentence, and what makes room for a number of them."""

COMBINED: dict[str, tuple[str, Callable[[int], Any]]] = {
    "box_and_sphere": (
        "Intersection of the axis-aligned box and the smallest sphere",
        lambda count: Intersection(make("aabb", count), make("smallest_sphere", count)),
    ),
    "obb_and_kdop14": (
        "Intersection of the oriented box and the 14-DOP",
        lambda count: Intersection(make("obb", count), make("kdop14", count)),
    ),
    "two_boxes": (
        "Union of axis-aligned boxes around two halves",
        lambda count: Union(make("aabb", count), make("aabb", count)),
    ),
    "two_spheres": (
        "Union of the smallest spheres around two halves",
        lambda count: Union(make("smallest_sphere", count), make("smallest_sphere", count)),
    ),
}
"""Some combinations, in the same form."""


def make(kind: str, count: int) -> Any:
    """Return room for a number of volumes of a kind, a combined one too."""
    return (KINDS | COMBINED)[kind][1](count)
