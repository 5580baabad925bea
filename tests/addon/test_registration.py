"""The add-on leaves nothing behind, and starts without waiting for Numba."""

from __future__ import annotations

import pkgutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

LEFTOVERS = """
import sys
import bpy
import accelscope


def registered():
    names = {f"type {name}" for name in dir(bpy.types)}
    names |= {f"operator {name}" for name in dir(bpy.ops.accelscope)}
    names |= {f"scene {name}" for name in dir(bpy.types.Scene)}
    names |= {f"scene property {name}" for name in bpy.types.Scene.bl_rna.properties.keys()}
    for event in dir(bpy.app.handlers):
        listed = getattr(bpy.app.handlers, event)
        if isinstance(listed, list):
            names |= {f"handler {event} {function}" for function in listed}
    return names


before = registered()
for _ in range(2):
    accelscope.register()
    assert registered() > before
    assert not {"numba", "embreex"} & set(sys.modules) or _, "imported at registration"
    bpy.ops.accelscope.add_sample_scene(sample="tetra")
    bpy.ops.accelscope.build()
    bpy.ops.accelscope.trace()
    bpy.ops.accelscope.step_ray()
    accelscope.unregister()
    assert registered() == before, registered() ^ before
print("clean")
"""

LEFT_REGISTERED = """
import bpy
import accelscope

accelscope.register()
bpy.ops.mesh.primitive_cube_add()
bpy.ops.accelscope.build()
print("left registered")
"""


def run(code: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    # A handler that is left when Python exits hangs Blender 4.5: hence the time limit.
    return subprocess.run(
        [sys.executable, "-c", code],
        cwd=cwd, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("code", "last"), [(LEFTOVERS, "clean"), (LEFT_REGISTERED, "left registered")]
)
def test_in_a_process_of_its_own(code: str, last: str, tmp_path: Path) -> None:
    done = run(code, tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert last in done.stdout


def test_panels_and_operators_are_found(bpy: Any) -> None:
    from accelscope import operators, panels

    verbs = {module.name for module in pkgutil.iter_modules(operators.__path__)}
    assert len(verbs) >= 14
    assert set(dir(bpy.ops.accelscope)) == verbs
    topics = {module.name for module in pkgutil.iter_modules(panels.__path__)}
    topics -= {"base", "ray_handles"}  # what they have in common; gizmos
    prefix = "VIEW3D_PT_accelscope_"
    shown = {name.removeprefix(prefix) for name in dir(bpy.types) if name.startswith(prefix)}
    assert len(topics) >= 7
    assert topics <= shown


def test_every_class_follows_blenders_naming(bpy: Any) -> None:
    from accelscope.addon import registration

    for cls in registration._registered:
        text = getattr(cls, "bl_description", "")
        assert not text.endswith("."), cls
        if issubclass(cls, bpy.types.Operator):
            assert cls.bl_label
            assert text, cls


def test_command_takes_the_open_file(
    bpy: Any, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from accelscope.addon import registration

    arguments = ["evaluate", "--structure", "naive", "--rays", "random_lines:count=10", "--quiet"]
    assert registration._run_command(arguments) == 2
    assert "no mesh with faces is visible" in capsys.readouterr().err
    bpy.ops.mesh.primitive_cube_add()
    assert registration._run_command([*arguments, "--json", str(tmp_path / "out.json")]) == 0
    assert '"triangles": 12' in (tmp_path / "out.json").read_text()
