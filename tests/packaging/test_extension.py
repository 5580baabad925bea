# SPDX-License-Identifier: GPL-3.0-or-later
"""The zips: what is in them, and what they do in a Blender that has nothing else."""

import importlib.metadata
import importlib.util
import json
import os
import subprocess
import sys
import sysconfig
import tomllib
import venv
import zipfile
from pathlib import Path
from types import ModuleType

import pytest
from accelscope.core.structures import general_structures
from packaging.requirements import Requirement

pytestmark = pytest.mark.packaging

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent


@pytest.fixture(scope="session")
def build_extension() -> ModuleType:
    """Return the build script as a module."""
    pytest.importorskip("bpy", reason="the build needs Blender's own extension tool")
    path = ROOT / ".ci" / "build_extension.py"
    spec = importlib.util.spec_from_file_location("build_extension", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def zips(build_extension: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the lite zip and the one for Linux, built and validated with Blender's tool."""
    lite, linux = build_extension.build(tmp_path_factory.mktemp("extension"), ["linux-x64"])
    return {"lite": lite, "linux": linux}


@pytest.fixture(scope="session")
def clean_blender(build_extension: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a Python whose environment holds bpy and what bpy itself asks for, nothing else.

    Without it the wheels of the zip would be hidden by those of the development environment.
    """
    folder = tmp_path_factory.mktemp("clean") / "venv"
    venv.create(folder, with_pip=False)
    scheme = {"base": str(folder), "platbase": str(folder)}
    target = Path(sysconfig.get_path("purelib", "venv", vars=scheme))
    wanted, seen = ["bpy"], set()
    while wanted:
        name = wanted.pop()
        if name in seen:
            continue
        seen.add(name)
        distribution = importlib.metadata.distribution(name)
        for line in distribution.requires or []:
            requirement = Requirement(line)
            if not requirement.marker or requirement.marker.evaluate({"extra": ""}):
                wanted.append(requirement.name)
        # Links, because a copy of bpy takes 1 GB.
        for top in {file.parts[0] for file in distribution.files or []} - {"..", "__pycache__"}:
            if not (target / top).exists():
                (target / top).symlink_to(distribution.locate_file(top))
    return folder / "bin" / "python"


def names_in(path: Path) -> list[str]:
    """Return the names of the files in a zip."""
    with zipfile.ZipFile(path) as archive:
        return archive.namelist()


def tree_names() -> set[str]:
    """Return the paths of all modules and data files of the package, seen from its root."""
    floors = ("addon", "core", "operators", "panels", "sample_scenes")
    files = {*ROOT.glob("*.py"), *(ROOT / "sample_scenes" / "data").glob("*")}
    for floor in floors:
        files.update((ROOT / floor).rglob("*.py"))
    return {str(path.relative_to(ROOT)) for path in files}


def test_zip_holds_all_modules_and_nothing_of_development(zips: dict[str, Path]) -> None:
    for path in zips.values():
        names = set(names_in(path))
        tops = {name.split("/")[0] for name in names}
        assert tree_names() <= names
        assert {"__init__.py", "blender_manifest.toml", "LICENSE"} <= names
        assert not tops & {"tests", "build", "Makefile", "pyproject.toml", ".ci", ".gitignore"}
        assert not [name for name in names if "__pycache__" in name]


def test_lite_zip_holds_no_wheels_and_no_large_files(zips: dict[str, Path]) -> None:
    assert not [name for name in names_in(zips["lite"]) if name.endswith(".whl")]
    assert zips["lite"].stat().st_size < 5_000_000


def test_full_zip_holds_every_wheel_for_every_python_but_no_numpy(zips: dict[str, Path]) -> None:
    wheels = [Path(name).name for name in names_in(zips["linux"]) if name.endswith(".whl")]
    for package in ("numba", "llvmlite", "embreex"):
        tags = {wheel.split("-")[2] for wheel in wheels if wheel.startswith(f"{package}-")}
        assert tags == {"cp311", "cp313", "cp314"}
    assert not [wheel for wheel in wheels if wheel.startswith("numpy")]
    with zipfile.ZipFile(zips["linux"]) as archive:
        manifest = tomllib.loads(archive.read("blender_manifest.toml").decode())
    assert manifest["platforms"] == ["linux-x64"]
    assert sorted(Path(wheel).name for wheel in manifest["wheels"]) == sorted(wheels)


def test_bundled_versions_are_those_that_the_tests_run_with(build_extension: ModuleType) -> None:
    for name, version in build_extension.WHEELS.items():
        assert importlib.metadata.version(name) == version


def test_pip_wheel_holds_all_modules_and_data(build_extension: ModuleType, tmp_path: Path) -> None:
    # From a copy: setuptools leaves its build folder in the tree it builds from.
    build_extension.stage(tmp_path / "tree", {})
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
    subprocess.run([*pip, "--wheel-dir", tmp_path, tmp_path / "tree"], check=True)
    (wheel,) = tmp_path.glob("accelscope-*.whl")
    expected = {f"accelscope/{name}" for name in tree_names()}
    assert expected <= set(names_in(wheel))
    assert not [name for name in names_in(wheel) if name.startswith("accelscope/tests")]


ALL = tuple(sorted(general_structures()))
FEW = ("bvh", "grid", "kdtree")


def command(names: tuple[str, ...], path: Path) -> list[str]:
    """Return what the command is asked in the clean Blender, and by the development environment."""
    words = ["evaluate", "sample:tetra:size=3", "--structure", *names]
    return [*words, "--rays", "random_lines:count=100", "--json", str(path)]


def figures(path: Path) -> list[dict]:
    """Return the records of an experiment without what a clock or a machine decides."""
    records = json.loads(path.read_text(encoding="utf-8"))["records"]
    kept = ("scene", "structure", "rays", "statistics", "trace")
    return [{part: untimed(record[part]) for part in kept} for record in records]


def untimed(part: dict) -> dict:
    """Return a part of a record, and what is in it, without times."""
    timed = ("seconds", "rays_per_second", "threads")
    return {
        key: untimed(value) if isinstance(value, dict) else value
        for key, value in part.items()
        if key not in timed
    }


def expected_figures(names: tuple[str, ...], path: Path) -> list[dict]:
    """Return what the development environment finds."""
    subprocess.run([sys.executable, "-m", "accelscope", *command(names, path)], check=True)
    return figures(path)


@pytest.mark.bpy
@pytest.mark.slow
@pytest.mark.parametrize(
    ("kind", "names"),
    [
        # All is compiled anew in there, or runs plain: each structure takes some ten seconds.
        ("lite", FEW),
        ("linux", FEW),
        pytest.param("lite", ALL, marks=pytest.mark.exhaustive),
        pytest.param("linux", ALL, marks=pytest.mark.exhaustive),
    ],
)
def test_zip_works_in_a_clean_blender(
    kind: str,
    names: tuple[str, ...],
    zips: dict[str, Path],
    clean_blender: Path,
    tmp_path: Path,
) -> None:
    resources = tmp_path / "resources"
    report_path = tmp_path / "report.json"
    records_path = tmp_path / "records.json"
    keep = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "BLENDER"))}
    # An empty cache: what a person meets who has just installed the zip.
    own = {"BLENDER_USER_RESOURCES": str(resources), "XDG_CACHE_HOME": str(tmp_path / "cache")}
    script = [clean_blender, HERE / "in_clean_blender.py", zips[kind], report_path]
    done = subprocess.run(
        [*script, *command(names, records_path)],
        cwd=tmp_path,
        env={**keep, **own},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    report = json.loads(report_path.read_text(encoding="utf-8"))

    assert report["enabled"]
    assert report["operators"]
    assert report["leftovers"] == []
    # Starting Blender must not wait for libraries that are used later, or never.
    assert report["imported"] == []
    assert not report["numpy"].startswith(str(resources))
    for module, file in report["wheels"].items():
        if kind == "lite":
            assert file is None, module
        else:
            assert file.startswith(str(resources / "extensions" / ".local")), module

    assert report["exit_code"] == 0
    assert report["folder"].startswith(str(resources))
    # The folder of an extension may be read-only, and is replaced by the next version.
    assert report["compiled_beside_the_code"] == []
    # With the wheels or without, in whatever Blender: the same figures to the last bit.
    expected = expected_figures(names, tmp_path / "expected.json")
    assert len(expected) == len(names)
    assert figures(records_path) == expected
