"""One file per acceleration structure.

A module in this folder that defines ``STRUCTURE``, a structure of the module's name, is found by
itself: it appears in the panel, on the command line, in the reports and in the test matrix.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil
from typing import Any

import numpy as np

from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.csg.trees import Csg
from ..geometry.geometry import in_order
from ..geometry.instances import Instanced


def module_names() -> list[str]:
    """Return the names of the modules, nothing imported: every structure is called as its own."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))


def structure_in(module: str) -> type[Structure] | None:
    """Import a module, and return the structure that it defines; None if it has none."""
    found: type[Structure] | None = getattr(
        importlib.import_module(f"{__name__}.{module}"), "STRUCTURE", None
    )
    return found


def found_in_modules(without: str = "") -> list[type[Structure]]:
    """Return the structures of all modules, in alphabetical order of their files, but one."""
    names = [name for name in module_names() if f"{__name__}.{name}" != without]
    return [found for found in map(structure_in, names) if found is not None]


@functools.cache
def structures() -> dict[str, type[Structure]]:
    """Return every structure by name, in alphabetical order of their files."""
    return {structure.name: structure for structure in found_in_modules()}


def general_structures() -> dict[str, type[Structure]]:
    """Return those that answer rays of every class, by name: all but the directional ones."""
    return {name: each for name, each in structures().items() if each.answers is None}


def structure_named(name: str) -> type[Structure]:
    """Return the structure called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    # Its own module alone: importing all of them takes longer than building many a scene.
    found = structure_in(name) if name in module_names() else None
    if found is None:
        known = ", ".join(structures())
        raise InputError(f"there is no structure '{name}'; known are: {known}")
    return found


def structures_that_are(protocol: type) -> list[type[Structure]]:
    """Return those that can what one of :mod:`..contract.protocols` says."""
    return [each for each in structures().values() if issubclass(each, protocol)]


# Whatever is built over instances or trees of solids, their meshes have hierarchies of their own:
# those of a bvh, which is imported when there are any.


@in_order.register
def _(geometry: Instanced, order: np.ndarray) -> Any:
    from .bvh.forest import instances_of
    from .bvh.settings import BVHSettings

    return in_order(instances_of(geometry, BVHSettings()), order)


@in_order.register
def _(geometry: Csg, order: np.ndarray) -> Any:
    from .bvh.forest import csg_of_forest
    from .bvh.settings import BVHSettings

    return in_order(csg_of_forest(geometry, BVHSettings()), order)
