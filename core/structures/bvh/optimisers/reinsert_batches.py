"""Reinsertion in batches: in each round only the largest nodes look for a better place.

A round is that of :mod:`.reinsert_parallel`, over a batch of the nodes instead of all. What a tree
costs is the area of its nodes, so the largest have the most to gain; most of the others search in
vain. Three rounds with a twentieth of the nodes take a tenth of the time or less. SAH cost saved,
and processor seconds:

    builder     mesh (triangles)   batches         all nodes (reinsert_parallel)
    binned_sah  Sponza (66,450)    12.4%, 0.05 s   15.9%, 1.1 s
    binned_sah  kitchen (56,939)   16.0%, 0.05 s   21.7%, 0.9 s
    binned_sah  dragon (202,520)    0.6%, 0.13 s    2.8%, 1.4 s
    ploc        Sponza              8.0%, 0.05 s   10.9%, 0.8 s
    ploc        kitchen             6.0%, 0.04 s    8.5%, 0.9 s
    ploc        dragon              4.8%, 0.16 s   10.1%, 2.7 s

Where a scan has no large triangles, little is gained at the top. Larger batches and more rounds
gain what is left, at the price of the whole. Sixteen rounds with 1, 1/3, 1/5 ... of the batch, as
the crate obvhs has it, gained no more (12.7, 16.2, 0.5, 7.6, 5.7 and 4.5%) and took three times as
long: what a round does with the whole tree takes longer than the searching.

D. Meister, J. Bittner: Parallel Reinsertion for Bounding Volume Hierarchy Optimization,
Computer Graphics Forum 37(2), 2018, let a share of the nodes search in a round, too; the largest
nodes, and a twentieth of them, are the choice of the library madmann91/bvh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ....contract.costs import CostSettings
from ....geometry.box_shape import surface_area
from ....progress import Progress
from ....settings import setting
from ..topology.tree import LinkedTree
from .rearranging import Optimiser, Rearrangement, settled
from .reinsert_parallel import Rounds

FEWEST = 64
"""Nodes that every batch has, if there are so many: to search for these takes no time."""


@dataclass(frozen=True)
class Settings(CostSettings):
    """Settings of reinsertion in batches."""

    batch: float = setting(
        0.05,
        "Batch",
        "Share of the nodes that look for a better place in a round, the largest ones",
        minimum=0.001,
        maximum=1.0,
    )
    rounds: int = setting(
        3,
        "Rounds",
        "How often a batch is reinserted; fewer times where little is gained",
        unit="rounds",
        minimum=1,
        maximum=1000,
    )


def largest(tree: LinkedTree, count: int) -> np.ndarray:
    """Return the nodes with the greatest areas, in ascending order, (count,) int32.

    Of equal areas at the border the lowest nodes are taken.
    """
    areas = surface_area(tree.boxes)
    least = np.partition(areas, len(areas) - count)[len(areas) - count]
    above, equal = np.flatnonzero(areas > least), np.flatnonzero(areas == least)
    chosen = np.concatenate([above, equal[: count - len(above)]])
    chosen.sort()
    return chosen.astype(np.int32)


def reinsert_in_batches(
    tree: LinkedTree, settings: Settings, progress: Progress, log: bool = False
) -> Rearrangement:
    """Reinsert in rounds, as many as the settings say or until little is gained; a step is a round.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    rounds = Rounds(tree, settings, progress, log)
    n_nodes = len(tree.left)
    # The root, the largest of all, has no better place.
    count = min(max(int(np.ceil(settings.batch * n_nodes)), FEWEST) + 1, n_nodes)
    while len(rounds.costs) <= settings.rounds and not settled(rounds.costs):
        rounds.run(largest(tree, count))
    return rounds.rearrangement()


OPTIMISER = Optimiser(
    "The largest nodes look for a better place at once: much of the gain in little time",
    Settings,
    reinsert_in_batches,
)
