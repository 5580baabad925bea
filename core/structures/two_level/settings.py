"""Settings of two levels: what each of them is, and how the top level is built."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...contract.structure import Structure
from ...settings import composed, parse_inner, setting
from ..bvh import BVH
from ..grid import STRUCTURE as GRID
from ..kdtree import KdTree
from ..octree import Octree
from .rebraid import RebraidSettings

BOTTOMS: dict[str, type[Structure]] = {each.name: each for each in (BVH, GRID, KdTree, Octree)}
"""What a bottom level may be."""

NONE, PARTIAL = "none", "partial"


@dataclass(frozen=True)
class OwnSettings:
    """Settings of both levels."""

    blas: str = setting(
        "bvh", "Bottom Level", "The structure of each mesh (BLAS)",
        choices={name: kind.summary for name, kind in BOTTOMS.items()},
    )  # fmt: skip
    blas_settings: str = setting(
        "", "Bottom Settings",
        "Settings of that structure, as on the command line, such as builder=ploc,max_leaf_size=2; "
        "empty for its defaults. There they stand in quotes",
    )  # fmt: skip
    tlas_settings: str = setting(
        "", "Top Settings",
        "Settings of the bvh over instances (TLAS), in the same form; re-braiding has a builder of "
        "its own and takes the constants of the cost alone",
    )  # fmt: skip
    shared: bool = setting(
        True, "Shared", "One bottom level for all instances of a mesh, not one for each of them"
    )
    rebraid: str = setting(
        NONE, "Re-braiding", "Whether the top level opens instances that overlap",
        choices={
            NONE: "Its leaves hold whole instances",
            PARTIAL: "Nodes of bottom levels that are long are opened (Benthin et al. 2017)",
        },
        only_for={"blas": ("bvh",)},
    )  # fmt: skip


TwoLevelSettings: Any = composed(
    "TwoLevelSettings", "Settings of both levels.", OwnSettings,
    {"rebraid": {PARTIAL: RebraidSettings}},
)  # fmt: skip


def settings_of_levels(settings: Any) -> tuple[Any, Any]:
    """Return the settings of the top level and of the bottom levels.

    Raises
    ------
    InputError
        For settings that a structure does not have.
    """
    return (
        _parsed(BVH, settings.tlas_settings, "tlas_settings"),
        _parsed(BOTTOMS[settings.blas], settings.blas_settings, "blas_settings"),
    )


def _parsed(kind: type[Structure], text: str, key: str) -> Any:
    return parse_inner(kind.Settings, kind.name, text, f"structure two_level, {key}")
