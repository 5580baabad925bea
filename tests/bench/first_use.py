"""What the first use of a structure takes, when nothing is compiled yet, and memory at its peak.

    python tests/bench/first_use.py [--runs N] [STRUCTURE ...]

Two processes compile; what counts is how long one waits, on a quiet machine. Beside it stand the
seconds of processor time of both, which other programs disturb less.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time

import numpy as np
from accelscope.core.structures import general_structures
from accelscope.sample_scenes import make_sample
from hierarchies import others
from timing import spread

FEW = ("bvh", "grid", "octree", "kdtree", "bsp")
"""Structures of a run that does not look at all."""

FIRST_USE = """
import resource, sys, time
from accelscope.core import kernel_cache
kernel_cache.set_cache_root(sys.argv[1])
from accelscope.addon.command.main import main
main(["evaluate", "sample:tetra", "--quiet", "--structure", sys.argv[2],
      "--rays", "random_lines:count=1000"])
used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
print(time.time() - float(sys.argv[3]), sum(each.ru_utime + each.ru_stime for each in used))
"""

MEMORY = """
import resource, sys
import numpy as np
from accelscope.core.scene import Scene
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import general_structures, structure_named

def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20

name, texts = parse_spec(sys.argv[2])
kind = structure_named(name)
settings = parse(kind.Settings, texts, name)
few = Scene.from_triangles(np.random.default_rng(1).random((20, 3, 3)), "few")
kind.build(few, settings)  # loads what is compiled
triangles = np.load(sys.argv[1], mmap_mode="r")
before = peak()
kind.build(Scene.from_triangles(triangles, "many"), settings)
print(peak() - before)
"""


def everything() -> list[str]:
    """Return all structures, and the hierarchy with everything else it can be made of."""
    kinds = ("builder", "optimise", "volume", "arity")
    return [
        *general_structures(),
        *(f"bvh:{kind}={name}" for kind in kinds for name in others(kind)),
    ]


def numbers_printed(program: str, *arguments: str) -> list[float]:
    """Run a program of Python in a process of its own and return the numbers that it prints."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments], check=True, capture_output=True, text=True
    )
    return [float(number) for number in done.stdout.split()]


Use = dict[str, list[float]]
"""The seconds of some runs: those waited and those of processors, the first time and later."""


def first_use(specs: list[str], runs: int) -> dict[str, Use]:
    """Measure starting, building and tracing with nothing compiled, and later.

    Parameters
    ----------
    runs : int
        Each with an empty cache of kernels; the first structure is run so often, the others once.
    """
    found = {}
    for spec in specs:
        use: Use = {"first": [], "first_cpu": [], "later": [], "later_cpu": []}
        for _ in range(runs if spec == specs[0] else 1):
            with tempfile.TemporaryDirectory() as cache:
                for when in ("first", "later"):
                    waited, used = numbers_printed(FIRST_USE, cache, spec, str(time.time()))
                    use[when].append(waited)
                    use[f"{when}_cpu"].append(used)
        found[spec] = use
    return found


def peak_memory(specs: list[str], sample: str) -> dict[str, float]:
    """Measure by how much the most memory of a process, in GiB, rises by a scene and its structure.

    Its triangles lie in a file: making the sample takes more than building over it.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/triangles.npy"
        np.save(path, make_sample(sample).triangles)
        return {spec: numbers_printed(MEMORY, path, spec)[0] for spec in specs}


def report_first_use(starts: dict[str, Use]) -> list[str]:
    """Return first uses as lines."""
    head = "start, build and trace: seconds waited and of processors with nothing compiled; later"
    return [head] + [
        f"  {spec:<34} " + " ".join(f"{spread(times)!s:<24}" for times in use.values()).rstrip()
        for spec, use in starts.items()
    ]


def report_memory(memory: dict[str, float], sample: str) -> list[str]:
    """Return peaks as lines."""
    return [f"memory of {sample} and of building over it, at its peak, GiB"] + [
        f"  {spec:<34} {gib:6.2f}" for spec, gib in memory.items()
    ]


def markdown_first_use(starts: dict[str, Use]) -> list[str]:
    """Return a sentence for the README."""
    each = ", ".join(
        f"{spread(use['first']).median:.1f} s for `{spec}`" for spec, use in starts.items()
    )
    return [f"The first use after an installation, which compiles, takes {each} on two cores."]


def main() -> None:
    """Print first uses."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("structures", nargs="*", default=list(FEW))
    parser.add_argument("--runs", type=int, default=3, help="of the first structure")
    arguments = parser.parse_args()
    print("\n".join(report_first_use(first_use(arguments.structures, arguments.runs))))


if __name__ == "__main__":
    main()
