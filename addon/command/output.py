"""What all subcommands share: what they print, and where their results go.

Like :mod:`.main`, this imports no ``bpy``.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

from ...core.errors import InputError, reason_of
from ...core.kernels import has_numba, numba_fault
from ...core.printing import print_lines, print_traceback
from ...core.progress import SILENT, Progress, TerminalProgress
from ...core.scene import Scene
from ...core.writing import is_device, is_special, refuse_unwritable
from ..stopping import Stops

SOME_MISSING, NOTHING = 1, 2
"""Exit codes: something was measured and something was not, and nothing was."""

Record = dict[str, Any]

T = TypeVar("T")


class CannotPrint(Exception):
    """Standard output cannot be written: a full disk, or a pipe whose reader has gone."""


def add_output_options(parser: argparse.ArgumentParser, pictures: str = "") -> None:
    """Declare where results go; `pictures` says what is to be seen in them, if there are some."""
    add = parser.add_argument
    add("--json", metavar="PATH",
        help="write the records as JSON; - is standard output, for JSON alone")  # fmt: skip
    add("--csv", metavar="PATH",
        help="write the records as CSV; - is standard output, for CSV alone")  # fmt: skip
    if pictures:
        add("--pictures", metavar="DIR", help=f"write {pictures}, and a page")
    add("--quiet", action="store_true",
        help="print errors only: no table, progress or remark, neither of Blender's")  # fmt: skip


def add_threads_option(parser: argparse.ArgumentParser) -> None:
    """Declare how many threads trace."""
    parser.add_argument(
        "--threads", type=int, default=0, metavar="N", help="0, the default, takes every core"
    )


def image_files(path: str | None, option: str) -> list[Path]:
    """Return the files that an image is written to; none if none is asked for.

    Raises
    ------
    InputError
        If its name is that of another kind of file.
    """
    if path is None:
        return []
    if Path(path).suffix.lower() != ".png":
        raise InputError(f"{option} writes PNG; call it something.png, not '{path}'")
    return [Path(path), Path(path).with_suffix(".npy")]


# ----------------------------------------------------------------------------- what is printed


def say(arguments: argparse.Namespace, text: str) -> None:
    """Print a remark on standard error, unless all is to be quiet."""
    if not arguments.quiet:
        remark(text)


def note_on(arguments: argparse.Namespace, scene: Scene, before: set[str] | None = None) -> None:
    """Print what of its source a scene is without, unless all is to be quiet.

    Parameters
    ----------
    before : set of str, optional
        What was said of earlier frames of the same scene, and need not be said again.
    """
    remarks = [f"{scene.name}: {sentence}" for sentence in scene.notes]
    if scene.dropped:
        remarks.insert(
            0, f"{scene.name}: {scene.dropped} triangles with NaN or infinite vertices are left out"
        )
    for text in remarks:
        if before is None or text not in before:
            say(arguments, text)
    if before is not None:
        before.update(remarks)


def note_on_numba(arguments: argparse.Namespace) -> None:
    """Print that nothing is compiled here, if so, unless all is to be quiet."""
    if not has_numba():
        fault = numba_fault()
        lack = f"Numba cannot be imported ({fault})" if fault else "no Numba here"
        say(arguments, f"{lack}: kernels run as slow plain Python")


def complain(text: str) -> None:
    """Print an error on standard error."""
    remark(f"error: {text}")


def reason_told(error: Exception) -> str:
    """Return why something failed, on one line.

    A defect, which is every error but InputError and MemoryError, has its traceback printed.
    """
    if isinstance(error, InputError | MemoryError):
        return reason_of(error)
    print_traceback(error)
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"a defect of AccelScope: {what}"


def complain_of(arguments: argparse.Namespace, where: str, error: Exception) -> str:
    """Print why a part of the work has failed, and return that without `where`.

    A defect is printed as :func:`reason_told` does.

    Parameters
    ----------
    where : str
        Which part it is, for the message; empty where there is but one.

    Raises
    ------
    KeyboardInterrupt
        If the reason is a stop.
    """
    arguments.stops.heed()
    reason = reason_told(error)
    complain(f"{where}: {reason}" if where else reason)
    return reason


def remark(text: str) -> None:
    """Print one line on standard error; names in it cannot steer the terminal."""
    print_lines(f"accelscope: {' '.join(text.split())}", sys.stderr)


def print_result(arguments: argparse.Namespace, text: str) -> None:
    """Print on the standard output that is kept for results.

    Raises
    ------
    CannotPrint
    """
    try:
        print_lines(text, arguments.standard_output, flush=True)
    except OSError as error:
        raise CannotPrint from error


def progress_of(arguments: argparse.Namespace) -> Progress:
    """Return what shows the progress, unless all is to be quiet, and heeds stops."""
    return StoppedProgress(SILENT if arguments.quiet else TerminalProgress(), arguments.stops)


class StoppedProgress(Progress):
    """Progress that raises KeyboardInterrupt for a stop that was lost."""

    def __init__(self, shown: Progress, stops: Stops) -> None:
        self._shown, self._stops = shown, stops

    def report(self, done: float, total: float, text: str) -> None:
        self._stops.heed()
        self._shown.report(done, total, text)

    def announce(self, text: str) -> None:
        self._stops.heed()
        self._shown.announce(text)


# ------------------------------------------------------------------------------- what is written


WRITING, A_LITTLE = 0.05, 0.5
"""Share of the time, and seconds, that writing down what there is so far may take."""


class Results:
    """Records as they come and failures among them; written as they come, and at the end.

    Whoever adds to them calls :meth:`keep`, so that even a process that is killed leaves files of
    what it has measured. It is a context: when its block ends, by Ctrl-C or a defect too, all that
    was measured until then is written. If nothing was, nothing is, and what stood there stays.

    Parameters
    ----------
    arguments : argparse.Namespace
        With the options of :func:`add_output_options`.
    table : callable
        Returns the records as text.
    expected : int
        How many records there will be.
    write_page : callable, optional
        Writes the page of pictures.

    Attributes
    ----------
    records : list of dict
    """

    def __init__(
        self,
        arguments: argparse.Namespace,
        table: Callable[[list[Record]], str],
        expected: int,
        write_page: Callable[[], None] | None = None,
    ) -> None:
        self.records: list[Record] = []
        self.write_page = write_page
        self._arguments, self._table, self._expected = arguments, table, expected
        self._is_all_there = True
        self._started, self._writing = time.monotonic(), 0.0

    def keep(self) -> None:
        """Write the files of what there is so far, if that takes little of the time.

        Raises
        ------
        KeyboardInterrupt
            For a stop that was lost.
        """
        self._arguments.stops.heed()
        started = time.monotonic()
        allowed = max(WRITING * (started - self._started), A_LITTLE)
        if not self.measured or self._writing > allowed:
            return
        for write in self._files(so_far=True):
            # What cannot be written now is tried again, and complained of, at the end: not even a
            # defect is a reason to measure nothing more.
            with contextlib.suppress(Exception):
                write()
        self._writing += time.monotonic() - started

    def attempt(self, where: str, work: Callable[[], T]) -> tuple[T | None, str]:
        """Do a part of a batch; one that fails leaves the others alone.

        Parameters
        ----------
        where : str
            What of the batch it is, for the message.
        work : callable

        Returns
        -------
        result : object or None
            What `work` returns; None if it fails.
        reason : str
            Why it has failed, which has been printed; empty if it has not.
        """
        try:
            return work(), ""
        except Exception as error:  # a defect, too, is told, and is no reason to stop
            return None, self.complain(where, error)

    def complain(self, where: str, error: Exception) -> str:
        """Print why something is missing, and return that, as :func:`complain_of` does."""
        reason = complain_of(self._arguments, "" if self._expected == 1 else where, error)
        self._is_all_there = False
        return reason

    @property
    def measured(self) -> int:
        """How many records have figures."""
        return sum("error" not in record for record in self.records)

    @property
    def exit_code(self) -> int:
        """0, 1 if something is missing, or 2 if nothing was measured."""
        if not self.measured:
            return NOTHING
        return 0 if self._is_all_there else SOME_MISSING

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type | None, error: BaseException | None, trace: TracebackType | None
    ) -> bool:
        if not self.measured:
            return False
        stopped = isinstance(error, KeyboardInterrupt)
        with self._arguments.stops.waiting():
            if stopped:
                complain(f"stopped; {self.measured} of {self._expected} records were measured")
                self._is_all_there = False
            self._write()
        return stopped

    def _files(self, so_far: bool = False) -> list[Callable[[], None]]:
        """Return what writes each of the files that were asked for.

        Parameters
        ----------
        so_far : bool
            Whether more will follow: then not to a pipe, which takes back nothing.
        """
        from ...core.evaluation.records.report import write_csv, write_json

        options, records = self._arguments, self.records
        wanted: list[Callable[[], None]] = []
        for path, write in ((options.json, write_json), (options.csv, write_csv)):
            if path and path != "-" and not (so_far and is_special(path)):
                wanted.append(functools.partial(write, path, records))
        if self.write_page and options.pictures:
            wanted.append(self.write_page)
        return wanted

    def _write(self) -> None:
        """Write and print everything that can be; raise the first of the errors after that."""
        from ...core.evaluation.records.report import to_json_text

        options, records = self._arguments, self.records
        wanted = self._files()
        if options.json == "-":
            wanted.append(lambda: print_result(options, to_json_text(records)))
        elif not (options.quiet or options.is_output_taken):
            wanted.append(lambda: print_result(options, self._table(records)))
        errors: list[Exception] = []
        for write in wanted:
            try:
                write()
            except Exception as error:  # raised below, once the others have been written
                errors.append(error)
        if errors:
            raise errors[0]


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
    if arguments.pictures == "":  # as of a variable of a shell that is not set
        raise InputError("--pictures names no folder; . is the one you are in")
    if arguments.pictures:
        outputs.append(Path(arguments.pictures) / "index.html")
    refuse_to_overwrite([*inputs, *filter(None, [arguments.open_path])], outputs)
    for path in outputs:
        refuse_unwritable(path)


def refuse_to_overwrite(inputs: Sequence[str], outputs: Sequence[Path]) -> None:
    """Raise InputError if an output is one of the inputs, or two outputs are one file.

    A device such as /dev/null keeps nothing that could be overwritten.
    """
    taken: dict[str, str] = {}
    for given in inputs:
        # Files of rays may begin with ~; a file of that name may be meant, too.
        taken |= {real_path(given): given, real_path(os.path.expanduser(given)): given}
    for path in outputs:
        if is_device(path):
            continue
        real = real_path(path)
        if real in taken:
            raise InputError(
                f"{path} would overwrite {taken[real]}; choose another name for the output"
            )
        taken[real] = str(path)


def real_path(path: str | Path) -> str:
    """Return where a path leads in the end; itself where that cannot be said."""
    try:
        return os.path.realpath(path)
    except (OSError, ValueError):  # the folder that one works in is gone, or it is no name
        return str(path)
