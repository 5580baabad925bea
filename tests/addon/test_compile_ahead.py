"""Compiling ahead as Blender sees it: when it starts, what it lets run plain, how it ends."""

from __future__ import annotations

from typing import Any

import pytest
from accelscope.core import kernels
from accelscope.core.kernels import has_numba

needs_numba = pytest.mark.skipif(not has_numba(), reason="there is nothing to compile with")


class StandIn:
    """A process that is as it is told."""

    def __init__(self, *arguments: Any) -> None:
        self.arguments, self.is_running, self.stops = arguments, True, 0

    def stop(self) -> None:
        self.is_running, self.stops = False, self.stops + 1


@pytest.fixture
def ahead(bpy: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """The module, whose process is a stand-in, in a Blender that seems to have windows."""
    from accelscope.addon import compile_ahead

    monkeypatch.setattr(compile_ahead, "Preparation", StandIn)
    monkeypatch.setattr(compile_ahead, "is_done", lambda: False)
    yield compile_ahead
    compile_ahead.stop()


@needs_numba
def test_it_is_started_once_and_stopped(ahead: Any, bpy: Any) -> None:
    assert ahead.running() is None
    ahead._start()
    process = ahead.running()
    assert process.arguments[0] == "accelscope"
    ahead._start()
    assert ahead.running() is process
    assert ahead._look() == ahead.OFTEN
    assert bpy.app.timers.is_registered(ahead._look)
    ahead.stop()
    assert process.stops == 1
    assert ahead.running() is None
    assert not bpy.app.timers.is_registered(ahead._look)


@needs_numba
def test_another_file_does_not_stop_it(ahead: Any, bpy: Any) -> None:
    ahead._start()
    bpy.ops.wm.read_homefile(use_empty=True)
    assert bpy.app.timers.is_registered(ahead._look)
    ahead.running().is_running = False
    assert ahead._look() is None


def test_it_does_not_start_when_all_is_done_or_in_the_background(
    ahead: Any, bpy: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ahead, "is_done", lambda: True)
    ahead._start()
    assert ahead.running() is None
    ahead.start_soon()  # this Blender has no windows
    assert not bpy.app.timers.is_registered(ahead._start)


@needs_numba
def test_only_builds_over_small_scenes_run_plain_and_only_meanwhile(ahead: Any, bpy: Any) -> None:
    with ahead.plain_for(10):
        assert not kernels.is_plain()  # nothing is being compiled
    ahead._start()
    with ahead.plain_for(ahead.FEW_ITEMS + 1):
        assert not kernels.is_plain()
    with ahead.plain_for(ahead.FEW_ITEMS):
        assert kernels.is_plain()
    assert not kernels.is_plain()


@needs_numba
def test_a_build_says_that_it_was_plain_and_a_trace_is_compiled(ahead: Any, bpy: Any) -> None:
    from accelscope.addon.results import session

    bpy.ops.mesh.primitive_cube_add()
    ahead._start()
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert session.current.built.is_plain
    assert session.current.record["environment"]["numba"] is None
    assert not kernels.is_plain()
    ahead.stop()
    assert bpy.ops.accelscope.build() == {"FINISHED"}
    assert not session.current.built.is_plain
    assert session.current.record["environment"]["numba"]


def test_the_preference_is_taken_for_granted_where_there_is_none(ahead: Any) -> None:
    assert ahead.is_wanted()
