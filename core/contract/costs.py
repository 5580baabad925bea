"""The constants of the cost model, as settings that several structures have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ..settings import setting


def traversal_cost(is_flat: bool = False) -> Any:
    """Declare C_trav, the lecture's t_tra; a flat structure has no inner nodes to reckon with."""
    return setting(
        1.2,
        "C_trav",
        "Cost of one traversal step, in the unit of C_isect"
        + "; enters no figure here, where there are no inner nodes" * is_flat,
        minimum=0.0,
        maximum=1e9,
    )


def intersection_cost() -> Any:
    """Declare C_isect, the lecture's t_tri."""
    return setting(
        1.0,
        "C_isect",
        "Cost of one ray-triangle test, in the unit of C_trav",
        minimum=0.0,
        maximum=1e9,
    )


@dataclass(frozen=True)
class CostSettings:
    """The constants of the SAH."""

    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()
