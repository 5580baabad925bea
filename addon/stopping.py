"""Ctrl-C and requests to terminate: what they end, and what they wait for.

A signal is told to whatever Python happens to run, and a KeyboardInterrupt there may come to harm:
Blender crashes if one is raised while it is imported, Blender and C libraries print what is raised
in a function that they call, and go on, and a module that is being imported may make an ImportError
of it. Python's own locks, released by whoever has lost them, fail in other threads. So stops wait
while Blender is at work (:func:`held`), none is raised among locks, and one that was not raised
there, or was lost elsewhere, is raised by whatever looks next (:meth:`Stops.heed`).
"""

from __future__ import annotations

import contextlib
import math
import signal
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType
from typing import Any

SIGNALS = signal.SIGINT, signal.SIGTERM

SAME = 1.0
"""Seconds in which further signals are the same stop: ``timeout`` sends one to the process and one
to its group, and a hand in a hurry presses twice."""

LOCKING = {"threading", "concurrent.futures.thread", "concurrent.futures._base"}
"""Modules that lock something for a moment; who waits for them looks several times a second."""

Handlers = dict[signal.Signals, Any]


class Stops:
    """What signals ask of one run of the command line.

    Attributes
    ----------
    is_asked : bool
        Whether it is to stop.
    """

    def __init__(self) -> None:
        self.is_asked = False
        self._passed_over: float = 0  # how many more are
        self._heard = -math.inf

    @contextlib.contextmanager
    def told(self, *, until_exit: bool) -> Iterator[None]:
        """Raise KeyboardInterrupt at Ctrl-C and at a request to terminate, in Blender, too.

        Parameters
        ----------
        until_exit : bool
            Whether the process ends afterwards. Then signals are ignored from there on: what is
            left to Python and Blender takes a moment, and has no say in the exit code.
        """
        # Who has it ignored, such as nohup, has a reason.
        before = {
            each: earlier
            for each in SIGNALS
            if (earlier := signal.getsignal(each)) is not signal.SIG_IGN
        }
        # Blender's own handler is none that Python could set again.
        afterwards = {
            each: signal.SIG_IGN if until_exit else earlier or signal.SIG_DFL
            for each, earlier in before.items()
        }
        try:
            with _handled(self._hear, afterwards):
                yield
        finally:
            # CPython notes when a KeyboardInterrupt leaves code that was given to exec as text, as
            # Numba's and that of dataclasses is. At its end it kills itself by SIGINT then, whoever
            # has caught it and whatever the exit code. The next such text makes it forget that.
            exec("")

    def heed(self) -> None:
        """Raise KeyboardInterrupt if a signal was heard that has not ended the run.

        Raises
        ------
        KeyboardInterrupt
        """
        if self.is_asked:
            raise KeyboardInterrupt

    @contextlib.contextmanager
    def waiting(self) -> Iterator[None]:
        """Let a first stop wait for the end of the block, which is short; a second one does not.

        Afterwards there is nothing left that any could stop.
        """
        self.is_asked = False
        self._passed_over = 1
        try:
            yield
        finally:
            self._passed_over = math.inf

    def _hear(self, number: int, frame: FrameType | None) -> None:
        """Stop what is running, unless this is to be passed over."""
        now = time.monotonic()
        if now - self._heard < SAME:
            return
        self._heard = now
        if self._passed_over:
            self._passed_over -= 1
            return
        is_first, self.is_asked = not self.is_asked, True
        # A second one is not for waiting any longer.
        if not (is_first and _is_among_locks(frame)):
            raise KeyboardInterrupt


def _is_among_locks(frame: FrameType | None) -> bool:
    """Say whether a function of LOCKING is running, or has called what is."""
    while frame is not None:
        if frame.f_globals.get("__name__") in LOCKING:
            return True
        frame = frame.f_back
    return False


@contextlib.contextmanager
def held() -> Iterator[None]:
    """Let stops wait for the end of the block, in which Blender is at work; then tell of them.

    What is no function of Python's is told at once: it raises nothing.
    """
    waiting: list[int] = []
    before = {each: earlier for each in SIGNALS if callable(earlier := signal.getsignal(each))}
    try:
        with _handled(lambda number, frame: waiting.append(number), before):
            yield
    finally:
        if waiting:
            signal.raise_signal(waiting[0])


@contextlib.contextmanager
def _handled(handler: Callable[[int, Any], Any], afterwards: Handlers) -> Iterator[None]:
    """Let `handler` be told of signals meanwhile; only the main thread can be.

    Parameters
    ----------
    handler : callable
    afterwards : dict of signal.Signals to handler
        Who is to be told of which signal afterwards.
    """
    can_be = threading.current_thread() is threading.main_thread()
    if can_be:
        for number in afterwards:
            signal.signal(number, handler)
    try:
        yield
    finally:
        if can_be:
            for number, later in afterwards.items():
                signal.signal(number, later)
