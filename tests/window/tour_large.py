"""A million triangles in a real Blender window: it stays alive, can be stopped, and loads a file.

See tour.py for how to run it.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Generator
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    build,
    changed,
    install,
    note,
    open_wide_tab,
    over_viewport,
    part,
    results,
    running,
    sample,
    session,
    settings,
    station,
    status,
    taken,
)
from heartbeat import Heartbeat, gaps, summary
from session import Steps, Wait


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def open_tab() -> Steps:
    """The tab is there."""
    yield from open_wide_tab()


@session.step
def million() -> Steps:
    """The interface stays alive while a million triangles are built over."""
    sample("suzanne", suzanne_subdivisions=5)
    yield 2.0
    before = results().built
    x, y = yield from session.find("accelscope.build(")
    heart = Heartbeat()
    heart.start()
    clicked = time.monotonic()
    session.click(x, y)
    yield lambda: running()
    job = running()
    ended = yield from until(lambda: job.is_finished)
    yield lambda: running() is None and results().built is not before
    shown = time.monotonic()
    heart.stop()
    measured = {
        "triangles": len(results().built.structure.scene),
        "click_and_extraction_seconds": round(job.started - clicked, 3),
        "job_seconds": round(ended - job.started, 3),
        "build_seconds": round(results().built.seconds, 3),
        "from_job_to_result_seconds": round(shown - ended, 3),
        "timer_gaps": summary(gaps(heart.beats, job.started, ended)),
        "sidebar_gaps": summary(gaps(heart.redraws, job.started, ended)),
    }
    note("million", measured)
    yield 1.0
    station("million")
    # How long the gaps are depends on who else uses the processor; that there are many does not:
    # an interface that stands still while a thread works has one.
    assert measured["timer_gaps"]["count"] > 10, measured
    assert measured["sidebar_gaps"]["count"] > 10, measured


@session.step
def cancel() -> Steps:
    """Esc stops the build and leaves the previous result."""
    before = results().built, results().cells, results().record
    x, y = yield from session.find("accelscope.build(")
    escapes = []
    for wait in (0.2, 0.35, 0.5):
        session.click(x, y)
        yield lambda: running()
        job = running()
        yield wait
        assert running() is job, "the build was over before Esc"
        progress = job.text, round(job.factor, 2)
        pressed = time.monotonic()
        session.key("Escape")
        ended = yield from until(lambda: running() is None)
        finished = yield from until(lambda job=job: job.is_finished)
        escapes.append(
            {
                "at": progress,
                "operator_seconds": round(ended - pressed, 3),
                "thread_seconds": round(finished - pressed, 3),
            }
        )
        assert job.is_cancelled
        assert isinstance(job.error, part("core.progress").Cancelled), "the build ran to its end"
        assert (results().built, results().cells, results().record) == before
        yield 1.0
    note("escape", escapes)
    station("cancelled")
    yield lambda: status() == "Up to date"


def until(condition: Callable[[], object]) -> Generator[Wait, None, float]:
    """Wait for a condition, looking more often than the harness, and return when it came true."""
    times: list[float] = []

    def look() -> float | None:
        if not condition():
            return 0.005
        times.append(time.monotonic())
        return None

    bpy.app.timers.register(look)
    yield lambda: times
    return times[0]


@session.step
def load_while_building() -> Steps:
    """Loading a file ends the build and drops everything; the settings come with the file."""
    x, y = yield from session.find("accelscope.build(")
    session.click(x, y)
    yield lambda: running()
    job = running()
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    yield lambda: job.is_finished
    yield 0.5
    assert running() is None
    assert results().built is None
    yield from open_wide_tab()
    settings().structures.bvh.max_leaf_size = 8
    sample("suzanne")
    over_viewport()
    yield 1.0
    empty = session.screenshot("before-the-build")
    yield from build()
    over_viewport()
    yield 0.5
    path = "/tmp/tour.blend"
    bpy.ops.wm.save_as_mainfile(filepath=path)
    settings().structures.bvh.max_leaf_size = 2
    bpy.ops.wm.open_mainfile(filepath=path)
    yield 2.0
    over_viewport()
    yield 1.0
    station("loaded")
    assert settings().structures.bvh.max_leaf_size == 8
    assert status() == "Nothing has been built yet"
    assert changed(empty, taken["loaded"]) == 0
    empty.unlink()


session.run()
