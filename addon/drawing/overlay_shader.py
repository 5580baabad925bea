"""The shaders of the overlay: lines of any width, and translucent faces.

Blender's Python has no per-instance vertex buffer, so boxes lie in a texture, two texels each, and
one unit cube is drawn once per box (see :mod:`.overlay_upload`). Lines wider than one pixel are not
portable (Metal and Vulkan have none): every edge is a rectangle, made in the vertex shader to face
the viewer, with an edge that fades over one pixel instead of stairs.

A second texture holds the step of the building in which each cell was made, or plane appeared: four
to a texel.
"""

from __future__ import annotations

import gpu

from ...core.colours import INNER_COLOUR
from .drawable import TEXTURE_WIDTH

RAMP_SIZE = 256
"""Colours in the texture of the ramp."""

COLOURINGS = {"depth": 0, "count": 1, "order": 2, "plain": 3}
"""What a colour is made of, as the shaders know it."""

EMPTY_OPACITY = 0.3
"""Opacity of empty cells, and of inner nodes when colouring by count, relative to the others."""

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
    return NOWHERE;
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

# Texel number i of a texture, and a colour of the ramp.
_FETCH = """
#define TEXEL(data, i) texelFetch(data, ivec2((i) % TEXTURE_WIDTH, (i) / TEXTURE_WIDTH), 0)

vec3 ramp_colour(float fraction)
{
  int texel = int(clamp(fraction, 0.0, 1.0) * float(RAMP_SIZE - 1) + 0.5);
  return texelFetch(colours, ivec2(texel, 0), 0).rgb;
}
"""

_CELLS_VERTEX = """
void main()
{
  int item = first + gl_InstanceID;
  vec4 lower = TEXEL(cells, 2 * item);
  vec4 upper = TEXEL(cells, 2 * item + 1);
  gl_Position = place(
      mix(lower.xyz, upper.xyz, start), mix(lower.xyz, upper.xyz, end), corner, distance_across);

  // lower.w is the depth, upper.w the number of primitives, -1 for an inner node.
  float fraction = lower.w / maximum;
  if (coloured_by == BY_COUNT) {
    fraction = log(1.0 + max(upper.w, 0.0)) / log(1.0 + maximum);
  }
  if (coloured_by == BY_ORDER) {
    fraction = TEXEL(steps, item / 4)[item % 4] / maximum;
  }
  line_colour = vec4(ramp_colour(fraction), opacity);
  if (upper.w == 0.0) {
    line_colour.a *= EMPTY_OPACITY;
  }
  if (coloured_by == BY_COUNT && upper.w < 0.0) {
    line_colour = vec4(INNER_COLOUR, opacity * EMPTY_OPACITY);
  }
}
"""

_FACES_VERTEX = """
void main()
{
  int item = first + gl_InstanceID;
  vec4 a = TEXEL(faces, 3 * item);
  vec4 b = TEXEL(faces, 3 * item + 1);
  vec4 c = TEXEL(faces, 3 * item + 2);
  vec3 point = a.xyz * corner.x + b.xyz * corner.y + c.xyz * corner.z;
  gl_Position = ModelViewProjectionMatrix * vec4(point, 1.0);

  // Towards the eye, so that a face within a surface is seen; half as far as edges are.
  gl_Position.z -= (perspective != 0.0) ? 0.5e-4 * (gl_Position.w - gl_Position.z) :
                                          1e-6 * gl_Position.w;

  // a.w is the depth, b.w the step of the building in which the face appears.
  face_colour = vec4(plain_colour, opacity);
  if (coloured_by == BY_DEPTH) {
    face_colour.rgb = ramp_colour(a.w / maximum);
  }
  if (coloured_by == BY_ORDER) {
    face_colour.rgb = ramp_colour(b.w / maximum);
  }
}
"""

# On a bright background, bright colours are as dark as `brightest` says.
_LIMIT = """
vec3 limited(vec3 rgb)
{
  float luminance = dot(rgb, vec3(0.2126, 0.7152, 0.0722));
  return rgb * min(1.0, brightest / max(luminance, 1e-3));
}
"""

_PATHS_VERTEX = """
void main()
{
  gl_Position = place(start, end, corner, distance_across);
  line_colour = vec4(limited(colour.rgb), colour.a * opacity);
}
"""

_PANES_VERTEX = """
void main()
{
  gl_Position = ModelViewProjectionMatrix * vec4(point, 1.0);
  gl_Position.z -= (perspective != 0.0) ? 2e-4 * (gl_Position.w - gl_Position.z) :
                                          4e-6 * gl_Position.w;
  face_colour = vec4(limited(colour.rgb), colour.a * opacity);
}
"""

_IMAGE_VERTEX = """
void main()
{
  gl_Position = ModelViewProjectionMatrix * vec4(point, 0.0, 1.0);
  place_in_image = place;
}
"""

# `srgbTarget` is set by Blender: whether the colours written are taken as linear.
_AS_TARGET = """
vec3 as_target(vec3 rgb)
{
  if (!srgbTarget) {
    return rgb;
  }
  vec3 bright = pow((rgb + 0.055) / 1.055, vec3(2.4));
  return mix(rgb / 12.92, bright, step(vec3(0.04045), rgb));
}
"""

_LINES_FRAGMENT = """
void main()
{
  float cover = clamp(0.5 * (width + 1.0) - abs(distance_across), 0.0, 1.0);
  fragment = vec4(as_target(line_colour.rgb), line_colour.a * cover);
}
"""

_FACES_FRAGMENT = """
void main()
{
  fragment = vec4(as_target(face_colour.rgb), face_colour.a);
}
"""

_IMAGE_FRAGMENT = """
void main()
{
  fragment = vec4(as_target(texture(image, place_in_image).rgb), 1.0);
}
"""


def _shader_info(vertex_source: str, fragment_source: str) -> gpu.types.GPUShaderCreateInfo:
    """Return what all shaders have in common."""
    info = gpu.types.GPUShaderCreateInfo()
    info.fragment_out(0, "VEC4", "fragment")
    info.push_constant("MAT4", "ModelViewProjectionMatrix")
    info.push_constant("FLOAT", "perspective")
    info.push_constant("FLOAT", "opacity")
    info.push_constant("BOOL", "srgbTarget")
    info.define("NOWHERE", "vec4(2.0, 2.0, 2.0, 1.0)")
    info.vertex_source(vertex_source)
    info.fragment_source(_AS_TARGET + fragment_source)
    return info


def _line_shader_info(vertex_source: str) -> tuple[gpu.types.GPUShaderCreateInfo, object]:
    """Return what both shaders of lines have in common, and the interface to keep alive."""
    interface = gpu.types.GPUStageInterfaceInfo("accelscope_line")
    interface.smooth("FLOAT", "distance_across")
    interface.flat("VEC4", "line_colour")
    info = _shader_info(_PLACE + vertex_source, _LINES_FRAGMENT)
    info.vertex_in(0, "VEC3", "start")
    info.vertex_in(1, "VEC3", "end")
    info.vertex_in(2, "VEC2", "corner")
    info.vertex_out(interface)
    info.push_constant("VEC2", "viewport")
    info.push_constant("FLOAT", "width")
    return info, interface


def _read_textures(info: gpu.types.GPUShaderCreateInfo, *textures: str) -> None:
    """Add what the shaders need that read cells or faces from a texture."""
    for name in ("first", "coloured_by"):
        info.push_constant("INT", name)
    info.push_constant("FLOAT", "maximum")
    for slot, name in enumerate((*textures, "colours")):
        info.sampler(slot, "FLOAT_2D", name)
    info.define("TEXTURE_WIDTH", str(TEXTURE_WIDTH))
    info.define("RAMP_SIZE", str(RAMP_SIZE))
    for name, number in COLOURINGS.items():
        info.define(f"BY_{name.upper()}", str(number))


def cells_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws boxes, or segments, from a texture."""
    info, interface = _line_shader_info(_FETCH + _CELLS_VERTEX)
    _read_textures(info, "cells", "steps")
    info.define("EMPTY_OPACITY", str(EMPTY_OPACITY))
    info.define("INNER_COLOUR", "vec3({}, {}, {})".format(*INNER_COLOUR))
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def faces_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws translucent triangles from a texture."""
    interface = gpu.types.GPUStageInterfaceInfo("accelscope_face")
    interface.flat("VEC4", "face_colour")
    info = _shader_info(_FETCH + _FACES_VERTEX, _FACES_FRAGMENT)
    info.vertex_in(0, "VEC3", "corner")
    info.vertex_out(interface)
    _read_textures(info, "faces")
    info.push_constant("VEC3", "plain_colour")
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def paths_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws coloured segments from a vertex buffer."""
    info, interface = _line_shader_info(_LIMIT + _PATHS_VERTEX)
    info.vertex_in(3, "VEC4", "colour")
    info.push_constant("FLOAT", "brightest")
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def panes_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws coloured triangles from a vertex buffer."""
    interface = gpu.types.GPUStageInterfaceInfo("accelscope_pane")
    interface.flat("VEC4", "face_colour")
    info = _shader_info(_LIMIT + _PANES_VERTEX, _FACES_FRAGMENT)
    info.vertex_in(0, "VEC3", "point")
    info.vertex_in(1, "VEC4", "colour")
    info.vertex_out(interface)
    info.push_constant("FLOAT", "brightest")
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def image_shader() -> gpu.types.GPUShader:
    """Compile the shader that draws an image onto the screen."""
    interface = gpu.types.GPUStageInterfaceInfo("accelscope_image")
    interface.smooth("VEC2", "place_in_image")
    info = _shader_info(_IMAGE_VERTEX, _IMAGE_FRAGMENT)
    info.vertex_in(0, "VEC2", "point")
    info.vertex_in(1, "VEC2", "place")
    info.vertex_out(interface)
    info.sampler(0, "FLOAT_2D", "image")
    shader = gpu.shader.create_from_info(info)
    del interface
    return shader


def set_view(shader: gpu.types.GPUShader, line_width: float | None = None) -> None:
    """Set the uniforms that depend on the current view.

    Parameters
    ----------
    line_width : float, optional
        In pixels; below 1 it means fainter lines, which the caller puts into the opacity. Only
        the shaders of lines have it.
    """
    projection = gpu.matrix.get_projection_matrix()
    shader.uniform_float("perspective", 0.0 if projection[3][3] else 1.0)
    if line_width is not None:
        shader.uniform_float("viewport", gpu.state.viewport_get()[2:])
        shader.uniform_float("width", max(line_width, 1.0))


def draw_twice(
    shader: gpu.types.GPUShader,
    batch: gpu.types.GPUBatch,
    hidden: float,
    brightest: float = 1.0,
) -> None:
    """Draw lines or faces, faint where they lie behind something.

    The shader is bound and knows its view.

    Parameters
    ----------
    hidden : float
        Opacity of what lies behind something.
    brightest : float
        Luminance that colours have at most.
    """
    shader.uniform_float("brightest", brightest)
    for depth_test, opacity in (("GREATER", hidden), ("LESS_EQUAL", 1.0)):
        gpu.state.depth_test_set(depth_test)
        shader.uniform_float("opacity", opacity)
        batch.draw(shader)
