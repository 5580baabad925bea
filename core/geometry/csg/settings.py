"""Settings of how the trees of a scene are cut."""

from __future__ import annotations

from dataclasses import dataclass

from ...settings import setting

NONE, UPWARD, CUT = "none", "upward", "cut"

VOLUMES = {
    "aabb": "Axis-aligned boxes, exactly",
    "kdop14": "Seven strips, exactly",
    "kdop18": "Nine strips, exactly",
    "kdop26": "Thirteen strips, exactly",
    "sphere": "Spheres: of two that meet, the smallest around what they share",
    "obb": "Oriented boxes: of two that meet, the smaller one",
}


@dataclass(frozen=True)
class CuttingSettings:
    """What a ray is tested with before it is tested with the operands of a CSG tree.

    No choice changes a hit.
    """

    csg_bounds: str = setting(
        CUT, "CSG Bounds", "Where the bounds of the nodes of CSG trees come from",
        choices={
            CUT: "From the leaves up, and cut by what lies above, until nothing changes",
            UPWARD: "From the leaves up only",
            NONE: "There are none: every ray is tested with every leaf",
        },
    )  # fmt: skip
    csg_volume: str = setting(
        "aabb", "CSG Volume", "What is put around the nodes of CSG trees",
        choices=VOLUMES, only_for={"csg_bounds": (CUT, UPWARD)},
    )  # fmt: skip
