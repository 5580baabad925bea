"""Cursor and status line are given back however the picking of a ray ends."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest

pytestmark = pytest.mark.bpy

MOVE = SimpleNamespace(type="MOUSEMOVE", value="NOTHING", mouse_x=10, mouse_y=10)
CLICK = SimpleNamespace(type="LEFTMOUSE", value="PRESS", mouse_x=10, mouse_y=10)
ESC = SimpleNamespace(type="ESC", value="PRESS", mouse_x=10, mouse_y=10)


class Pretended:
    """A context of Blender's, with a window that knows its cursor and its status line."""

    def __init__(self, scene: Any, area: Any) -> None:
        self.scene, self.area = scene, area
        self.cursor, self.status = "DEFAULT", None
        self.window: Any = SimpleNamespace(
            cursor_modal_set=lambda cursor: setattr(self, "cursor", cursor),
            cursor_modal_restore=lambda: setattr(self, "cursor", "DEFAULT"),
        )
        self.workspace = SimpleNamespace(status_text_set=lambda text: setattr(self, "status", text))
        self.window_manager = SimpleNamespace(modal_handler_add=lambda operator: True)

    @property
    def is_as_before(self) -> bool:
        return (self.cursor, self.status) == ("DEFAULT", None)


@pytest.fixture
def context(bpy: Any) -> Iterator[Pretended]:
    """A context in whose scene the lesson on a ray is taught."""
    from accelscope.addon.drawing.viewport import largest
    from accelscope.addon.results import lesson_view

    bpy.context.scene.accelscope.teaching.lesson = "ray"
    assert bpy.ops.accelscope.teach() == {"FINISHED"}
    yield Pretended(bpy.context.scene, largest(bpy.context.window))
    lesson_view.current.clear()


@pytest.fixture
def operator(context: Pretended) -> Any:
    """The operator, begun."""
    from accelscope.operators.pick_ray import ACCELSCOPE_OT_pick_ray as Real

    methods = {name: each for name, each in vars(Real).items() if callable(each)}
    begun = type("Pick", (), methods)()
    assert begun.invoke(context, MOVE) == {"RUNNING_MODAL"}
    assert context.cursor == "CROSSHAIR"
    assert begun.modal(context, MOVE) == {"PASS_THROUGH"}
    return begun


def test_it_is_cancelled_by_esc(context: Pretended, operator: Any) -> None:
    assert operator.modal(context, ESC) == {"CANCELLED"}
    assert context.is_as_before


def test_blender_ends_it(context: Pretended, operator: Any) -> None:
    """When a file is loaded, or the window is closed."""
    operator.cancel(context)
    assert context.is_as_before
    context.window = context.workspace = None
    operator.cancel(context)


@pytest.mark.parametrize("event", [MOVE, CLICK])
@pytest.mark.parametrize("area", [None, SimpleNamespace(type="OUTLINER", regions=())])
def test_its_viewport_is_gone(context: Pretended, operator: Any, event: Any, area: Any) -> None:
    context.area = area
    assert operator.modal(context, event) == {"CANCELLED"}
    assert context.is_as_before


def test_its_lesson_is_gone(context: Pretended, operator: Any) -> None:
    from accelscope.addon.results import lesson_view

    lesson_view.current.clear()
    assert operator.modal(context, CLICK) == {"CANCELLED"}
    assert context.is_as_before


def test_what_comes_of_the_click_fails(
    context: Pretended, operator: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise ValueError("broken")

    monkeypatch.setattr(operator, "take", fail)
    region = next(each for each in context.area.regions if each.type == "WINDOW")
    inside = SimpleNamespace(
        type="LEFTMOUSE", value="PRESS",
        mouse_x=region.x + region.width // 2, mouse_y=region.y + region.height // 2,
    )  # fmt: skip
    with pytest.raises(ValueError, match="broken"):
        operator.modal(context, inside)
    assert context.is_as_before
