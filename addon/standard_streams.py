"""Who may print: standard output for results alone, whatever Blender and libraries print.

Blender prints lines of its own when it is imported, opens a file or ends; much of that is printed
by C, behind Python's back. So it is the descriptors that are pointed elsewhere, not the objects in
``sys`` alone.
"""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import stat
import sys
from collections.abc import Iterator
from typing import TextIO

from ..core.errors import InputError


@contextlib.contextmanager
def pointed_away(descriptor: int, to: int | None) -> Iterator[None]:
    """Point a descriptor of this process to another one meanwhile, None for nowhere."""
    kept = os.dup(descriptor)
    point(descriptor, to)
    try:
        yield
    finally:
        with contextlib.suppress(OSError, TypeError):  # Windows has no C library of this name
            ctypes.CDLL(None).fflush(None)
        os.dup2(kept, descriptor)
        os.close(kept)


def point(descriptor: int, to: int | None) -> None:
    """Point a descriptor to another one, for good; None, or one that is closed, is nowhere."""
    try:
        if to is not None:
            os.dup2(to, descriptor)
            return
    except OSError:
        pass
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, descriptor)
    os.close(nowhere)


@contextlib.contextmanager
def others_kept_silent() -> Iterator[None]:
    """Discard what others print meanwhile: it names things of a file as they are in there."""
    sys.stdout.flush()
    sys.stderr.flush()
    with pointed_away(1, None), pointed_away(2, None):
        yield


def reopen_closed_streams() -> None:
    """Let standard input, output and errors be something, where the process has none (``>&-``).

    Else the next file that is opened gets the number of what is missing, and in it whatever anybody
    prints.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            # The lowest number that is free: this one.
            os.open(os.devnull, os.O_RDWR)
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            # It stays open as long as the process.
            setattr(sys, name, open(os.devnull, mode, encoding="utf-8"))  # noqa: SIM115


def descriptor_of(stream: TextIO) -> int | None:
    """Return the descriptor a stream writes to; None if it is an object of Python's alone."""
    try:
        return stream.fileno()
    except (OSError, ValueError, AttributeError):
        return None


def is_standard_output(path: str | None) -> bool:
    """Say whether a path leads to where standard output goes, as ``/dev/stdout`` and ``-`` do.

    ``/dev/null`` by its own name never does: what goes there is among nothing else.
    """
    if path == "-":
        return True
    if path == os.devnull:
        return False
    descriptor = descriptor_of(sys.stdout)
    if not isinstance(path, str) or descriptor is None:
        return False
    try:
        return os.path.samestat(os.stat(path), os.fstat(descriptor))
    except (OSError, ValueError):  # there is nothing, or no such name can be
        return False


def path_of(stream: TextIO) -> str:
    """Return a path by which what a stream writes to can be opened.

    Raises
    ------
    InputError
        If there is none, or if it is a file with something in it, which would be replaced.
    """
    descriptor = descriptor_of(stream)
    path = f"/dev/fd/{descriptor}"
    if descriptor is None or not os.path.exists(path):
        raise InputError("standard output has no name here; name a file to write")
    there = os.fstat(descriptor)
    if stat.S_ISREG(there.st_mode) and there.st_size > 0:
        raise InputError("the file behind standard output would be replaced; name another one")
    return path


def stream_like(stream: TextIO, descriptor: int) -> TextIO:
    """Return a stream to where a descriptor points now, in the encoding of another stream.

    What that encoding does not have is written as an escape: a name is no reason to fail.
    """
    return io.TextIOWrapper(
        os.fdopen(os.dup(descriptor), "wb"),
        encoding=stream.encoding or "utf-8",
        errors="backslashreplace",
        line_buffering=getattr(stream, "line_buffering", False),
    )


@contextlib.contextmanager
def own_standard_output(*, others_to: int | None, until_exit: bool) -> Iterator[TextIO]:
    """Give standard output to the caller alone, as the stream that is yielded.

    Parameters
    ----------
    others_to : int or None
        The descriptor that everybody else's printing goes to: 2, or None for nowhere.
    until_exit : bool
        Leave it so until the process ends, since Blender prints even then; else it is as before
        afterwards.
    """
    stream = sys.stdout
    stream.flush()
    descriptor = descriptor_of(stream)
    with contextlib.ExitStack() as undone:
        if descriptor is not None:
            # What C has not written yet is not flushed: it is none of ours and follows the others.
            own: TextIO = undone.enter_context(stream_like(stream, descriptor))
            if until_exit:
                point(descriptor, others_to)
            else:
                undone.enter_context(pointed_away(descriptor, others_to))
        else:
            own = stream
        others = sys.stderr if others_to is not None else io.StringIO()
        if until_exit:
            sys.stdout = others
        else:
            undone.enter_context(contextlib.redirect_stdout(others))
        yield own


@contextlib.contextmanager
def own_standard_error(*, until_exit: bool) -> Iterator[None]:
    """Keep standard error for Python: what C prints there goes nowhere."""
    stream = sys.stderr
    stream.flush()
    descriptor = descriptor_of(stream)
    if descriptor is None:
        yield
        return
    with contextlib.ExitStack() as undone:
        own = stream_like(stream, descriptor)
        if until_exit:
            point(descriptor, None)
            sys.stderr = own
        else:
            undone.enter_context(own)
            undone.enter_context(pointed_away(descriptor, None))
            undone.enter_context(contextlib.redirect_stderr(own))
        yield
