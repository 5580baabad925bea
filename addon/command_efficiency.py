"""``accelscope efficiency``: what a bounding volume is worth for an object.

Like :mod:`.command`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

from ..core.errors import InputError
from ..core.evaluation.efficiency_settings import EfficiencySettings
from ..core.scene import Scene
from ..core.settings import describe, parse
from .command_arguments import (
    add_output_options,
    progress_of,
    refuse_bad_outputs,
    scenes_of,
    write_records,
)

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
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scene", nargs="?", metavar="SCENE",
        help="a mesh file, a .blend or sample:NAME[:key=value,...]")  # fmt: skip
    add("--volume", nargs="+", default=["simple"], metavar="KIND",
        help="kinds of volumes; simple, the default, is all but combined ones")  # fmt: skip
    add("--direction", nargs="+", default=[], metavar="XxYxZ",
        help="view directions for projected areas, instead of x, y and z")  # fmt: skip
    for entry in describe(EfficiencySettings):
        add(f"--{entry['key']}", metavar="N", help=entry["description"])
    add_output_options(parser, "pictures of the lines")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: Callable[[], Scene] | None) -> None:
    """Measure and write what was asked for.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scene or the places to write to.
    """
    from ..core.evaluation.efficiency import efficiency_of, table
    from ..core.evaluation.efficiency_page import write_page

    kinds = volume_kinds(arguments.volume)
    directions = {text: direction_of(text) for text in arguments.direction} or None
    keys = [entry["key"] for entry in describe(EfficiencySettings)]
    texts = {key: text for key in keys if (text := getattr(arguments, key)) is not None}
    settings = parse(EfficiencySettings, texts, "efficiency")
    named = [arguments.scene] if arguments.scene else []
    (open_one,) = scenes_of(named, open_file)
    refuse_bad_outputs(arguments, named)

    scene = open_one()
    records = efficiency_of(scene, kinds, settings, directions, progress_of(arguments))
    if arguments.pictures:
        write_page(Path(arguments.pictures), scene, records)
    write_records(arguments, records, table)


def volume_kinds(names: Sequence[str]) -> list[str]:
    """Return the kinds of volumes that are named, each once.

    Raises
    ------
    InputError
        For an unknown name, listing the known ones.
    """
    from ..core.geometry.kinds import COMBINED, KINDS

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
    from ..core.evaluation.workloads import CameraSettings
    from ..core.settings import parse

    direction = parse(CameraSettings, {"at": text}, "--direction").at
    if not any(direction):
        raise InputError(f"--direction {text} has no length; name another, such as 1x0x0")
    return direction
