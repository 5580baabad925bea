"""Sizes that do not fit are refused before they are allocated."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path

from .errors import InputError

SHARE = 0.8  # of what is available; the rest is left to Blender and the system


def available_bytes() -> int:
    """Return how much memory can still be had without swapping."""
    if sys.platform == "win32":
        return _available_on_windows()
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except OSError:
        pass  # no /proc: macOS
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2


def _available_on_windows() -> int:
    class Status(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)] + [
            (name, ctypes.c_ulonglong)
            for name in ("total", "available", "total_page", "free_page", "total_virtual",
                         "free_virtual", "free_extended")
        ]  # fmt: skip

    status = Status(length=ctypes.sizeof(Status))
    ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status))  # type: ignore[attr-defined]
    return status.available


def refuse_if_too_large(needed: int, what: str, advice: str) -> None:
    """Raise InputError if `needed` bytes for `what` are more than the machine can give.

    Parameters
    ----------
    advice : str
        What to do instead, for example ``"lower the resolution"``.
    """
    limit = int(available_bytes() * SHARE)
    if needed > limit:
        raise InputError(
            f"{what} needs {in_words(needed)} of memory, {in_words(limit)} can be had; {advice}"
        )


MOST_NUMBERS = 2**31 - 1
"""Triangles, nodes, cells and references have numbers of 32 bits."""


def refuse_if_unnumbered(count: float, what: str, advice: str) -> None:
    """Raise InputError if there would be more things of a kind than there are numbers for them.

    Parameters
    ----------
    what : str
        The things, for example ``"cells of the grid"``.
    advice : str
        What to do instead.
    """
    if count > MOST_NUMBERS:
        counted, most = (f"{number:,.0f}".replace(",", " ") for number in (count, MOST_NUMBERS))
        raise InputError(
            f"{counted} {what} are more than the {most} that can be numbered; {advice}"
        )


def in_words(count: float) -> str:
    """Return a number of bytes such as ``"3.2 GiB"``."""
    for unit in ("bytes", "KiB", "MiB", "GiB", "TiB", "PiB"):
        if count < 1024 or unit == "PiB":
            return f"{count:.0f} {unit}" if unit == "bytes" else f"{count:.1f} {unit}"
        count /= 1024
    raise AssertionError("unreachable")
