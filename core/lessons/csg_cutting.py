"""Lesson "csg_cutting": the bounds of a CSG tree, pass by pass.

The slides 'CSG tree "cutting"'. Dashed are the bounds that solids have by themselves, solid lines
are those that passes have left. Beside the model stands the tree; what a pass has made smaller has
a green frame, what is pruned a red cross.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..contract.outlines import dashes_of
from ..geometry.csg.cutting import CUT, UP, Cutting, CuttingSettings, cutting_of
from ..geometry.csg.settings import VOLUMES
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..settings import setting
from .around import edges_of
from .csg_tree import DrawnTree
from .drawing import GREEN, GREY, RED, Lines, coloured, counted, faint, picture_of
from .lesson import Lesson, Play, Subject
from .picture import Picture, Row

LEAVES, OPERATIONS, ALL = "leaves", "operations", "all"

MOST_ROWS = 12
"""Nodes whose figures are listed."""


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    passes: int = setting(
        2, "Passes", "Passes so far: the first goes up, the next down; 0 is before them", minimum=0
    )
    volume: str = setting("aabb", "Volume", "What is put around nodes", choices=VOLUMES)
    shown: str = setting(
        LEAVES, "Shown", "Whose bounds are drawn over the model",
        choices={
            LEAVES: "Those of solids", OPERATIONS: "Those of set operations", ALL: "All of them",
        },
    )  # fmt: skip


class CsgCutting(Play):
    """The passes over one tree."""

    def __init__(self, subject: Subject, settings: Settings) -> None:
        self.scene = subject.scene
        self.tree = DrawnTree(subject.scene)
        geometry = self.tree.geometry
        self.cutting: Cutting = cutting_of(geometry, CuttingSettings(CUT, settings.volume))
        self.ends = {"passes": len(self.cutting.passes)}
        self.kind = self.cutting.kind
        self.model = lines_of_items(geometry, np.array([self.tree.item]))
        everything = np.zeros(len(geometry.nodes.kind), bool)
        self.states = [(self.cutting.own, everything)] + [
            (one.rows, one.is_pruned) for one in self.cutting.passes
        ]
        self.sizes = [self._sizes(rows, gone) for rows, gone in self.states]

    def _sizes(self, rows: np.ndarray, is_pruned: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return areas and volumes of the bounds of drawn nodes; inf of what has no end."""
        nodes = self.tree.nodes
        ends = is_closed(rows[nodes]) & ~is_pruned[nodes]
        areas = np.where(is_pruned[nodes], 0.0, np.inf)
        contents = areas.copy()
        if ends.any():
            volumes = self.kind.exactly(np.ascontiguousarray(rows[nodes[ends]]))
            areas[ends], contents[ends] = volumes.areas(), volumes.contents()
        return np.maximum(areas, 0.0), np.maximum(contents, 0.0)

    def picture(self, settings: Settings) -> Picture:
        """Return the bounds after so many passes."""
        tree, step = self.tree, settings.passes
        rows, is_pruned = self.states[step]
        gone = is_pruned[tree.nodes]
        which = np.ones(len(tree.nodes), bool)
        if settings.shown != ALL:
            which = tree.is_leaf == (settings.shown == LEAVES)
        if step == 0:  # operations have no bounds yet
            which &= tree.is_leaf
        parts = [
            coloured(self.model, faint(GREY, 0.3)),
            self._bounds(self.cutting.upward, which & (step > 0), True),
            self._bounds(rows, which & ~gone, False),
            tree.border(),
            *self._diagram(step, gone),
        ]
        return picture_of(parts, self._caption(step), marks=tree.marks(), rows=self._rows(step))

    def _bounds(self, rows: np.ndarray, which: np.ndarray, is_dashed: bool) -> Lines:
        """Return the edges of the bounds of some nodes, each in its colour."""
        tree = self.tree
        places = np.flatnonzero(which & is_closed(rows[tree.nodes]))
        if not len(places):
            return coloured(np.empty((0, 2, 3)), GREY)
        volumes = self.kind.exactly(np.ascontiguousarray(rows[tree.nodes[places]]))
        segments, owners = edges_of(volumes)
        colours = tree.colours[places[owners]].copy()
        if is_dashed:
            colours[:, 3] = 0.55
            dashes = dashes_of(segments)
            return Lines(dashes, np.repeat(colours, len(dashes) // max(len(segments), 1), axis=0))
        return Lines(segments, colours)

    def _diagram(self, step: int, gone: np.ndarray) -> list[Lines]:
        """Return the tree, with what is pruned and what the last pass has changed."""
        tree = self.tree
        segments, lower = tree.branches(), tree.below_branches()
        parts = [
            coloured(segments[~gone[lower]], GREY),
            coloured(dashes_of(segments[gone[lower]]), faint(RED, 0.7)),
            tree.squares(np.arange(len(tree.nodes)), tree.colours),
            tree.crosses(np.flatnonzero(gone), RED),
        ]
        if step > 1:
            changed = np.isin(tree.nodes, self.cutting.passes[step - 1].changed)
            places = np.flatnonzero(changed)
            parts.append(tree.squares(places, np.tile(GREEN, (len(places), 1)), 1.7))
        return parts

    def _caption(self, step: int) -> str:
        """Return what the last pass has done."""
        left_out = ""
        if self.tree.n_left_out:
            left_out = f"; {counted(self.tree.n_left_out, 'node', 'nodes')} below are left out"
        if step == 0:
            return "Before the first pass: every solid has a bound of its own" + left_out
        one = self.cutting.passes[step - 1]
        way = "up, from the leaves to the root" if one.direction == UP else "down, from the root"
        if step == 1:
            return f"Pass 1 goes {way}: what lies above is bounded by what lies below" + left_out
        changed = np.isin(self.tree.nodes, one.changed).sum()
        gone = int(one.is_pruned[self.tree.nodes].sum())
        pruned = f", {counted(gone, 'is', 'are')} pruned by now" if gone else ""
        return f"Pass {step} goes {way}: {changed} of {len(self.tree.nodes)} bounds become " + (
            f"smaller{pruned}{left_out}"
        )

    def _rows(self, step: int) -> list[Row]:
        """Return volumes before and after, of leaves together and of some nodes."""
        tree, names = self.tree, self.tree.names()
        areas, contents = self.sizes[step]
        own_areas, own = self.sizes[0 if step == 0 else 1]
        leaves = np.flatnonzero(tree.is_leaf & np.isfinite(own))
        rows = [
            Row(
                "Volume of Leaves", before_and_after(own[leaves].sum(), contents[leaves].sum()),
                "Sum over the bounds of solids, their own and what passes have left",
            ),
            Row(
                "Area of Leaves",
                before_and_after(own_areas[leaves].sum(), areas[leaves].sum()),
                "The same of their surfaces, by which random rays meet them",
            ),
            Row("Margin", f"{self.cutting.margin:.2g}", "How much larger rays are tested with"),
        ]  # fmt: skip
        for place in range(min(len(names), MOST_ROWS)):
            if step == 0 and not tree.is_leaf[place]:
                continue
            rows.append(
                Row(
                    f"{place + 1} {names[place]}", before_and_after(own[place], contents[place]),
                    "Volume of its bound, from below and now",
                )
            )  # fmt: skip
        return rows

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return all passes, up to five."""
        steps = range(min(self.ends["passes"], 4) + 1)
        return [Settings(step, settings.volume, settings.shown) for step in steps]


def is_closed(rows: np.ndarray) -> np.ndarray:
    """Say which bounds have an end on all sides, (n,) bool."""
    return np.isfinite(rows.reshape(len(rows), -1)).all(axis=1)


def before_and_after(before: float, after: float) -> str:
    """Return two volumes or areas in words."""
    texts = ["endless" if np.isinf(each) else f"{each:.4g}" for each in (before, after)]
    return texts[0] if texts[0] == texts[1] else f"{texts[0]}, now {texts[1]}"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Cut the trees."""
    progress.report(0, 1, "Cutting")
    return CsgCutting(subject, settings)


LESSONS = (
    Lesson(
        name="csg_cutting",
        label="Cutting a CSG Tree",
        slide='CSG tree "cutting"',
        begin="Every solid has a bound; bounds go up to the root, and what the root is bounded by "
        "cuts those below",
        look_for="Dashed are the bounds that solids have by themselves. An intersection makes both "
        "of its operands smaller, a difference only what is taken away; smaller operands make "
        "smaller nodes, and so further passes",
        question="Why may a difference cut what is taken away, but not the other way round?",
        answer="Outside of A there is nothing to take away from, so B matters within A's bound "
        "only. What B takes away from A is known where B is, not where its bound is: A's bound "
        "shrinks only if B surely covers a whole slice of it",
        source="geometry.csg.cutting",
        sample="csg_classic:length=2",
        Settings=Settings,
        play=play,
        film="passes",
        replays=("volume",),
    ),
)
