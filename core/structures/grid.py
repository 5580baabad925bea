"""Uniform grid, walked by a 3D DDA.

The scene's box is cut into nx * ny * nz equal cells; each cell lists the triangles that overlap it.
A ray enters at a cell and steps from wall to wall: the next wall is the nearest of the three in
x, y and z (lecture, "Grid traversal (3D DDA)"). The lecture subtracts the step from Lx, Ly, Lz each
time; here the t of the next wall is computed from its integer index, so no error builds up.

Cells are stored in one array with an offset per cell (compressed sparse rows): cell c lists
``references[offsets[c]:offsets[c + 1]]``, and c = (i * ny + j) * nz + k.

A cell owns its lower walls, not its upper ones: a point on a wall lies in the cell above it. That
is what computing an index by rounding down gives, and what published counts rest on.

A triangle that spans several cells is met several times. The mailbox remembers the last ray that
tested it. A hit beyond the current cell is postponed: something nearer may wait in between, so it
is kept and only accepted once the walk has reached its cell.

J. Amanatides, A. Woo: A Fast Voxel Traversal Algorithm for Ray Tracing, Eurographics 1987.
A. Woo: Ray Tracing Polygons Using Spatial Subdivision, Graphics Interface 1992 (resolution).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..geometry.box import MISS, boxes_of, enter_box, surface_area
from ..geometry.rays import ALL, ANY, ULPS
from ..geometry.triangle import intersect, overlaps_box, triangles_of
from ..kernels import call, implements, inner, kernel
from ..memory import refuse_if_too_large
from ..parallel import for_chunks
from ..progress import SILENT, Progress
from ..scene import Scene
from ..settings import setting
from .cells import Cells
from .contract import (
    Found,
    Statistics,
    Structure,
    intersection_cost,
    traversal_cost,
    walk,
)
from .steps import HIT, MAILBOX, POSTPONE, TEST, VISIT_EMPTY, VISIT_LEAF, VOLUME_TEST, note

# ------------------------------------------------------------------------------------- settings


@dataclass(frozen=True)
class GridSettings:
    """Settings of the uniform grid."""

    resolution: tuple[int, int, int] = setting(
        (0, 0, 0),
        "Resolution",
        "Cells along x, y and z; 0 leaves it to the rule",
        unit="cells",
        minimum=0,
        unset="auto",
    )
    rule: str = setting(
        "woo",
        "Rule",
        "How the resolution follows from the number of triangles N and the density D",
        choices={
            "regular": "n = (D N)^(1/3) along every axis",
            "woo": "Near-cubic cells: (D N)^(1/3) along the longest axis, fewer along the others",
            "heterogeneous": "Cubic cells, D N of them in all (Klimaszewski)",
        },
    )
    density: float = setting(
        3.0, "Density", "Cells per triangle that the rule aims at", minimum=1e-6, maximum=1e6
    )
    padding: float = setting(
        0.001,
        "Padding",
        "Enlargement of the scene's box on each side, as a share of its size",
        minimum=0.0,
        maximum=10.0,
    )
    overlap: str = setting(
        "closed",
        "Overlap",
        "Whether a triangle that only touches a cell's wall belongs to that cell",
        choices={
            "closed": "A triangle that reaches up to a wall also belongs to the cell above it",
            "open": "Only a true overlap counts; a ray that runs exactly in a wall may miss it",
        },
    )
    assignment: str = setting(
        "box",
        "Assignment",
        "What is compared with a cell",
        choices={"box": "The triangle's bounding box", "exact": "The triangle itself"},
    )
    mailbox: bool = setting(False, "Mailbox", "Test a triangle at most once per ray")
    C_trav: float = traversal_cost()
    C_isect: float = intersection_cost()


def resolution_by_rule(size: np.ndarray, count: int, rule: str, density: float) -> np.ndarray:
    """Return the resolution (3,) that a rule gives for a box of `size` with `count` triangles."""
    cells = density * count
    if rule == "regular":
        wanted = np.full(3, cells ** (1 / 3))
    elif rule == "woo":
        wanted = size / size.max() * cells ** (1 / 3)
    else:
        # A flat side would ask for infinitely many cells along the others.
        x, y, z = np.maximum(size, 1e-6 * size.max())
        nx = np.floor((cells * x * x / (y * z)) ** (1 / 3) + 0.5)
        ny = np.floor(np.sqrt(cells * y / (max(nx, 1) * z)) + 0.5)
        nz = np.floor(cells / (max(nx, 1) * max(ny, 1)) + 0.5)
        wanted = np.array([nx, ny, nz])
    return np.maximum(np.floor(wanted), 1)


# ------------------------------------------------------------------------------------ the record


class GridArrays(NamedTuple):
    """The grid as its kernels see it.

    Attributes
    ----------
    box : (1, 6) float64
        The box that is cut into cells.
    origin : (3,) float64
        Where the walls are counted from: the lower corner of the box, less a hair (see HAIR).
    cell_size : (3,) float64
    resolution : (3,) int64
    offsets : (n_cells + 1,) int64
    references : (N_OIV,) int32
        Triangle indices, ascending within a cell.
    mailbox : bool
    """

    box: np.ndarray
    origin: np.ndarray
    cell_size: np.ndarray
    resolution: np.ndarray
    offsets: np.ndarray
    references: np.ndarray
    mailbox: bool


# ----------------------------------------------------------------------------------------- build

BYTES_PER_CELL = 64
"""Per cell: its offset, and what the figures of all cells take for a moment."""

HAIR = 1e-8
"""How far below their nominal places the walls lie, as a share of the grid's longest side.

Coordinates like to lie exactly on walls. A hair lower, every wall has such triangles and rays
clearly above it, farther than rounding can reach, and nearer than any published count could tell.
"""

TOUCH = 2e-9
"""How much boxes are widened when they are inserted, as a share of the grid's longest side.

Where a ray passes through the corner of cells, rounding decides which of them it visits; a triangle
there has to be in all of them. This covers the rounding of rays that start up to a million sides
away, and is well below a hair.
"""


@kernel
def wall(grid, axis, index):
    """Return the coordinate of the wall below cell `index` along an axis."""
    if index == grid.resolution[axis]:
        # The last wall lies a hair above the box, so that the box's own boundary is inside.
        return grid.box[0, 3 + axis] + (grid.box[0, axis] - grid.origin[axis])
    return grid.origin[axis] + index * grid.cell_size[axis]


@inner
def cell_at(grid, axis, x):
    """Return the cell along an axis whose walls hold the coordinate x; the nearest if none does."""
    last = grid.resolution[axis] - 1
    i = int(min(max((x - grid.origin[axis]) / grid.cell_size[axis], 0.0), last + 0.0))
    # The division may be off by one; the walls decide.
    while i > 0 and wall(grid, axis, i) > x:
        i -= 1
    while i < last and wall(grid, axis, i + 1) <= x:
        i += 1
    return i


@kernel
def insert(
    grid, corners, boxes, first, last, touch, hair, is_exact, fill, cursor, lo, hi, cell_box
):
    """Insert the triangles ``first <= n < last`` into every cell they overlap.

    Boxes are widened by `touch` (3,), and under open overlap lowered at the top by twice the `hair`
    (3,). Called twice: with `fill` false, ``cursor[c]`` counts the
    references of cell c; with `fill` true it is the place of the next one. `lo` and `hi`, (3,)
    int64, and `cell_box`, (6,), are scratch.
    """
    for n in range(first, last):
        for axis in range(3):
            lo[axis] = cell_at(grid, axis, boxes[n, axis] - touch[axis])
            hi[axis] = cell_at(grid, axis, boxes[n, 3 + axis] + touch[axis] - 2.0 * hair[axis])
            # A flat triangle in a wall overlaps neither side openly: it goes to the upper one.
            hi[axis] = max(lo[axis], hi[axis])
        single = lo[0] == hi[0] and lo[1] == hi[1] and lo[2] == hi[2]
        for i in range(lo[0], hi[0] + 1):
            for j in range(lo[1], hi[1] + 1):
                for k in range(lo[2], hi[2] + 1):
                    if is_exact and not single:
                        for axis in range(3):
                            index = i if axis == 0 else j if axis == 1 else k
                            cell_box[axis] = wall(grid, axis, index) - touch[axis]
                            cell_box[3 + axis] = wall(grid, axis, index + 1) + touch[axis]
                        if not overlaps_box(corners, n, cell_box):
                            continue
                    cell = (i * grid.resolution[1] + j) * grid.resolution[2] + k
                    if fill:
                        grid.references[cursor[cell]] = n
                    cursor[cell] += 1


# ------------------------------------------------------------------------------------------ walk


@inner
def start_cell(grid, axis, o, d, inverse, t):
    """Return the cell along one axis where the ray is at t, consistent with :func:`wall_t`."""
    i = cell_at(grid, axis, o + t * d)
    if np.isinf(inverse):
        return i
    last = grid.resolution[axis] - 1
    step = 1 if d > 0.0 else -1
    while 0 <= i + step <= last and wall_t(grid, axis, i, o, inverse) < t:
        i += step
    while 0 <= i - step <= last and wall_t(grid, axis, i - step, o, inverse) > t:
        i -= step
    return i


@inner
def wall_t(grid, axis, i, o, inverse):
    """Return the t at which the ray leaves cell i of one axis, inf if it never does.

    `o` is moved by the ray's slack, so that this is the earliest t the crossing can have: what lies
    behind the wall is not hit before it. A direction whose inverse overflows crosses no wall.
    """
    if np.isinf(inverse):
        return np.inf
    if inverse > 0.0:
        return (wall(grid, axis, i + 1) - o) * inverse
    return (wall(grid, axis, i) - o) * inverse


@implements(walk, GridArrays)
def walk_grid(structure, triangles, ray, number, workspace, log):
    """Step from cell to cell until the nearest hit lies before the next wall."""
    best_t, best = np.inf, -1
    cells_visited, empty_visited, tests, mailbox_hits = 0, 0, 0, 0

    t = enter_box(structure.box, 0, ray, ray.t_max)
    note(log, VOLUME_TEST, -1, -1, t, t)
    if t == MISS:
        return Found(best_t, best, 0, 0, 0, 0, 1, 0)

    nx, ny, nz = structure.resolution[0], structure.resolution[1], structure.resolution[2]
    ox = ray.low_x if ray.dx > 0.0 else ray.high_x
    oy = ray.low_y if ray.dy > 0.0 else ray.high_y
    oz = ray.low_z if ray.dz > 0.0 else ray.high_z
    i = start_cell(structure, 0, ox, ray.dx, ray.ix, t)
    j = start_cell(structure, 1, oy, ray.dy, ray.iy, t)
    k = start_cell(structure, 2, oz, ray.dz, ray.iz, t)
    step_x = 1 if ray.dx > 0.0 else -1
    step_y = 1 if ray.dy > 0.0 else -1
    step_z = 1 if ray.dz > 0.0 else -1
    # t at the next wall of each system of parallel walls: the lecture's Lx, Ly, Lz.
    wall_x = wall_t(structure, 0, i, ox, ray.ix)
    wall_y = wall_t(structure, 1, j, oy, ray.iy)
    wall_z = wall_t(structure, 2, k, oz, ray.iz)

    while True:
        t_exit = min(wall_x, wall_y, wall_z)
        cell = (i * ny + j) * nz + k
        begin, end = structure.offsets[cell], structure.offsets[cell + 1]
        cells_visited += 1
        if begin == end:
            empty_visited += 1
            note(log, VISIT_EMPTY, cell, -1, t, t_exit)
        else:
            note(log, VISIT_LEAF, cell, -1, t, t_exit)

        for slot in range(begin, end):
            n = structure.references[slot]
            if structure.mailbox:
                if workspace.mailbox[n] == number:
                    mailbox_hits += 1
                    note(log, MAILBOX, cell, n, t, t_exit)
                    continue
                workspace.mailbox[n] = number
            hit_t = intersect(triangles, n, ray)
            tests += 1
            note(log, TEST, cell, n, hit_t, hit_t)
            if hit_t <= ray.t_max and (hit_t < best_t or (hit_t == best_t and n < best)):
                best_t, best = hit_t, n
                note(log, HIT if hit_t <= t_exit else POSTPONE, cell, n, hit_t, hit_t)

        # The hit must lie in the current cell. One exactly on the wall waits for the next cell,
        # which may hold a triangle of lower id at the same t.
        if ray.query == ANY and best >= 0:
            break
        if ray.query != ALL and best_t < t_exit:
            break
        if t_exit > ray.t_max:
            break

        t = t_exit
        if wall_x == t_exit:
            i += step_x
            if i < 0 or i == nx:
                break
            wall_x = wall_t(structure, 0, i, ox, ray.ix)
        elif wall_y == t_exit:
            j += step_y
            if j < 0 or j == ny:
                break
            wall_y = wall_t(structure, 1, j, oy, ray.iy)
        else:
            k += step_z
            if k < 0 or k == nz:
                break
            wall_z = wall_t(structure, 2, k, oz, ray.iz)

    return Found(
        best_t, best, cells_visited, cells_visited, empty_visited, tests, 1, mailbox_hits
    )  # fmt: skip


# ------------------------------------------------------------------------------- the structure


class Grid(Structure):
    """Uniform subdivision of space."""

    name = "grid"
    label = "Uniform Grid"
    summary = "Equal cells in CSR lists, walked by a 3D DDA"
    Settings = GridSettings

    arrays: GridArrays

    @property
    def has_mailbox(self) -> bool:  # type: ignore[override]
        """Whether the walk needs a mailbox."""
        return self.settings.mailbox

    @staticmethod
    def _plan(scene: Scene, settings: GridSettings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the lower and upper corner of the grid and its resolution (float), (3,) each."""
        size = scene.upper - scene.lower
        margin = settings.padding * size
        # A flat scene gets some thickness: a cell of zero volume has no inside to walk through.
        margin = np.where(size > 0.0, margin, max(settings.padding, 1e-6) * size.max())
        lower, upper = scene.lower - margin, scene.upper + margin
        given = np.array(settings.resolution)
        by_rule = resolution_by_rule(upper - lower, len(scene), settings.rule, settings.density)
        return lower, upper, np.where(given > 0, given, by_rule)

    @classmethod
    def refuse_too_large(cls, scene: Scene, settings: GridSettings) -> None:
        """Refuse a resolution whose cells do not fit, with the arrays their figures need."""
        _, _, resolution = cls._plan(scene, settings)
        n_cells = float(np.prod(resolution))
        words = "x".join(f"{n:.0f}" for n in resolution)
        refuse_if_too_large(
            int(BYTES_PER_CELL * n_cells),
            f"a grid of {words} = {n_cells:.3g} cells",
            "lower the resolution",
        )

    @classmethod
    def build(cls, scene: Scene, settings: GridSettings, progress: Progress = SILENT) -> Grid:
        """Count the references of every cell, turn counts into offsets, fill in the references."""
        cls.refuse_too_large(scene, settings)
        lower, upper, wanted = cls._plan(scene, settings)
        resolution = wanted.astype(np.int64)
        triangles = triangles_of(scene)
        boxes = boxes_of(scene.triangles)
        hair, touch = cls._hair_and_touch(lower, upper, scene)
        grid = GridArrays(
            np.concatenate([lower, upper])[None], lower - hair, (upper - lower) / resolution,
            resolution,
            np.zeros(int(np.prod(wanted)) + 1, dtype=np.int64), np.zeros(0, dtype=np.int32),
            settings.mailbox,
        )  # fmt: skip
        is_open = settings.overlap == "open"
        how = (touch, hair * is_open, settings.assignment == "exact")
        scratch = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64), np.empty(6)

        def insert_all(fill: bool, cursor: np.ndarray, text: str) -> None:
            def insert_some(first: int, last: int) -> None:
                call(
                    insert, grid, triangles.corners, boxes, first, last, *how, fill, cursor,
                    *scratch,
                )  # fmt: skip

            # One thread: threads would meet at the cursors of cells.
            for_chunks(insert_some, len(scene), 1, progress, text)

        insert_all(False, grid.offsets[1:], "Grid: counting references")
        np.cumsum(grid.offsets, out=grid.offsets)
        n_references = int(grid.offsets[-1])
        refuse_if_too_large(
            4 * n_references, f"a grid with {n_references} references", "lower the resolution"
        )
        grid = grid._replace(references=np.empty(n_references, dtype=np.int32))
        insert_all(True, grid.offsets[:-1].copy(), "Grid: filling cells")
        return cls(scene, settings, grid, triangles)

    @staticmethod
    def _hair_and_touch(
        lower: np.ndarray, upper: np.ndarray, scene: Scene
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return HAIR and TOUCH as lengths, (3,) each."""
        longest = np.full(3, (upper - lower).max())
        # Far from the origin coordinates are coarse, however small the scene is.
        rounding = 8 * ULPS * np.maximum(np.abs(scene.lower), np.abs(scene.upper))
        return HAIR * longest + 4 * rounding, TOUCH * longest + rounding

    def _counts(self) -> np.ndarray:
        """Return the references per cell, (n_cells,) int64."""
        return np.diff(self.arrays.offsets)

    def cells(self) -> Cells:
        """Return all cells; their number is that of the step log."""
        box, size, resolution = self.arrays.box, self.arrays.cell_size, self.arrays.resolution
        counts = self._counts()
        refuse_if_too_large(
            len(counts) * 160, f"listing {len(counts)} cells", "lower the resolution"
        )
        index = np.stack(np.unravel_index(np.arange(len(counts)), tuple(resolution)), axis=1)
        lower = box[0, :3] + index * size
        upper = box[0, :3] + (index + 1) * size
        return Cells(
            np.concatenate([lower, upper], axis=1), np.arange(len(counts), dtype=np.int32),
            np.zeros(len(counts), dtype=np.int32), np.ones(len(counts), dtype=bool),
            counts.astype(np.int32),
        )  # fmt: skip

    def statistics(self) -> Statistics:
        """Return the figures; a grid has no inner nodes, so C_trav does not enter its SAH."""
        counts = self._counts()
        area = surface_area(np.concatenate([np.zeros(3), self.arrays.cell_size]))
        return Statistics.of_cells(
            np.full(len(counts), area), np.ones(len(counts), dtype=bool), counts,
            np.zeros(len(counts), dtype=np.int64), float(surface_area(self.arrays.box)[0]),
            self.settings.C_trav, self.settings.C_isect,
            {"resolution": self.arrays.resolution.tolist()},
        )  # fmt: skip

    def validate(self) -> list[str]:
        """Check the lists, and that every cell lists what overlaps it.

        With exact assignment the latter is checked at the triangles' corners only.
        """
        violations = []
        offsets, references = self.arrays.offsets, self.arrays.references
        if offsets[0] != 0 or offsets[-1] != len(references) or (np.diff(offsets) < 0).any():
            violations.append("cell offsets do not partition the references")
            return violations
        if len(np.unique(references)) != len(self.scene):
            violations.append("a triangle is in no cell")
        cell_of = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        same = cell_of[1:] == cell_of[:-1]
        if (np.diff(references)[same] <= 0).any():
            violations.append("a cell lists a triangle twice or out of order")
        low, high = self._spans()
        i, j, k = np.unravel_index(cell_of, tuple(self.arrays.resolution))
        index = np.stack([i, j, k], axis=1)
        if (index < low[references]).any() or (index > high[references]).any():
            violations.append("a cell lists a triangle whose box lies outside it")
        listed = np.bincount(references, minlength=len(self.scene))
        overlapped = np.prod(high - low + 1, axis=1)
        if self.settings.assignment == "box" and (listed < overlapped).any():
            violations.append("a cell does not list a triangle whose box overlaps it")
        corners = self._cells_of_corners()
        pairs = corners * len(self.scene) + np.arange(len(self.scene))[:, None]
        if not np.isin(pairs, cell_of * len(self.scene) + references).all():
            violations.append("a triangle is not listed by the cell of one of its corners")
        return violations

    def _walls(self, axis: int) -> np.ndarray:
        """Return the coordinates of all walls of an axis, (n + 1,)."""
        count = self.arrays.resolution[axis]
        walls = self.arrays.origin[axis] + np.arange(count + 1) * self.arrays.cell_size[axis]
        walls[-1] = wall(self.arrays, axis, count)
        return walls

    def _cells_at(self, axis: int, x: np.ndarray) -> np.ndarray:
        """Return the cells of coordinates along an axis, found by searching the walls."""
        found = np.searchsorted(self._walls(axis), x, side="right") - 1
        return np.clip(found, 0, self.arrays.resolution[axis] - 1)

    def _spans(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and last cell per axis that each triangle's box overlaps, (n, 3)."""
        boxes = boxes_of(self.scene.triangles)
        box = self.arrays.box[0]
        hair, touch = self._hair_and_touch(box[:3], box[3:], self.scene)
        low = np.stack([self._cells_at(a, boxes[:, a] - touch[a]) for a in range(3)], axis=1)
        top = boxes[:, 3:] + touch - 2.0 * hair * (self.settings.overlap == "open")
        high = np.stack([self._cells_at(a, top[:, a]) for a in range(3)], axis=1)
        return low, np.maximum(low, high)

    def _cells_of_corners(self) -> np.ndarray:
        """Return the cell of every triangle's corners, (n, 3), within the span of its box."""
        low, high = self._spans()
        index = np.stack(
            [self._cells_at(axis, self.scene.triangles[:, :, axis]) for axis in range(3)], axis=2
        )
        index = np.clip(index, low[:, None], high[:, None])
        _, ny, nz = self.arrays.resolution
        return (index[..., 0] * ny + index[..., 1]) * nz + index[..., 2]


STRUCTURE = Grid
