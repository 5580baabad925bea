"""The Python interface: what it returns is the core's own, what does not fit is refused."""

from __future__ import annotations

import subprocess
import sys

import accelscope
import numpy as np
import pytest

TRIANGLES = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 1], [0, 1, 1]]])


@pytest.fixture(scope="module")
def built() -> accelscope.Built:
    return accelscope.build(accelscope.scene(TRIANGLES), "naive")


def test_importing_it_imports_nothing_else() -> None:
    """Blender does so at its start, and asks for names of its own."""
    code = """
import sys, accelscope
assert not hasattr(accelscope, "bl_info") and not hasattr(accelscope, "numba")
assert not {"numba", "numpy", "bpy", "accelscope.addon"} & set(sys.modules)
assert accelscope.build is sys.modules["accelscope.addon.interface"].build
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_all_names_are_there() -> None:
    from accelscope.addon import interface

    assert accelscope.__all__ == interface.__all__
    for name in accelscope.__all__:
        assert getattr(accelscope, name).__doc__


def test_hits_are_known(built: accelscope.Built) -> None:
    rays = accelscope.rays([[0.2, 0.2, -1.0], [5.0, 5.0, -1.0]], [[0.0, 0.0, 2.0]] * 2)
    traced = accelscope.trace(built, rays)
    assert traced.hits.t.tolist() == [0.5, np.inf]
    assert traced.hits.primitive.tolist() == [0, -1]
    assert traced.counters["N_IT"].tolist() == [2, 2]
    assert accelscope.walk(built, traced, 0).tally()["N_IT"] == 2
    assert accelscope.record(built, traced)["rays"]["name"] == "own"


def test_settings_are_texts_or_values(built: accelscope.Built) -> None:
    scene = built.structure.scene
    by_value = accelscope.build(scene, "grid", resolution=[2, 3, 4], mailbox=True)
    by_text = accelscope.build(scene, "grid:resolution=2x3x4,mailbox=true")
    assert by_value.structure.settings == by_text.structure.settings
    both = accelscope.build(scene, "grid:mailbox=true", resolution=(2, 3, 4))
    assert both.structure.settings == by_text.structure.settings


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda b: accelscope.load("sample:nothing"), "nothing"),
        (lambda b: accelscope.build(b.structure.scene, "bhv"), "no structure 'bhv'; known are"),
        (lambda b: accelscope.build(b.structure.scene, "bvh", leaf=3), "no setting 'leaf'"),
        (lambda b: accelscope.build(b.structure.scene, "bvh", arity=4), "arity"),
        (lambda b: accelscope.build(b.structure.scene, "bvh", bins=1), "at least 2"),
        (lambda b: accelscope.trace(b, "camera", wide=3), "no setting 'wide'"),
        (lambda b: accelscope.trace(b, accelscope.rays([[0, 0, 0]], [[0, 0, 0]])), "zero"),
        (
            lambda b: accelscope.trace(b, accelscope.rays([[0, 0, 0]], [[0, 0, 1]]), count=3),
            "no settings",
        ),
        (
            lambda b: accelscope.walk(b, accelscope.trace(b, "random_lines", count=3), 3),
            "rays 0 to 2, not 3",
        ),
        (lambda b: accelscope.scene(np.full((1, 3, 3), np.nan)), "finite"),
    ],
)
def test_what_does_not_fit_is_refused(built: accelscope.Built, call, message: str) -> None:
    with pytest.raises(accelscope.InputError, match=message):
        call(built)
