"""What is printed: every line for a terminal passes through here, and every name on a page.

Names come from files: a terminal would obey the control characters in them, and a bidirectional
override would show their letters in another order.
"""

from __future__ import annotations

import sys
from typing import TextIO


def printable(text: str) -> str:
    """Return a text that a terminal only shows: what would steer it is written as an escape."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def show_integer(number: float) -> str:
    """Return a whole number with a space between thousands: ``"12 345"``."""
    return f"{number:,.0f}".replace(",", " ")


def in_html(text: str) -> str:
    """Return a text as a page has it: neither tags nor anything else in it has an effect.

    What is invisible, or would turn the order of letters, is written as an escape here, too.
    """
    import html

    return html.escape(printable(text))


def print_lines(text: str, file: TextIO | None, flush: bool = False) -> None:
    """Print lines, each as :func:`printable` has it; without a file on standard output."""
    print("\n".join(map(printable, text.split("\n"))), file=file, flush=flush)


def print_traceback(error: BaseException) -> None:
    """Print where a defect has shown itself, on standard error."""
    import traceback  # it reads sources, and is imported when there is something to tell

    print_lines("".join(traceback.format_exception(error)).rstrip(), sys.stderr)
