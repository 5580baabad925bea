"""Text of mesh files: whichever way lines end, whatever bytes stand in names and comments."""

from __future__ import annotations

import codecs
import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np

from .contents import MORE_THAN_ANY, BrokenFile

MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
"""What a text may begin with to tell its encoding; UTF-32's contains UTF-16's."""


def text_of(data: bytes) -> bytes:
    r"""Return a text file's bytes, with ``\n`` at the end of lines and no mark at the beginning.

    Names and comments may be in any encoding that has ASCII in it; UTF-16 and UTF-32 are turned
    into UTF-8 where the file begins with their mark.
    """
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


class TextLines(NamedTuple):
    """Lines of a file that are not blank, and their numbers, counted from 1."""

    texts: list[bytes]
    numbers: list[int]

    def part(self, begin: int, end: int) -> TextLines:
        """Return some of them."""
        return TextLines(self.texts[begin:end], self.numbers[begin:end])


def lines_of(data: bytes, n_before: int, comment: bytes = b"") -> TextLines:
    """Return the lines of a part of a file, without comments.

    Parameters
    ----------
    n_before : int
        How many lines stand before that part.
    comment : bytes
        What begins a comment, if anything does.
    """
    texts = data.split(b"\n")
    if comment and comment in data:
        texts = [text.partition(comment)[0] for text in texts]
    filled = [number for number, text in enumerate(texts) if text and not text.isspace()]
    return TextLines([texts[number] for number in filled], [n_before + 1 + k for k in filled])


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


def floats_of(words: Sequence[bytes]) -> np.ndarray:
    """Return numbers written in ASCII, (n,) float64.

    Raises
    ------
    ValueError
        If one is no number.
    """
    _refuse_underscores(words)
    return np.fromiter(map(float, words), np.float64, len(words))


def integers_of(words: Sequence[bytes]) -> np.ndarray:
    """Return whole numbers written in ASCII, (n,) int64.

    Raises
    ------
    ValueError
        If one is no whole number, or none that 64 bits can hold.
    """
    _refuse_underscores(words)
    try:
        return np.fromiter(map(int, words), np.int64, len(words))
    except OverflowError:
        raise ValueError("a number is too large") from None


def _refuse_underscores(words: Sequence[bytes]) -> None:
    """Refuse ``1_000``, which Python takes for a number but no file format does."""
    if b"_" in b" ".join(words):
        raise ValueError("a number has an underscore in it")


DIGITS = len(str(MORE_THAN_ANY))


def integer_of(word: bytes, what: str) -> int:
    """Return one whole number from 0 to below 2^63, such as a count in a header.

    Raises
    ------
    BrokenFile
        Naming `what` it should have been.
    """
    if not word.isdigit():
        raise BrokenFile(f"{what} is {shown(word)}, not a whole number")
    # Python refuses to read thousands of digits.
    number = int(word) if len(word.lstrip(b"0")) <= DIGITS else MORE_THAN_ANY
    if number >= MORE_THAN_ANY:
        raise BrokenFile(f"{what} is {shown(word)}, more than any file can have")
    return number


def numbers_in(
    words: Sequence[bytes],
    sizes: Iterable[int],
    lines: Iterable[int],
    convert: Callable[[Sequence[bytes]], np.ndarray] = floats_of,
) -> np.ndarray:
    """Return the numbers that words in rows are.

    Parameters
    ----------
    words : sequence of bytes
        Row after row. Not a list for each row: hundreds of thousands of lists keep Python's
        collector of garbage busy for longer than all of the reading takes.
    sizes, lines : iterable of int
        How many words each row has, and the number of its line, for the message.
    convert : function
        :func:`floats_of` or :func:`integers_of`.

    Raises
    ------
    BrokenFile
        Naming the first line with a word that is no such number.
    """
    try:
        return convert(words)
    except ValueError:
        rest = iter(words)
        for size, line in zip(sizes, lines):
            for word in itertools.islice(rest, size):
                try:
                    convert([word])
                except ValueError:
                    kind = "number" if convert is floats_of else "whole number"
                    raise BrokenFile(f"line {line}: {shown(word)} is no {kind}") from None
        raise
