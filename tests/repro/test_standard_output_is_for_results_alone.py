"""``--json -`` is JSON and nothing else, whatever Blender and libraries print meanwhile."""

import json
import os
import subprocess
import sys

import pytest

SMALL = ("--structure", "bvh", "--rays", "camera:width=4,height=3", "--json", "-")


def run(*words, **environment):
    return subprocess.run(
        words, capture_output=True, text=True, timeout=120, check=False,
        env={**os.environ, **environment},
    )  # fmt: skip


def has_drivers():
    """Whether a driver may be refused: after that, Blender 4.5 by itself hangs at its end."""
    import bpy

    return bpy.app.version >= (5, 0)


@pytest.fixture(scope="module")
def blend(tmp_path_factory):
    """A file whose driver Blender refuses to run, and says so on standard output."""
    bpy = pytest.importorskip("bpy")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    if has_drivers():
        driver = bpy.context.object.driver_add("location", 0).driver
        driver.expression = "__import__('os').getpid()"
    path = tmp_path_factory.mktemp("blend") / "driver.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return path


@pytest.mark.bpy
@pytest.mark.parametrize("quiet", [False, True])
def test_blender_may_print_what_it_likes(blend, quiet):
    words = [sys.executable, "-m", "accelscope", "evaluate", blend, *SMALL]
    done = run(*words, *["--quiet"] * quiet, OCIO="/nowhere/config.ocio")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["records"][0]["scene"]["triangles"] == 12
    if quiet:
        assert done.stderr == ""
    else:
        assert "OCIO" in done.stderr, "this Blender has nothing to say about a missing profile?"
        assert done.stderr.count("Python of the file was not run") == has_drivers()
        assert "PyDriver" not in done.stderr


@pytest.mark.bpy
def test_quiet_is_quiet_without_json_too(blend):
    words = [sys.executable, "-m", "accelscope", "evaluate", blend, *SMALL[:4], "--quiet"]
    done = run(*words, OCIO="/nowhere/config.ocio")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


# A library that prints from Python, from C and at the very end, in a process that ends afterwards
# (as Blender does) or goes on (as any other program may).
NOISY = """
import atexit, ctypes, sys
from accelscope.addon.command.main import main
from accelscope.core.evaluation.records import experiment
libc = ctypes.CDLL(None)

def chatter():
    print("noise of Python")
    libc.puts(b"noise of C")

build = experiment.build
def noisy_build(*arguments, **options):
    chatter()
    return build(*arguments, **options)
experiment.build = noisy_build
atexit.register(chatter)
code = main(sys.argv[2:], until_exit=sys.argv[1] == "ends")
print("noise afterwards", flush=True)
sys.exit(code)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there is no C library of that name")
@pytest.mark.parametrize("quiet", [False, True])
def test_noise_until_the_process_ends(quiet):
    scene = ["evaluate", "sample:tetra:size=1", *SMALL, *["--quiet"] * quiet]
    done = run(sys.executable, "-c", NOISY, "ends", *scene)
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["records"]) == 1
    assert done.stderr.count("noise") == (0 if quiet else 5)


@pytest.mark.skipif(sys.platform == "win32", reason="there is no C library of that name")
def test_a_program_that_goes_on_has_its_standard_output_back():
    scene = ["evaluate", "sample:tetra:size=1", *SMALL]
    done = run(sys.executable, "-c", NOISY, "goes on", *scene)
    assert done.returncode == 0, done.stderr
    document, end = json.JSONDecoder().raw_decode(done.stdout)
    assert len(document["records"]) == 1
    assert done.stdout[end:].split("\n") == ["", "noise afterwards", "noise of Python",
                                             "noise of C", ""]  # fmt: skip


def test_a_list_as_json_is_json_alone():
    done = run(sys.executable, "-m", "accelscope", "list", "--json")
    assert json.loads(done.stdout)["schema"] == "accelscope/2"
