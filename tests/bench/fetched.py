"""What the benchmark fetches: packages that carry meshes, and the programs of the peers.

Everything goes into a directory of the cache, outside the checkout; only sources of our own stand
in ``tests/bench/peers``. What cannot be had raises one of :data:`MISSING`, and who asked does
without.
"""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

SOURCES = Path(__file__).parent / "peers"

MISSING = (OSError, subprocess.CalledProcessError)
"""What is raised where a program, a package or the network is not there."""

OPEN3D = "open3d-cpu==0.20.0"
"""Six hundred megabytes with what it asks for, so it has an environment of its own."""


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
def node_script(peer: str, script: str) -> Path:
    """Return a script for Node.js, the packages that it wants beside it."""
    folder = fresh_copy(peer)
    run("npm", "install", "--ignore-scripts", "--no-audit", "--no-fund", "--silent", folder=folder)
    return folder / script


@functools.cache
def open3d_python() -> Path:
    """Return the interpreter of an environment that has open3d, made if need be (two minutes)."""
    folder = cache_folder() / f"open3d-{sys.version_info.major}.{sys.version_info.minor}"
    python, ready = folder / "bin" / "python", folder / "ready"
    if not ready.exists():
        run(sys.executable, "-m", "venv", "--clear", folder, folder=cache_folder())
        run(python, "-m", "pip", "install", "--quiet", OPEN3D, folder=folder)
        ready.touch()
    return python


@functools.cache
def debian_file(package: str, name: str) -> Path:
    """Return a file of a Debian package, which is unpacked but not installed."""
    folder = cache_folder() / package
    if not (folder / name).exists():
        folder.mkdir(exist_ok=True)
        run("apt-get", "download", "--quiet", package, folder=folder)
        for archive in folder.glob("*.deb"):
            run("dpkg-deb", "--extract", archive, folder, folder=folder)
            archive.unlink()
    return folder / name


@functools.cache
def crate_folder(crate: str) -> Path:
    """Return where cargo has unpacked the sources of a crate that the peer names."""
    folder = fresh_copy("obvhs")
    run("cargo", "fetch", "--quiet", folder=folder)
    found = json.loads(run("cargo", "metadata", "--format-version", "1", folder=folder))
    manifests = {each["name"]: each["manifest_path"] for each in found["packages"]}
    return Path(manifests[crate]).parent
