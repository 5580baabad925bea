"""Our structures beside each other and beside slow peers, and where grids have much to skip.

Slow peers are Blender's ``mathutils.bvhtree`` in a Python loop and trimesh's own ray tracer (an
R-tree and NumPy); they get fewer rays.
"""

from __future__ import annotations

import functools
import time
from collections.abc import Callable

import numpy as np
from accelscope.core.contract.structure import Structure
from accelscope.core.evaluation.records.experiment import warm_up
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import general_structures, structure_named
from meshes import meshes
from speed import RAYS, batches_of
from timing import in_turn, ratios, spread, timed

LOOP_RAYS = 5_000
TRIMESH_RAYS = 100  # more need 20 GB at a quarter of a million triangles

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


def built(scene: Scene, spec: str) -> tuple[Callable[[], Structure], Structure]:
    """Return what builds a structure, compiled, and the structure."""
    name, texts = parse_spec(spec)
    kind = structure_named(name)
    settings = parse(kind.Settings, texts, name)
    warm_up(kind, settings)
    build = functools.partial(kind.build, scene, settings)
    return build, build()


def compare(scene: Scene, specs: list[str], batches: dict[str, Rays], rounds: int) -> list[dict]:
    """Measure structures in turn: seconds to build, seconds to trace."""
    made = {spec: built(scene, spec) for spec in specs}
    builds = in_turn({spec: timed(build) for spec, (build, _) in made.items()}, rounds)
    rows = []
    for name, rays in batches.items():
        traces = {
            spec: timed(functools.partial(structure.trace, rays))
            for spec, (_, structure) in made.items()
        }
        seconds = in_turn(traces, rounds)
        for spec, (_, structure) in made.items():
            _, counters = structure.trace(rays)
            rows.append(
                {"mesh": scene.name, "triangles": len(scene), "who": spec, "rays": name,
                 "count": len(rays), "build": builds[spec], "trace": seconds[spec],
                 "bytes_per_triangle": structure.memory() / len(scene), **counters.means()}
            )  # fmt: skip
    return rows


def measure_structures(names: list[str], rounds: int, side: int, lines: int) -> list[dict]:
    """Measure every structure but the naive one, as it is by default."""
    rows: list[dict] = []
    specs = [name for name in general_structures() if name != "naive"]
    for name, scene in meshes(names):
        print(f"  {name}", flush=True)
        rows += compare(scene, specs, batches_of(scene, side, lines), rounds)
    return rows


def measure_stadium(rounds: int, lines: int) -> list[dict]:
    """Measure what empty space costs: the sample's own camera, and random lines."""
    rows: list[dict] = []
    for _, scene in meshes(["teapot in a stadium"]):
        rows += compare(scene, list(STADIUM), batches_of(scene, 512, lines), rounds)
    return rows


def some(rays: Rays, count: int) -> Rays:
    """Return `count` rays spread evenly over a batch."""
    return rays.select(np.linspace(0, len(rays) - 1, min(count, len(rays))).astype(np.int64))


def measure_slow_peers(names: list[str], rounds: int) -> list[dict]:
    """Measure Blender's BVHTree and trimesh's tracer in turn with our hierarchy."""
    rows: list[dict] = []
    for name, scene in meshes(names):
        print(f"  {name}", flush=True)
        batches = batches_of(scene, 512, 200_000)
        build, tree = built(scene, "bvh")
        for peer, measure in (("BVHTree", bvhtree), ("trimesh", trimesh_tracer)):
            try:
                build_peer, trace_peer, count = measure(scene)
            except ImportError as error:
                print(f"  without {peer}: {error}", flush=True)
                continue
            builds = in_turn({"bvh": timed(build), peer: build_peer}, rounds)
            for kind, rays in batches.items():
                few = some(rays, count)
                traces = in_turn(
                    {"bvh": timed(functools.partial(tree.trace, rays)),
                     peer: functools.partial(trace_peer, few)},
                    rounds,
                )  # fmt: skip
                faster = ratios(traces[peer], traces["bvh"]).median * len(rays) / len(few)
                rows.append(
                    {"mesh": name, "triangles": len(scene), "who": peer, "rays": kind,
                     "build": builds[peer], "slower": ratios(builds["bvh"], builds[peer]).median,
                     "rate": len(few) / spread(traces[peer]).median, "faster": faster}
                )  # fmt: skip
    return rows


Peer = tuple[Callable[[], float], Callable[[Rays], float], int]


def bvhtree(scene: Scene) -> Peer:
    """Return what builds Blender's BVHTree and traces one ray after the other; how many rays."""
    import bpy  # noqa: F401 brings mathutils along
    from mathutils import Vector
    from mathutils.bvhtree import BVHTree

    vertices = scene.triangles.reshape(-1, 3).tolist()
    faces = np.arange(len(vertices)).reshape(-1, 3).tolist()
    trees = []

    def build() -> float:
        start = time.perf_counter()
        trees[:] = [BVHTree.FromPolygons(vertices, faces, all_triangles=True)]
        return time.perf_counter() - start

    def trace(rays: Rays) -> float:
        # From the arrays that everybody gets, as such loops are written.
        start = time.perf_counter()
        for origin, direction in zip(rays.origins, rays.directions, strict=True):
            trees[0].ray_cast(Vector(origin), Vector(direction))
        return time.perf_counter() - start

    return build, trace, LOOP_RAYS


def trimesh_tracer(scene: Scene) -> Peer:
    """Return what builds and traces with trimesh, which builds at its first ray; how many rays."""
    import trimesh
    from trimesh.ray.ray_triangle import RayMeshIntersector

    corners = np.arange(3 * len(scene)).reshape(-1, 3)
    mesh = trimesh.Trimesh(scene.triangles.reshape(-1, 3), corners, process=False)
    tracers = []

    def build() -> float:
        start = time.perf_counter()
        tracers[:] = [RayMeshIntersector(mesh)]
        tracers[0].intersects_first(np.zeros((1, 3)), np.ones((1, 3)))
        return time.perf_counter() - start

    def trace(rays: Rays) -> float:
        start = time.perf_counter()
        tracers[0].intersects_first(rays.origins, rays.directions)
        return time.perf_counter() - start

    return build, trace, TRIMESH_RAYS


def report_structures(title: str, rows: list[dict], first: str) -> list[str]:
    """Return a comparison of structures as lines, with ratios to one of them."""
    lines = [f"{title}: medians; ratios to {first} round by round, median (least..greatest)"]
    by_key = {(row["mesh"], row["rays"], row["who"]): row for row in rows}
    for (mesh, rays, who), row in by_key.items():
        base = by_key[mesh, rays, first]
        lines.append(
            f"  {mesh:<14} {rays:<12} {who:<64}"
            f" build {spread(row['build']).median:>8.3f} s,"
            f" x {ratios(row['build'], base['build'])!s:<24}"
            f" {row['count'] / spread(row['trace']).median / 1e6:>8.3f} Mrays/s,"
            f" x {ratios(base['trace'], row['trace'])!s:<24}"
            f" N_TS {row['N_TS']:>8.2f}, {row['bytes_per_triangle']:>6.0f} B/triangle"
        )
    return lines


def report_slow_peers(rows: list[dict]) -> list[str]:
    """Return slow peers as lines."""
    return ["slow peers, and how many times as fast we are, built in how much of their time"] + [
        f"  {row['mesh']:<14} {row['rays']:<12} {row['who']:<8}"
        f" build {spread(row['build']).median:>8.3f} s, x {row['slower']:>7.2f}"
        f"  {row['rate']:>10.0f} rays/s, x {row['faster']:>9.1f}"
        for row in rows
    ]


def markdown_structures(rows: list[dict]) -> list[str]:
    """Return the table of structures for the README."""
    lines = [
        "Our structures against our `bvh`, all by default: seconds to build, rays per second.",
        "",
    ]
    meshes_there = list(dict.fromkeys(row["mesh"] for row in rows))
    by_key = {(row["mesh"], row["rays"], row["who"]): row for row in rows}
    heads = [f"{mesh}: build, camera, random lines" for mesh in meshes_there]
    lines += ["| structure | " + " | ".join(heads) + " |", "|---" * (len(heads) + 1) + "|"]
    for who in dict.fromkeys(row["who"] for row in rows):
        cells = []
        for mesh in meshes_there:
            it, base = ({rays: by_key[mesh, rays, each] for rays in RAYS} for each in (who, "bvh"))
            figures = [
                ratios(it["camera"]["build"], base["camera"]["build"]),
                *(ratios(base[rays]["trace"], it[rays]["trace"]) for rays in RAYS),
            ]
            cells.append(", ".join(f"{each.median:.2f}" for each in figures))
        lines.append(f"| `{who}` | " + " | ".join(cells) + " |")
    return lines


def markdown_slow_peers(rows: list[dict]) -> list[str]:
    """Return slow peers as sentences for the README."""
    return [
        f"{row['who']} on {row['mesh']}, {row['rays']}: our `bvh` is {row['faster']:.0f} times as"
        f" fast, and built in {row['slower']:.2f} times its time."
        for row in rows
    ]
