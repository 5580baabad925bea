"""Baking is a job: it shows how far it is, and Esc stops it."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any

import pytest

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")
ESC = SimpleNamespace(type="ESC", value="PRESS")


def pretended(jobs: Any, operator: type, **properties: Any) -> Any:
    """Return an operator with the functions of a real one, which Blender alone can make."""
    own = {
        key: value
        for key, value in vars(operator).items()
        if key in ("prepare", "finish", "give_up", "tick", "job_text", "refused_text", "head_start")
    }
    made = type("Pretended", (jobs.JobOperator,), own | properties)()
    made.reports = []
    made.report = lambda kind, text: made.reports.append((kind, text))
    return made


@pytest.fixture
def bake(jobs: Any) -> Any:
    from accelscope.operators.bake import ACCELSCOPE_OT_bake

    return pretended(jobs, ACCELSCOPE_OT_bake)


def run(operator: Any, context: Any, until: Any = lambda: False) -> tuple[set[str], float]:
    """Run an operator; return how it ended, and the longest that it held Blender's thread up.

    That is processor time, and what Blender takes to clear the memory of one array, at least.
    """
    longest, end = 0.0, time.monotonic() + 300.0
    step = lambda: operator.invoke(context, None)  # noqa: E731
    while True:
        begin = time.thread_time()
        outcome = step()
        longest = max(longest, time.thread_time() - begin)
        if outcome not in ({"RUNNING_MODAL"}, {"PASS_THROUGH"}):
            return outcome, longest
        assert time.monotonic() < end
        event = ESC if until() else TIMER
        step = lambda event=event: operator.modal(context, event)  # noqa: E731
        time.sleep(0.005)


@pytest.fixture
def cells(bpy: Any, root: Any, current: Any) -> Any:
    """Those of a kd-tree."""
    bpy.ops.mesh.primitive_monkey_add()
    root.structure = "kdtree"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    return current.cells


def test_it_gives_what_it_gives_to_a_script(bpy: Any, cells: Any, bake: Any, context: Any) -> None:
    bpy.ops.accelscope.bake()
    first = bpy.data.objects["kd-Tree Cells"]
    assert run(bake, context)[0] == {"FINISHED"}, bake.reports
    second = bpy.data.objects["kd-Tree Cells.001"]
    for key in ("position", ".edge_verts", "number", "colour"):
        one, two = (each.data.attributes[key].data for each in (first, second))
        assert len(one) == len(two) > 0
    assert bake.reports == [({"INFO"}, f"kd-Tree Cells.001: {len(second.data.edges)} edges")]


def test_nothing_of_it_is_computed_in_blenders_thread(
    bpy: Any, cells: Any, bake: Any, context: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon.to_blender import bake as baking

    threads = []

    def noting(function: Any) -> Any:
        def call(*arguments: Any, **named: Any) -> Any:
            threads.append(threading.current_thread())
            return function(*arguments, **named)

        return call

    monkeypatch.setattr(baking, "edges_of", noting(baking.edges_of))
    assert run(bake, context)[0] == {"FINISHED"}
    assert len(threads) == 1
    assert threading.main_thread() not in threads


def test_esc_takes_away_what_was_begun(
    bpy: Any, cells: Any, bake: Any, context: Any, jobs: Any
) -> None:
    objects, meshes = len(bpy.data.objects), len(bpy.data.meshes)
    jobs_errands, jobs.ERRANDS = jobs.ERRANDS, 0.0
    try:
        outcome, _ = run(bake, context, until=lambda: len(bpy.data.meshes) > meshes)
    finally:
        jobs.ERRANDS = jobs_errands
    assert outcome == {"CANCELLED"}
    assert bake.reports == [({"INFO"}, "Cancelled; the previous result stays")]
    assert (len(bpy.data.objects), len(bpy.data.meshes)) == (objects, meshes)
    assert jobs.running() is None
    assert run(bake, context)[0] == {"FINISHED"}


def test_what_was_begun_is_taken_away_by_somebody_else(
    bpy: Any, cells: Any, bake: Any, context: Any, jobs: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs, "ERRANDS", 0.0)
    meshes = set(bpy.data.meshes.keys())

    def remove() -> bool:
        for name in set(bpy.data.meshes.keys()) - meshes:
            bpy.data.meshes.remove(bpy.data.meshes[name])
        return False

    assert run(bake, context, until=remove)[0] == {"CANCELLED"}
    assert bake.reports == [
        ({"ERROR"}, "the file was changed meanwhile, as by an undo; bake again")
    ]
    assert jobs.refusal().startswith("Not baked: the file was changed")


@pytest.mark.exhaustive
def test_a_million_cells(bpy: Any, root: Any, bake: Any, context: Any, current: Any) -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=500, y_subdivisions=500)
    root.structure = "octree"
    octree = root.structures.octree
    octree.max_depth, octree.max_leaf_size = 9, 1
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    root.display.hide_empty, root.display.depth_max = False, 1000
    assert len(current.cells) > 1_000_000
    outcome, longest = run(bake, context)
    assert outcome == {"FINISHED"}, bake.reports
    print(f"{bake.job_text}: {longest:.3f} s at most")
    assert len(bpy.data.objects["Octree Cells"].data.edges) == 12 * len(current.cells)
