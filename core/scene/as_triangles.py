"""A scene of solids and polygons as one of triangles, for what knows triangles alone."""

from __future__ import annotations

import dataclasses

import numpy as np

from ..geometry.cones.sphere import are_spheres
from ..geometry.geometry import in_order
from ..geometry.solids.making import in_turn, mixed_of_triangles
from ..geometry.solids.mixed import Mixed
from ..geometry.solids.tessellation import tessellated
from . import Scene


def as_triangles(scene: Scene, reason: str) -> Scene:
    """Return a scene with its items as triangles, and a note on that; itself if it has no others.

    Parameters
    ----------
    reason : str
        Why, for the note: ``"beams meet polygons only"``.

    Raises
    ------
    InputError
        If instances are of something else than triangles.
    """
    scene = scene.flat()
    geometry = scene.geometry
    if not isinstance(geometry, Mixed):
        return scene
    corners, owners = tessellated(geometry)
    made = Scene.from_triangles(
        corners, scene.name, scene.source, object_ids=scene.object_ids[owners],
        object_names=scene.object_names,
        notes=(*scene.notes, note_on(len(scene), len(corners), reason)),
    )  # fmt: skip
    return seen_alike(made, scene, owners[made.primitive_ids])


def as_triangles_and_spheres(scene: Scene, reason: str) -> Scene:
    """Return a scene with all items but spheres as triangles, and a note on that.

    Itself if it has no others; one of triangles alone if it has no spheres.

    Parameters
    ----------
    reason : str
        Why, for the note: ``"cones meet triangles and spheres only"``.

    Raises
    ------
    InputError
        If instances are of something else than triangles.
    """
    scene = scene.flat()
    geometry = scene.geometry
    if not isinstance(geometry, Mixed) or not (are := are_spheres(geometry)).any():
        return as_triangles(scene, reason)
    others, spheres = np.flatnonzero(~are), np.flatnonzero(are)
    parts, owners, notes = [in_order(geometry, spheres)], spheres, scene.notes
    if len(others):
        corners, which = tessellated(in_order(geometry, others))
        parts, owners = [*parts, mixed_of_triangles(corners)], np.append(owners, others[which])
        notes = (*notes, note_on(len(others), len(corners), reason))
    order = np.argsort(owners, kind="stable")
    owners = owners[order]
    made = Scene.from_mixed(
        in_turn(parts, order), scene.name, scene.source, object_ids=scene.object_ids[owners],
        object_names=scene.object_names, notes=notes,
    )  # fmt: skip
    return seen_alike(made, scene, owners)


def note_on(items: int, triangles: int, reason: str) -> str:
    """Return what is said of items that are seen as triangles."""
    return f"its {items} items are seen as {triangles} triangles, for {reason}"


def seen_alike(made: Scene, scene: Scene, owners: np.ndarray) -> Scene:
    """Return a scene with the camera, the lights and the materials of what it was made of.

    Parameters
    ----------
    owners : (n,) int
        The item of the other one that each item was.
    """
    return dataclasses.replace(
        made, camera=scene.camera, lights=scene.lights, background=scene.background,
        materials=scene.materials,
        material_ids=None if scene.material_ids is None else scene.material_ids[owners],
    )  # fmt: skip
