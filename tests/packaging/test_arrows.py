# SPDX-License-Identifier: GPL-3.0-or-later
"""The arrows between modules, drawn from their imports: none leads upward, none round in a circle.

Imports inside functions and those for types alone count like all others.
"""

import ast
import graphlib
from collections.abc import Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

# Which floors the modules of a floor may import, beside their own.
BELOW = {
    "core": set(),
    "sample_scenes": {"core"},
    "addon": {"core", "sample_scenes"},
    "operators": {"addon", "core", "sample_scenes"},
    "panels": {"operators", "addon", "core", "sample_scenes"},
}
# The rooms of the core from the ground up; the ground itself are the modules beside them.
ROOMS = (
    "geometry", "scene", "files", "contract", "structures", "sah", "pipeline", "probes", "lessons",
    "evaluation",
)  # fmt: skip

# Blender's own modules, which the core must do without.
BLENDER = {"bpy", "bmesh", "mathutils", "gpu", "gpu_extras", "bpy_extras", "blf", "bl_ext"}

MODULES = {
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path
    for floor in BELOW
    for path in sorted((ROOT / floor).rglob("*.py"))
}


def imports_of(path: Path) -> set[str]:
    """Return the full names of all that a module imports, at any depth of its code."""
    package = path.relative_to(ROOT).parent.parts
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            names.add(node.module or "")
        elif isinstance(node, ast.ImportFrom):
            base = [*package[: len(package) - node.level + 1], *(node.module or "").split(".")]
            base = [part for part in base if part]
            # What is imported from a package may itself be a module.
            for alias in node.names:
                full = ".".join([*base, alias.name])
                names.add(full if full in MODULES else ".".join(base))
    return names


ARROWS = {name: imports_of(path) for name, path in MODULES.items()}


def circle_in(arrows: Mapping[str, set[str]]) -> list[str]:
    """Return the modules of a circle in the order of their imports; none if there is none."""
    try:
        graphlib.TopologicalSorter(arrows).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def height_of(module: str) -> int:
    """Return how high the room of one of core's modules lies, 0 for the ground."""
    room = module.split(".")[1] if "." in module else ""
    return 1 + ROOMS.index(room) if room in ROOMS else 0


def test_every_floor_and_every_room_has_modules() -> None:
    assert {name.split(".")[0] for name in MODULES} == set(BELOW)
    folders = {path.name for path in (ROOT / "core").iterdir() if (path / "__init__.py").exists()}
    assert folders == set(ROOMS)


def test_a_circle_is_found() -> None:
    assert set(circle_in({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}})) == {"a", "b", "c"}
    assert circle_in({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == []


def test_no_circle_of_imports() -> None:
    # A package that its own modules import themselves from would be one, too.
    arrows = {name: {each for each in found if each != name} for name, found in ARROWS.items()}
    assert circle_in(arrows) == []


@pytest.mark.parametrize("module", MODULES)
def test_no_arrow_leads_upward(module: str) -> None:
    floor = module.split(".")[0]
    for name in ARROWS[module]:
        first = name.split(".")[0]
        if floor == "core":
            assert first not in BLENDER
        if name in MODULES and first == floor == "core":
            assert height_of(name) <= height_of(module), f"{module} imports {name}"
        elif name in MODULES:
            assert first == floor or first in BELOW[floor], f"{module} imports {name}"


@pytest.mark.parametrize("module", [name for name in MODULES if not name.startswith("core.")])
def test_nobody_above_the_core_knows_a_structure_by_name(module: str) -> None:
    """They find them all, and ask of each what it declares."""
    named = [name for name in ARROWS[module] if name.startswith("core.structures.")]
    assert named == []
