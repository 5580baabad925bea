"""Embree through open3d, on as many threads as asked for: a process that builds and traces.

    python serve.py

It answers each line of JSON on its standard input with one on its standard output:

    {"do": "build", "corners": FILE, "threads": N}   ->  {"copy": s, "commit": s, "again": s}
    {"do": "trace", "rays": FILE, "threads": N}      ->  {"seconds": s, "hits": n}

FILE is one of NumPy's: (n, 3, 3) float32 corners, (n, 6) float32 origins and directions. 0 threads
are all. Embree builds at the first ray: `commit` is what a batch of one ray takes, `again` what one
more takes. Files are read and turned into open3d's arrays before the clock starts.
"""

import functools
import json
import sys
import time

import numpy as np
import open3d

ONE_RAY = open3d.core.Tensor(np.array([[0, 0, 0, 1, 1, 1]], np.float32))


@functools.lru_cache(maxsize=8)
def tensor(path):
    """Return the rays of a file as open3d takes them."""
    return open3d.core.Tensor(np.load(path))


@functools.lru_cache(maxsize=1)
def mesh(path):
    """Return vertices and indices of a file of triangles as open3d takes them."""
    vertices = np.load(path).reshape(-1, 3)
    indices = np.arange(len(vertices), dtype=np.uint32).reshape(-1, 3)
    return open3d.core.Tensor(vertices), open3d.core.Tensor(indices)


def seconds_of(work, *arguments, **named):
    """Return what a call takes and what it returns."""
    start = time.perf_counter()
    found = work(*arguments, **named)
    return time.perf_counter() - start, found


def build(corners, threads):
    """Return the scene, and what each part of building took."""
    prepared = mesh(corners)
    start = time.perf_counter()
    scene = open3d.t.geometry.RaycastingScene(nthreads=threads)
    scene.add_triangles(*prepared)
    copy = time.perf_counter() - start
    commit, again = (seconds_of(scene.cast_rays, ONE_RAY)[0] for _ in range(2))
    return scene, {"copy": copy, "commit": commit, "again": again}


def main():
    """Answer until the input ends."""
    scene = None
    for line in sys.stdin:
        asked = json.loads(line)
        if asked["do"] == "build":
            scene, answer = build(asked["corners"], asked["threads"])
        else:
            rays = tensor(asked["rays"])
            seconds, found = seconds_of(scene.cast_rays, rays, nthreads=asked["threads"])
            hits = int(np.isfinite(found["t_hit"].numpy()).sum())
            answer = {"seconds": seconds, "hits": hits}
        print(json.dumps(answer), flush=True)


main()
