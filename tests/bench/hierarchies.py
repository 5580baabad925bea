"""Builders, optimisers, volumes, arities of the hierarchy: to build, for the figures, to trace.

    python tests/bench/hierarchies.py [--rounds N] [--sections NAME ...] [MESH ...]

All counters are on; what is compared runs in turn. What an optimiser takes is what the build takes
longer with it; its price is that per percent of cost it saves. Section `default` is what the
default was chosen by: the geometric mean, over the meshes, of the seconds to build and to trace a
million random lines.
"""

from __future__ import annotations

import argparse
import dataclasses
import tracemalloc
from collections.abc import Callable

from accelscope.core.contract.structure import Structure
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named
from meshes import MESHES, meshes
from structures import built
from timing import geometric_mean, in_turn, ratios, spread, timed


def choices(name: str) -> list[str]:
    """Return what a setting of the hierarchy can be."""
    fields = dataclasses.fields(structure_named("bvh").Settings)
    return list(next(field.metadata["choices"] for field in fields if field.name == name))


def others(name: str) -> list[str]:
    """Return what a setting of the hierarchy can be beside its default."""
    default = getattr(structure_named("bvh").Settings(), name)
    return [choice for choice in choices(name) if choice != default]


PLAIN = "optimise=none"

FAST = ("sweep_sah", "sbvh", "ploc")
"""Candidates for the hierarchy that is traced fastest, once rearranged."""

SECTIONS: dict[str, list[str]] = {
    "default": [
        "bvh",
        *(f"bvh:builder={builder},{PLAIN}" for builder in (
            "binned_sah", "binned_sah,bins=32", "sweep_sah", "ploc", "ploc,radius=6",
            "ploc,radius=32", "hlbvh", "phr", "sbvh", "sbvh,duplication=1.2")),
        *(f"bvh:builder={builder},optimise={optimise}"
          for builder in ("binned_sah", "sweep_sah", "ploc", "ploc,radius=6", "hlbvh", "sbvh")
          for optimise in ("reinsert_batches", "reinsert")),
        *(f"bvh:builder={builder},optimise={optimise},arity=4"
          for builder in ("binned_sah", "ploc") for optimise in ("none", "reinsert_batches")),
    ],
    "builders": [
        f"bvh:builder=binned_sah,{PLAIN}",
        *(f"bvh:builder={name},{PLAIN}" for name in choices("builder") if name != "binned_sah"),
        f"bvh:builder=rtree_insert,rtree_split=linear,{PLAIN}",
        *(f"bvh:builder={name},morton_codes=extended,{PLAIN}"
          for name in ("lbvh", "hlbvh", "ploc", "phr")),
        f"bvh:builder=phr,cut_alpha=0.55,cut_delta=9,{PLAIN}",
    ],
    "optimisers": [
        f"bvh:builder={builder},optimise={optimise}"
        for builder in ("binned_sah", "ploc", "lbvh")
        for optimise in choices("optimise")
    ],
    "volumes": [f"bvh:builder=binned_sah,{PLAIN},volume={volume}" for volume in choices("volume")],
    "arities": [
        f"bvh:builder={builder},optimise={optimise},arity={arity}"
        for builder, optimise in (("binned_sah", "none"), *((name, "reinsert") for name in FAST))
        for arity in choices("arity")
    ],
}  # fmt: skip
"""What is compared; ratios are to the first of each section."""


def peak_of(build: Callable[[], Structure]) -> int:
    """Return the bytes at the peak of a build, those of the structure itself among them."""
    tracemalloc.start()
    try:
        build()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def measure_section(scene: Scene, section: str, rounds: int, lines: int) -> list[dict]:
    """Measure all hierarchies of a section in turn."""
    rays = RandomLinesWorkload.make(scene, RandomLinesSettings(count=lines))
    made = {spec: built(scene, spec) for spec in SECTIONS[section]}
    builds = in_turn({spec: timed(build) for spec, (build, _) in made.items()}, rounds)
    traces = in_turn(
        {spec: timed(lambda tree=tree: tree.trace(rays)) for spec, (_, tree) in made.items()},
        rounds,
    )
    figured = in_turn({spec: timed(tree.statistics) for spec, (_, tree) in made.items()}, rounds)
    rows = []
    for spec, (build, tree) in made.items():
        figures, (_, counters) = tree.statistics(), tree.trace(rays)
        rows.append(
            {"mesh": scene.name, "triangles": len(scene), "section": section, "spec": spec,
             "build": builds[spec], "trace": traces[spec], "statistics": figured[spec],
             "lines": lines, "sah": figures.sah,
             "bytes_per_triangle": tree.memory() / len(scene),
             "peak_per_triangle": peak_of(build) / len(scene), **counters.means()}
        )  # fmt: skip
    return rows


def measure_hierarchies(
    names: list[str], sections: list[str], rounds: int, lines: int
) -> list[dict]:
    """Measure sections over all meshes that can be had."""
    rows: list[dict] = []
    for name, scene in meshes(names):
        for section in sections:
            print(f"  {name}, {section}", flush=True)
            rows += measure_section(scene, section, rounds, lines)
    return rows


def million(row: dict) -> float:
    """Return the seconds of building and of a million lines."""
    return spread(row["build"]).median + spread(row["trace"]).median * 1e6 / row["lines"]


def mean_relative(rows: list[dict], section: str, figure: str) -> dict[str, float]:
    """Return a figure relative to the first of a section, as geometric mean over the meshes.

    Parameters
    ----------
    figure : {"build", "trace", "sah", "million"}
    """
    first = SECTIONS[section][0]
    by_key = {(row["mesh"], row["spec"]): row for row in rows if row["section"] == section}
    relative: dict[str, list[float]] = {}
    for (mesh, spec), row in by_key.items():
        base = by_key[mesh, first]
        if figure == "million":
            value = million(row) / million(base)
        elif figure == "sah":
            value = row["sah"] / base["sah"]
        else:
            value = ratios(row[figure], base[figure]).median
        relative.setdefault(spec, []).append(value)
    return {spec: geometric_mean(values) for spec, values in relative.items()}


def report_hierarchies(rows: list[dict]) -> list[str]:
    """Return the sections as lines, with ratios to the first row of each."""
    lines = []
    for mesh, section in dict.fromkeys((row["mesh"], row["section"]) for row in rows):
        found = {
            row["spec"]: row for row in rows if (row["mesh"], row["section"]) == (mesh, section)
        }
        first = found[SECTIONS[section][0]]
        lines.append(f"hierarchies, {section}: {mesh}, {first['triangles']} triangles")
        lines.append(
            f"  {'':<64} {'build s':>8} {'x first':>8} {'SAH':>8} {'N_TS':>7} {'boxes':>7}"
            f" {'Mlines/s':>8} {'x first':>8} {'B/tri':>6} {'peak':>6}"
            f" {'million':>8} {'figures s':>9}"
        )
        for spec, row in found.items():
            rate = row["lines"] / spread(row["trace"]).median / 1e6
            lines.append(
                f"  {spec:<64} {spread(row['build']).median:>8.3f}"
                f" {ratios(row['build'], first['build']).median:>8.2f} {row['sah']:>8.3f}"
                f" {row['N_TS']:>7.2f} {row['volume_tests']:>7.2f} {rate:>8.3f}"
                f" {ratios(first['trace'], row['trace']).median:>8.2f}"
                f" {row['bytes_per_triangle']:>6.0f} {row['peak_per_triangle']:>6.0f}"
                f" {million(row):>8.3f} {spread(row['statistics']).median:>9.3f}"
            )
        if section == "optimisers":
            lines += prices(found)
        lines.append("")
    for section in dict.fromkeys(row["section"] for row in rows):
        lines.append(f"{section}: build and a million lines, geometric mean over the meshes")
        means = mean_relative(rows, section, "million")
        lines += [
            f"  {spec:<64} {means[spec]:>6.3f}" for spec in sorted(means, key=means.__getitem__)
        ]
    return lines


def prices(found: dict[str, dict]) -> list[str]:
    """Return what each optimiser saves and what it takes, as lines."""
    lines = [f"  {'':<64} {'SAH':>8} {'then':>8} {'saved':>7} {'seconds':>8} {'s/percent':>9}"]
    for spec, after in found.items():
        before = found[f"{spec.partition(',')[0]},{PLAIN}"]
        if before is after:
            continue
        saved = 100.0 * (1.0 - after["sah"] / before["sah"])
        seconds = spread(after["build"]).median - spread(before["build"]).median
        lines.append(
            f"  {spec:<64} {before['sah']:>8.3f} {after['sah']:>8.3f} {saved:>6.2f}%"
            f" {seconds:>8.3f} {seconds / saved if saved else float('nan'):>9.3f}"
        )
    return lines


def markdown_hierarchies(rows: list[dict]) -> list[str]:
    """Return tables for the README: means over the meshes, relative to the first of a section."""
    lines: list[str] = []
    for section in ("builders", "optimisers"):
        there = [row for row in rows if row["section"] == section]
        if not there:
            continue
        meshes_there = ", ".join(dict.fromkeys(row["mesh"] for row in there))
        build, sah, trace = (
            mean_relative(there, section, figure) for figure in ("build", "sah", "trace")
        )
        peaks: dict[str, float] = {}
        for row in there:
            peaks[row["spec"]] = max(peaks.get(row["spec"], 0.0), row["peak_per_triangle"])
        first = SECTIONS[section][0].partition(":")[2]
        lines += [
            f"Relative to `{first}`, geometric means over {meshes_there}; bytes a triangle at the "
            "peak of the build, the largest of them:",
            "",
            f"| {section} | build | SAH cost | random lines | peak |",
            "|---|---|---|---|---|",
        ]
        lines += [
            f"| `{spec.partition(':')[2]}` | {build[spec]:.2f} | {sah[spec]:.2f}"
            f" | {1 / trace[spec]:.2f} | {peaks[spec]:.0f} |"
            for spec in build
        ]
        lines.append("")
    return lines


def main() -> None:
    """Print the sections."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("meshes", nargs="*", metavar="MESH", help=", ".join(MESHES))
    parser.add_argument("--sections", nargs="+", choices=SECTIONS, default=["default"])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--lines", type=int, default=200_000)
    given = parser.parse_args()
    rows = measure_hierarchies(
        given.meshes or ["sponza"], given.sections, given.rounds, given.lines
    )
    print("\n".join(report_hierarchies(rows)))


if __name__ == "__main__":
    main()
