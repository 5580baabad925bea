"""Tests of the add-on: all of them need Blender, and some a frame buffer to draw into."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test in this folder: all of them need Blender."""
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.bpy)


@pytest.fixture(scope="module")
def canvas() -> Iterator[Any]:
    """A frame buffer that the overlay draws into (``overlay_canvas.py``)."""
    import bpy
    import gpu
    from overlay_canvas import Canvas, WithGPU

    if bpy.app.version >= (5, 2, 0):
        gpu.init()
        yield Canvas(lambda function: function())
    else:
        bpy.utils.register_class(WithGPU)
        yield Canvas(WithGPU.run)
        bpy.utils.unregister_class(WithGPU)


@pytest.fixture
def clean_overlay() -> Iterator[None]:
    """Let the overlay go of everything afterwards."""
    from accelscope.addon.drawing import overlay

    yield
    overlay.disable()
