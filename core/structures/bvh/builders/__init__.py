"""The builders by name. Each groups triangles in its own way; see the file of its name."""

from __future__ import annotations

from ..topology.tree import Builder
from .bottom_up import agglomerative, ploc
from .morton import hlbvh, lbvh, lbvh_parallel, phr
from .rtree import rtree_insert, rtree_str
from .spatial import sbvh
from .top_down import binned_sah, object_median, parallel_sah, spatial_median, sweep_sah

BUILDERS: dict[str, Builder] = {
    "spatial_median": spatial_median.BUILDER,
    "object_median": object_median.BUILDER,
    "sweep_sah": sweep_sah.BUILDER,
    "parallel_sah": parallel_sah.BUILDER,
    "binned_sah": binned_sah.BUILDER,
    "sbvh": sbvh.BUILDER,
    "agglomerative": agglomerative.BUILDER,
    "ploc": ploc.BUILDER,
    "lbvh": lbvh.BUILDER,
    "lbvh_parallel": lbvh_parallel.BUILDER,
    "hlbvh": hlbvh.BUILDER,
    "phr": phr.BUILDER,
    "rtree_insert": rtree_insert.BUILDER,
    "rtree_str": rtree_str.BUILDER,
}
