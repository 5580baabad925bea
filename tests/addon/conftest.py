"""A Blender in which the add-on is registered, with an empty file for every test."""

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


@pytest.fixture(scope="session")
def addon() -> Iterator[Any]:
    """The registered add-on."""
    import accelscope

    accelscope.register()
    yield accelscope
    # A handler that is left when Python exits hangs Blender 4.5.
    accelscope.unregister()


@pytest.fixture
def bpy(addon: Any) -> Iterator[Any]:
    """Blender with an empty file."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)
    yield bpy
    if bpy.ops.accelscope.clear.poll():
        bpy.ops.accelscope.clear()


@pytest.fixture
def root(bpy: Any) -> Any:
    """The settings of the scene."""
    return bpy.context.scene.accelscope


@pytest.fixture
def current(bpy: Any) -> Any:
    """The session."""
    from accelscope.addon import session

    return session.current
