"""Cones and pyramids: probes that ask which items lie in a direction, give or take an angle.

A cone goes through the same walks as a ray: it has all that a ray has, its axis, and an angle
beside. Only two questions are answered otherwise: whether it reaches into a volume, and whether it
meets an item. The answer is not the nearest hit but everything that it meets.

- :mod:`.cone`: what a cone is, and a pyramid;
- :mod:`.volumes`: whether one reaches into a volume;
- :mod:`.triangle`, :mod:`.sphere`: whether one meets an item.

J. Amanatides: Ray Tracing with Cones, SIGGRAPH 1984.
"""

# Imported for what they register.
from . import sphere as sphere
from . import triangle as triangle
from . import volumes as volumes
from .cone import ROUND as ROUND
from .cone import SQUARE as SQUARE
from .cone import Cone as Cone
from .cone import ConeArrays as ConeArrays
from .cone import Spread as Spread
from .cone import cones_around as cones_around
from .sphere import meets_all as meets_all
