"""Jobs: long work in a background thread, under a modal operator that stays responsive.

The thread runs ``core`` only and never touches ``bpy``; kernels release Python's lock, so Blender
goes on drawing. One job at a time. In background mode, and when a script calls the operator, the
same work runs in the caller's thread.

Whatever goes wrong, in the thread or in Blender's, the job ends: its timer is removed, one line
says what has happened, and the buttons work again. An exception that is not meant for the user
(every other than InputError) leaves its traceback on standard error as well.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import bpy

from ..core.errors import InputError
from ..core.printing import print_traceback, printable
from ..core.progress import SILENT, Cancelled, Progress
from .results.wording import in_panel, refusal_in_panel

Work = Callable[[Progress], Any]

REFUSALS = (InputError, MemoryError)
"""What is no defect of ours."""

TICK = 0.1  # seconds between two looks at the thread

ERRANDS = 0.01  # seconds that Blender may be held up by errands that are short

PATIENCE = 5.0  # seconds to wait for a cancelled thread when Blender ends; a compiler takes longer


class Job(Progress):
    """Work in a thread of its own; also the progress that the work reports to.

    Attributes
    ----------
    text : str
        What is being done.
    factor : float
        How far that is, 0 to 1.
    result : object
        What the work returned, once it is finished.
    error : Exception or None
        What it raised instead.
    draft : object
        What can be shown until then; None if there is nothing new.
    by : str
        Name of the class of the operator that started it.
    """

    def __init__(self, work: Work, text: str, by: str = "") -> None:
        self.text = text
        self.by = by
        self.factor = 0.0
        self.result: Any = None
        self.error: BaseException | None = None
        self.draft: Any = None
        self.started = time.monotonic()
        self._stop = threading.Event()
        # A daemon, so that a compilation under way does not keep Blender from ending.
        self._thread = threading.Thread(target=self._run, args=(work,), daemon=True)
        self._thread.start()

    def _run(self, work: Work) -> None:
        try:
            self.result = work(self)
        except BaseException as error:  # whatever it is, the main thread has to tell
            self.error = error

    def announce(self, text: str) -> None:
        """Show that work has begun which cannot say how far it is."""
        self.text = in_panel(text[:1].upper() + text[1:])

    def report(self, done: float, total: float, text: str) -> None:
        """Note how far the work is; stop it here if it is cancelled."""
        self.text = in_panel(text)
        self.factor = min(max(done / total, 0.0), 1.0) if total > 0 else 0.0
        if self._stop.is_set():
            raise Cancelled

    def offer(self, draft: Any) -> None:
        """Keep what can be shown meanwhile, in place of one that nobody has taken."""
        self.draft = draft

    def take_draft(self) -> Any:
        """Return what can be shown meanwhile, but once; None if there is nothing new."""
        draft, self.draft = self.draft, None
        return draft

    def cancel(self) -> None:
        """Ask the work to stop; what it still returns is nobody's."""
        self._stop.set()

    @property
    def is_cancelled(self) -> bool:
        """Whether :meth:`cancel` was called."""
        return self._stop.is_set()

    @property
    def is_finished(self) -> bool:
        """Whether the thread has ended."""
        return not self._thread.is_alive()

    def wait(self, seconds: float) -> None:
        """Wait for the thread to end."""
        self._thread.join(seconds)


class Errands:
    """What work in a thread has Blender's thread do in between, a few errands per tick.

    Work that runs in Blender's thread itself does its errands at once.
    """

    def __init__(self) -> None:
        self._waiting: queue.Queue[Callable[[], Any]] = queue.Queue(maxsize=1)
        self._done: queue.Queue[tuple[Any, Exception | None]] = queue.Queue(maxsize=1)

    def run(self, errand: Callable[[], Any], progress: Progress, *how_far: Any) -> Any:
        """Have an errand done, and return what it returns or raise what it raises.

        Parameters
        ----------
        *how_far
            What is reported to `progress` meanwhile.

        Raises
        ------
        Cancelled
            From `progress`.
        """
        progress.report(*how_far)
        if threading.current_thread() is threading.main_thread():
            return errand()
        self._waiting.put(errand)
        while True:
            try:
                result, error = self._done.get(timeout=TICK)
            except queue.Empty:
                progress.report(*how_far)
                continue
            if error is not None:
                raise error
            return result

    def serve(self) -> None:
        """Do the errand that is waiting, if there is one; call it in the main thread.

        As long as errands are short, those that come next are done as well.
        """
        end, wait = time.monotonic() + ERRANDS, 0.0
        while True:
            try:
                errand = self._waiting.get(timeout=wait) if wait else self._waiting.get_nowait()
            except queue.Empty:
                return
            try:
                self._done.put((errand(), None))
            except Exception as error:  # whoever waits for it gets it
                self._done.put((None, error))
            if time.monotonic() > end:
                return
            wait = 0.5 * ERRANDS


_current: Job | None = None
_refusal = ""
_refused = ""
"""Name of the operator that was refused."""

_abandoned: list[Job] = []


def running() -> Job | None:
    """Return the job under way."""
    return _current


def refusal(*by: str) -> str:
    """Return why the last job came to nothing, in one line; nothing if it did not.

    Parameters
    ----------
    *by : str
        Names of operators' classes: nothing, either, if none of them was refused.
    """
    return _refusal if not by or _refused in by else ""


def forget_refusal() -> None:
    """Forget why the last job came to nothing: something else is done now."""
    global _refusal
    _refusal = ""


def keep_waiting(operator: type[bpy.types.Operator]) -> bool:
    """Say whether a job is under way, and tell the greyed button of `operator` why it is grey."""
    if _current:
        operator.poll_message_set("Wait, or press Esc to stop what is running")
    return _current is not None


def cancel() -> None:
    """Cancel the job under way; its operator ends at its next tick."""
    if _current:
        _current.cancel()


def abandon() -> None:
    """Cancel the job under way and forget it: Blender may drop its operator."""
    if _current:
        _leave(_current)


def stop() -> None:
    """Cancel the job under way and wait for all threads: Blender ends."""
    abandon()
    for job in _abandoned:
        job.wait(PATIENCE)
    _abandoned.clear()


def _leave(job: Job) -> None:
    """Forget a job; if its thread still runs, it ends by itself."""
    global _current
    job.cancel()
    _abandoned[:] = [each for each in _abandoned if not each.is_finished]
    if not job.is_finished:
        _abandoned.append(job)
    if _current is job:
        _current = None


def redraw_sidebars() -> None:
    """Have the progress drawn again; not the scene, which takes long when it is large."""
    for window in bpy.context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()


def why(error: BaseException) -> str:
    """Return why something was not done; print the traceback of what should not have happened."""
    if isinstance(error, REFUSALS):
        return refusal_in_panel(error)
    print_traceback(error)
    what = printable(" ".join(f"{type(error).__name__}: {error}".split()))
    return f"a defect of AccelScope ({what}); the console has more"


class JobOperator:
    """What operators with long work have in common; mix it in before ``bpy.types.Operator``.

    A button shows the work in the panel and can be stopped by Esc. A call from a script
    (``EXEC_DEFAULT``, what ``bpy.ops`` does by default) returns when the work is done.
    """

    job_text = "Working"

    refused_text = "Not done"
    """What the panel says in front of the reason why it was refused."""

    head_start = 0.0
    """Seconds that Blender waits first, for work that mostly ends at once."""

    if TYPE_CHECKING:  # of bpy.types.Operator

        def report(self, kind: set[str], text: str) -> None: ...

    def prepare(self, context: bpy.types.Context) -> Work:
        """Return the work, with everything it needs from Blender; runs in the main thread.

        Raises
        ------
        InputError
            When it cannot be done.
        """
        raise NotImplementedError  # no abstract method: Blender's classes have a type of their own

    def finish(self, context: bpy.types.Context, result: Any) -> str:
        """Store what the work returned and say what it was, or nothing; runs in the main thread."""
        raise NotImplementedError  # as above

    def give_up(self) -> None:
        """Clean up after work that was cancelled or has failed; runs in the main thread."""

    def tick(self, context: bpy.types.Context) -> None:
        """Do what the thread waits for Blender to do; runs in the main thread, every TICK.

        Raises
        ------
        InputError
            When the work cannot go on.
        """

    def enough(self) -> Any:
        """Return what `finish` can go on with before the work is done; None to wait for all of it.

        What is still under way is given up then.
        """
        return None

    def execute(self, context: bpy.types.Context) -> set[str]:
        """Do the work and return."""
        forget_refusal()
        try:
            return self._store(context, self.prepare(context)(SILENT))
        except Exception as error:  # told in the panel and on the console
            return self._fail(error)

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Start the work in a thread."""
        global _current
        if bpy.app.background or context.window is None:
            return self.execute(context)
        self._job: Job | None = None
        self._timer: Any = None
        forget_refusal()
        try:
            self._job = job = Job(self.prepare(context), self.job_text, type(self).__name__)
            if self.head_start > 0.0:
                job.wait(self.head_start)
                if job.is_finished:
                    return self._conclude(context, job)
            _current = job
            manager = context.window_manager
            self._timer = manager.event_timer_add(TICK, window=context.window)
            manager.modal_handler_add(self)
        except Exception as error:  # told as above; the buttons are free again first
            self._end(context)
            return self._fail(error)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        """Look at the thread."""
        job = self._job
        assert job is not None
        if event.type == "ESC" and event.value == "PRESS":
            job.cancel()
        if job.is_cancelled:
            self._end(context)
            self._clean_up()
            self.report({"INFO"}, "Cancelled; the previous result stays")
            return {"CANCELLED"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        try:
            redraw_sidebars()
            if not job.is_finished:
                self.tick(context)
                early = self.enough()
                if early is None:
                    return {"PASS_THROUGH"}
                self._end(context)
                return self._store(context, early)
            self._end(context)
            return self._conclude(context, job)
        except Exception as error:  # told as above; the buttons are free again first
            self._end(context)
            return self._fail(error)

    def cancel(self, context: bpy.types.Context) -> None:
        """Blender ends the operator, because it loads a file or closes the window."""
        self._end(context)
        self._clean_up()

    def _end(self, context: bpy.types.Context) -> None:
        """Forget the job, and what Blender was asked for because of it; done twice it does no harm.

        The buttons first: they are free whatever comes after.
        """
        job, timer = self._job, self._timer
        self._timer = None
        if job is not None:
            _leave(job)
        if timer is not None:
            with tracebacks_only():
                context.window_manager.event_timer_remove(timer)
                redraw_sidebars()

    def _conclude(self, context: bpy.types.Context, job: Job) -> set[str]:
        """Take over what the thread has left."""
        if job.error:
            return self._fail(job.error)
        return self._store(context, job.result)

    def _store(self, context: bpy.types.Context, result: Any) -> set[str]:
        text = self.finish(context, result)
        if text:
            # Blender prints it on the terminal, too.
            self.report({"INFO"}, printable(text))
        return {"FINISHED"}

    def _fail(self, error: BaseException) -> set[str]:
        global _refusal, _refused
        self._clean_up()
        reason = why(error)
        # The report vanishes at the next move of the mouse.
        _refusal, _refused = f"{self.refused_text}: {reason}", type(self).__name__
        is_defect = not isinstance(error, REFUSALS)
        self.report({"ERROR"}, f"{self.job_text} failed, {reason}" if is_defect else reason)
        return {"CANCELLED"}

    def _clean_up(self) -> None:
        with tracebacks_only():
            self.give_up()


@contextlib.contextmanager
def tracebacks_only() -> Iterator[None]:
    """Print what goes wrong, and go on: for cleaning up, which has to come to its end."""
    try:
        yield
    except Exception as error:  # printed, which is all that can be done about it here
        print_traceback(error)
