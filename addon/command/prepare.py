"""``accelscope prepare``: compile now what would be compiled at its first use, and keep it.

Like :mod:`.main`, this imports no ``bpy``. The add-on runs it in a process of its own
(:mod:`..preparing`).
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from typing import NoReturn

from ...core.contract.ray_order import SORTED
from ...core.errors import InputError
from ...core.kernel_cache import cache_directory
from ...core.kernels import has_numba
from ...core.parallel import core_count
from ...core.progress import SILENT
from ..preparing import start_modestly
from .arguments import OpenFile
from .output import (
    SOME_MISSING,
    complain,
    complain_of,
    print_result,
    progress_of,
    reason_told,
    say,
)

SAMPLE = "tetra:size=3"
"""Of triangles, as most scenes are; with a light, for shadow rays."""


WORKLOADS = (
    ("camera", {"width": 8, "height": 8, "shadows": True}),
    ("random_lines", {"count": 64, "order": SORTED}),  # as large batches over large scenes are
)  # fmt: skip

DONE = "prepared"
"""A file of this name among the kernels says that nothing is left to compile."""

MOST_PROCESSES = 8
"""Each takes some 300 MB, and half the time goes into what follows a few large kernels."""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "prepare", help="compile ahead what the structures and lessons need",
        description="Compile the kernels of every structure with its default settings, and those "
        "of the lessons, and keep them: then nothing has to wait at its first use. It takes all "
        "cores for a minute or two.",
    )  # fmt: skip
    parser.add_argument("--quiet", action="store_true", help="print errors only")
    parser.add_argument(
        "--processes", type=int, default=min(core_count(), MOST_PROCESSES), metavar="N",
        help="that compile at the same time (default: as many as cores, at most "
        f"{MOST_PROCESSES})",
    )  # fmt: skip
    parser.add_argument(
        "--modestly", action="store_true", help="give way to whatever else runs on this machine"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Compile everything; print each part before it begins."""
    if arguments.processes < 1:
        raise InputError(f"--processes must be at least 1, not {arguments.processes}")
    if not has_numba():
        say(arguments, "there is no Numba here, so nothing to compile")
        return 0
    if arguments.modestly and hasattr(os, "nice"):
        os.nice(19)  # those that help are as modest
    steps = list(parts())
    failed = (work_alone if arguments.processes == 1 else work_together)(arguments, steps)
    # What has failed will again: it is no reason to do all of it at every start.
    write_done()
    say(arguments, f"{len(steps) - failed} of {len(steps)} are compiled")
    return SOME_MISSING if failed else 0


Part = tuple[str, Callable[[], object]]
"""Of the work: what it compiles, for people, and what does it."""


def work_alone(arguments: argparse.Namespace, steps: Sequence[Part]) -> int:
    """Do all parts here; return how many have failed."""
    progress, failed = progress_of(arguments), 0
    for number, (what, work) in enumerate(steps):
        progress.report(number, len(steps), "Preparing")
        announce(arguments, steps, number)
        try:
            work()
        except Exception as error:  # a defect, too, is told, and is no reason to stop
            complain_of(arguments, what, error)
            failed += 1
    return failed


def work_together(arguments: argparse.Namespace, steps: Sequence[Part]) -> int:
    """Have all parts done by several processes; return how many have failed.

    Each takes the next one as soon as it is free. What two need is most often compiled by one of
    them, and read by the other.
    """
    progress, numbers, lock = progress_of(arguments), iter(range(len(steps))), threading.Lock()
    workers: list[Worker] = []

    def begin_worker() -> Worker:
        worker = Worker()
        workers.append(worker)
        return worker

    def begin_part() -> int | None:
        with lock:
            number = next(numbers, None)
            if number is not None:
                announce(arguments, steps, number)
            return number

    def work_off() -> int:
        failed, worker = 0, begin_worker()
        try:
            while (number := begin_part()) is not None:
                if worker.do(number):
                    continue
                failed += 1
                if not worker.is_running and not is_stopped:
                    complain(f"{steps[number][0]}: its process has ended by itself")
                    worker.stop()
                    worker = begin_worker()
        finally:
            worker.stop()
        return failed

    is_stopped = False
    with ThreadPoolExecutor(arguments.processes) as pool:
        busy = [pool.submit(work_off) for _ in range(arguments.processes)]
        try:
            while wait(busy, timeout=0.2).not_done:
                progress.report(sum(worker.done for worker in workers), len(steps), "Preparing")
        except BaseException:
            is_stopped, numbers = True, iter(())
            for worker in workers:
                worker.process.kill()
            raise
        return sum(each.result() for each in busy)


def announce(arguments: argparse.Namespace, steps: Sequence[Part], number: int) -> None:
    """Print which part begins."""
    if not arguments.quiet:
        print_result(arguments, f"{number} of {len(steps)}: {steps[number][0]}")


class Worker:
    """A process that does one part after the other, and ends with this one.

    Attributes
    ----------
    done : int
        How many parts it has done.
    python : str
        The interpreter of all of them.
    """

    python = sys.executable

    def __init__(self) -> None:
        self.process = start_modestly(
            "addon.command.prepare",
            python=self.python, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self.done = 0

    @property
    def is_running(self) -> bool:
        """Whether it can do another one."""
        return self.process.poll() is None

    def do(self, number: int) -> bool:
        """Have a part done, and say whether that went well."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        try:
            print(number, file=self.process.stdin, flush=True)
            answer = self.process.stdout.readline()
        except OSError:
            answer = ""
        if not answer:
            self.process.wait()
        self.done += 1
        return answer == f"{DONE}\n"

    def stop(self) -> None:
        """End it at once; each kernel is kept whole or not at all."""
        self.process.kill()
        self.process.communicate()


def serve() -> NoReturn:
    """Do the parts whose numbers come in, a line each, until there are no more; say how it went.

    Whoever asks may be killed: then it ends at once, whatever it is at.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who asks is stopped, too, and stops this
    asked: queue.SimpleQueue[int] = queue.SimpleQueue()

    def listen() -> None:
        for line in sys.stdin:
            asked.put(int(line))
        os._exit(0)

    threading.Thread(target=listen, daemon=True).start()
    steps = list(parts())
    while True:
        what, work = steps[asked.get()]
        try:
            work()
            print(DONE, flush=True)
        except Exception as error:  # a defect, too, is told, and is no reason to stop
            complain(f"{what}: {reason_told(error)}")
            print("failed", flush=True)


def is_done() -> bool:
    """Say whether all of this version was compiled; without importing Numba."""
    return (cache_directory() / DONE).is_file()


def write_done() -> None:
    """Note that all of this version was compiled."""
    directory = cache_directory()
    directory.mkdir(parents=True, exist_ok=True)
    (directory / DONE).write_text("all kernels of the default settings\n", encoding="utf-8")


def parts() -> Iterator[Part]:
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

    One that is for some classes of rays only is part of a routed one, which traces all: on the
    routes of those classes that have one of their own.
    """
    from ...core.evaluation.rays.workloads import workload_named
    from ...core.evaluation.records.experiment import Built, make_record, trace
    from ...core.structures import structure_named
    from ...sample_scenes import make_sample

    scene, entry = make_sample(SAMPLE), structure_named(name)
    settings = entry.Settings()
    if entry.answers is not None:
        answers, entry = entry.answers, structure_named("routed")
        routes = {field.name for field in dataclasses.fields(entry.Settings)}
        settings = entry.Settings(**{kind: name for kind in answers if kind in routes})
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
    from ...sample_scenes import make_sample

    lesson = lesson_named(name)
    settings = lesson.Settings()
    play = lesson.play(lesson.subject(make_sample(lesson.sample)), settings, SILENT)
    play.picture(play.within(settings))
