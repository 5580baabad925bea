"""What the overlay draws of cells, ready for the graphics card; without graphics.

Made once, in the background job that builds. The main thread uploads what is in here as it is, and
looks up what the panel says; it goes through the cells no more. Whatever the shape of the cells,
what is held is bounded by the constants of :mod:`.selection`.

What is uploaded are textures (:mod:`.overlay_upload`):

- Boxes: two texels each, ``[lower, depth]`` and ``[upper, count]``, count -1 for an inner node;
  drawn as one unit cube per box.
- Edges of polyhedra, and of planes: the same two texels per edge, its ends in place of the lower
  and the upper corner; drawn as one diagonal of the unit cube per edge.
- Faces: three texels per triangle, its corners, with the depth and the step of the building.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ...core.contract.outlines import by_shape, faces_of, outlines_of, triangles_of, wires_of
from ...core.progress import SILENT, Progress
from . import selection
from .selection import Extent, Sections, Tally

if TYPE_CHECKING:  # only the type: its module brings Numba in
    from ...core.contract.cells import Cells, Polygons

TEXTURE_WIDTH = 4092
"""Texels in a row of a texture: a multiple of two and three that every graphics card can hold.

With it no texture has more rows than a card can hold, either: 2 MAXIMUM_CORNERS texels are 1956.
"""


class LineBatch(NamedTuple):
    """Shapes that are drawn as lines: boxes, or edges.

    Attributes
    ----------
    ends, steps : (rows, TEXTURE_WIDTH, 4) float32
        Two texels for each shape, and a quarter of one: the step of the building in which it
        appears. Where nobody knows those, only as large as it must be.
    starts : (n + 1,) int64
        Shapes of item i (a cell or a plane) are starts[i] ... starts[i + 1] - 1.
    """

    ends: np.ndarray
    steps: np.ndarray
    starts: np.ndarray


class FaceBatch(NamedTuple):
    """Triangles that are filled.

    Attributes
    ----------
    corners : (rows, TEXTURE_WIDTH, 4) float32
        Three texels for each.
    starts : (n + 1,) int64
        Triangles of item i (a cell or a plane) are starts[i] ... starts[i + 1] - 1.
    depth : (n,) int32
        Of the items, ascending.
    areas : Tally
        Surface by depth.
    """

    corners: np.ndarray
    starts: np.ndarray
    depth: np.ndarray
    areas: Tally


@dataclass(frozen=True)
class Drawable:
    """Cells, and all that is drawn and said of them.

    Attributes
    ----------
    cells : Cells
    extent : Extent
    sections : Sections
    surface : float
        Of the box around all cells.
    boxes, edges : LineBatch
        The edges of the cells in the sections, as boxes or one by one.
    plane_lines, plane_faces : LineBatch, FaceBatch
        The planes, the shallow ones.
    empty_faces : FaceBatch
        The empty leaves, the shallow ones.
    n_shaped, n_planes, n_empty : int
        How many cells in the sections are drawn in their shape; how many planes and empty leaves
        there are.
    """

    cells: Cells
    extent: Extent
    sections: Sections
    surface: float
    boxes: LineBatch
    edges: LineBatch
    plane_lines: LineBatch
    plane_faces: FaceBatch
    empty_faces: FaceBatch
    n_shaped: int
    n_planes: int
    n_empty: int


def make_drawable(cells: Cells, progress: Progress = SILENT) -> Drawable:
    """Make cells ready to be drawn.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    progress.report(0, 1, "Preparing the picture")
    extent, sections = selection.extent_of(cells), selection.sections_of(cells)
    made, replaced = steps_of(cells)
    is_empty = selection.is_empty(cells)
    empty = np.flatnonzero(is_empty)[: selection.MAXIMUM_FILLED]
    planes = _first_of(cells.planes, selection.MAXIMUM_FILLED)
    shaped, _ = by_shape(cells, np.sort(sections.order))
    cells.sort_numbers()
    progress.report(0, 1, "Preparing the picture")
    return Drawable(
        cells, extent, sections, _surface_of(cells),
        box_lines(cells, sections.order, shaped, made),
        edge_lines(cells, sections.order, shaped, made, progress),
        # A plane is there from the step on that divides its cell.
        plane_lines(cells, planes, replaced),
        plane_faces(cells, planes, replaced),
        cell_faces(cells, empty, made),
        len(shaped), 0 if cells.planes is None else len(cells.planes.owners), int(is_empty.sum()),
    )  # fmt: skip


def steps_of(cells: Cells) -> tuple[np.ndarray, np.ndarray]:
    """Return when cells are made and replaced, (n,) int each; all 0 where nobody knows."""
    if cells.replaced is None:
        nothing = np.zeros(len(cells), dtype=np.int64)
        return nothing, nothing
    return cells.extra["order"], cells.replaced


def _surface_of(cells: Cells) -> float:
    """Return the surface of the box around all cells."""
    if len(cells) == 0:
        return 0.0
    x, y, z = cells.boxes[:, 3:].max(axis=0) - cells.boxes[:, :3].min(axis=0)
    return float(2.0 * (x * y + y * z + z * x))


# ------------------------------------------------------------------------------------------ lines


def box_lines(cells: Cells, order: np.ndarray, shaped: np.ndarray, steps: np.ndarray) -> LineBatch:
    """Return those of the cells `order` that are drawn as boxes: all but `shaped`."""
    is_box = np.ones(len(cells), dtype=bool)
    is_box[shaped] = False
    owners = order[is_box[order]]
    starts = np.concatenate([[0], np.cumsum(is_box[order])])
    return _lines(cells, cells.boxes[owners].reshape(-1, 2, 3), owners, steps, starts)


def edge_lines(
    cells: Cells,
    order: np.ndarray,
    shaped: np.ndarray,
    steps: np.ndarray,
    progress: Progress = SILENT,
) -> LineBatch:
    """Return the edges of those of the cells `order` that are drawn in their shape, `shaped`."""
    wires = wires_of(cells, shaped, progress)
    position = np.zeros(len(cells), dtype=np.int64)
    position[order] = np.arange(len(order))
    positions = position[wires.edge_owners()]
    sorting = np.argsort(positions, kind="stable")
    starts = np.searchsorted(positions[sorting], np.arange(len(order) + 1))
    owners = wires.edge_owners()[sorting]
    return _lines(cells, wires.segments()[sorting], owners, steps, starts)


def plane_lines(cells: Cells, planes: Polygons | None, steps: np.ndarray) -> LineBatch:
    """Return the outlines of planes."""
    if planes is None:
        nothing = np.empty(0, np.int64)
        return _lines(cells, np.empty((0, 2, 3)), nothing, steps, np.zeros(1, int))
    wires = outlines_of(planes)
    ends, owners = wires.segments(), wires.edge_owners()
    return _lines(cells, ends, owners, steps, planes.offsets, of_cells=False)


def _lines(
    cells: Cells,
    ends: np.ndarray,
    owners: np.ndarray,
    steps: np.ndarray,
    starts: np.ndarray,
    of_cells: bool = True,
) -> LineBatch:
    """Pack shapes with two ends (n, 2, 3), and whose they are (n,); planes have no count.

    Steps, in which shapes appear, are those of all cells.
    """
    texels = np.empty((len(ends), 2, 4), dtype=np.float32)
    texels[:, :, :3] = ends
    texels[:, 0, 3] = cells.depth[owners]
    texels[:, 1, 3] = np.where(cells.is_leaf, cells.count, -1)[owners] if of_cells else -1
    if cells.replaced is None:
        when = np.zeros(1, dtype=np.float32)
    else:
        when = steps[owners].astype(np.float32)
    return LineBatch(in_rows(texels), in_rows(when), starts)


# ------------------------------------------------------------------------------------------ faces


def plane_faces(cells: Cells, planes: Polygons | None, steps: np.ndarray) -> FaceBatch:
    """Return planes as triangles."""
    if planes is None:
        triangles, owners = np.empty((0, 3, 3)), np.empty(0, dtype=np.int64)
        starts, depth = np.zeros(1, dtype=np.int64), cells.depth[:0]
    else:
        triangles, owners = triangles_of(planes)
        per_plane = np.maximum(np.diff(planes.offsets) - 2, 0)
        starts, depth = np.concatenate([[0], np.cumsum(per_plane)]), cells.depth[planes.owners]
    return _faces(triangles, cells.depth[owners], steps[owners], starts, depth)


def cell_faces(cells: Cells, places: np.ndarray, steps: np.ndarray) -> FaceBatch:
    """Return the faces of the cells `places`, which are ascending."""
    triangles, owners = faces_of(cells, places)
    starts = np.searchsorted(owners, np.append(places, len(cells)))
    depth = cells.depth[places]
    return _faces(triangles, cells.depth[owners], steps[owners], starts, depth)


def _faces(
    triangles: np.ndarray,
    depths: np.ndarray,
    steps: np.ndarray,
    starts: np.ndarray,
    depth: np.ndarray,
) -> FaceBatch:
    """Pack triangles (m, 3, 3) with their depths and the steps in which they appear."""
    texels = np.zeros((len(triangles), 3, 4), dtype=np.float32)
    texels[:, :, :3] = triangles
    texels[:, 0, 3] = depths
    texels[:, 1, 3] = steps
    sides = triangles[:, 1:] - triangles[:, :1]
    areas = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return FaceBatch(in_rows(texels), starts, depth, Tally(depths, areas))


def _first_of(polygons: Polygons | None, most: int) -> Polygons | None:
    """Return the first so many polygons."""
    if polygons is None:
        return None
    offsets = polygons.offsets[: most + 1]
    return polygons._replace(
        points=polygons.points[: offsets[-1]], offsets=offsets, owners=polygons.owners[:most]
    )


def in_rows(texels: np.ndarray, width: int = TEXTURE_WIDTH) -> np.ndarray:
    """Return numbers of float32, four to a texel, in rows (rows, width, 4) filled up with zeros."""
    rows = max(-(-texels.size // (4 * width)), 1)
    whole = np.zeros((rows, width, 4), dtype=np.float32)
    whole.reshape(-1)[: texels.size] = texels.ravel()
    return whole
