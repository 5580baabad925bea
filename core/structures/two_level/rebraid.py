"""Partial re-braiding: where instances overlap, the top level is built over parts of them.

A ray that meets the boxes of several instances has to enter them all. So the builder of the top
level may *open* a reference: in the place of an instance's root come the two children of that node,
each with a box of its own, tighter than the one around both; then perhaps their children. Leaves of
the top level thus lead into the middle of bottom levels, and the split may go through an instance.

Nodes are opened before each split, those that are longer than a share of the node's own extent. For
that there is a budget of references, shared out between both sides by the number of references. No
more are opened below

- where all references are of one instance: its own tree has divided that already;
- where a few do not overlap: nothing is to be gained;
- where the budget is spent.

A reference that is a leaf of its tree cannot be opened. Leaves of the top level hold one reference
each: to try one costs the move of a ray, which the box of its own leaf may spare.

Whatever is opened, hits are the same, bit for bit. The test of an instance is the same from each of
its references: its own box, then a walk of the moved ray. Boxes of references lie around what is in
them in world space, with more room than moving a ray rounds; for rays from so far away that this is
not enough, nothing is pruned by what was found nearer (:mod:`.braided_walk`).

C. Benthin, S. Woop, I. Wald, A. Afra: Improved Two-Level BVHs using Partial Re-Braiding, HPG 2017.
How Embree does it: kernels/builders/heuristic_openmerge_array.h.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...contract.instances import Instances
from ...contract.workspace import STACK_SIZE
from ...geometry.instances import PADDING, Instanced, box_of, padding_of
from ...geometry.volume import EPS
from ...kernels import call
from ...progress import SILENT, Progress
from ...settings import setting
from ..bvh.topology.tree import Tree
from ..bvh.walks.binary_walk import Binary
from .braid_builder import BINS, Openable, References, Scratch, build_top
from .braided_walk import Braided, BraidedBoxes

ROOM = 4.0
"""By what the slack of volumes is multiplied, that a ray which is moved and back stays within."""

SIZES_AWAY = 16.0
"""How many sizes of the scene away rays may begin for which the boxes of references have room."""


@dataclass(frozen=True)
class RebraidSettings:
    """How the top level opens instances."""

    extent: float = setting(
        0.1, "Open Above",
        "What is longer than this share of a node, along its longest side, is opened",
        minimum=0.0, maximum=1.0,
    )  # fmt: skip
    budget: float = setting(
        2.0, "Budget", "References that the top level may have, for each instance", minimum=1.0
    )
    room: int = setting(
        1000, "Room", "References that it may have in any case, however few instances there are",
        minimum=0, maximum=100_000_000,
    )  # fmt: skip


@dataclass(frozen=True)
class Braid:
    """A top level over parts of instances.

    Attributes
    ----------
    tree : Tree
    references : References
        In the order of its leaves.
    volumes : BraidedBoxes
    opened : (k, 2) int32
        Instance and node in the forest of every reference that was opened.
    """

    tree: Tree
    references: References
    volumes: BraidedBoxes
    opened: np.ndarray

    def geometry(self, instances: Instances) -> Braided:
        """Return its references for walks."""
        return Braided(self.references.owner, instances.reach, self.references.node, instances)


def braided(
    geometry: Instanced,
    instances: Instances,
    settings: RebraidSettings,
    progress: Progress = SILENT,
) -> Braid:
    """Build a top level over instances, opening them where that pays.

    Parameters
    ----------
    instances : Instances
        In their own order, over a forest of binary trees of boxes.
    """
    progress.report(0, 1, "Re-braiding")
    count = len(geometry.ids)
    capacity = max(int(settings.budget * count), settings.room, count)
    references = References(
        np.empty((capacity, 6)), np.empty(capacity, np.int32), np.empty(capacity, np.int32)
    )
    references.boxes[:count] = geometry.boxes
    references.owner[:count] = np.arange(count)
    is_there = instances.mesh >= 0
    references.node[:count] = np.where(is_there, instances.roots[instances.mesh], -1)
    slack, room, padding = rooms(geometry, instances, is_there)
    forest: Binary = instances.forest
    of = Openable(
        np.ascontiguousarray(forest.volumes.boxes()), forest.first, forest.size,
        geometry.matrices, padding, instances.boxes.dtype == np.float32, settings.extent,
    )  # fmt: skip
    out = References(*(np.empty_like(array) for array in references))
    tree = Tree(
        np.empty((2 * capacity, 6)), np.empty(2 * capacity, np.int32),
        np.empty(2 * capacity, np.int32),
    )  # fmt: skip
    opened = np.empty((capacity, 2), np.int32)
    scratch = Scratch(
        np.empty((BINS + 1, 6)), np.empty(BINS, np.int64), np.empty(BINS), np.empty(6)
    )
    nodes, taken, n_opened = call(
        build_top, references, count, of, tree, out, opened, np.empty((STACK_SIZE, 6), np.int64),
        scratch,
    )  # fmt: skip
    tree = Tree(*(array[:nodes].copy() for array in tree))
    rows = tree.boxes.astype(np.float32) if of.is_single else tree.boxes
    progress.report(1, 1, "Re-braiding")
    return Braid(
        tree, References(*(array[:taken].copy() for array in out)),
        BraidedBoxes(rows, slack, room), opened[:n_opened].copy(),
    )  # fmt: skip


def rooms(
    geometry: Instanced, instances: Instances, is_there: np.ndarray
) -> tuple[float, float, np.ndarray]:
    """Return what :class:`BraidedBoxes` has to know, and the padding of each instance, (n,).

    Moving a ray rounds it in proportion to how far away it begins, and the more, the worse the
    matrix is conditioned; in proportion, too, to how far the mesh is moved. Where even rays from
    nearby would be rounded by more than boxes are enlarged, an instance is not opened: its padding
    is -1.
    """
    local = np.array([box_of(mesh) for mesh in geometry.meshes])
    padding = padding_of(local[geometry.which], geometry.matrices)
    reach = float(geometry.reach.sum())
    with np.errstate(all="ignore"):
        forth = np.abs(geometry.matrices[:, :, :3]).sum(axis=2).max(axis=1)
        back = np.abs(instances.to_object[:, :, :3]).sum(axis=2).max(axis=1)
        slack = ROOM * forth * back * (1.0 + padding / PADDING / reach)
        can = is_there & (64.0 * EPS * slack * SIZES_AWAY * reach <= padding)
    if not can.any():
        return ROOM, np.inf, np.full(len(padding), -1.0)
    return float(slack[can].max()), float(padding[can].min()), np.where(can, padding, -1.0)
