"""Ctrl-C and requests to terminate: what they end, and what they wait for."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any, NoReturn

STOPS = signal.SIGINT, signal.SIGTERM

Handler = Callable[[int, Any], Any]


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Raise KeyboardInterrupt at Ctrl-C and at a request to terminate, in Blender, too."""
    with _handled(_stop):
        yield


@contextlib.contextmanager
def stopped_afterwards() -> Iterator[None]:
    """Let a first stop wait for the end of the block, which is short; a second one does not.

    Afterwards the first one is forgotten: there is nothing left that it could stop.
    """
    is_asked = False

    def wait(number: int, frame: Any) -> None:
        nonlocal is_asked
        if is_asked:
            _stop(number, frame)
        is_asked = True

    with _handled(wait):
        yield


def _stop(number: int, frame: Any) -> NoReturn:
    raise KeyboardInterrupt


@contextlib.contextmanager
def _handled(handler: Handler) -> Iterator[None]:
    """Let `handler` be told of stops meanwhile; only the main thread can be."""
    before = {}
    if threading.current_thread() is threading.main_thread():
        for number in STOPS:
            # Who has it ignored, such as nohup, has a reason.
            if signal.getsignal(number) is not signal.SIG_IGN:
                before[number] = signal.signal(number, handler)
    try:
        yield
    finally:
        for number, earlier in before.items():
            # Blender's own handler is none that Python could set again.
            signal.signal(number, signal.SIG_DFL if earlier is None else earlier)
