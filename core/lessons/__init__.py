"""Exhibits of hierarchies: one file for each idea that is shown."""

from __future__ import annotations

from ..contract.structure import Structure
from ..structures.bvh.hierarchy import BVH
from .efficiency import nodes_not_paying, overlapping_siblings
from .exhibit import Exhibit
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


def exhibits_of(structure: Structure) -> list[Exhibit]:
    """Return what there is to show of a structure and of how it was built: of hierarchies only.

    Cheap, frames are made on demand. What explains the building runs it once more, over the
    triangles the tree has now. Of one that was refitted those are elsewhere, and other decisions
    than the tree's would be shown.
    """
    return exhibits_of_hierarchy(structure) if isinstance(structure, BVH) else []


def exhibits_left_out(structure: Structure) -> str:
    """Say why exhibits that such structures usually have are not offered; empty if none are."""
    if not (isinstance(structure, BVH) and structure.is_refitted):
        return ""
    return (
        "Exhibits of the building are not shown after a refit, since the triangles have moved. "
        "Build to see them"
    )


def exhibits_of_hierarchy(bvh: BVH) -> list[Exhibit]:
    """Return the exhibits of a hierarchy."""
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
