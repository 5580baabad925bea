"""Two levels: a top-level structure over instances, a bottom-level one for each mesh."""

from .settings import TwoLevelSettings
from .structure import TwoLevel

STRUCTURE = TwoLevel

__all__ = ["STRUCTURE", "TwoLevel", "TwoLevelSettings"]
