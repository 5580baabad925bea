"""Ctrl-C while Blender is imported, opens a file or shows a frame: no crash, and none is lost.

Blender's own C code crashes over a KeyboardInterrupt that is raised in one of its imports, or
prints it and goes on.
"""

import json
import os
import signal
import subprocess
import sys
import time

import pytest
from accelscope.addon import stopping

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="/proc says what a process has loaded"),
    pytest.mark.bpy,
]

COMMANDS = {
    "animate": ("animate", "walk.blend", "--frames", "1:3000", "--rays", "random_lines:count=20"),
    "evaluate": (
        "evaluate",
        "walk.blend",
        "--rays",
        "random_lines:count=500000",
        "--structure",
        "naive",
    ),
    "efficiency": ("efficiency", "walk.blend"),
}
STOPPED = "accelscope: error: stopped"


@pytest.fixture
def start(bpy, tmp_path):
    """Start a command over a .blend, in a process that heeds Ctrl-C."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=64, ring_count=32)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "walk.blend"))
    processes = []

    def started(name):
        processes.append(
            subprocess.Popen(
                [sys.executable, "-m", "accelscope", *COMMANDS[name],
                 "--json", "a.json", "--quiet"],
                cwd=tmp_path, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                # A shell lets what it starts in the background ignore Ctrl-C.
                preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            )
        )  # fmt: skip
        return processes[-1]

    yield started
    for process in processes:
        process.kill()
        process.communicate()


def wait_until(process, condition):
    deadline = time.monotonic() + 120.0
    while not condition():
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.01)


def is_loading_blender(process):
    with open(f"/proc/{process.pid}/maps") as maps:
        return "/bpy/" in maps.read()


def said(process):
    """Return what the process says of itself once it has ended."""
    _, err = process.communicate(timeout=60)
    return err.splitlines()


@pytest.mark.parametrize(
    ("name", "seconds"),
    [
        ("animate", 0.1),
        *(
            pytest.param(name, seconds, marks=pytest.mark.exhaustive)
            for name in COMMANDS
            for seconds in (0.0, 0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
        ),
    ],
)
def test_soon_after_blender_is_found(start, tmp_path, name, seconds):
    process = start(name)
    wait_until(process, lambda: is_loading_blender(process))
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    (line,) = said(process)
    if (tmp_path / "a.json").exists():  # a quick machine has measured something by then
        assert process.returncode == 1
        assert line.startswith(f"{STOPPED}; ")
    else:
        assert (process.returncode, line) == (2, STOPPED)


@pytest.mark.parametrize(
    "number", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.exhaustive)]
)
def test_between_frames(start, tmp_path, number):
    process = start("animate")
    wait_until(process, (tmp_path / "a.json").exists)
    # As timeout does, which tells the process and its group.
    process.send_signal(number)
    process.send_signal(number)
    (line,) = said(process)
    records = json.loads((tmp_path / "a.json").read_text())["records"]
    assert process.returncode == 1
    assert line == f"{STOPPED}; {len(records)} of 6000 records were measured"
    assert {record["method"] for record in records} == {"refit", "rebuild"}


def test_opening_and_showing_a_frame_are_waited_for(bpy, run, tmp_path):
    """Whatever handler is called meanwhile, of which Blender would only print the exception."""
    bpy.ops.mesh.primitive_cube_add()
    path = tmp_path / "cube.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    called = []

    @bpy.app.handlers.persistent
    def stop_then(*_):
        os.kill(os.getpid(), signal.SIGINT)
        called.append("to its end")

    for event, words in (("load_post", ("evaluate",)), ("frame_change_post", ("animate",))):
        handlers = getattr(bpy.app.handlers, event)
        handlers.append(stop_then)
        try:
            outcome = run(*words, path, "--quiet", "--rays", "random_lines:count=5")
        finally:
            handlers.remove(stop_then)
        assert (outcome.code, outcome.out, outcome.err) == (2, "", f"{STOPPED}\n")
        assert called.pop() == "to its end"
        assert called == []


def test_a_stop_is_told_to_whom_it_was_told_before():
    heard = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    try:
        with stopping.held():
            os.kill(os.getpid(), signal.SIGTERM)
            os.kill(os.getpid(), signal.SIGTERM)
            assert heard == []
        assert heard == [signal.SIGTERM]
    finally:
        signal.signal(signal.SIGTERM, before)
