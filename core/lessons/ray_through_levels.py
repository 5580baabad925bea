"""Lesson "ray through levels": a ray in the world, and moved into the space of an instance.

On the left the scene with the nodes of the top level that the ray enters, event by event. When it
enters an instance it is moved into the space of its mesh, which stands on the right, and walks
there. The t along it are the same on both sides, for its direction is not made a unit vector again.

Magenta: what the event is about. Grey: inner nodes; orange: leaves. Green: the hit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contract.events import ENTER, HIT, TEST, VISIT_INNER, VISIT_LEAF
from ..contract.steps import Steps
from ..contract.within import chains_of
from ..geometry.box_shape import box_segments
from ..geometry.instances import inverted, levels_of_mesh
from ..geometry.marks import stars
from ..geometry.rays import Rays
from ..progress import Progress
from ..settings import setting
from ..structures.two_level import TwoLevel
from .drawing import GREEN, GREY, ORANGE, Lines, coloured, extent_of, faint, picture_of, tinted
from .lesson import Lesson, Play, Subject
from .object_space import ObjectSpace, is_two_level
from .one_ray import RAY, Walked, candidates
from .picture import Mark, Picture, Row
from .ray import MAGENTA
from .ray import up_to as up_to_event
from .walk_in_words import event_text

MOST_CELLS = 150


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    event: int = setting(0, "Event", "Event of the walk; the first is 0", minimum=0)
    ray: int = setting(
        0, "Ray", "Which ray; those that enter two or three instances come first", minimum=0
    )


class Through(Play):
    """The walk of one ray through both levels."""

    def __init__(self, subject: Subject, settings: Settings, progress: Progress) -> None:
        structure = subject.structures[0]
        assert isinstance(structure, TwoLevel)
        self.structure, self.scene = structure, structure.scene
        rays = candidates(self.scene, is_oblique=True) if subject.rays is None else subject.rays
        hits, counts = structure.trace(rays, progress=progress)
        order = np.arange(len(rays))
        if subject.rays is None:
            # Two instances, the second of them hit, and a walk that is not long.
            entered, vain = counts["instances_entered"], counts["entered_in_vain"]
            worth = 3 * (hits.primitive >= 0) + (entered > 1) + (vain > 0) - (entered > 4)
            order = np.lexsort([counts["N_TS_1"], -worth])
        number = int(order[min(settings.ray if subject.rays is None else subject.ray,
                               len(rays) - 1)])  # fmt: skip
        self.rays: Rays = rays.select(np.array([number]))
        self.walked = Walked.of(structure, self.rays, progress)
        self.steps: Steps = self.walked.steps
        self.chains = chains_of(self.steps, self.walked.structure.levels)
        self.inverse, _ = inverted(self.scene.geometry.matrices)
        self.spaces: dict[int, ObjectSpace] = {}
        self.ends = {"event": len(self.steps) - 1, "ray": len(rays) - 1}

    def instance_at(self, event: int) -> int:
        """Return the instance that the ray is in at an event, or was in last; -1 before any."""
        steps = self.steps
        if steps.level[event] > 0:
            return int(self.chains[event, 0])
        entered = steps.events_of(ENTER, event)
        entered = entered[steps.level[entered] == 0]
        return int(steps.primitive[entered[-1]]) if len(entered) else -1

    def space(self, instance: int) -> ObjectSpace:
        """Return the space of the mesh of an instance."""
        mesh = int(self.scene.geometry.which[instance])
        if mesh not in self.spaces:
            geometry = self.scene.geometry.meshes[mesh]
            self.spaces[mesh] = ObjectSpace(self.scene, self.structure, geometry)
        return self.spaces[mesh]

    def picture(self, settings: Settings) -> Picture:
        """Return both sides up to an event."""
        event, steps, walked = settings.event, self.steps, self.walked
        up_to = np.arange(len(steps)) <= event
        own = up_to & (steps.level == 0)
        boxes, geometry = walked.cells, self.scene.geometry
        parts = [coloured(box_segments(geometry.boxes[:MOST_CELLS]), faint(GREY, 0.15))]
        for kind, colour in ((VISIT_INNER, faint(GREY, 0.6)), (VISIT_LEAF, ORANGE)):
            cells = np.unique(steps.cell[own & (steps.kind == kind)])[:MOST_CELLS]
            parts.append(coloured(box_segments(boxes.boxes[boxes.places_of(cells)]), colour))
        parts += walked.ray_lines()
        marks: list[Mark] = []
        rows: list[Row] = []
        instance = self.instance_at(event)
        if instance >= 0:
            parts.append(coloured(box_segments(geometry.boxes[[instance]]), MAGENTA))
            more, marks, rows = self._within(instance, event)
            parts += more
        name = self.scene.primitive_name
        caption = f"Event {event} of {len(steps) - 1}: {event_text(steps, event, name)}"
        so_far = up_to_event(steps, event).tally()
        rows += [
            Row(counter.label, str(so_far[counter.name]), f"so far: {counter.meaning}")
            for counter in steps.counters
        ]
        return picture_of(parts, caption, marks=marks, rows=rows)

    def _within(self, instance: int, event: int) -> tuple[list[Lines], list[Mark], list[Row]]:
        """Return what is seen in the space of an instance, texts, and rows about the moved ray."""
        steps, space = self.steps, self.space(instance)
        matrix = self.inverse[instance]
        origin = matrix[:, :3] @ self.rays.origins[0] + matrix[:, 3]
        direction = matrix[:, :3] @ self.rays.directions[0]
        parts: list = [space.items()]
        inside = (np.arange(len(steps)) <= event) & (steps.level > 0)
        inside &= self.chains[:, 0] == instance
        forest = self.structure.instances.forest
        if levels_of_mesh(self.scene.geometry) == 1:
            for kind, colour in ((VISIT_INNER, faint(GREY, 0.8)), (VISIT_LEAF, ORANGE)):
                numbers = np.unique(steps.cell[inside & (steps.kind == kind)])[-MOST_CELLS:]
                if hasattr(forest, "volumes"):
                    found = forest.volumes.boxes()[numbers]
                else:
                    found = space.cells.boxes[space.cells.places_of(numbers)]
                parts.append(coloured(space.boxes(found), colour))
            tested = np.unique(steps.primitive[inside & (steps.kind == TEST)])
            if hasattr(space.mesh, "corners"):
                corners = space.mesh.corners
                parts.append(tinted(space.points(corners[tested]), ORANGE, 0.6))
        # As far as the ray is in the mesh's box, and a little more, on the same t.
        with np.errstate(all="ignore"):
            planes = (space.box.reshape(2, 3) - origin) / direction
        length = float(np.linalg.norm(direction))
        margin = 0.15 * extent_of(self.scene) / space.scale / length
        ends = np.array([planes.min(axis=0).max() - margin, planes.max(axis=0).min() + margin])
        # One that passes the box by is drawn where it comes nearest.
        middle = float((space.box.reshape(2, 3).mean(axis=0) - origin) @ direction) / length**2
        half = 0.75 * float(np.linalg.norm(space.box[3:] - space.box[:3])) / length
        ends = np.clip(np.sort(np.nan_to_num(ends, nan=middle)), middle - half, middle + half)
        parts.append(coloured(space.points(origin + ends[:, None] * direction)[None], RAY))
        marks = [space.name(f"space of instance {instance}")]
        # What is hit within is known when the walk there has come back.
        hits = np.flatnonzero((steps.kind == HIT) & (steps.level == 0) & (steps.primitive >= 0))
        hits = hits[hits <= event]
        hits = hits[steps.primitive[hits] == instance]
        if len(hits):
            t = float(steps.t_enter[hits[-1]])
            place = space.points(origin + t * direction)
            size = 0.04 * extent_of(self.scene)
            parts.append(coloured(stars(place[None], np.array([size])), GREEN))
            marks.append(Mark(place, f"t = {t:.4g} on both sides", GREEN[:3]))
        rows = [
            Row("o in the World", _numbers(self.rays.origins[0]), "where the ray begins"),
            Row("d in the World", _numbers(self.rays.directions[0]), "its direction"),
            Row("o in the Mesh", _numbers(origin), f"M^-1 o of instance {instance}"),
            Row("d in the Mesh", _numbers(direction), "M^-1 d, of another length: t stays"),
        ]
        return parts, marks, rows


def _numbers(values: np.ndarray) -> str:
    return "(" + ", ".join(f"{value:.3g}" for value in values) + ")"


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Record the ray."""
    return Through(subject, settings, progress)


LESSONS = (
    Lesson(
        name="ray_through_levels",
        label="A Ray through Two Levels",
        slide="DXR acceleration",
        begin="A ray walks through the top level in the world. At an instance it is moved into the "
        "space of its mesh, and walks through the bottom level there",
        look_for="Not the geometry is moved but the ray, and its direction keeps the length that "
        "the matrix gives it: so t is the same on both sides, and what was found in one instance "
        "ends the search in the others",
        question="What would go wrong if the moved direction were made a unit vector?",
        answer="t would be measured in units of that mesh. Hits in instances of different scale "
        "could not be compared, and the nearest hit so far would prune the wrong nodes",
        source="contract.instances",
        sample="crowd:figures=12,triangles=1500",
        structures=("two_level",),
        suits=is_two_level,
        Settings=Settings,
        play=play,
        film="event",
        replays=("ray",),
        takes_ray=True,
    ),
)
