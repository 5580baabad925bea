"""Workloads by name: sets of rays, one file each."""

from __future__ import annotations

from ...errors import InputError
from ...sah.line_sample import random_lines
from .ambient import AmbientSettings, AmbientWorkload
from .camera import CameraSettings, CameraWorkload, camera_of
from .from_file import FileSettings, FileWorkload
from .lines import RandomLinesSettings, RandomLinesWorkload
from .whitted import WhittedSettings, WhittedWorkload
from .workload import Generations, Workload, ray_order

__all__ = [
    "WORKLOADS", "AmbientSettings", "AmbientWorkload", "CameraSettings", "CameraWorkload",
    "FileSettings", "FileWorkload", "Generations", "RandomLinesSettings", "RandomLinesWorkload",
    "WhittedSettings", "WhittedWorkload", "Workload", "camera_of", "random_lines", "ray_order",
    "workload_named", "workloads",
]  # fmt: skip

WORKLOADS: dict[str, type[Workload]] = {
    workload.name: workload
    for workload in (
        CameraWorkload,
        WhittedWorkload,
        AmbientWorkload,
        RandomLinesWorkload,
        FileWorkload,
    )
}


def workloads() -> dict[str, type[Workload]]:
    """Return every workload by name."""
    return WORKLOADS


def workload_named(name: str) -> type[Workload]:
    """Return the workload called `name`.

    Raises
    ------
    InputError
        Listing the known names.
    """
    if name not in WORKLOADS:
        known = ", ".join(WORKLOADS)
        raise InputError(f"there are no rays '{name}'; known are: {known}")
    return WORKLOADS[name]
