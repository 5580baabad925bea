"""Settings of the bounding volume hierarchy.

Why the defaults are what they are: `builder`, `bins`, `optimise` and `arity` were chosen by the
seconds to build and to trace a million random lines, together, as geometric mean over Suzanne with
250,000 triangles, the dragon with 11,000 to 871,000, the bunny, the armadillo, Sponza, a kitchen,
an engine, a tree, and a teapot in a stadium. Seconds on two quiet cores, rounds in turn:

    builder, optimise                   both   build   lines   SAH cost
    binned_sah, none (16 bins)          1      1       1       1
    binned_sah, none, 32 bins           1.03   1.06    1.00    0.99
    binned_sah, none, arity 4           1.04   1.17    1.02    (of other nodes)
    sweep_sah, none                     1.04   1.33    0.98    0.98
    ploc, none                          1.13   1.11    1.14    1.02
    binned_sah, reinsert_batches        1.22   2.43    0.97    0.96
    ploc, reinsert_batches              1.27   2.61    1.06    0.98

Two runs differ by 2 to 3%. Where large triangles are among small ones `reinsert_batches` saves an
eighth of the cost (Sponza) or a sixth (the kitchen); why `binned_sah` alone is dear there is said
in :mod:`.binned_sah`. `sbvh` and `reinsert` trace Sponza 13% and 9% faster, which pays from 5 and
11 million lines on, and the even Suzanne hardly so; they build for six to ten times as long.

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
