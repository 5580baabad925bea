"""Settings that all directional structures have: how faces are divided, what is put into cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from ...settings import setting
from .filling import Division
from .merging import EQUAL, KEEP, SIMILAR
from .projection import BOX, CONE, EXACT

UNIFORM, ADAPTIVE = "uniform", "adaptive"


def insert_setting(others: dict[str, str]) -> Any:
    """Declare what of an item is put into cells; some structures know other ways as well."""
    return setting(
        "exact",
        "Insert",
        "What of an item is put into cells",
        choices={
            "cone": "The cone around its bounding sphere",
            "box": "The rectangle around its bounding box",
            "exact": "Its own outline, if it is flat and convex, or its cone and rectangle",
            **others,
        },
    )


@dataclass(frozen=True)
class DirectionalSettings:
    """How faces are divided, and what is put into their cells."""

    division: str = setting(
        ADAPTIVE,
        "Division",
        "How a face is divided into cells",
        choices={
            UNIFORM: "Into equal squares",
            ADAPTIVE: "Into four, again and again, where lists are long",
        },
    )
    cells: int = setting(
        32, "Cells", "Cells along an edge of a face", unit="cells", minimum=1, maximum=1024,
        only_for={"division": [UNIFORM]},
    )  # fmt: skip
    max_list_size: int = setting(
        8, "Max List Size", "A cell is divided if more items are listed", unit="items", minimum=1,
        only_for={"division": [ADAPTIVE]},
    )  # fmt: skip
    max_depth: int = setting(
        10, "Max Depth", "How often a face is divided at most", minimum=1, maximum=14,
        only_for={"division": [ADAPTIVE]},
    )  # fmt: skip
    insert: str = insert_setting({})
    merge: str = setting(
        KEEP,
        "Merge",
        "Which cells share one list",
        choices={
            KEEP: "None: each has its own",
            EQUAL: "Those with equal lists",
            SIMILAR: "Those with equal lists, and cells in a row with similar ones",
        },
    )
    full_occlusion: bool = setting(
        True, "Full Occlusion", "A cell that one item covers is cut off behind it"
    )


METHODS = {"cone": CONE, "box": BOX, "exact": EXACT, "raster": EXACT}
"""How items are inserted into the lists in which nothing is missing."""


def division_of(settings: Any) -> Division:
    """Return how faces are divided."""
    if settings.division == ADAPTIVE:
        return Division(1, settings.max_list_size, settings.max_depth,
                        "lower max_depth, or raise max_list_size")  # fmt: skip
    return Division(settings.cells, 0, 0, "lower cells")
