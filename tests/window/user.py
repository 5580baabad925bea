"""What a user does in a Blender window: finds a button of the sidebar, clicks, drags, types.

For a script's steps, see :mod:`session`; coordinates are those said there.
"""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Generator, Sequence

import bpy
from screen import Screen

Condition = Callable[[], object]
Wait = float | Condition | None
Steps = Generator[Wait, None, None]
Place = tuple[float, float]

TICK = 0.1
"""Seconds that a step waits for Blender to handle events, if it says nothing else."""

LOOK = 0.03
"""Seconds between two looks at what the step waits for."""

MOUSE_BUTTONS = {"LEFT": "1", "MIDDLE": "2", "RIGHT": "3", "WHEEL_UP": "4", "WHEEL_DOWN": "5"}

SCAN = 16
"""Pixels between two places where a button is looked for; buttons are 20 high."""


class NotePointer(bpy.types.Operator):
    """Note where the mouse pointer is for Blender: on a busy machine it hears of it late."""

    bl_idname = "session.pointer"
    bl_label = "Note the Pointer"

    place = (-1, -1)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        NotePointer.place = event.mouse_x, event.mouse_y
        return {"FINISHED"}


def fits(button: str, name: str) -> bool:
    """Say whether what a button stands for is meant by a name, see :meth:`User.find`."""
    return name in button if "(" in name else button.endswith(name)


class User(Screen):
    """A user before the main window of Blender."""

    def __init__(self) -> None:
        super().__init__()
        self._places: dict[str, Place] = {}

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

    # Finding a button: Blender tells nobody where its buttons are, but it does tell what the one
    # under the pointer stands for.

    def button_under_pointer(self) -> str:
        """Return what the button of the sidebar under the mouse pointer stands for.

        Returns
        -------
        str
            ``bpy.ops.x.y(...)`` for an operator, the full data path for a property, or "".
        """
        override = {**self.context(), "region": self.region("UI")}
        with bpy.context.temp_override(**override):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
            elif bpy.ops.ui.copy_data_path_button.poll():
                bpy.ops.ui.copy_data_path_button(full_path=True)
            else:
                return ""
        return bpy.context.window_manager.clipboard

    def find(self, name: str, across: float = 0.6) -> Generator[Wait, None, Place]:
        """Move the mouse onto a button of the sidebar: ``yield from session.find("x.build")``.

        The pointer goes down the open tab, scrolling where it has to, until the button is under
        it. On the way it learns where all the others are.

        Parameters
        ----------
        name
            Part of what the button stands for: the name of an operator, followed by "(" and
            perhaps arguments, or the end of a data path.
        across
            Where the pointer goes down, as a share of the sidebar's width: not over labels, and
            far left for a check box in the header of a panel.

        Yields
        ------
        Wait
            For Blender to notice the pointer.

        Returns
        -------
        (x, y)
            Where the pointer is now. RuntimeError if there is no such button.
        """
        known = next((place for each, place in self._places.items() if fits(each, name)), None)
        for scrolling in ("", "WHEEL_UP", *["WHEEL_DOWN"] * 5):
            sidebar = self.region("UI")
            x, y = sidebar.x + across * sidebar.width, sidebar.y + sidebar.height - SCAN
            if scrolling:
                count = {"WHEEL_UP": 40, "WHEEL_DOWN": 12}[scrolling]
                before = self._scrolled()
                self.click(x, sidebar.y + 0.5 * sidebar.height, scrolling, count=count)
                yield 5 * TICK
                if self._scrolled() == before and (known is None or scrolling == "WHEEL_DOWN"):
                    # At the end already: all of this has been looked at.
                    continue
            places = [(x, y - row * SCAN) for row in range(int(sidebar.height / SCAN) - 1)]
            if known is not None and scrolling != "WHEEL_DOWN":
                # The panels above it may have grown or shrunk by a few lines.
                offsets = (sign * n * SCAN for n in range(1, 5) for sign in (-1, 1))
                near = [(x, known[1]), known, *((x, known[1] + offset) for offset in offsets)]
                places = [*near, *places] if scrolling else near
            for place in places:
                if (yield from self._settles_on(name, place)):
                    return self._places[name]
        raise RuntimeError(f"the sidebar has no button for {name}")

    def _scrolled(self) -> float:
        """Return how far the sidebar is scrolled."""
        return self.region("UI").view2d.region_to_view(0, 0)[1]

    def _settles_on(self, name: str, place: Place) -> Generator[Wait, None, bool]:
        """Move the pointer to a place; when the button is there, further inside it."""
        yield from self._point(*place)
        found = self.button_under_pointer()
        if found:
            self._places[found] = place
        if not fits(found, name):
            return False
        # A few pixels further down, unless the button ends there.
        for down in (SCAN / 4, 0):
            inside = (place[0], place[1] - down)
            yield from self._point(*inside)
            if fits(self.button_under_pointer(), name):
                self._places[name] = inside
                return True
        return False

    def _point(self, x: float, y: float) -> Steps:
        """Move the pointer, and wait until Blender has told what is under it."""
        self.move(x, y)
        yield lambda: self._is_seen_at(x, y)
        # It knows the place before it handles the event.
        yield LOOK

    def _is_seen_at(self, x: float, y: float) -> bool:
        bpy.ops.session.pointer("INVOKE_DEFAULT")
        seen_x, seen_y = NotePointer.place
        return abs(seen_x - x) <= 1 and abs(seen_y - y) <= 1

    def press(self, name: str, across: float = 0.6) -> Steps:
        """Find a button of the sidebar and click on it: ``yield from session.press("x.build(")``.

        Parameters
        ----------
        name, across
            See `find`.

        Yields
        ------
        Wait
            Until Blender has taken the click.
        """
        x, y = yield from self.find(name, across)
        self.click(x, y)
        yield 3 * TICK

    def enter(self, name: str, text: str, across: float = 0.55) -> Steps:
        """Type a value into a field of the sidebar: ``yield from session.enter("opacity", "1")``.

        Parameters
        ----------
        name, across
            See `find`. A number with a slider behind it is short, and has arrows at both ends.
        text
            What to type.

        Yields
        ------
        Wait
            Until Blender has taken the value.
        """
        x, y = yield from self.find(name, across)
        self.click(x, y, count=2)
        yield 3 * TICK
        self.key("ctrl+a")
        self.type(text)
        self.key("Return")
        yield 3 * TICK

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
            ``LEFT``, ``MIDDLE``, ``RIGHT``, ``WHEEL_UP`` or ``WHEEL_DOWN``.
        held
            X names of keys that are held down meanwhile, for example ``ctrl``.
        count
            2 for a double click; how far to scroll.
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
        # Several, since Blender waits for a second move before it takes a drag for one.
        shares = (0.25, 0.5, 0.75, 1.0)
        points = [tuple(a + f * (b - a) for a, b in zip(start, end, strict=True)) for f in shares]
        yield from self._point(*start)
        self._xdotool(["mousedown", MOUSE_BUTTONS[button]])
        for point in points:
            yield 2 * TICK
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

    def _move(self, x: float, y: float) -> list[str]:
        # X counts from the top. There is no window manager: the window begins at (0, 0).
        return ["mousemove", str(round(x)), str(round(self.window.height - 1 - y))]

    def _xdotool(self, *commands: list[str]) -> None:
        for command in commands:
            if len(command) > 1:
                subprocess.run(["xdotool", *command], check=True, timeout=30)
