"""Two levels: a top-level structure (TLAS) over instances, a bottom-level one (BLAS) for each mesh.

The lecture on DXR: "Top-level AS are for animation (easy rebuild), bottom-level AS represent scene
geometry (trees over triangles), instance descriptor connects a BLAS to TLAS". A mesh that is in
many places is built once. When an object moves, only its box does, and the top level over a few
thousand boxes is built anew in milliseconds.

The top level is a hierarchy whose items are instances: to test one is to move the ray into the
space of its mesh and to walk there (:mod:`...contract.instances`). The bottom level may be any of
:data:`.settings.BOTTOMS`. Where instances overlap, the top level may be built over parts of them
(:mod:`.rebraid`).

Objects of a scene that holds no instances are instances, each in one place.

Microsoft: DirectX Raytracing (DXR) Functional Spec, 2018.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...contract.build_log import BuildLog
from ...contract.cells import Cells
from ...contract.counters import Counter, counters_within
from ...contract.instances import Instances
from ...contract.statistics import Statistics
from ...contract.structure import Structure, arrays_in
from ...contract.workspace import Workspace
from ...errors import InputError
from ...geometry.box import Boxes
from ...geometry.instances import Instanced, as_single, primitives_in, stored_in
from ...memory import refuse_if_too_large
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.placing import by_objects
from ...settings import part_of
from ..bvh import BVH
from ..bvh.forest import instances_of
from ..bvh.hierarchy import Making
from ..bvh.walks.binary_walk import Binary
from .bottoms import BottomLevels, unshared
from .braided_walk import Braided
from .figures import FIGURES, figures_of
from .rebraid import Braid, RebraidSettings, braided
from .settings import BOTTOMS, PARTIAL, TwoLevelSettings, settings_of_levels

BYTES_PER_INSTANCE = 700
"""Memory of an instance, or a reference to one, at the peak of a build."""


class TwoLevel(Structure):
    """A hierarchy over instances of meshes that have structures of their own.

    Attributes
    ----------
    tlas : BVH
        The top level; its cells are those of the whole.
    bottoms : list of (mesh, Structure)
        Those of the bottom levels, with their meshes.
    instances : Instances
        In the order of the leaves, or of the scene if they were re-braided.
    braid : Braid or None
        How the top level opened them.
    """

    name = "two_level"
    label = "Two Level"
    summary = "A top level over instances, and a bottom level for each mesh"
    Settings = TwoLevelSettings
    keeps_instances = True
    COUNTERS = BVH.COUNTERS
    FIGURES = FIGURES

    def __init__(
        self,
        scene: Scene,
        settings: Any,
        tlas: BVH,
        bottoms: Sequence[tuple[Any, Structure]],
        instances: Instances,
        braid: Braid | None = None,
    ) -> None:
        arrays: Any = tlas.arrays
        if braid is not None:
            arrays = arrays._replace(volumes=braid.volumes)
        elif isinstance(arrays.volumes, Boxes):
            arrays = arrays._replace(volumes=Boxes(as_single(arrays.volumes.rows)))
        super().__init__(scene, settings, arrays, tlas.geometry)
        self.tlas, self.bottoms, self.braid = tlas, list(bottoms), braid
        self.instances = instances

    # ------------------------------------------------------------------------------------ build

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: Any) -> None:
        """Refuse what would not fit into memory, before anything is compiled or allocated."""
        _, own = settings_of_levels(settings)
        kind = BOTTOMS[settings.blas]
        needed = kind.bytes_per_triangle(own) * stored_in(scene.geometry)
        geometry = scene.geometry
        if isinstance(geometry, Instanced):
            if not settings.shared:
                needed = kind.bytes_per_triangle(own) * primitives_in(geometry)
            references = len(scene)
            if settings.rebraid == PARTIAL:
                references = max(settings.budget * len(scene), settings.room)
            needed += BYTES_PER_INSTANCE * references
        refuse_if_too_large(
            int(needed), f"{cls.name} over {scene.counted}", "use a smaller scene, or shared=true"
        )

    @classmethod
    def build(
        cls, scene: Scene, settings: Any, progress: Progress = SILENT, *, log: bool = False
    ) -> TwoLevel:
        """Build the bottom levels, then the top level."""
        return cls._built(scene, settings, (), progress, log)

    @classmethod
    def _built(
        cls, scene: Scene, settings: Any, known: Sequence[Any], progress: Progress, log: bool
    ) -> TwoLevel:
        """Build over a scene; `known` are bottom levels that may be kept or follow."""
        cls.refuse_too_large(scene, settings)
        tlas_settings, own = settings_of_levels(settings)
        over = by_objects(scene)
        # As large as it was: rays start from its bounds, and every structure is sent the same.
        scene = dataclasses.replace(over, lower=scene.lower, upper=scene.upper)
        if not settings.shared:
            over = dataclasses.replace(over, geometry=unshared(over.geometry))
        bottom = BottomLevels(scene, BOTTOMS[settings.blas], own, known)
        if settings.rebraid == PARTIAL and settings.blas == BVH.name:
            return cls._braided(scene, over, settings, tlas_settings, bottom, progress)
        tlas = BVH.build(over, tlas_settings, progress, log=log, bottom=bottom)
        tlas.scene = scene
        return cls(scene, settings, tlas, bottom.made, tlas.geometry)

    @classmethod
    def _braided(
        cls,
        scene: Scene,
        over: Scene,
        settings: Any,
        tlas_settings: Any,
        bottom: BottomLevels,
        progress: Progress,
    ) -> TwoLevel:
        """Build with a top level that opens instances."""
        instances = instances_of(over.geometry, tlas_settings, progress, bottom)
        forest = instances.forest
        if not (isinstance(forest, Binary) and isinstance(forest.volumes, Boxes)):
            raise InputError(
                "re-braiding opens binary trees of boxes; leave volume and arity out of "
                "blas_settings, or choose rebraid=none"
            )
        own = part_of(settings, RebraidSettings)
        braid = braided(over.geometry, instances, own, progress)
        tree = braid.tree
        arrays = Binary(Boxes(braid.volumes.rows), tree.first, tree.size)
        tlas = BVH(scene, tlas_settings, arrays, braid.geometry(instances), making=Making(None, {}))
        return cls(scene, settings, tlas, bottom.made, instances, braid)

    def refitted(self, scene: Scene, progress: Progress = SILENT) -> TwoLevel:
        """Return the same over a scene whose instances have moved: the top level is built anew.

        Bottom levels are kept where the mesh is what it was; elsewhere a tree of volumes is
        refitted, and what is no such tree is built anew.

        Parameters
        ----------
        scene : Scene
            Instances of as many meshes, each with as many items.

        Raises
        ------
        InputError
            If they are others.
        Cancelled
            From `progress`.
        """
        scene = by_objects(scene)
        before, now = self.scene.geometry, scene.geometry
        if (
            len(before.ids) != len(now.ids)
            or not np.array_equal(before.which, now.which)
            or not np.array_equal(before.first, now.first)
        ):
            raise InputError(
                f"the two levels were built over {self.scene.counted}, now there are {len(scene)}, "
                "or of other meshes; a refit needs the same ones: build anew"
            )
        return self._built(scene, self.settings, self.bottoms, progress, False)

    def upper_boxes(self, levels: int) -> tuple[np.ndarray, np.ndarray]:
        """Return the boxes of the upper levels, (k, 6), and the depth of each, (k,)."""
        return self.tlas.upper_boxes(levels)

    # ---------------------------------------------------------------------------------- tracing

    @functools.cached_property
    def counters(self) -> tuple[Counter, ...]:
        """What is counted in the top level, of instances, and in each level below."""
        return (*self.COUNTERS, *counters_within(self.levels, BOTTOMS[self.settings.blas].COUNTERS))

    def _workspace(self) -> Workspace:
        """Return scratch memory for the walk of the top level, and of the largest mesh."""
        largest = max((structure for _, structure in self.bottoms), key=lambda s: len(s.scene))
        top, below = self.tlas._workspace(), largest._workspace()
        return below._replace(cells=top.cells, enters=top.enters)

    # ----------------------------------------------------------------------- what is known of it

    @property
    def build_log(self) -> BuildLog | None:
        """What the builder of the top level did."""
        return self.tlas.build_log

    @property
    def keeps_log(self) -> bool:
        """Whether there is a log of the top level."""
        return self.tlas.keeps_log

    def bottom_of(self, mesh: Any) -> Structure:
        """Return the structure of a mesh at the bottom."""
        return next(structure for known, structure in self.bottoms if known is mesh)

    def memory(self) -> int:
        """Return the bytes of both levels, and of what a walk has to know of each instance."""
        return self.bytes_of_top() + self.bytes_of_bottoms()

    def bytes_of_top(self) -> int:
        """Return the bytes of the top level, and of the instances."""
        references: Any = self.geometry if isinstance(self.geometry, Braided) else None
        parts = [self.arrays, self.instances._replace(forest=(), items=())]
        if references is not None:
            parts.append(references._replace(instances=()))
        return sum(array.nbytes for part in parts for array in arrays_in(part))

    def bytes_of_bottoms(self) -> int:
        """Return the bytes of all levels below, without the items of meshes."""
        parts, below = [self.instances.forest], self.instances.items
        while isinstance(below, Instances):
            parts.append(below._replace(items=()))
            below = below.items
        return sum(array.nbytes for part in parts for array in arrays_in(part))

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the nodes of the top level; ``parts`` says how many of its items are opened."""
        cells = self.tlas.cells(progress)
        if self.braid is None:
            return cells
        first, size = self.arrays.first, self.arrays.size
        roots = self.instances.roots[self.instances.mesh[self.braid.references.owner]]
        is_part = np.append(0, np.cumsum(self.braid.references.node != roots))
        is_leaf = size > 0
        begin = np.where(is_leaf, first, 0)
        parts = is_part[np.where(is_leaf, first + size, 0)] - is_part[begin]
        return dataclasses.replace(
            cells, extra={**cells.extra, "parts": parts[cells.numbers].astype(np.int32)}
        )

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the top level, and of both levels."""
        top = self.tlas.statistics(progress)
        return dataclasses.replace(top, extra={**top.extra, **figures_of(self, progress)})

    def validate(self) -> list[str]:
        """Check both levels."""
        violations = [
            f"{structure.name} of mesh {number}: {each}"
            for number, (_, structure) in enumerate(self.bottoms)
            for each in structure.validate()
        ]
        if self.braid is None:
            return violations + [f"top level: {each}" for each in self.tlas.validate()]
        return violations + self._violations_of_braid()

    def _violations_of_braid(self) -> list[str]:
        """Check that the references of every instance are a cut through its tree."""
        assert self.braid is not None
        violations = []
        tree, references = self.braid.tree, self.braid.references
        leaves = np.flatnonzero(tree.size > 0)
        if int(tree.size[leaves].sum()) != len(references.owner):
            violations.append("the leaves do not partition the references")
        inner = np.flatnonzero(tree.size == 0)
        for side in (0, 1):
            if not Boxes(tree.boxes).contain(inner, tree.first[inner] + side).all():
                violations.append("a box does not contain that of a child")
        # Opening takes a node away and adds its children: what is left over, in the end, is there.
        first = self.instances.forest.first
        had = {(int(owner), int(root)) for owner, root in self._roots_of_instances()}
        for owner, node in self.braid.opened.tolist():
            if (owner, node) not in had:
                violations.append("what was opened was not there")
            had.discard((owner, node))
            had |= {(owner, int(first[node])), (owner, int(first[node]) + 1)}
        there = set(zip(references.owner.tolist(), references.node.tolist(), strict=True))
        if there != had or len(there) != len(references.owner):
            violations.append("the references of an instance are no cut through its tree")
        return violations

    def _roots_of_instances(self) -> np.ndarray:
        mesh = self.instances.mesh
        roots = np.where(mesh >= 0, self.instances.roots[mesh], -1)
        return np.column_stack([np.arange(len(mesh)), roots])
