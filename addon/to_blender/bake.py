"""Bake: cells as a real mesh object, to keep, to render and to build nodes on.

What it consists of is computed in any thread, AT_ONCE cells at a time; the object is made of it in
Blender's thread, one array at a time. So nothing holds Blender up for longer than it takes to clear
the memory of one: of the colours of 1.4 million boxes, the longest, 0.07 to 0.6 s of its time.
"""

from __future__ import annotations

import contextlib
from collections.abc import Generator
from typing import TYPE_CHECKING, Any, NamedTuple

import bpy
import numpy as np

from ...core.colours import INNER_COLOUR, count_colours, depth_colours, ramp
from ...core.contract.outlines import wires_of
from ...core.errors import InputError
from ...core.memory import refuse_if_too_large
from ...core.progress import SILENT, Progress
from ..drawing.overlay_shader import EMPTY_OPACITY
from ..drawing.selection import Shown, colour_maximum, coloured_by, visible

if TYPE_CHECKING:
    from ..drawing.drawable import Drawable

COLLECTION = "AccelScope"

AT_ONCE = 20_000
"""Cells that are computed between two looks at whether that is cancelled."""

BYTES_PER_CELL = 1200  # at the peak, of boxes


class Edges(NamedTuple):
    """A mesh without faces, as Blender takes it.

    Attributes
    ----------
    points : (3 n,) float32
    ends : (2 m,) int32
        Pairs of points.
    attributes : dict
        Blender's type, the field of its values, and those of all points, by name.
    """

    points: np.ndarray
    ends: np.ndarray
    attributes: dict[str, tuple[str, str, np.ndarray]]

    @property
    def n_edges(self) -> int:
        """How many edges there are."""
        return len(self.ends) // 2


ATTRIBUTES = {
    "number": ("INT", "value", np.int32),
    "depth": ("INT", "value", np.int32),
    "count": ("INT", "value", np.int32),
    "is_leaf": ("BOOLEAN", "value", np.bool_),
    "colour": ("FLOAT_COLOR", "color", np.float32),
}
"""What every point carries: Blender's type, the field of its values, and NumPy's type."""


def edges_of(drawable: Drawable, shown: Shown, progress: Progress = SILENT) -> Edges:
    """Return the edges of all cells that display settings show.

    Its points carry the attributes number, depth, count (int), is_leaf (bool) and colour (float
    colour), as the overlay shows them, for shaders, geometry nodes and the spreadsheet. Cells that
    are no boxes are baked as the polyhedra they are.

    Raises
    ------
    InputError
        When the display settings show no cell, or more than memory holds.
    Cancelled
        From `progress`.
    """
    cells = drawable.cells
    places = np.flatnonzero(visible(cells, shown))
    if len(places) == 0:
        raise InputError("the display settings show no cell to bake; widen the depth range")
    refuse_if_too_large(
        len(places) * BYTES_PER_CELL,
        f"baking {len(places)} cells",
        "narrow the depth range or hide empty cells",
    )
    points, ends = [], []
    values: dict[str, list[np.ndarray]] = {name: [] for name in ATTRIBUTES}
    n_points = 0
    for first in range(0, len(places), AT_ONCE):
        progress.report(first, len(places), "Finding edges")
        some = places[first : first + AT_ONCE]
        wires = wires_of(cells, some)
        ranks = np.searchsorted(some, wires.owners)
        per_cell = {
            "number": cells.numbers[some],
            "depth": cells.depth[some],
            "count": cells.count[some],
            "is_leaf": cells.is_leaf[some],
            "colour": _colours(drawable, some, shown),
        }
        points.append(wires.points.astype(np.float32).ravel())
        ends.append((wires.edges + n_points).astype(np.int32).ravel())
        n_points += len(wires.points)
        for name, (_, _, kind) in ATTRIBUTES.items():
            values[name].append(per_cell[name][ranks].astype(kind).ravel())
    attributes = {}
    for done, (name, (blender, key, _)) in enumerate(ATTRIBUTES.items()):
        progress.report(done, len(ATTRIBUTES), "Joining what was found")
        attributes[name] = blender, key, np.concatenate(values.pop(name))
    return Edges(np.concatenate(points), np.concatenate(ends), attributes)


def _colours(drawable: Drawable, places: np.ndarray, shown: Shown) -> np.ndarray:
    """Return the colours of some cells as the overlay shows them, (n, 4), linear."""
    cells, extent = drawable.cells, drawable.extent
    maximum = colour_maximum(extent, shown)
    is_leaf, count = cells.is_leaf[places], cells.count[places]
    faint = is_leaf & (count == 0)
    colouring = coloured_by(extent, shown)
    if colouring == "count":
        rgb = count_colours(count, maximum)
        rgb[~is_leaf] = INNER_COLOUR
        faint |= ~is_leaf
    elif colouring == "order":
        rgb = ramp(cells.extra["order"][places] / max(maximum, 1))
    else:
        rgb = depth_colours(cells.depth[places], maximum)
    alpha = np.where(faint, shown.opacity * EMPTY_OPACITY, shown.opacity)
    return _linear(np.column_stack([rgb, alpha]))


def _linear(colours: np.ndarray) -> np.ndarray:
    """Return (n, 4) sRGB colours as Blender's attributes hold them: linear, opacity unchanged."""
    rgb, alpha = colours[:, :3], colours[:, 3:]
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.concatenate([linear, alpha], axis=1)


# -------------------------------------------------------------------------------- the object


def edges_of_path(segments: np.ndarray, colours: np.ndarray) -> Edges:
    """Return the segments, (k, 2, 3), of a recorded ray or cone, with their colours, (k, 4)."""
    colour = _linear(np.repeat(colours, 2, axis=0)).astype(np.float32)
    return Edges(
        segments.astype(np.float32).ravel(), np.arange(2 * len(segments), dtype=np.int32),
        {"colour": (*ATTRIBUTES["colour"][:2], colour.ravel())},
    )  # fmt: skip


def steps_of(edges: Edges) -> int:
    """Return in how many steps :func:`making` makes an object."""
    return 4 + 2 * len(edges.attributes)


def making(scene: bpy.types.Scene, edges: Edges, name: str) -> Generator[None, None, Any]:
    """Make a mesh object of edges, step by step; return it, linked into the scene.

    It is in the collection "AccelScope", which is made if it is missing. An object that is not
    finished, because the generator is closed, is taken away again.

    Parameters
    ----------
    name : str
        Of the object; Blender adds a number to one that exists.
    """
    mesh = bpy.data.meshes.new(name)
    try:
        mesh.vertices.add(len(edges.points) // 3)
        yield
        mesh.attributes["position"].data.foreach_set("vector", edges.points)
        yield
        mesh.edges.add(edges.n_edges)
        yield
        mesh.attributes[".edge_verts"].data.foreach_set("value", edges.ends)
        yield
        for key, (kind, field, values) in edges.attributes.items():
            mesh.attributes.new(key, kind, "POINT")
            yield
            mesh.attributes[key].data.foreach_set(field, values)
            yield
        mesh.update()
        # What the viewport shows when its objects are coloured by attribute.
        mesh.attributes.active_color_name = "colour"
        made = bpy.data.objects.new(name, mesh)
        _collection(scene).objects.link(made)
    except BaseException:
        with contextlib.suppress(ReferenceError):  # Blender has it no more
            bpy.data.meshes.remove(mesh)
        raise
    return made


def _collection(scene: bpy.types.Scene) -> Any:
    """Return a scene's collection for what is baked; make it if it is missing."""
    top = scene.collection
    for collection in top.children_recursive:
        # With a number behind the name if another scene has one, too.
        if collection.name.split(".")[0] == COLLECTION and collection.library is None:
            return collection
    collection = bpy.data.collections.new(COLLECTION)
    top.children.link(collection)
    return collection
