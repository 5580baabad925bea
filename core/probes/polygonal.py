"""A polygonal scene: convex polygons, and the BSP tree that says which are before which.

Beams are clipped at the edges of convex polygons. A scene's triangles and convex polygons are taken
as they are, a polygon with hollow corners as its triangles, and so is one whose corners are not
quite in a plane. The tree (:mod:`..structures.bsp`) is built over these; its planes cut them, so
that in each of its leaves every polygon is there with the part that lies in the leaf. From wherever
one looks, the leaves have an order from front to back, even where polygons overlap in a circle:
one of them has been cut.

H. Fuchs, Z. Kedem, B. Naylor: On Visible Surface Generation by A Priori Tree Structures, SIGGRAPH
1980.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..errors import InputError
from ..geometry.shapes import shapes_of
from ..geometry.solids.description import Polygon, Triangle
from ..geometry.solids.mixed import POLYGON, TRIANGLE, Mixed
from ..geometry.triangles import Triangles
from ..geometry.triangulation import triangulate
from ..progress import SILENT, Progress
from ..ranges import ranges
from ..scene import Scene
from ..structures.bsp import SHELL, Bsp, BspSettings

SETTINGS = BspSettings(planes="autopartition", max_leaf_size=1, max_depth=60)
"""Of the tree, by default: planes of polygons, until every leaf has one polygon or none."""


class Convex(NamedTuple):
    """Convex polygons inside kernels, and their parts in the leaves of the tree.

    Attributes
    ----------
    planes : (n, 4) float64
        Of each polygon: unit normal, about which its corners run counter-clockwise, and position
        along it. Zeros for one without an area.
    facets : (n, 3, 3) float64
        Three of its corners, far from each other.
    items : (n,) int64
        Number in the scene of what it is part of; of two in one plane the lower is seen.
    points : (m, 3) float64
    offsets : (k + 1,) int64
        Corners of the part that each entry of the lists of leaves has.
    """

    planes: np.ndarray
    facets: np.ndarray
    items: np.ndarray
    points: np.ndarray
    offsets: np.ndarray


@dataclass(frozen=True)
class Polygonal:
    """A scene for beams; make it with :func:`polygonal`.

    Attributes
    ----------
    scene : Scene
        Without instances.
    convex : Convex
    middles : (n, 3) float64
        Of each convex polygon, that of its corners.
    tree : Bsp
        Over the convex polygons.
    """

    scene: Scene
    convex: Convex
    middles: np.ndarray
    tree: Bsp


def polygonal(
    scene: Scene, settings: BspSettings = SETTINGS, progress: Progress = SILENT
) -> Polygonal:
    """Return a scene of flat polygons for beams.

    Raises
    ------
    InputError
        If there is anything else in it.
    Cancelled
        From `progress`.
    """
    scene = scene.flat()
    convex, items = in_convex_parts(scene)
    tree = Bsp.build(convex, settings, progress)
    shapes = shapes_of(tree.geometry, tree.arrays.tree.shell)
    parts = tree.parts()
    corners = shapes.points[ranges(shapes.start, shapes.size)]
    begins = np.cumsum(shapes.size) - shapes.size
    seen = Convex(
        planes_of(corners, begins, shapes.size), shapes.facets, items, parts.points, parts.offsets
    )
    middles = np.add.reduceat(corners, begins) / shapes.size[:, None]
    return Polygonal(scene, seen, middles, tree)


def in_convex_parts(scene: Scene) -> tuple[Scene, np.ndarray]:
    """Return a scene of convex polygons, and of each, (n,) int64, what it is part of.

    Raises
    ------
    InputError
        If a scene holds what is no polygon.
    """
    geometry = scene.geometry
    if isinstance(geometry, Triangles):
        return scene, np.arange(len(scene))
    if not isinstance(geometry, Mixed) or not np.isin(geometry.kinds, (TRIANGLE, POLYGON)).all():
        raise InputError(
            f"beams meet flat polygons only, and {scene.name} holds other items as well; choose a "
            "scene of triangles and polygons",
            scene.name,
        )
    shapes = shapes_of(geometry, SHELL * float(np.abs([scene.lower, scene.upper]).max()))
    if (shapes.is_cut & shapes.is_own).all():
        return scene, np.arange(len(scene))
    described: list[Polygon | Triangle] = []
    items: list[int] = []
    for item, kind in enumerate(geometry.kinds.tolist()):
        loop = geometry.points[geometry.first[item] :][: geometry.size[item]]
        if kind == TRIANGLE:
            described.append(Triangle(geometry.rows[item, :3]))
        elif shapes.is_cut[item] and shapes.is_own[item]:
            described.append(Polygon(loop))
        else:  # none of one without an area, which has no corners
            size = np.array([len(loop)])
            described += [Triangle(loop[c]) for c in triangulate(loop, np.arange(len(loop)), size)]
        items += [item] * (len(described) - len(items))
    return Scene.from_items(described, scene.name, scene.source), np.array(items)


def planes_of(corners: np.ndarray, begins: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the planes, (n, 4), of convex polygons: Newell's normals, and positions along them.

    Parameters
    ----------
    corners : (m, 3) float64
        Polygon after polygon, each once around.
    begins, sizes : (n,) int64
        Where those of each begin, and how many there are.
    """
    first = corners[begins]
    owners = np.repeat(np.arange(len(sizes)), sizes)
    after = np.arange(1, len(corners) + 1)
    after[begins + sizes - 1] = begins
    seen = corners - first[owners]
    # Scaled to size 1: products of very long or short edges may leave the range of numbers.
    scale = np.maximum.reduceat(np.abs(seen).max(axis=1), begins)
    seen /= np.where(scale > 0.0, scale, 1.0)[owners, None]
    normals = np.add.reduceat(np.cross(seen, seen[after]), begins)
    lengths = np.linalg.norm(normals, axis=1)
    normals /= np.where(lengths > 0.0, lengths, 1.0)[:, None]
    return np.column_stack([normals, (normals * first).sum(axis=1)])
