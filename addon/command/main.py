"""The command line ``accelscope``: the same on a terminal and as ``blender --command accelscope``.

This module imports no ``bpy``; a ``.blend`` brings it in when one is opened.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import os
import sys
from collections.abc import Sequence
from typing import Any

from ...core.errors import InputError
from ...core.settings import describe, only_for_in_words
from ..standard_streams import (
    is_standard_output,
    own_standard_error,
    own_standard_output,
    path_of,
    reopen_closed_streams,
)
from ..stopping import Stops
from . import animate as command_animate
from . import efficiency as command_efficiency
from . import evaluate as command_evaluate
from . import film as command_film
from . import handout as command_handout
from . import lessons as command_lessons
from . import pipeline as command_pipeline
from . import prepare as command_prepare
from . import probes as command_probes
from .arguments import SPECS, OpenFile, Parser
from .output import NOTHING, CannotPrint, complain, print_result, reason_told

OUTPUTS = "json", "csv", "hits"
"""Options that name a file to write."""


def make_parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    parser = Parser(
        prog="accelscope",
        description="Build, trace and measure ray-tracing acceleration structures.",
        epilog=f"{SPECS}\n{command_evaluate.EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")

    lists = commands.add_parser("list", help="structures, rays and sample scenes, with settings")
    lists.add_argument("--json", action="store_const", const="-", help="as JSON")
    lists.set_defaults(run=run_list, quiet=False)
    command_evaluate.add_parser(commands)
    command_animate.add_parser(commands)
    command_efficiency.add_parser(commands)
    command_lessons.add_parsers(commands)
    command_film.add_parser(commands)
    command_handout.add_parser(commands)
    command_pipeline.add_parser(commands)
    command_probes.add_parser(commands)
    command_prepare.add_parser(commands)
    parser.knobbed = {name: commands.choices[name] for name in ("lesson", "film")}
    return parser


def serve(*arguments: str) -> int:
    """Run the command line in a process that another one has started."""
    return main(arguments)


def main(
    argv: Sequence[str] | None = None,
    open_file: OpenFile | None = None,
    *,
    open_path: str = "",
    until_exit: bool | None = None,
) -> int:
    """Run the command line.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments after the program's name; those of the process by default.
    open_file : callable, optional
        Returns the scene of the file open in Blender; used when no SCENE is given.
    open_path : str, optional
        Where that file is; no result is written there.
    until_exit : bool, optional
        Whether the process ends afterwards. Then standard output stays reserved for results,
        whatever is printed until the end. By default it is if `argv` is None.

    Returns
    -------
    int
        Exit code: 0; 1 if something was measured and something was not; 2 if nothing was, after
        one line on standard error, and before it the traceback if that is due to a defect.
    """
    reopen_closed_streams()
    # A name that the terminal cannot show is no reason to fail.
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")
    until_exit = argv is None if until_exit is None else until_exit
    output = sys.stdout
    stops = Stops()
    with contextlib.ExitStack() as stack:
        try:
            arguments = make_parser().parse_args(argv)
            arguments.open_path = open_path
            if arguments.quiet:
                stack.enter_context(own_standard_error(until_exit=until_exit))
            outputs = [
                name for name in OUTPUTS if is_standard_output(getattr(arguments, name, None))
            ]
            if len(outputs) > 1:
                raise InputError(
                    f"{' and '.join(f'--{name}' for name in outputs)} cannot both be standard "
                    "output; name a file for one of them"
                )
            arguments.is_output_taken = bool(outputs)
            others_to = None if arguments.quiet else 2
            output = arguments.standard_output = stack.enter_context(
                own_standard_output(others_to=others_to, until_exit=until_exit)
            )
            # By its own name, standard output is where others print now.
            for name in outputs:
                setattr(arguments, name, "-" if name == "json" else path_of(output))
            arguments.stops = stops
            stack.enter_context(stops.told(until_exit=until_exit))
            return arguments.run(arguments, open_file)
        except SystemExit as stop:  # argparse has printed the help
            return int(stop.code or 0)
        except KeyboardInterrupt:
            complain("stopped")
        except CannotPrint as error:
            # Python would try again at its end; there is nowhere to try.
            os.dup2(os.open(os.devnull, os.O_WRONLY), output.fileno())
            if isinstance(error.__cause__, BrokenPipeError):
                return 0
            complain(f"cannot print: {error.__cause__}")
        except Exception as error:  # a defect, too, is told, and ends in the same way
            # A module that was imported when the stop came may have made another error of it.
            complain("stopped" if stops.is_asked else reason_told(error))
    return NOTHING


# ----------------------------------------------------------------------------------------- list


def run_list(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Print what there is."""
    print_result(arguments, list_json() if arguments.json else list_text())
    return 0


def everything() -> dict[str, dict[str, Any]]:
    """Return all structures, workloads, probes and sample scenes by kind and name."""
    from ...core.evaluation.probes.kinds import PROBES
    from ...core.evaluation.rays.workloads import WORKLOADS
    from ...core.structures import structures
    from ...sample_scenes import samples

    return {"structures": structures(), "rays": WORKLOADS, "probes": PROBES, "samples": samples()}


def list_json() -> str:
    """Return names and settings as JSON; of structures what they count and tell, too."""
    from ...core.evaluation.records.experiment import SCHEMA

    listing = {
        kind: [
            {
                "name": name,
                "label": entry.label,
                "summary": entry.summary,
                "settings": describe(entry.Settings),
                **(counts_and_figures(entry) if kind == "structures" else {}),
            }
            for name, entry in entries.items()
        ]
        for kind, entries in everything().items()
    }
    return json.dumps({"schema": SCHEMA, **listing}, indent=1)


def counts_and_figures(structure: Any) -> dict[str, Any]:
    """Return for which rays a structure is (null for all), what its records hold, with meanings."""
    return {
        "answers": None if structure.answers is None else list(structure.answers),
        "counters": [
            {"name": each.name, "label": each.label, "meaning": each.meaning}
            for each in structure.COUNTERS
        ],
        "figures": [
            {"key": each.key, "label": each.label, "meaning": each.meaning, "unit": each.unit}
            for each in structure.FIGURES
        ],
    }


def list_text() -> str:
    """Return names and settings for a person; of structures what they count and tell, too."""
    from ...core.contract.needs import in_words

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
            if kind == "structures":
                if entry.answers is not None:
                    lines.append(f"      for {in_words(entry.answers)} rays only")
                lines.append("      per ray: " + ", ".join(each.name for each in entry.COUNTERS))
                lines.append("      figures: " + ", ".join(each.key for each in entry.FIGURES))
        lines.append("")
    return "\n".join(lines).rstrip()


if __name__ == "__main__":
    sys.exit(main())
