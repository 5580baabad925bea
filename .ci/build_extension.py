#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Build the zips that Blender installs, and validate them with Blender's own tool.

    make extension
    .venv/bin/python .ci/build_extension.py --lite-only
    .venv/bin/python .ci/build_extension.py --platform linux-x64

``accelscope-VERSION-lite.zip`` holds no wheels and runs on Blender's NumPy alone, in any Python.
``accelscope-VERSION-PLATFORM.zip`` holds the wheels too, for each Python that a Blender for that
platform runs: Blender refuses an extension whose wheels leave out its Python.
"""

import argparse
import email
import importlib.util
import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OUTPUT = ROOT / "build" / "extension"

# The versions are those of the extra `extension` in pyproject.toml, which the tests run with too.
# NumPy is not among them and must not be: it would take the place of Blender's own NumPy and break
# other extensions.
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
WHEELS = dict(
    line.partition(";")[0].strip().split("==")
    for line in PROJECT["optional-dependencies"]["extension"]
)

# The NumPy inside the Blenders that the wheels go to: 4.5 LTS and 5.0; 5.1 and 5.2 LTS; Debian's
# own 5.2. What the wheels ask of NumPy is held against these.
BLENDER_NUMPY = ("1.26.4", "2.3.4", "2.4.6")

# Blender's name of a platform: pip's name, and the Pythons of the Blenders made for it. 3.14 is
# what Debian's own Blender 5.2 runs on.
PLATFORMS = {
    "windows-x64": ("win_amd64", ("3.11", "3.13")),
    "macos-arm64": ("macosx_14_0_arm64", ("3.11", "3.13")),
    "linux-x64": ("manylinux_2_28_x86_64", ("3.11", "3.13", "3.14")),
}


def cache_folder() -> Path:
    """Return the folder outside the checkout that keeps what was downloaded."""
    own = os.environ.get("ACCELSCOPE_CACHE")
    if own:
        return Path(own)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "accelscope"


def blender_tool() -> tuple[Path, Path]:
    """Return the paths of Blender's extension tool and of its list of known tags."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or not spec.origin:
        sys.exit("This needs Blender's extension tool: run it with .venv/bin/python (make venv).")
    package = Path(spec.origin).parent
    tool = next(package.rglob("bl_pkg/cli/blender_ext.py"))
    tags = next(package.rglob("_bpy_internal/extensions/tags.py"))
    return tool, tags


def run_blender_tool(command: str, *arguments: str) -> None:
    """Run a command of Blender's extension tool, with Blender's own list of tags."""
    tool, tags = blender_tool()
    done = subprocess.run(
        [sys.executable, str(tool), command, "--valid-tags", str(tags), *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode != 0:
        sys.exit(f"Blender's tool refused to {command}:\n{done.stdout}{done.stderr}")


def fetch_wheels(platform: str) -> list[Path]:
    """Return the wheels for a platform, downloaded into the cache where they are not there yet."""
    pip_platform, pythons = PLATFORMS[platform]
    wheels: dict[str, Path] = {}
    for python in pythons:
        folder = cache_folder() / "wheels" / f"{platform}-{python}"
        for name, version in WHEELS.items():
            if not list(folder.glob(f"{name}-{version}-*.whl")):
                print(f"Fetching {name} {version} for {platform}, Python {python}", flush=True)
                target = ["--platform", pip_platform, "--python-version", python]
                options = ["--quiet", "--no-deps", "--only-binary=:all:", "--dest", str(folder)]
                pip = [sys.executable, "-m", "pip", "download"]
                subprocess.run([*pip, *options, *target, f"{name}=={version}"], check=True)
            (wheel,) = folder.glob(f"{name}-{version}-*.whl")
            check_requirements(wheel)
            # Wheels of pure Python are the same for every version.
            wheels[wheel.name] = wheel
    return list(wheels.values())


def check_requirements(wheel: Path) -> None:
    """Stop if a wheel asks for something that neither the zip nor Blender brings."""
    from packaging.requirements import Requirement

    with zipfile.ZipFile(wheel) as archive:
        metadata = next(n for n in archive.namelist() if n.endswith(".dist-info/METADATA"))
        message = email.message_from_bytes(archive.read(metadata))
    for line in message.get_all("Requires-Dist", []):
        requirement = Requirement(line)
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        brought = BLENDER_NUMPY if requirement.name == "numpy" else (WHEELS.get(requirement.name),)
        for version in brought:
            if version is None or not requirement.specifier.contains(version, prereleases=True):
                sys.exit(f"{wheel.name} asks for {requirement}, but the extension has {version}")


def stage(folder: Path, wheels: dict[str, list[Path]]) -> None:
    """Copy the tree into a folder, with wheels beside it and in its manifest.

    Parameters
    ----------
    folder : Path
        Emptied first.
    wheels : dict of str to list of Path
        The wheels for each platform; empty for an extension without any.
    """
    shutil.rmtree(folder, ignore_errors=True)
    # Asking git leaves out caches and build results; files not yet committed are taken along.
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    for name in listed.stdout.split("\0"):
        if name and (ROOT / name).is_file():
            target = folder / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, target)
    if not wheels:
        return

    names = sorted({wheel.name for files in wheels.values() for wheel in files})
    (folder / "wheels").mkdir()
    for files in wheels.values():
        for wheel in files:
            target = folder / "wheels" / wheel.name
            if not target.exists():
                target.symlink_to(wheel)
    lines = ["platforms = ["]
    lines += [f'  "{platform}",' for platform in wheels]
    lines += ["]", "wheels = ["]
    lines += [f'  "./wheels/{name}",' for name in names]
    lines += ["]", "", ""]
    manifest = folder / "blender_manifest.toml"
    # In TOML whatever follows a table's heading belongs to that table, so they go before the first.
    head, heading, tables = manifest.read_text(encoding="utf-8").partition("[permissions]")
    manifest.write_text(head + "\n".join(lines) + heading + tables, encoding="utf-8")


def check_zip(path: Path, wheels: list[Path]) -> None:
    """Stop unless a zip is valid for Blender and holds what it should, and nothing else."""
    run_blender_tool("validate", str(path))
    with zipfile.ZipFile(path) as archive:
        names = archive.namelist()
    packed = {Path(name).name for name in names if name.endswith(".whl")}
    if packed != {wheel.name for wheel in wheels}:
        sys.exit(f"{path.name} holds other wheels than it should: {sorted(packed)}")
    unwanted = [
        name
        for name in names
        if name.startswith(("tests/", ".", "build/")) or Path(name).name.startswith("numpy-")
    ]
    if unwanted:
        sys.exit(f"{path.name} holds what it should not: {unwanted}")
    print(f"{os.path.relpath(path)}: {path.stat().st_size / 1e6:.2f} MB, {len(names)} files")


def build(output: Path, platforms: list[str]) -> list[Path]:
    """Build the lite zip and one full zip for each of the platforms, and check them.

    Parameters
    ----------
    output : Path
        The folder to put them into.
    platforms : list of str
        Keys of `PLATFORMS`.

    Returns
    -------
    list of Path
        The zips, the lite one first.
    """
    output.mkdir(parents=True, exist_ok=True)
    with (ROOT / "blender_manifest.toml").open("rb") as file:
        version = tomllib.load(file)["version"]
    staged = output / "stage" / "accelscope"

    stage(staged, {})
    lite = output / f"accelscope-{version}-lite.zip"
    run_blender_tool("build", "--source-dir", str(staged), "--output-filepath", str(lite))
    check_zip(lite, [])
    zips = [lite]

    if platforms:
        wheels = {platform: fetch_wheels(platform) for platform in platforms}
        stage(staged, wheels)
        run_blender_tool(
            "build", "--source-dir", str(staged), "--output-dir", str(output), "--split-platforms"
        )
        for platform in platforms:
            full = output / f"accelscope-{version}-{platform.replace('-', '_')}.zip"
            check_zip(full, wheels[platform])
            zips.append(full)
    shutil.rmtree(output / "stage")
    return zips


def main() -> None:
    """Read the options and build."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder for the zips")
    parser.add_argument("--lite-only", action="store_true", help="leave out the full zips")
    parser.add_argument(
        "--platform",
        action="append",
        choices=list(PLATFORMS),
        help="build the full zip for this platform only (may be repeated)",
    )
    options = parser.parse_args()
    platforms = [] if options.lite_only else options.platform or list(PLATFORMS)
    build(options.output.resolve(), platforms)


if __name__ == "__main__":
    main()
