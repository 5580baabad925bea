"""``accelscope prepare``: what is compiled ahead, and the process that does it beside Blender."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from accelscope.addon.command import prepare
from accelscope.addon.preparing import Preparation
from accelscope.core import kernels
from accelscope.core.lessons import lessons
from accelscope.core.structures import structures

ROOT = Path(__file__).resolve().parents[2]


def test_every_structure_and_every_lesson_is_prepared(run, monkeypatch, tmp_path):
    done = []
    monkeypatch.setattr(prepare, "compile_structure", done.append)
    monkeypatch.setattr(prepare, "compile_lesson", done.append)
    monkeypatch.setattr(prepare, "cache_directory", lambda: tmp_path / "kernels")
    assert not prepare.is_done()
    out = run("prepare", "--processes", "1")
    assert out.code == 0
    if not kernels.has_numba():
        assert "nothing to compile" in out.err
        return
    assert done[:2] == ["bvh", "grid"]
    assert sorted(done) == sorted([*structures(), *lessons()])
    lines = out.out.splitlines()
    assert lines[0] == f"0 of {len(done)}: BVH"
    assert len(lines) == len(done)
    assert prepare.is_done()


@pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")
def test_a_part_that_fails_leaves_the_others_alone(run, monkeypatch, tmp_path):
    done = []

    def compile_structure(name):
        if name == "grid":
            raise MemoryError
        done.append(name)

    monkeypatch.setattr(prepare, "compile_structure", compile_structure)
    monkeypatch.setattr(prepare, "compile_lesson", done.append)
    monkeypatch.setattr(prepare, "cache_directory", lambda: tmp_path / "kernels")
    out = run("prepare", "--processes", "1")
    assert out.code == 1
    assert "error: Uniform Grid: " in out.err
    assert len(done) == len(structures()) + len(lessons()) - 1
    # Else each start of Blender would try all of it again.
    assert prepare.is_done()


def stand_in(tmp_path, code):
    """A program that takes the place of Python, and runs some code instead."""
    path = tmp_path / "python"
    path.write_text(f"#!{sys.executable}\nimport sys, time\n{code}\n")
    path.chmod(0o755)
    return str(path)


def wait_until(condition):
    ends = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < ends
        time.sleep(0.01)


@pytest.mark.skipif(os.name == "nt", reason="the stand-in begins with #!")
def test_how_far_it_is_and_stopping_it(tmp_path):
    # Like a compiler, it does not listen to less than being killed.
    code = "import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n"
    code += "print('3 of 12: kd-Tree', flush=True)\ntime.sleep(60)"
    preparation = Preparation("accelscope", "", stand_in(tmp_path, code))
    wait_until(lambda: preparation.done == (0.25, "kd-Tree"))
    assert preparation.is_running
    begun = time.monotonic()
    preparation.stop()
    assert time.monotonic() - begun < 2.0
    assert not preparation.is_running
    preparation.stop()  # once more does no harm


@pytest.mark.skipif(os.name == "nt", reason="the stand-in begins with #!")
def test_one_that_fails_is_not_running(tmp_path):
    preparation = Preparation("accelscope", "", stand_in(tmp_path, "sys.exit(3)"))
    wait_until(lambda: not preparation.is_running)
    assert preparation.done[0] == 0.0


WORKER = """
print = lambda text, show=print: show(text, flush=True)
for line in sys.stdin:
    number = int(line)
    if number == 3:
        sys.exit(1)
    with open(PLACE, "a") as log:
        log.write(f"{number}\\n")
    print("failed" if number == 5 else "prepared")
"""


@pytest.mark.skipif(os.name == "nt", reason="the stand-in begins with #!")
@pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")
def test_several_processes_do_each_part_once(run, monkeypatch, tmp_path):
    log = tmp_path / "log"
    python = stand_in(tmp_path, WORKER.replace("PLACE", repr(str(log))))
    monkeypatch.setattr(prepare.Worker, "python", python)
    monkeypatch.setattr(prepare, "cache_directory", lambda: tmp_path / "kernels")
    out = run("prepare", "--processes", "3")
    names = [name for name, _ in prepare.parts()]
    # One says itself what is the matter; of one that has ended that is said.
    assert out.code == 1
    assert f"error: {names[3]}: its process has ended by itself" in out.err
    assert f"{len(names) - 2} of {len(names)} are compiled" in out.err
    done = sorted(map(int, log.read_text().split()))
    assert done == [number for number in range(len(names)) if number != 3]
    assert out.out.splitlines() == [f"{k} of {len(names)}: {name}" for k, name in enumerate(names)]


@pytest.mark.skipif(os.name == "nt", reason="the stand-in begins with #!")
@pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")
def test_a_stop_ends_all_processes(run, monkeypatch, tmp_path):
    log = tmp_path / "log"
    code = f"import os\nopen({str(log)!r}, 'a').write(f'{{os.getpid()}} ')\ntime.sleep(60)"
    python = stand_in(tmp_path, code)
    monkeypatch.setattr(prepare.Worker, "python", python)
    monkeypatch.setattr(prepare, "cache_directory", lambda: tmp_path / "kernels")

    def stop_when_all_are_there():
        wait_until(lambda: log.exists() and len(log.read_text().split()) == 2)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=stop_when_all_are_there).start()
    out = run("prepare", "--processes", "2", "--quiet")
    assert (out.code, out.err) == (2, "accelscope: error: stopped\n")
    for process in map(int, log.read_text().split()):
        with pytest.raises(ProcessLookupError):
            os.kill(process, 0)


@pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")
def test_a_worker_ends_with_whoever_asks_it():
    worker = prepare.Worker()
    assert worker.is_running
    worker.process.communicate(timeout=60)
    assert worker.process.returncode == 0


@pytest.mark.exhaustive
@pytest.mark.skipif(not kernels.has_numba(), reason="there is nothing to compile with")
def test_what_one_name_of_the_package_has_compiled_the_same_name_finds(tmp_path):
    # By a link, as where a checkout is linked into Blender's folder of extensions.
    (tmp_path / "accelscope").symlink_to(ROOT)
    script = tmp_path / "accelscope" / "core" / "another_process.py"
    kernels_in = tmp_path / "kernels"
    name = "bl_ext.user_default.accelscope"
    command = [sys.executable, str(script), name, str(kernels_in), "addon.command.main", "prepare"]
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    known = []
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
        assert done.returncode == 0, done.stderr
        known.append({path.name: path.stat().st_mtime_ns for path in kernels_in.rglob("*.nbc")})
    assert len(known[0]) > 100
    assert known[0] == known[1]  # nothing was compiled once more
