"""Exhibits: pictures of one idea, in frames, made of coloured lines in the scene's space.

How clusters merge, how a queue is compacted, where a subtree was moved to: each is a list of
segments and a caption, so that overlay and pictures show the same. A chart, too, is segments: it
stands in an upright plane beside the model.

What a builder or an optimiser has decided, an exhibit reads in the build log
(:mod:`..contract.build_log`) and in the arrays of the structure. What no log holds, such as all
that was considered and not taken, comes from the builder's own code, over the triangles of that
node; there is no second one that explains.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np

from ..progress import SILENT, Progress
from .lesson import FrameSettings, Play

T = TypeVar("T")

MOST_SEGMENTS = 20_000
"""Segments in one frame; more of them are a grey mass."""


@dataclass(frozen=True)
class Frame:
    """One picture.

    Attributes
    ----------
    segments : (k, 2, 3) float64
        Both ends of each line.
    colours : (k, 4) float64
        sRGB and opacity of each line.
    caption : str
        What is to be seen, with its figures.
    """

    segments: np.ndarray
    colours: np.ndarray
    caption: str


class MakesFrame(Protocol):
    """Makes a frame by its number; tells how far that is, and stops when `progress` says so."""

    def __call__(self, number: int, progress: Progress = ..., /) -> Frame:
        """Return frame number `number`."""


@dataclass(frozen=True)
class Exhibit:
    """A named series of frames.

    Attributes
    ----------
    name, label, description : str
        Key (a Python name), name in the panel, one sentence.
    count : int
        Number of frames, at least one.
    frame : callable
        Makes frame number i, ``0 <= i < count``: ``frame(i, progress)`` or ``frame(i)``. It may
        take as long as a build, and reports to `progress` a few times per second.
    on_page : tuple of int
        Frames that tell most, for a page of pictures; without any some evenly between the first
        and the last are taken.
    """

    name: str
    label: str
    description: str
    count: int
    frame: MakesFrame
    on_page: tuple[int, ...] = ()


def exhibit_of_play(
    name: str,
    label: str,
    description: str,
    count: int,
    play: Callable[[Progress], Play],
    knobs_of: Callable[[int], Any] = FrameSettings,
    on_page: tuple[int, ...] = (),
) -> Exhibit:
    """Return a lesson as an exhibit: as many frames as there are knobs."""
    played = Once(play)

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        picture = played(progress).picture(knobs_of(number))
        return Frame(picture.segments, picture.colours, picture.caption)

    return Exhibit(name, label, description, count, frame, on_page)


class Once(Generic[T]):
    """What all frames of an exhibit share: made when the first of them is, and kept.

    Work that was cancelled leaves nothing, and is done anew for the next frame.

    Parameters
    ----------
    make : callable
        Gets a Progress.
    """

    def __init__(self, make: Callable[[Progress], T]) -> None:
        self._make = make
        self._made: list[T] = []

    def __call__(self, progress: Progress = SILENT) -> T:
        """Return what was made, or make it."""
        if not self._made:
            self._made.append(self._make(progress))
        return self._made[0]
