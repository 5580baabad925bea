"""Speed beside the peers, in one run: ``make bench``. A benchmark, not a test.

Everybody gets the same triangles and rays on the same machine. What is compared runs in turn, round
by round (:mod:`timing`); quote ratios, not seconds. Every section is a file:

- :mod:`speed`: the default hierarchy beside Embree, on real scenes and on Suzanne;
- :mod:`structures`: our structures beside each other, slow peers, the teapot in a stadium;
- :mod:`directional`: directional structures beside the hierarchy, with the rays they are for;
- :mod:`csg`: trees of solids with bounds that are cut, from below, and without;
- :mod:`hierarchies`: builders, optimisers, volumes and arities;
- :mod:`quality`: cost of trees beside those of other programs;
- :mod:`first_use`: compilation, and memory.

At the end it prints, in Markdown, what the README quotes. Peers and meshes that cannot be had on a
machine are named and left out.
"""

from __future__ import annotations

import argparse
import json
import platform
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from csg import SCENES as CSG_SCENES
from csg import markdown_csg, measure_csg, report_csg
from directional import (
    SCENES,
    markdown_directional,
    measure_directional,
    report_directional,
)
from first_use import (
    FEW as FEW_STARTS,
)
from first_use import (
    everything,
    first_use,
    markdown_first_use,
    peak_memory,
    report_first_use,
    report_memory,
)
from hierarchies import SECTIONS, markdown_hierarchies, measure_hierarchies, report_hierarchies
from meshes import CHOICE, FEW, QUALITY, QUICK, WHOLE
from quality import markdown_quality, measure_quality, report_quality
from speed import markdown_speed, measure_speed, report_speed
from structures import (
    markdown_slow_peers,
    markdown_structures,
    measure_slow_peers,
    measure_stadium,
    measure_structures,
    report_slow_peers,
    report_structures,
)
from timing import load_in_words


class Extent(NamedTuple):
    """How much is measured.

    Attributes
    ----------
    rounds : int
        In which contestants run in turn.
    side : int
        Rays in a row of the camera's picture, which is square.
    lines : int
        Random lines.
    speed, structures, slow, hierarchies, quality : sequence of str
        Meshes of these sections.
    directional : sequence of str
        Sample scenes of that section.
    sections : sequence of str
        Of the hierarchies.
    starts, memory : sequence of str
        Structures that are used for the first time, and whose memory is measured.
    start_runs : int
    memory_sample : str
    """

    rounds: int
    side: int
    lines: int
    speed: tuple[str, ...]
    structures: tuple[str, ...]
    directional: tuple[str, ...]
    slow: tuple[str, ...]
    hierarchies: tuple[str, ...]
    quality: tuple[str, ...]
    sections: tuple[str, ...]
    starts: tuple[str, ...]
    memory: tuple[str, ...]
    start_runs: int
    memory_sample: str


USUAL = Extent(
    5, 512, 200_000, WHOLE, FEW, SCENES, ("sponza",), FEW,
    ("bunny", "sponza", "kitchen", "dragon 48k"),
    ("builders", "optimisers", "volumes"), FEW_STARTS, FEW_STARTS, 3, "suzanne:subdivisions=4",
)  # fmt: skip

QUICK_ONE = Extent(
    3, 256, 50_000, QUICK, (), (), ("suzanne 16k",), (), (), (), ("bvh",), (), 1, ""
)  # fmt: skip

ALL = USUAL._replace(
    slow=("sponza", "suzanne"), hierarchies=CHOICE, quality=QUALITY, sections=tuple(SECTIONS),
    starts=tuple(everything()), memory=tuple(everything()), memory_sample="suzanne:subdivisions=5",
)  # fmt: skip


def measure(extent: Extent) -> dict:
    """Run all sections of an extent; return everything, ready for JSON."""
    started = time.monotonic()

    def say(section: str) -> None:
        minutes = (time.monotonic() - started) / 60.0
        print(f"[{minutes:5.1f} min] {section}; {load_in_words(is_ours=True)}", flush=True)

    found: dict = {
        "machine": platform.machine(), "python": platform.python_version(),
        "load_before": load_in_words(is_ours=False),
    }  # fmt: skip
    sizes = extent.rounds, extent.side, extent.lines
    say("beside Embree")
    found["speed"], found["witnesses"] = measure_speed(list(extent.speed), *sizes)
    say("slow peers")
    found["slow"] = measure_slow_peers(list(extent.slow), extent.rounds)
    if extent.structures:
        say("structures")
        found["structures"] = measure_structures(list(extent.structures), *sizes)
        say("the stadium")
        found["stadium"] = measure_stadium(extent.rounds, extent.lines)
    if extent.directional:
        say("trees of solids")
        found["csg"] = measure_csg(CSG_SCENES, extent.rounds, extent.side, extent.lines)
        say("directional structures")
        found["directional"] = measure_directional(extent.directional, extent.rounds, extent.side)
    if extent.sections:
        say("hierarchies")
        # As many rounds as need be: there are dozens of them.
        found["hierarchies"] = measure_hierarchies(
            list(extent.hierarchies), list(extent.sections), 3, extent.lines
        )
    if extent.quality:
        say("cost of trees beside those of other programs")
        found["quality"] = measure_quality(list(extent.quality))
    say("first use")
    found["starts"] = first_use(list(extent.starts), extent.start_runs)
    if extent.memory:
        say("memory")
        found["memory"] = peak_memory(list(extent.memory), extent.memory_sample)
        found["memory_sample"] = extent.memory_sample
    say("done")
    found["load_after"], found["minutes"] = (
        load_in_words(is_ours=True),
        (time.monotonic() - started) / 60.0,
    )
    return found


def sections_of(found: dict, writers: dict[str, Callable[[], list[str]]]) -> list[str]:
    """Return the lines of all sections that were measured."""
    lines = []
    for key, write in writers.items():
        if found.get(key):
            lines += [*write(), ""]
    return lines


def report(found: dict) -> str:
    """Return everything as text, the README's part last."""
    head = (
        f"{found['machine']}, Python {found['python']}; before: {found['load_before']};"
        f" after {found['minutes']:.1f} minutes: {found['load_after']}"
    )
    tables = {
        "speed": lambda: report_speed(found["speed"], found["witnesses"]),
        "slow": lambda: report_slow_peers(found["slow"]),
        "structures": lambda: report_structures("structures", found["structures"], "bvh"),
        "stadium": lambda: report_structures("stadium", found["stadium"], "grid"),
        "csg": lambda: report_csg(found["csg"]),
        "directional": lambda: report_directional(found["directional"]),
        "hierarchies": lambda: report_hierarchies(found["hierarchies"]),
        "quality": lambda: report_quality(found["quality"]),
        "memory": lambda: report_memory(found["memory"], found["memory_sample"]),
        "starts": lambda: report_first_use(found["starts"]),
    }
    readme = {
        "speed": lambda: markdown_speed(found["speed"]),
        "slow": lambda: markdown_slow_peers(found["slow"]),
        "structures": lambda: markdown_structures(found["structures"]),
        "csg": lambda: markdown_csg(found["csg"]),
        "directional": lambda: markdown_directional(found["directional"]),
        "hierarchies": lambda: markdown_hierarchies(found["hierarchies"]),
        "quality": lambda: markdown_quality(found["quality"]),
        "starts": lambda: markdown_first_use(found["starts"]),
    }
    return "\n".join(
        [head, "", *sections_of(found, tables), "# For the README", "", *sections_of(found, readme)]
    )


def main() -> None:
    """Run the benchmark; write bench.txt and bench.json."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    extents = parser.add_mutually_exclusive_group()
    extents.add_argument("--quick", action="store_true", help="beside Embree only, three minutes")
    extents.add_argument("--all", action="store_true", help="every section over every mesh, hours")
    parser.add_argument("--output", type=Path, default=Path("build/bench"))
    given = parser.parse_args()
    found = measure(QUICK_ONE if given.quick else ALL if given.all else USUAL)
    text = report(found)
    print(text)
    given.output.mkdir(parents=True, exist_ok=True)
    (given.output / "bench.txt").write_text(text + "\n")
    (given.output / "bench.json").write_text(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
