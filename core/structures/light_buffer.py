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
from typing import NamedTuple

import numpy as np

from ..contract.needs import GEOMETRY, LIGHTS
from ..contract.walk import walk
from ..errors import InputError
from ..kernels import implements, whole
from ..progress import SILENT, Progress
from ..scene import LIGHT_KINDS, SUN, Scene
from ..scene.camera_rays import SHADOW
from ..settings import setting
from .directional.faces import Faces, cube, joined_faces, plane_before_sun
from .directional.lists import NONE, NOT_DRAWN, Lists, cell_at
from .directional.raster import with_drawn
from .directional.settings import UNIFORM, DirectionalSettings, insert_setting
from .directional.structure import Directional, filled, insertion_of
from .directional.walk import Seen, seen_by, sight_of, stranger, walk_cells

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
    lists : Lists
        In which nothing is missing; behind their references what was drawn.
    drawn : (n_cells + 1,) int64
        Where that begins, cell by cell; empty where nothing was.
    last : (k,) int32
        The last occluder of every light, or cell; without any, nothing is remembered.
    per_cell : bool
    slack, extent : float
        How far a ray may pass off its light; how large the scene is.
    """

    faces: Faces
    first_face: np.ndarray
    lists: Lists
    drawn: np.ndarray
    last: np.ndarray
    per_cell: bool
    slack: float
    extent: float


@implements(seen_by, LightBufferArrays, inline=True)
def seen_by_light(structure, ray):
    """Return what is known of a ray to the light that it goes to."""
    slack, light = structure.slack, whole(ray.target)
    if light < 0 or light >= len(structure.first_face):
        return stranger()
    first = whole(structure.first_face[light])
    sight = sight_of(structure.faces, first, True, -1.0, structure.extent, ray)
    # It ends at a light that has a place, and never reaches a sun.
    is_beyond = not (ray.t_max - sight.t) * sight.length <= slack
    if not sight.off <= slack * slack or (is_beyond and not structure.faces.is_parallel[first]):
        return stranger()
    cell, place = whole(NONE), whole(NONE)
    if abs(sight.u) <= 1.0 and abs(sight.v) <= 1.0:
        cell = cell_at(structure.lists, sight.face, sight.u, sight.v)
    if len(structure.last) > 0:
        place = cell if structure.per_cell else light
    return Seen(cell, True, (sight.t - ray.t_min) * sight.length + slack, 0.0, place)


implements(walk, LightBufferArrays, inline=True)(walk_cells)


class LightBuffer(Directional):
    """A directional cube in every light."""

    name = "light_buffer"
    label = "Light Buffer"
    summary = "A directional cube in every light, for shadow rays"
    Settings = LightBufferSettings
    answers = (SHADOW,)
    needs = frozenset({GEOMETRY, LIGHTS})

    arrays: LightBufferArrays

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
        drawn = NOT_DRAWN
        if settings.insert == RASTER:
            lists, drawn = with_drawn(
                lists, insertion, settings.pixels, settings.dilation, progress
            )  # fmt: skip
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

    def drawn_into(self, cell: int) -> np.ndarray:
        """Return what was drawn into a cell, (k,): places in the geometry, the nearest first."""
        drawn: np.ndarray = self.arrays.drawn
        items: np.ndarray = self.lists.references[int(drawn[cell]) : int(drawn[cell + 1])]
        return items

    @property
    def remembered(self) -> np.ndarray:
        """The last occluders."""
        return self.arrays.last


STRUCTURE = LightBuffer
