"""Settings of the bounding volume hierarchy.

Why the defaults are what they are: `builder`, `bins`, `optimise` and `arity` were chosen by the
seconds to build and to trace a million random lines, together, as geometric mean over Suzanne with
250,000 triangles, the dragon with 11,000 to 871,000, the bunny, the armadillo, Sponza, a kitchen,
an engine, a tree, and a teapot in a stadium. Processor seconds, medians of rounds in turn:

    builder, optimise                   both   build   lines   SAH cost
    binned_sah, none, 32 bins           0.98   1.07    0.97    0.99
    binned_sah, none, arity 4           0.99   1.12    0.98    (of other nodes)
    binned_sah, none (16 bins)          1      1       1       1
    sweep_sah, none                     1.05   1.44    0.99    0.98
    binned_sah, reinsert_batches        1.05   2.13    0.95    0.96
    ploc of radius 6, none              1.06   0.72    1.11    1.03
    ploc of radius 6, reinsert_batches  1.10   1.87    1.03    0.99
    ploc, none                          1.10   1.10    1.12    1.03
    ploc, reinsert_batches              1.13   2.13    1.03    0.98
    sweep_sah, reinsert_batches         1.13   2.60    0.97    0.95

The first three are equal within the noise of 2 to 3%, and of those the simplest is taken (32 bins
save 0.8% of the tests of boxes and cost 0.8% more of triangles). Where large triangles are among
small ones (Sponza, the kitchen) `reinsert_batches` is some 5% faster, its time included; why
`binned_sah` alone is dear there is said in :mod:`.binned_sah`. Over the largest dragon, where
building takes nearly half of the time, `ploc` of radius 6 is 12% faster. `sbvh` and whatever is
followed by `reinsert` (1.25 and more over seven of the meshes) trace up to an eighth faster, but
build for seven times as long: they pay from several million rays on.

``python tests/bench/hierarchies.py --sections default MESH ...`` measures this again.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...geometry.kinds import KINDS
from ...settings import setting
from ..contract import intersection_cost, traversal_cost
from .builders import BUILDERS
from .optimisers import OPTIMISERS

TOP_DOWN = (
    "spatial_median", "object_median", "sweep_sah", "binned_sah", "parallel_sah", "sbvh"
)  # fmt: skip
BINNED = "binned_sah", "parallel_sah", "hlbvh", "sbvh"
MORTON = "lbvh", "lbvh_parallel", "hlbvh", "ploc"


@dataclass(frozen=True)
class BVHSettings:
    """Settings of the bounding volume hierarchy."""

    builder: str = setting(
        "binned_sah",
        "Builder",
        "How the triangles are grouped",
        choices={name: text for name, (text, _) in BUILDERS.items()},
    )
    axis: str = setting(
        "best",
        "Axis",
        "Across which axis a builder from the top down may split a node",
        choices={
            "best": "Whichever is best: by cost, or for medians the longest",
            "round_robin": "x, y and z in turn",
        },
        only_for={"builder": TOP_DOWN},
    )
    volume: str = setting(
        "aabb",
        "Volume",
        "What is put around the triangles of a node",
        choices={name: text for name, (text, _) in KINDS.items()},
    )
    arity: str = setting(
        "2",
        "Arity",
        "How many children a node may have",
        choices={"2": "Binary tree", "4": "Up to four, chosen by cost", "8": "Up to eight"},
    )
    optimise: str = setting(
        "none",
        "Optimise",
        "How the finished tree is rearranged",
        choices={name: text for name, (text, _) in OPTIMISERS.items()},
    )
    max_leaf_size: int = setting(
        4,
        "Max Leaf Size",
        "A node with more triangles is always split",
        unit="triangles",
        minimum=1,
        maximum=1024,
    )
    bins: int = setting(
        16,
        "Bins",
        "Candidate intervals per axis",
        unit="bins",
        minimum=2,
        maximum=64,
        only_for={"builder": BINNED},
    )
    radius: int = setting(
        14,
        "Radius",
        "How far PLOC looks for a neighbour along the Morton curve",
        unit="clusters",
        minimum=1,
        maximum=512,
        only_for={"builder": ("ploc",)},
    )
    morton_bits: str = setting(
        "63",
        "Morton Bits",
        "Length of Morton codes",
        choices={"30": "10 bits per axis", "63": "21 bits per axis"},
        only_for={"builder": MORTON},
    )
    rtree_split: str = setting(
        "quadratic",
        "R-tree Split",
        "How a full node of an R-tree is shared out between two",
        choices={
            "quadratic": "The pair that wastes most surface apart, the most decided entry next",
            "linear": "The pair farthest apart along an axis, then the others as they come",
        },
        only_for={"builder": ("rtree_insert",)},
    )
    duplication: float = setting(
        2.0,
        "Duplication",
        "Most references that spatial splits may make, per triangle",
        minimum=1.0,
        maximum=16.0,
        only_for={"builder": ("sbvh",)},
    )
    batch: float = setting(
        0.05,
        "Batch",
        "Share of the nodes that look for a better place in a round, the largest ones",
        minimum=0.001,
        maximum=1.0,
        only_for={"optimise": ("reinsert_batches",)},
    )
    rounds: int = setting(
        3,
        "Rounds",
        "How often a batch is reinserted; fewer times where little is gained",
        unit="rounds",
        minimum=1,
        maximum=1000,
        only_for={"optimise": ("reinsert_batches",)},
    )
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()
