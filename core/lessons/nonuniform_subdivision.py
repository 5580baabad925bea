"""Lesson "nonuniform subdivision": the same ray through an octree and through a grid.

The lecture's slide "Nonuniform subdivision of space": 13 cells of an octree, 17 of a grid, and 3
objects tested in both. Its scene is the sample ``nonuniform``; over any other the figures are
those of that scene. The grid has as many cells along each axis as the octree has at its deepest
level, so the smallest cells of both are alike.

Both structures are drawn where the plane of the ray cuts them. Orange are the cells with objects
that the ray has entered, blue the empty ones, red the last; tested objects are green.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..contract.events import TEST
from ..contract.structure import Structure
from ..geometry.instances import lines_of_items
from ..progress import Progress
from ..settings import setting
from .drawing import BLUE, GREEN, GREY, ORANGE, RED, Faces, Lines, coloured, counted, picture_of
from .lesson import Lesson, Play, Subject, only_its_own
from .one_ray import Counted, Walked, ray_of
from .picture import Mark, Picture, Row
from .section import (
    FAINT,
    MOST_PIECES,
    Plane,
    contour,
    left_out_text,
    model_with,
    outline_beside,
    place_beside,
    section_of,
    title_place,
)

MOST_TESTED = 200
"""Tested objects that are drawn, the last."""

FILL = 0.3
"""Opacity of cells that were entered."""


@dataclass(frozen=True)
class Settings:
    """The knob of the lesson."""

    cells: int = setting(
        99, "Cells", "How many cells the ray has entered, in both structures", minimum=0
    )


class Entered:
    """One structure's share of the picture: its section, filled along the ray."""

    def __init__(self, structure: Structure, walked: Walked, plane: Plane, shift: np.ndarray):
        self.structure, self.walked, self.plane, self.shift = structure, walked, plane, shift
        leaves = np.flatnonzero(walked.cells.is_leaf)
        self.section = section_of(walked.cells, leaves, plane, 2).moved(shift)
        entered = section_of(walked.cells, np.unique(walked.places), plane)
        self.entered = entered.moved(shift).raised(structure.scene)

    def tested(self, count: int) -> np.ndarray:
        """Return the items that are tested in the first cells, each once."""
        steps, visits = self.walked.steps, self.walked.visits
        last = visits[count] if count < len(visits) else len(steps)
        return np.unique(steps.primitive[steps.events_of(TEST, last - 1)])

    def parts(self, count: int) -> list[Lines | Faces]:
        """Return what is drawn when the ray has entered so many cells."""
        walked = self.walked
        count = min(count, len(walked.visits))
        colours = np.zeros((len(walked.cells), 4))
        colours[:] = *GREY[:3], FAINT
        places, is_empty = walked.places[:count], walked.is_empty[:count]
        fills = colours.copy()
        fills[places] = *ORANGE[:3], FILL
        fills[places[is_empty]] = *BLUE[:3], FILL
        parts: list[Lines | Faces] = [self.section.lines(colours)]
        entered = self.entered.of(places)
        colours[places], colours[places[is_empty]] = ORANGE, BLUE
        parts += [entered.faces(fills), entered.lines(colours)]
        if 0 < count < len(walked.visits):
            colours[places[-1]] = RED
            parts.append(self.entered.of(places[-1:]).lines(colours))
        until = float(walked.steps.t_exit[walked.visits[count - 1]]) if count else -np.inf
        until = np.inf if count == len(walked.visits) else until
        return parts + list(walked.ray_lines(self.shift, until))


class NonuniformSubdivision(Play):
    """One ray through two subdivisions."""

    def __init__(self, structures: Sequence[Structure], walked: Sequence[Walked], plane: Plane):
        self.scene, self.plane, self.ray = structures[0].scene, plane, walked[0]
        self.both = [
            Entered(structure, walk, plane, place_beside(self.scene, number))
            for number, (structure, walk) in enumerate(zip(structures, walked, strict=True))
        ]
        self.contour = contour(self.scene, plane, 2)
        self.ends = {"cells": max(max(len(walk.visits) for walk in walked), 1)}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of a ray that has entered so many cells of each."""
        parts: list[Lines | Faces] = [*model_with(self.scene, self.plane), *self.ray.ray_lines()]
        marks, rows, told = [], [], []
        for each in self.both:
            counts, name = each.walked.counts, each.structure.label
            count = min(settings.cells, len(each.walked.visits))
            tested = each.tested(count)
            parts += each.parts(count)
            parts.append(outline_beside(self.contour, each.shift))
            lines = lines_of_items(self.scene.geometry, tested[-MOST_TESTED:])[:MOST_PIECES]
            parts.append(coloured(lines + each.shift, GREEN))
            cells = counted(count, "cell", "cells")
            marks.append(Mark(title_place(self.scene, self.plane, each.shift), f"{name}: {cells}"))
            told.append(
                f"{name}: {cells} of {counts['N_ETS']}, "
                f"{counted(len(tested), 'object', 'objects')} tested"
            )
            rows += [
                Row(f"{name}: Cells", str(counts["N_ETS"]), "Leaves or cells that the ray enters"),
                Row(f"{name}: Empty", str(counts["N_EETS"]), "Empty ones among them"),
                Row(f"{name}: Tests", str(counts["N_IT"]), "Objects that are tested"),
                Row(
                    f"{name}: Cells in All", f"{each.walked.cells.is_leaf.sum():,}",
                    "Leaves or cells of the whole structure",
                ),
            ]  # fmt: skip
        left_out = left_out_text(each.section for each in self.both)
        return picture_of(parts, "; ".join(told) + left_out, marks=marks, rows=rows)


ENOUGH = 13
"""Cells of the octree that make a telling ray, such as the slide's."""


def enters_enough(counted_in: Sequence[Counted], hits: np.ndarray) -> np.ndarray:
    """Prefer rays that are tested, enter many cells of the octree, and more of the grid."""
    octree, grid = counted_in
    is_tested = (octree["N_IT"] > 0) & (grid["N_IT"] > 0)
    return np.minimum(octree["N_ETS"], ENOUGH) * is_tested - (octree["N_ETS"] >= grid["N_ETS"])


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record the ray in both structures."""
    progress.report(0, 3, "Choosing a ray")
    rays = ray_of(subject, subject.structures, enters_enough, progress)
    walked = []
    for number, structure in enumerate(subject.structures):
        progress.report(1 + number, 3, f"Following the ray through {structure.name}")
        walked.append(Walked.of(structure, rays, progress))
    plane = Plane.through_ray(rays.origins[0], rays.directions[0])
    return NonuniformSubdivision(subject.structures, walked, plane)


LESSONS = (
    Lesson(
        name="nonuniform_subdivision",
        label="Nonuniform Subdivision: Octree and Grid",
        slide="Nonuniform subdivision of space",
        begin="A subdivision that adapts itself has small cells where objects are, and large ones "
        "where there is nothing to tell apart",
        look_for="Where the ray crosses empty space the octree takes one large step and the grid "
        "several small ones; near the objects their cells are the same",
        question="In which scene would the octree be no better than the grid?",
        answer="In one that is equally dense everywhere: then all leaves lie at the same depth, "
        "the cells are those of the grid, and the way down to each comes on top",
        source="structures.octree.build",
        sample="nonuniform",
        structures=(
            "octree:max_depth=4,max_leaf_size=1,padding=0,assignment=box,mailbox=true",
            "grid:resolution=16x16x16,padding=0,mailbox=true",
        ),
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="cells",
        takes_ray=True,
    ),
)
