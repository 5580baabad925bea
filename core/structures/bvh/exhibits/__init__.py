"""Exhibits of hierarchies: one file for each idea that is shown."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...exhibits import Exhibit
from .efficiency import nodes_not_paying, overlapping_siblings
from .kdop import kdop_levels
from .levels import levels
from .morton import morton_exhibits
from .parallel_sah import parallel_exhibits
from .ploc import ploc_exhibits
from .rearranging import rearranging_exhibits
from .refit import refit_over_timeline
from .sbvh import spatial_splits
from .split_curve import cost_curve
from .split_plane import split_planes
from .volume import volume_efficiency

if TYPE_CHECKING:
    from ..hierarchy import BVH


def exhibits_of(bvh: BVH) -> list[Exhibit]:
    """Return what there is to show of a hierarchy and of how it was built.

    What explains the building runs it once more, over the triangles the tree has now. Of one that
    was refitted those are elsewhere, and other decisions than the tree's would be shown.
    """
    of_tree = [
        levels(bvh),
        kdop_levels(bvh),
        split_planes(bvh),
        nodes_not_paying(bvh),
        overlapping_siblings(bvh),
        volume_efficiency(bvh),
    ]
    if bvh.history:
        of_tree.append(refit_over_timeline(bvh))
    if bvh.is_refitted:
        return of_tree
    return [
        *of_tree,
        *cost_curve(bvh),
        *parallel_exhibits(bvh),
        *morton_exhibits(bvh),
        *ploc_exhibits(bvh),
        *rearranging_exhibits(bvh),
        *spatial_splits(bvh),
    ]
