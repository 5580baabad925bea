"""Another process of this package: compiling takes one core, and most machines have several.

It runs this file, outside of any package: it makes the package known under the very name that it
has in the process that starts it (in Blender a longer one), since the cache of kernels knows types
by their modules.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import os
import pickle
import subprocess
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

ROOT = Path(__file__).absolute().parents[1]
"""As Blender has it, links and all: the place of what is compiled depends on it."""

PACKAGE = (__package__ or "").removesuffix(".core")
"""The package's name in this process."""


def make_known(package: str) -> None:
    """Import the package under a name."""
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


def start(
    module: str, *arguments: str, python: str = sys.executable, package: str = PACKAGE,
    kernels: str | None = None, **options: Any,
) -> Any:  # fmt: skip
    """Have the function ``serve`` of a module of this package run by another process.

    Parameters
    ----------
    module : str
        Within the package (``"addon.command.main"``).
    *arguments
        For the function.
    python : str
        The interpreter.
    package : str
        The name under which it imports the package.
    kernels : str, optional
        Its folder of compiled kernels; that of this process, unless another is given.
    **options
        For :class:`subprocess.Popen`.

    Returns
    -------
    subprocess.Popen
    """
    if kernels is None:
        from .kernel_cache import cache_directory

        kernels = str(cache_directory().parent)
    return subprocess.Popen(
        [python, str(Path(__file__).absolute()), package, kernels, module, *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}, **options,
    )  # fmt: skip


class CannotHelp(Exception):
    """There is no other process that could do a task."""


class Task:
    """A function that another process runs, for what it leaves on disk.

    Parameters
    ----------
    work : callable
        Of a module of this package, by its name.
    *arguments
        What can be pickled.

    Raises
    ------
    CannotHelp
        If something cannot be pickled, as a class of a function or of another program's, or the
        system gives no process.
    """

    def __init__(self, work: Callable[..., None], *arguments: Any) -> None:
        try:
            task = pickle.dumps((work, arguments))
            self._process = self._start()
        except (OSError, pickle.PicklingError, AttributeError, TypeError) as error:
            raise CannotHelp(str(error)) from error
        # A pipe takes some kilobytes at once; with more, this waits until the other one reads.
        with contextlib.suppress(OSError), self._process.stdin as pipe:
            pipe.write(task)

    @staticmethod
    def _start() -> Any:
        return start(
            "core.another_process",
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def wait(self) -> None:
        """Wait until it has ended, well or not."""
        self._process.wait()

    def stop(self) -> None:
        """End it at once, unless it has ended."""
        self._process.kill()
        self._process.wait()


def serve() -> None:
    """Run the task that comes in."""
    work, arguments = pickle.load(sys.stdin.buffer)
    work(*arguments)


def main(package: str, kernels: str, module: str, *arguments: str) -> Any:
    """Run the function ``serve`` of a module; kernels lie in a folder, or where it is usual."""
    make_known(package)
    if kernels:
        importlib.import_module(f"{package}.core.kernel_cache").set_cache_root(kernels)
    return importlib.import_module(f"{package}.{module}").serve(*arguments)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
