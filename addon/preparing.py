"""Preparing: after installation a process of its own compiles what would be waited for later.

Blender goes on meanwhile. The process runs this file, outside of any package: it makes the package
known under the very name that it has in Blender, since the cache knows types by their modules, and
then runs ``accelscope prepare``. It is one of low priority, and ends with Blender.
"""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import threading
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
"""As Blender has it, links and all: the place of what is compiled depends on it."""


WORKER = "worker"
"""After package and folder: to do parts of the work, as another process asks for them."""


def main(package: str, kernels: str, role: str = "") -> int:
    """Compile under the name of a package; kernels are kept in a folder, or where it is usual."""
    if role != WORKER and hasattr(os, "nice"):
        os.nice(19)  # its workers are as modest
    parents = package.split(".")
    for number in range(1, len(parents)):
        module = types.ModuleType(".".join(parents[:number]))
        module.__path__ = []
        sys.modules[module.__name__] = module
    spec = importlib.util.spec_from_file_location(
        package, ROOT / "__init__.py", submodule_search_locations=[str(ROOT)]
    )
    assert spec is not None
    assert spec.loader is not None
    sys.modules[package] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if kernels:
        importlib.import_module(f"{package}.core.kernel_cache").set_cache_root(kernels)
    if role == WORKER:
        importlib.import_module(f"{package}.addon.command.prepare").serve()
    return importlib.import_module(f"{package}.addon.command.main").main(["prepare"])


def start(command: Sequence[str], **streams: Any) -> subprocess.Popen[str]:
    """Start this file in another process, with an interpreter and the arguments of :func:`main`."""
    python, *arguments = command
    return subprocess.Popen(
        [python, str(Path(__file__).absolute()), *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        text=True, creationflags=getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0), **streams,
    )  # fmt: skip


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
        self.process = start(
            [python, package, kernels],
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


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:4]))
