"""Text of mesh files: whichever way lines end, whatever bytes stand in names and comments."""

from __future__ import annotations

import codecs
import itertools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import numpy as np

from .contents import BrokenFile

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""What a text may begin with to tell its encoding; UTF-32's contains UTF-16's."""


def bytes_of(path: Path) -> bytes:
    r"""Return a text file's bytes, with ``\n`` at the end of lines and no mark at the beginning.

    Names and comments may be in any encoding that has ASCII in it; UTF-16 and UTF-32 are turned
    into UTF-8 where the file begins with their mark.
    """
    data = path.read_bytes()
    for mark, encoding in MARKS:
        if data.startswith(mark):
            try:
                data = data.decode(encoding).encode()
            except UnicodeDecodeError:
                if mark != codecs.BOM_UTF8:
                    raise BrokenFile(f"it begins as {encoding} and goes on otherwise") from None
                data = data.removeprefix(mark)
            break
    return data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def name_of(words: bytes) -> str:
    """Return a name in a file as text: UTF-8 if it is that, else Latin-1."""
    words = b" ".join(words.split())
    try:
        return words.decode()
    except UnicodeDecodeError:
        return words.decode("latin-1")


def shown(words: bytes) -> str:
    """Return a short piece of a file for a message."""
    text = name_of(words[:60]).encode("unicode_escape").decode()
    return f"'{text}'" if len(words) <= 40 else f"'{text[:40]}...'"


def floats_of(words: Iterable[bytes]) -> np.ndarray:
    """Return numbers written in ASCII, (n,) float64.

    Raises
    ------
    ValueError
        If one is no number.
    """
    words = list(words)
    numbers = np.array(list(map(float, words)), dtype=np.float64)
    _refuse_underscores(words)
    return numbers


def integers_of(words: Iterable[bytes]) -> np.ndarray:
    """Return whole numbers written in ASCII, (n,) int64.

    Raises
    ------
    ValueError
        If one is no whole number, or none that 64 bits can hold.
    """
    words = list(words)
    try:
        numbers = np.array(list(map(int, words)), dtype=np.int64)
    except OverflowError:
        raise ValueError("a number is too large") from None
    _refuse_underscores(words)
    return numbers


def _refuse_underscores(words: Sequence[bytes]) -> None:
    """Refuse ``1_000``, which Python takes for a number but no file format does."""
    if b"_" in b"".join(words):
        raise ValueError("a number has an underscore in it")


def integer_of(word: bytes, what: str) -> int:
    """Return one whole number of at least 0, such as a count in a header.

    Raises
    ------
    BrokenFile
        Naming `what` it should have been.
    """
    if not word.isdigit():
        raise BrokenFile(f"{what} is {shown(word)}, not a whole number")
    return int(word)


def numbers_in(
    rows: Sequence[Sequence[bytes]],
    lines: Sequence[int],
    convert: Callable[[Iterable[bytes]], np.ndarray] = floats_of,
) -> np.ndarray:
    """Return the numbers of rows, one after the other.

    Parameters
    ----------
    lines : sequence of int
        The number of each row's line, for the message.
    convert : function
        :func:`floats_of` or :func:`integers_of`.

    Raises
    ------
    BrokenFile
        Naming the first line with a word that is no such number.
    """
    try:
        return convert(itertools.chain.from_iterable(rows))
    except ValueError:
        for row, line in zip(rows, lines):
            for word in row:
                try:
                    convert([word])
                except ValueError:
                    kind = "number" if convert is floats_of else "whole number"
                    raise BrokenFile(f"line {line}: {shown(word)} is no {kind}") from None
        raise
