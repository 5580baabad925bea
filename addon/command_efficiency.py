"""``accelscope efficiency``: what a bounding volume is worth for an object.

Like :mod:`.command`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from ..core.errors import InputError
from ..core.progress import SILENT, TerminalProgress
from ..core.scene import Scene

EXAMPLES = """\
examples:
  accelscope efficiency bunny.obj
  accelscope efficiency sample:suzanne --volume aabb kdop14 --pictures suzanne
  accelscope efficiency scene.blend --spread 3 --direction 1x1x0 --json -
"""

NUMBERS = {
    "lines": "how many random lines, and how many along each direction",
    "seed": "another seed gives other lines",
    "spread": "size of the ball that lines go through, in that around the object's box",
}


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
    for key, text in NUMBERS.items():
        add(f"--{key}", metavar="N", help=text)
    add("--json", metavar="PATH", help="write the records as JSON; - is standard output")
    add("--csv", metavar="PATH", help="write the records as CSV")
    add("--pictures", metavar="DIR", help="write pictures of the lines, and a page")
    add("--quiet", action="store_true", help="print no table and no progress")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: Callable[[], Scene] | None) -> None:
    """Measure and write what was asked for.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scene or the places to write to.
    """
    from ..core.evaluation.efficiency import EfficiencySettings, efficiency_of, table
    from ..core.evaluation.efficiency_page import write_page
    from ..core.evaluation.report import to_json_text, write_csv, write_json
    from ..core.settings import parse
    from .command import open_scene, refuse_to_overwrite, refuse_unwritable

    kinds = volume_kinds(arguments.volume)
    directions = {text: direction_of(text) for text in arguments.direction} or None
    texts = {key: value for key in NUMBERS if (value := getattr(arguments, key)) is not None}
    settings = parse(EfficiencySettings, texts, "efficiency")
    if arguments.scene is None and open_file is None:
        raise InputError("name a SCENE: a mesh file, a .blend or sample:NAME")
    outputs = [Path(path) for path in (arguments.json, arguments.csv) if path not in (None, "-")]
    if arguments.pictures:
        outputs.append(Path(arguments.pictures) / "index.html")
    refuse_to_overwrite([arguments.scene] if arguments.scene else [], outputs)
    for path in outputs:
        refuse_unwritable(path)

    scene = open_scene(arguments.scene) if arguments.scene else open_file()  # type: ignore[misc]
    progress = SILENT if arguments.quiet else TerminalProgress()
    records = efficiency_of(scene, kinds, settings, directions, progress)
    if arguments.json and arguments.json != "-":
        write_json(arguments.json, records)
    if arguments.csv:
        write_csv(arguments.csv, records)
    if arguments.pictures:
        write_page(Path(arguments.pictures), scene, records)
    if arguments.json == "-":
        print(to_json_text(records))
    elif not arguments.quiet:
        print(table(records))
    sys.stdout.flush()


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
