"""Settings of ray classification."""

from __future__ import annotations

from dataclasses import dataclass

from ...settings import setting

KEEP, EQUAL, MUCH_ALIKE = "none", "equal", "similar"

CHUNK = 1 << 14
"""Rays that are traced before lists are thrown away, if that is asked for."""


@dataclass(frozen=True)
class RayClassificationSettings:
    """How ray space is divided, and which lists are kept."""

    dimensions: str = setting(
        "5",
        "Dimensions",
        "What is known of a ray",
        choices={"5": "Where it begins, and its direction", "6": "Its time, too"},
    )
    max_list_size: int = setting(
        8,
        "Max List Size",
        "A cell is divided if more items are listed",
        unit="items",
        minimum=1,
        maximum=1_000_000,
    )
    min_rays: int = setting(
        16, "Min Rays", "A cell is divided if so many rays of a batch are in it", unit="rays",
        minimum=1, maximum=1_000_000,
    )  # fmt: skip
    max_depth: int = setting(
        24, "Max Depth", "How often a root is divided in two at most", minimum=0, maximum=60
    )
    truncate: bool = setting(
        True, "Truncate", "Nothing is listed behind an item that blocks the whole beam of a cell"
    )
    merge: str = setting(
        EQUAL,
        "Merge",
        "Which cells share the list of the cell that they are a half of",
        choices={
            KEEP: "None: each has its own",
            EQUAL: "Those with the same list",
            MUCH_ALIKE: "Those whose list would lack less than a tenth of it",
        },
    )
    cull: bool = setting(
        False, "Cull Back Faces", "No ray hits a triangle from behind, and cells do not list those "
        "that all of their rays see so; of closed meshes, seen from outside, only hits at edges of "
        "the outline may be others",
    )  # fmt: skip
    most_references: int = setting(
        0, "Most References", "Lists that no ray has come to for the longest time are thrown away "
        f"if more is stored, after every {CHUNK} rays", unit="references", minimum=0,
        maximum=2**40,
        unset="unlimited",
    )  # fmt: skip
