"""General BSP tree: a cell is cut by one plane of any orientation, again and again.

Cells are convex polyhedra (:mod:`.polyhedron`), and the surface area heuristic reckons with their
true areas. Who decides where the planes go is :mod:`.planes`; triangles and polygons are cut at
them, so that a leaf lists only what reaches into it (:mod:`.references`); other items are seen as
hulls (:mod:`...geometry.shapes`). The tree (:mod:`.storage`) is walked like a kd-tree
(:mod:`..subdivision.walks`), with an inner product instead of a coordinate. All planes are walked
alike, so C_trav is the same for all.

There are no links to neighbours here: a face of a cell may have any number of corners and touch
cells across any number of planes, and a march that stood at a face would have to find out which
face that is. Marching starts from the root instead, where the planes on the way down tell it.

K. Sung, P. Shirley: Ray Tracing with the BSP Tree, Graphics Gems III, 1992.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...contract.build_log import OBLIQUE, SPLIT, BuildLog
from ...contract.cells import Cells, parents_of
from ...contract.costs import intersection_cost, traversal_cost
from ...contract.figures import Figure
from ...geometry.shapes import areas_and_lengths, shapes_of
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...settings import setting
from ..subdivision.frontier import NO_BUDGET, ORDERS, budget_setting, order_setting
from ..subdivision.settings import (
    depth_limit,
    depth_setting,
    duplication_setting,
    empty_bonus_setting,
    leaf_size_setting,
    mailbox_setting,
    most_references,
    padding_setting,
    walk_setting,
)
from ..subdivision.structure import FIGURES, Subdivision, Topology, padded_box, split_costs
from ..subdivision.subtrees import Limits
from ..subdivision.walks import WALKS
from .build import grow_tree
from .cells import Measures, measured, polygons
from .grown import Grown
from .parts import Parts, covered_areas, parts_in_leaves
from .planes import Autopartition, Heuristic, directions_of
from .storage import BspArrays, BspMarch

SHELL = 2.0**-42
"""Distance from a plane within which a point counts as on it, relative to the coordinates: 1024
units in the last place, several times what sixty cuts may add up to."""


DUPLICATION = 16
"""References per triangle that a tree has at most by default. On scans, interiors and a machine
there are 2.1 to 2.8 under the heuristic, and the SAH cost is that without a limit; leaves of a tree
get 7, bundles of slanting needles 11 to 13."""


@dataclass(frozen=True)
class BspSettings:
    """Settings of the BSP tree."""

    planes: str = setting(
        "sah",
        "Planes",
        "Which planes may cut a cell",
        choices={
            "autopartition": "Those of triangles: of some, the one that cuts the fewest",
            "sah": "Across the axes, of triangles and through their edges, whichever costs least",
            "fixed": "Across a fixed set of directions, where it costs least (RBSP)",
        },
    )
    directions: str = setting(
        "7",
        "Directions",
        "Normals of the planes",
        choices={
            "3": "The axes, as in a kd-tree",
            "7": "Axes and diagonals of the cube (14-DOP)",
            "9": "Axes and diagonals of its faces (18-DOP)",
            "13": "All of these (26-DOP)",
        },
        only_for={"planes": ("fixed",)},
    )
    candidates: int = setting(
        32,
        "Candidates",
        "Oblique planes that are tried per cell",
        unit="planes",
        minimum=1,
        maximum=100_000,
        only_for={"planes": ("sah", "autopartition")},
    )
    walk: str = walk_setting(without=("neighbours",))
    max_depth: int = depth_setting()
    max_leaf_size: int = leaf_size_setting(8)
    duplication: float = duplication_setting(DUPLICATION)
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()
    # Less than for a kd-tree: some oblique plane always cuts off one more empty corner.
    empty_bonus: float = empty_bonus_setting(0.1, ("sah", "fixed"))
    budget: int = budget_setting()
    order: str = order_setting()
    mailbox: bool = mailbox_setting()
    padding: float = padding_setting()


class Bsp(Subdivision):
    """Binary subdivision of space by planes of any orientation."""

    name = "bsp"
    label = "BSP Tree"
    summary = "Binary tree of convex cells, cut by planes of any orientation"
    Settings = BspSettings
    FIGURES = (
        *FIGURES,
        Figure("oblique_planes", "planes across no axis", "Oblique planes", "count"),
        Figure("faces_per_leaf", "faces of a leaf's cell, in the mean", "Faces per leaf"),
    )

    def __init__(
        self, scene: Scene, settings: BspSettings, grown: Grown, items: Any,
        box: np.ndarray, shell: float, log: bool = False,
    ) -> None:  # fmt: skip
        super().__init__(scene, settings, None, items, Bsp.logged if log else None)
        self.grown = grown
        self.with_walk(
            BspArrays(box, grown.planes, grown.link, shell, grown.offsets, grown.references)
        )

    @classmethod
    def build(
        cls, scene: Scene, settings: BspSettings, progress: Progress = SILENT, *, log: bool = False
    ) -> Bsp:
        """Build the tree, then prepare its walk."""
        refuse_if_too_large(len(scene) * 900, f"a bsp over {scene.counted}", "use a smaller scene")
        items = scene.items()
        box = padded_box(scene.lower, scene.upper, settings.padding)
        shell = SHELL * float(np.abs(box).max())
        limits = Limits(
            depth_limit(settings.max_depth, len(scene)),
            settings.max_leaf_size,
            settings.budget or NO_BUDGET,
            most_references(settings.duplication, settings.max_depth, len(scene), DUPLICATION),
            ORDERS[settings.order],
            0,
        )
        grown = grow_tree(rule_of(settings), limits, shapes_of(items, shell), box, shell, progress)
        return cls(scene, settings, grown, items, box, shell, log)

    def with_walk(self, tree: Any) -> None:
        """Set :attr:`arrays` to the tree with the walk of the settings."""
        record = BspMarch if self.settings.walk == "march" else WALKS[self.settings.walk]
        self.arrays = record(tree, self.settings.mailbox)

    def measures(self, progress: Progress = SILENT) -> Measures:
        """Return areas, volumes and boxes of all cells."""
        tree = self.arrays.tree
        return measured(self.grown, tree.box, tree.shell, progress)

    def topology(self) -> Topology:
        """Return the nodes; the boxes are those around the cells."""
        return self._topology_with(self.measures())

    def _topology_with(self, measures: Measures) -> Topology:
        """Return the nodes, of which the measures are known."""
        grown = self.grown
        is_leaf = grown.link < 0
        leaves = np.empty(len(grown.offsets) - 1, np.int64)
        leaves[-1 - grown.link[is_leaf]] = np.flatnonzero(is_leaf)
        count = np.zeros(len(grown.link), np.int32)
        count[leaves] = np.diff(grown.offsets)
        return Topology(measures.boxes, grown.depth.astype(np.int64), is_leaf, count, leaves)

    def areas(self, nodes: Topology) -> np.ndarray:
        """Return the true surface areas of the cells."""
        return self.grown.area

    def volumes(self, nodes: Topology) -> np.ndarray:
        """Return the true volumes of the cells."""
        return self.measures().volumes

    def lists_what_is_apart(self, nodes: Topology, leaf_of: np.ndarray) -> bool:
        """Return False: boxes do not tell, planes do (:meth:`validate`).

        The corner of two planes that are nearly parallel moves far when they move by a shell.
        """
        return False

    def gaps(self) -> float:
        """Return what the shells of all cuts may hold."""
        return self.arrays.tree.shell * float(self.grown.area[self.grown.link > 0].sum())

    def parts(self) -> Parts:
        """Return what the planes have made of the items: their parts, leaf after leaf."""
        tree = self.arrays.tree
        return parts_in_leaves(self.grown, shapes_of(self.geometry, tree.shell), tree.shell)

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the cells of all nodes as polyhedra, with the planes that cut them."""
        measures, tree = self.measures(progress), self.arrays.tree
        nodes = self._topology_with(measures)
        faces, cuts = polygons(self.grown, tree.box, tree.shell, measures, progress)
        inner = np.flatnonzero(self.grown.link > 0)
        children = self.grown.link[inner][:, None] + np.arange(2)
        parent = parents_of(len(nodes.depth), inner, children)
        steps, replaced = self.steps_of_cells(parent)
        return Cells.sorted_by_depth(
            nodes.boxes, nodes.depth, nodes.is_leaf, nodes.count,
            {**steps, "faces": measures.faces, "volume": measures.volumes},
            faces, cuts, measures.areas, replaced, parent, progress,
        )  # fmt: skip

    def logged(self) -> BuildLog:
        """Return the log of the building: nodes are numbered in the order of the settings."""
        grown, inner = self.grown, np.flatnonzero(self.grown.link > 0)
        children = grown.link[inner][:, None] + np.arange(2)
        normals = grown.planes[inner, :3]
        is_oblique = (normals != 0.0).sum(axis=1) > 1
        axis = np.abs(normals).argmax(axis=1)
        # The position along a normal of -1 is that on the other side of the origin.
        position = grown.planes[inner, 3] * np.sign(normals[np.arange(len(inner)), axis])
        return BuildLog.of(
            SPLIT, (children[:, 0] + 1) // 2, inner, children,
            axis=np.where(is_oblique, OBLIQUE, axis),
            position=np.where(is_oblique, np.nan, position),
            cost=split_costs(grown.area, grown.count, inner, children, self.settings),
            counts=grown.count[children], cells=np.arange(len(grown.link)),
        )  # fmt: skip

    def extra_statistics(self) -> dict[str, Any]:
        """Return how many planes are oblique, and how many faces a leaf has."""
        grown = self.grown
        normals = grown.planes[grown.link > 0, :3]
        oblique = (normals != 0.0).sum(axis=1) > 1
        return {
            "oblique_planes": int(oblique.sum()),
            "faces_per_leaf": float(self.measures().faces[grown.link < 0].mean()),
        }

    def validate(self) -> list[str]:
        """Check the tree, its polyhedra, and that leaves which list a triangle cover all of it."""
        violations = super().validate()
        if violations:
            return violations
        tree, measures = self.arrays.tree, self.measures()
        if (measures.faces < 4).any():
            violations.append("a cell has no inside")
        rounding = 64 * tree.shell * float(np.sqrt(self.grown.area[0]))
        # A cell as thin as the shells of its planes has any area: planes that are nearly parallel
        # decide it, and a shell moves where they meet by the cell's own size.
        thick = measures.volumes > 64 * tree.shell * measures.areas
        reckoned = self.grown.area[thick]
        if not np.allclose(measures.areas[thick], reckoned, rtol=1e-6, atol=rounding):
            violations.append("the areas that the builder reckoned with are not those of the cells")
        shapes = shapes_of(self.geometry, tree.shell)
        areas, n_empty = covered_areas(self.grown, shapes, tree.shell)
        if n_empty:
            violations.append(
                f"{n_empty} times a leaf lists a triangle that does not reach into it"
            )
        whole, around = areas_and_lengths(shapes)
        # What lies in the shell of a plane may be on either side, all around the polygon.
        is_off = np.abs(areas - whole) > 1e-6 * whole + 8 * tree.shell * around
        if (is_off & shapes.is_cut).any():
            violations.append("the leaves that list a triangle do not cover it")
        return violations


def rule_of(settings: BspSettings) -> Heuristic | Autopartition:
    """Return what decides the planes."""
    if settings.planes == "autopartition":
        return Autopartition(settings.candidates)
    is_fixed = settings.planes == "fixed"
    return Heuristic(
        directions_of(int(settings.directions) if is_fixed else 3),
        0 if is_fixed else settings.candidates,
        settings.C_trav, settings.C_isect, 1.0 - settings.empty_bonus,
    )  # fmt: skip


STRUCTURE = Bsp
