"""Exhibits of hierarchies: one file for each idea that is shown."""

from __future__ import annotations

from collections.abc import Sequence

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
from .refit import Moment, refit_over_timeline
from .sbvh import spatial_splits
from .split_curve import cost_curve
from .split_plane import split_planes
from .volume import volume_efficiency

OF_TREE = (
    levels, kdop_levels, split_planes, nodes_not_paying, overlapping_siblings, volume_efficiency
)  # fmt: skip
"""Exhibits of any hierarchy, whatever became of it."""


def exhibits_of(structure: Structure, history: Sequence[Moment] = ()) -> list[Exhibit]:
    """Return what there is to show of a structure and of how it was built: of hierarchies only.

    Cheap, frames are made on demand. What explains the building runs it once more, over the
    triangles the tree has now. Of one that was refitted those are elsewhere, and other decisions
    than the tree's would be shown.

    Parameters
    ----------
    history : sequence of Moment
        The animation over which such a structure was refitted, if it was.
    """
    exhibits = exhibits_of_hierarchy(structure) if isinstance(structure, BVH) else []
    if history:
        exhibits.insert(len(OF_TREE), refit_over_timeline(history))
    return exhibits


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
    of_tree = [make(bvh) for make in OF_TREE]
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
