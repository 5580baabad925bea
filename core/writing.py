"""Files of results: written beside the old ones and renamed, so that none is ever half written."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from .errors import InputError


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file that takes the place of `path` once it is complete; its folder is made.

    Until then, and for good if an exception ends the writing, what stood there stays. A link is
    followed. What is no file, such as a pipe, is written to directly.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    with _complaining(path):
        target = _prepared(path)
        if _is_special(target):
            with target.open("wb") as file:
                yield file
            return
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
    """Raise InputError if :func:`replacing` could not write `path`; nothing there is changed."""
    with _complaining(path):
        target = _prepared(path)
        if not _is_special(target):
            beside = _beside(target)
            beside.open("xb").close()
            beside.unlink()


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


def _is_special(target: Path) -> bool:
    """Say whether `target` is a device or a pipe, which cannot be replaced.

    Raises
    ------
    OSError
        If it is a folder, or a name that cannot be.
    """
    try:
        target.stat()
    except FileNotFoundError:
        return False
    if target.is_dir():
        raise IsADirectoryError(21, "it is a folder")
    return not target.is_file()


def _beside(target: Path) -> Path:
    """Return a name in the folder of `target`, short enough wherever that one is."""
    return target.with_name(f".accelscope-{os.getpid()}-{os.urandom(4).hex()}.partial")
