"""What another process compiles, this one finds; and nothing depends on there being one."""

import os
import subprocess
import sys
import time

import numpy as np
import pytest
from accelscope.core import another_process, kernels
from accelscope.core.kernels import ALONE
from accelscope.core.parallel import core_count
from compiled_names import COMPILED

FIRST_USE = f"""
import sys
if len(sys.argv) > 2:
    sys.executable = sys.argv[2]
from accelscope.core import kernel_cache
from accelscope.core.evaluation.records.experiment import warm_up
from accelscope.core.structures import structure_named
kernel_cache.set_cache_root(sys.argv[1])
{COMPILED}
kind = structure_named("sorted_volumes")
warm_up(kind, kind.Settings())
print(len(compiled) > 0, "trace_range" in compiled)
"""


def first_use(folder, *python, alone="0"):
    done = subprocess.run(
        [sys.executable, "-c", FIRST_USE, str(folder), *python], check=True, text=True,
        capture_output=True, env={**os.environ, ALONE: alone},
    )  # fmt: skip
    assert done.stderr == ""
    return done.stdout.split()


needs_two = pytest.mark.skipif(
    core_count() == 1 or not kernels.has_numba(), reason="nothing is compiled at the same time"
)


@needs_two
def test_tracing_is_compiled_while_building_is(tmp_path):
    # Something was compiled here, but not what walks.
    assert first_use(tmp_path) == ["True", "False"]
    assert first_use(tmp_path) == ["False", "False"]


@needs_two
def test_one_process_compiles_everything_if_it_is_told_to(tmp_path):
    assert first_use(tmp_path, alone="1") == ["True", "True"]


@needs_two
@pytest.mark.skipif(os.name == "nt", reason="the stand-in begins with #!")
def test_what_another_process_fails_to_compile_is_compiled_here(tmp_path):
    python = tmp_path / "python"
    python.write_text(f"#!{sys.executable}\nimport sys\nsys.exit(3)\n")
    python.chmod(0o755)
    assert first_use(tmp_path / "kernels", str(python)) == ["True", "True"]


def test_what_cannot_be_handed_over_is_said_before_a_process_starts():
    class Local:
        pass

    with pytest.raises(another_process.CannotHelp, match="Local"):
        another_process.Task(print, Local)


OF_A_PROGRAM = """
import sys
import numpy as np
from accelscope.core import another_process, kernel_cache
from accelscope.core.evaluation.records.experiment import warm_up
from accelscope.core.structures.naive import STRUCTURE
kernel_cache.set_cache_root(sys.argv[1])
started = []
start = another_process.start
another_process.start = lambda *a, **k: started.append(1) or start(*a, **k)

def made():
    class Own(STRUCTURE):
        pass
    return Own

warm_up(made(), STRUCTURE.Settings())
print(len(started))
"""


@needs_two
def test_a_structure_that_only_a_program_knows_is_compiled_by_it(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", OF_A_PROGRAM, str(tmp_path)], check=False, text=True,
        capture_output=True, env={**os.environ, ALONE: "0"},
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "0\n", "")


def test_a_task_that_is_stopped_has_ended():
    task = another_process.Task(time.sleep, 60.0)
    begun = time.monotonic()
    task.stop()
    task.stop()  # once more does no harm
    task.wait()
    assert time.monotonic() - begun < 5.0


def test_a_task_is_done_by_another_process_under_the_name_of_the_package(tmp_path):
    another_process.Task(np.save, tmp_path / "out.npy", np.arange(100_000)).wait()
    assert np.array_equal(np.load(tmp_path / "out.npy"), np.arange(100_000))
