"""Refit against rebuild over an animation: what it costs to keep the tree of the first frame.

Each frame gives two records, both over the same rays: one of the first frame's tree refitted, one
of a tree built for that frame. They are records as an experiment makes them, with ``frame`` and
``method`` ("refit" or "rebuild") in front; ``build.seconds`` is the time of the refit or of the
build.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from ..errors import InputError
from ..progress import SILENT, Progress
from ..scene import Scene
from ..structures.bvh import BVH
from ..structures.bvh.exhibits.refit import Moment, moment_of
from ..structures.bvh.refit import refit
from .experiment import Built, build, make_record, trace_rays
from .report import Record, aligned, look_up, show_number, show_seconds
from .workloads import Workload

METHODS = ("refit", "rebuild")


@dataclass(frozen=True)
class Comparison:
    """What came of an animation.

    Attributes
    ----------
    records : list of dict
        Two per frame: refit, rebuild.
    history : list of Moment
        One per frame, for the exhibit.
    last : tuple of (Built, Built)
        The trees of the last frame, refitted and built anew.
    """

    records: list[Record]
    history: list[Moment]
    last: tuple[Built, Built]


def animate(
    frames: Iterable[tuple[int, Scene]],
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
    settings : BVHSettings

    Raises
    ------
    InputError
        If a frame has other triangles than the first, which it names.
    Cancelled
        From `progress`.
    """
    records: list[Record] = []
    history: list[Moment] = []
    original, last = None, None
    for number, scene in frames:
        rebuilt = build(scene, BVH, settings, progress)
        assert isinstance(rebuilt.structure, BVH)
        if original is None:
            original = rebuilt.structure
            refit(original, scene)  # compiles, which is not to be measured
        try:
            start = time.perf_counter()
            moved = refit(original, scene, progress)
            refitted = Built(moved, time.perf_counter() - start)
        except InputError as error:
            raise InputError(f"frame {number}: {error}") from None
        last = refitted, rebuilt
        rays = workload.make(scene, workload_settings)
        for method, built in zip(METHODS, last, strict=True):
            traced = trace_rays(built, workload, workload_settings, rays, threads, progress)
            records.append({"frame": number, "method": method, **make_record(built, traced)})
        costs = (record["statistics"]["sah"] for record in records[-2:])
        history.append(moment_of(number, moved, *costs))
    if last is None:
        raise InputError("there is no frame to compare; name at least one")
    return Comparison(records, history, last)


def growth(refitted: Record, rebuilt: Record) -> float:
    """Return the SAH cost of a refitted tree over that of a new one."""
    cost = rebuilt["statistics"]["sah"]
    return refitted["statistics"]["sah"] / cost if cost > 0.0 else 1.0


COLUMNS = (
    ("SAH", ("statistics", "sah"), show_number),
    ("overlap", ("statistics", "overlap"), show_number),
    ("N_TS", ("trace", "N_TS"), show_number),
    ("N_IT", ("trace", "N_IT"), show_number),
    ("time", ("build", "seconds"), show_seconds),
)


def table(records: list[Record]) -> str:
    """Return the records as an aligned table, a line per frame: refit / rebuild."""
    rows = [["frame", *(title for title, _, _ in COLUMNS), "SAH refit / rebuild"]]
    for pair in zip(records[::2], records[1::2], strict=True):
        figures = [
            " / ".join(show(look_up(record, path)) for record in pair) for _, path, show in COLUMNS
        ]
        rows.append([str(pair[0]["frame"]), *figures, f"{growth(*pair):.3f}"])
    return aligned(rows)
