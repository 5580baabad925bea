"""A tour of what the status says, and of jobs that fail, in a real Blender window.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/tour_state.py build/window/tour-state [-- ZIP]

What is asked for is what the panel is told, which looks at nothing by itself: it becomes true in
time, or it says that it does not know yet.
"""

from __future__ import annotations

import itertools
import sys
import time
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from guide import (
    REFIT,
    build,
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
)
from heartbeat import Heartbeat, gaps, summary
from session import Steps

UP_TO_DATE = "Up to date"
COMPARING = "Comparing with the scene..."
PLAYING = "Compared with the scene when the animation stops"

seen: list[str] = []
"""What the panel was told, and what the job bar showed; each once it changed."""


def monkey() -> bpy.types.Object:
    """Return the one object with a mesh."""
    return next(obj for obj in bpy.context.scene.objects if obj.type == "MESH")


def told() -> str:
    """Return what the panel is told."""
    return results().status(bpy.context, at_once=False).text


def listen() -> float:
    """Keep what is said, many times a second."""
    job = running()
    text = job.text if job else told()
    if not seen or seen[-1] != text:
        seen.append(text)
    return 0.02


def settled(text: str) -> Steps:
    """Wait until the panel is told this, without anybody asking for a comparison."""
    yield lambda: told() == text
    # It stays.
    yield 0.6
    assert told() == text, told()


def out_of_date(reason: str) -> Steps:
    """Wait until the panel is told so."""
    yield from settled(f"Out of date: {reason}")


def grabbed() -> Steps:
    """Put the pointer into the viewport, the keys go there."""
    bpy.ops.object.select_all(action="SELECT")
    bpy.ops.ed.undo_push(message="Select")
    over_viewport()
    yield 0.5


def close_report() -> Steps:
    """Close the report of an error: it covers the buttons below the pointer."""
    over_viewport()
    yield 0.5
    session.key("Escape")
    yield 0.5


# ------------------------------------------------------------------------------------ the status


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def first_build() -> Steps:
    """Compiling is said while there is something to compile."""
    yield from open_wide_tab()
    sample("suzanne", suzanne_subdivisions=1)
    bpy.app.timers.register(listen, persistent=True)
    yield from build()
    yield from settled(UP_TO_DATE)
    compiling = [text for text in seen if "ompiling" in text]
    note("first_build_said", list(seen))
    assert compiling == ["Compiling BVH, once after installation, some ten seconds"], seen
    station("built")


@session.step
def second_build() -> Steps:
    """The same kernels again, and others that the first build had too: nothing is compiled."""
    seen.clear()
    settings().structures.bvh.max_leaf_size = 2
    yield from build()
    settings().structures.bvh.property_unset("max_leaf_size")
    yield from build()
    yield from settled(UP_TO_DATE)
    assert not [text for text in seen if "ompiling" in text], seen


@session.step
def grab_and_let_go() -> Steps:
    """G, a drag, Esc: out of date during the drag, and up to date after it."""
    yield from grabbed()
    region = session.region()
    session.key("g")
    yield 0.3
    session.move(region.x + 0.4 * region.width, region.y + 0.5 * region.height)
    yield from out_of_date(f"{monkey().name} has moved")
    station("dragged")
    session.key("Escape")
    yield from settled(UP_TO_DATE)
    station("let-go")


@session.step
def edit_mode_and_back() -> Steps:
    """Tab and Tab: nothing was changed."""
    yield from grabbed()
    bpy.context.view_layer.objects.active = monkey()
    for _ in range(2):
        seen.clear()
        session.key("Tab")
        yield 1.0
        yield from settled(UP_TO_DATE)
        assert not [text for text in seen if text.startswith("Out of date")], seen


@session.step
def hide_and_show() -> Steps:
    """H and Alt+H."""
    yield from grabbed()
    session.key("h")
    yield from out_of_date(f"{monkey().name} is hidden")
    session.key("alt+h")
    yield from settled(UP_TO_DATE)


@session.step
def shading_and_material() -> Steps:
    """What no ray meets."""
    yield from grabbed()
    seen.clear()
    bpy.ops.object.shade_smooth()
    yield 0.5
    bpy.ops.object.material_slot_add()
    bpy.context.object.material_slots[0].material = bpy.data.materials.new("Red")
    yield 0.5
    bpy.ops.object.select_all(action="DESELECT")
    yield from settled(UP_TO_DATE)
    bpy.ops.accelscope.bake()
    yield from settled(UP_TO_DATE)
    assert not [text for text in seen if text.startswith("Out of date")], seen
    bpy.ops.ed.undo_push(message="Bake")
    bpy.data.objects.remove(bpy.data.objects["BVH Cells"])
    yield from settled(UP_TO_DATE)


@session.step
def move_and_undo() -> Steps:
    """A real move, and Ctrl+Z."""
    yield from grabbed()
    session.key("g", "x", "1", "Return")
    yield from out_of_date(f"{monkey().name} has moved")
    session.key("ctrl+z")
    yield from settled(UP_TO_DATE)
    session.key("ctrl+shift+z")
    yield from out_of_date(f"{monkey().name} has moved")
    session.key("ctrl+z")
    yield from settled(UP_TO_DATE)


@session.step
def scrub() -> Steps:
    """Arrow keys go through the frames of a keyframed object with a modifier."""
    for frame, place in ((1, 0.0), (40, 3.0)):
        monkey().location.x = place
        monkey().keyframe_insert("location", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 40
    bpy.context.scene.frame_set(1)
    yield from settled(UP_TO_DATE)
    over_viewport()
    yield 0.3
    session.key("Right")
    yield from out_of_date(f"{monkey().name} has moved")
    yield from session.find("accelscope.build(")
    station("scrubbed")
    over_viewport()
    yield 0.3
    session.key("Left")
    yield from settled(UP_TO_DATE)


@session.step
def play() -> Steps:
    """Playing compares nothing, and says so; when it stops, it is compared."""
    over_viewport()
    yield 0.3
    compared = []
    look = results().snapshot.look
    kind = type(look)
    compare = kind.compare

    def counted(self: object, *arguments: object) -> object:
        compared.append(time.monotonic())
        return compare(self, *arguments)

    kind.compare = counted
    seen.clear()
    session.key("space")
    yield lambda: bpy.context.window_manager.windows[0].screen.is_animation_playing
    yield 3.0
    assert bpy.context.scene.frame_current > 1
    assert told() == PLAYING, told()
    yield from session.find("accelscope.build(")
    station("playing")
    assert not compared
    over_viewport()
    yield 0.3
    session.key("space")
    yield lambda: told().startswith("Out of date")
    assert len(compared) >= 1
    kind.compare = compare
    bpy.context.scene.frame_set(1)
    yield from settled(UP_TO_DATE)


@session.step
def large_mesh() -> Steps:
    """A million triangles are compared without the window standing still."""
    sample("suzanne", suzanne_subdivisions=5)
    settings().structure = "naive"
    yield 2.0
    yield from build()
    yield from settled(UP_TO_DATE)
    compared: list[tuple[float, float]] = []
    kind = type(results().snapshot.look)
    compare = kind.compare

    def noted(self: object, *arguments: object) -> object:
        start = time.monotonic()
        finished = compare(self, *arguments)
        compared.append((start, time.monotonic()))
        return finished

    kind.compare = noted
    heart = Heartbeat()
    seen.clear()
    monkey().data.update_tag()
    yield 0.0
    start = time.monotonic()
    heart.start()
    yield lambda: compared and told() == UP_TO_DATE
    yield 0.5
    heart.stop()
    kind.compare = compare
    note("comparing_a_million_triangles", {
        "said": list(seen),
        "seconds_each": [round(end - start, 4) for start, end in compared],
        "timer_gaps": summary(gaps(heart.beats, start, time.monotonic())),
    })  # fmt: skip
    assert COMPARING in seen
    assert not [text for text in seen if text.startswith("Out of date")], seen
    assert len(compared) >= 2
    # What else is due waits for two slices at most: Blender looks at the clock once a round.
    for begin, end in itertools.pairwise(heart.beats):
        assert sum(begin <= slice_begin < end for slice_begin, _ in compared) <= 2
    settings().structure = "bvh"


# ---------------------------------------------------------------------------------- jobs that fail


def animated() -> Steps:
    """Make a small scene whose object grows over the timeline, and build over it."""
    sample("suzanne", suzanne_subdivisions=0)
    for frame, size in ((1, 1.0), (40, 2.0)):
        monkey().scale.z = size
        monkey().keyframe_insert("scale", frame=frame)
    bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 40
    bpy.context.scene.frame_set(1)
    yield 0.5
    yield from build()
    yield from settled(UP_TO_DATE)


@session.step
def comparison_that_breaks() -> Steps:
    """An exception in the main thread's part of a comparison leaves every button working."""
    yield from animated()
    before = results().built
    frames, jobs = part("addon.from_blender.timeline").Frames, part("addon.jobs")
    serve, calls = frames.serve, []

    def fail(self: object) -> None:
        calls.append(1)
        if len(calls) > 3:
            raise ZeroDivisionError("a fault that the tour has put there")
        serve(self)

    frames.serve, printing = fail, jobs.print_traceback
    # The harness takes a traceback for a failure of its own.
    jobs.print_traceback = lambda error: None
    yield from session.press("accelscope.compare_over_timeline(")
    yield lambda: len(calls) > 3
    yield lambda: running() is None
    frames.serve, jobs.print_traceback = serve, printing
    yield 1.0
    note("broken_comparison_said", jobs.refusal())
    assert "a fault that the tour has put there" in jobs.refusal()
    assert results().built is before
    assert bpy.context.scene.frame_current == 1
    for verb in ("build", "refit", "trace", "compare_over_timeline", "clear"):
        assert getattr(bpy.ops.accelscope, verb).poll(), verb
    station("broken")
    yield from close_report()
    yield from settled(UP_TO_DATE)
    yield from build()
    assert jobs.refusal() == ""


@session.step
def edit_during_a_comparison() -> Steps:
    """G X 1 while frames are compared ends it, with the reason in the panel."""
    yield from grabbed()
    before = results().built
    yield from session.press("accelscope.compare_over_timeline(")
    yield lambda: running()
    over_viewport()
    yield lambda: bpy.context.scene.frame_current > 3
    session.key("g", "x", "1", "Return")
    yield lambda: running() is None
    yield 1.0
    said = part("addon.jobs").refusal()
    note("edited_comparison_said", said)
    assert f"{monkey().name} has moved in frame" in said, said
    assert results().built is before
    station("edited")
    yield from close_report()
    yield from out_of_date(f"{monkey().name} has moved")
    session.key("ctrl+z")
    yield 0.5


@session.step
def comparison() -> Steps:
    """One that nobody disturbs finds nothing to complain of."""
    bpy.context.scene.frame_set(1)
    bpy.context.scene.frame_end = 6
    yield 0.5
    yield from build()
    yield from settled(UP_TO_DATE)
    yield from session.press("accelscope.compare_over_timeline(")
    yield lambda: running() is None and results().timeline
    yield from settled(UP_TO_DATE)
    assert part("addon.jobs").refusal() == ""
    assert len(results().timeline) == 12


@session.step
def refit() -> Steps:
    """After a refit the tree is that of the scene again."""
    settings().structures.bvh.builder = "ploc"
    yield from build()
    bpy.context.scene.frame_set(6)
    yield 1.0
    yield from session.press("accelscope.refit(", across=REFIT)
    yield lambda: running() is None and results().record.get("method") == "refit"
    yield from settled(UP_TO_DATE)
    over_viewport()
    yield 1.0
    station("refitted")
    bpy.context.scene.frame_set(1)
    settings().structures.bvh.property_unset("builder")


@session.step
def refused() -> Steps:
    """A structure that is refused is refused in one line, in the words of the panel."""
    settings().structure = "grid"
    settings().structures.grid.resolution = (10_000, 10_000, 10_000)
    yield from session.press("accelscope.build(")
    yield lambda: running() is None
    yield 1.0
    over_viewport()
    session.key("Escape")
    yield 1.0
    said = part("addon.jobs").refusal()
    note("refused_said", said)
    assert said == (
        "Not built: 1 000 000 000 000 cells of the grid are more than the 2 147 483 647 "
        "that can be numbered; lower the resolution"
    )
    station("refused")
    settings().structures.grid.property_unset("resolution")
    settings().structure = "bvh"
    yield from build()
    station("built-again")


session.run()
