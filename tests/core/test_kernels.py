"""Kernels without Numba, and their cache when it is damaged or has no place. In processes apart."""

import json
import os
import shutil
import subprocess
import sys

import pytest

TRACE = """
import dataclasses, json, sys
import numpy as np
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST
from accelscope.core.evaluation.rays.workloads import random_lines
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import general_structures, structures
from accelscope.core import kernels
from accelscope.sample_scenes import make_sample
scene = make_sample("tetra:size=2")
o, d = random_lines(scene.lower, scene.upper, 20, 1)
vertices = scene.triangles.reshape(-1, 3)
axis = np.tile(np.eye(3), (8, 1))
o = np.concatenate([o, vertices[:24] - 2 * axis, vertices[:24]])
d = np.concatenate([d, axis, axis[::-1]])
rays = Rays.from_arrays(o, d)
out = {"numba": kernels.has_numba()}
directional = set(structures()) - set(general_structures())
for name, structure in general_structures().items():
    made = [structure.Settings()]
    for field in dataclasses.fields(structure.Settings):
        others = field.metadata["choices"] or ((True,) if field.default is False else ())
        others = [other for other in others if other not in directional]
        made += [structure.Settings(**{field.name: other}) for other in others
                 if other != field.default]
    for n, settings in enumerate(made):
        built = structure.build(scene, settings)
        assert built.validate() == []
        for query in (CLOSEST, ANY, ALL):
            hits, counters = built.trace(rays, query)
            out[f"{name} {n} {query}"] = [hits.t.tobytes().hex(), hits.primitive.tolist(),
                                          counters.values.tolist(),
                                          [built.record(rays, i, query).tally() for i in (0, 30)]]
print(json.dumps(out))
"""

NO_NUMBA = """
import sys
class Blocker:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("numba", "llvmlite"):
            raise ModuleNotFoundError(name, name=name)
sys.meta_path.insert(0, Blocker())
import importlib.util
find = importlib.util.find_spec
importlib.util.find_spec = lambda name, *a: None if name == "numba" else find(name, *a)
"""


def run(code, **environment):
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, timeout=300, env={**os.environ, **environment}, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return done


@pytest.fixture(scope="module")
def expected():
    return json.loads(run(TRACE).stdout)


def test_plain_python_gives_the_same_bits(expected):
    done = run(NO_NUMBA + TRACE)
    got = json.loads(done.stdout)
    assert (expected.pop("numba"), got.pop("numba")) == (True, False)
    assert expected.keys() == got.keys()
    for name in expected:
        assert got[name] == expected[name], name
    assert done.stderr == ""


def test_the_command_works_without_numba():
    main = "from accelscope.addon.command.main import main; sys.exit(main(sys.argv[1:]))"
    done = subprocess.run(
        [sys.executable, "-c", NO_NUMBA + main, "list"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0
    assert "grid: " in done.stdout
    assert done.stderr == ""
    done = subprocess.run(
        [sys.executable, "-c", NO_NUMBA + main, "evaluate", "sample:tetra:size=1",
         "--structure", "all", "--rays", "camera:width=6,height=5", "--json", "-"],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["records"]) >= 3
    assert done.stderr == "accelscope: no Numba here: kernels run as slow plain Python\n"


SMALL = """
import sys
from accelscope.core import kernel_cache, kernels
kernel_cache.set_cache_root(ROOT)
sys.path.insert(0, FOLDER)
import numpy as np
import toy
from accelscope.core.progress import Progress

class Listening(Progress):
    said = []
    def announce(self, text):
        self.said.append(text)

with kernels.announcing(Listening(), "toy"):
    result = kernels.call(toy.sum_of_squares, np.arange(4.0))
cache_hits = toy.sum_of_squares.dispatcher.stats.cache_hits
print(result, sum(cache_hits.values()), *Listening.said, sep="|")
"""

REAL = """
from accelscope.core import kernel_cache
kernel_cache.set_cache_root(ROOT)
from accelscope.addon.command.main import main
raise SystemExit(main(["evaluate", "sample:tetra:size=2", "--structure", "bvh",
                       "--rays", "camera:width=8,height=8", "--quiet"]))
"""


@pytest.fixture(scope="module")
def toy(tmp_path_factory, toy_kernels):
    """Return a function that runs the toy kernels with their cache at a place.

    It returns result, cache hits, announcements.
    """
    folder = tmp_path_factory.mktemp("toy")
    (folder / "toy.py").write_text(toy_kernels)

    def run_with(root):
        code = SMALL.replace("ROOT", repr(str(root))).replace("FOLDER", repr(str(folder)))
        return run(code).stdout.strip().split("|")

    return run_with


@pytest.fixture(scope="module")
def compiled(toy, tmp_path_factory):
    """A cache in which the toy kernels are; it stays as it is."""
    root = tmp_path_factory.mktemp("compiled") / "kernels"
    assert toy(root) == ["14.0", "0", "compiling toy, once after installation, some ten seconds"]
    assert toy(root) == ["14.0", "1"]
    return root


@pytest.fixture
def warm_cache(compiled, tmp_path):
    """A copy of that cache, to be damaged."""
    return shutil.copytree(compiled, tmp_path / "kernels")


def damage(file, how):
    data = file.read_bytes()
    if how == "gone":
        file.unlink()
        return
    file.write_bytes(
        {
            "empty": b"",
            "half": data[: len(data) // 2],
            "one byte less": data[:-1],
            "zeros": bytes(len(data)),
            "text": b"Disk quota exceeded\n" * 5,
        }[how]
    )


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("how", ["empty", "half", "one byte less", "zeros", "gone", "text"])
def test_a_damaged_cache_is_made_anew(toy, warm_cache, ending, how):
    files = sorted(warm_cache.rglob(f"*.{ending}"))
    assert files
    for file in files:
        damage(file, how)
    assert toy(warm_cache)[:2] == ["14.0", "0"]
    # And the new cache is sound.
    assert toy(warm_cache) == ["14.0", "1"]


def test_the_command_survives_a_damaged_cache(tmp_path):
    code = REAL.replace("ROOT", repr(str(tmp_path / "kernels")))
    run(code)
    files = sorted((tmp_path / "kernels").rglob("*.nb[ic]"))
    assert len(files) > 8
    for file in files:
        damage(file, "half")
    assert run(code).stderr == ""


def test_without_a_place_for_the_cache_kernels_still_run(toy, tmp_path):
    """Root may write anywhere, so a file stands where the folder should be."""
    obstacle = tmp_path / "file"
    obstacle.write_text("keep me")
    for _ in range(2):
        result, hits, said = toy(obstacle)
        assert (result, hits) == ("14.0", "0")
        assert said.startswith("compiling toy, at every start")
    assert run(REAL.replace("ROOT", repr(str(obstacle / "below")))).stderr == ""
    assert obstacle.read_text() == "keep me"


def test_the_cache_forgets_old_versions_only(toy, warm_cache):
    old, recent, foreign = (
        warm_cache / ("a" * 16),
        warm_cache / ("b" * 16),
        warm_cache / "notes.txt",
    )
    for folder in (old, recent):
        folder.mkdir()
    foreign.write_text("mine")
    os.utime(old, (1e9, 1e9))
    toy(warm_cache)
    assert not old.exists()
    assert recent.exists()
    assert foreign.read_text() == "mine"


def test_an_inner_kernel_is_not_called_from_python():
    from accelscope.core.geometry.box import area_of
    from accelscope.core.kernels import call, has_numba

    assert has_numba()
    with pytest.raises(TypeError, match="area_of is an inner kernel"):
        call(area_of, (0.0,) * 6)
