"""The showcase: which exhibit stands in the viewport, and the frames made so far.

Frames are made on demand, since one may mean running a builder once more. Those made are kept, so
that moving through them is fluent.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

from ..drawing import overlay

if TYPE_CHECKING:  # importing it for real would import the structures, and Numba with them
    from ...core.lessons.exhibit import Exhibit, Frame
    from ...core.progress import Progress

MOST_KEPT = 64
"""Frames kept; each is some megabytes at most."""


class Key(NamedTuple):
    """Name of an exhibit, and number of a frame."""

    exhibit: str
    frame: int


@dataclass
class Showcase:
    """Exhibits of the structure that was built.

    Attributes
    ----------
    exhibits : list of Exhibit
    frames : dict of Key to Frame
        Those made so far, the oldest first.
    shown : Key or None
        The frame that is drawn.
    """

    exhibits: list[Exhibit] = field(default_factory=list)
    frames: dict[Key, Frame] = field(default_factory=dict)
    shown: Key | None = None

    def chosen(self, group: Any) -> Exhibit | None:
        """Return the exhibit that the settings name, or else the first one.

        Parameters
        ----------
        group : bpy.types.PropertyGroup
            ``scene.accelscope.exhibits``.
        """
        named = [exhibit for exhibit in self.exhibits if exhibit.name == group.chosen]
        return next(iter(named or self.exhibits), None)

    def wanted(self, group: Any) -> Key | None:
        """Return the frame that the settings ask for; None if there is nothing to show."""
        exhibit = self.chosen(group)
        if exhibit is None or not group.show:
            return None
        return Key(exhibit.name, group.frame)

    def make(self, key: Key, progress: Progress) -> Frame:
        """Make a frame; may take as long as a build.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        (exhibit,) = (each for each in self.exhibits if each.name == key.exhibit)
        return exhibit.frame(key.frame, progress)

    def keep(self, key: Key, frame: Frame) -> None:
        """Keep a frame that was made."""
        if len(self.frames) >= MOST_KEPT:
            del self.frames[next(iter(self.frames))]
        self.frames[key] = frame

    def draw(self, group: Any) -> bool:
        """Draw the frame that the settings ask for, or none; say whether that was possible.

        It is not when the frame has still to be made: then what is drawn stays.
        """
        key = self.wanted(group)
        if key is None:
            self.shown = None
            overlay.set_lines(overlay.EXHIBIT, None)
        elif key != self.shown and key in self.frames:
            self.shown = key
            frame = self.frames[key]
            overlay.set_lines(overlay.EXHIBIT, frame.segments, frame.colours)
        overlay.hide_cells(self.shown is not None and group.alone)
        return self.shown == key

    @property
    def frame_shown(self) -> Frame | None:
        """The frame that is drawn."""
        return None if self.shown is None else self.frames.get(self.shown)
