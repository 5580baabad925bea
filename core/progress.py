"""Progress and cancellation of long work, the same for panel, command line and tests."""

from __future__ import annotations

import os
import sys
import time
from typing import Any

from .printing import print_lines, printable


class Cancelled(Exception):
    """The user stopped the work; the previous result stays."""


class Progress:
    """Receives how far the work is; silent. Subclasses show it or cancel.

    Long work calls :meth:`report` a few times per second.
    """

    def report(self, done: float, total: float, text: str) -> None:
        """Take note that `done` of `total` units of the work called `text` are finished.

        Raises
        ------
        Cancelled
            When the work is to stop.
        """

    def announce(self, text: str) -> None:
        """Take note of a wait that nobody can say the length of, such as a compilation."""

    def offer(self, draft: Any) -> None:
        """Take what can be shown until the work is finished: a result, but a coarser one.

        Nothing changes it any more.
        """


class TerminalProgress(Progress):
    """A progress bar on the terminal, shown once the work has taken two seconds.

    Our own few lines, because Blender's Python carries no progress library.
    """

    DELAY = 2.0  # seconds

    def __init__(self) -> None:
        self._text = ""
        self._started = time.perf_counter()
        self._drawn = 0.0
        self._visible = sys.stderr.isatty()

    def announce(self, text: str) -> None:
        """Print the text on a line of its own."""
        print_lines(f"accelscope: {text}", sys.stderr)

    def report(self, done: float, total: float, text: str) -> None:
        """Draw the bar, at most ten times a second; wipe it when the work is finished."""
        now = time.perf_counter()
        if text != self._text:
            self._text, self._started = text, now
        finished = done >= total
        if not self._visible or now - self._started < self.DELAY:
            return
        if not finished and now - self._drawn < 0.1:
            return
        self._drawn = now
        share = f" {100 * done / max(total, 1):3.0f}%"
        bar = f" [{'#' * int(30 * done / total) if total else '':<30}]"
        # A line that is wider than the terminal would go on in the next, again and again.
        columns = max(_columns() - 1, 0)
        if columns < 40 + len(bar + share):
            bar = ""
        room = max(min(columns - len(bar + share), 40), 0)
        line = f"{printable(text)[:room]:<{room}}{bar}{share}"[:columns]
        sys.stderr.write("\r" + " " * len(line) + "\r" if finished else f"\r{line}")
        sys.stderr.flush()


def _columns() -> int:
    """Return how wide the terminal is, in letters."""
    try:
        return os.get_terminal_size(sys.stderr.fileno()).columns or 80
    except (OSError, ValueError):
        return 80  # as terminals are that cannot say it


SILENT = Progress()
