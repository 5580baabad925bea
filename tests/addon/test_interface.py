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
            "no setting .count.; its settings are: order",
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


def test_instances_of_arrays_and_of_scenes() -> None:
    corners = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 1], [0, 1, 1.0]]])
    places = np.tile(np.eye(3, 4), (3, 1, 1))
    places[:, 0, 3] = (0, 5, 10)
    row = accelscope.instances([corners], [0, 0, 0], places, [1, 2, 3])
    rows = accelscope.instances([row, row], [0, 1], places[:2, [1, 0, 2]])
    for scene, count in ((row, 6), (rows, 12)):
        assert len(scene.flat()) == count
        starts = scene.flat().triangles.mean(axis=1) + np.array([0, 0, 9])
        lines = accelscope.rays(starts, [[0, 0, -1]] * count)
        built = accelscope.build(scene)
        traced = accelscope.trace(built, lines)
        flat = accelscope.trace(accelscope.build(scene.flat()), lines)
        assert traced.hits.primitive.tolist() == flat.hits.primitive.tolist()
        assert "N_TS_1" in accelscope.record(built, traced)["trace"]
        text = accelscope.table(accelscope.record(built, traced))
        assert str(count) in text
        cells = accelscope.cells(built)
        assert cells.extra["level"].max() == (1 if scene is row else 2)
    for arguments, said in (
        (([corners], [0, 1], places[:2]), "instance 1 is of mesh 1; meshes are 0 to 0"),
        (([corners], [-1], places[:1]), "instance 0 is of mesh -1"),
        (([corners], [0], places[:1], 256), "mask 256 is not from 0 to 255"),
        (([corners, row], [0, 1], places[:2]), "of one kind"),
        (([], [], places[:0]), "there are no instances"),
    ):
        with pytest.raises(accelscope.InputError, match=said):
            accelscope.instances(*arguments)


def test_instances_of_files_are_kept_or_flattened(cases) -> None:
    path = str(cases / "gltf_instancing.gltf")
    kept, flat = accelscope.load(path), accelscope.load(path, instances="flatten")
    assert len(kept.flat()) == len(flat) == len(flat.triangles) == 3
    assert np.allclose(kept.flat().triangles, flat.triangles)
    with pytest.raises(accelscope.InputError, match="instances"):
        accelscope.load(path, instances="melt")
    said = accelscope.record(accelscope.build(kept))["scene"]["instances"]
    assert said == {"count": 3, "meshes": 1, "triangles": 1}


def test_a_program_is_launched_by_name(built: accelscope.Built) -> None:
    launched = accelscope.launch(built, "shadows", width=8, height=6)
    assert launched.colours.shape == (6, 8, 4)
    assert launched.totals["ray_generation"] == 48
    with pytest.raises(accelscope.InputError, match="there is no program"):
        accelscope.launch(built, "nothing")
