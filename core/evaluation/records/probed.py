"""A picture of probes as a record: what they went through, what they saw, what it took."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ...scene import Scene
from ...settings import to_json
from ..probes.probe import Cast, Probe
from ..rays.camera import camera_used
from .environment import environment
from .experiment import describe_scene
from .report import aligned, show_number, show_seconds

Record = dict[str, Any]


def make_record(scene: Scene, probe: type[Probe], settings: Any, cast: Cast) -> Record:
    """Return the JSON-ready record of a picture."""
    structure = cast.structure
    described = describe_scene(scene)
    described["notes"] += notes_on_casting(scene, cast)
    return {
        "scene": described,
        "structure": {"name": structure.name, "settings": to_json(structure.settings)},
        "build": {"seconds": cast.seconds_to_build, "bytes": structure.memory()},
        "probe": {
            "name": probe.name,
            "settings": to_json(settings),
            "camera": camera_used(scene, settings),
        },
        "cast": {"seconds": cast.seconds, **cast.figures, "by_object": cast.by_object},
        "environment": environment(1),
    }


def notes_on_casting(scene: Scene, cast: Cast) -> list[str]:
    """Return what was made of a scene for these probes, in sentences, beside its own notes."""
    return [each for each in cast.structure.scene.notes if each not in scene.notes]


def table(records: Sequence[Record]) -> str:
    """Return the figures of pictures, and which share of them each object has."""
    parts = []
    for record in records:
        cast = record["cast"]
        rows = [[f"{record['probe']['name']} through {record['structure']['name']}", ""]]
        rows.append(["build", show_seconds(record["build"]["seconds"])])
        for key, value in flat(cast):
            name = key.replace("_", " ")
            if key == "seconds":
                rows.append(["cast", show_seconds(value)])
            elif isinstance(value, int):
                rows.append([name, str(value)])
            else:
                rows.append([name, show_number(value)])
        rows += [["share of the picture", ""]]
        rows += [[f"  {name}", show_number(share)] for name, share in cast["by_object"].items()]
        parts.append(aligned(rows))
    return "\n\n".join(parts)


def flat(figures: Record) -> list[tuple[str, Any]]:
    """Return figures and those within them, but for the shares of objects, in their order."""
    found: list[tuple[str, Any]] = []
    for key, value in figures.items():
        if isinstance(value, dict):
            found += [] if key == "by_object" else list(value.items())
        else:
            found.append((key, value))
    return found
