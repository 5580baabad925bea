"""``accelscope efficiency``: what a bounding volume is worth for an object.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Sequence
from pathlib import Path

from ...core.errors import InputError
from ...core.evaluation.records.efficiency_settings import EfficiencySettings
from ...core.settings import describe, parse
from .arguments import SPECS, OpenFile, add_scene_options, opened, scenes_of, take_scenes
from .output import Results, add_output_options, note_on, progress_of, refuse_bad_outputs

EXAMPLES = """\
examples:
  accelscope efficiency bunny.obj
  accelscope efficiency sample:suzanne --volume aabb kdop14 --pictures suzanne
  accelscope efficiency scene.blend --spread 3 --direction 1x1x0 --json -
"""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "efficiency",
        help="what a bounding volume is worth for an object: B + p I < I",
        description="Measure the efficiency of bounding volumes around a whole scene: the times B "
        "and I of their tests on this machine, p from areas and from random lines, the verdict.",
        epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="one; without it, Blender's open file")
    add("--volume", nargs="+", action="extend", metavar="KIND",
        help="kinds of volumes; simple, the default, is all but combined ones")  # fmt: skip
    add("--direction", nargs="+", action="extend", metavar="XxYxZ",
        help="view directions for projected areas, such as 1x0x-1 (default: x, y, z)")  # fmt: skip
    for entry in describe(EfficiencySettings):
        add(f"--{entry['key']}", metavar="N", help=entry["description"])
    add_scene_options(parser, are_flattened=True)
    add_output_options(parser, "pictures of the lines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Measure and write what was asked for; return the exit code.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scene or the places to write to.
    """
    from ...core.evaluation.pages.efficiency_page import write_page
    from ...core.evaluation.records.efficiency import Measurement, table
    from ...core.geometry.kinds import COMBINED, KINDS

    named = take_scenes(arguments, "volume", [*KINDS, *COMBINED, "simple", "all"], "kind of volume")
    kinds = volume_kinds(named or ["simple"])
    words = take_scenes(arguments, "direction", (), "direction")
    directions = {text: direction_of(text) for text in words} or None
    keys = [entry["key"] for entry in describe(EfficiencySettings)]
    texts = {key: text for key in keys if (text := getattr(arguments, key)) is not None}
    settings = parse(EfficiencySettings, texts, "efficiency")
    scenes = scenes_of(arguments.scenes, arguments.instances, open_file)
    if len(scenes) > 1:
        raise InputError(f"efficiency takes one SCENE, not {len(scenes)}")
    refuse_bad_outputs(arguments, arguments.scenes)

    _, open_one = scenes[0]
    scene = opened(open_one, progress_of(arguments))
    note_on(arguments, scene)
    measurement = Measurement(scene, settings, directions, progress_of(arguments))
    with Results(arguments, table, len(kinds)) as results:
        results.write_page = lambda: write_page(Path(arguments.pictures), scene, results.records)
        for kind in kinds:
            record, reason = results.attempt(kind, functools.partial(measurement.of, kind))
            results.records.append(record or {**measurement.what(kind), "error": reason})
            results.keep()
    return results.exit_code


def volume_kinds(names: Sequence[str]) -> list[str]:
    """Return the kinds of volumes that are named, each once.

    Raises
    ------
    InputError
        For an unknown name, listing the known ones.
    """
    from ...core.geometry.kinds import COMBINED, KINDS

    known = {**KINDS, **COMBINED}
    chosen: list[str] = []
    for name in names:
        if name not in (*known, "simple", "all"):
            raise InputError(
                f"there is no volume '{name}'; known are: {', '.join(known)}, simple and all"
            )
        chosen += {"simple": list(KINDS), "all": list(known)}.get(name, [name])
    return list(dict.fromkeys(chosen))


def direction_of(text: str) -> tuple[float, float, float]:
    """Return the direction that ``1x0x0`` means.

    Raises
    ------
    InputError
        If it is none.
    """
    from ...core.evaluation.rays.workloads import CameraSettings
    from ...core.settings import parse

    direction = parse(CameraSettings, {"at": text}, "--direction").at
    if not any(direction):
        raise InputError(f"--direction {text} has no length; name another, such as 1x0x0")
    return direction
