"""The lesson that stands in the viewport: what it is about, its play, and the picture shown.

Whatever takes long is a job (:mod:`...operators.teach`, :mod:`...operators.play_lesson`); a picture
of what has been played is made at once, in Blender's thread. Until a job has come to its good end,
everything stays as it was.
"""

from __future__ import annotations

import contextlib
import dataclasses
import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import numpy as np
from bpy.app.handlers import persistent

from ...core.printing import print_lines
from .. import handlers, jobs
from ..drawing import arrangement, overlay, picture_overlay
from ..drawing.viewport import largest, look_at
from ..from_blender import watching
from ..settings import generated
from ..to_blender import lesson_scene
from . import session

if TYPE_CHECKING:  # importing them for real would import the structures, and Numba with them
    from ...core.geometry.rays import Rays
    from ...core.lessons.lesson import Lesson, Play, Subject
    from ...core.lessons.picture import Picture
    from ...core.scene import Camera

TEACH, PLAY = "ACCELSCOPE_OT_teach", "ACCELSCOPE_OT_play_lesson"
"""Operators whose jobs are for a lesson."""

RETRY = 0.1
"""Seconds between two looks whether a job can be started."""


class Ready(NamedTuple):
    """A lesson that was played, before any of it is shown.

    Attributes
    ----------
    lesson : Lesson
    subject : Subject
    play : Play
    settings : object
        The knobs that it was played with.
    """

    lesson: Lesson
    subject: Subject
    play: Play
    settings: Any


@dataclass
class LessonView:
    """The lesson in the viewport; all None before the first.

    Attributes
    ----------
    lesson : Lesson
    subject : Subject
    play : Play
    played_with : object
        The knobs of that play.
    settings : object
        The knobs of the picture.
    picture : Picture
    owner : int
        Session id of the Blender scene over which it is drawn.
    sample : str
        Which sample of a lesson that scene has; empty if it has none.
    is_own : bool
        Whether it is about the user's own mesh.
    fault : str
        Why there is no picture of the knobs as they are; empty if there is.
    """

    lesson: Lesson | None = None
    subject: Subject | None = None
    play: Play | None = None
    played_with: Any = None
    settings: Any = None
    picture: Picture | None = None
    owner: int = 0
    sample: str = ""
    is_own: bool = False
    fault: str = ""

    # Showing.

    def begin(self, ready: Ready, owner: bpy.types.Scene, is_own: bool) -> None:
        """Show a lesson, over a scene of Blender's."""
        self.lesson, self.subject, self.is_own = ready.lesson, ready.subject, is_own
        self.owner, self.sample = owner.session_uid, lesson_scene.sample_in(owner)
        self.hide_cells(owner)
        self.keep_play(ready)

    def keep_play(self, ready: Ready) -> None:
        """Show what was played anew."""
        self.play, self.played_with, self.settings = ready.play, ready.settings, None

    def follow(self, owner: bpy.types.Scene) -> None:
        """Show the picture of the knobs as they are now in a scene, or have it played first."""
        if self.lesson is None or self.play is None or owner.session_uid != self.owner:
            return
        try:
            settings = settings_of(owner, self.lesson)
            if self.played_with is None or (
                self.lesson.key(settings) != self.lesson.key(self.played_with)
            ):
                ask("play_lesson", owner)
                return
            self.draw(self.play.within(settings))
        except Exception as error:  # told in the panel, and on the console if it is a defect
            self.fault = f"Not shown: {jobs.why(error)}"
        overlay.tag_redraw()

    def draw(self, settings: Any) -> None:
        """Draw the picture of some knobs."""
        assert self.lesson is not None
        assert self.play is not None
        if settings != self.settings:
            self.picture = self.play.picture(settings)
            self.settings = settings
        assert self.picture is not None
        picture_overlay.show(self.picture, self.owner, self.lesson.label)
        self.fault = ""

    # Choosing a ray.

    def has_pixels(self) -> bool:
        """Say whether the picture has an image in which a pixel can be chosen."""
        return self.picture is not None and bool(self.picture.images) and self.ray() is not None

    def ray(self) -> Rays | None:
        """Return the ray that the knobs choose, a batch of one; None if they choose none."""
        if self.play is None or self.settings is None:
            return None
        return self.play.ray_shown(self.settings)

    def choose_pixel(self, owner: bpy.types.Scene, across: float, down: float) -> None:
        """Choose the pixel at some share of the image's width and height, from the upper left."""
        assert self.lesson is not None
        assert self.picture is not None
        values = self.picture.images[0].values
        height, width = self.picture.images[0].pixels.shape[:2]
        rows, columns = (height, width) if values is None else values.shape
        group = group_of(owner, self.lesson)
        group.column = min(int(across * width), columns - 1)
        group.row = min(int(down * height), rows - 1)

    def choose_ray(self, owner: bpy.types.Scene, origin: np.ndarray, direction: np.ndarray) -> None:
        """Have the lesson played with another ray; `direction` reaches to t = 1."""
        from ...core.geometry.rays import Rays

        assert self.lesson is not None
        assert self.subject is not None
        rays = Rays.from_arrays(origin[None], direction[None])
        self.subject = dataclasses.replace(self.subject, rays=rays, ray=0)
        self.played_with = None
        group = group_of(owner, self.lesson)
        if hasattr(group, "ray"):
            group.ray = 0
        self.follow(owner)

    def play_again(self, owner: bpy.types.Scene) -> None:
        """Have the lesson played anew, whatever its knobs say."""
        self.played_with = None
        self.follow(owner)

    def choose_camera(self, owner: bpy.types.Scene, camera: Camera) -> None:
        """Have the lesson played with the rays of another camera."""
        assert self.subject is not None
        seen = dataclasses.replace(self.subject.scene, camera=camera)
        self.subject = dataclasses.replace(self.subject, scene=seen)
        self.play_again(owner)

    def hide_cells(self, owner: bpy.types.Scene) -> None:
        """Leave out the cells of what was built, or draw them with the lesson, as asked for."""
        overlay.hide_cells_in(self.owner if owner.accelscope.teaching.hide_cells else 0)

    def is_in(self, scene: bpy.types.Scene) -> bool:
        """Say whether a lesson is shown in a scene."""
        return self.lesson is not None and self.owner == scene.session_uid

    def lines_in(self, scene: bpy.types.Scene) -> tuple[str, np.ndarray, np.ndarray] | None:
        """Return name, segments and colours of what is drawn over the user's own mesh; or None."""
        picture = self.picture
        if self.lesson is None or picture is None or not self.is_own or not self.is_in(scene):
            return None
        return self.lesson.label, picture.segments, picture.colours

    def points(self) -> np.ndarray:
        """Return what the view has to have in it, (n, 3): the scene, and all that is drawn."""
        from ...core.geometry.box_shape import corners_of

        assert self.subject is not None
        scene = self.subject.scene
        corners = corners_of(np.concatenate([scene.lower, scene.upper])[None])[0]
        return corners if self.picture is None else np.concatenate([corners, self.picture.points()])

    def frame(self, context: bpy.types.Context, area: bpy.types.Area) -> None:
        """Move a viewport so that it shows the scene and all that is drawn."""
        owner = owner_scene() or context.scene  # an operator may just have come to it
        is_large = owner.accelscope.teaching.large_text
        look_at(area, self.points(), picture_overlay.rooms_for_lines(context, area, is_large))

    def frame_again(self, owner: bpy.types.Scene) -> None:
        """Do so in the windows of its scene: words take another part of the viewport now."""
        for window in bpy.context.window_manager.windows:
            area = largest(window)
            if self.is_in(owner) and window.scene == owner and area is not None:
                self.frame(bpy.context, area)
        overlay.tag_redraw()

    def clear(self) -> None:
        """Show nothing any more; viewports are left as they are."""
        self.lesson = self.subject = self.play = self.picture = None
        self.played_with = self.settings = None
        self.owner, self.sample, self.is_own, self.fault = 0, "", False, ""
        picture_overlay.hide()
        overlay.hide_cells_in(0)


current = LessonView()


def is_taught(operator: type[bpy.types.Operator], context: bpy.types.Context) -> bool:
    """Say whether a lesson is shown here, and tell the greyed button of `operator` if none is."""
    is_shown = current.is_in(context.scene)
    if not is_shown:
        operator.poll_message_set("Teach a lesson first")
    return is_shown


def can_end_in(scene: bpy.types.Scene) -> bool:
    """Say whether a scene has a lesson to be ended: the one that is shown, or what it has left."""
    is_lost = current.lesson is not None and owner_scene() is None
    return current.is_in(scene) or lesson_scene.is_ours(scene) or is_lost


def forget() -> None:
    """Show no lesson any more, and watch no mesh because of it."""
    current.clear()
    session.current.lesson_look = None
    session.current.watch()


def rearrange() -> None:
    """Arrange viewports as they were before lessons, but those that are in one still."""
    windows = bpy.context.window_manager.windows
    taught = [window.screen for window in windows if can_end_in(window.scene)]
    for screen in bpy.data.screens:
        if screen not in taught:
            arrangement.rearrange(screen)


# -------------------------------------------------------------------------------------- settings


def group_of(scene: bpy.types.Scene, lesson: Lesson) -> Any:
    """Return the property group of a lesson's knobs."""
    return getattr(scene.accelscope.lessons, lesson.name)


def settings_of(scene: bpy.types.Scene, lesson: Lesson) -> Any:
    """Return the knobs of a lesson.

    Raises
    ------
    InputError
        For a value outside its limits.
    """
    return generated.read(group_of(scene, lesson), lesson.Settings, lesson.label)


def chosen(scene: bpy.types.Scene) -> Lesson:
    """Return the lesson that the list names."""
    from ...core.lessons import lesson_named

    return lesson_named(scene.accelscope.teaching.lesson)


def end_of(lesson: str, knob: str) -> int | None:
    """Return the last value of a knob that ends where its content ends; None if none is played."""
    if current.lesson is None or current.lesson.name != lesson or current.play is None:
        return None
    return current.play.ends.get(knob)


def copy_settings(lesson: Lesson, source: bpy.types.Scene, target: bpy.types.Scene) -> None:
    """Give a scene the knobs of another, and what else is set about teaching."""
    if source == target:
        return
    old, new = group_of(source, lesson), group_of(target, lesson)
    for each in dataclasses.fields(lesson.Settings):
        setattr(new, each.name, getattr(old, each.name))
    old, new = source.accelscope.teaching, target.accelscope.teaching
    for name in ("lesson", "large_text", "hide_cells"):
        setattr(new, name, getattr(old, name))


# -------------------------------------------------------------------------- asking for a job

_asked: tuple[str, int, dict[str, Any]] | None = None


def ask(operator: str, scene: bpy.types.Scene, **arguments: Any) -> None:
    """Start an operator with a job in a window of a scene, once Blender is done with its panels.

    A list that is open, and a field that is dragged, have handlers of their own. A job adds one,
    and Blender has crashed when that came about while it was in theirs. A job for a lesson that is
    still running is for what was asked before, and is cancelled; for any other this one waits.
    """
    global _asked
    _asked = operator, scene.session_uid, arguments
    if bpy.app.background:
        _serve()
    elif not bpy.app.timers.is_registered(_serve):
        bpy.app.timers.register(_serve)


def _serve() -> float | None:
    global _asked
    if _asked is None:
        return None
    job = jobs.running()
    if job is not None:
        if job.by in (TEACH, PLAY):
            job.cancel()
        return RETRY
    (name, owner, arguments), _asked = _asked, None
    windows = [each for each in bpy.context.window_manager.windows if _shows(each, owner)]
    window = next(iter(windows), None)
    if window is None:
        return None  # nobody sees that scene any more
    operator = getattr(bpy.ops.accelscope, name)
    with watching.in_window(window) if not bpy.app.background else contextlib.nullcontext():
        if not operator.poll():
            return None
        try:
            operator("INVOKE_DEFAULT", True, **arguments)
        except RuntimeError as error:
            # What the operator has reported is said in the panel already.
            print_lines(f"AccelScope: {' '.join(str(error).split())}", sys.stderr)
    return None


def _shows(window: bpy.types.Window, owner: int) -> bool:
    return window.scene.session_uid == owner


# -------------------------------------------------------------------------------------- handlers


def owner_scene() -> bpy.types.Scene | None:
    """Return the scene over which the lesson is drawn; None if there is none any more."""
    return scene_of(current.owner)


def scene_of(uid: int) -> bpy.types.Scene | None:
    """Return the scene with a session id; None if there is none any more."""
    return next((each for each in bpy.data.scenes if each.session_uid == uid), None)


@persistent
def _before_load(*_: Any) -> None:
    """Arrange all viewports as they were: whoever loads without the UI goes on with these."""
    for screen in bpy.data.screens:
        arrangement.rearrange(screen)


@persistent
def _after_load(*_: Any) -> None:
    forget()
    # A file may have been saved during a lesson on the user's own mesh, which is not to be ended.
    rearrange()


@persistent
def _after_undo(*_: Any) -> None:
    """Show what the properties say that Blender has brought back."""
    if current.lesson is None:
        return
    scene = owner_scene()
    if scene is None or not _is_still_about(scene):
        forget()
        rearrange()
    else:
        current.follow(scene)


def _is_still_about(scene: bpy.types.Scene) -> bool:
    """Say whether a scene still names the lesson that is shown, and has its sample."""
    return lesson_scene.sample_in(scene) == current.sample and chosen(scene) == current.lesson


HANDLERS = (
    ("load_pre", _before_load),
    ("load_post", _after_load),
    ("undo_post", _after_undo),
    ("redo_post", _after_undo),
)


def register() -> None:
    """Start listening to Blender."""
    handlers.listen(HANDLERS)


def unregister() -> None:
    """Stop listening, and show nothing."""
    global _asked
    _asked = None
    if bpy.app.timers.is_registered(_serve):
        bpy.app.timers.unregister(_serve)
    handlers.stop_listening(HANDLERS)
    forget()
