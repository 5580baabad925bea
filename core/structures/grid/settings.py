"""Settings of the uniform grid, and of whatever else has its cells."""

from __future__ import annotations

from dataclasses import dataclass

from ...contract.costs import intersection_cost, traversal_cost
from ...contract.lazy import lazy_setting
from ...settings import OPEN, setting


@dataclass(frozen=True)
class CellSettings:
    """Settings of whatever has the cells of a uniform grid."""

    resolution: tuple[int, int, int] = setting(
        (0, 0, 0),
        "Resolution",
        "Cells along x, y and z; 0 leaves it to the rule",
        unit="cells",
        minimum=0,
        unset="auto",
    )
    rule: str = setting(
        "woo",
        "Rule",
        "How the resolution follows from the number of triangles N and the density D",
        choices={
            "regular": "n = (D N)^(1/3) along every axis",
            "woo": "Near-cubic cells: (D N)^(1/3) along the longest axis, fewer along the others",
            "heterogeneous": "Cubic cells, D N of them in all (Klimaszewski)",
        },
        only_for={"resolution": OPEN},
    )
    density: float = setting(
        3.0,
        "Density",
        "Cells per triangle that the rule aims at; fewer where triangles are large",
        minimum=1e-6,
        maximum=1e6,
        only_for={"resolution": OPEN},
    )
    padding: float = setting(
        0.001,
        "Padding",
        "Enlargement of the scene's box on each side, as a share of its size",
        minimum=0.0,
        maximum=10.0,
    )
    overlap: str = setting(
        "closed",
        "Overlap",
        "Whether a triangle that only touches a cell's wall belongs to that cell",
        choices={
            "closed": "A triangle that reaches up to a wall also belongs to the cell above it",
            "open": "Only a true overlap counts; a ray that runs exactly in a wall may miss it",
        },
    )
    assignment: str = setting(
        "box",
        "Assignment",
        "What is compared with a cell",
        choices={"box": "The triangle's bounding box", "exact": "The triangle itself"},
    )
    mailbox: bool = setting(False, "Mailbox", "Test a triangle at most once per ray")
    C_trav: float = traversal_cost(is_flat=True)
    C_isect: float = intersection_cost()


@dataclass(frozen=True)
class GridSettings(CellSettings):
    """Settings of the uniform grid: of its cells, and when they are made."""

    lazy: bool = lazy_setting("A cell lists its triangles when a ray first enters it")
