"""The scene: items in world space, with what is known about where they came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NoReturn

import numpy as np

from ..errors import InputError
from ..geometry.csg.cutting import cut
from ..geometry.csg.making import Described, csg_of
from ..geometry.csg.settings import CuttingSettings
from ..geometry.csg.trees import Csg, first_of_leaves, primitive_counts
from ..geometry.geometry import boxes_around, in_order
from ..geometry.instances import (
    Instanced,
    flattened,
    is_of_triangles,
    mirrors,
    owners_of,
)
from ..geometry.solids.description import Item
from ..geometry.solids.making import mixed_of
from ..geometry.solids.mixed import Mixed
from ..geometry.triangles import Triangles, all_triangles, extent
from ..memory import refuse_if_too_large, refuse_if_unnumbered
from ..progress import SILENT, Progress
from .camera import ORTHOGRAPHIC, PERSPECTIVE, Camera
from .light import AREA, LIGHT_KINDS, POINT, SPOT, SUN, Light, point_lights
from .material import Material

__all__ = [
    "AREA", "LIGHT_KINDS", "ORTHOGRAPHIC", "PERSPECTIVE", "POINT", "SPOT", "SUN", "Camera", "Light",
    "Scene", "point_lights",
]  # fmt: skip

SMALLEST, LARGEST = 1e-100, 1e100
"""Sizes in between, products of three coordinates are in the range of float64."""

LOOKED_AT = 4096
"""Triangles looked at together for one that has an area."""

THINNEST = 1e-100
"""Share of the scene's longest side below which another one is taken as flat. A thin side's
products with others would lose their digits, and there is no cell between numbers near 1e-310."""


@dataclass(frozen=True)
class Scene:
    """Everything that rays can hit, in world space.

    Make one with :meth:`from_triangles`, :meth:`from_items` or :meth:`from_instances`, which check
    and clean the input. An item is what a leaf holds: a triangle, a solid, or a mesh's instance.

    Attributes
    ----------
    name, source : str
        Short name, and where it came from (file, sample scene, Blender file).
    geometry : NamedTuple of arrays
        The items, in their order, see :mod:`.geometry.geometry`.
    primitive_ids : (n,) int32
        Index of each item in the order of its source. Ascending; it differs from ``arange(n)`` only
        where triangles were dropped.
    dropped : int
        Triangles left out because a coordinate was not a finite number.
    object_ids : (n,) int32
        Index into `object_names` of the object each item belongs to.
    object_names : tuple of str
    lower, upper : (3,) float64
        The box around all items.
    camera : Camera or None
        The scene's own camera, if it has one.
    lights : tuple of Light
    materials : tuple of Material
    material_ids : (n,) int32 or None
        Index into `materials` of each item, if there are any; with `material_first`, of each run.
    material_first : (n_runs + 1,) int64 or None
        Number of the first primitive of each run of one material, as hits have it, where an
        instance may hold several.
    turned : (n,) bool or None
        Of each item, or with `object_first` of each object: whether its corners run clockwise as
        seen from outside, since a matrix has mirrored them. None if those of no item do.
    background : (float, float, float)
        Red, green and blue of what rays see that hit nothing, 0 to 1, as they are shown.
    object_first : (n_objects + 1,) int64 or None
        Number of the first primitive of each object, as hits have it, where an instance may hold
        several objects; its object id is then the first one's.
    notes : tuple of str
        What the source has and was not read, or was read otherwise than it says; one sentence each,
        without a full stop. They are said once and stand in the record.
    """

    name: str
    source: str
    geometry: Any
    primitive_ids: np.ndarray
    dropped: int
    object_ids: np.ndarray
    object_names: tuple[str, ...]
    lower: np.ndarray
    upper: np.ndarray
    camera: Camera | None = None
    lights: tuple[Light, ...] = ()
    notes: tuple[str, ...] = ()
    materials: tuple[Material, ...] = ()
    material_ids: np.ndarray | None = None
    object_first: np.ndarray | None = None
    material_first: np.ndarray | None = None
    turned: np.ndarray | None = None
    background: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @classmethod
    def from_triangles(
        cls,
        triangles: np.ndarray,
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray | None = None,
        object_names: tuple[str, ...] = (),
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        notes: tuple[str, ...] = (),
        progress: Progress = SILENT,
    ) -> Scene:
        """Check, clean and wrap triangles.

        Parameters
        ----------
        triangles : (n, 3, 3) array_like of float
            Corner positions in world space.

        Raises
        ------
        InputError
            When no triangle is left that a ray could hit.
        Cancelled
            From `progress`.
        """
        text = "Checking triangles"
        progress.report(0, 4, text)
        triangles = np.array(triangles, dtype=np.float64, order="C").reshape(-1, 3, 3)
        if len(triangles) == 0:
            raise InputError(f"{name} has no triangles; choose a mesh with faces", name)
        refuse_if_unnumbered(len(triangles), f"triangles of {name}", "use a part of it")
        progress.report(1, 4, text)
        count, kept = len(triangles), np.arange(len(triangles), dtype=np.int32)
        lower, upper = extent(triangles)
        # A float32 file may hold values up to 3e38; what is larger than we can compute with is
        # treated like infinity.
        if not (np.abs([lower, upper]) < LARGEST).all():
            usable = (np.abs(triangles) < LARGEST).all(axis=(1, 2))
            kept = kept[usable]
            if len(kept) == 0:
                reason = f"every vertex of {name} is NaN or infinite; repair the mesh"
                raise InputError(reason, name)
            triangles = triangles[kept]
            lower, upper = extent(triangles)
        dropped = count - len(kept)
        if object_ids is None:
            object_ids, object_names = np.zeros(len(kept), dtype=np.int32), object_names or (name,)
        else:
            object_ids = np.ascontiguousarray(object_ids[kept], dtype=np.int32)
        progress.report(2, 4, text)
        notes = (*notes, *_flatten(triangles, lower, upper))
        _refuse_if_all_degenerate(triangles, lower, upper, name)
        progress.report(3, 4, text)
        geometry = all_triangles(triangles)
        progress.report(4, 4, text)
        return cls(
            name, source or name, geometry, kept, dropped, object_ids, tuple(object_names),
            lower, upper, camera, tuple(lights), notes,
        )  # fmt: skip

    @classmethod
    def from_items(
        cls,
        items: Sequence[Item],
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray | None = None,
        object_names: tuple[str, ...] = (),
        material_ids: np.ndarray | None = None,
        materials: Sequence[Material] = (),
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        notes: tuple[str, ...] = (),
    ) -> Scene:
        """Check and wrap elementary solids, polygons and triangles; all kinds may be mixed.

        Parameters
        ----------
        items : sequence
            Of what :mod:`.geometry.solids.description` has words for.
        material_ids : (n,) int, optional
            Index into `materials` of each item.

        Raises
        ------
        InputError
            When there are none, or one cannot be.
        """
        if not len(items):
            raise InputError(f"{name} is empty; add something that a ray can hit", name)
        refuse_if_unnumbered(len(items), f"items of {name}", "use a part of it")
        if object_ids is None:
            object_ids, object_names = np.zeros(len(items), np.int32), object_names or (name,)
        scene = cls.from_mixed(
            mixed_of(items), name, source, object_ids=object_ids, object_names=object_names,
            notes=notes,
        )  # fmt: skip
        return replace(
            scene, camera=camera, lights=tuple(lights), materials=tuple(materials),
            material_ids=None if material_ids is None else np.asarray(material_ids, np.int32),
        )  # fmt: skip

    @classmethod
    def from_mixed(
        cls,
        geometry: Mixed,
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray,
        object_names: tuple[str, ...],
        primitive_ids: np.ndarray | None = None,
        dropped: int = 0,
        notes: tuple[str, ...] = (),
    ) -> Scene:
        """Wrap items that are made already.

        Raises
        ------
        InputError
            When the scene is too large or too small to compute with.
        """
        count, boxes = len(geometry.ids), geometry.boxes
        lower, upper = boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)
        _refuse_sizes(lower, upper, name)
        if primitive_ids is None:
            primitive_ids = np.arange(count, dtype=np.int32)
        return cls(
            name, source or name, geometry, primitive_ids, dropped,
            np.ascontiguousarray(object_ids, dtype=np.int32), tuple(object_names), lower, upper,
            notes=notes,
        )  # fmt: skip

    @classmethod
    def from_instances(
        cls,
        geometry: Instanced,
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray | None = None,
        object_names: tuple[str, ...] = (),
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        notes: tuple[str, ...] = (),
    ) -> Scene:
        """Wrap meshes in places, see :func:`.geometry.instances.instanced`.

        Parameters
        ----------
        object_ids : (n,) int, optional
            Of each instance; without them each mesh is an object.

        Raises
        ------
        InputError
            When the scene is too large or too small to compute with.
        """
        count = len(geometry.ids)
        lower, upper = geometry.boxes[:, :3].min(axis=0), geometry.boxes[:, 3:].max(axis=0)
        _refuse_sizes(lower, upper, name)
        if object_ids is None:
            object_ids = geometry.which
            object_names = object_names or tuple(
                f"{name} {number}" for number in range(len(geometry.meshes))
            )
        return cls(
            name, source or name, geometry, np.arange(count, dtype=np.int32), 0,
            np.ascontiguousarray(object_ids, dtype=np.int32), tuple(object_names), lower, upper,
            camera, tuple(lights), notes,
        )  # fmt: skip

    @classmethod
    def from_trees(
        cls,
        described: Sequence[Described],
        name: str,
        source: str = "",
        *,
        object_ids: np.ndarray | None = None,
        object_names: tuple[str, ...] = (),
        material_ids: np.ndarray | None = None,
        materials: Sequence[Material] = (),
        camera: Camera | None = None,
        lights: Sequence[Light] = (),
        notes: tuple[str, ...] = (),
        cutting: CuttingSettings | None = None,
    ) -> Scene:
        """Check and wrap trees of solids, and plain items beside them.

        Parameters
        ----------
        described : sequence
            Of what :mod:`.geometry.csg.description` has words for; of a Mixed, each item is one.
        object_ids : (n,) int, optional
            Of each item, ascending; without them each is an object.
        material_ids : (n_leaves,) int, optional
            Index into `materials` of each leaf, from the first tree's to the last one's.
        cutting : CuttingSettings, optional
            How trees are bounded.

        Raises
        ------
        InputError
            When there are none, one cannot be, or the scene is too large or too small to compute
            with.
        """
        if not len(described):
            raise InputError(f"{name} is empty; add something that a ray can hit", name)
        geometry = csg_of(described, cutting)
        lower, upper = geometry.boxes[:, :3].min(axis=0), geometry.boxes[:, 3:].max(axis=0)
        _refuse_sizes(lower, upper, name)
        count = len(geometry.ids)
        if object_ids is None:
            object_ids = np.arange(count)
            object_names = object_names or tuple(f"{name} {number}" for number in range(count))
        object_ids = np.ascontiguousarray(object_ids, dtype=np.int32)
        of_objects = np.bincount(
            object_ids, weights=primitive_counts(geometry), minlength=len(object_names)
        )
        first = None
        if material_ids is not None:
            first = np.append(first_of_leaves(geometry), geometry.n_primitives)
        return cls(
            name, source or name, geometry, np.arange(count, dtype=np.int32), 0, object_ids,
            tuple(object_names), lower, upper, camera, tuple(lights), notes, tuple(materials),
            None if material_ids is None else np.asarray(material_ids, np.int32),
            object_first=np.concatenate([[0], np.cumsum(of_objects.astype(np.int64))]),
            material_first=first,
        )  # fmt: skip

    def with_cutting(self, cutting: CuttingSettings) -> Scene:
        """Return the scene with its trees of solids bounded otherwise; itself if it has none."""
        if not isinstance(self.geometry, Csg):
            return self
        return replace(self, geometry=cut(self.geometry, cutting))

    def __len__(self) -> int:
        return len(self.geometry.ids)

    @property
    def triangles(self) -> np.ndarray:
        """Corner positions, (n, 3, 3) float64, of a scene that holds triangles alone.

        Raises
        ------
        InputError
            For one that holds other items as well.
        """
        if not isinstance(self.geometry, Triangles):
            self.refuse_other_items("this is done")
        return self.geometry.corners

    def refuse_other_items(self, what: str, which: str = "triangles") -> NoReturn:
        """Raise InputError: something is for some items only, and there are others.

        Parameters
        ----------
        what, which : str
            ``"cones meet"``, and with what.
        """
        if is_of_triangles(self.geometry):
            raise InputError(
                f"{what} with {which} only, and {self.name} holds instances; choose "
                "--instances flatten, or another structure or setting",
                self.name,
            )
        raise InputError(
            f"{what} with {which} only, and {self.name} holds other items as well; choose "
            f"another structure or setting, or a scene of {which}",
            self.name,
        )

    @property
    def counted(self) -> str:
        """How many items there are, in words: ``"4096 triangles"``."""
        return f"{len(self)} {self.item_name}s"

    @property
    def item_name(self) -> str:
        """What a leaf holds: a ``"triangle"``, ``"instance"``, ``"tree"`` or any ``"item"``."""
        if isinstance(self.geometry, Csg):
            return "tree"
        return "instance" if isinstance(self.geometry, Instanced) else self.primitive_name

    @property
    def primitive_name(self) -> str:
        """What rays hit: a ``"triangle"`` or an ``"item"`` of any kind."""
        return "triangle" if is_of_triangles(self.geometry) else "item"

    def object_of(self, primitive: int) -> tuple[str, int]:
        """Return the name of the object that a primitive is of, and its number.

        Over instances that is its number in the object, otherwise in the scene.
        """
        if self.object_first is not None:
            number = int(np.searchsorted(self.object_first, primitive, side="right")) - 1
            return self.object_names[number], primitive - int(self.object_first[number])
        (owner,), (within,) = owners_of(self.geometry, np.array([primitive]))
        number = self.object_ids[primitive if owner < 0 else owner]
        return self.object_names[number], int(within)

    def objects_of(self, primitives: np.ndarray) -> np.ndarray:
        """Return the numbers of the objects, (n,), that primitives are of; -1 for -1, a miss."""
        if self.object_first is not None:
            return _runs_of(self.object_first, primitives)
        owners, within = owners_of(self.geometry, primitives)
        items = np.where(owners < 0, within, owners)
        return np.where(items < 0, -1, self.object_ids[items])

    def materials_of(self, primitives: np.ndarray) -> np.ndarray:
        """Return what primitives that were hit are made of, (n,) int, as index into `materials`.

        Where there are none, all zeros: what is not said to be of another material is matt.
        """
        if self.material_ids is None:
            return np.zeros(len(primitives), dtype=np.int32)
        if self.material_first is not None:
            return self.material_ids[_runs_of(self.material_first, primitives)]
        return self.material_ids[primitives]

    def is_turned(self, primitives: np.ndarray) -> np.ndarray:
        """Say of primitives that were hit whether their corners run the other way round, (n,)."""
        if self.turned is None:
            return np.zeros(len(primitives), dtype=bool)
        if self.object_first is not None:
            return self.turned[_runs_of(self.object_first, primitives)]
        return self.turned[primitives]

    def flat(self) -> Scene:
        """Return the scene with its instances as triangles in world space.

        Triangles are in the order in which the primitives of instances are counted.

        Raises
        ------
        InputError
            If meshes hold other items, or the triangles are too many.
        """
        if not isinstance(self.geometry, Instanced):
            return self
        if not is_of_triangles(self.geometry):
            self.refuse_other_items("instances are flattened")
        count = int(self.geometry.first[-1])
        refuse_if_too_large(
            150 * count, f"{self.name} with {count} triangles", "keep its instances"
        )
        corners, owners = flattened(self.geometry)
        ids = self.object_ids[owners]
        if self.object_first is not None:
            counts = np.diff(self.object_first)
            ids = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        flat = Scene.from_triangles(
            corners, self.name, self.source, object_ids=ids,
            object_names=self.object_names, camera=self.camera, lights=self.lights,
            notes=self.notes,
        )  # fmt: skip
        numbers = flat.primitive_ids
        turned = self.is_turned(numbers) ^ mirrors(self.geometry.matrices)[owners[numbers]]
        return replace(
            flat, materials=self.materials, background=self.background,
            material_ids=None if self.material_ids is None else self.materials_of(numbers),
            turned=turned if turned.any() else None,
        )  # fmt: skip

    def items(self, order: np.ndarray | None = None) -> Any:
        """Return the items as structures hold them, in scene order or permuted by `order`."""
        return in_order(self.geometry, np.arange(len(self)) if order is None else order)

    def boxes(self) -> np.ndarray:
        """Return the box of every item, (n, 6) float64; an array of the caller's own."""
        return boxes_around(self.geometry)

    @property
    def diagonal(self) -> float:
        """Length of the diagonal of the box around the scene."""
        return float(np.linalg.norm(self.upper - self.lower))


def _runs_of(first: np.ndarray, primitives: np.ndarray) -> np.ndarray:
    """Return the run that each primitive lies in; -1 for -1."""
    return np.searchsorted(first, primitives, side="right") - 1


def _refuse_sizes(lower: np.ndarray, upper: np.ndarray, name: str) -> None:
    """Raise InputError for a scene whose size, or that along an axis, is no size to compute with.

    Triangles are drawn flat instead, see :func:`_flatten`; solids and matrices cannot be.
    """
    if not (np.abs([lower, upper]) < LARGEST).all():
        raise InputError(f"{name} is too large to compute with; scale it", name)
    if not is_computable(lower, upper):
        raise InputError(f"{name} is too small or too thin to compute with; scale it", name)


def is_computable(lower: np.ndarray, upper: np.ndarray) -> bool:
    """Say whether what lies in a box has a size, and one along each axis, to compute with."""
    size = upper - lower
    is_thin = (size > 0.0) & (size < THINNEST * size.max())
    # Of numbers that are none all comparisons are false.
    return bool((np.abs([lower, upper]) < LARGEST).all() and size.max() >= SMALLEST) and not bool(
        is_thin.any()
    )


def _flatten(triangles: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> list[str]:
    """Make axes exactly flat, in place, along which a scene is thinner than THINNEST.

    Returns
    -------
    list of str
        A note for each such axis.
    """
    sizes, notes = upper - lower, []
    for axis in np.flatnonzero((sizes > 0.0) & (sizes < THINNEST * sizes.max())):
        place = min(max(lower[axis], 0.0), upper[axis])
        triangles[:, :, axis] = lower[axis] = upper[axis] = place
        notes.append(
            f"it is {sizes[axis]:.1g} units thick along {'xyz'[axis]}, which is taken as flat: "
            f"that is less than {THINNEST:g} of its longest side"
        )
    return notes


def has_area(triangles: np.ndarray) -> bool:
    """Say whether one of the triangles, (n, 3, 3), has an area."""
    lower, upper = extent(triangles)
    scale = float((upper - lower).max())
    if not scale > 0.0:
        return False
    for first in range(0, len(triangles), LOOKED_AT):  # most often one of the first has
        # Scaled to the unit box first: at 1e-200 the cross product would underflow to zero.
        unit = (triangles[first : first + LOOKED_AT] - lower) / scale
        if np.cross(unit[:, 1] - unit[:, 0], unit[:, 2] - unit[:, 0]).any():
            return True
    return False


def _refuse_if_all_degenerate(
    triangles: np.ndarray, lower: np.ndarray, upper: np.ndarray, name: str
) -> None:
    """Raise InputError if every triangle has zero area: there is nothing to hit or to divide."""
    scale = float((upper - lower).max())
    if 0.0 < scale < SMALLEST:
        raise InputError(
            f"{name} is {scale:.1g} units large, too small to compute with; scale it", name
        )
    if has_area(triangles):
        return
    count = (
        "its only triangle has" if len(triangles) == 1 else f"all {len(triangles)} triangles have"
    )
    raise InputError(
        f"{name}: {count} zero area, so no ray can hit; check the object's scale", name
    )
