"""Refit against rebuild over an animation: what it costs to keep the tree of the first frame.

Two levels follow in their own way: the top level is built anew, bottom levels are kept or refitted.

Each frame gives two records, both over the same rays: one of the first frame's tree refitted, one
of a tree built for that frame. They are records as an experiment makes them, with ``frame`` and
``method`` ("refit" or "rebuild") in front; ``build.seconds`` is the time of the refit or of the
build. A frame that is refused gives two failed records.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any

from ...contract.figures import look_up
from ...contract.protocols import Refittable
from ...contract.structure import Structure
from ...errors import InputError
from ...kernels import announcing
from ...lessons.moment import Moment
from ...lessons.refit import moment_of
from ...progress import SILENT, Progress
from ...scene import Scene
from ..rays.workloads import Workload
from .experiment import (
    Built,
    build,
    make_failed_record,
    make_record,
    refuse_not_finite,
    trace_rays,
)
from .report import Record, aligned, failure, show_number, show_seconds

METHODS = ("refit", "rebuild")


@dataclass
class Comparison:
    """An animation, compared frame by frame.

    Attributes
    ----------
    kind : type
        The structure, one that is Refittable.
    settings
        Its settings.
    workload, workload_settings
        What is traced in every frame.
    threads : int
        0 takes every core.
    records : list of dict
        Two per frame: refit, rebuild.
    history : list of Moment
        One per frame, for the lesson.
    original : Structure
        That of the first frame.
    last : tuple of (Built, Built)
        Those of the last frame, refitted and built anew.
    """

    kind: type[Structure]
    settings: Any
    workload: type[Workload]
    workload_settings: Any
    threads: int = 0
    progress: Progress = SILENT
    records: list[Record] = field(default_factory=list)
    history: list[Moment] = field(default_factory=list)
    original: Structure | None = None
    last: tuple[Built, Built] | None = None

    def add(self, number: int, scene: Scene) -> None:
        """Compare refit and rebuild in one more frame; the first one gives the tree.

        Whatever is raised, nothing is added then.

        Raises
        ------
        InputError
            If the frame has other triangles than the first, or if its tree cannot be built, its
            rays cannot be made, or a figure of its record is no number.
        Cancelled
            From the progress.
        """
        if not self.kind.keeps_instances:
            scene = scene.flat()  # a mesh that is deformed is no instance any more
        rebuilt = build(scene, self.kind, self.settings, self.progress)
        original = self.original or rebuilt.structure
        assert isinstance(original, Refittable)
        if self.original is None:
            with announcing(self.progress, "refit"):
                original.refitted(scene)  # compiles, which is not to be measured
        start = time.perf_counter()
        moved = original.refitted(scene, self.progress)
        both = Built(moved, time.perf_counter() - start), rebuilt
        rays = self.workload.make(scene, self.workload_settings)
        records = []
        for method, built in zip(METHODS, both, strict=True):
            traced = trace_rays(
                built, self.workload, self.workload_settings, rays, self.threads, self.progress
            )
            record = make_record(built, traced, self.progress)
            refuse_not_finite(record)
            records.append({"frame": number, "method": method, **record})
        costs = map(cost_of, records)
        self.history.append(moment_of(number, moved, rebuilt.structure, *costs))
        self.records += records
        self.original, self.last = self.original or rebuilt.structure, both

    def add_failure(self, number: int, scene: Scene | str, reason: str) -> None:
        """Note that a frame was refused, and why."""
        record = make_failed_record(
            scene, self.kind, self.settings, self.workload, self.workload_settings, reason
        )
        self.records += [{"frame": number, "method": method, **record} for method in METHODS]


def animate(
    frames: Iterable[tuple[int, Scene]],
    kind: type[Structure],
    settings: Any,
    workload: type[Workload],
    workload_settings: Any,
    threads: int = 0,
    progress: Progress = SILENT,
) -> Comparison:
    """Compare refit and rebuild, frame by frame.

    Parameters
    ----------
    frames : iterable of (int, Scene)
        Number and scene of each, at least one; taken one after the other.
    kind : type
        The structure, one that is Refittable.
    settings
        Its settings.

    Raises
    ------
    InputError
        If a frame has other triangles than the first, which it names.
    Cancelled
        From `progress`.
    """
    comparison = Comparison(kind, settings, workload, workload_settings, threads, progress)
    for number, scene in frames:
        try:
            comparison.add(number, scene)
        except InputError as error:
            raise InputError(f"frame {number}: {error}", *error.names) from None
    if comparison.last is None:
        raise InputError("there is no frame to compare; name at least one")
    return comparison


def cost_of(record: Record) -> float:
    """Return the SAH cost of a structure; of two levels, that of both."""
    statistics = record["statistics"]
    for key in ("sah_rebraided", "sah_two_levels"):
        if key in statistics:
            return float(statistics[key])
    return float(statistics["sah"])


def growth(refitted: Record, rebuilt: Record) -> float:
    """Return the SAH cost of a refitted tree over that of a new one."""
    cost = cost_of(rebuilt)
    return cost_of(refitted) / cost if cost > 0.0 else 1.0


def figure(path: str) -> Callable[[Record], Any]:
    """Return what looks up a figure of a record, such as ``"trace.N_TS"``."""
    return lambda record: look_up(record, path.split("."))


COLUMNS = (
    ("SAH", cost_of, show_number),
    ("overlap", figure("statistics.overlap"), show_number),
    ("N_TS", figure("trace.N_TS"), show_number),
    ("N_IT", figure("trace.N_IT"), show_number),
    ("time", figure("build.seconds"), show_seconds),
)


def table(records: list[Record]) -> str:
    """Return the records as an aligned table, a line per frame: refit / rebuild."""
    rows = [["frame", *(title for title, _, _ in COLUMNS), "SAH refit / rebuild"]]
    for pair in zip(records[::2], records[1::2], strict=True):
        if "error" in pair[0]:
            rows.append([str(pair[0]["frame"]), failure(pair[0])])
            continue
        figures = [
            " / ".join(show(figure_of(record)) for record in pair) for _, figure_of, show in COLUMNS
        ]
        rows.append([str(pair[0]["frame"]), *figures, f"{growth(*pair):.3f}"])
    return aligned(rows)
