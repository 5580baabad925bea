"""The steps of one ray: its log, unpacked."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from .counters import Counter
from .events import CELL, KIND, KIND_NAMES, LEVEL, N_EVENTS, PRIMITIVE, T_ENTER, T_EXIT, Log


@dataclass(frozen=True)
class Steps:
    """The recorded walk of one ray.

    Attributes
    ----------
    kind : (n,) int32
        One of VISIT_INNER ... MASKED.
    cell : (n,) int32
        Cell or node number, as in :class:`.structure.Cells`; -1 where there is none.
    primitive : (n,) int32
        Triangle index in the scene; -1 where there is none. For JUMP the number of cells.
    t_enter, t_exit : (n,) float64
        Ray parameters: of the cell for visits, of the hit for tests (inf for a miss).
    level : (n,) int32
        Of the structure that `cell` is of: 0 but within another.
    counters : tuple of Counter
        Those of the structure.
    """

    kind: np.ndarray
    cell: np.ndarray
    primitive: np.ndarray
    t_enter: np.ndarray
    t_exit: np.ndarray
    level: np.ndarray
    counters: tuple[Counter, ...]

    @classmethod
    def from_log(cls, log: Log, counters: tuple[Counter, ...]) -> Steps:
        """Unpack the rows that were written."""
        rows = log.rows[: log.written[N_EVENTS]]
        whole = rows[:, : PRIMITIVE + 1].astype(np.int32)
        return cls(
            whole[:, KIND], whole[:, CELL], whole[:, PRIMITIVE],
            rows[:, T_ENTER].copy(), rows[:, T_EXIT].copy(),
            rows[:, LEVEL].astype(np.int32), counters,
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.kind)

    @functools.cached_property
    def _by_kind(self) -> list[np.ndarray]:
        """Numbers of the events of each kind."""
        return [np.flatnonzero(self.kind == kind) for kind in range(len(KIND_NAMES))]

    def events_of(self, kind: int | np.integer, event: int | None = None) -> np.ndarray:
        """Return the numbers of all events of a kind, ascending; of those up to an event only."""
        events = self._by_kind[kind]
        if event is None:
            return events
        return events[: np.searchsorted(events, event, side="right")]

    def tally(self) -> dict[str, int]:
        """Count the events: the counters this walk must have had, by name."""
        return {counter.name: self._count(counter) for counter in self.counters}

    def _count(self, counter: Counter) -> int:
        """Return the value of one counter."""
        events = [self._by_kind[kind] for kind in counter.events]
        events = [each[self.level[each] == counter.level] for each in events]
        if counter.is_sum:
            return sum(int(self.primitive[each].sum()) for each in events)
        return sum(len(each) for each in events)
