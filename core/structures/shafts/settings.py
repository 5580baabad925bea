"""Settings of shafts: of their classes, of their start arrays, and of the tree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...errors import InputError
from ...scene import Scene
from ...settings import parse_inner, setting
from ..bvh import BVH
from .classes import Classes, classes_of


@dataclass(frozen=True)
class ShaftsSettings:
    """How rays are divided into classes, and how many starts a class may have."""

    max_starts: int = setting(
        16, "Max Starts", "Length of the start array of a class", unit="nodes",
        minimum=1, maximum=256,
    )  # fmt: skip
    origin_cells: int = setting(
        16, "Origin Cells", "Cells of the grid of origins along the longest side of the scene",
        unit="cells", minimum=1, maximum=256,
    )  # fmt: skip
    direction_cells: int = setting(
        4, "Direction Cells", "Squares along the edge of each of the six faces of directions",
        unit="squares", minimum=1, maximum=256,
    )  # fmt: skip
    bvh_settings: str = setting(
        "", "BVH Settings",
        "Settings of the tree, as those of a bvh on the command line, such as "
        "builder=ploc,max_leaf_size=2; empty for its defaults. There they stand in quotes",
    )  # fmt: skip


def settings_of_tree(settings: ShaftsSettings) -> Any:
    """Return the settings of the tree.

    Raises
    ------
    InputError
        For those that a bvh does not have, or whose tree is not binary.
    """
    own: Any = parse_inner(
        BVH.Settings, BVH.name, settings.bvh_settings, "structure shafts, bvh_settings"
    )
    if own.arity != "2":
        raise InputError(
            f"structure shafts, bvh_settings: walks start in binary trees; leave arity={own.arity} "
            "out"
        )
    return own


def classes_over(scene: Scene, settings: ShaftsSettings) -> Classes:
    """Return the classes of a scene's rays."""
    box = np.concatenate([scene.lower, scene.upper])
    return classes_of(box, settings.origin_cells, settings.direction_cells)
