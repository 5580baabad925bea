"""Statistics: the figures of a built structure, by the names of Havran.

V. Havran: Heuristic Ray Shooting Algorithms, PhD thesis, Czech Technical University, 2000.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Statistics:
    """Figures of a built structure (Havran's names).

    Attributes
    ----------
    N_IN, N_V, N_EV : int
        Inner nodes, elementary cells (leaves), empty ones among those.
    N_OIV : int
        References to primitives in all leaves.
    max_depth : int
        The root has depth 0.
    mean_leaf_size : float
        N_OIV / N_V.
    sah : float
        (C_trav * sum over inner SA + C_isect * sum over leaves n * SA) / SA_root.
    C_trav, C_isect : float
        The constants used.
    expected_inner, expected_leaves, expected_tests : float
        Means over isotropic uniform lines through the root that never stop early: inner nodes and
        leaves visited, primitives tested; the terms of `sah` without their constants.
    leaf_sizes, depths : (k,) int64
        Number of leaves by their size, and by their depth.
    extra : dict
        Figures of this structure only.
    """

    N_IN: int
    N_V: int
    N_EV: int
    N_OIV: int
    max_depth: int
    mean_leaf_size: float
    sah: float
    C_trav: float
    C_isect: float
    expected_inner: float
    expected_leaves: float
    expected_tests: float
    leaf_sizes: np.ndarray
    depths: np.ndarray
    extra: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def of_cells(
        cls,
        areas: np.ndarray,
        is_leaf: np.ndarray,
        count: np.ndarray,
        depth: np.ndarray,
        root_area: float,
        c_trav: float,
        c_isect: float,
        extra: dict[str, Any] | None = None,
    ) -> Statistics:
        """Compute all figures from per-cell arrays: surface area, leaf or not, size, depth."""
        leaf_count, leaf_areas = count[is_leaf], areas[is_leaf]
        expected_inner = float(areas[~is_leaf].sum() / root_area)
        expected_leaves = float(leaf_areas.sum() / root_area)
        expected_tests = float((leaf_areas * leaf_count).sum() / root_area)
        references = int(leaf_count.sum(dtype=np.int64))
        return cls(
            N_IN=int((~is_leaf).sum()),
            N_V=len(leaf_count),
            N_EV=int((leaf_count == 0).sum()),
            N_OIV=references,
            max_depth=int(depth.max(initial=0)),
            mean_leaf_size=references / (len(leaf_count) or 1),
            sah=c_trav * expected_inner + c_isect * expected_tests,
            C_trav=c_trav,
            C_isect=c_isect,
            expected_inner=expected_inner,
            expected_leaves=expected_leaves,
            expected_tests=expected_tests,
            leaf_sizes=np.bincount(leaf_count),
            depths=np.bincount(depth[is_leaf]),
            extra=extra or {},
        )

    def to_json(self) -> dict[str, Any]:
        """Return a JSON-ready mapping; the constants stand under ``sah_constants``."""
        return {
            "N_IN": self.N_IN,
            "N_V": self.N_V,
            "N_EV": self.N_EV,
            "N_OIV": self.N_OIV,
            "max_depth": self.max_depth,
            "mean_leaf_size": self.mean_leaf_size,
            "sah": self.sah,
            "sah_constants": {"C_trav": self.C_trav, "C_isect": self.C_isect},
            "expected_inner": self.expected_inner,
            "expected_leaves": self.expected_leaves,
            "expected_tests": self.expected_tests,
            "leaf_sizes": self.leaf_sizes.tolist(),
            "depths": self.depths.tolist(),
            **self.extra,
        }
