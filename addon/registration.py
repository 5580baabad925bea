"""Registration: everything that is added to Blender, and taken away again."""

from __future__ import annotations

import atexit
import importlib
import pkgutil
from collections.abc import Sequence
from types import ModuleType
from typing import Any

import bpy

from ..core.evaluation.records.environment import set_blender_version
from ..core.kernel_cache import set_cache_root
from ..core.scene import Scene
from . import compile_ahead, jobs
from .from_blender import watching
from .preferences import ACCELSCOPE_Preferences
from .results import film, lesson_view, session
from .settings import properties

BASE_PACKAGE = __package__.rpartition(".")[0]
"""``accelscope``, or ``bl_ext.<repository>.accelscope`` in an extension."""

UPPER_FLOORS = ("operators", "panels")
"""Packages whose modules list classes to register under CLASSES. They are looked up by name, since
this floor must not import from those above; a new file there is found by itself."""

_registered: list[type] = []
_commands: list[Any] = []


def register() -> None:
    """Add classes, properties, handlers and the command to Blender."""
    if folder := compile_ahead.kernel_folder():
        set_cache_root(folder)
    set_blender_version(bpy.app.version_string)
    for floor in UPPER_FLOORS:
        for module in _modules_of(f"{BASE_PACKAGE}.{floor}"):
            for cls in getattr(module, "CLASSES", ()):
                bpy.utils.register_class(cls)
                _registered.append(cls)
    bpy.utils.register_class(ACCELSCOPE_Preferences)
    _registered.append(ACCELSCOPE_Preferences)
    properties.register()
    session.register()
    lesson_view.register()
    film.register()
    watching.register()
    # What is still registered when Python ends makes Blender 4.5 hang or crash.
    atexit.register(unregister)
    compile_ahead.start_soon()
    _commands.append(bpy.utils.register_cli_command("accelscope", _run_command))


def unregister() -> None:
    """Take away everything that :func:`register` added, and what came of it since."""
    atexit.unregister(unregister)
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())
    compile_ahead.stop()
    jobs.stop()
    watching.unregister()
    film.unregister()
    lesson_view.unregister()
    session.unregister()
    properties.unregister()
    while _registered:
        bpy.utils.unregister_class(_registered.pop())


def _modules_of(package_name: str) -> list[ModuleType]:
    """Import and return the modules of a package, in alphabetical order."""
    package = importlib.import_module(package_name)
    names = sorted(module.name for module in pkgutil.iter_modules(package.__path__))
    return [importlib.import_module(f"{package_name}.{name}") for name in names]


def _run_command(arguments: Sequence[str]) -> int:
    """Run ``blender --command accelscope``; without SCENE it takes the open file."""
    from .command.main import main
    from .from_blender import extraction

    def open_file(instances: str) -> Scene:
        return extraction.extract(bpy.context, extraction.VISIBLE, instances)

    # Blender ends afterwards, and prints that it does.
    return main(list(arguments), open_file, open_path=bpy.data.filepath, until_exit=True)
