"""Lesson "kdop_levels", and what it is made of: one tree with several kinds of volumes, by levels.

The slides "K-DOP hierarchy": levels 0 to 3 of 6-, 14-, 18- and 26-DOPs, side by side. The tree is
the same in all copies, each node has a colour of its own, and leaves above a level are drawn with
it, so that the volumes of each picture contain everything.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..colours import ramp
from ..geometry.fit import fit_all
from ..progress import Progress
from ..settings import setting
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.tree import ranges_of
from .around import beside_each_other, edges_of
from .drawing import GREY, Lines, counted, items_in, opaque, picture_of, shifted
from .hierarchy import is_tree, tree_of
from .lesson import Lesson, Play, Subject
from .picture import Mark, Picture, Row

KINDS = {"kdop6": "6-DOP", "kdop14": "14-DOP", "kdop18": "18-DOP", "kdop26": "26-DOP"}

LEVELS = 4
"""Levels that the slides show."""

MOST_NODES = 64
"""Nodes of a level that are drawn: a 26-DOP has up to 72 edges, and there are four copies."""

MOST_ITEMS = 4000
"""Items that stand for the object in each copy."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    level: int = setting(2, "Level", "Level of the tree; the root has 0", minimum=0)


class VolumesByLevel(Play):
    """One tree with several kinds of volumes; one picture per level.

    Attributes
    ----------
    nodes : list of (n,) int64
        Of each level, those that are drawn.
    shown : list of int
        Of each level, how many there are.
    sums : list of dict
        Of each level, the surfaces of the drawn ones together, by kind.
    """

    def __init__(self, bvh: BVH, kinds: Mapping[str, str], levels: int, progress: Progress) -> None:
        self.scene, self.kinds = bvh.scene, kinds
        depths = bvh.depths()
        count = min(int(depths.max()) + 1, levels)
        self.ends = {"level": count - 1}
        self.body = items_in(bvh.scene, np.arange(len(bvh.scene)), GREY, 0.3, most=MOST_ITEMS)
        begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
        self.nodes: list[np.ndarray] = []
        self.shown: list[int] = []
        self.sums: list[dict[str, float]] = []
        self.lines: list[dict[str, Lines]] = []
        for level in range(count):
            is_shown = (depths == level) | ((bvh.arrays.size > 0) & (depths < level))
            nodes = np.flatnonzero(is_shown)
            largest = nodes[np.argsort(begin[nodes] - end[nodes], kind="stable")[:MOST_NODES]]
            nodes = np.sort(largest)
            corners, first, last = bvh.referred(begin[nodes], end[nodes], progress)
            sums, lines = {}, {}
            for kind in kinds:
                volumes = fit_all(kind, corners, first, last, progress)
                segments, owners = edges_of(volumes, progress=progress)
                lines[kind] = Lines(segments, opaque(ramp(owners / max(len(nodes) - 1, 1))))
                sums[kind] = float(volumes.areas(progress).sum())
            self.nodes.append(nodes)
            self.shown.append(int(is_shown.sum()))
            self.sums.append(sums)
            self.lines.append(lines)

    def parts(self, level: int) -> list[Any]:
        """Return what is drawn of a level: in each copy the object and its volumes."""
        parts: list[Any] = []
        places = beside_each_other(self.scene, len(self.kinds))
        for kind, place in zip(self.kinds, places, strict=True):
            if place.any():  # the object itself is there once
                parts.append(shifted(self.body, place))
            parts.append(shifted(self.lines[level][kind], place))
        return parts

    def caption(self, level: int) -> str:
        """Return the figures of a level in words."""
        nodes, sums = self.nodes[level], self.sums[level]
        text = f"Level {level}: {counted(len(nodes), 'volume', 'volumes')}"
        if len(nodes) < self.shown[level]:
            text += f", the largest of {self.shown[level]}"
        first, *_ = self.kinds
        whole = sums[first] or 1.0
        shares = ", ".join(f"{self.kinds[kind]} {area / whole:.2f}" for kind, area in sums.items())
        return f"{text}; surfaces together, in those of the {self.kinds[first]}s: {shares}"

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one level."""
        level = settings.level
        size = self.scene.upper - self.scene.lower
        above = self.scene.upper - np.array([size[0], 0.5 * size[1], -0.12 * size.max()])
        places = beside_each_other(self.scene, len(self.kinds))
        names = zip(self.kinds.values(), places, strict=True)
        marks = [Mark(above + place, name) for name, place in names]
        rows = [
            Row(name, f"{self.sums[level][kind]:.4g}",
                "Surfaces of the level's volumes together, in square scene units")
            for kind, name in self.kinds.items()
        ]  # fmt: skip
        rows.insert(0, Row("Volumes", str(self.shown[level]), "Nodes of the level, leaves above"))
        return picture_of(self.parts(level), self.caption(level), marks=marks, rows=rows)

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first levels."""
        return [Settings(level) for level in range(min(self.ends["level"] + 1, LEVELS))]


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Fit the volumes of the upper levels."""
    return VolumesByLevel(tree_of(subject), KINDS, LEVELS, progress)


LESSONS = (
    Lesson(
        name="kdop_levels",
        label="A k-DOP Hierarchy",
        slide="K-DOP hierarchy",
        begin="The same tree with four kinds of k-DOPs, level by level",
        look_for="A further direction never makes a volume looser: 26 has the least surface on "
        "every level; 14 and 18 have different directions, and neither is always better",
        question="The 26-DOPs have the least surface on every level. Why does hardly any ray "
        "tracer use them?",
        answer="Their test takes 13 strips instead of 3, and a node 26 numbers instead of 6: B "
        "grows more than p falls. They pay where a test is dear, as between objects that collide",
        source="geometry.kdop",
        sample="suzanne:subdivisions=1",
        structures=("bvh",),
        suits=is_tree,
        Settings=Settings,
        play=play,
        film="level",
    ),
)
