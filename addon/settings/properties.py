"""Properties: everything the user can set, as Blender properties of the scene.

Those of structures and workloads are :mod:`.generated` from their settings.

``scene.accelscope`` is made on first use. Knowing the settings means importing the structures, and
with them Numba: half a second that every start of Blender would wait for otherwise.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping
from typing import Any

import bpy
import numpy as np
from bpy.props import (
    BoolProperty,
    FloatProperty,
    FloatVectorProperty,
    PointerProperty,
)

from ...core.geometry.csg.settings import CuttingSettings
from ...core.scene.placing import PlacingSettings
from ..drawing import overlay
from ..from_blender import extraction
from ..results import lesson_view, session
from . import instances, solids
from .generated import condition_of, enum_of, group_type, name_of, properties_of, property_of
from .ranges import MOST, range_properties

COLOURINGS = {
    "depth": ("Depth", "From the root to the deepest cell"),
    "count": ("Count", "By the number of primitives in the leaf"),
    "order": (
        "Build Step",
        "By the step of the building that made the cell, where it was built in steps",
    ),
}

FIRST_LEVELS = 5
"""Depth down to which cells are drawn at first: what lies deeper is a mass of lines."""

LECTURE = (
    "naive", "sorted_volumes", "bvh", "grid", "octree", "kdtree", "bsp", "macro_grid",
)  # fmt: skip
"""Structures in the order in which the lecture comes to them; all others follow."""

_loaded: list[type] = []
"""Property groups that are registered; the root is the last."""


# ------------------------------------------------------------------------------ scene.accelscope


def _redraw(group: Any, context: bpy.types.Context) -> None:
    overlay.tag_redraw()


def _show_leaves(display: Any, context: bpy.types.Context) -> None:
    """Show all leaves, as long as nobody has chosen a depth: most of them lie below the first."""
    if display.leaves_only and not display.is_property_set("depth_max_kept"):
        display.depth_max = MOST
    overlay.tag_redraw()


def _deepest(group: Any) -> int | None:
    drawable = session.current.drawable
    return None if drawable is None else drawable.extent.deepest


def _display_properties() -> dict[str, Any]:
    """Return what decides how cells are drawn; the overlay reads it."""
    return {
        "show": BoolProperty(
            name="Show Cells", description="Draw the cells over the scene",
            default=True, update=_redraw,
        ),
        **range_properties(
            "depth_min", _deepest, label="Depth Min",
            description="Least depth of the cells drawn; the root has depth 0", update=_redraw,
        ),
        **range_properties(
            "depth_max", _deepest, label="Max", default=FIRST_LEVELS, open_end=True,
            description="Largest depth of the cells drawn", update=_redraw,
        ),
        "leaves_only": BoolProperty(
            name="Leaves Only", description="Leave out inner nodes", default=False,
            update=_show_leaves,
        ),
        "hide_empty": BoolProperty(
            name="Hide Empty", description="Leave out the edges of leaves without primitives",
            default=True, update=_redraw,
        ),
        "tint_empty": BoolProperty(
            name="Tint Empty", description="Draw the faces of leaves without primitives, tinted",
            default=False, update=_redraw,
        ),
        "planes": BoolProperty(
            name="Planes",
            description="Draw the planes that cut inner nodes, each within its own cell",
            default=False, update=_redraw,
        ),
        "opacity": FloatProperty(
            name="Opacity", description="Opacity of edges; tints and planes follow it",
            default=0.6, min=0.0, max=1.0, subtype="FACTOR", update=_redraw,
        ),
        "line_width": FloatProperty(
            name="Line Width", description="Width of the cells' edges in pixels",
            default=1.0, min=0.5, max=10.0, update=_redraw,
        ),
        "colour_by": enum_of(
            COLOURINGS, name="Colour By", description="What the colour of a cell means",
            default="depth", update=_redraw,
        ),
    }  # fmt: skip


def _follow_knobs(group: Any, context: bpy.types.Context) -> None:
    lesson_view.current.follow(group.id_data)


def _teach_chosen(group: Any, context: bpy.types.Context) -> None:
    """Go on with another lesson if one is taught; otherwise it is chosen, and nothing happens."""
    scene, view = group.id_data, lesson_view.current
    group.show_answer = False
    if view.is_in(scene) and lesson_view.chosen(scene) != view.lesson:
        lesson_view.ask("teach", scene, subject="MESH" if view.is_own else "SAMPLE")


def _frame_again(group: Any, context: bpy.types.Context) -> None:
    lesson_view.current.frame_again(group.id_data)


def _hide_cells(group: Any, context: bpy.types.Context) -> None:
    if lesson_view.current.is_in(group.id_data):
        lesson_view.current.hide_cells(group.id_data)


def _aim(group: Any, context: bpy.types.Context) -> None:
    """Set both handles beside the scene that is taught, when they are shown."""
    view = lesson_view.current
    if group.aim and view.subject is not None and view.is_in(group.id_data):
        lower, upper = view.subject.scene.lower, view.subject.scene.upper
        middle, half = 0.5 * (lower + upper), 0.5 * (upper - lower)
        across = (1.2 * half[0], 0.3 * half[1], 0.4 * half[2])
        group.ray_to, group.ray_from = middle + across, middle - across


def _aim_again(group: Any, context: bpy.types.Context) -> None:
    view, way = lesson_view.current, np.subtract(group.ray_to, group.ray_from)
    if group.aim and view.is_in(group.id_data) and way.any():
        view.choose_ray(group.id_data, np.array(group.ray_from), way)


def _teaching_properties(lessons: Mapping[str, Any]) -> dict[str, Any]:
    """Return which lesson is chosen, and how it is taught."""
    choices = {name: (lesson.label, lesson.begin) for name, lesson in lessons.items()}
    return {
        "lesson": enum_of(
            choices, name="Lesson", description="What is taught, in the order of the lecture",
            default=next(iter(choices)), update=_teach_chosen,
        ),
        "show_answer": BoolProperty(
            name="Answer", description="Show the answer to the question to the class",
            default=False,
        ),
        "large_text": BoolProperty(
            name="Large Text",
            description="For a projector: larger text in the viewport, and with it the title, the "
            "figures and the caption",
            default=False, update=_frame_again,
        ),
        "hide_cells": BoolProperty(
            name="Hide Cells", description="Leave out the cells of what was built meanwhile",
            default=True, update=_hide_cells,
        ),
        "aim": BoolProperty(
            name="Aim Ray",
            description="Two handles in the viewport: the lesson shows the ray from one towards "
            "the other",
            default=False, update=_aim,
        ),
        "ray_from": FloatVectorProperty(
            name="From", description="Where the ray starts", size=3, subtype="XYZ",
            update=_aim_again,
        ),
        "ray_to": FloatVectorProperty(
            name="To", description="What the ray goes towards; there t is 1", size=3,
            subtype="XYZ", update=_aim_again,
        ),
    }  # fmt: skip


def _knobs_of(lesson: Any) -> dict[str, Any]:
    """Return the knobs of a lesson; whole numbers without a maximum end where the play ends."""
    knobs: dict[str, Any] = {}
    for each in dataclasses.fields(lesson.Settings):
        default: Any = each.default
        meta = each.metadata
        is_whole = isinstance(default, int) and not isinstance(default, bool)
        if is_whole and meta["maximum"] is None:
            knobs |= range_properties(
                each.name,
                functools.partial(_last_of_knob, lesson.name, each.name),
                label=meta["label"],
                default=default,
                description=meta["description"],
                update=_follow_knobs,
            )
        else:
            condition = condition_of(each, lesson.Settings)
            knobs[each.name] = property_of(each, condition, update=_follow_knobs)
    return knobs


def _last_of_knob(lesson: str, knob: str, group: Any) -> int | None:
    return lesson_view.end_of(lesson, knob)


def in_lecture(entries: Mapping[str, Any]) -> dict[str, Any]:
    """Return structures in the order of the lecture."""
    known = [name for name in LECTURE if name in entries]
    return {
        name: entries[name] for name in [*known, *(each for each in entries if each not in known)]
    }


def is_loaded() -> bool:
    """Say whether ``scene.accelscope`` exists already; panels must not make it."""
    return bool(_loaded)


def load() -> None:
    """Make the property groups and put them on the scene.

    Blender refuses this (RuntimeError) while it draws a panel.
    """
    if _loaded:
        return
    from ...core.evaluation.rays.workloads import workloads
    from ...core.lessons import lessons
    from ...core.pipeline.loading import program_named, program_names
    from ...core.structures import structures

    def make(name: str, properties: Mapping[str, Any]) -> type:
        group = group_type(name, properties)
        bpy.utils.register_class(group)
        _loaded.append(group)
        return group

    def make_all(kind: str, entries: Mapping[str, Any]) -> type:
        groups = {
            name: PointerProperty(type=make(f"{kind}_{name}", properties_of(entry.Settings)))
            for name, entry in entries.items()
        }
        return make(f"{kind}s", groups)

    def choice_of(entries: Mapping[str, Any], default: str, **options: Any) -> Any:
        choices = {name: (entry.label, entry.summary) for name, entry in entries.items()}
        return enum_of(choices, default=default, **options)

    knobs = {
        name: PointerProperty(type=make(f"lesson_{name}", _knobs_of(lesson)))
        for name, lesson in lessons().items()
    }
    root = {
        "teaching": PointerProperty(type=make("teaching", _teaching_properties(lessons()))),
        "lessons": PointerProperty(type=make("lessons", knobs)),
        "scope": enum_of(
            extraction.SCOPES,
            name="Scope", description="Which objects are built over", default=extraction.VISIBLE,
        ),
        **properties_of(PlacingSettings),
        **properties_of(CuttingSettings),
        "structure": choice_of(
            in_lecture(structures()), "bvh", name="Structure",
            description="Acceleration structure to build",
        ),
        "structures": PointerProperty(type=make_all("structure", structures())),
        "workload": choice_of(
            workloads(), "camera", name="Rays", description="Set of rays to trace"
        ),
        "workloads": PointerProperty(type=make_all("workload", workloads())),
        "pipeline": PointerProperty(type=make("pipeline", {"program": enum_of(
            {name: (name_of(name), program_named(name).label) for name in program_names()},
            default="lecture", name="Program", description="Which shaders are run",
        )})),
        "display": PointerProperty(type=make("display", _display_properties())),
    }  # fmt: skip
    bpy.types.Scene.accelscope_settings = PointerProperty(type=make("root", root))


def load_soon() -> None:
    """Make the properties as soon as Blender has finished drawing."""
    if not bpy.app.timers.is_registered(_load_and_redraw):
        bpy.app.timers.register(_load_and_redraw, first_interval=0.01)


def _load_and_redraw() -> None:
    load()
    overlay.tag_redraw()


def _root_of(scene: bpy.types.Scene) -> Any:
    """Return the settings of a scene: what ``scene.accelscope`` is."""
    load()
    return scene.accelscope_settings


def register() -> None:
    """Give scenes their ``accelscope``, whose groups come on first use, and objects their own."""
    solids.register()
    instances.register()
    bpy.types.Scene.accelscope = property(_root_of)


def unregister() -> None:
    """Take it all away; the values stay in the file."""
    if bpy.app.timers.is_registered(_load_and_redraw):
        bpy.app.timers.unregister(_load_and_redraw)
    instances.unregister()
    solids.unregister()
    del bpy.types.Scene.accelscope
    if _loaded:
        del bpy.types.Scene.accelscope_settings
    while _loaded:
        bpy.utils.unregister_class(_loaded.pop())
