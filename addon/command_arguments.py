"""What all subcommands share: what their arguments name, and where their results go.

Like :mod:`.command`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import functools
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.evaluation.workloads import Workload, workload_named
from ..core.files import load_mesh_file
from ..core.progress import SILENT, Progress, TerminalProgress
from ..core.scene import Scene
from ..core.settings import parse, parse_spec, without_effect
from ..core.structures import structure_named, structures
from ..core.structures.contract import Structure
from ..sample_scenes import make_sample

# ---------------------------------------------------------------------------- what they name


def scenes_of(
    arguments: Sequence[str], open_file: Callable[[], Scene] | None
) -> list[Callable[[], Scene]]:
    """Return what opens each scene that is named; without a name, that of Blender's open file.

    Raises
    ------
    InputError
        If there is neither.
    """
    if arguments:
        return [functools.partial(open_scene, argument) for argument in arguments]
    if open_file is None:
        raise InputError("name at least one SCENE: a mesh file, a .blend or sample:NAME")
    return [open_file]


def open_scene(argument: str) -> Scene:
    """Return the scene that an argument of the command line names.

    Raises
    ------
    InputError
        If there is no such scene, or it cannot be read.
    """
    if argument.startswith("sample:"):
        return make_sample(argument.removeprefix("sample:"))
    if argument.lower().endswith(".blend"):
        if not Path(argument).is_file():
            raise InputError(f"there is no file {argument}")
        try:
            import bpy  # noqa: F401  only to see whether it is there
        except ImportError:
            raise InputError(
                f"reading {argument} needs Blender; install it with: "
                "pip install 'accelscope[blender]'"
            ) from None
        from .extraction import load_blend

        return load_blend(argument)
    return load_mesh_file(argument)


def structure_specs(
    texts: Sequence[str], note: Callable[[str], None]
) -> list[tuple[type[Structure], Any]]:
    """Return (structure, settings) for the texts of ``--structure``; ``all`` is every structure.

    Settings that change nothing are noted.
    """
    chosen: list[tuple[type[Structure], Any]] = []
    for text in texts:
        name, values = parse_spec(text)
        if name == "all":
            if values:
                raise InputError("'all' takes no settings; name the structure they are for")
            chosen += [(entry, entry.Settings()) for entry in structures().values()]
            continue
        entry = structure_named(name)
        where = f"structure {name}"
        settings: Any = parse(entry.Settings, values, where)
        for sentence in without_effect(settings, where):
            note(sentence)
        chosen.append((entry, settings))
    return chosen


def workload_specs(texts: Sequence[str]) -> list[tuple[type[Workload], Any]]:
    """Return (workload, settings) for the texts of ``--rays``."""
    chosen: list[tuple[type[Workload], Any]] = []
    for text in texts:
        name, values = parse_spec(text)
        entry = workload_named(name)
        chosen.append((entry, parse(entry.Settings, values, f"rays {name}")))
    return chosen


# ------------------------------------------------------------------------------ what they say


def add_output_options(parser: argparse.ArgumentParser, pictures: str) -> None:
    """Declare where results go; `pictures` says what is to be seen in them."""
    add = parser.add_argument
    add("--json", metavar="PATH", help="write the records as JSON; - is standard output")
    add("--csv", metavar="PATH", help="write the records as CSV")
    add("--pictures", metavar="DIR", help=f"write {pictures}, and a page")
    add("--quiet", action="store_true", help="print no table and no progress")


def add_threads_option(parser: argparse.ArgumentParser) -> None:
    """Declare how many threads trace."""
    parser.add_argument(
        "--threads", type=int, default=0, metavar="N", help="0, the default, takes every core"
    )


def say(arguments: argparse.Namespace, text: str) -> None:
    """Print a remark on standard error, unless all is to be quiet."""
    if not arguments.quiet:
        print(f"accelscope: {text}", file=sys.stderr)


def progress_of(arguments: argparse.Namespace) -> Progress:
    """Return what shows the progress, unless all is to be quiet."""
    return SILENT if arguments.quiet else TerminalProgress()


def write_records(
    arguments: argparse.Namespace,
    records: list[dict[str, Any]],
    table: Callable[[list[dict[str, Any]]], str],
) -> None:
    """Write the records to the files that are named; print them as JSON or as a table."""
    from ..core.evaluation.report import to_json_text, write_csv, write_json

    if arguments.json and arguments.json != "-":
        write_json(arguments.json, records)
    if arguments.csv:
        write_csv(arguments.csv, records)
    if arguments.json == "-":
        print(to_json_text(records))
    elif not arguments.quiet:
        print(table(records))


# ------------------------------------------------------------------------ what they may not be


def refuse_bad_outputs(
    arguments: argparse.Namespace, inputs: Sequence[str], others: Sequence[str | None] = ()
) -> None:
    """Refuse outputs that would overwrite an input or each other, or that cannot be written.

    Parameters
    ----------
    inputs : sequence of str
        Files that are read.
    others : sequence of str or None
        Outputs of this subcommand only.

    Raises
    ------
    InputError
        Naming the place.
    """
    names = [arguments.json, arguments.csv, *others]
    outputs = [Path(name) for name in names if name not in (None, "-")]
    if arguments.pictures:
        outputs.append(Path(arguments.pictures) / "index.html")
    refuse_to_overwrite(inputs, outputs)
    for path in outputs:
        refuse_unwritable(path)


def refuse_bad_threads(threads: int) -> None:
    """Raise InputError for a number of threads that makes no sense."""
    if threads < 0 or threads > 1024:
        raise InputError(f"--threads must be 0 to 1024, not {threads}")


def refuse_to_overwrite(inputs: Sequence[str], outputs: Sequence[Path]) -> None:
    """Raise InputError if an output is one of the inputs, or two outputs are one file."""
    taken = {Path(path).expanduser().resolve(): path for path in inputs}
    for path in outputs:
        real = path.expanduser().resolve()
        if real in taken:
            raise InputError(
                f"{path} would overwrite {taken[real]}; choose another name for the output"
            )
        taken[real] = str(path)


def refuse_unwritable(path: Path) -> None:
    """Raise InputError if a file cannot be written at `path`, before anything is computed."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.is_dir():
            raise IsADirectoryError(21, "it is a folder")
        existed = path.exists()
        with path.open("ab"):
            pass
        if not existed:
            path.unlink()
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another place") from None
