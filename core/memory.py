"""Sizes that do not fit are refused before they are allocated."""

from __future__ import annotations

import contextlib
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
    return min(_available_on_machine(), _available_to_process(), _available_to_group())


def _available_on_machine() -> int:
    try:
        for line in Path("/proc/meminfo").read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    except OSError:
        pass  # no /proc: macOS
    return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") // 2


NO_LIMIT = 1 << 62


def _available_to_process() -> int:
    """Return what ``ulimit -v`` leaves."""
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return NO_LIMIT
    try:
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    except OSError:
        taken = 0
    return max(limit - taken, 0)


CONTROL_GROUPS = Path("/sys/fs/cgroup")
OWN_GROUPS = Path("/proc/self/cgroup")


def _available_to_group() -> int:
    """Return what the limit of a container leaves, at any level above this process.

    Whoever takes more is killed. What the files read so far take there is given back when needed.
    """
    available = NO_LIMIT
    try:
        lines = OWN_GROUPS.read_text().splitlines()
    except OSError:
        return available
    for line in lines:
        _, controllers, place = line.split(":", 2)
        if controllers == "":  # the second version has one tree of groups for everything
            root, names = CONTROL_GROUPS, ("memory.max", "memory.current", "inactive_file ")
        elif "memory" in controllers.split(","):
            root = CONTROL_GROUPS / "memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file ")
        else:
            continue
        folder = root / place.lstrip("/")
        for group in (folder, *folder.parents):
            if root not in (group, *group.parents):
                break
            with contextlib.suppress(OSError, ValueError):  # there is none, or its limit is "max"
                limit = int((group / names[0]).read_text())
                if limit >= NO_LIMIT:  # the first version has no word for it
                    continue
                taken = int((group / names[1]).read_text())
                for entry in (group / "memory.stat").read_text().splitlines():
                    if entry.startswith(names[2]):
                        taken -= int(entry.split()[1])
                available = min(available, max(limit - taken, 0))
    return available


def _available_on_windows() -> int:
    class Status(ctypes.Structure):
        _fields_ = [("length", ctypes.c_ulong), ("load", ctypes.c_ulong)] + [
            (name, ctypes.c_ulonglong)
            for name in ("total", "available", "total_page", "free_page", "total_virtual",
                         "free_virtual", "free_extended")
        ]  # fmt: skip

    status = Status(length=ctypes.sizeof(Status))
    kernel32 = ctypes.windll.kernel32  # type: ignore[attr-defined]  # only Windows has it
    kernel32.GlobalMemoryStatusEx(ctypes.byref(status))
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
        raise _refusal(needed, limit, what, advice)


def _refusal(needed: int, limit: int, what: str, advice: str) -> InputError:
    return InputError(
        f"{what} needs {in_words(needed)} of memory, {in_words(limit)} can be had; {advice}"
    )


class Tally:
    """Refuses many things, each small enough, that together do not fit.

    Parameters
    ----------
    what, advice : str
        What they are, and what to do instead.
    """

    def __init__(self, what: str, advice: str) -> None:
        self._what, self._advice, self._total = what, advice, 0
        self._limit = int(available_bytes() * SHARE)

    def add(self, size: int) -> None:
        """Take note of `size` bytes more, which are taken already or will be.

        Raises
        ------
        InputError
            If all so far are more than the machine could give in the beginning.
        """
        self._total += size
        if self._total > self._limit:
            raise _refusal(self._total, self._limit, self._what, self._advice)


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
