"""Routed: each class of rays goes to a structure of its own.

Primary rays start in one point and run side by side, shadow rays end at lights, reflected rays go
everywhere: the lecture's table of directional techniques says which structure serves which class.
This is that table as a structure. It builds one for each class, and splits every batch by the
classes of its rays. Where two classes have the same structure with the same settings, it is built
once.

What is counted is what the parts count, by name: an event that does not occur in a part has not
occurred for its rays, 0 times. Cells are those of all parts; ``part`` tells them apart.
"""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ..contract.cells import Cells
from ..contract.counters import Counter, Counts
from ..contract.figures import MAX_DEPTH, N_EV, N_IN, N_OIV, N_V, SAH, Figure
from ..contract.joined_cells import join_cells
from ..contract.needs import refuse_other_classes
from ..contract.ray_order import AUTOMATIC
from ..contract.statistics import Statistics
from ..contract.steps import Steps
from ..contract.structure import Hits, Made, Structure
from ..geometry.rays import Rays
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import parse_inner, setting
from . import found_in_modules

PARTS = {structure.name: structure for structure in found_in_modules(without=__name__)}
"""The structures that rays may be sent to."""

PRIMARY, SHADOW, OTHER = ROUTES = ("primary", "shadow", "other")
"""Classes of rays that have a structure of their own; the last is that of all others."""

# ------------------------------------------------------------------------------------- settings


def route(default: str, label: str, rays: str) -> Any:
    """Declare the structure that some rays go to."""
    return setting(
        default,
        label,
        f"The structure that {rays} go to",
        choices={name: structure.summary for name, structure in PARTS.items()},
    )


def settings_of_route(label: str) -> Any:
    """Declare the settings of that structure."""
    return setting(
        "",
        f"{label} Settings",
        "Settings of that structure, as on the command line, such as C_isect=2,C_trav=1; empty for "
        "its defaults. There they stand in quotes",
    )


@dataclass(frozen=True)
class RoutedSettings:
    """Which structure each class of rays goes to."""

    primary: str = route("bvh", "Primary", "rays from the camera")
    primary_settings: str = settings_of_route("Primary")
    shadow: str = route("grid", "Shadow", "rays to the lights")
    shadow_settings: str = settings_of_route("Shadow")
    other: str = route("bvh", "Other", "rays of all other classes")
    other_settings: str = settings_of_route("Other")


def chosen(settings: RoutedSettings) -> dict[str, tuple[type[Structure], Any]]:
    """Return structure and settings of every route.

    Raises
    ------
    InputError
        For settings that a structure does not have.
    """
    routes: dict[str, tuple[type[Structure], Any]] = {}
    for name in ROUTES:
        kind = PARTS[getattr(settings, name)]
        own: Any = parse_inner(
            kind.Settings, kind.name, getattr(settings, name + "_settings"),
            f"structure routed, {name}",
        )  # fmt: skip
        routes[name] = kind, own
    return routes


# ------------------------------------------------------------------------------- the structure

OF_ALL = (
    N_IN, N_V, N_EV, N_OIV, MAX_DEPTH,
    SAH._replace(meaning=f"{SAH.meaning}; of the structure for other rays, such as random lines"),
)  # fmt: skip
"""Figures of all parts together: sums, the greatest depth, and the cost of random lines."""


def figures_of_parts() -> tuple[Figure, ...]:
    """Return the figures that are shown of every structure, under the name of each route."""
    figures = {
        figure.key: figure
        for structure in PARTS.values()
        for figure in structure.FIGURES
        if figure.label
    }
    return tuple(
        figure._replace(
            key=f"{name}.{figure.key}",
            meaning=f"{figure.meaning}; of the structure for {name} rays",
            section=f"{name.capitalize()} rays: {figure.section.lower()}",
            column="",
        )
        for name in ROUTES
        for figure in figures.values()
    )


class Routed(Structure):
    """A structure for each class of rays.

    Attributes
    ----------
    parts : tuple of Structure
        Each once.
    routes : dict of str to int
        Which of them each of ROUTES leads to.
    """

    name = "routed"
    label = "Routed"
    summary = "Each class of rays goes to a structure of its own"
    Settings = RoutedSettings
    COUNTERS: ClassVar[tuple[Counter, ...]] = tuple(
        {each.name: each for part in PARTS.values() for each in part.COUNTERS}.values()
    )
    FIGURES: ClassVar[tuple[Figure, ...]] = (*OF_ALL, *figures_of_parts())

    def __init__(
        self,
        scene: Scene,
        settings: RoutedSettings,
        parts: tuple[Structure, ...],
        routes: dict[str, int],
    ) -> None:
        self.parts, self.routes = parts, routes
        super().__init__(scene, settings, None, parts[0].geometry)
        self.needs = frozenset().union(*(part.needs for part in parts))  # type: ignore[misc]

    @property
    def arrays(self) -> Any:
        """What the parts are for kernels: none takes them together."""
        return tuple(part.arrays for part in self.parts)

    @arrays.setter
    def arrays(self, arrays: None) -> None:
        """Keep nothing: the parts do."""

    def memory(self) -> int:
        """Return the bytes of all parts."""
        return sum(part.memory() for part in self.parts)

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: RoutedSettings) -> None:
        """Refuse what one of the parts refuses."""
        for kind, own in chosen(settings).values():
            kind.refuse_too_large(scene, own)

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: RoutedSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> Routed:
        """Build the parts, one after the other; there is no log of that."""
        wanted = chosen(settings)
        kinds = list(dict.fromkeys(wanted.values()))
        parts = tuple(kind.build(scene, own, progress) for kind, own in kinds)
        return cls(scene, settings, parts, {n: kinds.index(each) for n, each in wanted.items()})

    @functools.cached_property
    def counters(self) -> tuple[Counter, ...]:
        """What the parts count, each name once."""
        counted = {each.name: each for part in self.parts for each in part.counters}
        names = [each.name for each in self.COUNTERS if each.name in counted]
        return tuple({name: counted[name] for name in [*names, *counted]}.values())

    # ------------------------------------------------------------------------------------ rays

    def parts_of(self, rays: Rays) -> np.ndarray:
        """Return which part each ray goes to, (n,)."""
        of_class = [self.routes.get(name, self.routes[OTHER]) for name in rays.class_names]
        return np.array(of_class, np.int64)[rays.classes]

    def trace(
        self,
        rays: Rays,
        query: int | None = None,
        *,
        threads: int = 0,
        ray_order: str = AUTOMATIC,
        progress: Progress = SILENT,
    ) -> tuple[Hits, Counts]:
        """Trace the rays of each part through it; see :meth:`Structure.trace`."""
        part_of = self.parts_of(rays)
        batches = [(k, np.flatnonzero(part_of == k)) for k in range(len(self.parts))]
        batches = [(k, which) for k, which in batches if len(which)]
        for k, which in batches:
            part = self.parts[k]
            refuse_other_classes(f"{self.name}: {part.name}", part.answers, rays.select(which))
        hits = Hits(np.empty(len(rays)), np.empty(len(rays), self._number_type))
        counts = np.zeros((len(rays), len(self.counters)), np.int32)
        columns = {each.name: column for column, each in enumerate(self.counters)}
        for k, which in batches:
            own = rays if len(which) == len(rays) else rays.select(which)
            found, counted = self.parts[k].trace(
                own, query, threads=threads, ray_order=ray_order, progress=progress
            )
            hits.t[which], hits.primitive[which] = found.t, found.primitive
            for each, values in zip(counted.counters, counted.values.T, strict=True):
                counts[which, columns[each.name]] = values
        return hits, Counts(self.counters, counts)

    def record(self, rays: Rays, index: int, query: int | None = None) -> Steps:
        """Record the walk of one ray through the part that it goes to."""
        part_of = self.parts_of(rays)
        k = int(part_of[index])
        which = np.flatnonzero(part_of == k)
        steps = self.parts[k].record(rays.select(which), int(np.searchsorted(which, index)), query)
        is_own = (steps.cell >= 0) & (steps.level == 0)
        cell = steps.cell.copy()
        cell[is_own] = self._number(k, cell[is_own])
        # As the part itself counts, and what it does not is never met.
        own = {each.name: each for each in steps.counters}
        counters = tuple(own.get(each.name, each) for each in self.counters)
        return dataclasses.replace(steps, cell=cell, counters=counters)

    def answered(self, rays: Rays) -> dict[str, Any]:
        """Return which structure has answered the rays of each class, and how many of all."""
        part_of, shares = self.parts_of(rays), {}
        for number, name in enumerate(rays.class_names):
            of_class = part_of[rays.classes == number]
            if len(of_class):
                shares[name] = {
                    "structure": self.parts[int(of_class[0])].name,
                    "rays": len(of_class),
                    "share": len(of_class) / len(rays),
                }
        return shares

    def made(self) -> Made | None:
        """Return what the lazy ones among the parts have made; None if none is."""
        made = [each for each in (part.made() for part in self.parts) if each is not None]
        return Made(*map(sum, zip(*made, strict=True))) if made else None

    # ----------------------------------------------------------------------------------- cells

    @functools.cached_property
    def _first_numbers(self) -> list[int]:
        """What is added to the numbers of each part's cells."""
        sizes = [len(part.cells()) for part in self.parts[:-1]]
        return np.cumsum([0, *sizes]).tolist()

    def _number(self, k: int, numbers: np.ndarray) -> np.ndarray:
        """Return the numbers that cells of a part have in the whole.

        Those of one part follow those of the other. Where rays add cells they take turns: numbers
        that have been given stay.
        """
        if self.made() is not None:
            return numbers * len(self.parts) + k
        return numbers + self._first_numbers[k]

    def cells(self, progress: Progress = SILENT) -> Cells:
        """Return the cells of all parts; ``part`` says which one each is of."""
        parts = [part.cells(progress) for part in self.parts]
        numbers = [
            self._number(k, np.arange(int(part.numbers.max(initial=-1)) + 1))
            for k, part in enumerate(parts)
        ]
        return join_cells(parts, numbers)

    def statistics(self, progress: Progress = SILENT) -> Statistics:
        """Return the figures of every part under the names of its routes, and their sums.

        SAH terms are of random lines, which are of no class that has a route: they are those of
        the part for other rays.
        """
        parts = [part.statistics(progress) for part in self.parts]
        cells, listed = sum(part.N_V for part in parts), sum(part.N_OIV for part in parts)
        lines = parts[self.routes[OTHER]]
        return Statistics(
            N_IN=sum(part.N_IN for part in parts), N_V=cells, N_EV=sum(part.N_EV for part in parts),
            N_OIV=listed, max_depth=max(part.max_depth for part in parts),
            mean_leaf_size=listed / cells, sah=lines.sah, C_trav=lines.C_trav,
            C_isect=lines.C_isect, expected_inner=lines.expected_inner,
            expected_leaves=lines.expected_leaves, expected_tests=lines.expected_tests,
            leaf_sizes=_sum([part.leaf_sizes for part in parts]),
            depths=_sum([part.depths for part in parts]),
            extra={name: parts[k].to_json() for name, k in self.routes.items()},
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Return what is wrong with the parts."""
        return [f"{part.name}: {each}" for part in self.parts for each in part.validate()]


def _sum(histograms: list[np.ndarray]) -> np.ndarray:
    """Return the sum of histograms of different lengths."""
    longest = max(map(len, histograms))
    return sum(np.pad(each, (0, longest - len(each))) for each in histograms)  # type: ignore[return-value]


STRUCTURE = Routed
