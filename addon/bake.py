"""Bake: cells as a real mesh object, to keep, to render and to build nodes on."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import bpy
import numpy as np

from ..core.colours import INNER_COLOUR, count_colours, depth_colours, ramp
from ..core.errors import InputError
from ..core.memory import refuse_if_too_large
from ..core.outlines import wires_of
from .overlay_shader import EMPTY_OPACITY
from .selection import colour_maximum, coloured_by, extent_of, visible

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

COLLECTION = "AccelScope"


def bake_cells(context: bpy.types.Context, cells: Cells, display: Any, name: str) -> Any:
    """Make one mesh of the edges of all cells that the display settings show.

    Its points carry the attributes number, depth, count (int), is_leaf (bool) and colour (float
    colour), as the overlay shows them, for shaders, geometry nodes and the spreadsheet. Cells that
    are no boxes are baked as the polyhedra they are.

    Parameters
    ----------
    display : object
        Attributes depth_min, depth_max, leaves_only, hide_empty, replay, step, opacity, colour_by.
    name : str
        Of the object; Blender adds a number to one that exists.

    Returns
    -------
    bpy.types.Object
        In the collection "AccelScope", which is made if it is missing.

    Raises
    ------
    InputError
        When the display settings show no cell, or more than memory holds.
    """
    shown = np.flatnonzero(visible(cells, display))
    if len(shown) == 0:
        raise InputError("the display settings show no cell to bake; widen the depth range")
    refuse_if_too_large(
        len(shown) * 1200,
        f"baking {len(shown)} cells",
        "narrow the depth range or hide empty cells",
    )
    wires = wires_of(cells, shown)
    attributes = {
        "number": ("INT", cells.numbers[wires.owners]),
        "depth": ("INT", cells.depth[wires.owners]),
        "count": ("INT", cells.count[wires.owners]),
        "is_leaf": ("BOOLEAN", cells.is_leaf[wires.owners]),
        "colour": ("FLOAT_COLOR", _colours(cells, display)[wires.owners]),
    }
    return _edges_object(context, name, wires.points, wires.edges, attributes)


def _colours(cells: Cells, display: Any) -> np.ndarray:
    """Return the colour of every cell as the overlay shows it, (n, 4), linear."""
    extent = extent_of(cells)
    maximum = colour_maximum(extent, display)
    faint = cells.is_leaf & (cells.count == 0)
    colouring = coloured_by(extent, display)
    if colouring == "count":
        rgb = count_colours(cells.count, maximum)
        rgb[~cells.is_leaf] = INNER_COLOUR
        faint |= ~cells.is_leaf
    elif colouring == "order":
        rgb = ramp(cells.extra["order"] / max(maximum, 1))
    else:
        rgb = depth_colours(cells.depth, maximum)
    alpha = np.where(faint, display.opacity * EMPTY_OPACITY, display.opacity)
    return _linear(np.column_stack([rgb, alpha]))


def _linear(colours: np.ndarray) -> np.ndarray:
    """Return (n, 4) sRGB colours as Blender's attributes hold them: linear, opacity unchanged."""
    rgb, alpha = colours[:, :3], colours[:, 3:]
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    return np.concatenate([linear, alpha], axis=1)


def _edges_object(
    context: bpy.types.Context,
    name: str,
    points: np.ndarray,
    edges: np.ndarray,
    attributes: dict[str, tuple[str, np.ndarray]],
) -> Any:
    """Make a mesh object without faces.

    Parameters
    ----------
    points : (..., 3) float
    edges : (...,) int
        Pairs of points.
    attributes : dict
        Blender's type and one value per point, by name.
    """
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(points.size // 3)
    mesh.vertices.foreach_set("co", np.ascontiguousarray(points, dtype=np.float32).ravel())
    mesh.edges.add(edges.size // 2)
    mesh.edges.foreach_set("vertices", np.ascontiguousarray(edges, dtype=np.int32).ravel())
    for key, (kind, values) in attributes.items():
        attribute = mesh.attributes.new(key, kind, "POINT")
        if kind == "FLOAT_COLOR":
            attribute.data.foreach_set("color", values.astype(np.float32).ravel())
        else:
            attribute.data.foreach_set("value", values)
    mesh.update()
    # What the viewport shows when its objects are coloured by attribute.
    mesh.attributes.active_color_name = "colour"
    made = bpy.data.objects.new(name, mesh)
    _collection(context).objects.link(made)
    return made


def _collection(context: bpy.types.Context) -> Any:
    """Return this scene's collection for what is baked; make it if it is missing."""
    top = context.scene.collection
    for collection in top.children_recursive:
        # With a number behind the name if another scene has one, too.
        if collection.name.split(".")[0] == COLLECTION and collection.library is None:
            return collection
    collection = bpy.data.collections.new(COLLECTION)
    top.children.link(collection)
    return collection
