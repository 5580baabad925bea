# SPDX-License-Identifier: GPL-3.0-or-later
"""The package as it is described in pyproject.toml."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
MANIFEST = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))

FLOORS = "core", "sample_scenes", "addon", "operators", "panels"

MODULES = sorted(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py"))


def test_pyproject_lists_every_package() -> None:
    on_disk = {"accelscope"} | {
        ".".join(["accelscope", *path.relative_to(ROOT).parent.parts])
        for floor in FLOORS
        for path in (ROOT / floor).rglob("__init__.py")
    }
    assert on_disk == set(PROJECT["tool"]["setuptools"]["packages"])


def test_every_folder_with_modules_is_a_package() -> None:
    missing = {path.parent for path in MODULES if not (path.parent / "__init__.py").exists()}
    assert not missing


def test_manifest_and_pyproject_agree() -> None:
    assert MANIFEST["id"] == PROJECT["project"]["name"]
    assert MANIFEST["version"] == PROJECT["project"]["version"]
    assert MANIFEST["license"] == [f"SPDX:{PROJECT['project']['license']}"]
    assert f"{MANIFEST['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_manifest_in_the_repository_names_no_wheels() -> None:
    assert "wheels" not in MANIFEST
    assert "platforms" not in MANIFEST


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_module_imports_its_own_package_relatively(path: Path) -> None:
    # As an extension the package is called bl_ext.<repository>.accelscope.
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            absolute = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            absolute = [node.module or ""]
        else:
            continue
        assert not [name for name in absolute if name.split(".")[0] == "accelscope"]


@pytest.mark.parametrize(
    "module", ["accelscope", "accelscope.core", "accelscope.addon.command.main"]
)
def test_module_imports_without_blender(module: str, tmp_path: Path) -> None:
    code = f"import sys; sys.modules['bpy'] = None; import {module}"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
