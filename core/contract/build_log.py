"""The build log: what a builder did, one event after the other, for whoever asks for it.

``Structure.build(..., log=True)`` keeps it, and :attr:`.structure.Structure.build_log` has it. Who
shows how a structure came about (a replay, planes, colours by step, lessons) reads it here and
runs no builder again. The log is the same for any number of threads.

An event is about a *node*: builders give each one a name, 0, 1, 2, ..., before anybody knows which
of them will be cells of the finished structure. :attr:`BuildLog.cells` has the cell of each name.
Nodes that are below a leaf in the end, or that a wide tree leaves out, have none.

======= ======================================================================================
SPLIT   A node was divided: its children are made.
MERGE   Two nodes were joined: the node above them is made.
INSERT  A primitive was put into the tree: its node is made.
MOVE    A node got other children in place of those it had.
REINSERT A node was cut off, and hung beside ``children[0]``; before, ``children[1]`` was its
        sibling. Its parent goes with it: there it is the parent of both, the node on the right,
        and where it was the old sibling takes its place.
FIT     The box of a node has changed, since something below it was moved.
======= ======================================================================================

A *step* is what a builder does at once: one split in the order of the settings, or breadth-first
where they say nothing; all splits of a level, or all mergers of a round, where the builder is a
parallel one by design; one triangle that is inserted; one pass of an optimiser. Steps count from 1,
and step 0 is what is there before.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..geometry.polygons import Polygons
from .cells import NEVER, planes_across, rectangles

SPLIT, MERGE, INSERT, MOVE, REINSERT, FIT = range(6)
KINDS = ("split", "merge", "insert", "move", "reinsert", "fit")
"""Their names, in that order."""

OBLIQUE = 3
"""The axis of a plane that is perpendicular to none."""


COLUMNS = ("kind", "step", "node", "children", "axis", "position", "cost", "counts")
"""What is said of every event."""


@dataclass(frozen=True)
class BuildLog:
    """The events of a building; k of them, about m nodes.

    Attributes
    ----------
    kind : (k,) int8
    step : (k,) int64
        Ascending.
    node : (k,) int32
        The name of the node that the event is about.
    children : (k, w) int32
        Names of what a split makes, a merger joins, a move hangs below the node, left before
        right, w of them at most, and -1 where there are fewer; see above for REINSERT.
    axis : (k,) int8
        Of the plane of a split; OBLIQUE, or -1 if there is no plane. A split into eight is three
        events of one step, one for each plane, with the same children.
    position : (k,) float64
        Of an axis-aligned plane, in scene units, otherwise NaN.
    cost : (k,) float64
        Of a split Cost(V -> {L, R}) = C_trav + C_isect (SA(L) N_L + SA(R) N_R) / SA(V); of a merger
        the surface area of the box around both; of a move or a reinsertion by how much the SAH cost
        falls, once for all moves that belong together. HLBVH reckons it above its treelets alone,
        and N is how many of those there are.

        NaN where the builder reckons none: splits by index, and those of LBVH, which follow from
        the codes; branches that are balanced since they are too deep; insertions, which compare by
        how much boxes grow, on every level anew.
    counts : (k, 2) int32
        References on both sides of a plane, or below the two that are joined; -1 if there is
        neither.
    cells : (m,) int32
        The number in the finished structure of the cell that each name stands for, -1 for none.
    boxes : (m, 6) float64, optional
        Of all nodes, where some that were divided are no cells: their planes lie in these boxes.
    leaves : (r,) int32, optional
        The name of the node that each of r references is by itself, in the order of the finished
        structure; where the log goes down to those: built from the bottom up, or rearranged.
    """

    kind: np.ndarray
    step: np.ndarray
    node: np.ndarray
    children: np.ndarray
    axis: np.ndarray
    position: np.ndarray
    cost: np.ndarray
    counts: np.ndarray
    cells: np.ndarray
    boxes: np.ndarray | None = None
    leaves: np.ndarray | None = None

    @classmethod
    def of(
        cls,
        kind: int,
        step: np.ndarray,
        node: np.ndarray,
        children: np.ndarray | None = None,
        *,
        axis: np.ndarray | None = None,
        position: np.ndarray | None = None,
        cost: np.ndarray | None = None,
        counts: np.ndarray | None = None,
        cells: np.ndarray,
    ) -> BuildLog:
        """Return events of one kind in the order of their steps; columns left out are empty.

        Of equal steps the order is that in which they are given.
        """
        k = len(step)
        order = np.argsort(step, kind="stable")
        columns: dict[str, tuple[type, np.ndarray]] = {
            "kind": (np.int8, np.full(k, kind)),
            "step": (np.int64, step),
            "node": (np.int32, node),
            "children": (np.int32, np.full((k, 2), -1) if children is None else children),
            "axis": (np.int8, np.full(k, -1) if axis is None else axis),
            "position": (np.float64, np.full(k, np.nan) if position is None else position),
            "cost": (np.float64, np.full(k, np.nan) if cost is None else cost),
            "counts": (np.int32, np.full((k, 2), -1) if counts is None else counts),
        }
        by_step: dict[str, Any] = {
            name: values[order].astype(t, copy=False) for name, (t, values) in columns.items()
        }
        return cls(**by_step, cells=np.asarray(cells, np.int32))

    def __len__(self) -> int:
        return len(self.kind)

    @property
    def last_step(self) -> int:
        """The last step of the building; 0 if nothing was done."""
        return int(self.step[-1]) if len(self) else 0

    @property
    def is_rearranged(self) -> bool:
        """Whether nodes were moved about after the tree was built."""
        return bool(np.isin(self.kind, (MOVE, REINSERT)).any())

    @property
    def is_bottom_up(self) -> bool:
        """Whether nodes were joined, not divided."""
        return bool((self.kind == MERGE).any())

    def with_cells(self, cells: np.ndarray) -> BuildLog:
        """Return the log with other cells: `cells` by the numbers that names have had so far."""
        known = self.cells >= 0
        moved = np.full(len(self.cells), -1, np.int32)
        moved[known] = cells[self.cells[known]]
        return replace(self, cells=moved)

    def renamed(self, names: np.ndarray) -> BuildLog:
        """Return the log with other names for the same nodes, (m,), each of them once."""
        children = np.where(self.children >= 0, names[self.children], -1).astype(np.int32)
        cells = np.empty_like(self.cells)
        cells[names] = self.cells
        return replace(self, node=names[self.node].astype(np.int32), children=children, cells=cells)

    def with_events(self, *others: BuildLog) -> BuildLog:
        """Return these events and others behind them, which go on with the same or later steps.

        Cells and leaves are those of this log; names have to be the same in all.
        """
        parts = (self, *others)
        return replace(
            self,
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in COLUMNS},
        )

    def merged_with(self, other: BuildLog) -> BuildLog:
        """Return the events of both in the order of their steps, of equal ones these first."""
        both = self.with_events(other)
        order = np.argsort(both.step, kind="stable")
        return replace(both, **{name: getattr(both, name)[order] for name in COLUMNS})

    def then(self, other: BuildLog) -> BuildLog:
        """Return these events and what was done afterwards, whose steps count on from here."""
        return self.with_events(replace(other, step=other.step + self.last_step))

    def steps(self, parent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return when every cell was made, and when others took its place.

        Those that a tree from the top down has are replaced by their children, and those of one
        from the bottom up by their parents. In every step, what is made and not yet replaced are
        the leaves of a tree under construction, or the clusters that are left.

        Parameters
        ----------
        parent : (n,) int
            The cell above every cell, -1 for the root.

        Returns
        -------
        made : (n,) int64
            The step from which on it is there as in the finished structure: with the box that it
            has in the end.
        replaced : (n,) int64
            NEVER for those that nothing replaces; not before `made`.
        """
        by_name = np.zeros(len(self.cells), np.int64)
        is_split = self.kind == SPLIT
        for column in self.children.T:
            there = is_split & (column >= 0)
            by_name[column[there]] = self.step[there]
        makes = np.isin(self.kind, (MERGE, INSERT, FIT))
        np.maximum.at(by_name, self.node[makes], self.step[makes])
        made = np.zeros(len(parent), np.int64)
        known = self.cells >= 0
        made[self.cells[known]] = by_name[known]

        replaced = np.full(len(parent), NEVER)
        below = np.flatnonzero(parent >= 0)
        if self.is_bottom_up:
            replaced[below] = made[parent[below]]
        else:
            last_child = np.full(len(parent), -1)
            np.maximum.at(last_child, parent[below], made[below])
            inner = np.flatnonzero(last_child >= 0)
            replaced[inner] = last_child[inner]
        return made, np.maximum(made, replaced)

    def split_of(self, cell: int) -> int | None:
        """Return the event that divided a cell, the first of several; None if there is none."""
        events = np.flatnonzero((self.kind == SPLIT) & (self.cells[self.node] == cell))
        return int(events[0]) if len(events) else None

    def has_planes(self) -> bool:
        """Say whether the cells are those that were divided; perhaps not one of them was."""
        return not self.is_rearranged and not self.is_bottom_up

    def planes(self, boxes: np.ndarray) -> Polygons:
        """Return the axis-aligned planes that divided cells, each clipped to the box of its cell.

        The plane of a node that is no cell belongs to the cell that the node lies in.

        Parameters
        ----------
        boxes : (n, 6) float64
            Of the cells, by their numbers; these are the owners.
        """
        cuts = (self.kind == SPLIT) & (self.axis >= 0) & (self.axis < OBLIQUE)
        if self.boxes is None:
            cuts &= self.cells[self.node] >= 0
        cuts = np.flatnonzero(cuts)
        node, owner = self.node[cuts], self.cells[self._nearest_cells()[self.node[cuts]]]
        around = boxes[owner]
        if self.boxes is not None:
            is_none = self.cells[node] < 0
            around[is_none] = self.boxes[node[is_none]]
        corners = np.empty((len(cuts), 4, 3))
        for axis in range(3):
            there = np.flatnonzero(self.axis[cuts] == axis)
            box = around[there]
            # Rounding may have put a plane between equal numbers a little outside.
            position = np.clip(self.position[cuts[there]], box[:, axis], box[:, 3 + axis])
            corners[there] = planes_across(box, axis, position)
        return rectangles(corners, owner)

    def _nearest_cells(self) -> np.ndarray:
        """Return of every name that which stands for the cell it lies in, (m,), after splits."""
        nearest = np.arange(len(self.cells))
        above = nearest.copy()
        is_split = self.kind == SPLIT
        for column in self.children.T:
            there = is_split & (column >= 0)
            above[column[there]] = self.node[there]
        while (outside := self.cells[nearest] < 0).any():
            higher = above[nearest[outside]]
            if np.array_equal(higher, nearest[outside]):
                break  # these lie in none
            nearest[outside] = higher
        return nearest
