"""Speed beside Embree: the default hierarchy, thread for thread and all cores against all cores.

All counters are on in ours. Building is compared with Embree's commit (:mod:`embree`), which leaves
its copying out, while ours has it in. For one core, ours is held on one, and open3d's scene is made
for one thread.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

from accelscope.core.contract.structure import Structure
from accelscope.core.evaluation.rays.workloads import (
    CameraSettings,
    CameraWorkload,
    RandomLinesSettings,
    RandomLinesWorkload,
)
from accelscope.core.evaluation.records.experiment import warm_up
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named
from embree import Embreex, Open3D
from fetched import MISSING
from meshes import meshes
from timing import Spread, geometric_mean, in_turn, one_core, ratios, spread, timed

RAYS = "camera", "random lines"

OURS = "bvh"


def batches_of(scene: Scene, side: int, lines: int) -> dict[str, Rays]:
    """Return the rays that everybody traces: a camera's, and random lines."""
    return {
        "camera": CameraWorkload.make(scene, CameraSettings(width=side, height=side)),
        "random lines": RandomLinesWorkload.make(scene, RandomLinesSettings(count=lines)),
    }


class Ours:
    """Our default hierarchy."""

    def __init__(self, scene: Scene) -> None:
        self._scene, self._type = scene, structure_named(OURS)
        self._settings = self._type.Settings()
        warm_up(self._type, self._settings)
        self.built: Structure = self._type.build(scene, self._settings)

    def build(self) -> None:
        """Build on all cores that this thread may use."""
        self.built = self._type.build(self._scene, self._settings)

    def build_alone(self) -> float:
        """Build on one core; return the seconds."""
        with one_core():
            return timed(self.build)()


def measure(
    scene: Scene, open3d: Open3D | None, rounds: int, side: int, lines: int
) -> tuple[list[dict], dict[str, list[float]]]:
    """Measure one scene.

    Returns
    -------
    rows : list of dict
        Scene, what was done, who, on how many cores, and the seconds round by round.
    witness : dict of str to list of float
        What shows that a commit was one.
    """
    batches = batches_of(scene, side, lines)
    ours, embreex = Ours(scene), Embreex(scene, batches)
    for rays in batches.values():
        ours.built.trace(rays)
    builds: dict[tuple[str, str], Callable[[], float]] = {
        (OURS, "all"): timed(ours.build),
        ("embreex", "all"): embreex.build,
    }
    if open3d is not None:
        open3d.prepare(scene, batches)
        builds["open3d", "all"] = functools.partial(open3d.build, 0)
        builds[OURS, "one"] = ours.build_alone
        builds["open3d", "one"] = functools.partial(open3d.build, 1)
    rows = list(rows_of(scene, "build", len(scene), builds, rounds))
    for name, rays in batches.items():
        traces: dict[tuple[str, str], Callable[[], float]] = {
            (OURS, "one"): timed(functools.partial(ours.built.trace, rays, threads=1)),
            ("embreex", "one"): functools.partial(embreex.trace, name),
            (OURS, "all"): timed(functools.partial(ours.built.trace, rays)),
        }
        if open3d is not None:
            traces["open3d", "one"] = functools.partial(open3d.trace, name, 1)
            traces["open3d", "all"] = functools.partial(open3d.trace, name, 0)
        rows += rows_of(scene, name, len(rays), traces, rounds)
    rows.append(
        {"mesh": scene.name, "triangles": len(scene), "what": "copy", "count": len(scene),
         "who": "embreex", "cores": "one", "seconds": embreex.copy}
    )  # fmt: skip
    witness = {"commit": embreex.commit, "again": embreex.again, "cores": embreex.cores}
    return rows, witness


def rows_of(
    scene: Scene,
    what: str,
    count: int,
    contestants: dict[tuple[str, str], Callable[[], float]],
    rounds: int,
) -> Iterator[dict]:
    """Let contestants run in turn; yield a row for each."""
    named = {f"{who} {cores}": run for (who, cores), run in contestants.items()}
    found = in_turn(named, rounds)
    for who, cores in contestants:
        yield {
            "mesh": scene.name, "triangles": len(scene), "what": what, "count": count,
            "who": who, "cores": cores, "seconds": found[f"{who} {cores}"],
        }  # fmt: skip


def measure_speed(names: list[str], rounds: int, side: int, lines: int) -> tuple[list[dict], dict]:
    """Measure all meshes that can be had; with open3d if it can be had."""
    rows: list[dict] = []
    witnesses: dict[str, dict] = {}
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        open3d: Open3D | None = None
        try:
            open3d = stack.enter_context(Open3D(Path(folder)))
        except MISSING as error:
            print(f"  without open3d: {error}", flush=True)
        for name, scene in meshes(names):
            print(f"  {name}, {len(scene)} triangles", flush=True)
            try:
                found, witness = measure(scene, open3d, rounds, side, lines)
            except MISSING as error:
                print(f"  without open3d: {error}", flush=True)
                open3d = None
                found, witness = measure(scene, open3d, rounds, side, lines)
            rows += found
            witnesses[name] = witness | {"triangles": len(scene)}
    return rows, witnesses


COLUMNS = [
    ("build", "all", "embreex"), ("build", "all", "open3d"), ("build", "one", "open3d"),
    *((rays, "one", "embreex") for rays in RAYS),
    *((rays, cores, "open3d") for cores in ("one", "all") for rays in RAYS),
]  # fmt: skip
"""What is compared: what is done, on which cores, with whom."""


def compared(rows: list[dict], mesh: str, what: str, cores: str, who: str) -> Spread | None:
    """Return ours against a peer's: seconds to build, or rates of rays; None if one is missing."""
    found = {
        row["who"]: row["seconds"]
        for row in rows
        if (row["mesh"], row["what"], row["cores"]) == (mesh, what, cores)
    }
    if OURS not in found or who not in found:
        return None
    if what == "build":
        return ratios(found[OURS], found[who])
    return ratios(found[who], found[OURS])


def report_speed(rows: list[dict], witnesses: dict) -> list[str]:
    """Return everything as lines: seconds, then ratios."""
    lines = ["beside Embree: median seconds (least..greatest), and per second of the median"]
    for row in rows:
        seconds = spread(row["seconds"])
        lines.append(
            f"  {row['mesh']:<14} {row['triangles']:>9}  {row['what']:<12}  {row['who']:<8}"
            f" {row['cores']:<4} {seconds!s:<28} {row['count'] / seconds.median / 1e6:>8.3f} M/s"
        )
    lines += [
        "",
        "witness: seconds of a first and of a second batch of one ray, cores of the first",
    ]
    lines += [
        f"  {name:<14} {each['triangles']:>9}  {spread(each['commit'])!s:<28}"
        f"  {spread(each['again'])!s:<32}  {spread(each['cores'])}"
        for name, each in witnesses.items()
    ]
    lines += ["", "ratios of ours to theirs, round by round: median (least..greatest)"]
    for what, cores, who in COLUMNS:
        for mesh in dict.fromkeys(row["mesh"] for row in rows):
            found = compared(rows, mesh, what, cores, who)
            if found is not None:
                lines.append(f"  {what:<12}  {cores:<4} {who:<8}  {mesh:<14} {found}")
    return lines


def markdown_speed(rows: list[dict]) -> list[str]:
    """Return the table for the README."""
    columns = [
        ("build", "all", "embreex"), ("build", "one", "open3d"),
        ("camera", "one", "embreex"), ("random lines", "one", "embreex"),
        ("camera", "all", "open3d"), ("random lines", "all", "open3d"),
    ]  # fmt: skip
    heads = [
        f"{what}, {'one core' if cores == 'one' else 'all cores'}, {who}"
        for what, cores, who in columns
    ]
    names = list(dict.fromkeys(row["mesh"] for row in rows))
    table = {
        name: [compared(rows, name, *column) for column in columns] for name in names
    }  # fmt: skip
    lines = [
        "Our default `bvh` against Embree (float32, SIMD, no counters): seconds to build as a"
        " multiple of its commit, rays per second as a share of its rate. Medians of ratios round"
        " by round. Each head names who brought Embree: embreex traces on one thread only.",
        "",
        "| mesh (triangles) | " + " | ".join(heads) + " |",
        "|---" * (len(heads) + 1) + "|",
    ]
    for name in names:
        triangles = next(row["triangles"] for row in rows if row["mesh"] == name)
        cells = ["-" if each is None else f"{each.median:.2f}" for each in table[name]]
        lines.append(f"| {name} ({triangles:,}) | " + " | ".join(cells) + " |")
    means = []
    for column in zip(*table.values(), strict=True):
        there = [each.median for each in column if each is not None]
        means.append(f"{geometric_mean(there):.2f}" if there else "-")
    return [*lines, "| geometric mean | " + " | ".join(means) + " |"]
