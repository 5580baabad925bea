"""The bounding volume hierarchy: its tree, its builders, its walk."""

from .hierarchy import BVH, BVHSettings

STRUCTURE = BVH

__all__ = ["BVH", "STRUCTURE", "BVHSettings"]
