"""What the overlay uploads: batches of unit shapes, and the textures that place them.

- Boxes: two texels each, ``[lower, depth]`` and ``[upper, count]``, count -1 for an inner node;
  drawn as one unit cube per box.
- Edges of polyhedra, and of planes: the same two texels per edge, its ends in place of the lower
  and the upper corner; drawn as one diagonal of the unit cube per edge.
- Faces: three texels per triangle, its corners, with the depth and the step of the building.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import gpu
import numpy as np

from ..core.colours import ramp
from ..core.outlines import (
    EDGES,
    UNIT_CORNERS,
    division_steps,
    faces_of,
    outlines_of,
    triangles_of,
    wires_of,
)
from .overlay_shader import RAMP_SIZE, TEXTURE_WIDTH

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

NEVER = 1e9
"""A step of the building that never comes; single precision must hold it."""

# The corners of a rectangle around an edge, and its two triangles.
_CORNERS = np.array([(0, -1), (0, 1), (1, -1), (1, 1)], dtype=np.float32)
_TRIANGLES = np.array([(0, 1, 2), (2, 1, 3)], dtype=np.int32)


class Lines(NamedTuple):
    """Boxes, or edges of other shapes, on the graphics card.

    Attributes
    ----------
    cells, steps : GPUTexture
        Two texels, and one, for each shape that is drawn.
    starts : (n + 1,) int64
        Shapes of item i (a cell or a plane) are starts[i] ... starts[i + 1] - 1.
    are_boxes : bool
        Whether the shapes are boxes or edges.
    """

    cells: gpu.types.GPUTexture
    steps: gpu.types.GPUTexture
    starts: np.ndarray
    are_boxes: bool


class Faces(NamedTuple):
    """Triangles on the graphics card.

    Attributes
    ----------
    faces : GPUTexture
        Three texels for each.
    starts : (n + 1,) int64
        Triangles of item i (a cell or a plane) are starts[i] ... starts[i + 1] - 1.
    areas : (m,) float64
    steps : (m,) float32
        Of every triangle: its area, and the step of the building in which it appears.
    """

    faces: gpu.types.GPUTexture
    starts: np.ndarray
    areas: np.ndarray
    steps: np.ndarray

    def area(self, first: int, last: int, step: int | None) -> float:
        """Return the area of the items first ... last - 1, as far as they are there by a step."""
        piece = slice(self.starts[first], self.starts[last])
        there = 1.0 if step is None else self.steps[piece] <= step
        return float((self.areas[piece] * there).sum())


class Steps(NamedTuple):
    """When cells were made and divided, (n,) float32 each; all zero where nobody knows."""

    made: np.ndarray
    divided: np.ndarray


def steps_of(cells: Cells) -> Steps:
    """Return when each cell was made and divided."""
    if "order" not in cells.extra:
        nothing = np.zeros(len(cells), dtype=np.float32)
        return Steps(nothing, nothing)
    divided = np.minimum(division_steps(cells), NEVER)
    return Steps(cells.extra["order"].astype(np.float32), divided.astype(np.float32))


# ------------------------------------------------------------------------------- what is uploaded


def cell_lines(cells: Cells, order: np.ndarray, steps: Steps) -> Lines:
    """Upload the edges of the cells `order`."""
    leaf_count = np.where(cells.is_leaf, cells.count, -1)
    if cells.faces is None:
        ends = cells.boxes[order].reshape(-1, 2, 3)
        owners, starts = order, np.arange(len(order) + 1)
    else:
        wires = wires_of(cells, np.sort(order))
        position = np.empty(len(cells), dtype=np.int64)
        position[order] = np.arange(len(order))
        owners = wires.edge_owners()
        wanted = np.argsort(position[owners], kind="stable")
        ends, owners = wires.segments()[wanted], owners[wanted]
        starts = np.searchsorted(position[owners], np.arange(len(order) + 1))
    return Lines(
        _ends_texture(ends, cells.depth[owners], leaf_count[owners]),
        _steps_texture(steps.made[owners], steps.divided[owners]),
        starts,
        cells.faces is None,
    )


def plane_lines(cells: Cells, steps: Steps, most: int) -> Lines:
    """Upload the outlines of the first so many planes."""
    assert cells.planes is not None
    starts = cells.planes.offsets[: most + 1]
    wires = outlines_of(cells.planes)
    ends, owners = wires.segments()[: starts[-1]], wires.edge_owners()[: starts[-1]]
    # A plane is there from the step on that divides its cell, and is divided by none.
    return Lines(
        _ends_texture(ends, cells.depth[owners], np.full(len(owners), -1)),
        _steps_texture(steps.divided[owners], np.full(len(owners), NEVER)),
        starts,
        False,
    )


def plane_faces(cells: Cells, steps: Steps, most: int) -> Faces:
    """Upload the first so many planes."""
    assert cells.planes is not None
    triangles, owners = triangles_of(cells.planes)
    per_plane = np.maximum(np.diff(cells.planes.offsets) - 2, 0)[:most]
    starts = np.concatenate([[0], np.cumsum(per_plane)])
    triangles, owners = triangles[: starts[-1]], owners[: starts[-1]]
    return _faces(triangles, cells.depth[owners], steps.divided[owners], starts)


def cell_faces(cells: Cells, places: np.ndarray, steps: Steps) -> Faces:
    """Upload the faces of the cells `places`, which are ascending."""
    triangles, owners = faces_of(cells, places)
    starts = np.searchsorted(owners, np.append(places, len(cells)))
    return _faces(triangles, cells.depth[owners], steps.made[owners], starts)


# -------------------------------------------------------------------------------------- textures


def _ends_texture(ends: np.ndarray, depth: np.ndarray, count: np.ndarray) -> gpu.types.GPUTexture:
    """Upload both ends of shapes, (n, 2, 3), with their depths and counts."""
    texels = np.empty((len(ends), 2, 4), dtype=np.float32)
    texels[:, :, :3] = ends
    texels[:, 0, 3] = depth
    texels[:, 1, 3] = count
    return _texture(texels)


def _steps_texture(made: np.ndarray, divided: np.ndarray) -> gpu.types.GPUTexture:
    """Upload when shapes were made and divided; a single texel where nobody knows."""
    if not made.any():
        return _texture(np.zeros((1, 4), dtype=np.float32))
    texels = np.zeros((len(made), 4), dtype=np.float32)
    texels[:, 0] = made
    texels[:, 1] = divided
    return _texture(texels)


def _faces(
    triangles: np.ndarray, depth: np.ndarray, steps: np.ndarray, starts: np.ndarray
) -> Faces:
    """Upload triangles (m, 3, 3) with their depths and the steps in which they appear."""
    texels = np.zeros((len(triangles), 3, 4), dtype=np.float32)
    texels[:, :, :3] = triangles
    texels[:, 0, 3] = depth
    texels[:, 1, 3] = steps
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return Faces(_texture(texels), starts, areas, steps)


def ramp_texture() -> gpu.types.GPUTexture:
    """Upload the colour ramp, in one row."""
    texels = np.ones((RAMP_SIZE, 4), dtype=np.float32)
    texels[:, :3] = ramp(np.linspace(0.0, 1.0, RAMP_SIZE))
    return _texture(texels, RAMP_SIZE)


def _texture(texels: np.ndarray, width: int = TEXTURE_WIDTH) -> gpu.types.GPUTexture:
    """Upload texels (..., 4) of float32, row by row."""
    rows = max(-(-texels.size // (4 * width)), 1)
    whole = np.zeros(rows * width * 4, dtype=np.float32)
    whole[: texels.size] = texels.ravel()
    data = gpu.types.Buffer("FLOAT", whole.size, whole)
    return gpu.types.GPUTexture((width, rows), format="RGBA32F", data=data)


# --------------------------------------------------------------------------------------- batches


def cube_batch() -> gpu.types.GPUBatch:
    """Upload the edges of the unit cube, which the shader of cells stretches to every box."""
    return line_batch(UNIT_CORNERS[EDGES[:, 0]], UNIT_CORNERS[EDGES[:, 1]])


def edge_batch() -> gpu.types.GPUBatch:
    """Upload the diagonal of the unit cube, which the shader of cells stretches to every edge."""
    return line_batch(UNIT_CORNERS[:1], UNIT_CORNERS[7:])


def triangle_batch() -> gpu.types.GPUBatch:
    """Upload one triangle in barycentric coordinates."""
    return _batch(3, {"corner": np.eye(3)}, np.array([[0, 1, 2]]))


def line_batch(
    starts: np.ndarray, ends: np.ndarray, colours: np.ndarray | None = None
) -> gpu.types.GPUBatch:
    """Upload segments as rectangles that are still to be placed.

    Parameters
    ----------
    starts, ends : (k, 3) float
    colours : (k, 4) float, optional
        Only the shader of paths has them.
    """
    count = len(starts)
    attributes = {
        "start": np.repeat(starts, 4, axis=0),
        "end": np.repeat(ends, 4, axis=0),
        "corner": np.tile(_CORNERS, (count, 1)),
    }
    if colours is not None:
        attributes["colour"] = np.repeat(colours, 4, axis=0)
    triangles = np.arange(count)[:, None, None] * 4 + _TRIANGLES
    return _batch(4 * count, attributes, triangles.reshape(-1, 3))


def _batch(
    count: int, attributes: dict[str, np.ndarray], triangles: np.ndarray
) -> gpu.types.GPUBatch:
    """Upload triangles over vertices with attributes (count, k)."""
    layout = gpu.types.GPUVertFormat()
    for name, data in attributes.items():
        layout.attr_add(id=name, comp_type="F32", len=data.shape[1], fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, count)
    for name, data in attributes.items():
        # Any other type or layout is drawn silently wrong.
        vertices.attr_fill(name, np.ascontiguousarray(data, dtype=np.float32))
    indices = np.ascontiguousarray(triangles, dtype=np.int32)
    return gpu.types.GPUBatch(
        type="TRIS", buf=vertices, elem=gpu.types.GPUIndexBuf(type="TRIS", seq=indices)
    )
