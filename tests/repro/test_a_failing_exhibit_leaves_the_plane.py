"""Plane and exhibit are made by one job: what goes wrong with one is no fault of the other."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.fixture
def shown(bpy: Any, root: Any, current: Any, monkeypatch: pytest.MonkeyPatch) -> Any:
    """A BVH, with an exhibit and a plane that are to be shown and are not made yet."""
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    with monkeypatch.context() as patch:
        patch.setattr("accelscope.addon.results.session.make_frame_soon", lambda scene: None)
        root.exhibits.show = root.split_plane.show = True
    assert current.split_view.axes == {}
    return root


def fail(*_: Any) -> None:
    raise ZeroDivisionError("a fault")


def test_an_exception_of_the_exhibit(
    bpy: Any, shown: Any, current: Any, monkeypatch: pytest.MonkeyPatch, capsys: Any
) -> None:
    from accelscope.addon import jobs
    from accelscope.addon.drawing import overlay

    monkeypatch.setattr(type(current.showcase), "make", fail)
    with pytest.raises(RuntimeError, match="ZeroDivisionError: a fault"):
        bpy.ops.accelscope.show_frame()
    assert list(current.split_view.axes) == ["x"]
    assert overlay.PLANE in overlay._overlay.layers
    assert overlay.EXHIBIT not in overlay._overlay.layers
    assert jobs.refusal() == (
        "Not shown: a defect of AccelScope (ZeroDivisionError: a fault); the console has more"
    )


def test_an_exception_of_the_plane_draws_none(
    bpy: Any, shown: Any, current: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(type(current.split_view), "make", fail)
    with pytest.raises(RuntimeError, match="ZeroDivisionError: a fault"):
        bpy.ops.accelscope.show_frame()
    assert current.split_view.axes == {}


def test_what_the_panel_asks_for_fails_in_one_line(
    bpy: Any, shown: Any, current: Any, monkeypatch: pytest.MonkeyPatch, capfd: Any
) -> None:
    """A slider has nobody who could catch an exception: without a window, too."""
    from accelscope.core.errors import InputError

    def refuse(*_: Any) -> None:
        raise InputError("no frame today")

    monkeypatch.setattr(type(current.showcase), "make", refuse)
    capfd.readouterr()
    shown.exhibits.frame = 1
    said = capfd.readouterr()
    assert said.err == "AccelScope: Error: no frame today\n"
