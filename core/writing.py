"""Files of results: written beside the old ones and renamed, so that none is ever half written."""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from .errors import InputError


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file that takes the place of `path` once it is complete; its folder is made.

    Until then, and for good if an exception ends the writing, what stood there stays. A link is
    followed. What is no file, such as a pipe, or has no name of its own any more, is written to
    directly: what `/dev/stdout` leads to may be either.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    with _complaining(path):
        if not _can_be_replaced(Path(path)):
            with open(path, "wb") as file:
                yield file
            return
        target = _prepared(path)
        beside = _beside(target)
        try:
            with beside.open("xb") as file:
                yield file
            if target.exists():
                shutil.copymode(target, beside)
            beside.replace(target)
        except BaseException:
            beside.unlink(missing_ok=True)
            raise


def write_bytes(path: str | Path, data: bytes) -> None:
    """Write a whole file, as :func:`replacing` does.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    with replacing(path) as file:
        file.write(data)


def refuse_unwritable(path: str | Path) -> None:
    """Refuse a `path` that :func:`replacing` could not write; a file there stays as it is.

    Its folder is made, as for writing, and has an empty file in it for a moment.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    with _complaining(path):
        if _can_be_replaced(Path(path)):
            beside = _beside(_prepared(path))
            beside.open("xb").close()
            beside.unlink()
        elif not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))


@contextlib.contextmanager
def _complaining(path: str | Path) -> Iterator[None]:
    """Turn what the operating system refuses into one line about `path`."""
    try:
        yield
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}; choose another place") from None


def _prepared(path: str | Path) -> Path:
    """Return where `path` leads, its folder made."""
    target = Path(os.path.realpath(path))
    target.parent.mkdir(parents=True, exist_ok=True)
    return target


def _can_be_replaced(path: Path) -> bool:
    """Say whether another file can take the place of `path`: that of a file, or of nothing.

    A device or a pipe cannot be replaced; nor can a file that is open, but has been deleted.

    Raises
    ------
    OSError
        If it is a folder, or a name that cannot be.
    """
    try:
        # What is there is asked by the name as given: a link in /proc to a pipe says where it
        # leads in words that are no name of a file.
        there = path.stat()
    except FileNotFoundError:
        return True
    if stat.S_ISDIR(there.st_mode):
        raise IsADirectoryError(errno.EISDIR, "it is a folder")
    if not stat.S_ISREG(there.st_mode):
        return False
    real = Path(os.path.realpath(path))
    return real.exists() and os.path.samestat(real.stat(), there)


def _beside(target: Path) -> Path:
    """Return a name in the folder of `target`, short enough wherever that one is."""
    return target.with_name(f".accelscope-{os.getpid()}-{os.urandom(4).hex()}.partial")
