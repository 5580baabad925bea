"""The builders by name. Each groups triangles in its own way; see the file of its name."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from . import binned_sah, sweep_sah
from .tree import Grouping, Primitives

if TYPE_CHECKING:
    from .settings import BVHSettings

    Builder = Callable[[Primitives, BVHSettings, Progress], Grouping]

BUILDERS: dict[str, tuple[str, Builder]] = {
    "sweep_sah": ("From the top down, SAH evaluated between all centroids", sweep_sah.build),
    "binned_sah": (
        "From the top down, SAH evaluated at bin borders (Wald 2007)", binned_sah.build
    ),
}  # fmt: skip
"""For each builder one sentence, and the function that builds."""
