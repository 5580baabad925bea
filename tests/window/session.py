"""Drive a real Blender window from a script: steps, real mouse and key events, screenshots.

Only for scripts that ``.ci/blender_window.sh`` runs; nothing here works without a window. Blender
does not put a script's directory on ``sys.path``, so such a script begins like this::

    import sys
    from pathlib import Path

    import bpy

    sys.path.insert(0, str(Path(__file__).parent))
    from session import Session

    session = Session()


    @session.step
    def add_monkey():
        bpy.ops.mesh.primitive_monkey_add()
        yield                                              # let Blender handle events
        yield 0.5                                          # wait half a second
        yield lambda: bpy.context.object.name == "Suzanne"  # wait until true, or fail
        session.screenshot("monkey")


    session.run()

Steps run in the order in which they were added, in the context of the 3D viewport. A step is a
function or, to give Blender time to handle events and to redraw, a generator function. It fails
when it raises, when a condition it waits for does not come true in time, and also when Blender
prints a traceback meanwhile: that is how errors in panels, handlers and timers show.

In the output directory are left the screenshots and either ``passed.txt`` (the names of the steps,
one a line) or ``failed.txt`` (the step and its traceback) and ``failed.png``. Blender ends with
exit code 0 or 1 accordingly.

Coordinates are Blender's: pixels from the lower left corner of the window, as in ``region.x`` and
``region.y``.
"""

from __future__ import annotations

import atexit
import os
import sys
import time
import traceback
from collections.abc import Callable
from typing import TextIO

import bpy
from user import LOOK, TICK, NotePointer, Steps, User, Wait

FIRST_TICK = 2.0
"""Seconds until the first step: the window must have been drawn once before regions have sizes."""


class _Recorder:
    """Pass on what is written to a stream, and keep it for a look at it.

    Parameters
    ----------
    stream
        The stream that gets everything.
    """

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream
        self.text = ""

    def write(self, text: str) -> int:
        """Write to the stream and keep the text."""
        self.text += text
        return self.stream.write(text)

    def flush(self) -> None:
        """Flush the stream."""
        self.stream.flush()


class Session(User):
    """A queue of steps in a Blender window.

    Parameters
    ----------
    timeout
        Seconds after which a condition that a step waits for counts as failed.
    """

    def __init__(self, timeout: float = 20.0) -> None:
        super().__init__()
        self.timeout = timeout
        self._steps: list[tuple[str, Callable[[], Steps | None]]] = []
        self._running = self._run_steps()
        self._current = "before the first step"
        self._wait: Wait = None
        self._waiting_since = 0.0
        self._all_done = False
        self._started = time.monotonic()
        self._errors = _Recorder(sys.stderr)

    # The queue.

    def step(self, function: Callable[[], Steps | None]) -> Callable[[], Steps | None]:
        """Add a step (a decorator); it is named after the function.

        Parameters
        ----------
        function
            A function, or a generator function that yields what to wait for: None for one tick,
            a number of seconds, or a function that returns true when the wait is over.

        Returns
        -------
        Callable
            The function itself.
        """
        self._steps.append((function.__name__, function))
        return function

    def run(self) -> None:
        """Start: the steps run as soon as Blender has drawn its window."""
        # Neither the splash screen nor the question whether to save may take the clicks.
        bpy.context.preferences.view.show_splash = False
        bpy.context.preferences.view.use_save_prompt = False
        sys.stderr = self._errors
        bpy.utils.register_class(NotePointer)
        # Persistent: a step may load a file.
        bpy.app.timers.register(self._tick, first_interval=FIRST_TICK, persistent=True)

    def _run_steps(self) -> Steps:
        for name, function in self._steps:
            self._current = name
            print(f"session: {time.monotonic() - self._started:5.1f} s  {name}", flush=True)
            waits = function()
            if waits is not None:
                yield from waits
            # One redraw after each step, so that what it broke in a panel shows in this step. Not
            # more, as software GL takes a second for some scenes.
            self._redraw()
            yield None
        self._current = "quit Blender"
        self._all_done = True
        yield None

    def _tick(self) -> float | None:
        try:
            with bpy.context.temp_override(**self.context()):
                self._advance()
                if self._all_done:
                    # The ordinary way out, with the add-ons' unregister() and all.
                    atexit.register(self._finish)
                    bpy.ops.wm.quit_blender()
                    return None
        except BaseException:
            self._fail(traceback.format_exc())
        return LOOK

    def _advance(self) -> None:
        error = self._error()
        if error is not None:
            # Thrown into the step, so that the traceback shows where it was waiting.
            self._wait = self._running.throw(error)
        elif self._wait_is_over():
            self._wait = next(self._running)
            self._waiting_since = time.monotonic()

    def _error(self) -> Exception | None:
        if "Traceback (most recent call last)" in self._errors.text:
            return RuntimeError("Blender printed a traceback:\n" + self._errors.text)
        if callable(self._wait) and time.monotonic() - self._waiting_since > self.timeout:
            return TimeoutError(f"what the step waits for did not come in {self.timeout:g} s")
        return None

    def _wait_is_over(self) -> bool:
        if callable(self._wait):
            return bool(self._wait())
        seconds = TICK if self._wait is None else self._wait
        return time.monotonic() - self._waiting_since >= seconds

    def _finish(self) -> None:
        # Python ends after Blender has disabled the add-ons: errors in that count as well.
        error = self._error()
        if error is not None:
            self._write_failure(str(error))
            os._exit(1)
        names = "".join(f"{name}\n" for name, _ in self._steps)
        (self.output / "passed.txt").write_text(names, encoding="utf-8")

    def _fail(self, error: str) -> None:
        self._write_failure(error)
        try:
            self.screenshot("failed")
        finally:
            # Quitting by the operator would end with 0, and SystemExit does not end a timer.
            os._exit(1)

    def _write_failure(self, error: str) -> None:
        message = f"step {self._current} failed\n{error}"
        (self.output / "failed.txt").write_text(message, encoding="utf-8")
        print(f"session: {message}", flush=True)
