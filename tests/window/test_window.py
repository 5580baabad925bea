# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real Blender window, and on the command line of that Blender."""

import ast
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import NoReturn

import numpy as np
import pytest
from accelscope.core.evaluation.records.experiment import build, make_record
from accelscope.core.scene import Scene
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

pytestmark = [pytest.mark.window, pytest.mark.slow, pytest.mark.packaging]

ROOT = Path(__file__).resolve().parents[2]
HERE = Path(__file__).resolve().parent
# Kept after the test, to be looked at.
OUTPUT = ROOT / "build" / "window"
CANNOT = 3
"""Exit code when this machine may not make or use the root with Blender."""


WITHOUT = "ACCELSCOPE_WITHOUT_WINDOW"
"""Set this in the environment of a machine that can have no window, since it forbids mounts."""


def go_without(reason: str) -> NoReturn:
    """Skip a test; fail where nobody would see that, in continuous integration."""
    if os.environ.get("CI", "").lower() in ("", "0", "false"):
        pytest.skip(reason)
    pytest.fail(f"the window was not tried: {reason}; to go without it here, set {WITHOUT}=1")


@pytest.fixture(scope="session", autouse=True)
def blender_root() -> None:
    """Make the root with Blender, or skip with the line that says what is in the way."""
    if sys.platform != "linux":
        pytest.skip("the window tests need a Linux machine")
    if os.environ.get(WITHOUT):
        pytest.skip(f"{WITHOUT} is set")
    done = subprocess.run(
        [ROOT / ".ci" / "blender_root.sh"], capture_output=True, text=True, check=False
    )
    skip_if_impossible(done)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="session")
def extension_zip(blender_root: None) -> Path:
    """Return the full zip for Linux, built now."""
    if importlib.util.find_spec("bpy") is None:
        go_without("the build needs Blender's own extension tool, which comes with bpy")
    folder = OUTPUT / "extension"
    script = [sys.executable, ROOT / ".ci" / "build_extension.py"]
    subprocess.run([*script, "--platform", "linux-x64", "--output", folder], check=True)
    return next(folder.glob("accelscope-*-linux_x64.zip"))


def skip_if_impossible(done: subprocess.CompletedProcess[str]) -> None:
    """Skip the test with the one line on stderr if the machine cannot do it."""
    if done.returncode == CANNOT:
        go_without(done.stderr.strip().splitlines()[-1])


def in_window(script: str, output: Path, *arguments: object, seconds: int) -> None:
    """Run a script of this folder in the root, and fail with the end of its log."""
    shutil.rmtree(output, ignore_errors=True)
    done = subprocess.run(
        [ROOT / ".ci" / "blender_window.sh", HERE / script, output, *map(str, arguments)],
        env={**os.environ, "ACCELSCOPE_WINDOW_TIMEOUT": str(seconds)},
        capture_output=True,
        text=True,
        check=False,
    )
    skip_if_impossible(done)
    assert done.returncode == 0, done.stdout + done.stderr


def steps_of(script: Path) -> list[str]:
    """Return the names of the steps a script has, in their order."""
    tree = ast.parse(script.read_text(encoding="utf-8"))
    return [
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(ast.unparse(each) == "session.step" for each in node.decorator_list)
    ]


def walk_through(script: str, extension_zip: Path) -> Path:
    """Run a script whose every step has to pass; return where its pictures and figures are."""
    output = OUTPUT / script.replace("_", "-")
    in_window(f"{script}.py", output, "--", extension_zip, seconds=2400)
    passed = (output / "passed.txt").read_text(encoding="utf-8").split()
    assert passed == steps_of(HERE / f"{script}.py")
    for measured in output.glob("figures.json"):
        print(measured.read_text(encoding="utf-8"))
    return output


def test_five_minutes(extension_zip: Path) -> None:
    output = walk_through("five_minutes", extension_zip)
    # What it exported are the figures of the same triangles, rounded as Blender does.
    (record,) = json.loads((output / "exported.json").read_text(encoding="utf-8"))["records"]
    rounded = make_sample("suzanne").triangles.astype(np.float32)
    scene = Scene.from_triangles(rounded, "suzanne")
    kdtree = structure_named("kdtree")
    terminal = make_record(build(scene, kdtree, kdtree.Settings()), None)
    assert record["scene"]["triangles"] == len(scene) == 15_744
    assert record["statistics"] == json.loads(json.dumps(terminal["statistics"]))


@pytest.mark.exhaustive
def test_tour(extension_zip: Path) -> None:
    output = walk_through("tour", extension_zip)
    assert len(list(output.glob("[0-9][0-9]-*.png"))) > 25
    assert (output / "figures.json").exists()


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "script",
    [
        "tour_large",
        "tour_lessons",
        "tour_state",
        "cycles",
        "solids",
        "pipeline",
        "csg",
        "directional",
        "two_levels",
    ],
)
def test_every_step_passes(extension_zip: Path, script: str) -> None:
    walk_through(script, extension_zip)


# Small enough for the naive algorithm; the camera is the .blend's own.
RAYS = ["--rays", "camera:width=32,height=24", "random_lines:count=200"]


# Everything is compiled anew in there: each structure takes some ten seconds.
@pytest.mark.parametrize(
    "names", ["bvh grid kdtree", pytest.param("all", marks=pytest.mark.exhaustive)]
)
def test_command_line_in_blender_finds_what_the_terminal_finds(
    extension_zip: Path, names: str
) -> None:
    asked = ["--structure", *names.split(), *RAYS]
    output = OUTPUT / "command"
    output.mkdir(parents=True, exist_ok=True)
    # Beside the output, which is emptied first; in the checkout, so that the root sees it.
    blend = OUTPUT / "command.blend"
    subprocess.run([sys.executable, HERE / "make_blend.py", blend], check=True)
    in_window("evaluate.sh", output, extension_zip, blend, *asked, seconds=1200)
    outside = output / "outside.json"
    command = [sys.executable, "-m", "accelscope", "evaluate", blend, *asked, "--json", outside]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    assert untimed(output / "inside.json") == untimed(outside)


def untimed(path: Path) -> list[dict]:
    """Return the records of a JSON file without times, machine and folder of the scene."""
    document = json.loads(path.read_text(encoding="utf-8"))
    assert document["schema"] == "accelscope/2"
    for record in document["records"]:
        record["scene"]["source"] = Path(record["scene"]["source"]).name
        del record["build"]["seconds"], record["trace"]["seconds"]
        del record["trace"]["rays_per_second"], record["environment"]
    assert len(document["records"]) >= 6
    return document["records"]
