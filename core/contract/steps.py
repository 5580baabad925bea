"""The step log: what a walk did, event by event.

One kernel counts and records. It calls :func:`note` at every event; for a batch the log has no room
and nothing is written, for one ray it has. So what a student watches is exactly what the counters
counted: :func:`tally` turns a log back into counters, and a test compares the two.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..kernels import inner

VISIT_INNER = np.int64(0)
"""An inner node is entered (popped)."""
VISIT_LEAF = np.int64(1)
"""A leaf or elementary cell with primitives is entered."""
VISIT_EMPTY = np.int64(2)
"""An empty leaf or elementary cell is entered."""
VOLUME_TEST = np.int64(3)
"""A bounding volume is tested; t_enter is inf for a miss."""
TEST = np.int64(4)
"""A primitive is tested; t_enter is inf for a miss."""
MAILBOX = np.int64(5)
"""A primitive is skipped: this ray has met it before."""
HIT = np.int64(6)
"""The nearest hit so far changes to this primitive."""
POSTPONE = np.int64(7)
"""The nearest hit lies beyond the current cell: it is kept, not accepted yet."""
SKIP = np.int64(8)
"""A cell on the stack is thrown away: a nearer hit was found meanwhile."""
LEAP = np.int64(9)
"""Cells are passed in one step, or not needed any more; `primitive` is how many."""

NONE = np.int64(-1)
"""In the place of a cell or primitive: there is none. Not the plain -1, for which Numba would
compile :func:`note` once more."""

KIND_NAMES = (
    "visit inner", "visit leaf", "visit empty", "volume test", "test", "mailbox", "hit",
    "postpone", "skip", "leap",
)  # fmt: skip

COUNTER_NAMES = (
    "N_TS", "N_ETS", "N_EETS", "N_IT", "volume_tests", "mailbox_hits", "postponed_hits",
    "cells_skipped",
)  # fmt: skip
"""Counters of one ray, in the order of their columns.

N_TS traversal steps (cells entered), N_ETS elementary cells or leaves among them, N_EETS empty
ones among those, N_IT primitive tests, bounding volume tests, tests saved by the mailbox, hits
postponed since they lay beyond the cell, steps saved: by macro-cells, or by the early end of a
sorted list.
"""

# Columns of the log.
_KIND, _CELL, _PRIMITIVE, _T_ENTER, _T_EXIT = range(5)


class Log(NamedTuple):
    """Room for events: `rows` is (capacity, 5) float64, `written` is (1,) int64."""

    rows: np.ndarray
    written: np.ndarray


def make_log(capacity: int) -> Log:
    """Return an empty log; capacity 0 is for batches."""
    return Log(np.zeros((capacity, 5)), np.zeros(1, dtype=np.int64))


@inner
def note(log, kind, cell, primitive, t_enter, t_exit):
    """Write an event if there is room; count it if the log has any room at all."""
    capacity = log.rows.shape[0]
    if capacity == 0:
        return
    index = log.written[0]
    if index < capacity:
        row = log.rows[index]
        row[_KIND] = kind
        row[_CELL] = cell
        row[_PRIMITIVE] = primitive
        row[_T_ENTER] = t_enter
        row[_T_EXIT] = t_exit
    log.written[0] = index + 1


@dataclass(frozen=True)
class Steps:
    """The recorded walk of one ray.

    Attributes
    ----------
    kind : (n,) int32
        One of VISIT_INNER ... LEAP.
    cell : (n,) int32
        Cell or node number, as in :class:`.structure.Cells`; -1 where there is none.
    primitive : (n,) int32
        Triangle index in the scene; -1 where there is none. For LEAP the number of cells.
    t_enter, t_exit : (n,) float64
        Ray parameters: of the cell for visits, of the hit for tests (inf for a miss).
    """

    kind: np.ndarray
    cell: np.ndarray
    primitive: np.ndarray
    t_enter: np.ndarray
    t_exit: np.ndarray

    @classmethod
    def from_log(cls, log: Log) -> Steps:
        """Unpack the rows that were written."""
        rows = log.rows[: log.written[0]]
        whole = rows[:, : _PRIMITIVE + 1].astype(np.int32)
        return cls(
            whole[:, _KIND], whole[:, _CELL], whole[:, _PRIMITIVE],
            rows[:, _T_ENTER].copy(), rows[:, _T_EXIT].copy(),
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
        n = [len(events) for events in self._by_kind]
        leaves = int(n[VISIT_LEAF] + n[VISIT_EMPTY])
        values = (
            int(n[VISIT_INNER]) + leaves, leaves, int(n[VISIT_EMPTY]),
            int(n[TEST]), int(n[VOLUME_TEST]), int(n[MAILBOX]), int(n[POSTPONE]),
            int(self.primitive[self.events_of(LEAP)].sum()),
        )  # fmt: skip
        return dict(zip(COUNTER_NAMES, values, strict=True))
