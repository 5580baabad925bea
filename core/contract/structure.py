"""The contract of a structure, and the parts of it that are the same for all.

A technique is one module in this folder with

- ``Settings``: a frozen dataclass, see :mod:`..settings`;
- a NamedTuple of flat arrays, the structure as its kernels see it;
- an implementation of :func:`.walk.walk` for that NamedTuple: the traversal;
- a subclass of :class:`Structure` whose ``build`` makes it from a scene;
- ``STRUCTURE = TheClass``, by which it is found.
"""

from __future__ import annotations

import abc
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.cones import ConeArrays, Spread, cones_around, meets_all
from ..geometry.csg.trees import Csg
from ..geometry.instances import Instanced, levels_of_mesh, stored_in
from ..geometry.rays import RayArrays, Rays, make_probe
from ..geometry.triangles import Triangles
from ..kernels import call, kernel
from ..memory import refuse_if_too_large
from ..parallel import Spare, for_chunks
from ..progress import SILENT, Progress
from ..scene import Scene
from .build_log import BuildLog
from .cells import Cells
from .counters import Counter, Counts, counters_within
from .csg import CSG_COUNTERS, with_scratch
from .events import COUNTS, N_EVENTS, NONE, TEST, Log, NoLog, make_log, no_log
from .figures import Figure
from .needs import EVERY_CLASS, GEOMETRY, refuse_other_classes
from .ray_order import AS_GIVEN, AUTOMATIC, order_of, taken
from .statistics import Statistics
from .steps import Steps
from .walk import NOWHERE, walk
from .workspace import Workspace, deepened, make_workspace

SMALLEST_T = 1e-308
"""The t that the longest ray needs to cross a scene is at least this. Below, which is near the end
of the range of float64, numbers lose their digits."""

# ---------------------------------------------------------------------------- what comes out


class Made(NamedTuple):
    """How much of a structure has been made for rays that entered it (:mod:`.lazy`).

    Attributes
    ----------
    cells : int
    seconds : float
        That making them took.
    passes : int
        How often rays were stopped, and traced again, for cells that were missing.
    """

    cells: int
    seconds: float
    passes: int


@dataclass(frozen=True)
class Hits:
    """Hits of a batch.

    Attributes
    ----------
    t : (n,) float64
        Ray parameter of the hit, inf for a miss.
    primitive : (n,) int32, or int64 over instances
        Number of the item in the scene, -1 for a miss. Of equal t the lowest. Over instances the
        primitives of each are counted after those of the one before.
    """

    t: np.ndarray
    primitive: np.ndarray


# ------------------------------------------------------------------------------ the one driver


@kernel
def trace_range(
    structure, geometry, rays, first, last, before, workspace, log, t, primitive, counters
):  # fmt: skip
    """Trace the rays ``first <= i < last`` and write their hits and counters.

    Parameters
    ----------
    before : int
        Rays that were traced before, in this workspace or others.
    """
    for i in range(first, last):
        ray = make_probe(rays, i, geometry.reach)
        found = walk(structure, geometry, ray, before + i, workspace, log)
        t[i] = found.t
        primitive[i] = found.primitive
        own = len(found.counts)
        for column in range(own):
            counters[i, column] = found.counts[column]
        # What was counted within instances, level by level.
        for column in range(own, counters.shape[1]):
            counters[i, column] = log.written[COUNTS + column - own]
            log.written[COUNTS + column - own] = 0


def arrays_in(record: Any) -> Iterator[np.ndarray]:
    """Yield the arrays of a record and of the records in it."""
    if isinstance(record, np.ndarray):
        yield record
    elif isinstance(record, tuple):
        for value in record:
            yield from arrays_in(value)


BYTES_IN_MESH = 330
"""Memory at the peak of a build for each primitive of a mesh of instances: its tree is a bvh's, by
the settings of that if it is a bvh that is built, otherwise by the default ones."""


class Structure(abc.ABC):
    """A built structure; ``Structure.build`` makes one.

    Attributes
    ----------
    name, label, summary : str
        Name on the command line, in the panel, and one sentence.
    Settings : type
        The settings dataclass.
    COUNTERS : tuple of Counter
        What the walk counts, in the order of its :class:`Found`.
    FIGURES : tuple of Figure
        What its statistics hold, in reading order.
    answers : tuple of str or None
        The classes of rays it is for; None for all.
    takes_cones : bool
        Whether cones go through it, see :mod:`..geometry.cones`.
    keeps_instances : bool
        Whether the frames of an animation are instances that move; otherwise they are flattened,
        since a mesh may be deformed from frame to frame.
    needs : frozenset of str
        What it is built from: GEOMETRY, LIGHTS, CAMERA, TIME.
    """

    name: ClassVar[str]
    label: ClassVar[str]
    summary: ClassVar[str]
    Settings: ClassVar[type]
    COUNTERS: ClassVar[tuple[Counter, ...]]
    FIGURES: ClassVar[tuple[Figure, ...]]
    answers: ClassVar[tuple[str, ...] | None] = EVERY_CLASS
    takes_cones: ClassVar[bool] = False
    keeps_instances: ClassVar[bool] = False
    needs: ClassVar[frozenset[str]] = frozenset({GEOMETRY})
    BYTES_PER_TRIANGLE: ClassVar[int] = 80
    """Memory at the peak of a build; by default a copy of the triangles."""

    def __init__(
        self,
        scene: Scene,
        settings: Any,
        arrays: Any,
        geometry: Any,
        log: Callable[[Any], BuildLog] | None = None,
    ) -> None:
        self.scene = scene
        self.settings = settings
        self.arrays = arrays
        self.geometry = geometry
        self._log = log

    @functools.cached_property
    def build_log(self) -> BuildLog | None:
        """What the builder did, if the build was asked for a log, and if this kind keeps one.

        What the builder has noted is put together when it is first looked at, so that the time of
        a build is that of the building.
        """
        log, self._log = self._log, None  # what it holds is not needed any more
        return None if log is None else log(self)

    @property
    def keeps_log(self) -> bool:
        """Whether there is a :attr:`build_log`; it is not put together for the answer."""
        return self._log is not None or self.__dict__.get("build_log") is not None

    @property
    def triangles(self) -> Triangles:
        """The geometry, if it is triangles.

        Raises
        ------
        InputError
            If it holds other items as well.
        """
        if not isinstance(self.geometry, Triangles):
            self.scene.refuse_other_items("this is done")
        return self.geometry

    @functools.cached_property
    def levels(self) -> int:
        """How deep instances lie within each other in what it is built over; 0 without any."""
        return levels_of_mesh(self.scene.geometry)

    @functools.cached_property
    def counters(self) -> tuple[Counter, ...]:
        """What is counted: COUNTERS, and what is within instances and trees of solids."""
        trees = CSG_COUNTERS if isinstance(self.scene.geometry, Csg) else ()
        return (*self.COUNTERS, *counters_within(self.levels), *trees)

    @property
    def remembered(self) -> np.ndarray:
        """What walks leave to those after them, (k,) int32; by default nothing.

        It is forgotten before each batch, and the rays of that are then traced one after the other,
        in the caller's order.
        """
        return np.empty(0, np.int32)

    @property
    def has_mailbox(self) -> bool:
        """Whether the walk needs a mailbox."""
        return False

    @classmethod
    def bytes_per_triangle(cls, settings: Any) -> float:
        """Return the memory at the peak of a build that has these settings, per triangle."""
        return cls.BYTES_PER_TRIANGLE

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: Any) -> None:
        """Refuse what would not fit into memory, before anything is compiled or allocated.

        Raises
        ------
        InputError
            Naming what to lower.
        """
        per_triangle = cls.bytes_per_triangle(settings)
        needed = len(scene) * per_triangle
        if isinstance(scene.geometry, Instanced):
            needed += stored_in(scene.geometry) * max(BYTES_IN_MESH, per_triangle)
        refuse_if_too_large(int(needed), f"{cls.name} over {scene.counted}", "use a smaller scene")

    @classmethod
    @abc.abstractmethod
    def build(
        cls, scene: Scene, settings: Any, progress: Progress = SILENT, *, log: bool = False
    ) -> Structure:
        """Build the structure over a scene.

        Parameters
        ----------
        log : bool
            Keep what it takes to tell how it was built (:attr:`build_log`). Without it, nothing of
            that is kept, and cells have no steps.

        Raises
        ------
        InputError
            When the settings ask for more memory than there is.
        Cancelled
            From `progress`.
        """

    @abc.abstractmethod
    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return everything there is to draw.

        Raises
        ------
        Cancelled
            From `progress`.
        """

    @abc.abstractmethod
    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of the structure.

        Raises
        ------
        Cancelled
            From `progress`.
        """

    @abc.abstractmethod
    def validate(self) -> list[str]:
        """Return the violated invariants, one sentence each; empty for a sound structure."""

    def memory(self) -> int:
        """Return the bytes of the structure's arrays, without the scene's triangles.

        Over instances, the trees of their meshes are among them, and what a walk has to know of
        each instance.
        """
        parts, geometry = [self.arrays], self.geometry
        for _ in range(self.levels):
            parts.append(geometry._replace(items=()))
            geometry = geometry.items
        return sum(array.nbytes for part in parts for array in arrays_in(part))

    def answered(self, rays: Rays) -> dict[str, Any]:
        """Return, by class, which structure within this one answers which share of rays.

        Returns
        -------
        dict
            Of a structure that answers all of them itself, empty.
        """
        return {}

    def made(self) -> Made | None:
        """Return what has been made for rays so far; None if all was made by the build."""
        return None

    def trace(
        self,
        rays: Rays,
        query: int | None = None,
        *,
        threads: int = 0,
        ray_order: str = AUTOMATIC,
        progress: Progress = SILENT,
    ) -> tuple[Hits, Counts]:
        """Trace a batch of rays.

        Parameters
        ----------
        query : {CLOSEST, ANY, ALL}, optional
            For all rays; without it every ray's own.
        threads : int
            0 takes every core.
        ray_order : {"automatic", "as_given", "sorted"}
            In which order rays are traced, see :mod:`.ray_order`. Results are the same. Both say
            nothing where walks leave something to others (:attr:`remembered`).

        Raises
        ------
        InputError
            If directions are so long that numbers for t run out, or rays are of a class that the
            structure does not answer.
        Cancelled
            From `progress`.
        RuntimeError
            For a defect: a ray whose walk does not come to an end.
        """
        refuse_other_classes(self.name, self.answers, rays)
        count = len(rays)
        refuse_if_too_large(count * 60, f"tracing {count} rays", "ask for fewer rays")
        # All t of a scene would be zero, or so near that none could tell what comes first.
        ends = rays.directions.max(initial=0.0), rays.directions.min(initial=0.0)
        longest = float(max(ends[0], -ends[1]))
        if self.scene.diagonal < SMALLEST_T * longest:
            raise InputError(
                f"the directions of rays are up to {longest:.1g} units long, which is too much for "
                f"a scene of {self.scene.diagonal:.1g} units; make them shorter"
            )
        arrays = rays.arrays()
        if query is not None:
            arrays = arrays._replace(queries=np.full(count, query, dtype=np.uint8))
        if len(self.remembered):
            self.remembered[:] = NONE
            threads, ray_order = 1, AS_GIVEN
        box = np.concatenate([self.scene.lower, self.scene.upper])
        order = order_of(arrays, box, len(self.scene), ray_order, threads, progress)
        t, primitive, counters = self._trace_all(arrays, order, threads, progress)
        self._complain_of_lost(primitive)
        return Hits(t, primitive), Counts(self.counters, counters)

    def _trace_all(
        self,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays in an order, in threads; return t, primitives and counters of each."""
        return self._trace_through(self.arrays, rays, order, threads, progress)

    def _trace_through(
        self,
        arrays: Any,
        rays: RayArrays | ConeArrays,
        order: np.ndarray | None,
        threads: int,
        progress: Progress,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trace rays through the structure as it stands in `arrays`."""
        count = len(next(arrays_in(rays)))
        out = self._room_for(count)
        spare = Spare(self._deep_workspace)

        def trace_chunk(first: int, last: int) -> None:
            with spare.lent() as workspace:
                if order is None:
                    self._trace(arrays, rays, first, last, 0, workspace, no_log(), *out)
                    return
                numbers, size = order[first:last], last - first
                found = self._room_for(size)
                self._trace(
                    arrays, taken(rays, numbers), 0, size, first, workspace, no_log(), *found
                )
            # Written one after the other, and then put in their places: a walk that writes far and
            # wide waits for it.
            for column, values in zip(out, found, strict=True):
                column[numbers] = values

        for_chunks(trace_chunk, count, threads, progress, f"Tracing {self.name}")
        return out

    def _room_for(self, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return room for t, primitives and counters of so many rays."""
        counters = np.empty((count, len(self.counters)), np.int32)
        return np.empty(count), np.empty(count, self._number_type), counters

    def record(self, rays: Rays, index: int, query: int | None = None) -> Steps:
        """Record the walk of one ray of a batch, with the same kernel that counts.

        Raises
        ------
        RuntimeError
            For a defect: the walk does not come to an end.
        """
        if len(self.remembered):
            # It finds what those before it have left.
            self.trace(rays.select(np.arange(index)), query)
        arrays = rays.select(np.array([index])).arrays()
        if query is not None:
            arrays = arrays._replace(queries=np.full(1, query, dtype=np.uint8))
        return self._recorded(arrays)

    def cover(self, rays: Rays, index: int, spread: Spread | float) -> tuple[np.ndarray, Steps]:
        """Record the walk of a cone around one ray of a batch; return the items that it meets.

        Parameters
        ----------
        spread : Spread or float
            What is around the ray: a number is a round cone's angle between axis and side, in
            radians, above 0 and below a right angle. The cone is where t, along its axis, is from
            t_min to t_max.

        Returns
        -------
        items : (k,) int
            Ascending, each once.
        steps : Steps
            What it was recorded as; a test with a finite t is that of an item which is met.

        Raises
        ------
        InputError
            If cones do not go through this structure, or items of this kind are not asked by any.
        """
        if not isinstance(spread, Spread):
            spread = Spread(float(spread))
        self.refuse_cones(spread)
        steps = self._recorded(cones_around(rays.select(np.array([index])), spread))
        tests = steps.events_of(TEST)
        return np.unique(steps.primitive[tests[np.isfinite(steps.t_enter[tests])]]), steps

    def refuse_cones(self, spread: Spread) -> None:
        """Raise InputError if cones do not go through this structure, or do not meet its items."""
        if not self.takes_cones:
            raise InputError(
                f"cones do not go through {self.name}; choose naive, grid, bvh, octree, kdtree or "
                "sorted_volumes"
            )
        if not meets_all(self.geometry, spread):
            if spread.is_circular:
                self.scene.refuse_other_items("cones meet", "triangles and spheres")
            self.scene.refuse_other_items("ellipses and pyramids meet")

    def _recorded(self, arrays: Any) -> Steps:
        """Return the steps of a batch of one."""
        out = self._room_for(1)
        capacity = 1024
        while True:
            log = make_log(capacity)
            self._trace(self.arrays, arrays, 0, 1, 0, self._deep_workspace(), log, *out)
            self._complain_of_lost(out[1])
            if log.written[N_EVENTS] <= capacity:
                return Steps.from_log(log, self.counters)
            capacity = int(log.written[N_EVENTS])

    def _trace(
        self, arrays: Any, rays: RayArrays | ConeArrays, first: int, last: int, before: int,
        workspace: Workspace, log: Log | NoLog, *out: Any,
    ) -> None:  # fmt: skip
        """Run the driver over a range of rays."""
        call(trace_range, arrays, self.geometry, rays, first, last, before, workspace, log, *out)

    def _complain_of_lost(self, primitive: np.ndarray) -> None:
        """Raise RuntimeError if a walk has lost its way."""
        lost = np.flatnonzero(primitive == NOWHERE)
        if len(lost):
            raise RuntimeError(
                f"{self.name}: the walk of {len(lost)} of {len(primitive)} rays, ray {lost[0]} the"
                f" first, does not come to an end in {self.scene.name}; please report it"
            )

    @property
    def _number_type(self) -> type:
        """Of the numbers of primitives: instances may have more of them than int32 holds."""
        return np.int64 if self.levels else np.int32

    def _deep_workspace(self) -> Workspace:
        """Return scratch memory for one thread, and for what is within items."""
        return with_scratch(deepened(self._workspace(), self.levels), self.geometry)

    def _workspace(self) -> Workspace:
        """Return scratch memory for one thread; a structure asks for what its walk uses."""
        return make_workspace(mailbox=len(self.scene) if self.has_mailbox else 1)
