"""What is chosen in the panel: a structure and rays, with their settings."""

from __future__ import annotations

from typing import Any

from .generated import read


def structure_chosen(root: Any) -> Any:
    """Return the class of the chosen structure."""
    from ...core.structures import structure_named

    return structure_named(root.structure)


def structure_and_settings(root: Any) -> tuple[type, Any]:
    """Return the chosen structure and its settings.

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    structure = structure_chosen(root)
    group = getattr(root.structures, structure.name)
    return structure, read(group, structure.Settings, structure.label)


def workload_and_settings(root: Any) -> tuple[type, Any]:
    """Return the chosen workload and its settings.

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    from ...core.evaluation.rays.workloads import workload_named

    workload = workload_named(root.workload)
    group = getattr(root.workloads, workload.name)
    return workload, read(group, workload.Settings, workload.label)


def is_refittable(structure: Any) -> bool:
    """Say whether a structure, or its class, can follow triangles that move."""
    from ...core.contract.protocols import Refittable

    kind = structure if isinstance(structure, type) else type(structure)
    return issubclass(kind, Refittable)


def refittable_labels() -> str:
    """Return the labels of the structures that can, for a message."""
    from ...core.contract.protocols import Refittable
    from ...core.structures import structures_that_are

    return " or ".join(each.label for each in structures_that_are(Refittable))
