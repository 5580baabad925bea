"""Lesson "replay": how any structure came about, step by step, as its builder has noted.

Every step of the build log (:mod:`..contract.build_log`) is one of the builder's: a cell is
divided, two clusters are joined, an object is put in. Shown are the cells that were the leaves
after a step, or the clusters that were left, by depth, or all cells so far; red are those that the
step has made, with the plane that was chosen, and fainter the planes before it, if they are asked
for. The figures are those of the log: what lies on either side, and the cost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import depth_colours
from ..contract.build_log import KINDS, MERGE, OBLIQUE, SPLIT, BuildLog
from ..contract.cells import Cells, reowned
from ..contract.outlines import faces_of, outlines_of, triangles_of, wires_of
from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.polygons import Polygons
from ..printing import show_integer
from ..progress import Progress
from ..settings import setting
from .drawing import RED, Faces, Lines, coloured, counted, picture_of, tinted
from .lesson import Lesson, Play, Subject
from .picture import Picture, Row

MOST_NEWEST = 60
"""Cells of one step that stand out, the largest: of a parallel builder a step makes a level."""

MOST_PLANES = 300
"""Planes of earlier steps, those of the largest cells."""

MOST_BOXES, MOST_POLYHEDRA = 5000, 400
"""Cells that can be drawn at a knob's pace: boxes, and others, whose edges have to be found."""

LEAVES, FULL, ALL = "leaves", "full", "all"
NEWEST = "newest"

EARLY = 1, 4, 12, 40
"""Steps on a page."""

ONE_BY_ONE, FRAMES = 40, 120
"""Steps that a film shows one by one, and its frames; from then on it goes ever faster."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    step: int = setting(20, "Step", "Steps of the builder so far; 0 is before the first", minimum=0)
    cells: str = setting(
        LEAVES, "Cells", "Which of the cells that were made so far are drawn",
        choices={
            LEAVES: "Those that would be the leaves, or the roots, if building ended here",
            FULL: "Of those, the ones that do not end up as empty leaves",
            ALL: "Those that were divided or joined, too",
        },
    )  # fmt: skip
    planes: str = setting(
        NEWEST, "Planes", "Which planes are drawn",
        choices={NEWEST: "Those of this step", ALL: "Those of all steps so far"},
    )  # fmt: skip
    most: int = setting(
        400, "Cells Drawn", "At most so many cells are drawn, the largest", minimum=1
    )


class ReplayOfBuilding(Play):
    """The building of one structure.

    Attributes
    ----------
    made, replaced : (n,) int64
        By place: from which step on a cell is there, and when others take its place.
    """

    def __init__(self, structure: Structure, log: BuildLog, progress: Progress) -> None:
        self.cells, self.log = structure.cells(progress).own(), log
        self.item = structure.scene.item_name
        self.made = self.cells.extra["order"]
        assert self.cells.replaced is not None
        self.replaced = self.cells.replaced
        self.ends = {
            "step": int(max(log.last_step, self.made.max())),
            "most": MOST_BOXES if self.cells.faces is None else MOST_POLYHEDRA,
        }
        progress.report(0, 2, "Sorting cells")
        self.sizes = (self.cells.boxes[:, 3:] - self.cells.boxes[:, :3]).sum(axis=1)
        self.largest_first = np.argsort(-self.sizes, kind="stable")
        progress.report(1, 2, "Looking at planes")
        self.planes = planes_of(self.cells, log)
        self.is_empty = self.cells.is_leaf & (self.cells.count == 0)
        self.state = "left" if log.is_bottom_up else "so far"
        self.deepest = int(self.cells.depth.max())

    def there(self, step: int) -> np.ndarray:
        """Return which cells are leaves, or clusters, after a step, (n,) bool."""
        return (self.made <= step) & (step < self.replaced)

    def events(self, step: int) -> np.ndarray:
        """Return the events of a step."""
        first, last = np.searchsorted(self.log.step, [step, step + 1])
        return np.arange(first, last)

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after a step."""
        step, cells = settings.step, self.cells
        there = self.there(step)
        chosen = self.made <= step if settings.cells == ALL else there
        is_newest = (self.made == step) & (step > 0)
        if settings.cells == FULL:
            chosen = chosen & ~self.is_empty
        shown = self.largest(chosen & ~is_newest, settings.most)
        newest = self.largest(chosen & is_newest, min(settings.most, MOST_NEWEST))
        wires = wires_of(cells, shown)
        colours = np.column_stack([
            depth_colours(cells.depth[wires.edge_owners()], self.deepest),
            np.full(len(wires.edges), 0.35),
        ])  # fmt: skip
        parts: list[Lines | Faces] = [Lines(wires.segments(), colours)]
        if self.planes is not None and step > 0:
            # A cell is divided when others take its place.
            cut = self.replaced[self.planes.owners]
            if settings.planes == ALL:
                parts += planes_drawn(self.planes, self.of_largest(cut < step), 0.08, 0.3)
            parts += planes_drawn(self.planes, np.flatnonzero(cut == step)[:MOST_NEWEST], 0.3, 1.0)
        parts += [
            tinted(faces_of(cells, newest)[0], RED, 0.06),
            coloured(wires_of(cells, newest).segments(), RED),
        ]
        count = int(there.sum())
        done = self.words(step)
        one, many = ("cluster", "clusters") if self.log.is_bottom_up else ("leaf", "leaves")
        left = counted(count, one, many)
        caption = f"Step {step} of {self.ends['step']}: {done}; {left} {self.state}"
        drawn, wanted = len(shown) + len(newest), int(chosen.sum())
        if drawn < wanted:
            caption += f", drawn: the largest {show_integer(drawn)}"
            caption += f" of {show_integer(wanted)}" if wanted != count else ""
        elif drawn != count:
            caption += f", drawn: {counted(drawn, 'cell', 'cells')}"
        rows = (
            Row("Leaves" if not self.log.is_bottom_up else "Clusters", show_integer(count),
                "What would be the leaves, or the roots, if building ended here"),
            Row("Made", show_integer(int(is_newest.sum())), "Cells that this step has made"),
            Row("Deepest Level", str(int(cells.depth[there].max(initial=0))), "Of those so far"),
            *self.figures(step),
        )  # fmt: skip
        return picture_of(parts, caption, rows=rows)

    def largest(self, which: np.ndarray, most: int) -> np.ndarray:
        """Return the places of the largest of some cells, ascending."""
        return np.sort(self.largest_first[which[self.largest_first]][:most])

    def of_largest(self, which: np.ndarray) -> np.ndarray:
        """Return which of some planes are those of the largest cells, ascending."""
        assert self.planes is not None
        places = np.flatnonzero(which)
        sizes = self.sizes[self.planes.owners[places]]
        first = np.argsort(-sizes, kind="stable")[:MOST_PLANES]
        return np.sort(places[first])

    def words(self, step: int) -> str:
        """Say what is done in a step."""
        events = self.events(step)
        if not len(events):
            return "before the first step" if step == 0 else "nothing else"
        kinds, counts = np.unique(self.log.kind[events], return_counts=True)
        # Three planes that divide a cell into eight are one split.
        nodes = [len(np.unique(self.log.node[events[self.log.kind[events] == k]])) for k in kinds]
        if len(kinds) > 1 or nodes[0] > 1:
            done = [
                counted(n, KINDS[kind], f"{KINDS[kind]}s")
                for n, kind in zip(nodes, kinds, strict=True)
            ]
            return ", ".join(done)
        event, axis = int(events[0]), int(self.log.axis[events[0]])
        if kinds[0] == SPLIT:
            if counts[0] > 1:
                return "a cell is divided into eight"
            if axis < 0:
                return "a node is divided"
            if axis == OBLIQUE:
                return "a cell is cut by an oblique plane"
            return f"a cell is cut across {'xyz'[axis]} at {self.log.position[event]:.4g}"
        if kinds[0] == MERGE:
            return "two clusters are joined"
        return f"one {KINDS[int(kinds[0])]}"

    def figures(self, step: int) -> Sequence[Row]:
        """Return what the log says of a step of one event."""
        events = self.events(step)
        if not len(events):
            return ()
        rows, log = [], self.log
        if len(events) == 1 and (log.counts[events[0]] >= 0).all():
            left, right = log.counts[events[0]].tolist()
            rows.append(
                Row("N_L, N_R", f"{show_integer(left)}, {show_integer(right)}",
                    f"{self.item.capitalize()}s on either side, or of the two that are joined")
            )  # fmt: skip
        cost = log.cost[events]
        if np.isfinite(cost[0]) and (len(events) == 1 or (cost == cost[0]).all()):
            meaning = (
                "Surface of the box around both" if log.kind[events[0]] == MERGE
                else "C_trav + C_isect (SA(L) N_L + SA(R) N_R) / SA(V); for moves, what is saved"
            )  # fmt: skip
            rows.append(Row("Cost", f"{cost[0]:.4g}", meaning))
        return rows

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return early steps: later ones look alike."""
        last = self.ends["step"]
        return [Settings(step) for step in sorted({min(step, last) for step in EARLY})]

    def film(self, lesson: Lesson) -> Sequence[Any]:
        """Return the first steps one by one, and then ever more at once."""
        last = self.ends["step"]
        if last <= FRAMES:
            return range(last + 1)
        later = np.geomspace(ONE_BY_ONE, last, FRAMES - ONE_BY_ONE)
        return [*range(ONE_BY_ONE), *sorted({round(step) for step in later.tolist()})]


def planes_drawn(
    planes: Polygons, places: np.ndarray, cover: float, opacity: float
) -> list[Lines | Faces]:
    """Return some planes: filled, `cover` opaque, and their outlines."""
    if not len(places):
        return []
    sizes = np.diff(planes.offsets)[places]
    points = [
        planes.points[begin : begin + size]
        for begin, size in zip(planes.offsets[places], sizes, strict=True)
    ]
    offsets = np.concatenate([[0], np.cumsum(sizes)])
    polygons = Polygons(np.concatenate(points), offsets, np.arange(len(places)))
    edges = outlines_of(polygons).segments()
    return [tinted(triangles_of(polygons)[0], RED, cover), coloured(edges, (*RED[:3], opacity))]


def planes_of(cells: Cells, log: BuildLog) -> Polygons | None:
    """Return the planes that divided cells, owners by place; None if there are none."""
    if cells.planes is not None:
        return cells.planes
    if not log.has_planes() or len(cells) != int(cells.numbers.max()) + 1:
        return None
    place = np.empty(len(cells), np.int64)
    place[cells.numbers] = np.arange(len(cells))
    boxes = np.empty_like(cells.boxes)
    boxes[cells.numbers] = cells.boxes
    return reowned(log.planes(boxes), place)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Look at the log."""
    structure = subject.structures[0]
    progress.report(0, 2, "Reading the build log")
    log = structure.build_log
    if log is None:
        raise InputError(
            f"{structure.label} keeps no log of its building; choose an octree, kd-tree, BSP tree "
            "or bvh, and do not refit it"
        )
    return ReplayOfBuilding(structure, log, progress)


LESSONS = (
    Lesson(
        name="replay",
        label="A Build, Step by Step",
        slide="Adaptive subdivision criteria",
        begin="A builder takes one decision after the other, and each can be looked at",
        look_for="Each step divides one cell; those with many objects go first or last, as the "
        "order of the builder says, and cells that are good enough are left alone",
        question="Which of the cells that are left would you divide next, if only one more cut "
        "was allowed?",
        answer="The one that costs most: its surface, which says how many rays come there, times "
        "the objects that each of them is tested against. A priority queue does just that",
        source="contract.build_log",
        sample="suzanne:subdivisions=1",
        structures=("kdtree:max_leaf_size=16",),
        Settings=Settings,
        play=play,
        film="step",
    ),
)
