"""Lazy structures: a cell is made when a ray first enters it.

A kernel cannot make cells, for it makes no arrays. A walk that meets a cell which is not made yet
notes it and goes on, as if the cell were empty, for some cells more; in the end it answers MISSING.
When all rays of a batch have had their turn, the driver makes the noted cells, each once and in the
order of their numbers, and traces those rays again, until none is missing. Only the last pass of a
ray counts, and in that it has met what a ray meets in a structure whose cells were all made by the
build: hits and counters are the same, whatever the number of threads.

How far a walk goes on is a matter of passes: going nowhere, there would be one for every cell of
the longest path; going to the end, cells would be made that lie behind the hit. So it goes on for
one missing cell, then for two, four, ...: there are no more passes than the longest path has bits,
and no more cells are made in vain than are entered, about. What a pass has made is a new set of
arrays: whoever is tracing through the one before is not disturbed.

A. Glassner: Space Subdivision for Fast Ray Tracing, IEEE CG&A 4(10), 1984 (cells on demand).
"""

from __future__ import annotations

import abc
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..geometry.cones import ConeArrays
from ..geometry.rays import RayArrays
from ..progress import SILENT, Progress
from ..settings import setting
from .figures import Figure
from .ray_order import taken
from .steps import Steps
from .structure import Made, Structure
from .walk import MISSING


def with_room(record: Any, n_cells: int, look_ahead: int) -> tuple[Any, np.ndarray]:
    """Return a record of arrays with room for noting what is missing, and this room (n_cells,)."""
    wanted = np.zeros(n_cells, np.uint8)
    return record._replace(wanted=wanted, look_ahead=look_ahead), wanted


CELLS_MADE = Figure("cells_made", "cells that rays have entered and so made", "Cells made", "count")


def lazy_setting(
    description: str, only_for: Mapping[str, Sequence[str] | str] | None = None
) -> Any:
    """Declare the setting that leaves cells to be made by the rays that enter them.

    Parameters
    ----------
    only_for : mapping, optional
        Where it has an effect, see :func:`..settings.setting`.
    """
    return setting(
        False, "Lazy", f"{description}, not when the structure is built", only_for=only_for
    )


class Making:
    """What is made of a structure so far; its copies, which see the scene otherwise, share it.

    Attributes
    ----------
    arrays : NamedTuple of arrays
        The structure as its kernels see it.
    known : Any
        What else is known of the cells that are there, and is needed to make more.
    made : Made
    dropped : int
        Lists that were thrown away again.
    """

    def __init__(self, arrays: Any, known: Any = None) -> None:
        self.arrays, self.known = arrays, known
        self.dropped = 0
        self.made = Made(0, 0.0, 0)
        self.lock = threading.Lock()


class Finished(Progress):
    """Tells how many rays have their hits, while those that wait are traced again and again."""

    def __init__(self, progress: Progress, count: int, name: str) -> None:
        self.progress, self.count, self.name, self.finished = progress, count, name, 0

    def report(self, done: float, total: float, text: str) -> None:
        """Pass on how many are finished."""
        self.progress.report(self.finished, self.count, f"Tracing {self.name}")

    def announce(self, text: str) -> None:
        """Pass it on."""
        self.progress.announce(text)


class Again(Progress):
    """Tells of rays that are traced again as of other work: there are fewer of them."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress

    def report(self, done: float, total: float, text: str) -> None:
        """Pass it on."""
        self.progress.report(done, total, f"{text}, again")

    def announce(self, text: str) -> None:
        """Pass it on."""
        self.progress.announce(text)


class MadeByRays(Structure):
    """A structure whose cells are made for the rays that are traced."""

    making: Making

    @property
    def arrays(self) -> Any:
        """The structure as its kernels see it, with what is made so far."""
        return self.making.arrays

    @arrays.setter
    def arrays(self, arrays: Any) -> None:
        self.making = Making(arrays)

    @property
    def known(self) -> Any:
        """What else is known of the cells that are there."""
        return self.making.known

    def made(self) -> Made:
        """Return what has been made for rays so far."""
        return self.making.made

    def _recorded(self, arrays: Any) -> Steps:
        """Record the walk of one ray, or cone, once the cells that it enters are there."""
        self._trace_all(arrays, None, 1, SILENT)
        return super()._recorded(arrays)

    def _trace_in_passes(
        self,
        arrays: Any,
        rays: RayArrays | ConeArrays,
        waiting: np.ndarray,
        out: tuple[np.ndarray, np.ndarray, np.ndarray],
        threads: int,
        told: Finished,
        make: Callable[[Any, np.ndarray, Progress], Any],
    ) -> None:
        """Trace rays, make the cells that they miss, and trace those again, until none does.

        Parameters
        ----------
        waiting : (n,) int
            The rays that are traced, in this order.
        out : tuple
            The room for t, primitives and counters of all rays.
        make : callable
            Gets the arrays, and for each ray that waits the number of its cell, which its walk has
            returned in the place of t; returns arrays in which at least one of them is made.
        """
        while len(waiting):
            found = self._trace_through(arrays, taken(rays, waiting), None, threads, told)
            for column, values in zip(out, found, strict=True):
                column[waiting] = values
            is_waiting = found[1] == MISSING
            told.finished += int((~is_waiting).sum())
            waiting = waiting[is_waiting]
            if len(waiting):
                arrays = make(arrays, found[0][is_waiting].astype(np.int64), told)
        told.report(0, 0, "")

    def _keep(self, arrays: Any, count: int, seconds: float, known: Any = None) -> None:
        """Keep what was made: so many cells, in so much time."""
        cells, before, passes = self.making.made
        self.making.arrays, self.making.known = arrays, known
        self.making.made = Made(cells + count, before + seconds, passes + 1)


class LazyStructure(MadeByRays):
    """A structure that makes its cells when rays enter them.

    Its arrays, for kernels, have the fields

        wanted : (n_cells,) uint8     1 where a walk has met a cell that is not made
        look_ahead : int              how many missing cells a walk notes before it gives up

    of which the first has room only while rays are traced. All threads share it: each writes the
    same 1, so it does not matter who is first.
    """

    @abc.abstractmethod
    def seeking(self, look_ahead: int) -> tuple[Any, np.ndarray]:
        """Return the arrays, with room for noting what is missing, and this room (n_cells,)."""

    @abc.abstractmethod
    def make_cells(self, wanted: np.ndarray, threads: int, progress: Progress) -> tuple[Any, int]:
        """Make cells, and return the arrays with them, and how many were made.

        What has been made meanwhile is not made again; arrays that others see are not changed.

        Parameters
        ----------
        wanted : (n_cells,) uint8

        Raises
        ------
        InputError
            When what is made does not fit into memory.
        Cancelled
            From `progress`.
        """

    def _trace_all(
        self,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays, make what they miss, and trace those again, until none misses anything."""
        return self._trace_looking(1, rays, order, threads, progress)

    def _trace_looking(
        self,
        look_ahead: int,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Do the same with walks that go on for some missing cells."""
        arrays, wanted = self.seeking(look_ahead)
        out = self._trace_through(arrays, rays, order, threads, progress)
        is_waiting = out[1] == MISSING
        waiting = np.flatnonzero(is_waiting) if order is None else order[is_waiting[order]]
        if len(waiting):
            if not wanted.any():
                raise RuntimeError(f"{self.name}: rays miss cells and name none; please report it")
            self._make(wanted, threads, progress)
            # In workspaces of its own: mailboxes that know of the last pass would lose hits.
            left = taken(rays, waiting)
            traced = self._trace_looking(2 * look_ahead, left, None, threads, Again(progress))
            for all_rays, some in zip(out, traced, strict=True):
                all_rays[waiting] = some
        return out

    def _make(self, wanted: np.ndarray, threads: int, progress: Progress) -> None:
        """Make cells, and keep them and the time that took."""
        with self.making.lock:
            start = time.perf_counter()
            arrays, count = self.make_cells(wanted, threads, progress)
            self._keep(arrays, count, time.perf_counter() - start)
