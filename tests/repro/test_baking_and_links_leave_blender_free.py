"""Baking and looking for links are jobs: they show how far they are, and Esc stops them."""

from __future__ import annotations

import threading
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
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


@pytest.fixture
def show_links(jobs: Any) -> Any:
    from accelscope.operators.show_links import ACCELSCOPE_OT_show_links

    return pretended(jobs, ACCELSCOPE_OT_show_links, leaf=-1)


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
    """A kd-tree, whose leaves have links."""
    bpy.ops.mesh.primitive_monkey_add()
    root.structure = "kdtree"
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    return current.cells


def at_a_leaf(bpy: Any, cells: Any) -> int:
    place = int(np.flatnonzero(cells.is_leaf)[5])
    bpy.context.scene.cursor.location = 0.5 * (cells.boxes[place, :3] + cells.boxes[place, 3:])
    return int(cells.numbers[place])


def test_both_give_what_they_give_to_a_script(
    bpy: Any, cells: Any, bake: Any, show_links: Any, context: Any, current: Any
) -> None:
    bpy.ops.accelscope.bake()
    first = bpy.data.objects["kd-Tree Cells"]
    assert run(bake, context)[0] == {"FINISHED"}, bake.reports
    second = bpy.data.objects["kd-Tree Cells.001"]
    for key in ("position", ".edge_verts", "number", "colour"):
        one, two = (each.data.attributes[key].data for each in (first, second))
        assert len(one) == len(two) > 0
    assert bake.reports == [({"INFO"}, f"kd-Tree Cells.001: {len(second.data.edges)} edges")]

    number = at_a_leaf(bpy, cells)
    bpy.ops.accelscope.show_links()
    by_script = current.links
    current.set_links(-1, None)
    assert run(show_links, context)[0] == {"FINISHED"}
    assert current.linked_leaf == number
    for one, two in zip(by_script, current.links, strict=True):
        np.testing.assert_array_equal(one, two)


def test_nothing_of_it_is_computed_in_blenders_thread(
    bpy: Any, cells: Any, bake: Any, show_links: Any, context: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from accelscope.addon.to_blender import bake as baking
    from accelscope.core.lessons import ray_path

    threads = []

    def noting(function: Any) -> Any:
        def call(*arguments: Any, **named: Any) -> Any:
            threads.append(threading.current_thread())
            return function(*arguments, **named)

        return call

    for module, name in ((baking, "edges_of"), (ray_path, "leaf_at"), (ray_path, "links_of")):
        monkeypatch.setattr(module, name, noting(getattr(module, name)))
    at_a_leaf(bpy, cells)
    assert run(bake, context)[0] == run(show_links, context)[0] == {"FINISHED"}
    assert len(threads) == 3
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


def test_no_leaf_is_said_in_one_line(
    bpy: Any, cells: Any, show_links: Any, context: Any, current: Any
) -> None:
    bpy.context.scene.cursor.location = (1e6, 0, 0)
    assert run(show_links, context)[0] == {"FINISHED"}
    assert show_links.reports == [({"INFO"}, "There is no leaf at the 3D cursor")]
    show_links.leaf = int(cells.numbers[~cells.is_leaf][0])
    show_links.reports.clear()
    assert run(show_links, context)[0] == {"CANCELLED"}
    assert "there is no leaf with the number" in show_links.reports[0][1]


@pytest.mark.exhaustive
def test_a_million_cells(
    bpy: Any, root: Any, bake: Any, show_links: Any, context: Any, current: Any
) -> None:
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=500, y_subdivisions=500)
    root.structure = "octree"
    octree = root.structures.octree
    octree.max_depth, octree.max_leaf_size = 9, 1
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    root.display.hide_empty = False
    assert len(current.cells) > 1_000_000
    at_a_leaf(bpy, current.cells)
    for operator in (bake, show_links):
        outcome, longest = run(operator, context)
        assert outcome == {"FINISHED"}, operator.reports
        print(f"{operator.job_text}: {longest:.3f} s at most")
    assert len(bpy.data.objects["Octree Cells"].data.edges) == 12 * len(current.cells)
    assert len(current.links[0]) > 0
