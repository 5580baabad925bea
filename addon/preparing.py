"""Preparing: after installation a process of its own compiles what would be waited for later.

Blender goes on meanwhile. The process runs ``accelscope prepare``; it is one of low priority, and
ends with Blender.
"""

from __future__ import annotations

import subprocess
import sys
import threading
from typing import Any

from ..core.another_process import start


def start_modestly(module: str, *arguments: str, **options: Any) -> Any:
    """Have a module serve in another process; on Windows one of low priority."""
    flags = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
    return start(module, *arguments, text=True, creationflags=flags, **options)


class Preparation:
    """The process, and how far it is.

    Parameters
    ----------
    package : str
        Name of the package in this process.
    kernels : str
        The folder of compiled kernels; empty for the usual one.
    python : str
        The interpreter.
    """

    def __init__(self, package: str, kernels: str, python: str = sys.executable) -> None:
        self.text = "0 of 1: starting"
        self.process = start_modestly(
            "addon.command.main", "prepare", "--modestly",
            python=python, package=package, kernels=kernels,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.text = line.strip() or self.text

    @property
    def is_running(self) -> bool:
        """Whether it is still at work."""
        return self.process.poll() is None

    @property
    def done(self) -> tuple[float, str]:
        """How far it is, from 0 to 1, and with what it is busy."""
        numbers, _, what = self.text.partition(": ")
        number, _, count = numbers.partition(" of ")
        if not (number.isdigit() and count.isdigit() and int(count)):
            return 0.0, self.text
        return int(number) / int(count), what

    def stop(self) -> None:
        """End it at once; what it has compiled so far is kept, each kernel whole or not at all."""
        if self.is_running:
            self.process.kill()  # it would not listen to less until a kernel is compiled
        self.process.wait()
