"""Triangles of samples as meshes."""

from __future__ import annotations

import bpy
import numpy as np


def mesh_of(triangles: np.ndarray, name: str) -> bpy.types.Mesh:
    """Return triangles (n, 3, 3) as a mesh; equal corners become one vertex."""
    corners = np.ascontiguousarray(triangles, dtype=np.float32).reshape(-1, 3) + np.float32(0.0)
    # As opaque bytes: ten times faster than np.unique by rows. Adding 0 above makes -0 a 0.
    rows = corners.view(np.dtype((np.void, 12))).ravel()
    _, first, vertices = np.unique(rows, return_index=True, return_inverse=True)
    count = len(triangles)
    mesh = bpy.data.meshes.new(name)
    mesh.vertices.add(len(first))
    mesh.vertices.foreach_set("co", corners[first].ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", vertices.ravel().astype(np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", np.arange(0, 3 * count, 3, dtype=np.int32))
    mesh.update(calc_edges=True)
    return mesh
