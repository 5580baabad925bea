"""Session: what has been built and traced, kept outside of Blender's data.

Results are Python objects that no .blend can hold and no undo step should copy. They survive undo
and are dropped when another file is loaded. Handlers only find out whether they still belong to
what Blender shows; nothing is rebuilt by itself.
"""

from __future__ import annotations

import copy
import dataclasses
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ..core.errors import InputError
from . import extraction, generated, jobs, overlay, properties
from .showcase import Showcase
from .snapshot import Snapshot
from .split_plane import SplitPlaneSettings, SplitView

if TYPE_CHECKING:  # importing them for real would import Numba, and make Blender start slower
    from ..core.evaluation.experiment import Built, Traced
    from ..core.evaluation.ray_path import Walk
    from ..core.structures.cells import Cells
    from ..core.structures.steps import Steps


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
    cells : Cells
        What the overlay draws.
    record : dict
        The figures, those of the traced rays included.
    traced : Traced
    steps : Steps
        The recorded walk of ray number `step_index`.
    legend : list of (str, str)
        What is drawn of that walk: names of colours, and texts.
    linked_leaf : int
        Number of the leaf whose links are drawn, -1 for none.
    links : tuple of (segments, colours)
        The picture of those links.
    showcase : Showcase
        Exhibits of the structure; empty before the first build.
    timeline : list of dict
        The records of the last comparison over the timeline.
    split_view : SplitView
        The plane that divides the scene.
    watched : list of Snapshot
        Those that handlers keep an eye on: the one above, and one that is being built over.
    undone : bool
        An undo has happened that nobody has looked at yet.
    """

    snapshot: Snapshot | None = None
    built: Built | None = None
    cells: Cells | None = None
    record: dict[str, Any] | None = None
    traced: Traced | None = None
    steps: Steps | None = None
    step_index: int = -1
    legend: list[tuple[str, str]] = field(default_factory=list)
    linked_leaf: int = -1
    links: tuple[np.ndarray, np.ndarray] | None = None
    showcase: Showcase = field(default_factory=Showcase)
    timeline: list[dict[str, Any]] = field(default_factory=list)
    split_view: SplitView | None = None
    watched: list[Snapshot] = field(default_factory=list)
    undone: bool = False

    # Storing results.

    def watch(self, snapshot: Snapshot) -> None:
        """Keep an eye on a snapshot while something is built over it."""
        self.watched = [known for known in (self.snapshot, snapshot) if known]

    def watch_built(self) -> None:
        """Keep an eye on what was built only: whatever was under way has come to nothing."""
        self.watched = [self.snapshot] if self.snapshot else []

    def set_built(
        self, snapshot: Snapshot, built: Built, cells: Cells, record: dict[str, Any]
    ) -> None:
        """Replace everything by a new structure, and draw it."""
        self.snapshot, self.built, self.cells, self.record = snapshot, built, cells, record
        self.traced, self.timeline = None, []
        self.showcase = Showcase(built.structure.exhibits())
        self.split_view = SplitView(built.structure.scene)
        self.watch_built()
        self._clear_paths()
        overlay.set_cells(cells)
        overlay.enable()

    def set_traced(self, traced: Traced, record: dict[str, Any]) -> None:
        """Keep traced rays and the record that has them."""
        self.traced, self.record = traced, record
        self._clear_paths()

    def set_steps(self, index: int, steps: Steps) -> None:
        """Keep the walk of one traced ray."""
        self.step_index, self.steps = index, steps

    def set_linked_leaf(self, number: int) -> None:
        """Choose the leaf whose links are drawn; -1 for none."""
        from ..core.evaluation.ray_path import links_of

        assert self.built is not None
        assert self.cells is not None
        self.linked_leaf = number
        # Kept, since finding them goes through the whole tree.
        self.links = links_of(self.built.structure, self.cells, number) if number >= 0 else None

    def draw_paths(self, event: int | None = None) -> None:
        """Draw the recorded ray, up to an event if one is given, and the links of the leaf."""
        from ..core.evaluation.ray_path import legend, segments_of

        paths = [] if self.links is None else [self.links]
        if self.steps is not None:
            walk = self._walk()
            paths.append(segments_of(walk, event))
            self.legend = legend(walk, event)
        if paths:
            overlay.set_lines(overlay.RAY, *(np.concatenate(parts) for parts in zip(*paths)))
        else:
            overlay.set_lines(overlay.RAY, None)

    def show_exhibit(self, context: bpy.types.Context) -> None:
        """Draw the frame that the panel asks for; one that has still to be made starts a job."""
        drawn = self.showcase.draw(context.scene.accelscope.exhibits)
        # The job that is under way may be another one: the panel has a button to try again.
        if not drawn and jobs.running() is None:
            bpy.ops.accelscope.show_frame("INVOKE_DEFAULT")

    def show_plane(self, context: bpy.types.Context) -> None:
        """Draw the plane that the panel asks for, or none."""
        if self.split_view is not None:
            group = context.scene.accelscope.split_plane
            settings = generated.read(group, SplitPlaneSettings, "split plane")
            self.split_view.draw(settings if group.show else None)

    def _walk(self) -> Walk:
        from ..core.evaluation.ray_path import Walk

        assert self.built is not None
        assert self.cells is not None
        assert self.traced is not None
        assert self.steps is not None
        return Walk(
            self.built.structure, self.cells, self.traced.rays, self.step_index,
            float(self.traced.hits.t[self.step_index]), self.steps,
        )  # fmt: skip

    def _clear_paths(self) -> None:
        self._forget_paths()
        overlay.set_lines(overlay.RAY, None)

    def _forget_paths(self) -> None:
        self.step_index, self.steps, self.legend = -1, None, []
        self.linked_leaf, self.links = -1, None

    def clear(self) -> None:
        """Drop all results and stop drawing."""
        if self.built is not None:
            overlay.disable()
        self.snapshot = self.built = self.cells = self.record = self.traced = None
        self.showcase, self.split_view = Showcase(), None
        self.timeline, self.watched, self.undone = [], [], False
        self._forget_paths()

    # Asking.

    def status(self, context: bpy.types.Context) -> Status:
        """Say whether the structure is that of the scene and the settings as they are now."""
        if self.built is None or self.snapshot is None:
            return Status(False, "Nothing has been built yet")
        if self.snapshot.owner != context.scene.session_uid:
            return Status(False, "Built over another scene of this file")
        if self.snapshot.change:
            return Status(False, f"Out of date: {self.snapshot.change}")
        root = context.scene.accelscope
        if root.scope != self.snapshot.scope:
            return Status(False, "Out of date: the scope was changed")
        try:
            structure, settings = properties.structure_and_settings(root)
        except InputError as error:
            return Status(False, f"Out of date: {error}")
        if structure is not type(self.built.structure):
            return Status(False, f"Out of date: {self.built.structure.label} was built")
        if settings != self.built.structure.settings:
            return Status(False, "Out of date: the settings were changed")
        return Status(True, "Up to date")

    def has_links(self) -> bool:
        """Say whether the structure links leaves to their neighbours."""
        return self.built is not None and self.built.structure.has_links

    def event_text(self, event: int) -> str:
        """Say what happens in an event of the recorded ray."""
        from ..core.evaluation.ray_path import event_text

        assert self.steps is not None
        return event_text(self.steps, event)

    def hit_text(self) -> str:
        """Say what the recorded ray hits: ``"hits triangle 7 of Cube at t = 2.5"``."""
        assert self.built is not None
        assert self.traced is not None
        scene, hits = self.built.structure.scene, self.traced.hits
        primitive = int(hits.primitive[self.step_index])
        if primitive < 0:
            return "hits nothing"
        name = scene.object_names[scene.object_ids[primitive]]
        return f"hits triangle {primitive} of {name} at t = {hits.t[self.step_index]:.6g}"

    def built_with_view_of(self, context: bpy.types.Context) -> Built:
        """Return the structure with the camera and lights as they are now.

        Rays start from them; moving them does not make the structure out of date.
        """
        assert self.built is not None
        structure = copy.copy(self.built.structure)
        structure.scene = dataclasses.replace(
            structure.scene,
            camera=extraction.camera_of(context),
            lights=extraction.lights_of(context),
        )
        return dataclasses.replace(self.built, structure=structure)


current = Session()


# -------------------------------------------------------------------------------------- handlers


@persistent
def _after_update(scene: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
    """Mark results out of date; after an undo, look whether they are."""
    if depsgraph.mode != "VIEWPORT" or not current.watched:
        return
    watched = [each for each in current.watched if each.owner == scene.original.session_uid]
    for snapshot in watched:
        if current.undone:
            snapshot.compare(depsgraph)
        else:
            snapshot.note_updates(depsgraph)
    if watched:
        current.undone = False


@persistent
def _after_undo(*_: Any) -> None:
    # Blender has not evaluated the scene yet: the next update looks at it.
    current.undone = True


@persistent
def _before_load(*_: Any) -> None:
    jobs.abandon()


@persistent
def _after_load(*_: Any) -> None:
    current.clear()


HANDLERS = (
    ("depsgraph_update_post", _after_update),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
    ("load_pre", _before_load),
    ("load_post", _after_load),
)


def register() -> None:
    """Start listening to Blender."""
    for event, handler in HANDLERS:
        getattr(bpy.app.handlers, event).append(handler)


def unregister() -> None:
    """Stop listening and drop all results."""
    for event, handler in HANDLERS:
        handlers = getattr(bpy.app.handlers, event)
        if handler in handlers:
            handlers.remove(handler)
    current.clear()
