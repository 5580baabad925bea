"""Light buffer: what may stand between a light and the points it shines on, direction by direction.

A directional cube stands in every light. A cell of it lists the items that may be seen from the
light through it, the nearest first. A *shadow ray* ends at the light: it comes through one cell, so
only what that lists can be in its way, and of that only what is nearer to the light than the point
the ray comes from (lecture, "Light buffer"; Haines and Greenberg 1986).

A sun is infinitely far away: in the place of a cube there is a plane across its rays.

Where one item covers a cell, everything behind it is in shadow: it alone is tested, and nothing
that begins behind it is listed.

Neighbours are often in the shadow of the same item. The *last occluder*, of the light or of the
cell, is tested first if it is remembered. Counters then depend on the order of rays: they are
traced one after the other, in the caller's order, on one thread.

A ray that does not end at the light that it says it goes to is no shadow ray of this buffer, nor is
one to another point of a large light: all items are tested.

With ``insert=raster`` cells first try what graphics hardware would draw into them
(:mod:`.directional.raster`).

E. Haines, D. Greenberg: The Light Buffer: A Shadow-Testing Accelerator, IEEE CG&A 6(9), 1986.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.needs import GEOMETRY, LIGHTS
from ..contract.walk import walk
from ..errors import InputError
from ..kernels import implements, inlined, whole
from ..progress import SILENT, Progress
from ..scene import LIGHT_KINDS, SUN, Scene
from ..scene.camera_rays import SHADOW
from ..settings import setting
from .directional.faces import (
    Faces,
    cube,
    face_towards,
    in_face,
    joined_faces,
    plane_before_sun,
)
from .directional.lists import NONE, Lists, cell_at, no_lists
from .directional.projection import Insertion
from .directional.raster import drawn_lists
from .directional.structure import (
    UNIFORM,
    Directional,
    DirectionalSettings,
    filled,
    insert_setting,
    insertion_of,
)
from .directional.walk import Seen, walk_list

RASTER = "raster"

NOTHING, PER_LIGHT, PER_CELL = "none", "light", "cell"
"""What remembers its last occluder."""


@dataclass(frozen=True)
class LightBufferSettings(DirectionalSettings):
    """Settings of the light buffer."""

    insert: str = insert_setting(
        {RASTER: "What is visible at pixels is tried first, of uniform cells; then all as exact"}
    )
    pixels: int = setting(
        2, "Pixels", "Pixels along an edge of a cell", unit="pixels", minimum=1, maximum=16,
        only_for={"insert": [RASTER]},
    )  # fmt: skip
    dilation: int = setting(
        0, "Dilation", "Pixels around a cell that are its own as well", unit="pixels", minimum=0,
        maximum=16, only_for={"insert": [RASTER]},
    )  # fmt: skip
    last_occluder: str = setting(
        NOTHING,
        "Last Occluder",
        "Whether the item that has blocked the last ray is tested first; rays are then traced one "
        "after the other",
        choices={
            NOTHING: "Nothing is remembered",
            PER_LIGHT: "One item for each light",
            PER_CELL: "One item for each cell",
        },
    )


class LightBufferArrays(NamedTuple):
    """The light buffer as the walk sees it.

    Attributes
    ----------
    faces : Faces
        Of all lights, one after the other.
    first_face : (n_lights,) int32
    lists, drawn : Lists
        Those in which nothing is missing, and those of what was drawn.
    last : (k,) int32
        The last occluder of every light, or cell; without any, nothing is remembered.
    per_cell : bool
    slack, extent : float
        How far a ray may pass off its light; how large the scene is.
    """

    faces: Faces
    first_face: np.ndarray
    lists: Lists
    drawn: Lists
    last: np.ndarray
    per_cell: bool
    slack: float
    extent: float


@inlined
def stranger():
    """Return what is known of a ray that the lists are not for."""
    return Seen(whole(NONE), False, 0.0, 0.0, whole(NONE))


@inlined
def seen_from_light(structure, ray):
    """Return where a ray lies as the light sees it that it goes to."""
    faces, lists, slack = structure.faces, structure.lists, structure.slack
    light = whole(ray.target)
    if light < 0 or light >= len(structure.first_face):
        return stranger()
    face = whole(structure.first_face[light])
    o = faces.origins[face]
    x, y, z = ray.ox - o[0], ray.oy - o[1], ray.oz - o[2]
    square = ray.dx * ray.dx + ray.dy * ray.dy + ray.dz * ray.dz
    length = np.sqrt(square)
    if faces.is_parallel[face]:
        w = faces.axes[face, 2]
        ex, ey, ez = ray.dx / length + w[0], ray.dy / length + w[1], ray.dz / length + w[2]
        size = structure.extent + np.sqrt(x * x + y * y + z * z)
        if not np.sqrt(ex * ex + ey * ey + ez * ez) * size <= slack:
            return stranger()
        u, v, depth = in_face(faces, face, x, y, z)
        cell = whole(NONE)
        if abs(u) <= 1.0 and abs(v) <= 1.0:
            cell = cell_at(lists, face, u, v)
        start = depth - ray.t_min * length + slack
    else:
        # The t at which the ray is nearest to the light, and how far off that it then is.
        t = -(x * ray.dx + y * ray.dy + z * ray.dz) / square
        ex, ey, ez = x + t * ray.dx, y + t * ray.dy, z + t * ray.dz
        is_off = ex * ex + ey * ey + ez * ez > slack * slack
        if is_off or not (ray.t_max - t) * length <= slack:
            return stranger()
        face = whole(face_towards(face, -ray.dx, -ray.dy, -ray.dz))
        a, b, c = in_face(faces, face, -ray.dx, -ray.dy, -ray.dz)
        cell = cell_at(lists, face, a / c, b / c)
        start = (t - ray.t_min) * length + slack
    place = whole(NONE)
    if len(structure.last) > 0:
        place = cell if structure.per_cell else light
    return Seen(cell, True, start, 0.0, place)


@implements(walk, LightBufferArrays, inline=True)
def walk_light_buffer(structure, geometry, ray, number, workspace, log):
    """Test what the cell lists that a shadow ray comes through, the nearest to the light first."""
    return walk_list(
        structure.lists, structure.drawn, structure.last, geometry,
        seen_from_light(structure, ray), ray, number, workspace, log,
    )  # fmt: skip


class LightBuffer(Directional):
    """A directional cube in every light."""

    name = "light_buffer"
    label = "Light Buffer"
    summary = "A directional cube in every light, for shadow rays"
    Settings = LightBufferSettings
    answers = (SHADOW,)
    needs = frozenset({GEOMETRY, LIGHTS})

    arrays: LightBufferArrays

    def __init__(
        self,
        scene: Scene,
        settings: LightBufferSettings,
        arrays: LightBufferArrays,
        insertion: Insertion,
        geometry: Any,
    ) -> None:
        super().__init__(scene, settings, arrays, geometry)
        self.insertion = insertion

    @classmethod
    def build(
        cls,
        scene: Scene,
        settings: LightBufferSettings,
        progress: Progress = SILENT,
        *,
        log: bool = False,
    ) -> LightBuffer:
        """Divide the cubes of all lights, and list what is seen through their cells.

        Raises
        ------
        InputError
            If there is no light, or lists do not fit into memory.
        """
        if not scene.lights:
            raise InputError(
                f"{scene.name} has no light, and a light buffer stands in lights; add a light "
                f"({', '.join(LIGHT_KINDS)}), or choose another structure",
                scene.name,
            )
        if settings.insert == RASTER and settings.division != UNIFORM:
            raise InputError(
                "light_buffer: insert=raster draws into uniform cells; choose division=uniform, or "
                "another way to insert"
            )
        cls.refuse_too_large(scene, settings)
        parts = [
            plane_before_sun(light.direction, scene.lower, scene.upper)
            if light.kind == SUN
            else cube(light.position)
            for light in scene.lights
        ]
        ends = np.cumsum([0] + [len(part.origins) for part in parts])
        faces, geometry = joined_faces(parts), scene.items()
        insertion = insertion_of(scene, geometry, faces, settings)
        lists = filled(insertion, settings, cls.name, progress)
        drawn = no_lists()
        if settings.insert == RASTER:
            drawn = drawn_lists(
                insertion, settings.cells, settings.pixels, settings.dilation, progress
            )
        remembered = {PER_LIGHT: len(parts), PER_CELL: len(lists.children)}
        arrays = LightBufferArrays(
            faces, ends[:-1].astype(np.int32), lists, drawn,
            np.full(remembered.get(settings.last_occluder, 0), NONE, np.int32),
            settings.last_occluder == PER_CELL, insertion.slack, scene.diagonal,
        )  # fmt: skip
        return cls(scene, settings, arrays, insertion, geometry)

    @property
    def origin_of_face(self) -> np.ndarray:
        """Which light each face is of, (m,) int."""
        ends = np.append(self.arrays.first_face[1:], len(self.faces.origins))
        return np.repeat(np.arange(len(ends)), ends - self.arrays.first_face)

    @property
    def remembered(self) -> np.ndarray:
        """The last occluders."""
        return self.arrays.last


STRUCTURE = LightBuffer
