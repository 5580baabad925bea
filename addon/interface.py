"""The Python interface: scenes, structures, rays and figures in a script or a notebook.

``import accelscope`` has these names. They are few, and what they return is the core's own: scenes,
structures, rays, records, with everything in NumPy arrays.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from ..core.contract.cells import Cells
from ..core.contract.steps import Steps
from ..core.contract.structure import Structure
from ..core.contract.within import cells_with_instances
from ..core.errors import InputError
from ..core.evaluation.rays.workloads import Workload, ray_order, workload_named
from ..core.evaluation.records import experiment, report
from ..core.evaluation.records.experiment import Built, Traced
from ..core.evaluation.records.launched import LaunchSettings
from ..core.evaluation.records.launched import run as run_program
from ..core.geometry.csg.description import (
    ClosedMesh,
    Difference,
    HalfSpace,
    Intersection,
    Node,
    Union,
)
from ..core.geometry.csg.settings import CUT, CuttingSettings
from ..core.geometry.geometry import EVERY_OBJECT
from ..core.geometry.instances import instanced
from ..core.geometry.rays import Rays
from ..core.geometry.solids.description import (
    Box,
    Cone,
    Disc,
    Item,
    MovingTriangle,
    Placed,
    Polygon,
    Sphere,
    Triangle,
)
from ..core.pipeline.launch import Launched
from ..core.pipeline.loading import program_at
from ..core.pipeline.program import Program
from ..core.scene import Scene
from ..core.scene.placing import KEEP, PlacingSettings
from ..core.settings import check, key_of, parse, parse_spec
from ..core.structures import structure_named, structures
from .command.arguments import open_scene


def load(
    source: str, *, instances: str = KEEP, csg_bounds: str = CUT, csg_volume: str = "aabb"
) -> Scene:
    """Return the scene of a file or of a sample.

    Parameters
    ----------
    source : str
        As on the command line: a mesh file (OBJ, PLY, STL, GLB, glTF, OFF), a .blend, or
        ``"sample:tetra:size=5"``.
    instances : {"keep", "objects", "flatten"}
        What becomes of meshes that are in several places: each once, with a matrix for each of its
        places, and with "objects" those in one place, too; or all triangles in world space. What
        holds instances has ``.flat()``, too.
    csg_bounds, csg_volume : str
        How trees of solids are bounded, see :mod:`..core.geometry.csg.settings`; no choice changes
        a hit.

    Raises
    ------
    InputError
        If it cannot be read; the message says why.
    """
    settings = parse(PlacingSettings, {"instances": instances}, "load")
    texts = {"csg_bounds": csg_bounds, "csg_volume": csg_volume}
    return open_scene(source, settings.instances).with_cutting(
        parse(CuttingSettings, texts, "load")
    )


def trees(described: Sequence[Node], name: str = "trees") -> Scene:
    """Return a scene of trees of solids (CSG), and plain solids and surfaces beside them.

    Parameters
    ----------
    described : sequence
        Of Union, Intersection and Difference, each of a sequence of operands: such trees, Sphere,
        Box, Cone with its caps, HalfSpace, ClosedMesh. What :func:`solids` takes may stand beside.

    Raises
    ------
    InputError
        If there is none, or one cannot be; the message says which.
    """
    return Scene.from_trees(described, name)


def scene(triangles: np.ndarray, name: str = "triangles") -> Scene:
    """Return a scene of triangles, (n, 3, 3) of any type of number.

    Raises
    ------
    InputError
        If there is none, or a corner is not finite.
    """
    return Scene.from_triangles(np.asarray(triangles, dtype=np.float64), name)


def solids(items: Sequence[Item], name: str = "solids") -> Scene:
    """Return a scene of elementary solids, polygons and triangles, in any mixture.

    Parameters
    ----------
    items : sequence
        Of Sphere, Cone (a cylinder has equal radii), Box, Disc, Polygon, Triangle, MovingTriangle;
        Placed sees one of the first four through a matrix.

    Raises
    ------
    InputError
        If there is none, or one cannot be; the message says which.
    """
    return Scene.from_items(items, name)


def instances(
    meshes: Sequence[Scene | np.ndarray],
    which: np.ndarray,
    matrices: np.ndarray,
    masks: np.ndarray | int = EVERY_OBJECT,
    name: str = "instances",
    *,
    instance_ids: np.ndarray | int = 0,
    hit_groups: np.ndarray | int = 0,
    flags: np.ndarray | int = 0,
) -> Scene:
    """Return a scene of meshes in places, each mesh kept once.

    Hits have the numbers of the flattened scene, ``.flat()``: primitives are counted instance after
    instance.

    Parameters
    ----------
    meshes : sequence
        Triangles, (n, 3, 3); or scenes of triangles, of solids, or of instances, up to three deep.
        All of one kind.
    which : (n,) int
        The mesh of each instance.
    matrices : (n, 3, 4) float
        From the space of the mesh to that of the scene.
    masks : (n,) int, optional
        A ray meets an instance if its own mask, 255 by default, has a bit in common with this one.
    instance_ids, hit_groups, flags : (n,) int, optional
        What else DXR has of an instance, for shaders.

    Raises
    ------
    InputError
        If there is no instance, a number is not finite, or meshes are of different kinds.
    """
    scenes = [mesh if isinstance(mesh, Scene) else scene(mesh) for mesh in meshes]
    geometry = instanced(
        [each.geometry for each in scenes], which, matrices, masks, instance_ids=instance_ids,
        hit_groups=hit_groups, flags=flags,
    )  # fmt: skip
    names = tuple(f"{each.name} {number}" for number, each in enumerate(scenes))
    return Scene.from_instances(geometry, name, object_ids=geometry.which, object_names=names)


def build(over: Scene, structure: str = "bvh", *, log: bool = False, **settings: Any) -> Built:
    """Build a structure.

    Parameters
    ----------
    over : Scene
    structure : str
        Its name, or as on the command line: ``"bvh:builder=ploc,arity=4"``.
    log : bool
        Keep how it is built: ``.structure.build_log`` then has all events as arrays, and cells have
        the steps in which they were made.
    **settings
        Its settings by key: ``builder="ploc"``, ``max_leaf_size=2``, ``resolution=(8, 8, 8)``.

    Returns
    -------
    Built
        ``.structure`` and ``.seconds``, in which nothing was compiled.

    Raises
    ------
    InputError
        For a name or a setting that there is not, or more memory than there is.
    """
    name, texts = parse_spec(structure)
    kind = structure_named(name)
    chosen = _settings_of(kind.Settings, texts, settings, f"structure {name}")
    return experiment.build(over, kind, chosen, log=log)


def rays(origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | float = np.inf) -> Rays:
    """Return rays of your own: origins and directions, (n, 3), of any length but zero.

    Raises
    ------
    InputError
        If shapes differ, or a number is not finite.
    """
    return Rays.from_arrays(np.asarray(origins), np.asarray(directions), t_max)


def trace(
    built: Built, through: str | Rays = "random_lines", *, threads: int = 0, **settings: Any
) -> Traced:
    """Trace rays through a structure.

    Parameters
    ----------
    through : str or Rays
        The name of a set of rays, as on the command line (``"camera:width=64,height=64"``), or
        those of :func:`rays`.
    threads : int
        0 takes every core.
    **settings
        Those of the set of rays, by key.

    Returns
    -------
    Traced
        ``.hits.t`` and ``.hits.primitive``, (n,); ``.counters["N_IT"]``, (n,); ``.rays``;
        ``.seconds``.

    Raises
    ------
    InputError
        For a name or a setting that there is not.
    """
    if isinstance(through, Rays):
        chosen = _settings_of(OwnRaysSettings, {}, settings, "a batch of your own")
        return experiment.trace_rays(built, OwnRays, chosen, through, threads)
    name, texts = parse_spec(through)
    workload = workload_named(name)
    chosen = _settings_of(workload.Settings, texts, settings, f"rays {name}")
    return experiment.trace(built, workload, chosen, threads)


def launch(
    built: Built, program: str | Program = "lecture", *, threads: int = 0, **settings: Any
) -> Launched:
    """Run a program of the ray tracing pipeline for every pixel of a camera.

    Parameters
    ----------
    program : str or Program
        The name of one that comes with AccelScope, the path of a file of your own, which is run,
        or one that is made already.
    threads : int
        0 takes every core.
    **settings
        Those of the rays ``camera``, by key: ``width=256, height=256, from_=(...), at=(...)``.

    Returns
    -------
    Launched
        ``.colours``, (height, width, 4); ``.calls``, (height, width, stages); ``.totals`` and
        ``.by_type``, how often each stage was called; ``.seconds``.

    Raises
    ------
    InputError
        If the program does not fit the scene or the structure, or one of its shaders fails.
    """
    made = program if isinstance(program, Program) else program_at(program)
    view = _settings_of(LaunchSettings, {}, settings, "rays camera")
    return run_program(built, made, view, threads).launched


def cover(built: Built, through: Rays, number: int, half_angle: float) -> np.ndarray:
    """Return the items that a cone around one of some rays meets, (k,), ascending.

    Parameters
    ----------
    half_angle : float
        Between axis and side, in degrees.

    Raises
    ------
    InputError
        If cones do not go through the structure, or the scene holds others than triangles.
    """
    return built.structure.cover(through, number, float(np.radians(half_angle)))[0]


def walk(built: Built, traced: Traced, ray: int) -> Steps:
    """Return what one of the rays did, event by event, recorded by the kernel that counts.

    ``steps.tally()`` are the counters of that ray.
    """
    if not 0 <= ray < len(traced.rays):
        raise InputError(f"there are rays 0 to {len(traced.rays) - 1}, not {ray}")
    return built.structure.record(traced.rays, ray)


def cells(built: Built) -> Cells:
    """Return the cells or nodes: ``.boxes`` (n, 6), ``.depth``, ``.is_leaf``, ``.count``, ...

    Over instances, their boxes and the nodes of their meshes' trees follow, as
    ``.extra["level"]`` and ``.extra["instance"]`` say; ``.own()`` leaves those out.
    """
    return cells_with_instances(built.structure)


def record(built: Built, traced: Traced | None = None) -> dict[str, Any]:
    """Return all figures as the command line writes them as JSON."""
    return experiment.make_record(built, traced)


def table(*records: dict[str, Any]) -> str:
    """Return records of traced rays as the table of the command line."""
    return report.table(records)


@dataclasses.dataclass(frozen=True)
class OwnRaysSettings:
    """Settings of rays that a script has made."""

    order: str = ray_order()


class OwnRays(Workload):
    """Rays that a script has made."""

    name = "own"
    label = "Own"
    summary = "Rays of a script"
    Settings = OwnRaysSettings

    @staticmethod
    def refuse_impossible(settings: Any) -> None:
        """Refuse nothing."""

    @staticmethod
    def make(scene: Scene, settings: Any) -> Rays:
        """Refuse: only the script has them."""
        raise InputError("rays of a script are made by that script")


def _settings_of(kind: type[Any], texts: dict[str, str], values: dict[str, Any], where: str) -> Any:
    """Return settings from texts and from values by key."""
    settings = parse(kind, texts, where)
    names = {key_of(field): field.name for field in dataclasses.fields(kind)}
    unknown = [key for key in values if key not in names]
    if unknown:
        known = ", ".join(names) or "none"
        raise InputError(f"{where} has no setting '{unknown[0]}'; its settings are: {known}")
    changed = {names[key]: tuple(v) if isinstance(v, list) else v for key, v in values.items()}
    return check(dataclasses.replace(settings, **changed), where)


__all__ = [
    "Box", "Built", "Cells", "ClosedMesh", "Cone", "Difference", "Disc", "HalfSpace", "InputError",
    "Intersection", "MovingTriangle", "Placed", "Polygon", "Rays", "Scene", "Sphere", "Steps",
    "Structure", "Traced", "Triangle", "Union", "build", "cells", "cover", "instances", "launch",
    "load", "rays", "record", "scene", "solids", "structures", "table", "trace", "trees", "walk",
]  # fmt: skip
