"""Lesson "adaptive traversal": five walks through one tree along one ray, event by event.

As on the slide "Traversing adaptive subdivision": marching from the root, segments by
preprocessing, neighbours (found, or by stored links), depth-first with a stack, and with a heap.
All enter the same leaves in the same order (:mod:`..structures.subdivision.walks`); they differ in
how they find the next one, and in what they have to remember meanwhile.

A plane through the ray cuts the tree. Orange and blue are the leaves entered so far, with objects
and empty; red is the node of the event; yellow is what the walk remembers. For one walk alone, a
column beside it lists that: the stack, the heap, the list of segments or the nodes above.

What is remembered follows from the log: a node is put aside when its parent is entered, and is on
the stack or in the heap until it is entered or skipped itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contract.events import SKIP, VISIT_EMPTY, VISIT_INNER, VISIT_LEAF
from ..errors import InputError
from ..progress import Progress
from ..settings import setting
from ..structures.subdivision.structure import LinkedSubdivision
from .column import YELLOW, column_beside
from .drawing import BLUE, GREY, ORANGE, RED, Faces, Lines, counted, picture_of
from .lesson import Lesson, Play, Subject
from .one_ray import Walked, near, ray_of
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    Plane,
    contour,
    left_out_text,
    model_with,
    outline_beside,
    place_beside,
    section_of,
    title_place,
)


class Kind(NamedTuple):
    """A walk: what the settings call it and its links, its names, and what it remembers."""

    walk: str
    links: str
    label: str
    short: str
    one: str
    many: str


WALKS = {
    "march": Kind("march", "found", "From the Root", "Root", "", "nothing"),
    "segments": Kind("segments", "found", "Segments", "Segments", "segment or node",
                     "segments and nodes"),
    "neighbours": Kind("neighbours", "found", "Neighbours Found", "Found", "node above",
                       "nodes above"),
    "ropes": Kind("neighbours", "stored", "Neighbour Links", "Links", "",
                  "nothing but stored links"),
    "recursive": Kind("recursive", "found", "Recursive, Stack", "Stack", "node on the stack",
                      "nodes on the stack"),
    "heap": Kind("heap", "found", "Heap", "Heap", "node in the heap", "nodes in the heap"),
}  # fmt: skip

ENTERING = VISIT_INNER, VISIT_LEAF, VISIT_EMPTY


DOINGS = {
    int(VISIT_INNER): "enters inner node",
    int(VISIT_LEAF): "enters leaf",
    int(VISIT_EMPTY): "enters empty leaf",
    int(SKIP): "throws away node",
}


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    walk: str = setting(
        "all",
        "Walk",
        "How the next leaf is found",
        choices={"all": "All of them beside each other"}
        | {name: kind.label for name, kind in WALKS.items()},
    )
    event: int = setting(
        20, "Event", "Events of the walk so far; a walk that is shorter has ended", minimum=0
    )


class WalkShown:
    """One walk: its log, and what it remembers after every event."""

    def __init__(self, name: str, walked: Walked, plane: Plane) -> None:
        self.name, self.walked = name, walked
        self.kind, self.label = WALKS[name], WALKS[name].label
        steps, cells = walked.steps, walked.cells
        self.parents = dict(zip(cells.numbers.tolist(), cells.parents.tolist(), strict=True))
        self.events = np.flatnonzero(np.isin(steps.kind, (*ENTERING, SKIP)) & (steps.level == 0))
        self.nodes = steps.cell[self.events]
        self.kinds = steps.kind[self.events]
        self.held = self._held()
        places = cells.places_of(np.unique(self.nodes))
        self.section = section_of(cells, places, plane, len(WALKS))
        self.leaves = section_of(cells, np.flatnonzero(cells.is_leaf), plane, len(WALKS))

    def _held(self) -> np.ndarray:
        """Return from which event to which each node is put aside, (n, 3): node, first, last."""
        if self.name in ("march", "neighbours", "ropes"):
            return np.empty((0, 3), np.int64)
        entered: dict[int, int] = {}
        found = []
        for event, node in enumerate(self.nodes.tolist()):
            above = self.parents[node]
            pushed = entered[above] if above >= 0 else -1
            entered[node] = event
            # What is entered right after its parent was never put aside, but by a heap.
            if pushed >= 0 and (self.name == "heap" or event > pushed + 1):
                found.append((node, pushed, event))
        return np.array(found, np.int64).reshape(-1, 3)

    def remembered(self, event: int) -> list[int]:
        """Return the nodes that are remembered after an event, what comes next first."""
        if self.name == "neighbours":
            above, node = [], self.parents[int(self.nodes[event])]
            while node >= 0:
                above.append(node)
                node = self.parents[node]
            return above
        there = self.held[(self.held[:, 1] <= event) & (event < self.held[:, 2])]
        return there[np.argsort(there[:, 2], kind="stable"), 0].tolist()

    @property
    def most(self) -> int:
        """How much is remembered at most."""
        return max((len(self.remembered(event)) for event in range(len(self.nodes))), default=0)

    def parts(self, event: int, shift: np.ndarray) -> list[Lines | Faces]:
        """Return the section after an event."""
        walked, cells = self.walked, self.walked.cells
        colours = np.tile((*GREY[:3], FAINT), (len(cells), 1))
        parts: list[Lines | Faces] = [self.leaves.moved(shift).lines(colours)]
        if not len(self.nodes):
            return parts + list(walked.ray_lines(shift))
        so_far, kinds = self.nodes[: event + 1], self.kinds[: event + 1]
        section = self.section.moved(shift).raised(walked.structure.scene)
        for kind, colour in ((VISIT_LEAF, ORANGE), (VISIT_EMPTY, BLUE)):
            places = cells.places_of(so_far[kinds == kind])
            fills = np.tile((*colour[:3], 0.3), (len(cells), 1))
            colours[places] = colour
            parts += [section.of(places).faces(fills), section.of(places).lines(colours)]
        held = cells.places_of(np.array(self.remembered(event), np.int64))
        colours[held] = YELLOW
        parts.append(section.of(held).lines(colours))
        now = cells.places_of(so_far[-1:])
        colours[now] = RED
        parts.append(section.of(now).raised(walked.structure.scene).lines(colours))
        last = event == len(self.nodes) - 1
        return parts + list(walked.ray_lines(shift, np.inf if last else self.reached(event)))

    def reached(self, event: int) -> float:
        """Return the t up to which leaves have been entered."""
        at = self.events[: event + 1]
        leaves = at[np.isin(self.walked.steps.kind[at], (VISIT_LEAF, VISIT_EMPTY))]
        return float(self.walked.steps.t_exit[leaves].max(initial=-np.inf))

    def row(self) -> Row:
        """Return the figures of the walk."""
        counts = self.walked.counts
        memory = f"remembers {self.kind.many}"
        if self.kind.one:
            memory = f"remembers up to {counted(self.most, self.kind.one, self.kind.many)}"
        return Row(
            self.label,
            f"N_TS {counts['N_TS']}, leaves {counts['N_ETS']}, N_IT {counts['N_IT']}; {memory}",
            "Steps with inner nodes, leaves among them, tests; what is kept at most",
        )


class AdaptiveTraversal(Play):
    """The walks of one tree."""

    def __init__(self, walks: Sequence[WalkShown], plane: Plane, links: int) -> None:
        self.walks = {each.name: each for each in walks}
        self.scene, self.plane = walks[0].walked.structure.scene, plane
        self.contour, self.links = contour(self.scene, plane, len(WALKS)), links
        self.left_out = left_out_text([walks[0].leaves])
        self.ends = {"event": max(max(len(each.nodes) for each in walks) - 1, 0)}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture after an event."""
        parts: list[Lines | Faces] = list(model_with(self.scene, self.plane))
        rows = [each.row() for each in self.walks.values()]
        rows.append(Row("Stored Links", str(self.links), "Six for every leaf of the tree"))
        marks = []
        if settings.walk == "all":
            told = []
            for number, each in enumerate(self.walks.values()):
                event = min(settings.event, len(each.nodes) - 1)
                shift = place_beside(self.scene, number, 3)
                parts += each.parts(event, shift)
                parts.append(outline_beside(self.contour, shift))
                count = each.walked.counts["N_TS"]
                marks.append(
                    Mark(title_place(self.scene, self.plane, shift), f"{each.kind.short}: {count}")
                )
                told.append(f"{each.label} {event + 1} of {len(each.nodes)}")
            caption = f"Events: {', '.join(told)}{self.left_out}"
            return picture_of(parts, caption, marks=marks, rows=rows)
        each = self.walks[settings.walk]
        event = min(settings.event, len(each.nodes) - 1)
        shift = place_beside(self.scene, 0)
        parts += [*each.walked.ray_lines(), *each.parts(event, shift)]
        parts.append(outline_beside(self.contour, shift))
        marks.append(Mark(title_place(self.scene, self.plane, shift), each.label))
        if event < 0:
            return picture_of(parts, "The ray misses the tree", marks=marks, rows=rows)
        remembered = each.remembered(event)
        entries = [self.entry(each, event, node) for node in remembered]
        column, names = column_beside(
            self.scene, self.plane, each.walked.rays.directions[0], shift,
            each.kind.many.capitalize(), entries, YELLOW,
        )  # fmt: skip
        memory = each.kind.many
        if each.kind.one:
            memory = counted(len(remembered), each.kind.one, each.kind.many)
        caption = (
            f"{each.label}, event {event + 1} of {len(each.nodes)}: {self.words(each, event)}; "
            f"it remembers {memory}{self.left_out}"
        )
        return picture_of([*parts, column], caption, marks=[*marks, *names], rows=rows)

    def words(self, each: WalkShown, event: int) -> str:
        """Say what an event is."""
        kind, node = int(each.kinds[event]), int(each.nodes[event])
        number = int(each.events[event])
        enter = each.walked.steps.t_enter[number]
        return f"{DOINGS[kind]} {node} at t = {enter:.4g}"

    def entry(self, each: WalkShown, event: int, node: int) -> str:
        """Return the text of a remembered node."""
        if each.name == "neighbours":
            return f"node {node}"
        later = np.flatnonzero(each.nodes == node)[-1]
        return f"{node}, t = {each.walked.steps.t_enter[each.events[later]]:.3g}"


def has_linked_leaves(structure: object) -> str:
    """Accept trees that all walks go through, see :attr:`.lesson.Lesson.suits`."""
    if not isinstance(structure, LinkedSubdivision):
        return f"{getattr(structure, 'label', structure)} is no octree or kd-tree"
    if getattr(structure.settings, "lazy", False):
        return "its cells are not made yet; build it without lazy cells"
    return ""


ENOUGH = 9
"""Leaves that make a telling ray."""


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record all walks."""
    tree = subject.structures[0]
    assert isinstance(tree, LinkedSubdivision)
    progress.report(0, len(WALKS) + 1, "Choosing a ray")
    rays = ray_of(subject, [tree], near(ENOUGH), progress)
    plane = Plane.through_ray(rays.origins[0], rays.directions[0])
    cells = tree.cells(progress)
    shown = []
    for number, (name, kind) in enumerate(WALKS.items()):
        progress.report(1 + number, len(WALKS) + 1, f"Walking: {kind.label}")
        walked = Walked.of(tree.walked_by(kind.walk, kind.links), rays, progress, cells)
        shown.append(WalkShown(name, walked, plane))
    if not len(shown[0].nodes):
        raise InputError("this ray misses the tree; choose one that enters it")
    return AdaptiveTraversal(shown, plane, int((tree.ropes >= 0).sum()))


LESSONS = (
    Lesson(
        name="adaptive_traversal",
        label="Five Walks Through a Tree of Cells",
        slide="Traversing adaptive subdivision",
        begin="The next leaf along a ray can be found from the root, by cutting the ray "
        "beforehand, through links to neighbours, or depth-first with what was put aside",
        look_for="All walks enter the same leaves in the same order; from the root remembers "
        "nothing and comes down again for every leaf, segments cut the ray behind the hit as well, "
        "a stack remembers a few nodes, links are stored in the tree",
        question="Why does a heap, ordered by where the ray enters, need no sorting of children?",
        answer="Whatever is put into it, the nearest comes out first; the stack has to be given "
        "the far child before the near one",
        source="structures.subdivision.walks",
        sample="suzanne:subdivisions=1",
        structures=("octree:max_depth=4,max_leaf_size=16",),
        suits=has_linked_leaves,
        Settings=Settings,
        play=play,
        film="event",
        takes_ray=True,
    ),
)
