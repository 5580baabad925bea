"""An experiment: scene x structure x workload, and the record that comes of it.

The record is the one place figures come from: the panel, the table, CSV, JSON and the HTML page all
show records. Its form is ``accelscope/2``; times are wall-clock seconds. Beside the figures it says
what they are of: the lights of the scene (``scene.lights``), the camera that the rays start from
(``rays.camera``), versions and machine (``environment``). Where meshes were kept as instances, it
has ``scene.instances``: how many there are, of how many meshes, and the triangles of each mesh
counted once; ``scene.triangles`` counts those of every instance.
"""

from __future__ import annotations

import contextlib
import dataclasses
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...contract.counters import Counts
from ...contract.figures import of_keys
from ...contract.ray_order import SORTED, may_be_sorted, order_of
from ...contract.structure import Hits, Made, Structure, trace_range
from ...errors import InputError
from ...geometry.csg.description import Difference, mesh_of_triangles
from ...geometry.csg.trees import UNION, Csg, n_pruned
from ...geometry.icosphere import icosphere
from ...geometry.instances import Instanced, instanced, levels_of_mesh, primitives_in, stored_in
from ...geometry.rays import ALL, Rays, joined_rays
from ...geometry.solids.description import Sphere
from ...geometry.solids.mixed import Mixed
from ...geometry.triangles import Triangles
from ...kernels import announcing, as_written, compiling_beside, is_plain, plain
from ...parallel import core_count
from ...progress import SILENT, Progress
from ...scene import Scene
from ...scene.camera_rays import CLASS_NAMES
from ...scene.light import point_lights
from ...settings import to_json
from ..rays.workload import Generations, Outcome, Workload
from .environment import environment
from .spread import spread

SCHEMA = "accelscope/2"
"""Of records. The number rises when a key goes, or means something else; new keys leave it.

2: a record has only those counters and figures that its structure declares. Before, all had all of
them, 0 where there was nothing to count; names and meanings are the same.
"""


@dataclass(frozen=True)
class Built:
    """A structure, the seconds its build took, and whether plain Python has built it meanwhile.

    The last is so where kernels were not compiled yet (:func:`..kernels.run_plain`).
    """

    structure: Structure
    seconds: float
    is_plain: bool = False


@dataclass(frozen=True)
class Traced:
    """A traced workload: what it was, its rays, what they hit, what it cost on some threads.

    Of the seconds, those that went into making the cells of a lazy structure stand under `made`.
    What has come of the rays beside their hits is the `outcome`.
    """

    workload: type[Workload]
    settings: Any
    rays: Rays
    hits: Hits
    counters: Counts
    seconds: float
    threads: int
    made: Made | None = None
    outcome: Outcome | None = None


def build(
    scene: Scene,
    structure_type: type[Structure],
    settings: Any,
    progress: Progress = SILENT,
    *,
    log: bool = False,
) -> Built:
    """Build a structure and measure the time, compilation of its kernels left out.

    Parameters
    ----------
    log : bool
        Whether the structure keeps how it was built.

    Raises
    ------
    InputError
        When the settings ask for more memory than there is.
    Cancelled
        From `progress`.
    """
    structure_type.refuse_too_large(scene, settings)
    warm_up(structure_type, settings, progress, scene.geometry)
    start = time.perf_counter()
    structure = structure_type.build(scene, settings, progress, log=log)
    return Built(structure, time.perf_counter() - start, is_plain())


OVER = {Mixed: " over solids", Csg: " over trees of solids", Instanced: " over instances"}
"""What is said when kernels are compiled for other items than triangles."""


def warm_up(
    structure_type: type[Structure],
    settings: Any,
    progress: Progress = SILENT,
    geometry: Any = None,
) -> None:
    """Compile the kernels of a structure, or load them from the cache; announce a compilation.

    Other choices, such as another walk, have other kernels, and so may switches; numbers have not.

    Parameters
    ----------
    geometry : NamedTuple of arrays, optional
        What it is to be built over, if not triangles: other kinds have other kernels.
    """
    choices = {
        field.name: getattr(settings, field.name)
        for field in dataclasses.fields(settings)
        if isinstance(field.default, (bool, str))
    }
    tiny = tiny_scene_like(geometry)
    names = structure_type.answers or (*CLASS_NAMES, "ray")
    count = len(names)
    rays = Rays.from_arrays(
        np.zeros((count, 3)), np.ones((count, 3)), classes=np.arange(count), class_names=names
    )
    # What refuses other items than triangles will say so of the scene itself.
    refusing = contextlib.nullcontext() if is_triangles(tiny) else contextlib.suppress(InputError)
    beside = compiling_beside(compile_tracing, structure_type, choices, tiny, rays)
    what = structure_type.name + OVER.get(type(tiny.geometry), "")
    with announcing(progress, what), refusing, beside as tasks:
        structure = structure_type.build(tiny, structure_type.Settings(**choices))
        if tasks:
            structure.statistics()
            with as_written(trace_range):  # for what makes cells for rays
                structure.trace(rays, ALL, threads=1)
        for task in tasks:
            task.wait()
        structure.trace(rays, ALL, threads=1)


def compile_tracing(
    structure_type: type[Structure], choices: dict[str, Any], scene: Scene, rays: Rays
) -> None:
    """Compile what walks; plain Python does the building."""
    with plain(True):
        structure = structure_type.build(scene, structure_type.Settings(**choices))
    structure.trace(rays, ALL, threads=1)


def warm_up_order(rays: Rays, items: int, choice: str, progress: Progress) -> None:
    """Compile the kernels that sort rays, or load them, if there may be something to sort."""
    if may_be_sorted(items, choice):
        with announcing(progress, "the sorting of rays"):
            box = np.concatenate([np.zeros(3), np.ones(3)])
            order_of(rays.select(np.arange(1)).arrays(), box, items, SORTED, 1, SILENT)


def is_triangles(scene: Scene) -> bool:
    """Say whether a scene holds triangles alone."""
    return isinstance(scene.geometry, Triangles)


def tiny_scene_like(geometry: Any = None) -> Scene:
    """Return a scene with a light, of the kind of a geometry: triangles or solids, as deep."""
    # Enough of a muddle that even what only improves a poor tree has something to do.
    random = np.random.default_rng(1)
    corners = random.random((60, 1, 3)) + 0.05 * random.random((60, 3, 3))
    if isinstance(geometry, Csg):
        tree = Difference([Sphere(corners[0, 0], 0.1), mesh_of_triangles(icosphere(0))])
        scene = Scene.from_trees([tree, tree], "warm-up", cutting=geometry.cutting)
        return dataclasses.replace(scene, lights=point_lights((2.0, 3.0, 4.0)))
    bottom = geometry
    while isinstance(bottom, Instanced):
        bottom = bottom.meshes[0]
    if isinstance(bottom, Mixed):
        scene = Scene.from_items([Sphere(corner[0], 0.05) for corner in corners], "warm-up")
    else:
        scene = Scene.from_triangles(corners, "warm-up")
    for _ in range(levels_of_mesh(geometry)):
        places = np.tile(np.eye(3, 4), (len(corners), 1, 1))
        places[:, :, 3] = corners[:, 0]
        many = instanced([scene.geometry], np.zeros(len(places), np.int32), places)
        scene = Scene.from_instances(many, "warm-up")
    return dataclasses.replace(scene, lights=point_lights((2.0, 3.0, 4.0)))


def trace(
    built: Built,
    workload: type[Workload],
    settings: Any,
    threads: int = 0,
    progress: Progress = SILENT,
) -> Traced:
    """Make the rays of a workload, trace them and measure the time of the tracing alone.

    Raises
    ------
    InputError
        When the workload's settings do not fit the scene.
    Cancelled
        From `progress`.
    """
    rays = workload.make(built.structure.scene, settings)
    return trace_rays(built, workload, settings, rays, threads, progress)


def trace_rays(
    built: Built,
    workload: type[Workload],
    settings: Any,
    rays: Rays,
    threads: int = 0,
    progress: Progress = SILENT,
) -> Traced:
    """Trace the rays that a workload has made already, and all that come of them.

    Parameters
    ----------
    rays : Rays
        The first generation, which may serve several structures.
    """
    warm_up_order(rays, len(built.structure.scene), settings.order, progress)
    structure, before = built.structure, built.structure.made()
    batches: list[Rays] = []
    hits: list[Hits] = []
    counts: list[np.ndarray] = []
    seconds = 0.0

    def measured(batch: Rays) -> Hits:
        nonlocal seconds
        start = time.perf_counter()
        hit, counted = structure.trace(
            batch, threads=threads, ray_order=settings.order, progress=progress
        )
        seconds += time.perf_counter() - start
        batches.append(batch)
        hits.append(hit)
        counts.append(counted.values)
        return hit

    generations = workload.generations(structure.scene, settings, rays, progress)
    outcome = run_through(generations, measured)
    made = made_since(before, structure)
    unsparing = workload.unsparing(settings)
    if outcome is not None and unsparing is not None:
        outcome = outcome.against(outcome_of(structure, workload, unsparing, threads, progress))
    return Traced(
        workload, settings, joined_rays(batches),
        Hits(np.concatenate([hit.t for hit in hits]),
             np.concatenate([hit.primitive for hit in hits])),
        Counts(structure.counters, np.concatenate(counts)), seconds,
        threads or core_count(), made, outcome,
    )  # fmt: skip


def run_through(generations: Generations, trace: Callable[[Rays], Hits]) -> Outcome | None:
    """Trace a batch after the other, and return what comes of them in the end."""
    batch = next(generations)
    try:
        while True:
            batch = generations.send(trace(batch))
    except StopIteration as end:
        outcome: Outcome | None = end.value
        return outcome


def outcome_of(
    structure: Structure, workload: type[Workload], settings: Any, threads: int, progress: Progress
) -> Outcome | None:
    """Trace a workload for its outcome alone: hits and counters are forgotten."""
    first = workload.make(structure.scene, settings)
    return run_through(
        workload.generations(structure.scene, settings, first, progress),
        lambda batch: structure.trace(
            batch, threads=threads, ray_order=settings.order, progress=progress
        )[0],
    )


def made_since(before: Made | None, structure: Structure) -> Made | None:
    """Return what a lazy structure has made since it had made `before`; None of any other."""
    now = structure.made()
    if before is None or now is None:
        return None
    return Made(now.cells - before.cells, now.seconds - before.seconds, now.passes - before.passes)


def describe_scene(scene: Scene) -> dict[str, Any]:
    """Return the part of a record that is about the scene."""
    geometry = scene.geometry
    kept: dict[str, Any] = {}
    if isinstance(geometry, Instanced):
        kept["instances"] = {
            "count": len(scene),
            "meshes": len(geometry.meshes),
            "triangles": stored_in(geometry),
        }
    if isinstance(geometry, Csg):
        kinds = geometry.nodes.kind
        kept["csg"] = {
            "trees": int(geometry.is_tree.sum()),
            "operations": int((kinds >= UNION).sum()),
            "leaves": int((kinds < UNION).sum()),
            "pruned": n_pruned(geometry),
            **to_json(geometry.cutting),
        }
    return {
        "name": scene.name,
        "source": scene.source,
        "triangles": primitives_in(geometry),
        **kept,
        "dropped_triangles": scene.dropped,
        "bounds": [scene.lower.tolist(), scene.upper.tolist()],
        "notes": list(scene.notes),
        "lights": [light.to_json() for light in scene.lights],
    }


def make_failed_record(
    scene: Scene | str,
    structure_type: type[Structure],
    settings: Any,
    workload: type[Workload],
    workload_settings: Any,
    reason: str,
) -> dict[str, Any]:
    """Return the record of an experiment that was refused: what it was and why, without figures.

    Parameters
    ----------
    scene : Scene or str
        The name as it was given, if the scene could not be read.
    reason : str
        What stands under ``error``; no other record has that key.
    """
    if isinstance(scene, str):
        described: dict[str, Any] = {"name": Path(scene).stem, "source": scene}
    else:
        described = describe_scene(scene)
    return {
        "scene": described,
        "structure": {"name": structure_type.name, "settings": to_json(settings)},
        "rays": {"name": workload.name, "settings": to_json(workload_settings)},
        "environment": environment(None),
        "error": reason,
    }


def refuse_not_finite(part: Any, name: str = "") -> None:
    """Raise InputError if a record holds a number that is none: JSON has no word for it."""
    if isinstance(part, dict):
        for key, value in part.items():
            refuse_not_finite(value, f"{name}.{key}" if name else key)
    elif isinstance(part, list):
        for value in part:
            refuse_not_finite(value, name)
    elif isinstance(part, float) and not math.isfinite(part):
        raise InputError(f"{name} is {part}, too large to compute with; scale the scene")


def make_record(built: Built, traced: Traced | None, progress: Progress = SILENT) -> dict[str, Any]:
    """Return the JSON-ready record of an experiment; without rays if none were traced.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    structure = built.structure
    record: dict[str, Any] = {
        "scene": describe_scene(structure.scene),
        "structure": {"name": structure.name, "settings": to_json(structure.settings)},
        "build": {"seconds": built.seconds, "bytes": structure.memory()},
        "statistics": of_keys(structure.statistics(progress).to_json(), structure.FIGURES),
        "environment": environment(traced.threads if traced else None),
    }
    if built.is_plain:  # its seconds are not those of compiled kernels, whatever traces now
        record["environment"]["numba"] = None
    if traced is None:
        return record
    classes = np.bincount(traced.rays.classes, minlength=len(traced.rays.class_names))
    hit = traced.hits.primitive >= 0
    hits_by_class = np.bincount(traced.rays.classes[hit], minlength=len(traced.rays.class_names))
    record["rays"] = {
        "name": traced.workload.name,
        "settings": to_json(traced.settings),
        "count": len(traced.rays),
        "classes": dict(zip(traced.rays.class_names, classes.tolist(), strict=True)),
        **traced.workload.used(structure.scene, traced.settings),
    }
    record["trace"] = {
        "seconds": traced.seconds,
        "rays_per_second": len(traced.rays) / max(traced.seconds, 1e-9),
        "hits": int(hit.sum()),
        "hits_by_class": dict(zip(traced.rays.class_names, hits_by_class.tolist(), strict=True)),
        **traced.counters.means(),
        "by_class": by_class(traced),
    }
    answered = structure.answered(traced.rays)
    if answered:
        record["trace"]["routes"] = answered
    if traced.made is not None:
        record["trace"]["lazy"] = traced.made._asdict()
    if traced.outcome is not None:
        record["outcome"] = of_keys(traced.outcome.to_json(), traced.workload.FIGURES)
    return record


def by_class(traced: Traced) -> dict[str, Any]:
    """Return rays, hits and the spread of every counter, for each class of rays that there are."""
    hit, figures = traced.hits.primitive >= 0, {}
    for number, name in enumerate(traced.rays.class_names):
        chosen = np.flatnonzero(traced.rays.classes == number)
        if not len(chosen):
            continue
        figures[name] = {
            "rays": len(chosen),
            "hits": int(hit[chosen].sum()),
            **{
                counter.name: spread(traced.counters.values[chosen, k])
                for k, counter in enumerate(traced.counters.counters)
            },
        }
    return figures
