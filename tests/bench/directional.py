"""Directional structures beside the default hierarchy, each with the rays it is for.

Primary and shadow rays of the databases' scenes, from their own cameras and to their own lights.
"""

from __future__ import annotations

import functools

from accelscope.core.evaluation.rays.camera import CameraSettings, CameraWorkload
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample
from structures import built
from timing import in_turn, ratios, spread, timed

SCENES = (
    "balls", "gears", "lattice:size=6", "rings:size=4", "shells:size=3", "teapot:size=6", "tetra",
    "tree:size=8",
)  # fmt: skip
"""Sizes at which lists stay within some tens of MiB."""

CONTESTANTS = {"primary": ("bvh", "image_directory"), "shadow": ("bvh", "light_buffer")}
"""Which structures are compared, by the class of the rays; the first one is what others beat."""


def batches_of(scene: Scene, side: int) -> dict[str, Rays]:
    """Return the primary and the shadow rays of a picture."""
    settings = CameraSettings(width=side, height=side, shadows=True)
    primary = CameraWorkload.make(scene, settings)
    _, hierarchy = built(scene, "bvh")
    hits, _ = hierarchy.trace(primary)
    generations = CameraWorkload.generations(scene, settings, primary)
    next(generations)
    return {"primary": primary, "shadow": generations.send(hits)}


def measure_directional(specs: tuple[str, ...], rounds: int, side: int) -> list[dict]:
    """Measure how long the rays of each class take, on one thread and on all."""
    rows = []
    for spec in specs:
        print(f"  {spec}", flush=True)
        scene = make_sample(spec)
        for name, rays in batches_of(scene, side).items():
            made = {who: built(scene, who) for who in CONTESTANTS[name]}
            builds = in_turn({who: timed(build) for who, (build, _) in made.items()}, rounds)
            for threads in (1, 0):
                traces = {
                    who: timed(functools.partial(structure.trace, rays, threads=threads))
                    for who, (_, structure) in made.items()
                }
                seconds = in_turn(traces, rounds)
                for who, (_, structure) in made.items():
                    _, counts = structure.trace(rays)
                    rows.append(
                        {"scene": spec, "items": len(scene), "rays": name, "count": len(rays),
                         "who": who, "threads": threads, "build": builds[who],
                         "trace": seconds[who], "N_IT": counts.means()["N_IT"],
                         "bytes": structure.memory()}
                    )  # fmt: skip
    return rows


def pairs_of(rows: list[dict]) -> list[tuple[dict, dict]]:
    """Return each row of a directional structure, behind that of the hierarchy beside it."""
    by_key = {(row["scene"], row["rays"], row["threads"], row["who"]): row for row in rows}
    return [
        (by_key[row["scene"], row["rays"], row["threads"], "bvh"], row)
        for row in rows
        if row["who"] != "bvh"
    ]


def report_directional(rows: list[dict]) -> list[str]:
    """Return the table with spreads."""
    lines = ["## directional structures beside bvh: rate, seconds to build, N_IT, MiB"]
    for base, row in pairs_of(rows):
        faster = ratios(base["trace"], row["trace"])
        lines.append(
            f"{row['scene']:16} {row['rays']:8} {row['count']:8} rays, "
            f"{row['threads'] or 'all'} threads: {row['who']:16} {faster}, built in "
            f"{spread(row['build'])} s, N_IT {row['N_IT']:.2f} for {base['N_IT']:.2f}, "
            f"{row['bytes'] / 2**20:.1f} for {base['bytes'] / 2**20:.1f}"
        )
    return lines


def markdown_directional(rows: list[dict]) -> list[str]:
    """Return the table for the README, of one thread."""
    lines = [
        "Directional structures against our `bvh`, one thread: rays per second, N_IT of both, "
        "seconds to build over those of the `bvh`, memory.",
        "",
        "| scene | `light_buffer`, shadow rays | `image_directory`, primary rays |",
        "|---|---|---|",
    ]
    cells: dict[str, dict[str, str]] = {}
    for base, row in pairs_of(rows):
        if row["threads"] == 1:
            faster = ratios(base["trace"], row["trace"]).median
            slower = ratios(row["build"], base["build"]).median
            cells.setdefault(row["scene"], {})[row["who"]] = (
                f"{faster:.2f}; {row['N_IT']:.2f} for {base['N_IT']:.2f}; {slower:.0f}; "
                f"{row['bytes'] / 2**20:.1f} MiB"
            )
    for scene, each in cells.items():
        lines.append(f"| {scene} | {each['light_buffer']} | {each['image_directory']} |")
    return lines
