# SPDX-License-Identifier: GPL-3.0-or-later
"""Install a zip into the Blender this runs in, use it, and tell what happened.

    python in_clean_blender.py ZIP REPORT.json ARGUMENT ...

The arguments are those of the command ``accelscope``; it is run out of the installed extension.

Run by test_extension.py in an environment that holds nothing but Blender.
"""

import importlib
import importlib.util
import json
import sys
from pathlib import Path

import bpy

MODULE = "bl_ext.user_default.accelscope"


def registered() -> set[str]:
    """Return the names of all that an add-on can leave behind in Blender."""
    names = {f"type {name}" for name in dir(bpy.types)}
    names |= {f"operator {name}" for name in dir(bpy.ops.accelscope)}
    names |= {f"scene property {p.identifier}" for p in bpy.types.Scene.bl_rna.properties}
    for event in dir(bpy.app.handlers):
        listed = getattr(bpy.app.handlers, event)
        if isinstance(listed, list):
            names |= {f"handler {event}: {function.__module__}" for function in listed}
    return names


def where(module: str) -> str | None:
    """Return the file of a module, without importing it, or None."""
    spec = importlib.util.find_spec(module)
    return spec.origin if spec else None


def main() -> None:
    """Do it all and write the report."""
    zip_path, report_path, *arguments = sys.argv[1:]
    before = registered()
    bpy.ops.extensions.package_install_files(
        filepath=zip_path, repo="user_default", enable_on_install=True
    )
    report: dict[str, object] = {
        "python": sys.version_info[:2],
        "numpy": where("numpy"),
        "wheels": {m: where(m) for m in ("numba", "llvmlite", "embreex")},
        "enabled": MODULE in bpy.context.preferences.addons,
        "operators": sorted(dir(bpy.ops.accelscope)),
        "imported": sorted({"numba", "embreex"} & set(sys.modules)),
    }

    added = registered() - before
    leftovers: list[str] = []
    for _ in range(2):
        bpy.ops.preferences.addon_disable(module=MODULE)
        leftovers += sorted(registered() - before)
        bpy.ops.preferences.addon_enable(module=MODULE)
        leftovers += sorted(registered() ^ before ^ added)
    report["leftovers"] = leftovers

    report["exit_code"] = importlib.import_module(f"{MODULE}.addon.command.main").main(arguments)
    folder = Path(sys.modules[MODULE].__file__ or "").parent
    report["folder"] = str(folder)
    report["compiled_beside_the_code"] = [str(path) for path in folder.rglob("*.nb[ci]")]

    # A handler that is still there when Python exits can hang Blender 4.5.
    bpy.ops.preferences.addon_disable(module=MODULE)
    Path(report_path).write_text(json.dumps(report), encoding="utf-8")


main()
