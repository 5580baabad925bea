"""Session: what has been built and traced, kept outside of Blender's data.

Results are Python objects that no .blend can hold and no undo step should copy. They survive undo
and are dropped when another file is loaded. Whether they are still those of the scene is watched
(:mod:`..from_blender.watching`); nothing is rebuilt by itself.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
from bpy.app.handlers import persistent

from ...core.errors import InputError
from ...core.geometry.csg.settings import CuttingSettings
from ...core.geometry.csg.trees import Csg
from ...core.printing import show_integer
from ...core.scene.placing import FLATTEN, KEEP, OBJECTS
from ...core.settings import has_effect
from .. import handlers, jobs
from ..drawing import overlay
from ..drawing.drawable import Drawable
from ..from_blender import extraction, watching
from ..from_blender.snapshot import Look, Snapshot, Taken
from ..from_blender.view import View
from ..settings import choices, generated
from .outcome import Outcome
from .wording import refusal_in_panel

if TYPE_CHECKING:  # importing them for real would import Numba, and make Blender start slower
    from ...core.contract.cells import Cells
    from ...core.contract.structure import Structure
    from ...core.evaluation.records.experiment import Built, Traced
    from ...core.lessons.lesson import Lesson
    from ...core.lessons.moment import Moment


TAKEN_SO = {
    KEEP: "instances were kept",
    OBJECTS: "every object was an instance",
    FLATTEN: "instances were flattened",
    "": "objects were no instances",
}
"""What to say of a scene that was taken with another setting; without a name it made no odds."""


class Status(NamedTuple):
    """Whether the results belong to what Blender shows, and if not, why."""

    up_to_date: bool
    text: str


@dataclass
class Session:
    """The results; all None before the first build.

    Attributes
    ----------
    snapshot : Snapshot
        What was built over.
    built : Built
    drawable : Drawable
        Its cells, as the overlay draws them.
    record : dict
        The figures, those of the traced rays included.
    traced : Traced
    launched : dict
        The record of the last program of the pipeline.
    timeline : list of dict
        The records of the last comparison over the timeline.
    history : list of Moment
        The same for the lesson of refitting.
    lesson_look : Look
        How the meshes looked that the lesson on the user's scene is about.
    other_view : str
        Which of the structure's needs beside triangles had changed, when that was last compared.
    """

    snapshot: Snapshot | None = None
    built: Built | None = None
    drawable: Drawable | None = None
    record: dict[str, Any] | None = None
    traced: Traced | None = None
    launched: dict[str, Any] | None = None
    timeline: list[dict[str, Any]] = field(default_factory=list)
    history: Sequence[Moment] = ()
    other_view: str = ""
    lesson_look: Look | None = None

    # Storing results.

    def take(self, context: bpy.types.Context, scope: str, instances: str) -> Taken:
        """Take the scene from Blender for work to come, and keep an eye on it from now on.

        Parameters
        ----------
        scope : {"visible", "selected"}
        instances : {"keep", "flatten"}

        Raises
        ------
        InputError
            When there is nothing to build over, or a mesh is invalid.
        """
        taken = Taken.at(context, scope, instances)
        cutting = generated.read(context.scene.accelscope, CuttingSettings, "bounds of CSG trees")
        taken = taken._replace(raw=taken.raw._replace(cutting=cutting))
        self.watch(taken.look)
        return taken

    def watch(self, *looks: Look) -> None:
        """Keep an eye on what is looked at by work under way, too; it may come to nothing."""
        own = [self.snapshot.look] if self.snapshot else []
        if self.lesson_look is not None and self.lesson_look not in own:
            own.append(self.lesson_look)
        watching.watched[:] = [*own, *looks]

    def given_for(self, lesson: Lesson, context: bpy.types.Context) -> list[Structure]:
        """Return what was built, if a lesson on the user's mesh can be about that; or nothing.

        It can if it is still the mesh's, was built with a log, and is what the lesson wants first.
        What is selected alone is another mesh than all that is visible.
        """
        if self.built is None or self.snapshot is None or not lesson.structures:
            return []
        look, structure = self.snapshot.look, self.built.structure
        # Lessons on a ray look at what it does, not at how that came about.
        lacks_log = not structure.keeps_log and not lesson.takes_ray
        if lacks_log or lesson.suits(structure):
            return []
        scoped = extraction.objects_in_scope(context.view_layer, extraction.SELECTED)
        selected = {obj.session_uid for obj in scoped}
        built_over = {key[0] or key[1] for key in look.digests}
        is_other = selected and not built_over <= selected
        if look.scope == extraction.SELECTED:
            is_other = not selected
        if is_other or not self.is_of(context.scene):
            return []
        depsgraph = context.evaluated_depsgraph_get()
        look.compare(depsgraph)
        return [] if look.change_in(context.view_layer) else [structure]

    def set_built(self, outcome: Outcome) -> None:
        """Replace everything by a new structure, and draw it."""
        overlay.set_cells(outcome.drawable)
        self.snapshot, self.built = outcome.snapshot, outcome.built
        self.drawable, self.record = outcome.drawable, outcome.record
        self.traced, self.timeline, self.other_view = None, [], ""
        self.launched = None
        self.history = outcome.history
        self.watch()
        overlay.enable()

    def set_traced(
        self, traced: Traced, record: dict[str, Any], drawable: Drawable | None = None
    ) -> None:
        """Keep traced rays and the record that has them; and the cells, if rays have made some."""
        if drawable is not None:
            self.set_cells(drawable)
        self.traced, self.record = traced, record

    def set_cells(self, drawable: Drawable) -> None:
        """Draw the cells of the structure as they are now that rays have made some."""
        overlay.set_cells(drawable)
        self.drawable = drawable

    def clear(self) -> None:
        """Drop all results and stop drawing."""
        if self.built is not None:
            overlay.disable()
        self.snapshot = self.built = self.drawable = self.record = self.traced = None
        self.launched = None
        self.timeline, self.history = [], ()
        self.watch()

    # Asking.

    def is_of(self, scene: bpy.types.Scene) -> bool:
        """Say whether something was built over a scene of Blender's, as it is now or was then."""
        return self.snapshot is not None and self.snapshot.look.owner == scene.session_uid

    @property
    def cells(self) -> Cells | None:
        """The cells of the structure; None before the first build."""
        return None if self.drawable is None else self.drawable.cells

    def status(self, context: bpy.types.Context, at_once: bool = True) -> Status:
        """Say whether the structure is that of the scene and the settings as they are now.

        Parameters
        ----------
        at_once : bool
            Compare now whatever may have changed. A panel must not: it takes too long, and
            Blender allows no evaluation there; it is told that the comparison is under way.
        """
        if self.built is None or self.snapshot is None:
            return Status(False, "Nothing has been built yet")
        look = self.snapshot.look
        if not self.is_of(context.scene):
            return Status(False, "Built over another scene of this file")
        if at_once:
            depsgraph = context.evaluated_depsgraph_get()
            if not look.is_settled_for(depsgraph.view_layer):
                look.compare(depsgraph)
        is_settled = look.is_settled_for(context.view_layer)
        if not is_settled:
            watching.compare_soon()
        change = look.change_in(context.view_layer) if is_settled else ""
        if at_once:
            self.other_view = self._other_view(context)
        reason = change or self.other_view or self._other_settings(context)
        if reason:
            return Status(False, f"Out of date: {reason}")
        if is_settled:
            return Status(True, "Up to date")
        if watching.is_playing():
            return Status(False, "Compared with the scene when the animation stops")
        return Status(False, "Comparing with the scene...")

    def _other_view(self, context: bpy.types.Context) -> str:
        """Return which of the structure's needs beside triangles has changed; "" if none has."""
        from ...core.contract.needs import moved

        assert self.built is not None
        structure = self.built.structure
        if not self.needs_view:
            return ""
        return moved(structure.needs, structure.scene, View.of(context))

    def _other_settings(self, context: bpy.types.Context) -> str:
        """Return in which way the settings are not those that were built with; "" if they are."""
        assert self.built is not None
        assert self.snapshot is not None
        root = context.scene.accelscope
        if root.scope != self.snapshot.look.scope:
            return "the scope was changed"
        taken_so = self.snapshot.look.instances
        # What the timeline is compared for, of two levels, moves as objects do.
        is_compared = self.timeline and (root.instances, taken_so) == (KEEP, OBJECTS)
        is_other = root.instances != taken_so and (taken_so or root.instances == OBJECTS)
        if is_other and not is_compared:
            return TAKEN_SO[taken_so]
        geometry = self.snapshot.scene.geometry
        if isinstance(geometry, Csg) and geometry.cutting != generated.read(
            root, CuttingSettings, "bounds of CSG trees"
        ):
            return "the bounds of CSG trees were changed"
        try:
            structure, settings = choices.structure_and_settings(root)
        except InputError as error:
            return refusal_in_panel(error)
        if structure is not type(self.built.structure):
            return f"{self.built.structure.label} was built"
        return "" if settings == self.built.structure.settings else "the settings were changed"

    @property
    def needs_view(self) -> bool:
        """Whether the structure was built from lights or a camera, which may be moved."""
        from ...core.contract.needs import GEOMETRY

        return self.built is not None and self.built.structure.needs != {GEOMETRY}

    def look_at_view(self, context: bpy.types.Context) -> bool:
        """Compare lights and camera with those that were built from; say whether that is news."""
        before, self.other_view = self.other_view, self._other_view(context)
        return self.other_view != before

    def what_was_built(self) -> tuple[str, list[tuple[str, str]]]:
        """Return the name of the structure, and its settings that are not the defaults, in words.

        Those that change nothing beside the others are left out.
        """
        assert self.built is not None
        settings: Any = self.built.structure.settings
        changed = []
        for each in dataclasses.fields(settings):
            value = getattr(settings, each.name)
            if value != each.default and has_effect(each, settings):
                text = generated.name_of(value) if each.metadata["choices"] else to_words(value)
                changed.append((each.metadata["label"], text))
        return self.built.structure.label, changed

    def headline(self) -> str:
        """Say in one line what the build came to; "" before the first."""
        from ...core.contract.figures import look_up
        from ...core.evaluation.records.report import show_number, show_seconds

        if self.built is None or self.record is None or self.drawable is None:
            return ""
        # What tables compare structures by, first of all: the SAH cost of those that have one.
        values = self.record["statistics"]
        telling = [
            f"{figure.column} {show_number(value)}"
            for figure in self.built.structure.FIGURES
            if figure.column and figure.unit != "count"
            and (value := look_up(values, figure.path)) is not None
        ]  # fmt: skip
        n_cells = f"{show_integer(len(self.drawable.cells))} cells"
        parts = [*telling[:1], n_cells, show_seconds(self.built.seconds)]
        return f"{self.built.structure.label}: {', '.join(parts)}"

    def is_stale(self, context: bpy.types.Context) -> bool:
        """Say whether what was built is known not to be that of the scene any more.

        Cheap: it compares nothing, and is asked at every redraw.
        """
        if self.built is None or self.snapshot is None:
            return False
        look = self.snapshot.look
        if not self.is_of(context.scene):
            return True
        is_settled = look.is_settled_for(context.view_layer)
        return bool(
            (is_settled and look.change_in(context.view_layer))
            or self.other_view
            or self._other_settings(context)
        )

    def lesson_change(self, context: bpy.types.Context) -> str:
        """Return what has changed of the meshes that the lesson is about, as far as is known."""
        look = self.lesson_look
        if look is None or look.owner != context.scene.session_uid:
            return ""
        if not look.is_settled_for(context.view_layer):
            watching.compare_soon()
            return ""
        return look.change_in(context.view_layer)

    def notes(self) -> tuple[str, ...]:
        """Return what the file has and the scene that was built over has not, in sentences."""
        return self.snapshot.scene.notes if self.snapshot else ()


def to_words(value: Any) -> str:
    """Return the value of a setting as the panel shows it."""
    if isinstance(value, bool):
        return "On" if value else "Off"
    return " x ".join(map(str, value)) if isinstance(value, tuple) else str(value)


current = Session()


@persistent
def _before_load(*_: Any) -> None:
    jobs.abandon()


@persistent
def _after_load(*_: Any) -> None:
    current.clear()
    jobs.forget_refusal()


@persistent
def _after_update(scene: bpy.types.Scene, *_: Any) -> None:
    """Compare lights and camera soon: when they are moved, what was built from them is stale."""
    if not bpy.app.background and current.is_of(scene.original) and current.needs_view:
        look_soon()


@persistent
def _after_undo(*_: Any) -> None:
    if not bpy.app.background and current.needs_view:
        look_soon()


def look_soon() -> None:
    """Compare lights and camera once Blender has time; several updates are looked at once."""
    if not bpy.app.timers.is_registered(_look):
        bpy.app.timers.register(_look, first_interval=watching.DELAY)


def _look() -> float | None:
    """Compare lights and camera with those built from, in a window that shows their scene."""
    if jobs.running() or watching.is_playing():
        return watching.DELAY
    for window in bpy.context.window_manager.windows:
        if current.is_of(window.scene):
            with watching.in_window(window):
                if current.look_at_view(bpy.context):
                    overlay.tag_redraw()
            break
    return None


HANDLERS = (
    ("load_pre", _before_load),
    ("load_post", _after_load),
    ("depsgraph_update_post", _after_update),
    ("frame_change_post", _after_update),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)


def register() -> None:
    """Start listening to Blender, which may load another file."""
    handlers.listen(HANDLERS)
    overlay.fade_if(lambda context: current.is_stale(context))


def unregister() -> None:
    """Stop listening and drop all results."""
    if bpy.app.timers.is_registered(_look):
        bpy.app.timers.unregister(_look)
    handlers.stop_listening(HANDLERS)
    current.clear()
