"""The timeline of a Blender scene: its frames, one after the other, as scenes of ours."""

from __future__ import annotations

import contextlib
import queue
import threading
from collections.abc import Callable, Generator, Iterable, Iterator

import bpy

from ...core.errors import InputError
from ...core.progress import Progress
from ...core.scene import Scene
from ...core.scene.placing import FLATTEN
from ..standard_streams import others_kept_silent
from ..stopping import held
from .snapshot import Look, Taken

PATIENCE = 0.1  # seconds between two looks at whether the work was cancelled


def frame_range(scene: bpy.types.Scene) -> range:
    """Return the frames that a playback of the scene shows."""
    return range(scene.frame_start, scene.frame_end + 1, scene.frame_step)


def taken_at(
    context: bpy.types.Context, scope: str, number: int, instances: str = FLATTEN
) -> Taken:
    """Show a frame and take its scene, its instances flattened by default: meshes may change.

    Raises
    ------
    InputError
        When there is no such frame, no mesh with faces, or one is invalid.
    """
    try:
        context.scene.frame_set(number)
        is_shown = context.scene.frame_current == number
    except ValueError:  # more than 32 bits
        is_shown = False
    if not is_shown:
        raise InputError(f"there is no frame {number} on Blender's timeline")
    return Taken.at(context, scope, instances)


def scene_at(
    context: bpy.types.Context, scope: str, number: int, instances: str = FLATTEN
) -> Scene:
    """Show a frame and return its scene, for the command line.

    Raises
    ------
    InputError
        When there is no triangle that a ray could hit, or a mesh is invalid.
    """
    with held(), others_kept_silent():
        taken = taken_at(context, scope, number, instances)
    return taken.snapshot().scene


class Place:
    """Where a scene stands on its timeline."""

    def __init__(self, scene: bpy.types.Scene) -> None:
        self.scene = scene
        self.frame, self.subframe = scene.frame_current, scene.frame_subframe

    def restore(self) -> None:
        """Go back there, unless another file has been loaded meanwhile."""
        with contextlib.suppress(ReferenceError):
            self.scene.frame_set(self.frame, subframe=self.subframe)


class Frames:
    """Frames for work in a background thread, which must not touch Blender.

    The thread waits for the next one in :meth:`iterate`; the main thread takes it from Blender in
    :meth:`serve`. Work that runs in the main thread itself gets its frames at once.

    Meanwhile the user may edit. Frames from before and after an edit must not be compared with each
    other, so whenever Blender has evaluated something, those taken so far are looked at again.

    Parameters
    ----------
    numbers : iterable of int
    watch : callable
        Is given how the frame looks that was taken last, to mark what Blender evaluates.
    instances : {"objects", "flatten"}
    """

    def __init__(
        self,
        context: bpy.types.Context,
        scope: str,
        numbers: Iterable[int],
        watch: Callable[[Look], None] = lambda look: None,
        instances: str = FLATTEN,
    ) -> None:
        self.shown = Place(context.scene)
        self._frames = self._take(context, scope, numbers, watch, instances)
        # One frame in hand, so that memory does not grow with the length of the animation.
        self._ready: queue.Queue[tuple[int, Taken] | InputError | None] = queue.Queue(maxsize=1)

    def _take(
        self,
        context: bpy.types.Context,
        scope: str,
        numbers: Iterable[int],
        watch: Callable[[Look], None],
        instances: str,
    ) -> Generator[tuple[int, Taken] | None]:
        """Yield number and scene of every frame, then None for each that is looked at again."""
        looks: dict[int, Look] = {}
        is_touched = False
        for number in numbers:
            taken = taken_at(context, scope, number, instances)
            looks[number] = taken.look
            watch(taken.look)
            yield number, taken
            # What was edited and is not evaluated yet: in the next frame it could not be told from
            # what the animation does.
            context.evaluated_depsgraph_get()
            if not looks[number].is_settled:
                is_touched = True
                refuse_edited(context, number, looks[number])
        for number, look in looks.items() if is_touched else ():
            look.note_everything()
            refuse_edited(context, number, look)
            yield None

    def serve(self) -> None:
        """Take one frame from Blender, if there is room for it; call it in the main thread."""
        if self._ready.full():
            return
        try:
            frame = next(self._frames)
        except StopIteration:
            self._ready.put(None)
        except InputError as error:
            self._ready.put(error)
        else:
            if frame is not None:
                self._ready.put(frame)

    def iterate(self, progress: Progress) -> Iterator[tuple[int, Scene]]:
        """Yield number and scene of every frame.

        Raises
        ------
        InputError
            When a frame has no triangle that a ray could hit, or the scene was edited meanwhile.
        Cancelled
            From `progress`.
        """
        is_served = threading.current_thread() is threading.main_thread()
        while True:
            if is_served:
                self.serve()
            progress.report(0, 1, "Waiting for a frame")
            try:
                found = self._ready.get(timeout=0.0 if is_served else PATIENCE)
            except queue.Empty:
                continue
            if found is None:
                return
            if isinstance(found, InputError):
                raise found
            number, taken = found
            yield number, taken.snapshot(progress).scene

    def restore(self) -> None:
        """Show the frame again that was shown before; in the main thread."""
        self._frames.close()
        self.shown.restore()


def refuse_edited(context: bpy.types.Context, number: int, look: Look) -> None:
    """Raise InputError if a frame does not look as it did."""
    if context.scene.frame_current != number:
        context.scene.frame_set(number)
    depsgraph = context.evaluated_depsgraph_get()
    look.compare(depsgraph)
    if change := look.change_in(depsgraph.view_layer):
        raise InputError(
            f"{change} in frame {number} while frames were compared; start it again", change
        )
