"""The environment: versions and the machine, so that a record says where its times are from."""

from __future__ import annotations

import datetime
import functools
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ...kernels import has_numba
from ...parallel import core_count

MANIFEST = Path(__file__).parents[3] / "blender_manifest.toml"
"""Beside the package itself; the extension and the installed package have it, too."""

CPU_INFO = Path("/proc/cpuinfo")

_blender: str | None = None


def set_blender_version(version: str) -> None:
    """Tell which Blender this process runs in, or has loaded; the core cannot ask it."""
    global _blender
    _blender = version


def environment(threads: int | None) -> dict[str, Any]:
    """Return versions, machine and time as JSON takes them.

    Parameters
    ----------
    threads : int or None
        How many threads traced; None where nothing was traced.

    Returns
    -------
    dict
        ``accelscope``, ``blender`` (None without), ``python``, ``numpy``, ``numba`` (None
        without), ``processor`` (its name), ``cores`` (those that this process may use),
        ``threads``, ``platform``, and ``date``, when the record was made: ISO 8601 in UTC.
    """
    now = datetime.datetime.now(datetime.UTC)
    return {
        "accelscope": own_version(),
        "blender": _blender,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba_version(),
        "processor": processor(),
        "cores": core_count(),
        "threads": threads,
        "platform": platform.platform(),
        "date": now.isoformat(timespec="seconds"),
    }


@functools.cache
def own_version() -> str:
    """Return the version of AccelScope."""
    import tomllib

    return str(tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"])


def numba_version() -> str | None:
    """Return the version of Numba; None where kernels run as plain Python."""
    if not has_numba():
        return None
    import numba

    return str(numba.__version__)


@functools.cache
def processor() -> str:
    """Return the processor's name, or what kind it is where the system does not know more."""
    if sys.platform == "linux" and CPU_INFO.is_file():
        # Here platform.processor() knows the kind only, if anything.
        for line in CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines():
            key, _, value = line.partition(":")
            if key.strip() == "model name" and value.strip():
                return value.strip()
    return platform.processor() or platform.machine()
