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
in :mod:`.builders.top_down.binned_sah`. `sbvh` and `reinsert` trace Sponza 13% and 9% faster, which
pays from 5 and 11 million lines on, and the even Suzanne hardly so; they build for six to ten times
as long.

``python tests/bench/hierarchies.py --sections default MESH ...`` measures this again.
"""

from __future__ import annotations

from dataclasses import dataclass

from ...geometry.kinds import KINDS
from ...settings import composed, setting
from .builders import BUILDERS
from .optimisers import OPTIMISERS
from .topology.collapse import LeafSettings


@dataclass(frozen=True)
class FamilySettings(LeafSettings):
    """What can be chosen of every hierarchy."""

    builder: str = setting(
        "binned_sah",
        "Builder",
        "How the triangles are grouped",
        choices={name: builder.summary for name, builder in BUILDERS.items()},
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
        choices={name: optimiser.summary for name, optimiser in OPTIMISERS.items()},
    )


BVHSettings = composed(
    "BVHSettings",
    "Settings of the bounding volume hierarchy: of the family, its builders and optimisers.",
    FamilySettings,
    {
        "builder": {name: builder.Settings for name, builder in BUILDERS.items()},
        "optimise": {name: optimiser.Settings for name, optimiser in OPTIMISERS.items()},
    },
)
