"""``make demo``: sample scenes through Blender, every structure over every scene.

Blender runs without a window here: the add-on puts each sample scene into an empty file and saves
it, then the command line evaluates those files as it would evaluate anybody's.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from ...core.printing import print_lines

RAYS = ("camera:width=160,height=120", "random_lines:count=10000")
"""Few, because the naive algorithm is among the structures."""


def shown() -> list[str]:
    """Return the names of the samples that are shown: those of triangles.

    Every structure is built over them; ``accelscope evaluate sample:balls`` shows solids.
    """
    from ...sample_scenes import samples

    return [
        name for name, each in samples().items() if each.described is None and each.parts is None
    ]


def make_blend_files(folder: Path, names: list[str]) -> list[str]:
    """Save each of some sample scenes as a .blend and return their paths."""
    import bpy

    from .. import register, unregister

    register()
    try:
        paths = []
        for name in names:
            bpy.ops.wm.read_factory_settings(use_empty=True)
            bpy.ops.accelscope.add_sample_scene(sample=name)
            paths.append(str(folder / f"{name}.blend"))
            bpy.ops.wm.save_as_mainfile(filepath=paths[-1])
        return paths
    finally:
        unregister()


def main() -> int:
    """Make the scenes, evaluate them, and say where everything is."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("build/demo"))
    parser.add_argument("--samples", nargs="+", default=shown(), metavar="NAME")
    arguments = parser.parse_args()
    output = arguments.output.resolve()
    scenes = output / "scenes"
    scenes.mkdir(parents=True, exist_ok=True)
    print_lines(f"Saving the sample scenes to {scenes}", None, flush=True)
    paths = make_blend_files(scenes, arguments.samples)

    from .main import main as command

    print_lines("Evaluating them with every structure (some ten minutes)", None, flush=True)
    code = command(
        ["evaluate", *paths, "--structure", "all", "--rays", *RAYS,
         "--json", str(output / "records.json"), "--csv", str(output / "records.csv"),
         "--pictures", str(output / "pictures")]
    )  # fmt: skip
    if code == 0:
        print_lines(f"\nFigures:  {output / 'records.csv'}, {output / 'records.json'}", None)
        print_lines(f"Pictures: {output / 'pictures' / 'index.html'}", None)
    return code


if __name__ == "__main__":
    sys.exit(main())
