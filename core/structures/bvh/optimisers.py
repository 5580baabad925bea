"""The optimisers by name. Each rearranges a finished tree in its own way; see its file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from . import (
    reinsert,
    reinsert_batches,
    reinsert_parallel,
    rotate,
    treelet,
    treelet_agglomerative,
)
from .rearranging import Rearrangement
from .tree import LinkedTree

if TYPE_CHECKING:
    from .settings import BVHSettings

    Optimiser = Callable[[LinkedTree, BVHSettings, Progress], Rearrangement]

OPTIMISERS: dict[str, tuple[str, Optimiser | None]] = {
    "none": ("It stays as the builder made it", None),
    "rotate": ("Children and grandchildren change places (Kensler 2008)", rotate.optimise),
    "reinsert": (
        "The worst nodes are taken apart, one after another (Bittner 2013)", reinsert.optimise
    ),
    "reinsert_parallel": (
        "All nodes look for a better place at once; on few cores slower than one after another"
        " (Meister and Bittner 2018)",
        reinsert_parallel.optimise,
    ),
    "reinsert_batches": (
        "The largest nodes look for a better place at once: much of the gain in little time",
        reinsert_batches.optimise,
    ),
    "treelet": (
        "The best tree over every seven subtrees (Karras and Aila 2013)", treelet.optimise
    ),
    "treelet_agglomerative": (
        "Every nine subtrees joined pair by pair (Domingues and Pedrini 2015)",
        treelet_agglomerative.optimise,
    ),
}  # fmt: skip
"""For each optimiser one sentence, and the function that rearranges a tree in place."""
