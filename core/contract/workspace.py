"""The workspace of a walk: scratch memory of one thread, of one kind for every structure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..geometry.volume import MOST_STRIPS
from ..kernels import dispatched, implements

STACK_SIZE = 128
"""Cells a walk can remember; no hierarchy grows deeper (see MAXIMUM_DEPTH)."""

MAXIMUM_DEPTH = 96
"""Depth at which every hierarchy stops splitting, whatever its settings."""

STACK_WITHIN = 8 * MAXIMUM_DEPTH
"""Cells that a walk within an instance can remember: a wide hierarchy puts seven aside a level."""


class Workspace(NamedTuple):
    """Scratch memory of one thread; what a structure has no use for has a single row.

    Few arrays, since every one makes every kernel that takes them slower to compile; numbers of
    nodes are exact in float64.

    Attributes
    ----------
    cells : (k,) int32
    enters : (k,) float64
        The stack of hierarchies: nodes still to visit and where the ray enters them. In other
        structures a list.
    frame : (MOST_STRIPS, 6) float64
        What of the ray is the same for all volumes (:func:`..geometry.volume.prepare`), or for all
        planes of a tree (:func:`..structures.subdivision.tree.enter_root`).
    stack : (k, 4) float64
        Of trees of cells: nodes put aside, as node, enter, exit, late.
    rows : (k, 7) float64
        What a walk of these keeps beside the stack: marching, the nodes from the root to the
        current one by depth, each with its cell; else the entries of a heap, or the segments of a
        ray.
    mailbox : (n + 1,) int32
        Number of the last ray that met each primitive; in the end, how many walks within instances
        there have been, each of which is another ray to a mailbox.
    """

    cells: np.ndarray
    enters: np.ndarray
    frame: np.ndarray
    stack: np.ndarray
    rows: np.ndarray
    mailbox: np.ndarray


def deepened(workspace: Workspace, levels: int) -> Workspace:
    """Return scratch memory with room for the walks within instances, so many levels deep."""
    if not levels:
        return workspace
    return workspace._replace(
        cells=np.empty(len(workspace.cells) + levels * STACK_WITHIN, np.int32),
        enters=np.empty(len(workspace.enters) + levels * STACK_WITHIN),
        frame=np.zeros((len(workspace.frame) + levels * MOST_STRIPS, 6)),
    )


@dispatched
def part_below(workspace, levels):
    """Return the part for walks within instances that lie so many levels deep."""
    raise TypeError(f"no part of {type(workspace).__name__}")


@implements(part_below, Workspace)
def last_part(workspace, levels):
    """Return the last rows: the first ones are in use by the walks around."""
    return Workspace(
        workspace.cells[-levels * STACK_WITHIN :], workspace.enters[-levels * STACK_WITHIN :],
        workspace.frame[-levels * MOST_STRIPS :], workspace.stack, workspace.rows,
        workspace.mailbox,
    )  # fmt: skip


def make_workspace(*, cells: int = 1, stack: int = 1, rows: int = 1, mailbox: int = 1) -> Workspace:
    """Return scratch memory for one thread, with so many rows of each."""
    return Workspace(
        np.empty(cells, np.int32), np.empty(cells), np.zeros((MOST_STRIPS, 6)),
        np.zeros((stack, 4)), np.zeros((rows, 7)), np.full(mailbox + 1, -1, np.int32),
    )  # fmt: skip
