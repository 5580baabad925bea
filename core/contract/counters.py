"""Counters: what the walk of a ray counts, and which events of the log those are.

A structure declares its own in ``Structure.COUNTERS``; the walk returns their values in that order
(:class:`.walk.Found`). Records, tables, the panel, pages and documents take names, labels and
meanings from there. V. Havran's names, where he has one: Heuristic Ray Shooting Algorithms, PhD
thesis, Czech Technical University, 2000.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .events import (
    ENTER,
    IN_VAIN,
    JUMP,
    MAILBOX,
    MASKED,
    POSTPONE,
    STRANGER,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
    VOLUME_TEST,
)


class Counter(NamedTuple):
    """One counter of a ray.

    Attributes
    ----------
    name : str
        In records and files of hits.
    label : str
        For people, with the name where the field knows it.
    meaning : str
        One sentence without a full stop.
    events : tuple of int
        The kinds of events it counts.
    is_sum : bool
        Each event counts as many as it has in the place of its primitive, not as one.
    column : str
        Title of its column in tables; without one it has none.
    level : int
        Of the cells and items whose events it counts: 0 but within instances.
    """

    name: str
    label: str
    meaning: str
    events: tuple[int | np.integer, ...]
    is_sum: bool = False
    column: str = ""
    level: int = 0


N_TS = Counter(
    "N_TS", "N_TS steps", "traversal steps: cells or nodes entered",
    (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY), column="N_TS",
)  # fmt: skip
N_ETS = Counter(
    "N_ETS", "N_ETS leaves", "leaves or elementary cells among them", (VISIT_LEAF, VISIT_EMPTY),
    column="N_ETS",
)  # fmt: skip
N_EETS = Counter("N_EETS", "N_EETS empty leaves", "empty ones among those", (VISIT_EMPTY,))
N_IT = Counter("N_IT", "N_IT triangle tests", "ray-triangle tests", (TEST,), column="N_IT")
VOLUME_TESTS = Counter(
    "volume_tests", "Volume tests", "tests of bounding volumes", (VOLUME_TEST,)
)  # fmt: skip
MAILBOX_HITS = Counter(
    "mailbox_hits", "Mailbox hits", "tests that the mailbox saved", (MAILBOX,)
)  # fmt: skip
POSTPONED_HITS = Counter(
    "postponed_hits", "Postponed hits", "hits kept for a later cell, in which they lie", (POSTPONE,)
)
CELLS_SKIPPED = Counter(
    "cells_skipped", "Cells skipped",
    "cells passed in the steps of others, or not needed any more", (JUMP,), is_sum=True,
)  # fmt: skip
STRANGERS = Counter(
    "strangers", "Strangers", "rays that cells do not know, tested against all items", (STRANGER,),
    column="strangers",
)  # fmt: skip


ENTERED = Counter(
    "instances_entered", "Instances entered", "instances whose boxes were met, and entered",
    (ENTER,), column="entered",
)  # fmt: skip
ENTERED_IN_VAIN = Counter(
    "entered_in_vain", "Entered in vain", "those among them in which nothing of use was hit",
    (IN_VAIN,), column="in vain",
)  # fmt: skip
MASKED_OUT = Counter(
    "masked_out", "Masked out", "instances passed by, for the ray's mask has no bit of theirs",
    (MASKED,),
)  # fmt: skip
OF_HIERARCHY = N_TS, N_ETS, N_IT, VOLUME_TESTS


def counters_within(
    levels: int, at_bottom: tuple[Counter, ...] = OF_HIERARCHY
) -> tuple[Counter, ...]:
    """Return what is counted of so many levels of instances, and in each of them.

    Parameters
    ----------
    at_bottom : tuple of Counter
        What is counted in the last level; all others are hierarchies.
    """
    of_instances = tuple(
        counter._replace(
            name=f"{counter.name}_{level}",
            label=f"{counter.label}, level {level}",
            meaning=f"{counter.meaning}, of those {level + 1} deep",
            level=level,
            column="",
        )
        if level
        else counter
        for level in range(levels)
        for counter in (ENTERED, ENTERED_IN_VAIN, MASKED_OUT)
    )
    return of_instances + tuple(
        counter._replace(
            name=f"{counter.name}_{level}",
            label=f"{counter.label}, level {level}",
            meaning=f"{counter.meaning}, in the meshes of instances {level} deep",
            level=level,
            column=f"{counter.column}_{level}" if counter.column else "",
        )
        for level in range(1, levels + 1)
        for counter in (at_bottom if level == levels else OF_HIERARCHY)
    )


@dataclass(frozen=True)
class Counts:
    """What was counted for the rays of a batch.

    Attributes
    ----------
    counters : tuple of Counter
        Those of the structure.
    values : (n, len(counters)) int32
    """

    counters: tuple[Counter, ...]
    values: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the counter of a name for every ray, (n,); KeyError for one there is not."""
        return self.values[:, names_of(self.counters).index(name)]

    def by_name(self) -> dict[str, np.ndarray]:
        """Return every counter for every ray, (n,), by name."""
        return {name: self[name] for name in names_of(self.counters)}

    def means(self) -> dict[str, float]:
        """Return the mean over all rays, by name."""
        # One after the other: of all at once NumPy adds few numbers at a time.
        return {
            counter.name: float(self.values[:, k].mean(dtype=np.float64))
            for k, counter in enumerate(self.counters)
        }


def names_of(counters: Sequence[Counter]) -> list[str]:
    """Return the names of counters."""
    return [counter.name for counter in counters]
