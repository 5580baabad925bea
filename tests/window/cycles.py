"""A day of use in a real Blender window: nothing is left behind by what was built and taken away.

    .venv/bin/python .ci/build_extension.py --platform linux-x64 --output build/window/extension
    .ci/blender_window.sh tests/window/cycles.py build/window/cycles [-- ZIP]

A cycle builds, draws, traces and steps through a ray, undoes, opens another file and turns the
extension off and on. After some cycles, in which Blender and Numba fill their own pools, memory
stays where it is, and there are as many handlers, timers, threads and batches on the graphics card
as after the first.
"""

from __future__ import annotations

import gc
import sys
import threading
from pathlib import Path

import bpy
import gpu

sys.path.insert(0, str(Path(__file__).parent))
from guide import MODULE, enable, install, note, part, results, running, sample, session
from session import Steps

CYCLES = 60
WARM = 15
"""Cycles after which nothing grows any more."""

GROWTH = 0.3
"""MiB a cycle: one leaked copy of the triangles, cells and lines of a cycle would be 20."""


def memory() -> float:
    """Return the MiB of this process that lie in memory."""
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return pages * 4096 / 2**20


def left_behind() -> dict[str, int]:
    """Count what a cycle could leave behind."""
    gc.collect()
    handlers = bpy.app.handlers
    ours = [
        each
        for name in dir(handlers)
        if isinstance(getattr(handlers, name), list)
        for each in getattr(handlers, name)
        if "accelscope" in getattr(each, "__module__", "")
    ]
    objects = gc.get_objects()
    return {
        "handlers": len(ours),
        "threads": threading.active_count(),
        "batches": sum(isinstance(each, gpu.types.GPUBatch) for each in objects),
        "textures": sum(isinstance(each, gpu.types.GPUTexture) for each in objects),
        "structures": sum(type(each).__name__ == "Built" for each in objects),
        "objects": len(bpy.data.objects),
        "meshes": len(bpy.data.meshes),
    }


def finished() -> bool:
    """Say whether no job is under way."""
    return running() is None


def start(operator: str) -> None:
    """Start an operator as its button does."""
    with bpy.context.temp_override(**session.context()):
        getattr(bpy.ops.accelscope, operator)("INVOKE_DEFAULT")


def use() -> Steps:
    """Build, draw, trace, step through a ray; undo."""
    for operator in ("build", "trace"):
        start(operator)
        yield finished
        yield 0.1
    assert results().traced is not None
    lesson = part("addon.results.lesson_view").current
    start("step_ray")
    yield lambda: finished() and lesson.picture is not None
    yield 0.1
    start("end_lesson")
    assert lesson.picture is None
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.ed.undo_push(message="Cube")
    bpy.ops.ed.undo()
    yield 0.1


@session.step
def install_zip() -> None:
    """The zip installs into a Blender nobody has used before."""
    install()


@session.step
def day_of_use() -> Steps:
    """Cycle after cycle."""
    yield from session.open_sidebar("AccelScope")
    used, counted = [], []
    for cycle in range(CYCLES):
        sample("suzanne", suzanne_subdivisions=2)
        yield from use()
        if cycle % 3 == 0:
            bpy.ops.preferences.addon_disable(module=MODULE)
            yield 0.1
            enable()
        elif cycle % 3 == 1:
            bpy.ops.wm.read_homefile(use_empty=False)
            yield 1.0  # what is asked of a screen before it is drawn ends Blender
        # The new file has a screen of its own; the settings are made after the first draw.
        yield from session.open_sidebar("AccelScope")
        yield lambda: part("addon.settings.properties").is_loaded()
        if cycle % 3 == 2:
            # With something built and drawn, which the next cycle replaces.
            used.append(memory())
            counted.append(left_behind())
    note("memory", [round(each, 1) for each in used])
    note("left_behind", counted)
    warm = WARM // 3
    growth = (used[-1] - used[warm]) / (CYCLES - WARM)
    note("growth_a_cycle", round(growth, 3))
    assert counted[-1] == counted[warm], (counted[warm], counted[-1])
    assert growth < GROWTH, used


session.run()
