"""Embree, the peer that sets the measure: through embreex and through open3d.

Both copy the triangles when a scene is made, and let Embree build (commit) at the first ray. Copy
and commit are therefore timed apart, the latter by a batch of a single ray. Witness: the second
batch of a single ray takes microseconds.

How they choose threads, as seen in the processor time that they take:

- embreex commits on all cores that the process may use (Embree's own pool of tasks, TBB), and
  traces on one: a loop over single rays.
- open3d commits on as many threads as its scene is made for, and traces on as many as each call
  asks for; 0 are all.

They count in float32, and nothing else than hits.
"""

from __future__ import annotations

import json
import subprocess
import time
from pathlib import Path
from typing import Any, Self

import numpy as np
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene
from fetched import SOURCES, open3d_python

ONE_RAY = np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32)


def as_float32(rays: Rays) -> tuple[np.ndarray, np.ndarray]:
    """Return origins and directions, (n, 3) float32 each, of rays without an end.

    Raises
    ------
    ValueError
        If some end: embreex writes its hits into the array of their ends.
    """
    if not np.isinf(rays.t_max).all():
        raise ValueError("the benchmark traces rays without an end")
    return rays.origins.astype(np.float32), rays.directions.astype(np.float32)


class Embreex:
    """Embree through embreex. Times are of its own calls; arrays are made before.

    Attributes
    ----------
    copy, commit, again : list of float
        Seconds of each build: making a scene and adding the triangles, the first batch of one ray,
        the second.
    cores : list of float
        Processor time of each commit over its seconds.
    """

    def __init__(self, scene: Scene, batches: dict[str, Rays]) -> None:
        self._corners = scene.triangles.astype(np.float32)
        self._batches = {name: as_float32(rays) for name, rays in batches.items()}
        self._built: Any = None
        self.copy: list[float] = []
        self.commit: list[float] = []
        self.again: list[float] = []
        self.cores: list[float] = []

    def build(self) -> float:
        """Build anew; return the seconds of the commit."""
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        start = time.perf_counter()
        built = EmbreeScene()
        mesh = TriangleMesh(built, self._corners)
        self.copy.append(time.perf_counter() - start)
        start, busy = time.perf_counter(), time.process_time()
        built.run(*ONE_RAY, output=True)
        self.commit.append(time.perf_counter() - start)
        self.cores.append((time.process_time() - busy) / self.commit[-1])
        start = time.perf_counter()
        built.run(*ONE_RAY, output=True)
        self.again.append(time.perf_counter() - start)
        self._built = built, mesh  # the scene does not keep the mesh
        return self.commit[-1]

    def trace(self, name: str) -> float:
        """Trace a batch on one thread, all it can; return the seconds."""
        start = time.perf_counter()
        self._built[0].run(*self._batches[name], output=True)
        return time.perf_counter() - start


class Open3D:
    """Embree through open3d, in a process with an environment of its own.

    Raises
    ------
    MISSING
        If it cannot be had on this machine.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._process = subprocess.Popen(
            [open3d_python(), SOURCES / "open3d" / "serve.py"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )  # fmt: skip
        self.copy: list[float] = []
        self.again: list[float] = []
        self.hits: dict[str, int] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.communicate()

    def _ask(self, **question: object) -> dict:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        try:
            print(json.dumps(question), file=self._process.stdin, flush=True)
            answer = self._process.stdout.readline()
        except BrokenPipeError:
            answer = ""
        if not answer:
            _, said = self._process.communicate()
            raise OSError(f"open3d: {said.strip().splitlines()[-1] if said.strip() else 'silent'}")
        return json.loads(answer)

    def prepare(self, scene: Scene, batches: dict[str, Rays]) -> None:
        """Write triangles and rays where the process finds them, and let it read them."""
        self.copy.clear()
        self.again.clear()
        np.save(self._folder / f"{scene.name}.npy", scene.triangles.astype(np.float32))
        self._corners = str(self._folder / f"{scene.name}.npy")
        self._rays = {}
        for name, rays in batches.items():
            path = self._folder / f"{scene.name} {name}.npy"
            np.save(path, np.concatenate(as_float32(rays), axis=1))
            self._rays[name] = str(path)
        self.build(0)

    def build(self, threads: int) -> float:
        """Build anew on so many threads, 0 for all; return the seconds of the commit."""
        answer = self._ask(do="build", corners=self._corners, threads=threads)
        self.copy.append(answer["copy"])
        self.again.append(answer["again"])
        return answer["commit"]

    def trace(self, name: str, threads: int) -> float:
        """Trace a batch on so many threads, 0 for all; return the seconds."""
        answer = self._ask(do="trace", rays=self._rays[name], threads=threads)
        self.hits[name] = answer["hits"]
        return answer["seconds"]
