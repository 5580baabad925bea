# SPDX-License-Identifier: GPL-3.0-or-later
"""AccelScope: see, step through and measure ray tracing acceleration structures.

In a script or a notebook this package has the names of :mod:`.addon.interface`::

    import accelscope

    scene = accelscope.load("sample:tetra:size=5")
    built = accelscope.build(scene, "bvh", builder="ploc")
    traced = accelscope.trace(built, "random_lines", count=1000)
    print(traced.counters["N_IT"].mean())

Blender insists on this file beside ``blender_manifest.toml``. It imports anything only when that is
asked for, so that Blender starts quickly, and ``accelscope.core`` can be used without Blender.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .addon.interface import (
        Box,
        Built,
        Cells,
        ClosedMesh,
        Cone,
        Difference,
        Disc,
        HalfSpace,
        InputError,
        Intersection,
        MovingTriangle,
        Placed,
        Polygon,
        Rays,
        Scene,
        Sphere,
        Steps,
        Structure,
        Traced,
        Triangle,
        Union,
        build,
        cells,
        cover,
        instances,
        launch,
        load,
        rays,
        record,
        scene,
        solids,
        structures,
        table,
        trace,
        trees,
        walk,
    )

__all__ = [
    "Box", "Built", "Cells", "ClosedMesh", "Cone", "Difference", "Disc", "HalfSpace", "InputError",
    "Intersection", "MovingTriangle", "Placed", "Polygon", "Rays", "Scene", "Sphere", "Steps",
    "Structure", "Traced", "Triangle", "Union", "build", "cells", "cover", "instances", "launch",
    "load", "rays", "record", "scene", "solids", "structures", "table", "trace", "trees", "walk",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return a name of the Python interface, which is imported at its first use."""
    if name not in __all__:  # Blender asks for names of its own, too
        raise AttributeError(f"module 'accelscope' has no attribute '{name}'")
    from .addon import interface

    return getattr(interface, name)


def register() -> None:
    """Register the add-on with Blender."""
    from . import addon

    addon.register()


def unregister() -> None:
    """Remove everything that `register` added."""
    from . import addon

    addon.unregister()
