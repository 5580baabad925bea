"""Extraction reads Blender in its thread and does the rest beside it, announced if it compiles."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest
from accelscope.core.geometry import triangulation
from accelscope.core.kernels import has_numba
from accelscope.core.progress import Progress

CONCAVE = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (1, 0.5, 0), (0, 2, 0)]


@pytest.fixture
def concave(bpy: Any) -> Any:
    mesh = bpy.data.meshes.new("concave")
    mesh.from_pydata(CONCAVE, [], [range(5)])
    obj = bpy.data.objects.new("Concave", mesh)
    bpy.context.collection.objects.link(obj)
    return obj


class Listening(Progress):
    def __init__(self) -> None:
        self.said: list[str] = []

    def announce(self, text: str) -> None:
        self.said.append(text)


def test_a_build_cuts_in_its_thread(
    bpy: Any, concave: Any, current: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon import jobs
    from accelscope.operators.build import ACCELSCOPE_OT_build

    threads, real = [], triangulation.triangulate

    def triangulate(*arguments: Any) -> Any:
        threads.append(threading.current_thread())
        return real(*arguments)

    monkeypatch.setattr(triangulation, "triangulate", triangulate)
    work = ACCELSCOPE_OT_build.prepare(None, bpy.context)
    assert threads == []
    job = jobs.Job(work, "Building")
    job.wait(60.0)
    assert job.error is None
    assert threads
    assert threading.main_thread() not in threads
    current.watch()
    scene = job.result.snapshot.scene
    area = 0.5 * np.linalg.norm(
        np.cross(*(scene.triangles[:, k] - scene.triangles[:, 0] for k in (1, 2))), axis=1
    )
    assert len(scene) == 3
    assert area.sum() == 2.5


@pytest.mark.skipif(not has_numba(), reason="without Numba nothing is compiled")
def test_what_compiles_is_announced(
    bpy: Any, concave: Any, monkeypatch: pytest.MonkeyPatch, run: Any, obj: Any
) -> None:
    from accelscope.addon.from_blender.snapshot import Taken

    taken, progress = Taken.at(bpy.context, "visible"), Listening()
    taken.snapshot()
    taken.snapshot(progress)
    assert progress.said == []  # it has been compiled by now
    real = triangulation.triangulate

    def triangulate(*arguments: Any) -> Any:
        import numba

        numba.njit(lambda x: x + 1)(1)
        return real(*arguments)

    monkeypatch.setattr(triangulation, "triangulate", triangulate)
    taken.snapshot(progress)
    (said,) = progress.said
    assert said.startswith("compiling the cutting of polygons, once after installation")


def test_instances_share_what_was_cut(
    bpy: Any, concave: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon.from_blender.snapshot import Taken

    for place in range(5):
        other = bpy.data.objects.new("Other", concave.data)
        other.location.z = 1.0 + place
        bpy.context.collection.objects.link(other)
    calls, real = [], triangulation.triangulate

    def triangulate(*arguments: Any) -> Any:
        calls.append(1)
        return real(*arguments)

    monkeypatch.setattr(triangulation, "triangulate", triangulate)
    scene = Taken.at(bpy.context, "visible", "flatten").snapshot().scene
    assert len(calls) == 1
    assert sorted(np.unique(scene.triangles[:, 0, 2]).tolist()) == [0, 1, 2, 3, 4, 5]


def test_notes_of_the_triangles_stay(bpy: Any, current: Any) -> None:
    """Those of camera and lights do not push them out."""
    bpy.ops.mesh.primitive_cube_add()
    cube = bpy.context.object
    corners = [(x, y, z) for x in (0.0, 1e30) for y in (0.0, 1e30) for z in (0.0, 1e-33)]
    cube.data.vertices.foreach_set("co", np.array(corners, dtype=np.float32).ravel())
    cube.data.update()
    cube.scale = (1e7, 1e7, 2e-38)
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    (note,) = current.notes()
    assert "taken as flat" in note
    bpy.context.scene.accelscope.workload = "random_lines"
    bpy.context.scene.accelscope.workloads.random_lines.count = 10
    assert bpy.ops.accelscope.trace() == {"FINISHED"}
    assert current.record["scene"]["notes"] == [note]
