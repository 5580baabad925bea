"""Builders, optimisers, volumes and arities of the hierarchy: seconds to build, rays per second.

    python tests/bench/hierarchies.py [--subdivisions 4 5]

All over one mesh, with all counters on, beside Embree in the same run. What an optimiser takes is
what the build takes longer with it; its price is that per percent of cost it saves.
"""

from __future__ import annotations

import argparse
import dataclasses

from accelscope.core.evaluation.experiment import warm_up
from accelscope.core.evaluation.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.geometry.rays import Rays
from accelscope.core.reference import Embree
from accelscope.core.scene import Scene
from accelscope.core.settings import parse
from accelscope.core.structures import structure_named
from accelscope.core.structures.contract import Structure
from accelscope.sample_scenes import make_sample
from timing import best_of

BINNED = "builder=binned_sah"

FAST = ("sweep_sah", "sbvh", "ploc")
"""Candidates for the hierarchy that is traced fastest, once rearranged."""


def choices(name: str) -> list[str]:
    """Return what a setting of the hierarchy can be."""
    fields = dataclasses.fields(structure_named("bvh").Settings)
    return list(next(field.metadata["choices"] for field in fields if field.name == name))


def others(name: str) -> list[str]:
    """Return what a setting of the hierarchy can be beside its default."""
    default = getattr(structure_named("bvh").Settings(), name)
    return [choice for choice in choices(name) if choice != default]


SECTIONS: dict[str, list[str]] = {
    "builders": [
        BINNED,
        *(f"builder={name}" for name in others("builder")),
        *(f"builder=ploc,radius={radius}" for radius in (1, 6, 32)),
        "builder=rtree_insert,rtree_split=linear",
    ],
    "optimisers": [
        f"builder={builder},optimise={optimise}"
        for builder in ("binned_sah", "lbvh", "ploc")
        for optimise in others("optimise")
    ],
    "volumes": [f"{BINNED},volume={volume}" for volume in ("aabb", *others("volume"))],
    "arities": [
        f"{first},arity={arity}"
        for first in (BINNED, *(f"builder={name},optimise=reinsert_parallel" for name in FAST))
        for arity in choices("arity")
    ],
}
"""The settings that are compared, by what they compare."""


def measure(scene: Scene, rays: Rays, text: str) -> dict:
    """Return the figures of a hierarchy."""
    kind = structure_named("bvh")
    settings = parse(kind.Settings, dict(part.split("=") for part in text.split(",")), "bvh")
    warm_up(kind, settings)
    trees: list[Structure] = []

    def build() -> None:
        trees[:] = [kind.build(scene, settings)]

    build_seconds = best_of(build)
    built = trees[0]
    _, counters = built.trace(rays)
    seconds = best_of(lambda: built.trace(rays))
    figures = built.statistics()
    return {
        "triangles": len(scene), "settings": text, "build_seconds": build_seconds,
        "rays_per_second": len(rays) / seconds, "sah": figures.sah, "N_IN": figures.N_IN,
        "N_V": figures.N_V, "bytes_per_triangle": built.memory() / len(scene),
        **counters.means(),
    }  # fmt: skip


def measure_hierarchies(scene: Scene, rays: Rays) -> list[dict]:
    """Measure Embree, then all settings of all sections, each once."""
    embree = Embree(scene)
    build = best_of(lambda: Embree(scene))
    seconds = best_of(lambda: embree.trace(rays))
    rows = [
        {"triangles": len(scene), "settings": "embreex", "build_seconds": build,
         "rays_per_second": len(rays) / seconds}
    ]  # fmt: skip
    for text in dict.fromkeys(text for texts in SECTIONS.values() for text in texts):
        print(f"  {text}", flush=True)
        rows.append(measure(scene, rays, text))
    return rows


def report_hierarchies(rows: list[dict]) -> list[str]:
    """Return the sections as lines, with ratios to Embree and to the first row of each."""
    lines = []
    for triangles in dict.fromkeys(row["triangles"] for row in rows):
        found = {row["settings"]: row for row in rows if row["triangles"] == triangles}
        embree = found["embreex"]
        for section, texts in SECTIONS.items():
            first = found[texts[0]]
            lines.append(
                f"hierarchies, {section}, {triangles} triangles, random lines; Embree builds in"
                f" {embree['build_seconds']:.3f} s, {embree['rays_per_second'] / 1e6:.3f} Mrays/s"
            )
            lines.append(
                f"  {'':<54} {'build s':>8} {'x first':>8} {'x embreex':>9} {'SAH':>8}"
                f" {'N_TS':>7} {'tests':>7} {'Mrays/s':>8} {'x first':>8} {'x embreex':>9}"
                f" {'B/tri':>6}"
            )
            for text in texts:
                row = found[text]
                build, rate = row["build_seconds"], row["rays_per_second"]
                lines.append(
                    f"  {text:<54} {build:>8.3f} {build / first['build_seconds']:>8.2f}"
                    f" {build / embree['build_seconds']:>9.2f} {row['sah']:>8.3f}"
                    f" {row['N_TS']:>7.2f} {row['volume_tests']:>7.2f} {rate / 1e6:>8.3f}"
                    f" {rate / first['rays_per_second']:>8.2f}"
                    f" {rate / embree['rays_per_second']:>9.2f} {row['bytes_per_triangle']:>6.0f}"
                )
            if section == "optimisers":
                lines += prices(found, texts)
            lines.append("")
    return lines[:-1]


def prices(found: dict[str, dict], texts: list[str]) -> list[str]:
    """Return what each optimiser saves and what it takes, as lines."""
    lines = [f"  {'':<54} {'SAH':>8} {'then':>8} {'saved':>7} {'seconds':>8} {'s/percent':>9}"]
    for text in texts:
        before, after = found[text.partition(",")[0]], found[text]
        saved = 100.0 * (1.0 - after["sah"] / before["sah"])
        seconds = after["build_seconds"] - before["build_seconds"]
        lines.append(
            f"  {text:<54} {before['sah']:>8.3f} {after['sah']:>8.3f} {saved:>6.2f}%"
            f" {seconds:>8.3f} {seconds / saved if saved else float('nan'):>9.3f}"
        )
    return lines


def main() -> None:
    """Print the sections."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--subdivisions", nargs="+", type=int, default=[4], help="of Suzanne")
    rows = []
    for subdivisions in parser.parse_args().subdivisions:
        scene = make_sample(f"suzanne:subdivisions={subdivisions}")
        rays = RandomLinesWorkload.make(scene, RandomLinesSettings(count=200_000))
        rows += measure_hierarchies(scene, rays)
    print("\n".join(report_hierarchies(rows)))


if __name__ == "__main__":
    main()
