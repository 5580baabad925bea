"""The builders by name. Each groups triangles in its own way; see the file of its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from . import binned_sah, hlbvh, lbvh, lbvh_parallel, ploc
from .tree import Grouping, Primitives

if TYPE_CHECKING:
    from .settings import BVHSettings

    Builder = Callable[[Primitives, BVHSettings, Progress], Grouping]

BUILDERS: dict[str, tuple[str, Builder]] = {
    "binned_sah": (
        "From the top down, SAH evaluated at bin borders (Wald 2007)", binned_sah.build
    ),
    "lbvh": ("Intervals of sorted Morton codes (Lauterbach 2009)", lbvh.build),
    "lbvh_parallel": ("The tree of LBVH, all nodes at once (Karras 2012)", lbvh_parallel.build),
    "hlbvh": ("LBVH below, SAH above (Pantaleoni and Luebke 2010)", hlbvh.build),
    "ploc": ("Bottom-up, neighbours along the Morton curve merge (Meister 2018)", ploc.build),
}  # fmt: skip
"""For each builder one sentence, and the function that builds."""
