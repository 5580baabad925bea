"""The walk of one recorded ray, or cone, as coloured segments, whole or up to one event."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from ..contract.cells import Cells
from ..contract.events import (
    HIT,
    JUMP,
    POSTPONE,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
)
from ..contract.outlines import dashes_of, wires_of
from ..contract.protocols import Linked, Skipping
from ..contract.steps import Steps
from ..contract.structure import Structure
from ..contract.within import Space, chains_of, space_of, within_of
from ..geometry.box_shape import box_segments
from ..geometry.geometry import lines_of
from ..geometry.instances import Instanced, levels_of_mesh, lines_of_items, moved_points
from ..geometry.marks import arrows, cone_lines, stars
from ..geometry.rays import Rays
from ..progress import SILENT, Progress

STAR_SIZE = 0.03
"""Size of the marks of hits, as a share of the way to them; at most that of the primitive."""

MOST_TESTED = 2000
"""Primitives tested that are drawn, the last; of a naive walk more would be a grey mass."""

MOST_VISITED = 1000
"""Cells of a kind that were entered and are drawn, the last; a wide cone enters all of a tree."""

MOST_MET = 5000
"""Triangles that a cone meets and that are drawn, the first."""

FAINT = 0.4
"""Opacity of what a cone has entered, relative to that of a ray: there is much more of it."""

VISITS = VISIT_INNER, VISIT_LEAF, VISIT_EMPTY

Colour = tuple[float, float, float, float]
Piece = tuple[np.ndarray, Colour]


class Palette(NamedTuple):
    """Colours of a path: sRGB and opacity."""

    hitting: Colour
    missing: Colour
    ahead: Colour
    inner: Colour
    leaf: Colour
    empty: Colour
    skipped: Colour
    tested: Colour
    postponed: Colour
    found: Colour
    current: Colour
    link: Colour
    linked: Colour


ON_DARK = Palette(
    hitting=(1.0, 0.85, 0.1, 1.0),
    missing=(0.6, 0.6, 0.6, 1.0),
    ahead=(0.6, 0.6, 0.6, 0.35),
    inner=(1.0, 1.0, 1.0, 0.15),
    leaf=(1.0, 0.45, 0.0, 0.9),
    empty=(0.2, 0.6, 1.0, 0.7),
    skipped=(0.65, 0.45, 1.0, 0.7),
    tested=(0.9, 0.3, 0.6, 0.9),
    postponed=(1.0, 0.15, 0.1, 1.0),
    found=(0.2, 1.0, 0.3, 1.0),
    current=(1.0, 1.0, 1.0, 1.0),
    link=(0.1, 0.9, 0.9, 1.0),
    linked=(0.1, 0.9, 0.9, 0.4),
)
"""For the 3D viewport."""

ON_LIGHT = Palette(
    hitting=(0.10, 0.10, 0.10, 1.0),
    missing=(0.10, 0.10, 0.10, 1.0),
    ahead=(0.10, 0.10, 0.10, 0.25),
    inner=(0.35, 0.35, 0.38, 0.35),
    leaf=(0.95, 0.45, 0.0, 1.0),
    empty=(0.10, 0.45, 0.95, 0.7),
    skipped=(0.50, 0.25, 0.85, 0.8),
    tested=(0.85, 0.25, 0.55, 1.0),
    postponed=(0.90, 0.05, 0.05, 1.0),
    found=(0.0, 0.60, 0.15, 1.0),
    current=(0.0, 0.0, 0.0, 1.0),
    link=(0.0, 0.55, 0.55, 1.0),
    linked=(0.0, 0.55, 0.55, 0.4),
)
"""For pictures on paper."""


class Walk(NamedTuple):
    """A recorded ray, and what it was recorded in.

    Attributes
    ----------
    cells : Cells
        Of the structure.
    rays : Rays
    ray : int
        Number of the ray in `rays`.
    t_hit : float
        Ray parameter of the hit, inf for a miss.
    half_angle : float
        Of the cone around the ray that was recorded, in radians; 0 for the ray itself.
    """

    structure: Structure
    cells: Cells
    rays: Rays
    ray: int
    t_hit: float
    steps: Steps
    half_angle: float = 0.0

    def met(self, event: int | None = None) -> np.ndarray:
        """Return the items that a cone has met, up to an event: ascending, each once."""
        tests = self.steps.events_of(TEST, event)
        return np.unique(self.steps.primitive[tests[np.isfinite(self.steps.t_enter[tests])]])

    def at(self, t: np.ndarray) -> np.ndarray:
        """Return points (n, 3) on the ray."""
        return self.rays.origins[self.ray] + t[:, None] * self.rays.directions[self.ray]

    @property
    def levels(self) -> int:
        """How deep instances lie within each other in what was walked; 0 without any."""
        return levels_of_mesh(self.structure.scene.geometry)

    def spaces_of(self, events: np.ndarray) -> Iterator[tuple[Space, np.ndarray]]:
        """Yield the spaces in which some events happened, and which of them did in each."""
        if not len(events):
            return
        if not self.levels:
            yield space_of(self.structure, np.empty(0, dtype=np.int64)), events
            return
        chains = chains_of(self.steps, self.levels)[events]
        spaces, which = np.unique(chains, axis=0, return_inverse=True)
        for number, chain in enumerate(spaces):
            yield space_of(self.structure, chain), events[which.ravel() == number]


def segments_of(
    walk: Walk, event: int | None = None, palette: Palette = ON_DARK
) -> tuple[np.ndarray, np.ndarray]:
    """Return what to draw of a recorded ray.

    The ray up to its hit, or until it has left the scene; the edges of every cell it entered (inner
    nodes faint, empty leaves in another colour), or of the region that was skipped from there; the
    outlines of the primitives tested; the outline of that which is hit, and a star at the hit; the
    same in another colour for hits that were postponed.

    Parameters
    ----------
    event : int, optional
        Only what happened up to this event, whose own cell and primitive stand out.

    Returns
    -------
    segments : (k, 2, 3) float64
    colours : (k, 4) float64
    """
    if walk.half_angle:
        entered = {
            name: (*getattr(palette, name)[:3], FAINT * getattr(palette, name)[3])
            for name in ("inner", "leaf", "empty")
        }
        palette = palette._replace(**entered)
    pieces = list(_cone(walk, palette) if walk.half_angle else _ray(walk, event, palette))
    pieces += _cells(walk, event, palette)
    pieces += (_covered if walk.half_angle else _primitives)(walk, event, palette)
    if event is not None:
        pieces += _current(walk, event, palette)
    return _coloured(pieces)


def _coloured(pieces: list[Piece]) -> tuple[np.ndarray, np.ndarray]:
    """Return all segments, and a colour for each."""
    return (
        np.concatenate([segments for segments, _ in pieces]),
        np.concatenate([np.tile(colour, (len(segments), 1)) for segments, colour in pieces]),
    )


def _ray(walk: Walk, event: int | None, palette: Palette) -> Iterator[Piece]:
    """Draw the ray, what lies ahead of the event in another colour."""
    found = bool(np.isfinite(walk.t_hit))
    colour = palette.hitting if found else palette.missing
    end = walk.t_hit if found else _until_outside(walk)
    reached = end
    if event is not None:
        steps = walk.steps
        entered = [steps.events_of(kind, event) for kind in (VISIT_LEAF, VISIT_EMPTY)]
        exits = steps.t_exit[np.concatenate(entered)]
        reached = min(float(exits.max(initial=0.0)), end)
    origin, here, there = walk.at(np.array([0.0, reached, end]))
    yield np.array([[origin, here]]), colour
    if reached < end:
        yield np.array([[here, there]]), palette.ahead


def _cone(walk: Walk, palette: Palette) -> Iterator[Piece]:
    """Draw the axis, and the cone around it until it has left the scene."""
    ray, end = walk.ray, _until_outside(walk)
    begin = min(float(walk.rays.t_min[ray]), end)
    origin, direction = walk.rays.origins[ray], walk.rays.directions[ray]
    yield walk.at(np.array([begin, end]))[None], palette.missing
    yield cone_lines(origin, direction, walk.half_angle, begin, end), palette.hitting


def _covered(walk: Walk, event: int | None, palette: Palette) -> Iterator[Piece]:
    """Draw the triangles that were tested, and those among them that the cone meets."""
    tested = walk.steps.events_of(TEST, event)
    is_met = np.isfinite(walk.steps.t_enter[tested])
    yield _items(walk, tested[-MOST_TESTED:][~is_met[-MOST_TESTED:]]), palette.tested
    yield _items(walk, tested[is_met][:MOST_MET]), palette.found


def _cells(walk: Walk, event: int | None, palette: Palette) -> Iterator[Piece]:
    """Draw the cells that were entered, or the regions that were skipped from them."""
    steps = walk.steps
    inner, leaves, empty = (steps.events_of(kind, event) for kind in VISITS)
    yield _visited(walk, inner[-MOST_VISITED:]), palette.inner
    yield _visited(walk, leaves[-MOST_VISITED:]), palette.leaf
    empty = empty[-MOST_VISITED:]
    empty = np.unique(steps.cell[empty[steps.level[empty] == 0]])
    regions = skipped_regions(walk, empty)
    alone = [number for number in empty.tolist() if number not in regions]
    yield _outlines(walk.cells, np.array(alone, dtype=np.int64)), palette.empty
    if regions:
        yield box_segments(np.array(list(regions.values()))), palette.skipped


def skipped_regions(walk: Walk, numbers: np.ndarray) -> dict[int, np.ndarray]:
    """Return the boxes that the ray passes in one step, by the number of the cell where it does."""
    if not isinstance(walk.structure, Skipping):
        return {}
    direction = walk.rays.directions[walk.ray]
    found = {number: walk.structure.region(number, direction) for number in numbers.tolist()}
    return {number: region for number, region in found.items() if region is not None}


def _primitives(walk: Walk, event: int | None, palette: Palette) -> Iterator[Piece]:
    """Draw what was tested, postponed and found."""
    steps = walk.steps
    tested, postponed, hits = (steps.events_of(kind, event) for kind in (TEST, POSTPONE, HIT))
    # What is found within an instance may lie behind what was found before: the instance decides.
    postponed, hits = (events[steps.level[events] == 0] for events in (postponed, hits))
    yield _items(walk, tested[-MOST_TESTED:]), palette.tested
    yield _items(walk, within_of(steps, postponed, walk.levels)), palette.postponed
    nearest = np.sort(np.concatenate([postponed[-1:], hits[-1:]]))[-1:]
    yield _items(walk, within_of(steps, nearest, walk.levels)), palette.found
    for events, colour in ((hits[-1:], palette.found), (postponed, palette.postponed)):
        inside = within_of(steps, events, walk.levels)
        sizes = np.array([_size(_items(walk, inside[k : k + 1])) for k in range(len(inside))])
        points = walk.at(steps.t_enter[events])
        way = np.linalg.norm(points - walk.rays.origins[walk.ray], axis=1)
        yield stars(points, np.minimum(sizes, STAR_SIZE * way)), colour


def _current(walk: Walk, event: int, palette: Palette) -> Iterator[Piece]:
    """Draw what an event is about."""
    kind, cell = int(walk.steps.kind[event]), int(walk.steps.cell[event])
    only = np.array([event])
    if walk.steps.primitive[event] >= 0 and kind != JUMP:
        yield _items(walk, only), palette.current
    elif kind in VISITS and cell >= 0:
        yield _visited(walk, only), palette.current


def _outlines(cells: Cells, numbers: np.ndarray) -> np.ndarray:
    """Return the edges of cells by number, each cell once."""
    return wires_of(cells, cells.places_of(numbers)).segments()


def _visited(walk: Walk, events: np.ndarray) -> np.ndarray:
    """Return the edges of the cells that are visited in some events, each once."""
    steps = walk.steps
    pieces = [_outlines(walk.cells, steps.cell[events[steps.level[events] == 0]])]
    for space, there in walk.spaces_of(events[steps.level[events] > 0]):
        assert space.boxes is not None
        pieces.append(
            moved_points(box_segments(space.boxes[np.unique(steps.cell[there])]), space.matrix)
        )
    return np.concatenate(pieces)


def _items(walk: Walk, events: np.ndarray) -> np.ndarray:
    """Return lines that show what some events are about, each once; of instances dashed boxes."""
    pieces = [np.empty((0, 2, 3))]
    time = float(walk.rays.times[walk.ray])
    for space, there in walk.spaces_of(events):
        numbers = np.unique(walk.steps.primitive[there])
        if isinstance(space.geometry, Instanced):
            lines = dashes_of(lines_of_items(space.geometry, numbers))
        else:
            lines, _ = lines_of(space.geometry, numbers, time)
        pieces.append(lines if space.boxes is None else moved_points(lines, space.matrix))
    return np.concatenate(pieces)


def _size(segments: np.ndarray) -> float:
    """Return the longest side of the box around segments."""
    points = segments.reshape(-1, 3)
    return float((points.max(axis=0) - points.min(axis=0)).max()) if len(points) else 0.0


def _until_outside(walk: Walk) -> float:
    """Return a ray parameter at which a ray that hits nothing has left the scene, or its t_max."""
    scene, rays, ray = walk.structure.scene, walk.rays, walk.ray
    direction = rays.directions[ray]
    to_centre = 0.5 * (scene.lower + scene.upper) - rays.origins[ray]
    length = np.linalg.norm(direction)
    nearest = max(float(to_centre @ direction) / length, 0.0)
    return min((nearest + 0.75 * scene.diagonal) / float(length), float(rays.t_max[ray]))


# ---------------------------------------------------------------------------------------- links


def links_of(
    structure: Linked,
    cells: Cells,
    number: int,
    palette: Palette = ON_DARK,
    progress: Progress = SILENT,
) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the links of a leaf to draw: its edges, and an arrow to every cell it is linked to.

    The cells at the other ends are outlined, too.

    Returns
    -------
    segments : (k, 2, 3) float64
    colours : (k, 4) float64
    count : int
        How many links there are.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    progress.report(0, 1, "Finding what is linked")
    (place,) = cells.places_of(np.array([number]))
    linked = structure.links(number)
    # In the order of the links, each as often as it is linked.
    ends = np.array([cells.places_of(np.array([end]))[0] for end in linked], dtype=np.int64)
    centres = 0.5 * (cells.boxes[:, :3] + cells.boxes[:, 3:])
    links = np.stack([np.broadcast_to(centres[place], (len(ends), 3)), centres[ends]], axis=1)
    pieces = [
        (wires_of(cells, np.unique(ends)), palette.linked),
        (wires_of(cells, np.array([place])), palette.leaf),
    ]
    drawn = [(wires.segments(), colour) for wires, colour in pieces]
    return *_coloured([*drawn, (arrows(links), palette.link)]), len(links)
