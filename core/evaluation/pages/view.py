"""The mesh of a scene as a picture, with lines and translucent faces drawn over it.

The mesh is rendered with our own rays, so a picture needs no window, no GPU and no Blender. Lines
are crisp in front of the mesh and faint behind it; faces are seen in front of it only.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...geometry.geometry import normals_at
from ...ranges import ranges
from ...scene import ORTHOGRAPHIC, Camera, Scene
from ...scene.camera_rays import camera_axes, camera_rays, window_of
from ...structures.bvh import BVH
from .picture_cameras import HEIGHT, WIDTH, picture_camera

SUPERSAMPLING = 2
BACKGROUND = np.array([0.965, 0.965, 0.955])
SURFACE = np.array([0.80, 0.80, 0.79])
HIDDEN = 0.22
"""Opacity of lines behind the mesh."""

MIDDLE = 0.2, 0.8
"""From where to where the middle of a picture goes, as shares of its width and height."""

PIXELS_AT_ONCE = 1 << 21
"""Pixels of faces that are worked on at once: as much as stays in the cache."""


class View:
    """The mesh of a scene seen by a camera: an image and the depth behind every pixel.

    Parameters
    ----------
    camera : Camera, optional
        By default the :func:`picture_camera`.
    reduction : float
        Pictures are WIDTH by HEIGHT, divided by this.

    Attributes
    ----------
    columns, rows : int
        Size of a finished picture.
    width, height : int
        Size of the image, SUPERSAMPLING times that.
    image : (height, width, 3) float64
    depth : (height, width) float64
        Distance along the view direction, inf where there is nothing.
    axes : tuple of (3,) float64
        To the right, up, and forward.
    """

    def __init__(self, scene: Scene, camera: Camera | None = None, reduction: float = 1.0) -> None:
        self.camera = camera or picture_camera(scene)
        self.columns, self.rows = round(WIDTH / reduction), round(HEIGHT / reduction)
        self.width, self.height = self.columns * SUPERSAMPLING, self.rows * SUPERSAMPLING
        rays = camera_rays(self.camera, self.width, self.height)
        hits, _ = BVH.build(scene, BVH.Settings()).trace(rays)
        hit = hits.primitive >= 0
        points = rays.origins[hit] + hits.t[hit, None] * rays.directions[hit]
        normals = normals_at(scene.geometry, hits.primitive[hit], points, rays.times[hit])
        forward, right, up = camera_axes(self.camera)
        normals *= -np.sign((normals * rays.directions[hit]).sum(axis=1, keepdims=True))
        # A key light over the viewer's left shoulder, and a fill from the front.
        key = -0.5 * forward - 0.45 * right + 0.75 * up
        key /= np.linalg.norm(key)
        light = 0.35 + 0.45 * np.clip(normals @ key, 0, 1) + 0.25 * np.abs(normals @ forward)
        image = np.tile(BACKGROUND, (self.width * self.height, 1))
        image[hit] = np.clip(light, 0, 1.05)[:, None] * SURFACE
        self.image = image.reshape(self.height, self.width, 3)
        # Camera rays have component 1 along the view direction, so t is the depth.
        self.depth = hits.t.reshape(self.height, self.width)
        self.axes = right, up, forward
        window = window_of(self.camera, self.width, self.height)
        # Pixels per unit of the window, and where in the picture the camera looks to.
        self._scale = self.width / 2 / window.half_width
        self._column = self.width / 2 - self._scale * window.x
        self._row = self.height / 2 + self._scale * window.y
        self._is_flat = self.camera.kind == ORTHOGRAPHIC

    def sees(self, points: np.ndarray) -> bool:
        """Say whether all points (n, 3) lie within the picture."""
        relative = points - self.camera.position
        x, y, z = (relative @ axis for axis in self.axes)
        if not (z > 0).all():
            return False
        column, row = self._pixels(x, y, z)
        within = (column >= 0) & (column <= self.width) & (row >= 0) & (row <= self.height)
        return bool(within.all())

    def places(self, points: np.ndarray) -> np.ndarray:
        """Return column and row in the finished picture of points (n, 3); NaN behind the eye."""
        x, y, z = ((points - self.camera.position) @ axis for axis in self.axes)
        with np.errstate(divide="ignore", invalid="ignore"):
            places = np.stack(self._pixels(x, y, z), axis=1) / SUPERSAMPLING
        places[z <= 0.0] = np.nan
        return places

    def towards_eye(self, points: np.ndarray) -> np.ndarray:
        """Return vectors from points (n, 3) to where they are seen from."""
        if self._is_flat:
            return np.broadcast_to(-self.axes[2], points.shape)
        return self.camera.position - points

    def _pixels(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return column and row where points to the right, up and forward are seen."""
        nearness = 1.0 if self._is_flat else 1.0 / z
        return (
            self._column + self._scale * x * nearness,
            self._row - self._scale * y * nearness,
        )

    def _linear(self, depth: np.ndarray) -> np.ndarray:
        """Return what is linear in the picture along lines in space, and the depth of that again.

        It is 1 / depth in perspective, and the depth itself in an orthographic picture.
        """
        return depth if self._is_flat else 1.0 / depth

    def points(self, rows: int, columns: int) -> tuple[np.ndarray, np.ndarray]:
        """Return what is seen of the mesh at the nodes of a grid over the middle of the picture.

        Returns
        -------
        points : (n, 3) float64
        widths : (n,) float64
            Width of the picture at their depths, in scene units.
        """
        row = (self.height * np.linspace(*MIDDLE, rows)).astype(np.int64).repeat(columns)
        column = np.tile((self.width * np.linspace(*MIDDLE, columns)).astype(np.int64), rows)
        depth = self.depth[row, column]
        hit = np.isfinite(depth)
        row, column, depth = row[hit], column[hit], depth[hit, None]
        right, up, forward = self.axes
        across = (column + 0.5 - self._column)[:, None] / self._scale
        above = (self._row - row - 0.5)[:, None] / self._scale
        away = np.ones_like(depth) if self._is_flat else depth
        points = self.camera.position + depth * forward + away * (across * right + above * up)
        return points, away[:, 0] * self.width / self._scale

    def with_lines(
        self,
        segments: np.ndarray,
        colours: np.ndarray,
        *,
        over: np.ndarray | None = None,
        width: int = 1,
        hidden: float = HIDDEN,
    ) -> np.ndarray:
        """Return the image with lines drawn over it, antialiased: (rows, columns, 3).

        Parameters
        ----------
        segments : (n, 2, 3) float64
            Of lines that coincide, the last is seen.
        colours : (n, 3) or (n, 4) float64
            sRGB, and opacity if it is not 1.
        over : (height, width, 3) float64, optional
            Another image of this view, such as :meth:`with_faces` returns.
        width : int
            In pixels.
        hidden : float
            Opacity behind the mesh.
        """
        background = self.image if over is None else over
        column, row, depth, number = self._sample(segments, width)
        pixel = row * self.width + column
        behind = depth > self.depth.ravel()[pixel] * (1 + 2e-4) + 1e-12
        # Of several lines in one pixel the nearest is seen, if it is not behind the mesh while
        # another one is not. Of lines that coincide, the last one counts as a little nearer.
        rank = depth.min(initial=np.inf) / depth * (1.0 + 1e-4 * number / max(len(segments), 1))
        rank[~behind] += 2.0
        best = np.zeros(self.depth.size)
        np.maximum.at(best, pixel, rank)
        seen = rank == best[pixel]
        pixel, number, behind = pixel[seen], number[seen], behind[seen]
        opacity = np.where(behind, hidden, 1.0)[:, None]
        if colours.shape[1] == 4:
            opacity = opacity * colours[number, 3:]
        canvas = background.reshape(-1, 3).copy()
        canvas[pixel] = (1 - opacity) * canvas[pixel] + opacity * colours[number, :3]
        fine = canvas.reshape(self.rows, SUPERSAMPLING, self.columns, SUPERSAMPLING, 3)
        # Summed by hand: a mean over two short axes takes ten times as long.
        coarse = np.zeros((self.rows, self.columns, 3))
        for i in range(SUPERSAMPLING):
            for j in range(SUPERSAMPLING):
                coarse += fine[:, i, :, j]
        return coarse / SUPERSAMPLING**2

    def with_faces(
        self, triangles: np.ndarray, colours: np.ndarray, opacity: float | np.ndarray
    ) -> np.ndarray:
        """Return the image behind translucent triangles, in the full size of the view.

        The order of faces does not matter: each pixel gets the mean of their colours, as opaque as
        all of them together.

        Parameters
        ----------
        triangles : (n, 3, 3) float64
        colours : (n, 3) or (3,) float64
            Of each, or of all.
        opacity : float or (n,) float64
            Of all or of each, less than 1.
        """
        rays_depth = self.depth[::SUPERSAMPLING, ::SUPERSAMPLING].ravel()
        layers = np.zeros(self.columns * self.rows)
        sums = np.zeros((3, self.columns * self.rows))
        passing = np.log1p(-np.broadcast_to(opacity, len(triangles)))
        through_all = np.zeros(self.columns * self.rows)
        for pixel, depth, number in self._covered(triangles):
            seen = depth <= rays_depth[pixel] * (1 + 2e-4)
            pixel, number = pixel[seen], number[seen]
            layers += np.bincount(pixel, minlength=len(layers))
            through_all += np.bincount(pixel, passing[number], minlength=len(layers))
            if colours.ndim == 2:
                for channel in range(3):
                    weights = colours[number, channel]
                    sums[channel] += np.bincount(pixel, weights, minlength=len(layers))
        if colours.ndim == 1:
            sums = colours[:, None] * layers
        through = np.exp(through_all).reshape(self.rows, self.columns)
        mean = (sums / np.maximum(layers, 1.0)).T.reshape(self.rows, self.columns, 3)
        through, mean = (
            each.repeat(SUPERSAMPLING, axis=0).repeat(SUPERSAMPLING, axis=1)
            for each in (through[:, :, None], mean)
        )
        return through * self.image + (1.0 - through) * mean

    def _covered(
        self, triangles: np.ndarray
    ) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        """Yield number, depth and triangle of the finished picture's pixels under triangles."""
        x, y, linear, number = self._projected(triangles)
        # Rows whose middle lies in the triangle.
        first = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, self.rows).astype(np.int64)
        last = np.clip(np.ceil(y.max(axis=1) - 0.5), 0, self.rows).astype(np.int64)
        heights = np.maximum(last - first, 0)
        owner, row = np.repeat(np.arange(len(first)), heights), ranges(first, heights)
        middle = row + 0.5
        left = np.full((2, len(row)), np.inf)  # column, and what is linear of the depth there
        right = np.full((2, len(row)), -np.inf)
        for a, b in ((0, 1), (1, 2), (2, 0)):
            ya, yb = y[owner, a], y[owner, b]
            crossed = (ya <= middle) != (yb <= middle)
            share = (middle - ya) / np.where(crossed, yb - ya, 1.0)
            point = np.stack(
                [v[owner, a] + share * (v[owner, b] - v[owner, a]) for v in (x, linear)]
            )
            left = np.where(crossed & (point[0] < left[0]), point, left)
            right = np.where(crossed & (point[0] > right[0]), point, right)
        good = np.isfinite(left[0]) & np.isfinite(right[0])
        owner, row, left, right = owner[good], row[good], left[:, good], right[:, good]
        begin = np.clip(np.ceil(left[0] - 0.5), 0, self.columns).astype(np.int64)
        end = np.clip(np.ceil(right[0] - 0.5), 0, self.columns).astype(np.int64)
        widths = np.maximum(end - begin, 0)
        slope = (right[1] - left[1]) / np.maximum(right[0] - left[0], 1e-12)
        parts = np.cumsum(widths) // PIXELS_AT_ONCE
        for part in range(int(parts.max(initial=-1)) + 1):
            chosen = np.flatnonzero(parts == part)
            span = np.repeat(chosen, widths[chosen])
            column = ranges(begin[chosen], widths[chosen])
            there = left[1, span] + slope[span] * (column + 0.5 - left[0, span])
            yield row[span] * self.columns + column, self._linear(there), number[owner[span]]

    def _projected(
        self, triangles: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return where triangles fall in the finished picture, cut off just before the camera.

        Returns
        -------
        x, y, linear : (m, 3) float64
            Place of each corner in pixels, and what is linear of its depth.
        number : (m,) int64
            The triangle that each of them is a part of.
        """
        seen = np.stack([(triangles - self.camera.position) @ axis for axis in self.axes], axis=-1)
        near = 1e-3 * np.abs(seen[..., 2]).max(initial=0.0)
        number = np.arange(len(seen))
        # Corners in front of the camera come first.
        seen = np.take_along_axis(
            seen, np.argsort(seen[..., 2] < near, axis=1, kind="stable")[..., None], 1
        )
        in_front = (seen[..., 2] >= near).sum(axis=1)
        one, two = seen[in_front == 1], seen[in_front == 2]
        a, b, c = (two[:, i] for i in range(3))
        ac, bc = _cut(a, c, near), _cut(b, c, near)
        corner = one[:, 0]
        tip = np.stack(
            [corner, _cut(corner, one[:, 1], near), _cut(corner, one[:, 2], near)], axis=1
        )
        parts = np.concatenate(
            [seen[in_front == 3], tip, np.stack([a, b, ac], axis=1), np.stack([b, bc, ac], axis=1)]
        )
        number = np.concatenate([number[in_front == n] for n in (3, 1, 2, 2)])
        x, y, z = np.moveaxis(parts, -1, 0)
        column, row = self._pixels(x, y, z)
        return column / SUPERSAMPLING, row / SUPERSAMPLING, self._linear(z), number

    def _sample(
        self, segments: np.ndarray, width: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return column, row, depth and segment number of the pixels under segments (n, 2, 3)."""
        relative = segments - self.camera.position
        x, y, z = (relative @ axis for axis in self.axes)
        # Clip at a plane just in front of the camera.
        near = 1e-6 * np.abs(z).max(initial=0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.clip((near - z[:, 0]) / (z[:, 1] - z[:, 0]), 0.0, 1.0)
        for end, outside in ((0, z[:, 0] < near), (1, z[:, 1] < near)):
            for values in (x, y, z):
                crossing = values[:, 0] + share * (values[:, 1] - values[:, 0])
                values[outside, end] = crossing[outside]
        number = np.flatnonzero(z.max(axis=1) > near)
        x, y, z = x[number], y[number], np.maximum(z[number], near)
        px, py = self._pixels(x, y, z)
        # One sample per pixel and segment, at most across the whole picture.
        length = np.maximum(np.abs(np.diff(px)), np.abs(np.diff(py)))[:, 0]
        steps = np.clip(np.ceil(length), 1, 4 * self.width).astype(np.int64) + 1
        edge = np.repeat(np.arange(len(number)), steps)
        begin = np.cumsum(steps) - steps
        s = (np.arange(len(edge)) - begin[edge]) / (steps[edge] - 1)
        column = np.floor(px[edge, 0] + s * (px[edge, 1] - px[edge, 0]))
        row = np.floor(py[edge, 0] + s * (py[edge, 1] - py[edge, 0]))
        linear = self._linear(z)
        depth = self._linear(linear[edge, 0] + s * (linear[edge, 1] - linear[edge, 0]))
        # As many subpixels as make the width in the finished picture, around the line.
        size = width * SUPERSAMPLING
        offset = np.arange(size) - (size - 1) // 2
        column = (column + np.tile(offset, size)[:, None]).ravel()
        row = (row + np.repeat(offset, size)[:, None]).ravel()
        depth, edge = np.tile(depth, size * size), np.tile(number[edge], size * size)
        inside = (column >= 0) & (column < self.width) & (row >= 0) & (row < self.height)
        return (
            column[inside].astype(np.int64), row[inside].astype(np.int64),
            depth[inside], edge[inside],
        )  # fmt: skip


def _cut(inside: np.ndarray, outside: np.ndarray, near: float) -> np.ndarray:
    """Return where lines between points (n, 3) meet the plane z = near."""
    share = (inside[:, 2] - near) / np.maximum(inside[:, 2] - outside[:, 2], 1e-300)
    return inside + share[:, None] * (outside - inside)
