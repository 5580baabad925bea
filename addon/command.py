"""The command line ``accelscope``: the same on a terminal and as ``blender --command accelscope``.

This module imports no ``bpy``; a ``.blend`` brings it in when one is opened.
"""

from __future__ import annotations

import argparse
import functools
import io
import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from ..core.errors import InputError
from ..core.evaluation.workloads import WORKLOADS
from ..core.kernels import HAS_NUMBA
from ..core.scene import Scene
from ..core.settings import describe, only_for_in_words
from ..core.structures import structures
from ..sample_scenes import samples
from . import command_animate, command_efficiency
from .command_arguments import (
    add_output_options,
    add_threads_option,
    progress_of,
    refuse_bad_outputs,
    refuse_bad_threads,
    say,
    scenes_of,
    structure_specs,
    workload_specs,
    write_records,
)

EXAMPLES = """\
examples:
  accelscope list
  accelscope evaluate bunny.obj --structure bvh grid --rays camera
  accelscope evaluate sample:tetra --structure grid:resolution=35x35x35,mailbox=true \\
      --rays random_lines:count=100000 --json result.json
"""


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line, like all others."""

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of printing the usage."""
        raise InputError(f"{message}; see: {self.prog} -h")


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = Parser(
        prog="accelscope",
        description="Build, trace and measure ray-tracing acceleration structures.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    lists = commands.add_parser("list", help="structures, rays and sample scenes, with settings")
    lists.add_argument("--json", action="store_true", help="as JSON")

    evaluate = commands.add_parser(
        "evaluate",
        help="build every structure over every scene and trace every set of rays",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = evaluate.add_argument
    add(
        "scenes",
        nargs="*",
        metavar="SCENE",
        help="a mesh file, a .blend or sample:NAME[:key=value,...]",
    )
    add("--structure", nargs="+", required=True, metavar="SPEC", action="extend",
        help="name[:key=value,...], or all")  # fmt: skip
    add("--rays", nargs="+", required=True, metavar="SPEC", action="extend",
        help="camera, random_lines or file, with [:key=value,...]")  # fmt: skip
    add("--hits", metavar="PATH.npz", help="write hits and counters of every ray")
    add_output_options(evaluate, "pictures of the cells over the mesh")
    add_threads_option(evaluate)
    evaluate.set_defaults(run=evaluate_all)
    command_animate.add_parser(commands)
    command_efficiency.add_parser(commands)
    return parser


def main(argv: Sequence[str] | None = None, open_file: Callable[[], Scene] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.
    open_file : callable, optional
        Returns the scene of the file open in Blender; used when no SCENE is given.

    Returns
    -------
    int
        Exit code: 0, or 2 after one line on standard error.
    """
    # A name that the terminal cannot show is no reason to fail.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        arguments = make_parser().parse_args(argv)
        if arguments.command == "list":
            print(list_json() if arguments.json else list_text())
        else:
            arguments.run(arguments, open_file)
        sys.stdout.flush()
    except SystemExit as stop:  # argparse has printed the help
        return int(stop.code or 0)
    except (InputError, MemoryError) as error:
        message = str(error) or "out of memory; use a smaller scene or resolution"
        print(f"accelscope: error: {' '.join(message.split())}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("accelscope: error: stopped", file=sys.stderr)
        return 2
    except OSError as error:
        # Standard output cannot be written: a full disk, or a pipe whose reader has gone. Python
        # would try again at its end; there is nowhere to try.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):
            return 0
        print(f"accelscope: error: cannot print: {error.strerror}", file=sys.stderr)
        return 2
    return 0


# ----------------------------------------------------------------------------------------- list


def everything() -> dict[str, dict[str, Any]]:
    """Return all structures, workloads and sample scenes by kind and name."""
    return {"structures": structures(), "rays": WORKLOADS, "samples": samples()}


def list_json() -> str:
    """Return names and settings as JSON."""
    listing = {
        kind: [
            {
                "name": name,
                "label": entry.label,
                "summary": entry.summary,
                "settings": describe(entry.Settings),
            }
            for name, entry in entries.items()
        ]
        for kind, entries in everything().items()
    }
    return json.dumps({"schema": "accelscope/1", **listing}, indent=1)


def list_text() -> str:
    """Return names and settings for a person."""
    lines = []
    for kind, entries in everything().items():
        lines.append(kind)
        for name, entry in entries.items():
            lines.append(f"  {name}: {entry.summary}")
            for row in describe(entry.Settings):
                assignment = f"{row['key']}={row['default_text']}"
                text = f"{row['description']}; {row['takes']}"
                if "only_for" in row:
                    text += f"; {only_for_in_words(row['only_for'])}"
                lines.append(f"      {assignment}  {text}")
        lines.append("")
    return "\n".join(lines).rstrip()


# ------------------------------------------------------------------------------------- evaluate


def evaluate_all(arguments: argparse.Namespace, open_file: Callable[[], Scene] | None) -> None:
    """Run every combination, then write what was asked for.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scenes or the places to write to.
    """
    note = functools.partial(say, arguments)
    # Everything that can be refused is looked at before the first long computation.
    chosen_structures = structure_specs(arguments.structure, note)
    chosen_workloads = workload_specs(arguments.rays)
    refuse_bad_threads(arguments.threads)
    scenes = scenes_of(arguments.scenes, open_file)
    runs = len(scenes) * len(chosen_structures) * len(chosen_workloads)
    if arguments.hits and runs != 1:
        raise InputError(
            f"--hits takes one scene, structure and set of rays, not {runs} combinations"
        )
    rays_files = [settings.path for _, settings in chosen_workloads if hasattr(settings, "path")]
    refuse_bad_outputs(arguments, [*arguments.scenes, *rays_files], [arguments.hits])

    from ..core.evaluation.experiment import build, make_record, trace_rays
    from ..core.evaluation.report import table

    progress = progress_of(arguments)
    if not HAS_NUMBA:
        note("no Numba here: kernels run as slow plain Python")
    gallery = None
    if arguments.pictures:
        from ..core.evaluation.pictures import Gallery

        gallery = Gallery(Path(arguments.pictures))
    records = []
    for open_one in scenes:
        scene = open_one()
        if scene.dropped:
            note(
                f"{scene.name}: {scene.dropped} triangles with NaN or infinite vertices are left "
                "out"
            )
        for sentence in scene.notes:
            note(f"{scene.name}: {sentence}")
        rays_of = [workload.make(scene, settings) for workload, settings in chosen_workloads]
        for structure_type, settings in chosen_structures:
            built = build(scene, structure_type, settings, progress)
            for (workload, workload_settings), rays in zip(chosen_workloads, rays_of, strict=True):
                traced = trace_rays(
                    built, workload, workload_settings, rays, arguments.threads, progress
                )
                records.append(make_record(built, traced))
                if arguments.hits:
                    write_hits(Path(arguments.hits), scene, traced)
            if gallery:
                gallery.add(built, records[-len(chosen_workloads) :], rays_of)
    if gallery:
        gallery.write_page()
    write_records(arguments, records, table)


def write_hits(path: Path, scene: Scene, traced: Any) -> None:
    """Write t, primitive (index in the file's order) and the counters of every ray."""
    from ..core.structures.steps import COUNTER_NAMES

    primitive = traced.hits.primitive
    in_file = np.where(primitive >= 0, scene.primitive_ids[primitive], -1).astype(np.int32)
    try:
        with path.open("wb") as file:
            np.savez_compressed(
                file, t=traced.hits.t, primitive=in_file, ray_class=traced.rays.classes,
                **{name: traced.counters[name] for name in COUNTER_NAMES},
            )  # fmt: skip
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another place") from None


if __name__ == "__main__":
    sys.exit(main())
