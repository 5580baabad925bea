"""What the overlay uploads: textures as :mod:`.drawable` has prepared them, and unit shapes."""

from __future__ import annotations

import gpu
import numpy as np

from ...core.colours import ramp
from ...core.geometry.box_shape import EDGES, UNIT_CORNERS
from .drawable import in_rows
from .overlay_shader import RAMP_SIZE

# The corners of a rectangle around an edge, and its two triangles.
_CORNERS = np.array([(0, -1), (0, 1), (1, -1), (1, 1)], dtype=np.float32)
_TRIANGLES = np.array([(0, 1, 2), (2, 1, 3)], dtype=np.int32)


SHARP = 960
"""Pixels in a row of an image, about, from which on its pixels need not be told apart."""

# -------------------------------------------------------------------------------------- textures


def texture(texels: np.ndarray) -> gpu.types.GPUTexture:
    """Upload texels (rows, width, 4) of float32."""
    rows, width, _ = texels.shape
    data = gpu.types.Buffer("FLOAT", texels.size, texels.reshape(-1))
    return gpu.types.GPUTexture((width, rows), format="RGBA32F", data=data)


def image_texture(pixels: np.ndarray) -> gpu.types.GPUTexture:
    """Upload an image (height, width, 3) whose first row is the upper one.

    One of few pixels is made larger first: what the graphics card puts between them is no pixel.
    """
    times = max(SHARP // pixels.shape[1], 1)
    pixels = pixels.repeat(times, axis=0).repeat(times, axis=1)
    texels = np.ones((*pixels.shape[:2], 4), dtype=np.float32)
    texels[..., :3] = pixels[::-1]
    return texture(np.ascontiguousarray(texels))


def ramp_texture() -> gpu.types.GPUTexture:
    """Upload the colour ramp, in one row."""
    texels = np.ones((RAMP_SIZE, 4), dtype=np.float32)
    texels[:, :3] = ramp(np.linspace(0.0, 1.0, RAMP_SIZE))
    return texture(in_rows(texels, RAMP_SIZE))


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


def pane_batch(triangles: np.ndarray, colours: np.ndarray) -> gpu.types.GPUBatch:
    """Upload triangles (m, 3, 3), each in a colour of its own, (m, 4)."""
    count = len(triangles)
    attributes = {"point": triangles.reshape(-1, 3), "colour": np.repeat(colours, 3, axis=0)}
    return _batch(3 * count, attributes, np.arange(3 * count).reshape(-1, 3))


def image_batch(left: float, bottom: float, right: float, top: float) -> gpu.types.GPUBatch:
    """Upload a rectangle on the screen, and which corner of an image belongs to which of its."""
    corners = np.array([(left, bottom), (left, top), (right, bottom), (right, top)])
    places = np.array([(0, 0), (0, 1), (1, 0), (1, 1)])
    return _batch(4, {"point": corners, "place": places}, _TRIANGLES)


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
