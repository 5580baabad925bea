"""The workload ``file``: rays of the user's own."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from ...errors import InputError, naming
from ...geometry.rays import Rays
from ...scene import Scene
from ...settings import setting
from .ray_files import headers_of, read_rays
from .workload import Workload, ray_order


@dataclass(frozen=True)
class FileSettings:
    """Settings of rays from a file."""

    path: str = setting(
        "",
        "File",
        "An .npz with origins (n, 3), directions (n, 3) and optionally t_min, t_max, query, "
        "ray_class, source, target, time, mask, pixel (n each): what --hits writes",
    )
    order: str = ray_order()


class FileWorkload(Workload):
    """Rays of the user's own, from an .npz file."""

    name = "file"
    label = "File"
    summary = "Rays from an .npz file, such as --hits writes"
    Settings = FileSettings

    @staticmethod
    def refuse_impossible(settings: FileSettings) -> None:
        """Refuse a file that has no rays, by what it says of its arrays."""
        path = path_of(settings)
        with naming(str(path)):
            headers_of(path)

    @staticmethod
    def make(scene: Scene, settings: FileSettings) -> Rays:
        """Read the rays; they are the same for every scene."""
        path = path_of(settings)
        with naming(str(path)):
            return read_rays(path)


def path_of(settings: FileSettings) -> Path:
    """Return the path of a file of rays.

    Raises
    ------
    InputError
        If none is given.
    """
    if not settings.path:
        raise InputError("rays from a file need its path, that of an .npz file")
    # Path.expanduser raises for ~name if there is nobody of that name, though there may be a file.
    return Path(os.path.expanduser(settings.path))
