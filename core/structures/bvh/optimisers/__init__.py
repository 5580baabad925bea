"""The optimisers by name. Each rearranges a finished tree in its own way; see its file."""

from __future__ import annotations

from ....contract.costs import CostSettings
from . import (
    reinsert,
    reinsert_batches,
    reinsert_parallel,
    rotate,
    treelet,
    treelet_agglomerative,
)
from .rearranging import Optimiser

OPTIMISERS: dict[str, Optimiser] = {
    "none": Optimiser("It stays as the builder made it", CostSettings, None),
    "rotate": rotate.OPTIMISER,
    "reinsert": reinsert.OPTIMISER,
    "reinsert_parallel": reinsert_parallel.OPTIMISER,
    "reinsert_batches": reinsert_batches.OPTIMISER,
    "treelet": treelet.OPTIMISER,
    "treelet_agglomerative": treelet_agglomerative.OPTIMISER,
}
