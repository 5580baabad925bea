"""What all subcommands share: what their arguments name.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in. Whatever takes its time
is imported where it is used, so that help and refusals come at once.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NoReturn

from ...core.errors import InputError
from ...core.geometry.csg.settings import CuttingSettings
from ...core.progress import Progress
from ...core.reading import refuse_if_no_file
from ...core.scene import Scene
from ...core.scene.placing import FLATTEN, KEEP, PlacingSettings
from ...core.settings import describe, parse, parse_spec, without_effect
from ..stopping import held
from .output import CannotPrint

if TYPE_CHECKING:
    from ...core.contract.structure import Structure
    from ...core.evaluation.rays.workloads import Workload

SPECS = """\
A SCENE is a mesh file (OBJ, PLY, STL, GLB, glTF, OFF), a .blend or sample:NAME[:key=value,...]. It
may stand anywhere. A file whose name begins with sample: is ./sample:...

A SPEC is NAME[:key=value,...], three numbers are 1x2x3. A comma that no key= follows belongs to the
value; a value in quotes ends where they do: 'file:path=a,b.npz', 'file:path="a,b=c.npz"'.

Exit code 0: all was measured. 1: some was; the rest was refused, or stopped by Ctrl-C, with a line
on standard error each, and has records with an error instead of figures. 2: nothing was measured,
or a result could not be written; one line on standard error says why.

In Blender, from scene.blend or any other file: blender scene.blend --command accelscope ... What
Blender itself logs before a command begins is kept off standard output by blender --log-file FILE.
"""
"""What the help of every subcommand ends with."""

OpenFile = Callable[[str], Scene]
"""Returns the scene that is open in Blender, its instances kept or flattened."""

NEGATIVE = re.compile(r"-[.\d]")


class Parser(argparse.ArgumentParser):
    """A parser whose complaints are one line, like all others.

    Attributes
    ----------
    own_options : frozenset of str
        What was declared.
    knobbed : dict of str to Parser
        The subcommands that take knobs of a lesson, as options that nobody has declared.
    """

    own_options: frozenset[str] = frozenset()
    knobbed: Mapping[str, Parser] = MappingProxyType({})

    def error(self, message: str) -> NoReturn:
        """Raise InputError instead of printing the usage."""
        raise InputError(f"{message}; see: {self.prog} -h")

    def print_help(self, file: Any = None) -> None:
        """Print the help at once, so that it is known whether that was possible.

        Raises
        ------
        CannotPrint
        """
        try:
            print(self.format_help(), end="", file=file, flush=True)
        except OSError as error:
            raise CannotPrint from error

    def add_argument(self, *names: str, **options: Any) -> argparse.Action:
        """Declare an argument, and remember its names: what else begins with -- may be a knob."""
        self.own_options = self.own_options | frozenset(names)
        return super().add_argument(*names, **options)

    def parse_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; values may begin with a dash and a digit, and a SCENE may stand anywhere."""
        words = sys.argv[1:] if args is None else list(args)
        given = words
        knobs: dict[str, str] = {}
        if words and words[0] in self.knobbed:
            given, knobs = self.knobbed[words[0]].without_knobs(words)
        # argparse takes no word for an option that begins with a space.
        guarded = {f" {word}": word for word in given if NEGATIVE.match(word)}
        given = [f" {word}" if f" {word}" in guarded else word for word in given]
        arguments, rest = self.parse_known_args(given, namespace)
        for name, value in vars(arguments).items():
            if isinstance(value, str):
                setattr(arguments, name, guarded.get(value, value))
            elif isinstance(value, list):
                setattr(arguments, name, [guarded.get(word, word) for word in value])
        arguments.knobs = knobs
        # argparse looks for scenes in one place only and leaves the others behind.
        if rest and (not hasattr(arguments, "scenes") or any(w.startswith("-") for w in rest)):
            self.error(f"unrecognized arguments: {' '.join(rest)}")
        arguments.words = words
        if rest:
            rest = [guarded.get(word, word) for word in rest]
            arguments.scenes = in_order(arguments.scenes + rest, words)
        return arguments

    def without_knobs(self, words: list[str]) -> tuple[list[str], dict[str, str]]:
        """Take ``--key value`` and ``--key=value`` that are none of its own options out of words.

        Returns
        -------
        others : list of str
        knobs : dict of str to str
            Values by key.
        """
        others: list[str] = []
        knobs: dict[str, str] = {}
        rest = iter(words)
        for word in rest:
            if word == "--":
                return [*others, word, *rest], knobs
            option, is_joined, value = word.partition("=")
            if not word.startswith("--") or option in self.own_options:
                others.append(word)
                continue
            if not is_joined:
                value = next(rest, "")
                if not value or value.startswith("--"):
                    self.error(f"{option} lacks its value")
            key = option.removeprefix("--")
            if key in knobs:
                self.error(f"{option} is given twice")
            knobs[key] = value
        return others, knobs


# ------------------------------------------------------------------------------------- scenes


def add_scene_options(parser: argparse.ArgumentParser, *, are_flattened: bool = False) -> None:
    """Declare how scenes are made of what is read.

    Parameters
    ----------
    are_flattened : bool
        Whether the subcommand is for triangles only, so that there is nothing to choose.
    """
    (entry,) = describe(PlacingSettings)
    choices = [FLATTEN] if are_flattened else list(entry["choices"])
    default = FLATTEN if are_flattened else entry["default"]
    text = f"{entry['description']} (default: {default})"
    if are_flattened:
        text = f"{entry['description']}: they are flattened, for this is done with triangles"
    parser.add_argument(f"--{entry['key']}", choices=choices, default=default, help=text)
    for cutting in () if are_flattened else describe(CuttingSettings):
        parser.add_argument(
            f"--{cutting['key']}", choices=list(cutting["choices"]), default=cutting["default"],
            help=f"{cutting['description']} (default: {cutting['default']})",
        )  # fmt: skip


def cutting_of(arguments: argparse.Namespace) -> CuttingSettings:
    """Return how the trees of scenes are to be bounded."""
    keys = [entry["key"] for entry in describe(CuttingSettings)]
    return CuttingSettings(**{key: getattr(arguments, key) for key in keys})


def take_scenes(
    arguments: argparse.Namespace, option: str, known: Collection[str], what: str
) -> list[str]:
    """Return the values of an option that takes several; scenes among them become scenes.

    Parameters
    ----------
    known : collection of str
        The names that values of the option begin with.
    what : str
        What they are, for the message.

    Raises
    ------
    InputError
        For a value that may be both, or if nothing but scenes is left.
    """
    values = getattr(arguments, option)
    if values is None:
        return []
    taken = [value for value in values if is_scene(value, known, f"--{option}")]
    if len(taken) == len(values):
        raise InputError(f"--{option} names no {what}, only a scene: {taken[0]}")
    arguments.scenes = in_order(arguments.scenes + taken, arguments.words)
    return [value for value in values if value not in taken]


def in_order(scenes: list[str], words: list[str]) -> list[str]:
    """Return scenes in the order of the command line; those that it ties to an option last."""
    return sorted(scenes, key=[*words, *scenes].index)


def is_scene(value: str, known: Collection[str], option: str) -> bool:
    """Say whether a value of an option is rather a scene.

    Raises
    ------
    InputError
        If a file is called like a value of the option.
    """
    from ...core.files import READERS

    is_known = value.partition(":")[0].strip() in known
    has_suffix = Path(value).suffix.lower() in (*READERS, ".blend")
    if is_known and has_suffix and os.path.isfile(value):
        raise InputError(f"{value} is a file, but looks like a value of {option}; write ./{value}")
    return not is_known and (value.startswith("sample:") or has_suffix or os.path.isfile(value))


def scenes_of(
    names: Sequence[str],
    instances: str,
    open_file: OpenFile | None,
    cutting: CuttingSettings | None = None,
) -> list[tuple[str, Callable[[], Scene]]]:
    """Return name and opener of each scene that is named; without a name, of Blender's open file.

    Parameters
    ----------
    instances : {KEEP, OBJECTS, FLATTEN}
        See :mod:`...core.scene.placing`.
    cutting : CuttingSettings, optional
        How trees of solids are bounded.

    Raises
    ------
    InputError
        If there is neither, or a sample scene is named wrongly.
    """

    def opening(open_one: Callable[..., Scene], *words: str) -> Callable[[], Scene]:
        return lambda: open_one(*words, instances).with_cutting(cutting or CuttingSettings())

    for argument in names:
        if argument.startswith("sample:"):
            if os.path.isfile(argument):
                raise InputError(f"there is a file {argument}; write ./{argument} for it")
            from ...sample_scenes import sample_and_settings

            sample_and_settings(argument.removeprefix("sample:"))
    if names:
        return [(name, opening(open_scene, name)) for name in names]
    if open_file is None:
        raise InputError("name at least one SCENE: a mesh file, a .blend or sample:NAME")
    return [("open file", opening(open_file))]


def opened(open_one: Callable[[], Scene], progress: Progress) -> Scene:
    """Return what an opener of :func:`scenes_of` opens; announce a compilation on the way.

    Raises
    ------
    InputError
        If there is no such scene, or it cannot be read.
    """
    from ...core.geometry.triangulation import CUTTING
    from ...core.kernels import announcing

    with announcing(progress, CUTTING):
        return open_one()


def open_scene(argument: str, instances: str = KEEP) -> Scene:
    """Return the scene that an argument of the command line names.

    Parameters
    ----------
    instances : {KEEP, OBJECTS, FLATTEN}
        See :mod:`...core.scene.placing`.

    Raises
    ------
    InputError
        If there is no such scene, or it cannot be read.
    """
    if argument.startswith("sample:"):
        from ...sample_scenes import make_sample

        made = make_sample(argument.removeprefix("sample:"))
        return made.flat() if instances == FLATTEN else made
    if argument.lower().endswith(".blend"):
        refuse_if_no_file(argument)
        try:
            with held():
                import bpy  # noqa: F401  only to see whether it is there
        except ImportError:
            raise InputError(
                f"reading {argument} needs Blender; install it with: "
                "pip install 'accelscope[blender]'"
            ) from None
        from ..from_blender.extraction import load_blend

        return load_blend(argument, instances)
    from ...core.files import load_mesh_file

    return load_mesh_file(argument, instances)


# -------------------------------------------------------------------------------------- specs


def structure_specs(
    texts: Sequence[str], note: Callable[[str], None]
) -> list[tuple[type[Structure], Any]]:
    """Return (structure, settings) for the texts of ``--structure``; ``all`` is every structure.

    Settings that change nothing are noted.
    """
    from ...core.structures import general_structures, structure_named

    chosen: list[tuple[type[Structure], Any]] = []
    for text in texts:
        name, values = parse_spec(text)
        if name == "all":
            if values:
                raise InputError("'all' takes no settings; name the structure they are for")
            chosen += [(entry, entry.Settings()) for entry in general_structures().values()]
            continue
        entry = structure_named(name)
        where = f"structure {name}"
        settings: Any = parse(entry.Settings, values, where)
        for sentence in without_effect(settings, where):
            note(sentence)
        chosen.append((entry, settings))
    return chosen


def workload_specs(texts: Sequence[str]) -> list[tuple[type[Workload], Any]]:
    """Return (workload, settings) for the texts of ``--rays``; what fits no scene is refused."""
    from ...core.evaluation.rays.workloads import workload_named

    chosen: list[tuple[type[Workload], Any]] = []
    for text in texts:
        name, values = parse_spec(text)
        entry = workload_named(name)
        settings: Any = parse(entry.Settings, values, f"rays {name}")
        entry.refuse_impossible(settings)
        chosen.append((entry, settings))
    return chosen


def refuse_bad_threads(threads: int) -> None:
    """Raise InputError for a number of threads that makes no sense."""
    if threads < 0 or threads > 1024:
        raise InputError(f"--threads must be 0 to 1024, not {threads}")
