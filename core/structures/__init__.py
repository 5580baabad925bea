"""One file per acceleration structure.

A module in this folder that defines ``STRUCTURE`` is found by itself: it appears in the panel, on
the command line, in the reports and in the test matrix.
"""

from __future__ import annotations

import functools
import importlib
import pkgutil

from ..contract.structure import Structure
from ..errors import InputError


def found_in_modules(without: str = "") -> list[type[Structure]]:
    """Return the structures of all modules, in alphabetical order of their files, but one."""
    found = []
    for module in sorted(pkgutil.iter_modules(__path__), key=lambda module: module.name):
        name = f"{__name__}.{module.name}"
        if name != without:
            structure = getattr(importlib.import_module(name), "STRUCTURE", None)
            if structure is not None:
                found.append(structure)
    return found


@functools.cache
def structures() -> dict[str, type[Structure]]:
    """Return every structure by name, in alphabetical order of their files."""
    return {structure.name: structure for structure in found_in_modules()}


def structure_named(name: str) -> type[Structure]:
    """Return the structure called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    try:
        return structures()[name]
    except KeyError:
        known = ", ".join(structures())
        raise InputError(f"there is no structure '{name}'; known are: {known}") from None


def structures_that_are(protocol: type) -> list[type[Structure]]:
    """Return those that can what one of :mod:`..contract.protocols` says."""
    return [each for each in structures().values() if issubclass(each, protocol)]
