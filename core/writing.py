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
        if is_special(path):
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
        if not is_special(path):
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
        raise InputError(
            f"cannot write {path}: {error.strerror}; choose another place", str(path)
        ) from None


def _prepared(path: str | Path) -> Path:
    """Return where `path` leads, its folder made.

    Raises
    ------
    OSError
        If it is a folder, or its own cannot be made.
    """
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, "it is a folder")
    target.parent.mkdir(parents=True, exist_ok=True)
    return target


def is_special(path: str | Path) -> bool:
    """Say whether no other file can take the place of `path`: that of a device, or of a pipe.

    Nor can it that of a file that is open, but has been deleted.
    """
    try:
        # What is there is asked by the name as given: a link in /proc to a pipe says where it
        # leads in words that are no name of a file.
        there = os.stat(path)
    except OSError:
        return False
    if not stat.S_ISREG(there.st_mode):
        return not stat.S_ISDIR(there.st_mode)
    real = os.path.realpath(path)
    return not (os.path.exists(real) and os.path.samestat(os.stat(real), there))


def is_device(path: str | Path) -> bool:
    """Say whether `path` leads to a device, such as a terminal or /dev/null."""
    try:
        return stat.S_ISCHR(os.stat(path).st_mode)
    except (OSError, ValueError):  # there is nothing, or no such name can be
        return False


def _beside(target: Path) -> Path:
    """Return a name in the folder of `target`, short enough wherever that one is."""
    return target.with_name(f".accelscope-{os.getpid()}-{os.urandom(4).hex()}.partial")
