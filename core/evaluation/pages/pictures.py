"""Pictures of cells over the mesh, and a page that shows them beside their figures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...colours import EMPTY_TINT, depth_colours, face_opacity
from ...contract.cells import Cells
from ...contract.events import VISIT_EMPTY, VISIT_LEAF
from ...contract.needs import CAMERA, GEOMETRY
from ...contract.outlines import faces_of, triangles_of, wires_of
from ...contract.protocols import Linked
from ...contract.structure import Structure
from ...contract.within import cells_with_instances
from ...errors import InputError, reason_of
from ...geometry.box_shape import surface_area
from ...geometry.rays import Rays
from ...geometry.triangles import Triangles
from ...lessons import lessons_about
from ...lessons.ray_path import ON_LIGHT, Walk, links_of, segments_of
from ...lessons.walk_in_words import legend
from ...printing import in_html, show_integer
from ...settings import to_text
from ..records.experiment import Built
from ..records.report import figures, write_text
from .lesson_page import REDUCTION, pictures_that_tell, play
from .lesson_pictures import LessonPainter
from .page import figure_tags, page_of, rows_table
from .picture_cameras import camera_aside
from .png import write_png
from .view import View

MOST_CELLS = 20_000
"""Cells in one picture; more of them are a grey mass."""

MOST_WITHIN = 160
"""Nodes within instances in one picture, if their roots are not more; levels are shown whole."""

MOST_TINTED = 40_000
"""Empty leaves tinted in one picture: the largest."""

TINT_COVER, PLANE_COVER = 0.45, 0.35
"""Share of the view that tinted empty leaves, and planes, cover together."""

SNAPSHOTS = (1 / 16, 1 / 4)
"""When the building is shown: shares of its steps, counted from the end where that is the root."""

CANDIDATES = 32
"""Rays of which one is shown."""

MOST_OF_NAME = 40
"""Characters of a name in the name of a file, which may have 255 bytes."""

LEGIBLE = 0.03
"""Size from which a cell is told apart from its neighbours, as a share of the picture's width."""


def shown_levels(cells: Cells) -> int:
    """Return how many levels from the root give a picture one can still read."""
    per_level = np.bincount(cells.depth)
    return max(int((np.cumsum(per_level) <= 160).sum()), 1)


class Gallery:
    """A folder of pictures and the page that shows them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._views: dict[str, View] = {}
        self._rows: list[str] = []
        self._names: set[str] = set()
        self._told: set[tuple[str, str, str]] = set()

    def add_failure(
        self, scene: str, structure: type[Structure], settings: Any, reason: str
    ) -> None:
        """Say on the page why a structure is not on it."""
        self._rows.append(
            f"<section>{heading(scene, structure.label, settings)}"
            f'<p class="failed">{in_html(reason)}</p></section>'
        )

    def add(
        self, built: Built, records: list[dict[str, Any]], batches: Sequence[Rays] = ()
    ) -> None:
        """Draw a structure: its upper levels, its leaves, its building, a ray's walk, lessons.

        Of several batches of rays that were traced, one that is a single ray is the ray to show;
        without any, one is chosen.
        """
        structure = built.structure
        scene = structure.scene
        cells = structure.cells()
        view = self._view_of(structure, cells)
        stem = self._free_name(f"{scene.name}-{structure.name}")
        pictures = []
        if not cells.is_leaf.all():
            pictures.append(("levels", *picture_of_levels(view, cells)))
        pictures.append(("leaves", *picture_of_leaves(view, cells, scene.item_name)))
        if structure.levels:
            pictures.append(("instances", *picture_of_instances(view, structure)))
        if "order" in cells.extra:
            for number, step in enumerate(steps_shown(cells), 1):
                pictures.append((f"built-{number}", *picture_of_building(view, cells, step)))
        single = next((rays for rays in batches if len(rays) == 1), None)
        # Rays across the picture are of no class, which not every structure answers.
        if len(cells) > 1 and (single is not None or structure.answers is None):
            walk = walk_to_show(view, structure, cells, single)
            pictures.append(("ray", *picture_of_ray(view, walk)))
            if structure.takes_cones and isinstance(structure.scene.geometry, Triangles):
                pictures.append(("cone", *picture_of_cone(view, walk)))
            if isinstance(structure, Linked):
                pictures.append(("links", *picture_of_links(view, walk)))
        shown = []
        for kind, caption, image in pictures:
            file = f"{stem}-{kind}.png"
            write_png(self.folder / file, image)
            shown.append((file, caption))
        told = "".join(self._lessons(structure, stem))
        self._rows.append(section(built, records, shown, told))

    def _view_of(self, structure: Structure, cells: Cells) -> View:
        """Return the view of a scene; of a structure around lights or a camera one of all of it."""
        scene = structure.scene
        if structure.needs != {GEOMETRY}:
            return View(scene, camera_aside(scene, cells.boxes, CAMERA in structure.needs))
        if scene.source not in self._views:
            self._views = {scene.source: View(scene)}  # only the last: scenes come one by one
        return self._views[scene.source]

    def _lessons(self, structure: Structure, stem: str) -> Iterator[str]:
        """Draw the lessons about such structures, over this one; return their part of the page.

        Each is told once of a structure and its settings, over the first of several scenes.
        """
        for lesson in lessons_about(structure):
            key = lesson.name, structure.name, to_text(structure.settings)
            if key in self._told:
                continue
            self._told.add(key)
            try:
                subject = lesson.subject(structure.scene, given=[structure])
                played = play(lesson, subject, lesson.Settings())
                pictures = pictures_that_tell(played)
            except InputError as error:
                yield f"<h3>{in_html(lesson.label)}</h3><p>{in_html(reason_of(error))}</p>"
                continue
            painter = LessonPainter(structure.scene, pictures, REDUCTION)
            shown = []
            for number, picture in enumerate(pictures):
                file = f"{stem}-{lesson.name}-{number}.png"
                write_png(self.folder / file, painter.paint(picture))
                shown.append((file, picture.caption))
            yield (
                f"<h3>{in_html(lesson.label)}</h3><p>{in_html(lesson.begin)}.</p>"
                f'<div class="row frames">{figure_tags(shown)}</div>'
            )

    def _free_name(self, wanted: str) -> str:
        """Return a file name that no earlier picture has taken."""
        stem = "".join(c if c.isalnum() or c in "-_." else "_" for c in wanted[-MOST_OF_NAME:])
        name, n = stem, 2
        # Upper and lower case may be the same to the file system.
        while name.casefold() in self._names:
            name, n = f"{stem}-{n}", n + 1
        self._names.add(name.casefold())
        return name

    def write_page(self) -> None:
        """Write ``index.html`` beside the pictures."""
        write_text(self.folder / "index.html", page_of("AccelScope", ABOUT + "\n".join(self._rows)))


# ------------------------------------------------------------------------------------- pictures


def picture_of_levels(view: View, cells: Cells) -> tuple[str, np.ndarray]:
    """Return caption and image of the upper levels, with the planes that cut their cells."""
    levels = shown_levels(cells)
    caption = f"levels 0 to {levels - 1}"
    chosen = cells.depth < levels
    if cells.planes is None or levels < 2:
        return caption, edges_over(view, cells, chosen)
    triangles, owners = triangles_of(cells.planes)
    # The planes of the last level would cut it into cells that are not shown.
    upper = cells.depth[owners] < levels - 1
    colours = depth_colours(cells.depth[owners[upper]], levels - 1)
    image = faces_over(view, cells, triangles[upper], colours, PLANE_COVER)
    return f"{caption} and their planes", edges_over(view, cells, chosen, image)


def picture_of_leaves(view: View, cells: Cells, item_name: str) -> tuple[str, np.ndarray]:
    """Return caption and image of leaves: edges of those with items, tints of empty ones."""
    leaves = cells.is_leaf & (cells.count > 0)
    n_leaves = int(leaves.sum())
    caption = f"{show_integer(n_leaves)} {'leaf' if n_leaves == 1 else 'leaves'} with {item_name}s"
    if n_leaves > MOST_CELLS:
        # Every k-th: an even thinning keeps the shape.
        keep = np.flatnonzero(leaves)[:: -(-n_leaves // MOST_CELLS)]
        leaves = np.zeros_like(leaves)
        leaves[keep] = True
        caption = f"{show_integer(len(keep))} of the {caption}"
    empty = np.flatnonzero(cells.is_leaf & (cells.count == 0))
    if len(empty) == 0:
        return caption, edges_over(view, cells, leaves)
    size = (cells.boxes[empty, 3:] - cells.boxes[empty, :3]).sum(axis=1)
    largest = np.sort(empty[np.argsort(-size, kind="stable")[:MOST_TINTED]])
    caption += f", {show_integer(len(largest))}"
    if len(empty) > len(largest):
        caption += f" of {show_integer(len(empty))}"
    triangles, owners = faces_of(cells, largest)
    # A line of sight leaves a cell through a second face, which adds nothing but work.
    middle = triangles.mean(axis=1)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    centres = 0.5 * (cells.boxes[owners, :3] + cells.boxes[owners, 3:])
    outwards = ((middle - centres) * normals).sum(axis=1)
    towards_eye = (view.towards_eye(middle) * normals).sum(axis=1)
    front = triangles[(outwards > 0) == (towards_eye > 0)]
    image = faces_over(view, cells, front, np.array(EMPTY_TINT), TINT_COVER)
    return f"{caption} empty", edges_over(view, cells, leaves, image)


def picture_of_instances(view: View, structure: Structure) -> tuple[str, np.ndarray]:
    """Return caption and image of the boxes of instances, and of what is within them."""
    cells = cells_with_instances(structure)
    assert cells.n_own is not None
    assert cells.is_dashed is not None
    chosen = np.zeros(len(cells), dtype=bool)
    # Of the trees as much as can be told apart; each level whole.
    within = np.flatnonzero(~cells.is_dashed[cells.n_own :]) + cells.n_own
    depths, per_depth = np.unique(cells.depth[within], return_counts=True)
    shown = depths[np.cumsum(per_depth) <= max(MOST_WITHIN, int(per_depth[0]))]
    chosen[within] = np.isin(cells.depth[within], shown)
    chosen |= cells.is_dashed
    n_boxes, n_nodes = int(cells.is_dashed.sum()), int(chosen.sum() - cells.is_dashed.sum())
    caption = (
        f"boxes of {show_integer(n_boxes)} instances, dashed; within them, each mesh once, "
        f"{show_integer(n_nodes)} upper nodes of the meshes' trees"
    )
    if cells.left_out:
        caption += f" ({'; '.join(cells.left_out)})"
    return caption, edges_over(view, cells, chosen)


def steps_shown(cells: Cells) -> list[int]:
    """Return when the building is shown: while there are few cells, so that one can tell them.

    Neither before it has begun nor when all is built, which other pictures show.
    """
    order = cells.extra["order"]
    last = int(order.max())
    steps = {int(np.ceil(share * last)) for share in SNAPSHOTS}
    shown = steps if order[0] == 0 else {last - step for step in steps}
    return sorted(shown - {0, last})


def picture_of_building(view: View, cells: Cells, step: int) -> tuple[str, np.ndarray]:
    """Return caption and image of the cells there were after a step."""
    order = cells.extra["order"]
    last = int(order.max())
    assert cells.replaced is not None
    there = (order <= step) & (cells.replaced > step)
    caption = f"building after step {show_integer(step)} of {show_integer(last)}"
    return caption, edges_over(view, cells, there)


def walk_to_show(view: View, structure: Structure, cells: Cells, single: Rays | None) -> Walk:
    """Return the walk of one ray: that given, or one that is legible."""
    if single is None:
        rays, widths = crossing_rays(view, structure)
    else:
        rays, widths = single, np.ones(1)
    hits, _ = structure.trace(rays)
    if structure.made() is not None:
        cells = structure.cells()  # with those that these rays have made
    sizes = np.zeros(int(cells.numbers.max()) + 1)
    sizes[cells.numbers] = np.linalg.norm(cells.boxes[:, 3:] - cells.boxes[:, :3], axis=1)
    walks = [
        Walk(structure, cells, rays, i, float(t), structure.record(rays, i))
        for i, t in enumerate(hits.t)
    ]

    def worth(walk: Walk) -> tuple[bool, int, int]:
        """Rate a ray that hits above one that does not, then one through many large leaves."""
        entered = entered_by(walk)
        legible = LEGIBLE * widths[walk.ray] < sizes[entered]
        return bool(np.isfinite(walk.t_hit)), int(legible.sum()), -len(walk.steps)

    return max(walks, key=worth)


def entered_by(walk: Walk) -> np.ndarray:
    """Return the numbers of the structure's own leaves that a walk has entered."""
    steps = walk.steps
    return steps.cell[np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY)) & (steps.level == 0)]


def picture_of_ray(view: View, walk: Walk) -> tuple[str, np.ndarray]:
    """Return caption and image of a walk."""
    segments, colours = segments_of(walk, palette=ON_LIGHT)
    caption = "one ray: " + ", ".join(text for _, text in legend(walk))
    return caption, view.with_lines(segments, colours, width=2, hidden=0.5)


CONE = math.radians(3.0)
"""Half the angle of the cone that is shown."""


def picture_of_cone(view: View, walk: Walk) -> tuple[str, np.ndarray]:
    """Return caption and image of the walk of a cone around the ray of another walk."""
    _, steps = walk.structure.cover(walk.rays, walk.ray, CONE)
    cone = walk._replace(steps=steps, t_hit=np.inf, half_angle=CONE)
    segments, colours = segments_of(cone, palette=ON_LIGHT)
    caption = f"a cone of {math.degrees(CONE):g} degrees: "
    caption += ", ".join(text for _, text in legend(cone))
    return caption, view.with_lines(segments, colours, width=2, hidden=0.5)


def picture_of_links(view: View, walk: Walk) -> tuple[str, np.ndarray]:
    """Return caption and image of the links (ropes) of the largest leaf that a walk enters."""
    cells, structure = walk.cells, walk.structure
    assert isinstance(structure, Linked)
    entered = entered_by(walk)
    # A ray beside the scene enters none: then it is the largest of all.
    chosen = np.isin(cells.numbers, entered) if len(entered) else cells.is_leaf
    place = np.flatnonzero(chosen)
    sizes = np.linalg.norm(cells.boxes[place, 3:] - cells.boxes[place, :3], axis=1)
    leaf = int(cells.numbers[place[sizes.argmax()]])
    segments, colours, n_links = links_of(structure, cells, leaf, ON_LIGHT)
    caption = f"leaf {leaf} and its {n_links} link{'s' * (n_links != 1)} to neighbours"
    return caption, view.with_lines(segments, colours, width=2, hidden=0.5)


def crossing_rays(view: View, structure: Structure) -> tuple[Rays, np.ndarray]:
    """Return rays across the picture, each towards something that is seen in it.

    Returns
    -------
    rays : Rays
    widths : (n,) float64
        Width of the picture there, in scene units.
    """
    targets, widths = view.points(12, 16)
    if len(targets) == 0:
        scene = structure.scene
        targets = 0.5 * (scene.lower + scene.upper)[None]
        widths = np.array([scene.diagonal])
    some = np.linspace(0, len(targets) - 1, min(CANDIDATES, len(targets))).astype(np.int64)
    targets, widths = targets[some], widths[some]
    # From the left, a little from above and from the front.
    right, up, forward = view.axes
    direction = right - 0.35 * up + 0.45 * forward
    directions = widths[:, None] * direction / np.linalg.norm(direction)
    return Rays.from_arrays(targets - 0.6 * directions, directions), widths


def edges_over(
    view: View, cells: Cells, chosen: np.ndarray, over: np.ndarray | None = None
) -> np.ndarray:
    """Draw the edges of cells, coloured by depth, or by count where all are equally deep."""
    wires = wires_of(cells, np.flatnonzero(chosen))
    # Backwards: where edges coincide, the upper level's is seen.
    segments, owners = wires.segments()[::-1], wires.edge_owners()[::-1]
    by_depth = cells.depth.max() > 0
    values = cells.depth if by_depth else cells.count
    maximum = int(values[chosen].max(initial=0)) if by_depth else int(values.max())
    return view.with_lines(segments, depth_colours(values[owners], maximum), over=over)


def faces_over(
    view: View, cells: Cells, triangles: np.ndarray, colours: np.ndarray, cover: float
) -> np.ndarray:
    """Draw translucent triangles; return the view's image behind them."""
    sides = triangles[:, 1:] - triangles[:, :1]
    area = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    around = surface_area(
        np.concatenate([cells.boxes[:, :3].min(axis=0), cells.boxes[:, 3:].max(axis=0)])[None]
    )
    return view.with_faces(triangles, colours, face_opacity(area, float(around[0]), cover))


RAY_SECTIONS = ("Rays", "Per ray")


def section(
    built: Built, records: list[dict[str, Any]], pictures: list[tuple[str, str]], lessons: str
) -> str:
    """Return the part of the page about one structure over one scene."""
    structure = built.structure
    rows = figures(records[0])
    tables = [rows_table(structure.label, [row[1:] for row in rows if row[0] not in RAY_SECTIONS])]
    for record in records:
        rows = [row for row in figures(record) if row[0] in RAY_SECTIONS]
        rows += [("", "Failed", record["error"])] if "error" in record else []
        tables.append(rows_table(record["rays"]["name"], [row[1:] for row in rows]))
    return (
        f"<section>{heading(structure.scene.name, structure.label, structure.settings)}"
        f'<div class="row">{figure_tags(pictures)}<div class="tables">{"".join(tables)}</div>'
        f"</div>{lessons}</section>"
    )


def heading(scene: str, structure: str, settings: Any) -> str:
    """Return the heading of a section, and the settings below it."""
    return (
        f"<h2>{in_html(scene)} &middot; {in_html(structure)}</h2>"
        f"<p>{in_html(to_text(settings).replace(',', ', '))}</p>"
    )


ABOUT = """<p>Cells and planes are coloured by depth, from blue (root) to red (deepest); cells of a
grid by their number of items, such as triangles. Empty leaves are tinted blue. Lines behind the
scene's surface are faint. A ray is black; it enters inner nodes (grey), leaves with items (orange)
and empty ones (blue), skips empty regions (violet), and tests triangles and solids (pink); a red
star is a hit that is postponed, and what it hits in the end is green. A cone has black sides; all
that it meets is green. Arrows follow the links (ropes) of a leaf.</p>
"""
