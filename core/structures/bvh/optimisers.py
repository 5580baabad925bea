"""The optimisers by name. Each rearranges a finished tree in its own way; see its file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from ...progress import Progress
from .tree import LinkedTree

if TYPE_CHECKING:
    from .settings import BVHSettings

    Optimiser = Callable[[LinkedTree, BVHSettings, Progress], list[float]]

OPTIMISERS: dict[str, tuple[str, Optimiser | None]] = {
    "none": ("It stays as the builder made it", None),
}
"""For each optimiser one sentence, and the function that rearranges a tree in place.

It returns the SAH cost of the tree, one triangle a leaf, before the first step and after each.
"""
