"""Lesson "coherence lists": lists of a cube's cells are made while rays arrive.

As on the lecture's slide "Using coherence": every object has a cube of directions in the centre of
its bounding sphere, and a list for each cell, made when the first ray comes to it
(:mod:`..structures.ray_coherence`; Ohta and Maekawa 1987; REFERENCE.md A24).

Rays come one after the other: from each point that a small picture shows one is mirrored, and one
goes to the light. Squares on cubes are the lists that there are by now, tinted by their length.
Violet is the newest ray, orange its cell. Of what that lists, green is hit, orange was tested in
vain, and grey was not tested: the walk ended before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..contract.events import HIT, TEST
from ..contract.structure import Structure
from ..errors import InputError
from ..geometry.rays import ANY, CLOSEST, NOBODY, Rays, joined_rays
from ..printing import show_integer
from ..progress import Progress
from ..scene import Scene
from ..scene.camera_rays import REFLECTED, SHADOW, camera_rays, framing_camera
from ..scene.light_ways import ways_to_lights
from ..scene.surfaces import surfaces_hit
from ..scene.whitted.optics import mirrored
from ..settings import setting
from ..structures.ray_coherence import RayCoherence, RayCoherenceSettings
from .directions import MOST_CELLS, MOST_NUMBERED, lit, tinted_cells
from .drawing import (
    GREEN,
    GREY,
    ORANGE,
    Colour,
    Faces,
    Lines,
    coloured,
    counted,
    faint,
    items_in,
    outlines,
    picture_of,
)
from .lesson import Lesson, Play, Subject, build, only_its_own
from .one_ray import RAY
from .picture import Mark, Picture, Row

COLUMNS, ROWS = 40, 30
"""Rays of the picture from whose hits rays go on."""

LIGHT_CELLS = 16
"""Along an edge of a face of the light's cube; with more, its squares were too small to see."""

CLASS_NAMES = REFLECTED, SHADOW


@dataclass(frozen=True)
class Settings:
    """The knobs of the lesson."""

    ray: int = setting(43, "Ray", "Rays that have come before this one", minimum=0)
    cells: int = setting(
        6, "Cells", "Cells along an edge of a face of a cube", unit="cells", minimum=1, maximum=16
    )


class Arrived(NamedTuple):
    """What all rays have found.

    Attributes
    ----------
    spheres, cells : (n,) int
        Whose list each takes.
    first : (n,) int
        The first ray that has taken it, which is the ray itself where it had to be made.
    sizes, tests : (n,) int
        How long the list is, and how much of it was tested.
    t : (n,) float64
        Where it hits, inf for a miss.
    """

    spheres: np.ndarray
    cells: np.ndarray
    first: np.ndarray
    sizes: np.ndarray
    tests: np.ndarray
    t: np.ndarray


class ListsOnDemand(Play):
    """Rays that arrive, and the lists that they make."""

    def __init__(self, structure: RayCoherence, light: str, rays: Rays, arrived: Arrived) -> None:
        self.structure, self.light, self.rays, self.arrived = structure, light, rays, arrived
        self.scene = structure.scene
        self.ends = {"ray": len(rays) - 1}

    def picture(self, settings: Settings) -> Picture:
        """Return the picture of one ray, and of all lists that were made up to it."""
        structure, arrived, ray = self.structure, self.arrived, settings.ray
        scene, n_all = self.scene, len(self.scene)
        sphere, cell = int(arrived.spheres[ray]), int(arrived.cells[ray])
        made = np.unique(arrived.first[: ray + 1])
        shown = made[-MOST_CELLS:]
        corners = structure.corners_of(arrived.spheres[shown], arrived.cells[shown])
        longest = int(arrived.sizes.max())
        parts: list[Lines | Faces] = [*tinted_cells(corners, arrived.sizes[shown], longest)]
        n_own = 6 * int(structure.arrays.size[sphere]) ** 2
        own = structure.corners_of(np.full(n_own, sphere), np.arange(n_own))
        parts.append(coloured(outlines(own), faint(ORANGE, 0.2)))
        parts.append(coloured(outlines(own[cell : cell + 1]), ORANGE))
        items, _ = structure.list_of(sphere, cell)
        tested, hit = self.walked(ray)
        states = self.states(items, tested, hit)
        for colour, opacity in ((GREY, 0.2), (ORANGE, 0.5), (GREEN, 0.7)):
            some = items[[state == colour for state in states]]
            parts.append(items_in(scene, some, colour, opacity))
        begin, end = self.ends_of(ray)
        parts.append(coloured(np.array([[begin, end]]), RAY))
        marks = [Mark(begin, "ray", RAY[:3]), *self.numbers(items, states)]
        n_lists, n_cells = len(made), int((6 * structure.arrays.size.astype(np.int64) ** 2).sum())
        so_far = slice(0, ray + 1)
        rows = (
            Row("Rays", show_integer(ray + 1), f"That have come, of {len(self.rays)}"),
            Row("Lists", show_integer(n_lists), "That were made for them"),
            Row("Share Made", f"{n_lists / n_cells:.2%}",
                f"Of {show_integer(n_cells)} cells of all cubes"),
            Row("Found a List", f"{1.0 - n_lists / (ray + 1):.0%}",
                "Rays that came to a cell whose list was there"),
            Row("Listed", f"{len(items)} of {n_all}", f"{scene.item_name}s, by this cell"),
            Row("Tested", str(int(arrived.tests[ray])), "N_IT of this ray"),
            Row("Mean List", f"{arrived.sizes[so_far].mean():.3g}", "Of all rays so far"),
            Row("Mean Tests", f"{arrived.tests[so_far].mean():.3g}", "N_IT of all rays so far"),
            Row("Light", self.light, "Where shadow rays go"),
        )  # fmt: skip
        caption = self.words(settings, len(items), len(tested), hit)
        return picture_of(parts, caption, marks=marks, rows=rows)

    def walked(self, ray: int) -> tuple[list[int], int]:
        """Return the items that a ray tests, by its recorded walk, and which it hits or -1."""
        steps = self.structure.record(self.rays, ray)
        hits = steps.primitive[steps.kind == HIT]
        return steps.primitive[steps.kind == TEST].tolist(), int(hits[-1]) if len(hits) else -1

    def states(self, items: np.ndarray, tested: list[int], hit: int) -> list[Colour]:
        """Return the colours of what the cell lists."""
        colour_of = dict.fromkeys(tested, ORANGE) | {hit: GREEN}
        return [colour_of.get(item, GREY) for item in items.tolist()]

    def numbers(self, items: np.ndarray, states: Sequence[Colour]) -> list[Mark]:
        """Return places in the list beside those objects."""
        middles = self.structure.arrays.balls[items[:MOST_NUMBERED], :3]
        return [
            Mark(middle, str(n), colour[:3])
            for n, (middle, colour) in enumerate(zip(middles, states, strict=False), 1)
        ]

    def ends_of(self, ray: int) -> tuple[np.ndarray, np.ndarray]:
        """Return where a ray begins and where it is drawn to."""
        origin, direction = self.rays.origins[ray], self.rays.directions[ray]
        beyond = 0.3 * self.scene.diagonal / float(np.linalg.norm(direction))
        t = min(float(self.arrived.t[ray]), float(self.rays.t_max[ray]))
        return origin, origin + (t if np.isfinite(t) else beyond) * direction

    def words(self, settings: Settings, n_listed: int, n_tested: int, hit: int) -> str:
        """Say what the ray finds."""
        arrived, ray, item = self.arrived, settings.ray, self.scene.item_name
        sphere, first = int(arrived.spheres[ray]), int(arrived.first[ray])
        leaves = f"leaves {item} {sphere}" if sphere < len(self.scene) else "comes to the light"
        text = f"Ray {ray} {leaves}: the list of its cell "
        text += "is made now" if first == ray else f"was made for ray {first}"
        text += f"; of {counted(n_listed, item, f'{item}s')}, {n_tested} "
        text += "is tested" if n_tested == 1 else "are tested"
        return f"{text}, and {item} {hit} is hit" if hit >= 0 else f"{text}, and none is hit"

    def on_page(self, lesson: Lesson, settings: Any) -> list[Any]:
        """Return the first ray, one that makes a list, one that finds one, and the last."""
        first, count = self.arrived.first, len(self.rays)
        own = first == np.arange(count)
        is_hit = np.isfinite(self.arrived.t)
        some, found = np.flatnonzero(own & is_hit), np.flatnonzero(~own & is_hit)
        chosen = {0, count - 1}
        chosen |= {int(each[len(each) // 2]) for each in (some, found) if len(each)}
        return [Settings(ray, settings.cells) for ray in sorted(chosen)]


def rays_onward(scene: Scene, tracer: Structure, progress: Progress) -> Rays | None:
    """Return a mirrored ray and a shadow ray from each hit of a small picture, in turn."""
    primary = camera_rays(framing_camera(scene, COLUMNS / ROWS), COLUMNS, ROWS)
    hits, _ = tracer.trace(primary, progress=progress)
    hit = np.flatnonzero(hits.primitive >= 0)
    if not len(hit):
        return None
    surfaces = surfaces_hit(scene, primary, hits, hit)
    origins = surfaces.points + surfaces.offsets[:, None] * surfaces.normals
    lengths = np.linalg.norm(primary.directions[hit], axis=1, keepdims=True)
    onward = mirrored(primary.directions[hit] / lengths, surfaces.normals)
    ways = ways_to_lights(surfaces, scene.lights)
    own = hits.primitive[hit]
    of_mirror = Rays.from_arrays(
        origins, onward, queries=CLOSEST, classes=0, class_names=CLASS_NAMES, sources=own
    )
    if not len(ways.origins):
        return of_mirror
    to_light = Rays.from_arrays(
        ways.origins, ways.directions, ways.ends, queries=ANY, classes=1, class_names=CLASS_NAMES,
        sources=own[ways.surfaces], targets=ways.lights,
    )  # fmt: skip
    both = joined_rays([of_mirror, to_light])
    order = np.argsort(np.concatenate([np.arange(len(hit)), ways.surfaces]), kind="stable")
    return both.select(order)


def play(subject: Subject, settings: Settings, progress: Progress) -> Play:
    """Send the rays, which make the lists that they need."""
    progress.report(0, 3, "Building a BVH")
    scene, light = lit(subject.scene)
    bvh = build(scene, "bvh", progress)
    progress.report(1, 3, "Sending rays")
    rays = rays_onward(scene, bvh, progress)
    if rays is None:
        raise InputError("nothing is seen from the front; move what there is into the view")
    chosen = RayCoherenceSettings(cells=settings.cells, light_cells=LIGHT_CELLS)
    structure = RayCoherence.build(scene, chosen, progress)
    hits, counts = structure.trace(rays, progress=progress)
    spheres, cells = structure.cells_of(rays)
    is_known = spheres != NOBODY
    rays, spheres, cells = rays.select(is_known), spheres[is_known], cells[is_known]
    keys = spheres * structure.arrays.stride + cells
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    pairs = zip(spheres[first].tolist(), cells[first].tolist(), strict=True)
    sizes = np.array([len(structure.list_of(*pair)[0]) for pair in pairs])
    structure.record(rays, 0)  # compiled now, and not at the first picture
    arrived = Arrived(
        spheres, cells, first[which], sizes[which], counts["N_IT"][is_known], hits.t[is_known]
    )
    return ListsOnDemand(structure, light, rays, arrived)


LESSONS = (
    Lesson(
        name="coherence_lists",
        label="Lists on Demand",
        slide="Using coherence",
        begin="Every object has a cube of directions, and every cell a list: far too many, but "
        "most are never asked for, and each is made when the first ray comes",
        look_for="A ray through a cell whose list is there tests a few objects and makes nothing; "
        "lists appear where rays go, and the share of all cells stays small",
        question="A cell's list is the same for all rays that leave the object in its directions, "
        "wherever they start. What is the price of that?",
        answer="The whole sphere stands for the point: objects are listed that no single point "
        "sees in that direction, and whatever overlaps the sphere is listed in all cells. Large "
        "objects, such as floors, list nearly everything",
        source="structures.ray_coherence.making",
        sample="soup:count=30,edge=0.25",
        suits=only_its_own,
        Settings=Settings,
        play=play,
        film="ray",
        replays=("cells",),
    ),
)
