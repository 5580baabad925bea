"""Tables of a stage: shaders by record; instances, geometries, materials, lights of a scene."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..contract.structure import Structure
from ..geometry.instances import Instanced, inverted
from ..scene import SUN, Scene
from ..scene.material import MATT
from .program import Program
from .records import Row, declared
from .shaders import Group, Shader, Shaders, table
from .stage import ASKS_ANY_HIT, LIMIT, Stage
from .system import Scene as SceneRecord

FAR = 1000.0
"""How far away a sun is taken to be, in diagonals of the scene."""

LAMP = np.array([-0.6, -0.9, 1.2])
"""Where the light of a scene without lights is, seen from its middle, in diagonals."""


def shader_tables(own: Shaders, made: Callable[[Shader | None], Any]) -> dict[str, np.ndarray]:
    """Return the shader tables of a stage.

    Parameters
    ----------
    made : callable
        Makes of a shader what the tables hold.
    """

    def row(group: Group) -> list[Any]:
        asked = group.any_hit, group.closest_hit
        numbers = [0 if each is None else each.payload_number for each in asked]
        return [made(group.intersection), *(made(each) for each in asked), *numbers]

    nothing = [[0] * 5]
    return {
        "triangles": table([row(group) for group in own.triangles] or nothing),
        "procedurals": table([row(group) for group in own.procedurals] or nothing),
        "misses": table(
            [[made(each), 0 if each is None else each.payload_number] for each in own.misses]
            or [[0, 0]]
        ),
    }


def set_limits(stage: Stage, program: Program, own: Shaders) -> None:
    """Write what does not change while a program runs."""
    stage.now[LIMIT] = program.max_recursion_depth
    stage.now[ASKS_ANY_HIT] = any(group.any_hit is not None for group in own.triangles)


def scene_words(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Return the words of the scene's record, and its lights, (n, 3) float64."""
    words = np.zeros(declared(SceneRecord).size)
    centre = 0.5 * (scene.lower + scene.upper)
    # Without any there is one, above to the front and left.
    lights = np.tile(centre + scene.diagonal * LAMP, (max(len(scene.lights), 1), 1))
    for number, light in enumerate(scene.lights):
        if light.kind == SUN:
            lights[number] = centre - FAR * scene.diagonal * np.asarray(light.direction)
        else:
            lights[number] = light.position
    record = Row(declared(SceneRecord), words)
    record.lights, record.diagonal = len(lights), scene.diagonal
    record.background = scene.background
    return words, lights


def tables_of(structure: Structure, geometry_flags: Sequence[int]) -> dict[str, np.ndarray]:
    """Return what a stage knows of a scene."""
    scene, geometry = structure.scene, structure.scene.geometry
    empty, numbers = np.zeros(0, np.int32), np.zeros(0, np.int64)
    materials = scene.materials or (MATT,)
    tables: dict[str, np.ndarray] = {
        "materials": np.array(
            [(*each.colour, each.specular, each.transmission) for each in materials]
        ),
        "geometry_flags": np.array(list(geometry_flags) or [0], np.int64),
        "material_first": numbers if scene.material_first is None else scene.material_first,
        "material_of": np.zeros(max(len(scene), 1), np.int32)
        if scene.material_ids is None else scene.material_ids,
        "turned": np.zeros(0, np.uint8),
    }  # fmt: skip
    if isinstance(geometry, Instanced):
        to_object, _ = inverted(geometry.matrices)
        count = len(geometry.ids)
        columns = (
            geometry.first[:-1], geometry.instance_ids, geometry.hit_groups, geometry.flags,
        )  # fmt: skip
        tables |= {
            "instances": np.stack(columns, axis=1),
            "to_world": geometry.matrices.reshape(count, 12),
            "to_object": to_object.reshape(count, 12),
            "geometry_of": empty, "index_of": empty,
            "geometry_first": numbers if scene.object_first is None else scene.object_first,
            "places": np.argsort(structure.geometry.ids),
        }  # fmt: skip
    else:
        here = np.eye(3, 4).reshape(1, 12)
        tables |= {
            "instances": np.zeros((1, 4)), "to_world": here, "to_object": here.copy(),
            "geometry_of": scene.object_ids, "index_of": ranks(scene.object_ids),
            "geometry_first": numbers, "places": np.zeros(1),
        }  # fmt: skip
        if scene.turned is not None:
            tables["turned"] = scene.turned
    kinds = {
        "instances": np.int64, "to_world": np.float64, "to_object": np.float64,
        "materials": np.float64, "geometry_first": np.int64, "geometry_flags": np.int64,
        "material_first": np.int64, "turned": np.uint8,
    }  # fmt: skip
    return {
        name: np.require(values, kinds.get(name, np.int32), ["C", "W", "O"])
        for name, values in tables.items()
    }


def ranks(groups: np.ndarray) -> np.ndarray:
    """Return the number of each item among those of its group, in their order."""
    order = np.argsort(groups, kind="stable")
    sorted_groups = groups[order]
    begins = np.searchsorted(sorted_groups, sorted_groups, side="left")
    found = np.empty(len(groups), np.int32)
    found[order] = np.arange(len(groups)) - begins
    return found
