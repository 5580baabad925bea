"""``accelscope prepare``: compile now what would be compiled at its first use, and keep it.

Like :mod:`.main`, this imports no ``bpy``. The add-on runs it in a process of its own
(:mod:`..preparing`).
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable, Iterator

from ...core.kernels import cache_directory, has_numba
from ...core.progress import SILENT
from ...sample_scenes import make_sample
from .arguments import OpenFile
from .output import SOME_MISSING, complain_of, print_result, progress_of, say

SAMPLE = "tetra:size=3"
"""Of triangles, as most scenes are; with a light, for shadow rays."""


WORKLOADS = (
    ("camera", {"width": 8, "height": 8, "shadows": True}), ("random_lines", {"count": 64}),
)  # fmt: skip

DONE = "prepared"
"""A file of this name among the kernels says that nothing is left to compile."""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "prepare", help="compile ahead what the structures and lessons need",
        description="Compile the kernels of every structure with its default settings, and those "
        "of the lessons, and keep them: then nothing has to wait at its first use. It takes one "
        "core for some minutes.",
    )  # fmt: skip
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Compile everything; print each part before it begins."""
    if not has_numba():
        say(arguments, "there is no Numba here, so nothing to compile")
        return 0
    progress = progress_of(arguments)
    steps, failed = list(parts()), 0
    for number, (what, work) in enumerate(steps):
        progress.report(number, len(steps), "Preparing")
        if not arguments.quiet:
            print_result(arguments, f"{number} of {len(steps)}: {what}")
        try:
            work()
        except Exception as error:  # a defect, too, is told, and is no reason to stop
            complain_of(arguments, what, error)
            failed += 1
    # What has failed will again: it is no reason to do all of it at every start.
    write_done()
    say(arguments, f"{len(steps) - failed} of {len(steps)} are compiled")
    return SOME_MISSING if failed else 0


def is_done() -> bool:
    """Say whether all of this version was compiled; without importing Numba."""
    return (cache_directory() / DONE).is_file()


def write_done() -> None:
    """Note that all of this version was compiled."""
    directory = cache_directory()
    directory.mkdir(parents=True, exist_ok=True)
    (directory / DONE).write_text("all kernels of the default settings\n", encoding="utf-8")


def parts() -> Iterator[tuple[str, Callable[[], object]]]:
    """Yield the parts of the work with their names, what is needed first before all others."""
    from ...core.lessons import lessons
    from ...core.structures import structures

    first = ("bvh", "grid", "kdtree", "octree")
    everything = structures()
    for name in (*first, *(name for name in everything if name not in first)):
        yield everything[name].label, functools.partial(compile_structure, name)
    for lesson in lessons().values():
        yield f"lesson {lesson.label}", functools.partial(compile_lesson, lesson.name)


def compile_structure(name: str) -> None:
    """Do with a structure all that the panel does: build, draw, trace and step.

    One that is for some classes of rays only is part of a routed one, which traces all.
    """
    from ...core.evaluation.rays.workloads import workload_named
    from ...core.evaluation.records.experiment import Built, make_record, trace
    from ...core.structures import structure_named

    scene, entry = make_sample(SAMPLE), structure_named(name)
    settings = entry.Settings()
    if entry.answers is not None:
        parts = dict.fromkeys(entry.answers, name)
        entry = structure_named("routed")
        settings = entry.Settings(**parts)
    structure = entry.build(scene, settings, SILENT, log=True)
    structure.cells()
    built = Built(structure, 0.0)
    for workload, size in WORKLOADS:
        rays = workload_named(workload)
        traced = trace(built, rays, rays.Settings(**size))
        make_record(built, traced)
        for index in (0, len(traced.rays) - 1):
            structure.record(traced.rays, index)


def compile_lesson(name: str) -> None:
    """Play a lesson as it is taught."""
    from ...core.lessons import lesson_named

    lesson = lesson_named(name)
    settings = lesson.Settings()
    play = lesson.play(lesson.subject(make_sample(lesson.sample)), settings, SILENT)
    play.picture(play.within(settings))
