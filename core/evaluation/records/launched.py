"""A launch of the pipeline as a record: the picture's figures, calls by stage and class of rays."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ...geometry.instances import Instanced
from ...geometry.rays import Rays
from ...geometry.solids.mixed import Mixed
from ...kernels import announcing
from ...pipeline.launch import Launched, Pipeline, State
from ...pipeline.program import Program
from ...pipeline.shaders import shaders_of
from ...pipeline.stage import STAGE_NAMES
from ...printing import show_integer
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.as_triangles import as_triangles
from ...scene.camera_rays import camera_rays
from ...settings import to_json
from ..rays.camera import CameraWorkload, ViewSettings, camera_of, camera_used
from .environment import environment
from .experiment import Built, describe_scene
from .report import aligned, show_number

Record = dict[str, Any]


@dataclasses.dataclass(frozen=True)
class LaunchSettings(ViewSettings):
    """Where the camera stands, and how large the picture is."""


class Run(NamedTuple):
    """A program that has been run.

    Attributes
    ----------
    pipeline : Pipeline
    rays : Rays
        The camera's.
    launched : Launched
    """

    pipeline: Pipeline
    rays: Rays
    launched: Launched


def seen_by(program: Program, scene: Scene) -> Scene:
    """Return a scene as a program can see it: without intersection shaders, solids as triangles.

    Raises
    ------
    InputError
        If a shader of the program does not fit its stage.
    """
    geometry = scene.geometry
    if not isinstance(geometry, Mixed) or shaders_of(program).procedurals:
        return scene
    return as_triangles(scene, "the program has no intersection shader")


def run(
    built: Built,
    program: Program,
    view: ViewSettings,
    threads: int = 0,
    progress: Progress = SILENT,
) -> Run:
    """Run a program over a structure, for every pixel of a camera.

    Raises
    ------
    InputError
        If the program, the structure or the camera is none for this, or a shader fails.
    Cancelled
        From `progress`.
    """
    CameraWorkload.refuse_impossible(view)
    scene = built.structure.scene
    pipeline = Pipeline(built.structure, program)
    camera = camera_of(scene, view)
    rays = camera_rays(camera, view.width, view.height, view.pixel == "corner")
    with announcing(progress, "the pipeline"):
        pipeline.launch(rays.select(np.zeros(1, dtype=np.int64)), 1, 1, threads=1)
    launched = pipeline.launch(rays, view.width, view.height, threads=threads, progress=progress)
    return Run(pipeline, rays, launched)


def make_record(
    built: Built, name: str, made: Run, view: ViewSettings, threads: int,
    states: Sequence[State] | None = None, pixel: tuple[int, int] = (0, 0),
) -> Record:  # fmt: skip
    """Return the JSON-ready record of a launch.

    Parameters
    ----------
    name : str
        Of the program.
    states : sequence of State, optional
        Of one pixel, which is `pixel`: column and row from the top left.
    """
    structure, launched = built.structure, made.launched
    traced = launched.totals["trace_ray"]
    record: Record = {
        "scene": describe_scene(structure.scene),
        "structure": {"name": structure.name, "settings": to_json(structure.settings)},
        "build": {"seconds": built.seconds, "bytes": structure.memory()},
        "program": {"name": name, "label": made.pipeline.program.label},
        "view": {**to_json(view), **camera_used(structure.scene, view)},
        "launch": {
            "seconds": launched.seconds,
            "rays_per_second": traced / max(launched.seconds, 1e-9),
            "calls": launched.totals,
            "by_class": launched.by_type,
            "most_calls_of_a_pixel": dict(
                zip(STAGE_NAMES, launched.calls.max(axis=(0, 1)).tolist())
            ),
        },
        "environment": environment(threads),
    }
    if isinstance(structure.scene.geometry, Instanced):
        record["launch"]["instances"] = len(structure.scene)
    if states is not None:
        record["pixel"] = {"at": list(pixel), "states": [dataclasses.asdict(s) for s in states]}
    return record


def table(records: Sequence[Record]) -> str:
    """Return how often each stage was called, a line for each class of rays, and the states."""
    lines: list[str] = []
    for record in records:
        launch = record["launch"]
        rows = [["rays", *(name.replace("_", " ") for name in STAGE_NAMES)]]
        for name, calls in (*launch["by_class"].items(), ("all", launch["calls"])):
            rows.append([name, *(show_integer(calls[stage]) for stage in STAGE_NAMES)])
        lines += [aligned(rows), ""]
        lines.append(
            f"{show_number(launch['rays_per_second'] / 1e6)} million rays a second, "
            f"{launch['seconds']:.3f} s"
        )
        if "pixel" in record:
            x, y = record["pixel"]["at"]
            states = told(record["pixel"]["states"], list(launch["by_class"]))
            lines += ["", f"pixel {x},{y}", states]
    return "\n".join(lines)


def told(states: Sequence[Record], classes: Sequence[str]) -> str:
    """Return states as lines, indented by the depth of recursion."""
    lines = []
    for state in states:
        words = [state["name"].replace("_", " ")]
        if state["name"] == "trace_ray":
            number = state["ray_type"]
            words.append(classes[number] if number < len(classes) else f"type {number}")
        if state["primitive"] >= 0:
            words.append(f"instance {state['instance']}, primitive {state['primitive']}")
        if state["name"] not in ("ray_generation", "returned"):
            words.append(f"t {state['t']:.6g}")
        lines.append("  " * state["depth"] + "  ".join(words))
    return "\n".join(lines)
