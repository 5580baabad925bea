"""A scene of its own in the open file for the sample that a lesson is taught on.

The user's scene stays as it is: it is not even shown meanwhile. A file that was saved during a
lesson has the scene; it is known by a property of its own, and goes when the lesson ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import bpy

from ...core.scene import Scene
from .sample_objects import add_scene

NAME = "AccelScope Lesson"

HOME = "accelscope_home"
"""Property of the scene: the scene of the user's that it stands in for."""

OURS = "accelscope_lesson"
"""Property of scene, objects, collections and texts that are there for a lesson alone.

The scene's says which sample it has: undo brings back that of another lesson, and this with it.
"""


def is_ours(owner: bpy.types.ID) -> bool:
    """Say whether something is there for a lesson alone."""
    return OURS in owner


def sample_in(owner: bpy.types.Scene) -> str:
    """Return which sample of a lesson a scene has, as the lesson says it; "" if it has none."""
    return str(owner.get(OURS, ""))


def open_scene(
    window: bpy.types.Window, sample: str, scene: Scene, label: str, items: Sequence[Any] | None
) -> bpy.types.Scene:
    """Show a sample in the scene for lessons, and that in a window; return it.

    Parameters
    ----------
    sample : str
        Which it is, with its settings.
    label : str
        Of the sample.
    items : sequence of Item or Part, optional
        Descriptions of its items, if it has solids; of its parts, if it has trees.
    """
    owner = window.scene
    if not is_ours(owner):
        home = owner
        owner = bpy.data.scenes.new(NAME)
        owner[HOME] = home
        owner.render.engine = home.render.engine
        window.scene = owner
    owner[OURS] = sample
    empty(owner)
    collection = add_scene(owner, scene, label, items, has_materials=False)
    # Operands of Boolean modifiers lie in collections within.
    for each in (collection, *collection.children_recursive, *collection.all_objects):
        each[OURS] = True
    layer = owner.view_layers[0]
    for obj in collection.objects:
        obj.select_set(False, view_layer=layer)
        # Frames of cameras and lights are lines like those of the lesson.
        obj.hide_set(obj.type != "MESH", view_layer=layer)
    layer.objects.active = None
    return owner


def close_scene(owner: bpy.types.Scene) -> bpy.types.Scene:
    """Go back to the user's scene, which is returned, and remove the one for lessons.

    What the user has put into it meanwhile is kept, and with it the scene.
    """
    home = owner.get(HOME) or next((each for each in bpy.data.scenes if each != owner), None)
    if home is None:
        home = bpy.data.scenes.new("Scene")
    for window in bpy.context.window_manager.windows:
        if window.scene == owner:
            window.scene = home
    empty(owner)
    if any(len(obj.users_scene) == 1 for obj in owner.objects):
        del owner[OURS], owner[HOME]
    else:
        bpy.data.scenes.remove(owner)
    return home


def empty(owner: bpy.types.Scene) -> None:
    """Remove what lessons have put into their scene."""
    objects = [obj for obj in owner.objects if is_ours(obj)]
    data = {obj.data for obj in objects if obj.data is not None}
    bpy.data.batch_remove(objects)
    bpy.data.batch_remove([each for each in data if each.users == 0])
    collections: Iterable[bpy.types.Collection] = owner.collection.children_recursive
    bpy.data.batch_remove([each for each in collections if is_ours(each)])
