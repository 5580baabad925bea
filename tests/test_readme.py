"""Every command in the README is run as it stands there."""

from __future__ import annotations

import ast
import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
BLOCKS = re.findall(r"^```sh\n(.*?)^```", (ROOT / "README.md").read_text(), re.M | re.S)
COMMANDS = [line for block in BLOCKS for line in block.splitlines() if line]


def starting_with(program: str) -> list[str]:
    """Return the README's commands that start a program."""
    return [command for command in COMMANDS if shlex.split(command)[0] == program]


def test_the_readme_has_commands_of_known_kinds() -> None:
    known = starting_with("make") + starting_with("accelscope") + starting_with("blender")
    assert sorted(known) == sorted(COMMANDS)
    assert len(starting_with("accelscope")) >= 4


@pytest.mark.parametrize("command", starting_with("accelscope"))
def test_accelscope_command(command: str, tmp_path: Path) -> None:
    words = [sys.executable, "-m", "accelscope", *shlex.split(command)[1:]]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    written = [words[n + 1] for n, word in enumerate(words) if word in OUTPUTS]
    for name in written:
        assert (tmp_path / name).exists(), name
    assert bool(done.stdout) != ("--quiet" in words)


def test_the_window_test_follows_the_five_minutes_word_by_word() -> None:
    """Every sentence there is the docstring of a step, in this order, and nothing else is."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    installing, _, behind = readme.partition("**Five minutes:**")
    section, _, _ = behind.partition("\n## ")
    sentences = re.sub(r"^\d+\. ", "", section, flags=re.M).split()
    script = ast.parse((ROOT / "tests" / "window" / "five_minutes.py").read_text(encoding="utf-8"))
    steps = [node for node in script.body if isinstance(node, ast.FunctionDef)]
    first, *others = [ast.get_docstring(step) or "" for step in steps if step.decorator_list]
    assert first in installing
    quoted = " ".join(others).split()
    assert len(quoted) > 150
    assert quoted == sentences


OUTPUTS = {"--json", "--csv", "--hits", "--image", "--pictures", "--page", "--out"}


def test_the_readme_tells_every_counter() -> None:
    from accelscope.core.structures import structures

    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    _, _, figures = readme.partition("\n## The figures\n")
    told = set(re.findall(r"`(\w+)`", figures.partition("\n## ")[0]))
    counters = {each.name for kind in structures().values() for each in kind.COUNTERS}
    assert counters <= told


def test_the_python_examples_run_one_after_the_other() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    examples = re.findall(r"^```python\n(.*?)^```", readme, re.M | re.S)
    assert len(examples) >= 3
    done = subprocess.run(
        [sys.executable, "-c", "\n".join(examples)], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    from accelscope.core.structures import general_structures

    for word in ("N_IT", "leaves", *general_structures()):
        assert word in done.stdout


@pytest.mark.parametrize("command", starting_with("make"))
def test_make_target_exists(command: str) -> None:
    done = subprocess.run(
        [*shlex.split(command), "--dry-run"], cwd=ROOT, capture_output=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.bpy
@pytest.mark.slow
@pytest.mark.exhaustive  # every structure is compiled, built, drawn: minutes even for one sample
@pytest.mark.parametrize("names", [["tetra"], None])
def test_make_demo(tmp_path: Path, names: list[str] | None) -> None:
    """``make demo`` less the set-up that has been done: figures and pictures of its samples."""
    program = [sys.executable, "-m", "accelscope.addon.command.demo", "--output", tmp_path]
    program += ["--samples", *names] if names else []
    done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    from accelscope.addon.command import demo
    from accelscope.core.structures import general_structures
    from accelscope.sample_scenes import samples

    shown = names or demo.shown()
    assert set(demo.shown()) >= {"tetra", "suzanne", "bunny", "soup"}
    assert {"balls", "mount"} <= set(samples()) - set(demo.shown())

    rows = (tmp_path / "records.csv").read_text().splitlines()
    assert len(rows) == 1 + 2 * len(shown) * len(general_structures())
    page = (tmp_path / "pictures" / "index.html").read_text()
    pictures = re.findall(r'<img src="([^"]+)"', page)
    assert len(pictures) >= len(shown) * len(general_structures())
    for name in pictures:
        assert (tmp_path / "pictures" / name).read_bytes().startswith(b"\x89PNG")


IN_BLENDER = """
import sys, bpy
from accelscope.addon import register, registration, unregister
register()
bpy.ops.accelscope.add_sample_scene(sample="tetra")
code = registration._run_command(sys.argv[1:])
unregister()
sys.exit(code)
"""


@pytest.mark.bpy
@pytest.mark.parametrize("command", starting_with("blender"))
def test_blender_command(command: str) -> None:
    """What Blender hands to the command; tests/window runs Blender itself."""
    blender, _, arguments = command.partition(" --command accelscope ")
    assert blender == "blender scene.blend"
    done = subprocess.run(
        [sys.executable, "-c", IN_BLENDER, *shlex.split(arguments)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    document = done.stdout[done.stdout.index("{") :]  # behind what the operator reported
    (record,) = json.loads(document)["records"]
    assert record["scene"]["triangles"] == 4096  # without the default cube, which is hidden
