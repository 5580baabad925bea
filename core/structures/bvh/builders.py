"""The builders by name. Each groups triangles in its own way; see the file of its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from . import (
    agglomerative,
    binned_sah,
    hlbvh,
    lbvh,
    lbvh_parallel,
    object_median,
    parallel_sah,
    ploc,
    rtree_insert,
    rtree_str,
    sbvh,
    spatial_median,
    sweep_sah,
)
from .tree import Grouping, Primitives

if TYPE_CHECKING:
    from .settings import BVHSettings

    Builder = Callable[[Primitives, BVHSettings, Progress], Grouping]

BUILDERS: dict[str, tuple[str, Builder]] = {
    "spatial_median": (
        "From the top down, every node halved in space", spatial_median.build
    ),
    "object_median": (
        "From the top down, half of the triangles to each side", object_median.build
    ),
    "sweep_sah": ("From the top down, SAH evaluated between all centroids", sweep_sah.build),
    "parallel_sah": (
        "From the top down, level by level with queues, as on a GPU (Lauterbach 2009)",
        parallel_sah.build,
    ),
    "binned_sah": (
        "From the top down, SAH evaluated at bin borders (Wald 2007)", binned_sah.build
    ),
    "sbvh": ("Binned SAH with spatial splits, which cut triangles (Stich 2009)", sbvh.build),
    "agglomerative": (
        "Bottom-up, the two closest clusters merged (Walter 2008)", agglomerative.build
    ),
    "ploc": ("Bottom-up, neighbours along the Morton curve merge (Meister 2018)", ploc.build),
    "lbvh": ("Intervals of sorted Morton codes (Lauterbach 2009)", lbvh.build),
    "lbvh_parallel": ("The tree of LBVH, all nodes at once (Karras 2012)", lbvh_parallel.build),
    "hlbvh": ("LBVH below, SAH above (Pantaleoni and Luebke 2010)", hlbvh.build),
    "rtree_insert": (
        "R-tree, one triangle inserted after the other (Guttman 1984)", rtree_insert.build
    ),
    "rtree_str": ("R-tree packed by sort-tile-recursive (Leutenegger 1997)", rtree_str.build),
}  # fmt: skip
"""For each builder one sentence, and the function that builds."""
