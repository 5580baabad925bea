"""What tests of every floor use: the command line in this process, small files, and Blender."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from accelscope.addon.command.main import main
from accelscope.core.evaluation.pages import view
from accelscope.core.kernels import ALONE

os.environ.setdefault(ALONE, "1")  # tests run on all cores already

CASES = Path(__file__).parent / "repro" / "cases"

TOY = """
from accelscope.core.kernels import kernel

@kernel
def square(x):
    return x * x

@kernel
def sum_of_squares(values):
    total = 0.0
    for i in range(len(values)):
        total += square(values[i])
    return total
"""


@pytest.fixture(autouse=True)
def heard() -> None:
    """Let every test begin with Ctrl-C and requests to terminate being heard.

    Whoever starts tests in the background of a script has Ctrl-C ignored, in them and in all that
    they start; and a command that ends its process leaves both ignored, which a test that runs one
    does not end.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test that uses the add-on: it needs Blender. Slow ones go first.

    The last of them would otherwise keep one process busy for minutes after all others are done.
    """
    for item in items:
        if "addon" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.bpy)
    items.sort(key=lambda item: item.get_closest_marker("slow") is None)


@pytest.fixture
def cases() -> Path:
    """The folder of small inputs, each of a kind that was read or answered wrongly once."""
    return CASES


# ------------------------------------------------------------------------------- the command line


class Outcome:
    """What a call of the command line left behind."""

    def __init__(self, code, out, err):
        self.code, self.out, self.err = code, out, err

    @property
    def records(self):
        return json.loads(self.out)["records"]


@pytest.fixture
def small_pictures(monkeypatch):
    """A sixteenth of the pixels: what a picture shows is looked at elsewhere, at its full size."""
    for side in ("WIDTH", "HEIGHT"):
        monkeypatch.setattr(view, side, getattr(view, side) // 4)


@pytest.fixture
def run(capsys, small_pictures):
    """Call the command line with arguments."""

    def call(*arguments):
        capsys.readouterr()
        code = main([str(argument) for argument in arguments])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture
def evaluate(run):
    """Evaluate and return the records, which must succeed without a word on stderr."""

    def call(*arguments):
        outcome = run("evaluate", *arguments, "--json", "-", "--quiet")
        assert (outcome.code, outcome.err) == (0, "")
        return outcome.records

    return call


@pytest.fixture
def refused(run):
    """Assert that the command line refuses with one clear line, and return that line."""

    def call(*arguments):
        outcome = run(*arguments)
        assert outcome.code == 2
        assert outcome.out == ""
        assert outcome.err.endswith("\n")
        lines = outcome.err.splitlines()
        assert len(lines) == 1, outcome.err
        assert "error: " in lines[0]
        assert "Traceback" not in lines[0]
        assert len(lines[0]) < 500
        return lines[0]

    return call


TRIANGLES = np.array(
    [
        [[0, 0, 0], [1, 0, 0], [0, 1, 0]],
        [[0, 0, 1], [1, 0, 1], [0, 1, 1]],
        [[2, 0, 0], [3, 0, 0], [2, 1, 0]],
        [[0, 2, 3], [1, 2, 3], [0, 3, 3]],
        [[5, 5, 5], [6, 5, 5], [5, 6, 6]],
    ],
    dtype=float,
)


def write_obj(path, triangles):
    lines = []
    for n, triangle in enumerate(np.asarray(triangles, float)):
        lines += ["v " + " ".join(map(repr, map(float, corner))) for corner in triangle]
        lines.append(f"f {3 * n + 1} {3 * n + 2} {3 * n + 3}")
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def obj(tmp_path):
    """Write triangles as an OBJ file and return its path."""

    def make(triangles=TRIANGLES, name="mesh.obj"):
        return write_obj(tmp_path / name, triangles)

    return make


@pytest.fixture
def five():
    """Five triangles apart from each other."""
    return TRIANGLES.copy()


# ---------------------------------------------------------------------------------------- Blender


@pytest.fixture(scope="session")
def addon() -> Iterator[Any]:
    """The registered add-on."""
    import accelscope

    accelscope.register()
    yield accelscope
    # A handler that is left when Python exits hangs Blender 4.5.
    accelscope.unregister()


@pytest.fixture
def bpy(addon: Any) -> Iterator[Any]:
    """Blender with an empty file."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy
    if bpy.ops.accelscope.clear.poll():
        bpy.ops.accelscope.clear()


@pytest.fixture
def root(bpy: Any) -> Any:
    """The settings of the scene."""
    return bpy.context.scene.accelscope


@pytest.fixture
def current(bpy: Any) -> Any:
    """The session."""
    from accelscope.addon.results import session

    return session.current


@pytest.fixture(name="view")
def lesson_shown(bpy: Any) -> Iterator[Any]:
    """What is shown of a lesson."""
    from accelscope.addon.results import lesson_view

    yield lesson_view.current
    lesson_view.current.clear()


@pytest.fixture
def jobs(bpy: Any, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Jobs, whose operators take the way of a Blender with a window."""
    from accelscope.addon import jobs

    app = SimpleNamespace(background=False)
    monkeypatch.setattr(jobs, "bpy", SimpleNamespace(app=app, types=bpy.types, context=bpy.context))
    yield jobs
    jobs.stop()


@pytest.fixture
def manager() -> SimpleNamespace:
    """What an operator asks for timers; those that it has not given back are in `timers`."""
    timers: list[object] = []

    def event_timer_add(*_: Any, **__: Any) -> object:
        timers.append(object())
        return timers[-1]

    return SimpleNamespace(
        timers=timers,
        event_timer_add=event_timer_add,
        event_timer_remove=timers.remove,
        modal_handler_add=lambda operator: True,
    )


@pytest.fixture
def context(bpy: Any, manager: SimpleNamespace) -> Any:
    """What an operator is given: Blender's own context, with a window."""
    real = bpy.context

    class Context:
        window = "window"
        window_manager = manager

        def __getattr__(self, name: str) -> Any:
            return getattr(real, name)

    return Context()


# ------------------------------------------------------------------------------------- toy kernels


@pytest.fixture(scope="session")
def toy_kernels() -> str:
    """The source of a module with two kernels, for tests of what becomes of compiled ones."""
    return TOY
