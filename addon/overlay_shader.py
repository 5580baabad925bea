"""GPU side of the overlay: the line shaders, and what they read from the graphics card.

Blender's Python has no per-instance vertex buffer, so boxes lie in a texture, two texels each, and
one unit cube is drawn once per box. Lines wider than one pixel are not portable (Metal and Vulkan
have none): every edge is a rectangle, made in the vertex shader to face the viewer, with an edge
that fades over one pixel instead of stairs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import gpu
import numpy as np

from ..core.colours import INNER_COLOUR, ramp

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ..core.structures.cells import Cells

TEXTURE_WIDTH = 4096
"""Texels in a row of the texture of boxes; even, and within the limits of every graphics card."""

RAMP_SIZE = 256
"""Colours in the texture of the ramp."""

EMPTY_OPACITY = 0.3
"""Opacity of empty cells, and of inner nodes when colouring by count, relative to the others."""

_VIEW_CONSTANTS = (("VEC2", "viewport"), ("FLOAT", "width"), ("FLOAT", "perspective"))

# `place` puts one corner of the rectangle around the edge from a to b, and tells how far across
# the edge it lies, in pixels. `corner` is (0 at a or 1 at b, -1 or 1 for the side).
_PLACE = """
vec4 place(vec3 a, vec3 b, vec2 corner, out float distance_across)
{
  vec4 p = ModelViewProjectionMatrix * vec4(a, 1.0);
  vec4 q = ModelViewProjectionMatrix * vec4(b, 1.0);
  distance_across = 0.0;

  // Cut at the near plane first: a point behind the eye has no place on the screen.
  float p_depth = p.z + p.w;
  float q_depth = q.z + q.w;
  if (p_depth <= 0.0 && q_depth <= 0.0) {
    return vec4(2.0, 2.0, 2.0, 1.0);
  }
  if (p_depth < 0.0) {
    p = mix(p, q, p_depth / (p_depth - q_depth));
  }
  if (q_depth < 0.0) {
    q = mix(q, p, q_depth / (q_depth - p_depth));
  }

  vec2 half_viewport = 0.5 * viewport;
  vec2 p_pixel = p.xy / p.w * half_viewport;
  vec2 q_pixel = q.xy / q.w * half_viewport;
  vec2 along = q_pixel - p_pixel;
  float pixels = length(along);
  along = (pixels > 1e-4) ? along / pixels : vec2(1.0, 0.0);
  vec2 across = vec2(-along.y, along.x);

  distance_across = corner.y * 0.5 * (width + 1.0);
  vec2 pixel = mix(p_pixel, q_pixel, corner.x);
  pixel += across * distance_across + along * (corner.x - 0.5) * width;
  float depth = mix(p.z / p.w, q.z / q.w, corner.x);

  // Towards the eye by a ten-thousandth of the distance: edges that lie in a face win against it.
  depth -= (perspective != 0.0) ? 1e-4 * (1.0 - depth) : 2e-6;
  return vec4(pixel / half_viewport, max(depth, -1.0), 1.0);
}
"""

_CELLS_VERTEX = """
void main()
{
  int texel = 2 * (first_cell + gl_InstanceID);
  ivec2 at = ivec2(texel % TEXTURE_WIDTH, texel / TEXTURE_WIDTH);
  vec4 lower = texelFetch(cells, at, 0);
  vec4 upper = texelFetch(cells, at + ivec2(1, 0), 0);
  gl_Position = place(
      mix(lower.xyz, upper.xyz, start), mix(lower.xyz, upper.xyz, end), corner, distance_across);

  // lower.w is the depth, upper.w the number of primitives, -1 for an inner node.
  float fraction = (by_count != 0) ? log(1.0 + max(upper.w, 0.0)) / log(1.0 + maximum) :
                                     lower.w / maximum;
  int step_of_ramp = int(clamp(fraction, 0.0, 1.0) * float(RAMP_SIZE - 1) + 0.5);
  line_colour = vec4(texelFetch(colours, ivec2(step_of_ramp, 0), 0).rgb, opacity);
  if (upper.w == 0.0) {
    line_colour.a *= EMPTY_OPACITY;
  }
  if (by_count != 0 && upper.w < 0.0) {
    line_colour = vec4(INNER_COLOUR, opacity * EMPTY_OPACITY);
  }
}
"""

_PATHS_VERTEX = """
void main()
{
  gl_Position = place(start, end, corner, distance_across);
  line_colour = vec4(colour.rgb, colour.a * opacity);
}
"""

# `srgbTarget` is set by Blender: whether the colours written are taken as linear.
_FRAGMENT = """
void main()
{
  float cover = clamp(0.5 * (width + 1.0) - abs(distance_across), 0.0, 1.0);
  vec3 rgb = line_colour.rgb;
  if (srgbTarget) {
    vec3 bright = pow((rgb + 0.055) / 1.055, vec3(2.4));
    rgb = mix(rgb / 12.92, bright, step(vec3(0.04045), rgb));
  }
  fragment = vec4(rgb, line_colour.a * cover);
}
"""


def _line_shader_info(vertex_source: str) -> tuple[gpu.types.GPUShaderCreateInfo, object]:
    """Return what both shaders have in common, and the interface object to keep alive."""
    interface = gpu.types.GPUStageInterfaceInfo("accelscope_line")
    interface.smooth("FLOAT", "distance_across")
    interface.flat("VEC4", "line_colour")
    info = gpu.types.GPUShaderCreateInfo()
    info.vertex_in(0, "VEC3", "start")
    info.vertex_in(1, "VEC3", "end")
    info.vertex_in(2, "VEC2", "corner")
    info.vertex_out(interface)
    info.fragment_out(0, "VEC4", "fragment")
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    for kind, name in _VIEW_CONSTANTS:
        info.push_constant(kind, name)
    info.push_constant("FLOAT", "opacity")
    info.push_constant("BOOL", "srgbTarget")
    info.vertex_source(_PLACE + vertex_source)
    info.fragment_source(_FRAGMENT)
    return info, interface


def cells_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws boxes from a texture."""
    info, interface = _line_shader_info(_CELLS_VERTEX)
    info.push_constant("INT", "first_cell")
    info.push_constant("INT", "by_count")
    info.push_constant("FLOAT", "maximum")
    info.sampler(0, "FLOAT_2D", "cells")
    info.sampler(1, "FLOAT_2D", "colours")
    info.define("TEXTURE_WIDTH", str(TEXTURE_WIDTH))
    info.define("RAMP_SIZE", str(RAMP_SIZE))
    info.define("EMPTY_OPACITY", str(EMPTY_OPACITY))
    info.define("INNER_COLOUR", "vec3({}, {}, {})".format(*INNER_COLOUR))
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def paths_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws coloured segments from a vertex buffer."""
    info, interface = _line_shader_info(_PATHS_VERTEX)
    info.vertex_in(3, "VEC4", "colour")
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def set_view(shader: gpu.types.GPUShader, line_width: float) -> None:
    """Set the uniforms that `place` and the fragment shader read, from the current view.

    Parameters
    ----------
    line_width : float
        In pixels; below 1 it means fainter lines, which the caller puts into the opacity.
    """
    projection = gpu.matrix.get_projection_matrix()
    shader.uniform_float("viewport", gpu.state.viewport_get()[2:])
    shader.uniform_float("width", max(line_width, 1.0))
    shader.uniform_float("perspective", 0.0 if projection[3][3] else 1.0)


# The corners of a rectangle around an edge, and its two triangles.
_CORNERS = np.array([(0, -1), (0, 1), (1, -1), (1, 1)], dtype=np.float32)
_TRIANGLES = np.array([(0, 1, 2), (2, 1, 3)], dtype=np.int32)

UNIT_CORNERS = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)], dtype=np.float32)
"""Corners of a box, (8, 3): 0 stands for its lower and 1 for its upper bound."""

EDGES = np.array(
    [(i, i | 1 << axis) for axis in range(3) for i in range(8) if not i & 1 << axis],
    dtype=np.int32,
)
"""Edges of a box, (12, 2), as pairs of corners."""


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
    attributes = [
        ("start", np.repeat(starts, 4, axis=0)),
        ("end", np.repeat(ends, 4, axis=0)),
        ("corner", np.tile(_CORNERS, (count, 1))),
    ]
    if colours is not None:
        attributes.append(("colour", np.repeat(colours, 4, axis=0)))
    layout = gpu.types.GPUVertFormat()
    for name, data in attributes:
        layout.attr_add(id=name, comp_type="F32", len=data.shape[1], fetch_mode="FLOAT")
    vertices = gpu.types.GPUVertBuf(layout, 4 * count)
    for name, data in attributes:
        # Any other type or layout is drawn silently wrong.
        vertices.attr_fill(name, np.ascontiguousarray(data, dtype=np.float32))
    triangles = (np.arange(count, dtype=np.int32)[:, None, None] * 4 + _TRIANGLES).reshape(-1, 3)
    indices = gpu.types.GPUIndexBuf(type="TRIS", seq=np.ascontiguousarray(triangles))
    return gpu.types.GPUBatch(type="TRIS", buf=vertices, elem=indices)


def cube_batch() -> gpu.types.GPUBatch:
    """Upload the edges of the unit cube, which the shader of cells stretches to every box."""
    return line_batch(UNIT_CORNERS[EDGES[:, 0]], UNIT_CORNERS[EDGES[:, 1]])


def cells_texture(cells: Cells, order: np.ndarray) -> gpu.types.GPUTexture:
    """Upload boxes, depths and counts of the cells ``order``, two texels each."""
    rows = -(-2 * max(len(order), 1) // TEXTURE_WIDTH)
    texels = np.zeros((rows * TEXTURE_WIDTH, 4), dtype=np.float32)
    pairs = texels[: 2 * len(order)].reshape(-1, 2, 4)
    pairs[:, :, :3] = cells.boxes[order].reshape(-1, 2, 3)
    pairs[:, 0, 3] = cells.depth[order]
    pairs[:, 1, 3] = np.where(cells.is_leaf[order], cells.count[order], -1)
    return _texture(texels.reshape(rows, TEXTURE_WIDTH, 4))


def ramp_texture() -> gpu.types.GPUTexture:
    """Upload the colour ramp."""
    texels = np.ones((1, RAMP_SIZE, 4), dtype=np.float32)
    texels[0, :, :3] = ramp(np.linspace(0.0, 1.0, RAMP_SIZE))
    return _texture(texels)


def _texture(texels: np.ndarray) -> gpu.types.GPUTexture:
    """Upload (rows, columns, 4) float32 as a texture."""
    rows, columns, _ = texels.shape
    data = gpu.types.Buffer("FLOAT", texels.size, texels.reshape(-1))
    return gpu.types.GPUTexture((columns, rows), format="RGBA32F", data=data)
