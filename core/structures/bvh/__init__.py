"""The bounding volume hierarchy: builders, optimisers, volumes, walks."""

from .hierarchy import BVH
from .settings import BVHSettings

STRUCTURE = BVH

__all__ = ["BVH", "STRUCTURE", "BVHSettings"]
