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
        yield                                              # let Blender redraw once
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
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Generator, Sequence
from pathlib import Path
from typing import TextIO

import bpy

Condition = Callable[[], object]
Wait = float | Condition | None
Steps = Generator[Wait, None, None]

TICK = 0.1
"""Seconds between two looks at what the current step waits for; Blender redraws in between."""

FIRST_TICK = 2.0
"""Seconds until the first step: the window must have been drawn once before regions have sizes."""

MOUSE_BUTTONS = {"LEFT": "1", "MIDDLE": "2", "RIGHT": "3"}


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


class Session:
    """A queue of steps in a Blender window.

    Parameters
    ----------
    timeout
        Seconds after which a condition that a step waits for counts as failed.
    """

    def __init__(self, timeout: float = 20.0) -> None:
        self.output = Path(os.environ["ACCELSCOPE_OUTPUT"])
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
            A function, or a generator function that yields what to wait for: None for one redraw,
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
        # Persistent: a step may load a file.
        bpy.app.timers.register(self._tick, first_interval=FIRST_TICK, persistent=True)

    def _run_steps(self) -> Steps:
        for name, function in self._steps:
            self._current = name
            print(f"session: {time.monotonic() - self._started:5.1f} s  {name}", flush=True)
            waits = function()
            if waits is not None:
                yield from waits
            # One redraw after each step, so that what it broke in a panel shows in this step.
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
        return TICK

    def _advance(self) -> None:
        error = self._error()
        if error is not None:
            # Thrown into the step, so that the traceback shows where it was waiting.
            self._wait = self._running.throw(error)
        elif self._wait_is_over():
            self._wait = next(self._running)
            self._waiting_since = time.monotonic()
        self._redraw()

    def _error(self) -> Exception | None:
        if "Traceback (most recent call last)" in self._errors.text:
            return RuntimeError("Blender printed a traceback:\n" + self._errors.text)
        if callable(self._wait) and time.monotonic() - self._waiting_since > self.timeout:
            return TimeoutError(f"what the step waits for did not come in {self.timeout:g} s")
        return None

    def _wait_is_over(self) -> bool:
        if self._wait is None:
            return True
        if callable(self._wait):
            return bool(self._wait())
        return time.monotonic() - self._waiting_since >= self._wait

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

    # Finding things.

    @property
    def window(self) -> bpy.types.Window:
        """The main window (a timer's context has none)."""
        return bpy.context.window_manager.windows[0]

    def area(self, area_type: str = "VIEW_3D") -> bpy.types.Area:
        """Find the largest area of a type.

        Parameters
        ----------
        area_type
            For example ``VIEW_3D``, ``OUTLINER``, ``PROPERTIES``.

        Returns
        -------
        bpy.types.Area
            The area. ValueError if there is none.
        """
        areas = [area for area in self.window.screen.areas if area.type == area_type]
        return max(areas, key=lambda area: area.width * area.height)

    def region(self, region_type: str = "WINDOW", area_type: str = "VIEW_3D") -> bpy.types.Region:
        """Find a region of an area: ``WINDOW``, ``UI`` (the sidebar), ``TOOLS``, ``HEADER`` ...

        Parameters
        ----------
        region_type, area_type
            Which region of which area.

        Returns
        -------
        bpy.types.Region
            The region. ValueError if there is none.
        """
        (region,) = (r for r in self.area(area_type).regions if r.type == region_type)
        return region

    def context(self) -> dict[str, object]:
        """Return what ``Context.temp_override`` needs to act in the 3D viewport.

        Returns
        -------
        dict
            Window, area and region, or only the window if it shows no 3D viewport. Steps run
            under this override already.
        """
        if all(area.type != "VIEW_3D" for area in self.window.screen.areas):
            return {"window": self.window}
        return {"window": self.window, "area": self.area(), "region": self.region()}

    # Looking.

    def screenshot(self, name: str) -> Path:
        """Save the screen as Blender shows it now.

        ``bpy.ops.screen.screenshot`` gives a black picture with software GL, so the X server is
        asked.

        Parameters
        ----------
        name
            Name of the picture, without suffix.

        Returns
        -------
        Path
            The PNG file in the output directory.
        """
        picture = self.output / f"{name}.png"
        self._redraw()
        with bpy.context.temp_override(**self.context()):
            bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
        subprocess.run(["import", "-window", "root", str(picture)], check=True, timeout=30)
        return picture

    def open_sidebar(self, tab: str) -> Steps:
        """Open the sidebar of the 3D viewport at a tab: ``yield from session.open_sidebar(...)``.

        Parameters
        ----------
        tab
            Name of the tab, for example ``Item``. A tab without a visible panel does not exist.

        Yields
        ------
        Wait
            Until the sidebar shows the tab.
        """
        self.area().spaces[0].show_region_ui = True
        # The tabs are known, and may be chosen, only once the region has been drawn.
        yield lambda: self.region("UI").active_panel_category not in {"", "UNSUPPORTED"}
        self.region("UI").active_panel_category = tab
        yield lambda: self.region("UI").active_panel_category == tab
        # The region slides in, and is drawn with the panels of the tab.
        yield 0.5

    def widen_sidebar(self, width: int) -> Steps:
        """Drag the sidebar to a width: ``yield from session.widen_sidebar(450)``.

        Parameters
        ----------
        width
            New width in pixels.

        Yields
        ------
        Wait
            Until the sidebar is about that wide.
        """
        sidebar = self.region("UI")
        # Near the top: below the last panel the sidebar lets clicks through to the viewport.
        x, y = sidebar.x + 2, sidebar.y + 0.9 * sidebar.height
        yield from self.drag((x, y), (x - (width - sidebar.width), y))
        yield lambda: abs(self.region("UI").width - width) < 5

    # Acting like a user: real X events, which Blender handles after the next `yield`.

    def move(self, x: float, y: float) -> None:
        """Move the mouse pointer.

        Parameters
        ----------
        x, y
            Window coordinates.
        """
        self._xdotool(self._move(x, y))

    def click(
        self, x: float, y: float, button: str = "LEFT", held: Sequence[str] = (), count: int = 1
    ) -> None:
        """Click with the mouse.

        Parameters
        ----------
        x, y
            Window coordinates.
        button
            ``LEFT``, ``MIDDLE`` or ``RIGHT``.
        held
            X names of keys that are held down meanwhile, for example ``ctrl``.
        count
            2 for a double click.
        """
        clicks = ["click", "--repeat", str(count), "--delay", "60", MOUSE_BUTTONS[button]]
        self._xdotool(self._move(x, y), ["keydown", *held], clicks, ["keyup", *held])

    def drag(
        self, start: tuple[float, float], end: tuple[float, float], button: str = "LEFT"
    ) -> Steps:
        """Drag with the mouse: ``yield from session.drag(...)``.

        Parameters
        ----------
        start, end
            Window coordinates.
        button
            ``LEFT``, ``MIDDLE`` or ``RIGHT``.

        Yields
        ------
        Wait
            Between the events, as Blender merges those that come at once, and then sees no drag.
        """
        middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
        self._xdotool(self._move(*start))
        yield
        self._xdotool(["mousedown", MOUSE_BUTTONS[button]])
        for point in (middle, end):
            yield
            self._xdotool(self._move(*point))
        yield
        self._xdotool(["mouseup", MOUSE_BUTTONS[button]])
        yield

    def key(self, *names: str) -> None:
        """Press and release keys, one after the other.

        They go to what is under the mouse pointer: ``move`` it there first.

        Parameters
        ----------
        *names
            X names, for example ``n``, ``Escape``, ``Return``, ``ctrl+z``.
        """
        self._xdotool(["key", *names])

    def type(self, text: str) -> None:
        """Type a text, for example into a field that was double-clicked.

        Parameters
        ----------
        text
            The text.
        """
        self._xdotool(["type", text])

    def _redraw(self) -> None:
        for area in self.window.screen.areas:
            area.tag_redraw()

    def _move(self, x: float, y: float) -> list[str]:
        # X counts from the top. There is no window manager: the window begins at (0, 0).
        return ["mousemove", str(round(x)), str(round(self.window.height - 1 - y))]

    def _xdotool(self, *commands: list[str]) -> None:
        for command in commands:
            if len(command) > 1:
                subprocess.run(["xdotool", *command], check=True, timeout=30)
