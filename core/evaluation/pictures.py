"""Pictures of cells over the mesh, and a page that shows them beside their figures.

The mesh is rendered with our own rays, so a picture needs no window, no GPU and no Blender. The
edges of cells are drawn over it: crisp in front of the mesh, faint behind it.
"""

from __future__ import annotations

import dataclasses
import html
from pathlib import Path
from typing import Any

import numpy as np

from ..colours import depth_colours
from ..scene import Camera, Scene
from ..settings import to_text
from ..structures.bvh import BVH
from ..structures.cells import Cells
from ..structures.contract import Structure
from .experiment import Built
from .png import write_png
from .report import figures, show_integer, write_text
from .workloads import CameraSettings, camera_axes, camera_of, camera_rays

WIDTH, HEIGHT = 960, 720
SUPERSAMPLING = 2
BACKGROUND = np.array([0.965, 0.965, 0.955])
SURFACE = np.array([0.80, 0.80, 0.79])
HIDDEN = 0.22
"""Opacity of lines behind the mesh."""

MOST_CELLS = 20_000
"""Cells in one picture; more of them are a grey mass."""

CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
EDGES = np.array([[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3],
                  [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]])  # fmt: skip


def picture_camera(scene: Scene) -> Camera:
    """Return the scene's own camera, or one that frames the scene; both fill the lower side.

    Own cameras often belong to square pictures: their angle of view is that of the height here,
    so that nothing they show is cut off.
    """
    settings = CameraSettings(width=WIDTH, height=HEIGHT)
    if scene.camera is None:
        return camera_of(scene, settings)
    half = np.arctan(np.tan(np.radians(scene.camera.fov) / 2) * WIDTH / HEIGHT)
    return camera_of(scene, dataclasses.replace(settings, fov=float(np.degrees(2 * half))))


class View:
    """The mesh of a scene seen by its camera: an image and the depth behind every pixel.

    Attributes
    ----------
    image : (height, width, 3) float64
    depth : (height, width) float64
        Distance along the view direction, inf where there is nothing.
    """

    def __init__(self, scene: Scene) -> None:
        self.camera = picture_camera(scene)
        self.width, self.height = WIDTH * SUPERSAMPLING, HEIGHT * SUPERSAMPLING
        rays = camera_rays(self.camera, self.width, self.height)
        hits, _ = BVH.build(scene, BVH.Settings()).trace(rays)
        hit = hits.primitive >= 0
        corners = scene.triangles[hits.primitive[hit]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        forward, right, up = camera_axes(self.camera)
        normals *= -np.sign(normals @ forward)[:, None]
        # A key light over the viewer's left shoulder, and a fill from the front.
        key = -0.5 * forward - 0.45 * right + 0.75 * up
        key /= np.linalg.norm(key)
        light = 0.35 + 0.45 * np.clip(normals @ key, 0, 1) + 0.25 * np.abs(normals @ forward)
        image = np.tile(BACKGROUND, (self.width * self.height, 1))
        image[hit] = np.clip(light, 0, 1.05)[:, None] * SURFACE
        self.image = image.reshape(self.height, self.width, 3)
        # Camera rays have component 1 along the view direction, so t is the depth.
        self.depth = hits.t.reshape(self.height, self.width)

    def with_boxes(self, boxes: np.ndarray, colours: np.ndarray) -> np.ndarray:
        """Return the image with the edges of boxes drawn over it, antialiased.

        Parameters
        ----------
        boxes : (n, 6) float64
        colours : (n, 3) float64
        """
        corners = boxes[:, None, :3] * (1 - CORNERS) + boxes[:, None, 3:] * CORNERS
        segments = corners[:, EDGES].reshape(-1, 2, 3)
        column, row, depth, edge = self._sample(segments)
        behind = depth > self.depth[row, column] * (1 + 2e-4) + 1e-12
        canvas = self.image.copy()
        # Far ones first, so that of several lines in one pixel the nearest stays.
        order = np.lexsort((-depth, ~behind))
        column, row, behind = column[order], row[order], behind[order]
        opacity = np.where(behind, HIDDEN, 1.0)[:, None]
        ink = colours[edge[order] // len(EDGES)]
        canvas[row, column] = (1 - opacity) * self.image[row, column] + opacity * ink
        shape = (HEIGHT, SUPERSAMPLING, WIDTH, SUPERSAMPLING, 3)
        return canvas.reshape(shape).mean(axis=(1, 3))

    def _sample(
        self, segments: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return column, row, depth and segment number of the pixels under segments (n, 2, 3)."""
        forward, right, up = camera_axes(self.camera)
        relative = segments - self.camera.position
        x, y, z = relative @ right, relative @ up, relative @ forward
        # Clip at a plane just in front of the camera.
        near = 1e-6 * np.abs(z).max()
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip((near - z[:, 0]) / (z[:, 1] - z[:, 0]), 0.0, 1.0)
        for end, outside in ((0, z[:, 0] < near), (1, z[:, 1] < near)):
            for values in (x, y, z):
                crossing = values[:, 0] + share * (values[:, 1] - values[:, 0])
                values[outside, end] = crossing[outside]
        number = np.flatnonzero(z.max(axis=1) > near)
        x, y, z = x[number], y[number], np.maximum(z[number], near)
        scale = max(self.width, self.height) / 2 / np.tan(np.radians(self.camera.fov) / 2)
        px, py = self.width / 2 + scale * x / z, self.height / 2 - scale * y / z
        # One sample per pixel and segment, at most across the whole picture.
        length = np.maximum(np.abs(np.diff(px)), np.abs(np.diff(py)))[:, 0]
        steps = np.clip(np.ceil(length), 1, 4 * self.width).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(number)), steps)
        begin = np.cumsum(steps) - steps
        s = (np.arange(len(edge)) - begin[edge]) / (steps[edge] - 1)
        column = np.floor(px[edge, 0] + s * (px[edge, 1] - px[edge, 0]))
        row = np.floor(py[edge, 0] + s * (py[edge, 1] - py[edge, 0]))
        inverse = 1 / z  # linear in the picture, as depth is not
        depth = 1 / (inverse[edge, 0] + s * (inverse[edge, 1] - inverse[edge, 0]))
        # Two by two subpixels: one pixel wide in the finished picture.
        column = np.concatenate([column, column + 1, column, column + 1])
        row = np.concatenate([row, row, row + 1, row + 1])
        depth, edge = np.tile(depth, 4), np.tile(number[edge], 4)
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        return (
            column[inside].astype(np.int64), row[inside].astype(np.int64),
            depth[inside], edge[inside],
        )  # fmt: skip


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

    def add(self, built: Built, records: list[dict[str, Any]]) -> None:
        """Draw a structure: its upper levels, and its leaves that hold triangles."""
        structure = built.structure
        scene = structure.scene
        if scene.source not in self._views:
            self._views = {scene.source: View(scene)}  # only the last: scenes come one by one
        view = self._views[scene.source]
        cells = structure.cells()
        stem = self._free_name(f"{scene.name}-{structure.name}")
        pictures = []
        if not cells.is_leaf.all():
            levels = shown_levels(cells)
            chosen = cells.depth < levels
            pictures.append(("levels", f"levels 0 to {levels - 1}", chosen))
        leaves = cells.is_leaf & (cells.count > 0)
        n_leaves = int(leaves.sum())
        text = f"{show_integer(n_leaves)} {'leaf' if n_leaves == 1 else 'leaves'} with triangles"
        if n_leaves > MOST_CELLS:
            # Every k-th: an even thinning keeps the shape.
            keep = np.flatnonzero(leaves)[:: -(-n_leaves // MOST_CELLS)]
            leaves = np.zeros_like(leaves)
            leaves[keep] = True
            text = f"{show_integer(len(keep))} of the {text}"
        pictures.append(("leaves", text, leaves))
        shown = []
        for kind, caption, chosen in pictures:
            file = f"{stem}-{kind}.png"
            colours = self._colours(structure, cells, chosen)
            write_png(self.folder / file, view.with_boxes(cells.boxes[chosen], colours))
            shown.append((file, caption))
        self._rows.append(section(built, records, shown))

    def _colours(self, structure: Structure, cells: Cells, chosen: np.ndarray) -> np.ndarray:
        """Return a colour per chosen cell: by depth, or by count where all are equally deep."""
        if cells.depth.max() > 0:
            return depth_colours(cells.depth[chosen], int(cells.depth[chosen].max()))
        return depth_colours(cells.count[chosen], int(cells.count.max()))

    def _free_name(self, wanted: str) -> str:
        """Return a file name that no earlier picture has taken."""
        stem = "".join(c if c.isalnum() or c in "-_." else "_" for c in wanted)
        name, n = stem, 2
        while name in self._names:
            name, n = f"{stem}-{n}", n + 1
        self._names.add(name)
        return name

    def write_page(self) -> None:
        """Write ``index.html`` beside the pictures."""
        write_text(self.folder / "index.html", PAGE.replace("ROWS", "\n".join(self._rows)))


RAY_SECTIONS = ("Rays", "Per ray")


def html_table(caption: str, rows: list[tuple[str, str, str]]) -> str:
    """Return rows of :func:`figures` as a table."""
    lines = "".join(
        f"<tr><th>{html.escape(label)}</th><td>{html.escape(text)}</td></tr>"
        for _, label, text in rows
    )
    return f"<table><caption>{html.escape(caption)}</caption>{lines}</table>"


def section(built: Built, records: list[dict[str, Any]], pictures: list[tuple[str, str]]) -> str:
    """Return the part of the page about one structure over one scene."""
    structure = built.structure
    shown = "".join(
        f'<figure><img src="{html.escape(file)}" alt="{html.escape(caption)}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
        for file, caption in pictures
    )
    rows = figures(records[0])
    tables = [html_table(structure.label, [row for row in rows if row[0] not in RAY_SECTIONS])]
    for record in records:
        rows = figures(record)
        tables.append(
            html_table(record["rays"]["name"], [row for row in rows if row[0] in RAY_SECTIONS])
        )
    return (
        f"<section><h2>{html.escape(structure.scene.name)} &middot; "
        f"{html.escape(structure.label)}</h2>"
        f"<p>{html.escape(to_text(structure.settings).replace(',', ', '))}</p>"
        f'<div class="row">{shown}<div class="tables">{"".join(tables)}</div></div></section>'
    )


PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>AccelScope</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 110rem;
  padding: 0 1.5rem; color: #222; background: #fff; }
h1 { font-weight: 600; } h2 { margin: 2.5rem 0 0; font-weight: 600; }
p { margin: .2rem 0 .8rem; color: #666; font-size: .85rem; }
.row { display: flex; flex-wrap: wrap; gap: 1.2rem; align-items: flex-start; }
figure { margin: 0; } img { width: 29rem; max-width: 100%; border: 1px solid #ddd; display: block; }
figcaption { color: #666; font-size: .85rem; margin-top: .3rem; }
.tables { display: flex; flex-wrap: wrap; gap: 1.5rem; align-items: flex-start; }
table { border-collapse: collapse; font-size: .85rem; } caption { text-align: left;
  font-weight: 600; padding-bottom: .3rem; }
th { text-align: left; font-weight: 400; padding: .1rem 1.2rem .1rem 0; color: #555; }
td { text-align: right; font-variant-numeric: tabular-nums; }
</style></head><body><h1>AccelScope</h1>
<p>Cells are coloured by depth, from blue (root) to red (deepest); cells of a grid by their number
of triangles. Lines behind the mesh are faint.</p>
ROWS
</body></html>
"""
