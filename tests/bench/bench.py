"""Speed beside the peers, in one run: ``make bench``. A benchmark, not a test.

Peers: Embree through embreex, Blender's ``mathutils.bvhtree`` in a Python loop, trimesh's own ray
tracer. Everybody gets the same triangles and rays on the same machine; slow peers get fewer rays.
Quote ratios, not seconds. Every figure is the best of some runs, since other programs disturb.

The hierarchies have sections of their own (:mod:`hierarchies`), and so has the quality of their
trees beside those of other implementations (:mod:`quality`).
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from accelscope.core.evaluation.experiment import warm_up
from accelscope.core.evaluation.workloads import (
    CameraSettings,
    CameraWorkload,
    RandomLinesSettings,
    RandomLinesWorkload,
)
from accelscope.core.geometry.rays import Rays
from accelscope.core.parallel import core_count
from accelscope.core.reference import Embree
from accelscope.core.scene import Scene
from accelscope.core.settings import parse
from accelscope.core.structures import structure_named, structures
from accelscope.sample_scenes import make_sample
from hierarchies import measure_hierarchies, others, report_hierarchies
from meshes import MESHES
from quality import measure_quality, report_quality
from timing import best_of

SUBDIVISIONS = {"16k": 2, "250k": 4, "1M": 5}
LOOP_RAYS = 20_000
TRIMESH_RAYS = 200  # more need 20 GB at a quarter of a million triangles


def some(rays: Rays, count: int) -> Rays:
    """Return `count` rays spread evenly over a batch."""
    return rays.select(np.linspace(0, len(rays) - 1, min(count, len(rays))).astype(np.int64))


def measure_ours(scene: Scene, batches: dict[str, Rays], rows: list[dict]) -> None:
    """Measure every structure but the naive one, all counters on."""
    for name, structure_type in structures().items():
        if name == "naive":
            continue
        settings = structure_type.Settings()
        warm_up(structure_type, settings)
        structure = structure_type.build(scene, settings)
        build = best_of(lambda: structure_type.build(scene, settings))  # noqa: B023 run at once
        for rays_name, rays in batches.items():
            seconds = best_of(lambda: structure.trace(rays))  # noqa: B023 run at once
            rows.append(
                row(scene, name, rays_name, build, len(rays) / seconds)
                | {"bytes_per_triangle": structure.memory() / len(scene)}
            )


def measure_embree(scene: Scene, batches: dict[str, Rays], rows: list[dict]) -> None:
    """Measure Embree: float32, one thread for rays, all for the build."""
    embree = Embree(scene)
    build = best_of(lambda: Embree(scene))
    for rays_name, rays in batches.items():
        seconds = best_of(lambda: embree.trace(rays))  # noqa: B023 run at once
        rows.append(row(scene, "embreex", rays_name, build, len(rays) / seconds))


def measure_bvhtree(scene: Scene, batches: dict[str, Rays], rows: list[dict]) -> None:
    """Measure Blender's BVHTree, which takes one ray at a time."""
    import bpy  # noqa: F401 brings mathutils along
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree

    vertices = scene.triangles.reshape(-1, 3).tolist()
    faces = np.arange(len(vertices)).reshape(-1, 3).tolist()
    build = best_of(lambda: BVHTree.FromPolygons(vertices, faces, all_triangles=True))
    tree = BVHTree.FromPolygons(vertices, faces, all_triangles=True)
    for rays_name, rays in batches.items():
        few = some(rays, LOOP_RAYS)

        def loop(few: Rays = few) -> None:
            # From the arrays that everybody gets, as such loops are written.
            for origin, direction in zip(few.origins, few.directions, strict=True):
                tree.ray_cast(Vector(origin), Vector(direction))

        seconds = best_of(loop)
        rows.append(row(scene, "BVHTree", rays_name, build, len(few) / seconds))


def measure_trimesh(scene: Scene, batches: dict[str, Rays], rows: list[dict]) -> None:
    """Measure trimesh's own ray tracer (an R-tree and NumPy)."""
    import trimesh
    from trimesh.ray.ray_triangle import RayMeshIntersector

    mesh = trimesh.Trimesh(
        scene.triangles.reshape(-1, 3), np.arange(3 * len(scene)).reshape(-1, 3), process=False
    )
    start = time.perf_counter()
    tracer = RayMeshIntersector(mesh)
    tracer.intersects_first(*ends(some(batches["camera"], 1)))
    build = time.perf_counter() - start
    for rays_name, rays in batches.items():
        few = some(rays, TRIMESH_RAYS)
        start = time.perf_counter()  # once: it takes seconds
        tracer.intersects_first(*ends(few))
        seconds = time.perf_counter() - start
        rows.append(row(scene, "trimesh", rays_name, build, len(few) / seconds))


def ends(rays: Rays) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions."""
    return rays.origins, rays.directions


def row(scene: Scene, who: str, rays: str, build: float, rate: float) -> dict:
    """Return one line of the result."""
    return {
        "triangles": len(scene), "who": who, "rays": rays, "build_seconds": build,
        "rays_per_second": rate,
    }  # fmt: skip


STADIUM = (
    "grid", "macro_grid", "macro_grid:regions=octant",
    "grid:resolution=300x200x40,assignment=exact",
    "macro_grid:resolution=300x200x40,assignment=exact",
    "macro_grid:resolution=300x200x40,assignment=exact,regions=octant",
    "grid:resolution=600x400x80,assignment=exact",
    "macro_grid:resolution=600x400x80,assignment=exact",
    "octree", "kdtree", "bsp", "bvh",
)  # fmt: skip
"""Whose rates are compared in the scene that grids fear: a teapot in a stadium."""


def measure_stadium() -> list[dict]:
    """Measure what empty space costs: the sample's own camera, and random lines."""
    scene = make_sample("teapot_in_stadium")
    batches = {
        "camera": CameraWorkload.make(scene, CameraSettings()),
        "random_lines": RandomLinesWorkload.make(scene, RandomLinesSettings(count=200_000)),
    }
    found = []
    for spec in STADIUM:
        name, _, texts = spec.partition(":")
        structure_type = structure_named(name)
        given = dict(text.split("=") for text in texts.split(",") if text)
        settings = parse(structure_type.Settings, given, name)
        warm_up(structure_type, settings)
        structure = structure_type.build(scene, settings)
        for rays_name, rays in batches.items():
            _, counters = structure.trace(rays)
            seconds = best_of(lambda: structure.trace(rays))  # noqa: B023 run at once
            found.append(
                row(scene, spec, rays_name, float("nan"), len(rays) / seconds)
                | {"N_TS": counters.means()["N_TS"]}
            )
    return found


def everything() -> list[str]:
    """Return all structures, and the hierarchy with everything else it can be made of."""
    kinds = ("builder", "optimise", "volume", "arity")
    return [
        *structures(),
        *(f"bvh:{kind}={name}" for kind in kinds for name in others(kind)),
    ]


def peak_memory(size: str) -> dict[str, float]:
    """Measure the most memory, in GiB, that a process takes which builds one structure."""
    program = (
        "import resource, sys;"
        "from accelscope.core.settings import parse, parse_spec;"
        "from accelscope.core.structures import structure_named;"
        "from accelscope.sample_scenes import make_sample;"
        "scene = make_sample(sys.argv[1]);"
        "name, texts = parse_spec(sys.argv[2]);"
        "kind = structure_named(name);"
        "kind.build(scene, parse(kind.Settings, texts, name));"
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20)"
    )
    sample = f"suzanne:subdivisions={SUBDIVISIONS[size]}"
    return {
        name: float(
            subprocess.run(
                [sys.executable, "-c", program, sample, name],
                check=True, capture_output=True, text=True,
            ).stdout
        )
        for name in everything()
    }  # fmt: skip


def first_use() -> dict[str, dict[str, float]]:
    """Measure starting, building and tracing: nothing compiled yet, and again."""
    program = (
        "import sys, time; start = time.perf_counter();"
        "from accelscope.core import kernels; kernels.set_cache_root(sys.argv[1]);"
        "from accelscope.addon.command import main;"
        "main(['evaluate', 'sample:tetra', '--quiet', '--structure', sys.argv[2],"
        "'--rays', 'random_lines:count=1000']);"
        "print(time.perf_counter() - start)"
    )
    found = {}
    for name in everything():
        with tempfile.TemporaryDirectory() as cache:
            runs = [
                float(
                    subprocess.run(
                        [sys.executable, "-c", program, cache, name],
                        check=True, capture_output=True, text=True,
                    ).stdout
                )
                for _ in range(2)
            ]  # fmt: skip
        found[name] = {"first_seconds": runs[0], "later_seconds": runs[1]}
    return found


def report(
    rows: list[dict],
    starts: dict[str, dict[str, float]],
    stadium: list[dict],
    memory: dict[str, float],
    hierarchies: list[dict],
    quality: list[dict],
) -> str:
    """Return the result as text, with ratios to Embree, to BVHTree and to our BVH."""
    lines = [
        f"{platform.machine()}, {core_count()} cores, load {os.getloadavg()[0]:.1f}; "
        f"Python {platform.python_version()}",
        "",
        f"{'triangles':>9}  {'rays':<12}  {'who':<10}  {'build s':>8}  {'x embreex':>9}"
        f"  {'x bvh':>7}  {'Mrays/s':>8}  {'x embreex':>9}  {'x BVHTree':>9}  {'x bvh':>7}"
        f"  {'B/triangle':>10}",
    ]
    by_key = {(each["triangles"], each["rays"], each["who"]): each for each in rows}
    for (triangles, rays, who), each in by_key.items():
        embree, bvh, loop = (
            by_key[triangles, rays, peer] for peer in ("embreex", "bvh", "BVHTree")
        )
        build, rate = each["build_seconds"], each["rays_per_second"]
        lines.append(
            f"{triangles:>9}  {rays:<12}  {who:<10}  {build:>8.3f}"
            f"  {build / embree['build_seconds']:>9.2f}  {build / bvh['build_seconds']:>7.2f}"
            f"  {rate / 1e6:>8.3f}  {rate / embree['rays_per_second']:>9.2f}"
            f"  {rate / loop['rays_per_second']:>9.1f}  {rate / bvh['rays_per_second']:>7.2f}"
            f"  {each.get('bytes_per_triangle', float('nan')):>10.0f}"
        )
    lines += ["", "teapot in a stadium: rays per second against the first row, and steps a ray"]
    first = {each["rays"]: each["rays_per_second"] for each in reversed(stadium)}
    lines += [
        f"  {each['rays']:<12}  {each['who']:<48}"
        f"  {each['rays_per_second'] / first[each['rays']]:>6.2f}  {each['N_TS']:>8.2f}"
        for each in sorted(stadium, key=lambda each: each["rays"])
    ]
    lines += ["", "memory of a process that builds the largest of these scenes, GiB"]
    lines += [f"  {name:<34} {gib:6.2f}" for name, gib in memory.items()]
    lines += ["", "start, build and trace: seconds with nothing compiled, and later"]
    lines += [
        f"  {name:<34} {each['first_seconds']:6.2f} {each['later_seconds']:6.2f}"
        for name, each in starts.items()
    ]
    lines += ["", *report_hierarchies(hierarchies), "", *report_quality(quality)]
    return "\n".join(lines)


def main() -> None:
    """Run the benchmark and write build/bench/bench.json."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", nargs="+", choices=SUBDIVISIONS, default=list(SUBDIVISIONS))
    parser.add_argument("--meshes", nargs="*", choices=MESHES, default=list(MESHES))
    parser.add_argument("--output", type=Path, default=Path("build/bench"))
    arguments = parser.parse_args()
    starts = first_use()
    rows: list[dict] = []
    hierarchies: list[dict] = []
    for size in arguments.sizes:
        print(f"measuring {size} triangles ...", flush=True)
        scene = make_sample(f"suzanne:subdivisions={SUBDIVISIONS[size]}")
        batches = {
            "camera": CameraWorkload.make(scene, CameraSettings()),
            "random_lines": RandomLinesWorkload.make(scene, RandomLinesSettings(count=200_000)),
        }
        measure_ours(scene, batches, rows)
        measure_embree(scene, batches, rows)
        measure_bvhtree(scene, batches, rows)
        measure_trimesh(scene, batches, rows)
        if size != "16k":
            hierarchies += measure_hierarchies(scene, batches["random_lines"])
    print("measuring the stadium ...", flush=True)
    stadium = measure_stadium()
    memory = peak_memory(arguments.sizes[-1])
    print("comparing trees ...", flush=True)
    quality = measure_quality(arguments.meshes)
    text = report(rows, starts, stadium, memory, hierarchies, quality)
    print(text)
    arguments.output.mkdir(parents=True, exist_ok=True)
    (arguments.output / "bench.txt").write_text(text + "\n")
    document = {
        "rows": rows, "starts": starts, "stadium": stadium, "peak_gib": memory,
        "hierarchies": hierarchies, "quality": quality,
    }  # fmt: skip
    (arguments.output / "bench.json").write_text(json.dumps(document, indent=1))


if __name__ == "__main__":
    main()
