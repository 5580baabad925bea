"""The builders by name. Each groups triangles in its own way; see the file of its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from . import agglomerative, binned_sah, rtree_insert, rtree_str
from .tree import Grouping, Primitives

if TYPE_CHECKING:
    from .settings import BVHSettings

    Builder = Callable[[Primitives, BVHSettings, Progress], Grouping]

BUILDERS: dict[str, tuple[str, Builder]] = {
    "binned_sah": (
        "From the top down, SAH evaluated at bin borders (Wald 2007)", binned_sah.build
    ),
    "agglomerative": (
        "Bottom-up, the two closest clusters merged (Walter 2008)", agglomerative.build
    ),
    "rtree_insert": (
        "R-tree, one triangle inserted after the other (Guttman 1984)", rtree_insert.build
    ),
    "rtree_str": ("R-tree packed by sort-tile-recursive (Leutenegger 1997)", rtree_str.build),
}  # fmt: skip
"""For each builder one sentence, and the function that builds."""
