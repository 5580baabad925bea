"""Lesson "csg_intervals": where one ray is inside, node by node up a CSG tree.

Every node has a bar: where the line of the ray is inside of it. Leaves are asked, operations merge
the bars of both operands. What the walk did not ask has no bar: its bound was missed, or there was
nothing left to take away from. All of it is read from the log that the kernel writes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.csg import OF_TREE
from ..contract.events import SKIP, TEST, VISIT_INNER, VISIT_LEAF, VOLUME_TEST, WITHIN
from ..contract.steps import Steps
from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.csg.trees import INTERSECTION, NOTHING, UNION
from ..geometry.instances import lines_of_items
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..progress import Progress
from ..settings import setting
from .csg_tree import DrawnTree, frame_between, geometry_of, name_of
from .drawing import (
    GREEN,
    GREY,
    ORANGE,
    RED,
    Chart,
    Faces,
    Lines,
    coloured,
    faint,
    outlines,
    picture_of,
)
from .lesson import Lesson, Play, Subject
from .one_ray import RAY, Counted, ray_of
from .picture import Mark, Picture, Row

MOST_BARS = 40
"""Nodes that have a row."""

FOUND, MISSED, UNASKED = "found", "missed", "unasked"


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    node: int = setting(6, "Node", "Nodes that are done so far; the first is 0", minimum=0)


class Done(NamedTuple):
    """What became of a node.

    Attributes
    ----------
    node : int
    how : {FOUND, MISSED, UNASKED}
    intervals : (k, 2) float64
        Of t; empty if the line is nowhere inside.
    """

    node: int
    how: str
    intervals: np.ndarray


def done_in(steps: Steps, structure: Structure, item: int) -> list[Done]:
    """Return what became of the nodes of a tree, in the order in which they were finished."""
    geometry = geometry_of(structure.scene)
    nodes = geometry.pruned
    tests = steps.events_of(TEST)
    tests = tests[(steps.level[tests] == 0) & (steps.primitive[tests] == item)]
    if not len(tests):
        return []
    before = steps.events_of(TEST)
    before = before[(steps.level[before] == 0) & (before < tests[0])]
    begin = int(before[-1]) + 1 if len(before) else 0
    events = np.arange(begin, int(tests[0]))
    events = events[steps.level[events] == OF_TREE]
    kinds, of = steps.kind[events], steps.cell[events]
    how: dict[int, str] = {}
    for kind, node, t in zip(kinds.tolist(), of.tolist(), steps.t_enter[events], strict=True):
        if kind in (VISIT_INNER, VISIT_LEAF):
            how[node] = FOUND
        elif kind == VOLUME_TEST and np.isinf(t):
            how[node] = MISSED
        elif kind == SKIP:
            how[node] = UNASKED
    within: dict[int, list[tuple[float, float]]] = {}
    for event in events[kinds == WITHIN].tolist():
        ends = float(steps.t_enter[event]), float(steps.t_exit[event])
        within.setdefault(int(steps.cell[event]), []).append(ends)
    # As the walk does it: the left operand, the right one, the node itself.
    order: list[int] = []
    waiting = [(int(geometry.starts[item]), False)]
    while waiting:
        node, is_left_behind = waiting.pop()
        if node not in how:
            continue
        if is_left_behind or how[node] != FOUND or nodes.left[node] == NOTHING:
            order.append(node)
            continue
        waiting += [(node, True), (int(nodes.right[node]), False), (int(nodes.left[node]), False)]
    for node in order:
        left, right = int(nodes.left[node]), int(nodes.right[node])
        # The walk goes on with the one operand that is met: so the node is that operand.
        if how.get(left) == MISSED and nodes.kind[node] == UNION:
            within[node] = within.get(right, [])
        elif how.get(right) == MISSED and nodes.kind[node] != INTERSECTION:
            within[node] = within.get(left, [])
    return [Done(node, how[node], np.array(within.get(node, [])).reshape(-1, 2)) for node in order]


class CsgIntervals(Play):
    """One ray through one tree."""

    def __init__(self, structure: Structure, rays: Rays) -> None:
        self.scene, self.rays = structure.scene, rays
        geometry = geometry_of(structure.scene)
        steps = structure.record(rays, 0)
        self.hit = float(structure.trace(rays)[0].t[0])
        for item in np.flatnonzero(geometry.is_tree).tolist():
            self.done = done_in(steps, structure, item)
            if self.done:
                self.item = item
                break
        else:
            raise InputError("this ray meets no CSG tree; choose one that does")
        self.tree = DrawnTree(structure.scene, self.item)
        drawn = set(self.tree.nodes.tolist())
        self.done = [each for each in self.done if each.node in drawn][-MOST_BARS:]
        self.rows = [node for node in self.tree.nodes if node in {e.node for e in self.done}]
        self.ends = {"node": len(self.done) - 1}
        self.model = lines_of_items(geometry, np.array([self.item]))
        self.span = self._span()
        size = float(np.ptp(self.model.reshape(-1, 3), axis=0).max())
        foot = self.model.reshape(-1, 3).min(axis=0)
        width = float(np.ptp(self.model.reshape(-1, 3), axis=0)[0]) + size * 0.3
        height = size * min(0.11 * len(self.rows), 1.4)
        corner = np.array([foot[0], foot[1], foot[2] - 0.2 * size - height])
        self.chart = Chart(
            corner, np.array([width, 0, 0]), np.array([0, 0, height]), *self.span,
            float(len(self.rows)),
        )  # fmt: skip
        self.size = size

    def _span(self) -> tuple[float, float]:
        """Return between which t bars are drawn: where solids are."""
        ends = np.concatenate([each.intervals.ravel() for each in self.done] + [[0.0]])
        box = self.model.reshape(-1, 3)
        direction = self.rays.directions[0]
        along = (box - self.rays.origins[0]) @ direction / (direction @ direction)
        finite = ends[np.isfinite(ends) & (ends != 0.0)]
        low = finite.min(initial=float(along.max()))
        high = finite.max(initial=float(along.min()))
        if low >= high:
            low, high = float(along.min()), float(along.max())
        room = 0.12 * (high - low)
        return low - room, high + room

    def picture(self, settings: Settings) -> Picture:
        """Return the bars of the nodes that are done so far."""
        so_far = self.done[: settings.node + 1]
        now = so_far[-1]
        # With room for the names to the right.
        room = frame_between(
            float(self.chart.across[0]) + 0.75 * self.size,
            -0.15 * self.size, float(self.chart.upwards[2]) + 0.05 * self.size,
        )  # fmt: skip
        parts: list[Lines | Faces] = [
            coloured(self.model, faint(GREY, 0.35)), *self._ray(now),
            coloured(outlines((self.chart.origin + room)[None]), faint(GREY, 0.25)),
        ]  # fmt: skip
        for each in so_far:
            parts += self._bar(each, each is now)
        geometry, marks = self.tree.geometry, []
        for row, node in enumerate(self.rows):
            place = self.tree.number[int(node)]
            indent = 0.025 * self.size * int(self.tree.depths[place])
            name = name_of(geometry, int(node))
            known = next((each for each in so_far if each.node == node), None)
            if known is not None and known.how != FOUND:
                name += ", bound missed" if known.how == MISSED else ", not asked"
            at = self.chart.at(1.0, 1.0 - (row + 0.5) / len(self.rows))
            colour = tuple(self.tree.colours[place, :3])
            marks.append(Mark(at + np.array([0.03 * self.size + indent, 0, 0]), name, colour))
        marks.append(Mark(self.chart.at(0.97, -0.14), "t along the ray"))
        if np.isfinite(self.hit):
            parts.append(self._star())
        rows = [
            Row("Nodes Done", str(len(so_far)), "Whose intervals are known"),
            Row("Intervals", in_words(now.intervals), "Of the last of them, in t"),
            Row("Hit", f"t = {self.hit:.6g}" if np.isfinite(self.hit) else "none",
                "The first boundary of the root that lies before the ray"),
        ]  # fmt: skip
        return picture_of(parts, self._caption(now), marks=marks, rows=rows)

    def _bar(self, each: Done, is_now: bool) -> list[Lines | Faces]:
        """Return the bar of a node: where the line is inside."""
        row = next(i for i, node in enumerate(self.rows) if node == each.node)
        top = len(self.rows) - row
        low, high = top - 0.8, top - 0.2
        line = self.chart.points(np.array(self.span), np.full(2, top - 0.5))[None]
        parts: list[Lines | Faces] = [coloured(line, faint(GREY, 0.5))]
        if each.how != FOUND:
            colour = RED if each.how == MISSED else ORANGE
            return [coloured(line, faint(colour, 0.6))]
        colour = self.tree.colours[self.tree.number[each.node]]
        for begin, end in np.clip(each.intervals, *self.span):
            edges, faces = self.chart.blocks(
                np.array([begin]), np.array([end]), np.array([low]), np.array([high]),
                tuple(colour), 0.8 if is_now else 0.45,
            )  # fmt: skip
            parts += [edges, faces]
        return parts

    def _ray(self, now: Done) -> list[Lines]:
        """Return the ray, and in green where it is inside of the node that was done last."""
        parts = [coloured(self._between(np.array([self.span])), RAY)]
        if len(now.intervals):
            parts.append(coloured(self._between(np.clip(now.intervals, *self.span)), GREEN))
        return parts

    def _between(self, ends: np.ndarray) -> np.ndarray:
        """Return the pieces of the line between pairs of t, (k, 2, 3)."""
        return self.rays.origins[0] + ends[:, :, None] * self.rays.directions[0]

    def _star(self) -> Lines:
        """Return a star where the ray hits."""
        at = self._between(np.array([[self.hit, self.hit]]))[0, :1]
        return coloured(stars(at, np.array([0.05 * self.size])), GREEN)

    def _caption(self, now: Done) -> str:
        """Say what became of the last node."""
        geometry = self.tree.geometry
        name, node = name_of(geometry, now.node), now.node
        if now.how == MISSED:
            return f"The ray misses the bound of a {name}: nothing below is asked"
        if now.how == UNASKED:
            return f"A {name} is not asked: without the other operand its node is nothing"
        found = in_words(now.intervals)
        if geometry.pruned.left[node] == NOTHING:
            return f"The ray is inside of a {name}: {found}"
        pruned = geometry.pruned
        left = name_of(geometry, int(pruned.left[node]))
        right = name_of(geometry, int(pruned.right[node]))
        return f"The {name} of {left} and {right}: {found}"

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first leaf, some between, and the root."""
        last = self.ends["node"]
        return [Settings(n) for n in sorted({0, last // 3, 2 * last // 3, last})]


def in_words(intervals: np.ndarray) -> str:
    """Return intervals of t in words."""
    if not len(intervals):
        return "nowhere"
    return ", ".join(f"{begin:.4g} to {end:.4g}" for begin, end in intervals)


def many_nodes(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
    """Prefer rays that hit and meet many leaves."""
    counts = counted_in[0]
    return counts["csg_tests"] + 2 * hits


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Choose a ray, and record it."""
    geometry_of(subject.scene)
    progress.report(0, 2, "Choosing a ray")
    rays = ray_of(subject, subject.structures[:1], many_nodes, progress, is_oblique=True)
    progress.report(1, 2, "Following the ray")
    return CsgIntervals(subject.structures[0], rays)


LESSONS = (
    Lesson(
        name="csg_intervals",
        label="One Ray in a CSG Tree",
        slide='CSG tree "cutting"',
        begin="A solid is where the ray is inside of it: an interval of t, and a set operation is "
        "done on intervals",
        look_for="A union covers what either bar covers, an intersection what both do, a "
        "difference what only the first does. The hit is the first end of a bar of the root",
        question="Why is the nearest hit of a leaf not enough to find that of the tree?",
        answer="It may be taken away, or lie outside of the other operand; then the next boundary "
        "counts, which may be that of what was taken away. So both ends of every interval are "
        "needed, behind the ray's origin too",
        source="geometry.csg.intervals",
        sample="csg_classic:length=2",
        structures=("bvh",),
        Settings=Settings,
        play=play,
        film="node",
        takes_ray=True,
    ),
)
