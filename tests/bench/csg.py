"""Trees of solids: what cutting saves beside bounds from below, and beside none.

The same random lines and camera rays through the same hierarchy over each sample, three times.

Of a plate with 100 holes cutting saves two thirds of the bounds that camera rays test, and three
fifths of those of random lines through it: on the way down to one hole and to five, the upper half
of the tree is the same. Time is saved in a lower ratio, since every ray is also read, tested with
the hierarchy, and with the plate: a third to a half of the time with bounds that are cut.
"""

from __future__ import annotations

import functools

import numpy as np
from accelscope.core.geometry.csg.settings import CUT, NONE, UPWARD, CuttingSettings
from accelscope.core.geometry.rays import Rays
from accelscope.core.sah.line_sample import random_lines
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.sample_scenes import make_sample
from structures import built
from timing import in_turn, ratios, timed

SCENES = "csg_classic", "csg_rook", "csg_plate", "csg_chain"

CONTESTANTS = CUT, UPWARD, NONE


def measure_csg(specs: tuple[str, ...], rounds: int, side: int, lines: int) -> list[dict]:
    """Measure how long rays take with bounds that are cut, from below, and without, one thread."""
    rows = []
    for spec in specs:
        print(f"  {spec}", flush=True)
        scene = make_sample(spec)
        seen = camera_rays(scene.camera, side, side)
        batches = {
            "camera": Rays.from_arrays(seen.origins, seen.directions),
            "random lines": Rays.from_arrays(*random_lines(scene.lower, scene.upper, lines, 1)),
        }
        made = {
            bounds: built(scene.with_cutting(CuttingSettings(bounds)), "bvh")[1]
            for bounds in CONTESTANTS
        }
        for name, rays in batches.items():
            traces = {
                bounds: timed(functools.partial(structure.trace, rays, threads=1))
                for bounds, structure in made.items()
            }
            for run in traces.values():  # compiled, and read once
                run()
            seconds = in_turn(traces, rounds)
            found = {bounds: structure.trace(rays) for bounds, structure in made.items()}
            hits = found[CUT][0]
            for bounds, (other, counts) in found.items():
                assert np.array_equal(hits.t, other.t)
                rows.append(
                    {"scene": spec, "rays": name, "count": len(rays), "who": bounds,
                     "trace": seconds[bounds], "tests": counts.means()["csg_tests"],
                     "bounds": counts.means()["csg_volume_tests"]}
                )  # fmt: skip
    return rows


def groups_of(rows: list[dict]) -> list[dict[str, dict]]:
    """Return the rows of each scene and set of rays, by the bounds."""
    groups: dict[tuple[str, str], dict[str, dict]] = {}
    for row in rows:
        groups.setdefault((row["scene"], row["rays"]), {})[row["who"]] = row
    return list(groups.values())


def report_csg(rows: list[dict]) -> list[str]:
    """Return the table with spreads."""
    lines = ["## trees of solids: how many times as fast as bounds from below, and as none"]
    for group in groups_of(rows):
        cut = group[CUT]
        faster = [ratios(group[who]["trace"], cut["trace"]) for who in (UPWARD, NONE)]
        tests = ", ".join(f"{group[who]['tests']:.2f} {who}" for who in CONTESTANTS)
        bounds = ", ".join(f"{group[who]['bounds']:.2f} {who}" for who in CONTESTANTS[:2])
        lines.append(
            f"{cut['scene']:12} {cut['rays']:12} {cut['count']:8} rays: {faster[0]}, {faster[1]}; "
            f"leaf tests {tests}; bounds {bounds}"
        )
    return lines


def markdown_csg(rows: list[dict]) -> list[str]:
    """Return the table for the README."""
    lines = [
        "Trees of solids under a `bvh`, one thread: how many times as fast rays are with bounds "
        "that are cut as with bounds from below only, and as without; leaf tests of all three, "
        "and bounds tested.",
        "",
        "| scene | rays | from below | without | leaf tests: cut, from below, without "
        "| bounds: cut, from below |",
        "|---|---|---|---|---|---|",
    ]
    for group in groups_of(rows):
        cut = group[CUT]
        below, without = (
            ratios(group[who]["trace"], cut["trace"]).median for who in (UPWARD, NONE)
        )
        tests = ", ".join(f"{group[who]['tests']:.2f}" for who in CONTESTANTS)
        bounds = ", ".join(f"{group[who]['bounds']:.2f}" for who in CONTESTANTS[:2])
        lines.append(
            f"| {cut['scene']} | {cut['rays']} | {below:.2f} | {without:.2f} | {tests} | {bounds} |"
        )
    return lines
