"""Events: what a walk writes into its log, one after the other.

One kernel counts and records. It calls :func:`note` at every event; for a batch there is no log
(:class:`NoLog`) and nothing is written, for one ray there is. So what a student watches is exactly
what the counters counted (:mod:`.counters`), and a test compares the two.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry.instances import MOST_LEVELS
from ..kernels import dispatched, implements, whole

VISIT_INNER = whole(0)
"""An inner node is entered (popped)."""
VISIT_LEAF = whole(1)
"""A leaf or elementary cell with primitives is entered."""
VISIT_EMPTY = whole(2)
"""An empty leaf or elementary cell is entered."""
VOLUME_TEST = whole(3)
"""A bounding volume is tested; t_enter is inf for a miss."""
TEST = whole(4)
"""A primitive is tested; t_enter is inf for a miss."""
MAILBOX = whole(5)
"""A primitive is skipped: this ray has met it before."""
HIT = whole(6)
"""The nearest hit so far changes to this primitive."""
POSTPONE = whole(7)
"""The nearest hit lies beyond the current cell: it is kept, not accepted yet."""
SKIP = whole(8)
"""A cell on the stack is thrown away: a nearer hit was found meanwhile."""
JUMP = whole(9)
"""Cells are passed in one step, or not needed any more; `primitive` is how many."""
COVER = whole(10)
"""The ray goes on behind an item that covers its whole cell, which is asked first."""
RECALL = whole(11)
"""The item that a ray like this one has hit before is asked first."""
OVERLOOK = whole(12)
"""The ray is blocked by an item that was not drawn into its cell."""
STRANGER = whole(13)
"""The structure knows nothing of such a ray: all items are tested."""
ENTER = whole(15)
"""The ray is moved into the space of an instance, whose box it has met; a walk there follows."""
IN_VAIN = whole(16)
"""That walk has come back without a hit."""
MASKED = whole(17)
"""An instance is passed by: its mask has no bit in common with the ray's."""

WITHIN = whole(14)
"""The line of the ray is inside of a node of a CSG tree, from the surface `primitive` on."""

NONE = whole(-1)
"""In the place of a cell or primitive: there is none."""

KIND_NAMES = (
    "visit inner", "visit leaf", "visit empty", "volume test", "test", "mailbox", "hit",
    "postpone", "skip", "jump", "cover", "recall", "overlook", "stranger", "within", "enter",
    "in vain", "masked",
)  # fmt: skip

# Places in `Log.written`.
N_EVENTS, LEVEL_NOW, COUNTS = range(3)
ENTERED_NOW, IN_VAIN_NOW, MASKED_NOW = range(3)
COUNTS_OF_INSTANCES = 3
"""What is counted of the instances that a level is made of."""
COUNTS_OF_LEVEL = 4
"""What is counted of a level within: what the walk of a hierarchy counts."""
MOST_COUNTS = 12
"""What may be counted in the last one, which need be no hierarchy."""
WRITTEN = COUNTS + MOST_LEVELS * (COUNTS_OF_INSTANCES + COUNTS_OF_LEVEL) + MOST_COUNTS

# Columns of the log.
KIND, CELL, PRIMITIVE, T_ENTER, T_EXIT, LEVEL = range(6)


class Log(NamedTuple):
    """Room for events.

    Attributes
    ----------
    rows : (capacity, 6) float64
    written : (WRITTEN,) int64
        How many events there were (N_EVENTS), and the level that cells are of now (LEVEL_NOW): 0
        but in a structure within another, whose cells have numbers of their own. From COUNTS on,
        for the ray that is traced, what has been counted of the instances of each level, then what
        the walks in each level below have counted.
    """

    rows: np.ndarray
    written: np.ndarray


class NoLog(NamedTuple):
    """In the place of a log, for batches: nothing is noted.

    A type of its own, so that of a walk that is not recorded the compiler leaves out all notes. A
    log without room, which is asked at each, made the walk of a hierarchy 3 to 12% slower.

    Attributes
    ----------
    written : (WRITTEN,) int64
        As that of a :class:`Log`.
    """

    written: np.ndarray


def make_log(capacity: int) -> Log:
    """Return an empty log."""
    return Log(np.zeros((capacity, 6)), np.zeros(WRITTEN, np.int64))


def no_log() -> NoLog:
    """Return what takes the place of a log for a batch."""
    return NoLog(make_log(0).written)


@dispatched
def note(log, kind, cell, primitive, t_enter, t_exit):
    """Write an event, if there is a log."""
    raise TypeError(f"no log is a {type(log).__name__}")


@implements(note, Log)
def write_event(log, kind, cell, primitive, t_enter, t_exit):
    """Write it if there is room left, and count it."""
    index = log.written[N_EVENTS]
    if index < log.rows.shape[0]:
        row = log.rows[index]
        row[KIND] = kind
        row[CELL] = cell
        row[PRIMITIVE] = primitive
        row[T_ENTER] = t_enter
        row[T_EXIT] = t_exit
        row[LEVEL] = log.written[LEVEL_NOW]
    log.written[N_EVENTS] = index + 1


@implements(note, NoLog, inline=True)
def write_nothing(log, kind, cell, primitive, t_enter, t_exit):
    """Do nothing."""
