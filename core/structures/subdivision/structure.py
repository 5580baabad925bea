"""What octree, kd-tree and BSP tree have in common: walks, cells, figures and checks."""

from __future__ import annotations

import abc
import copy
import dataclasses
import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from ...contract.figures import COST_OF_TREE, OF_TREE, Figure
from ...contract.statistics import Statistics
from ...contract.structure import Structure
from ...contract.workspace import Workspace, make_workspace
from ...geometry.box_shape import surface_area
from ...geometry.rays import ULPS
from ...progress import SILENT, Progress

# Imported for what they register: an implementation of `walk` for each of the records in WALKS.
from . import heap as heap
from . import march as march
from . import recursive as recursive
from . import segments as segments
from .ropes import link
from .tree import ROWS, STACK
from .walks import COUNTERS, WALKS, Ropes

if TYPE_CHECKING:
    from typing import Self


def padded_box(lower: np.ndarray, upper: np.ndarray, padding: float) -> np.ndarray:
    """Return the root's cell, (6,): the scene's box enlarged by a share of its size.

    A flat scene gets some thickness: a cell of zero volume has no inside to walk through.
    """
    size = upper - lower
    margin = np.where(size > 0.0, padding * size, max(padding, 1e-6) * size.max())
    return np.concatenate([lower - margin, upper + margin])


def split_costs(
    areas: np.ndarray,
    counts: np.ndarray,
    inner: np.ndarray,
    children: np.ndarray,
    settings: Any,
) -> np.ndarray:
    """Return Cost(V -> {L, R}) of splits, (k,) float64; NaN for cells without a surface.

    What the heuristic takes off where one side is empty is not taken off here.

    Parameters
    ----------
    areas, counts : (n,)
        Surface areas and references of all cells.
    inner : (k,) int
        Cells that are split,
    children : (k, w) int
        and what they are split into.
    """
    shares = (areas[children] * counts[children]).sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cost = settings.C_trav + settings.C_isect * shares / areas[inner]
    return np.where(areas[inner] > 0.0, cost, np.nan)


class Topology(NamedTuple):
    """The nodes of a tree, whatever stores it.

    Attributes
    ----------
    boxes : (n, 6) float64
    depth : (n,) int64
    is_leaf : (n,) bool
    count : (n,) int32
        References of a leaf; 0 for inner nodes.
    leaves : (n_leaves,) int64
        Node of every leaf index.
    """

    boxes: np.ndarray
    depth: np.ndarray
    is_leaf: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of that name
    leaves: np.ndarray


FIGURES = (
    *OF_TREE,
    Figure("duplication", "references per triangle", "References per triangle"),
    Figure("bytes_per_triangle", "bytes of the structure per triangle", "Bytes per triangle"),
    *COST_OF_TREE,
    Figure("expected_empty", "empty leaves that such a line meets"),
)


def walked(tree: Any, settings: Any, topology: Callable[[], Topology]) -> Any:
    """Return a tree with the walk of the settings; for stored links its topology is asked."""
    if settings.walk != "neighbours" or settings.links != "stored":
        return WALKS[settings.walk](tree, settings.mailbox)
    nodes = topology()
    boxes = np.ascontiguousarray(nodes.boxes[nodes.leaves])
    return Ropes(tree, settings.mailbox, link(tree, nodes.boxes, nodes.leaves), boxes)


class Subdivision(Structure):
    """An adaptive subdivision of space by axis-aligned planes.

    A subclass builds a tree (:mod:`.tree`) and hands it to :meth:`with_walk`; its settings have
    the fields `walk`, `links`, `mailbox`, C_trav and C_isect.
    """

    COUNTERS = COUNTERS
    FIGURES: ClassVar[tuple[Figure, ...]] = FIGURES

    @property
    def has_mailbox(self) -> bool:
        """Whether the walk needs a mailbox."""
        return self.settings.mailbox

    @abc.abstractmethod
    def topology(self) -> Topology:
        """Return the boxes of all nodes and what else a figure is made of."""

    def areas(self, nodes: Topology) -> np.ndarray:
        """Return the surface areas of all cells."""
        return surface_area(nodes.boxes)

    def volumes(self, nodes: Topology) -> np.ndarray:
        """Return the volumes of all cells."""
        return np.prod(nodes.boxes[:, 3:] - nodes.boxes[:, :3], axis=1)

    def gaps(self) -> float:
        """Return what volume there may be between neighbouring cells."""
        return 0.0

    def extra_statistics(self) -> dict[str, Any]:
        """Return figures of this structure only."""
        return {}

    def with_walk(self, tree: Any) -> None:
        """Set :attr:`arrays` to the tree with the walk of the settings."""
        self.arrays = WALKS[self.settings.walk](tree, self.settings.mailbox)
        self.arrays = walked(tree, self.settings, self.topology)

    def walked_by(self, walk: str, links: str = "found") -> Self:
        """Return the same tree with another walk; one of those that its settings offer."""
        other = copy.copy(self)
        other.settings = dataclasses.replace(self.settings, walk=walk, links=links)
        other.with_walk(self.arrays.tree)
        return other

    @property
    def ropes(self) -> np.ndarray:
        """The links of all leaves, (n_leaves, 6) int32, see :mod:`.ropes`."""
        if isinstance(self.arrays, Ropes):
            return self.arrays.ropes
        return self._found_ropes

    @functools.cached_property
    def _found_ropes(self) -> np.ndarray:
        """The same, where no walk uses them."""
        nodes = self.topology()
        return link(self.arrays.tree, nodes.boxes, nodes.leaves)

    def _workspace(self) -> Workspace:
        """Return scratch memory for one thread."""
        mailbox = len(self.scene) if self.has_mailbox else 1
        return make_workspace(stack=STACK, rows=ROWS, mailbox=mailbox)

    def steps_of_cells(self, parent: np.ndarray) -> tuple[dict[str, np.ndarray], np.ndarray | None]:
        """Return ``order`` and ``replaced`` of all nodes, see Cells; nothing without a log.

        Parameters
        ----------
        parent : (n,) int
            Of each node, -1 for the root.
        """
        if self.build_log is None:
            return {}, None
        made, replaced = self.build_log.steps(parent)
        return {"order": made}, replaced

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the tree."""
        nodes = self.topology()
        areas = self.areas(nodes)
        empty = areas[nodes.is_leaf & (nodes.count == 0)].sum()
        return Statistics.of_cells(
            areas, nodes.is_leaf, nodes.count, nodes.depth, float(areas[0]),
            self.settings.C_trav, self.settings.C_isect,
            {
                "duplication": len(self.arrays.tree.references) / len(self.scene),
                "expected_empty": float(empty / areas[0]),
                "bytes_per_triangle": self.memory() / len(self.scene),
                **self.extra_statistics(),
            },
        )  # fmt: skip

    def lists_what_is_apart(self, nodes: Topology, leaf_of: np.ndarray) -> bool:
        """Say whether a leaf lists a triangle whose box lies outside the leaf's.

        Parameters
        ----------
        leaf_of : (m,) int
            The leaf of each entry of the lists.
        """
        boxes = self.scene.boxes()[self.arrays.tree.references]
        leaves = nodes.boxes[nodes.leaves][leaf_of]
        tolerance = 8 * ULPS * self.geometry.reach
        apart = boxes[:, :3] > leaves[:, 3:] + tolerance
        apart |= boxes[:, 3:] < leaves[:, :3] - tolerance
        return bool(apart.any())

    def validate(self) -> list[str]:
        """Check the lists, and that leaves hold what overlaps them."""
        violations = []
        tree, nodes = self.arrays.tree, self.topology()
        offsets, references = tree.offsets, tree.references
        if offsets[0] != 0 or offsets[-1] != len(references) or (np.diff(offsets) < 0).any():
            return ["leaf offsets do not partition the references"]
        if len(np.unique(references)) != len(self.scene):
            violations.append("a triangle is in no leaf")
        leaf_of = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        if (np.diff(references)[leaf_of[1:] == leaf_of[:-1]] <= 0).any():
            violations.append("a leaf lists a triangle twice or out of order")
        if self.lists_what_is_apart(nodes, leaf_of):
            violations.append("a leaf lists a triangle whose box lies outside it")
        volume = self.volumes(nodes)[nodes.leaves].sum()
        whole = np.prod(tree.box[3:] - tree.box[:3])
        if not abs(volume - whole) <= 1e-9 * whole + self.gaps():
            violations.append("the leaves do not fill the root")
        return violations


class LinkedSubdivision(Subdivision):
    """One whose cells are boxes, so that a leaf has neighbours behind its faces."""

    def links(self, number: int) -> np.ndarray:
        """Return the nodes at the ends of a leaf's ropes, whether its walk uses them or not.

        Each is the smallest node that covers the whole face: a neighbour of the same size or
        larger, or an inner node where the other side is divided more finely. Faces in the border of
        the root have none, nor have inner nodes.
        """
        (index,) = np.nonzero(self.topology().leaves == number)
        if not len(index):
            return np.empty(0, dtype=np.int32)
        ropes = self.ropes[index[0]]
        return ropes[ropes >= 0]
