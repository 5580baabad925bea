"""Exhibit "volume efficiency": lines at the whole scene, and what its bounding volumes keep off.

As on the lecture's slide, in three colours: grey lines miss the volume and cost its test only,
orange ones hit it but not the object, in vain; green ones hit both. pA / pB is the share of green
ones among those that hit the volume.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..geometry.geometry import hulls_of
from ..geometry.kinds import KINDS
from ..geometry.polygons import Polygons
from ..geometry.rays import Rays
from ..progress import SILENT, Progress
from ..sah.line_sample import (
    Ball,
    LineSample,
    chords,
    parallel_lines_through,
    random_lines_through,
    sample_of,
)
from ..structures.bvh.hierarchy import BVH
from ..structures.bvh.topology.fit import fit_all
from .drawing import BLUE, GREEN, GREY, ORANGE, Lines, coloured, frame_of
from .exhibit import Exhibit, Frame, Once

SPREAD = 1.3
"""Size of the ball that lines are drawn through, in that around the scene's box."""

COUNTED, DRAWN = 20_000, 160
"""Lines that are counted, and lines that are drawn."""

VIEWS = ("random lines", "lines along x", "lines along y", "lines along z")


def volume_efficiency(structure: BVH, kinds: Sequence[str] = ()) -> Exhibit:
    """Return the exhibit: kinds of volumes, one after the other, each in every view.

    Without `kinds` all of them, that of the settings first.
    """
    scene = structure.scene
    ball = Ball.around(scene.lower, scene.upper, SPREAD)
    kinds = kinds or sorted(KINDS, key=lambda kind: kind != structure.settings.volume)

    def lines(view: int, count: int) -> Rays:
        if view == 0:
            return random_lines_through(ball, count, seed=1)
        return parallel_lines_through(ball, np.eye(3)[view - 1], count)

    def fitting(kind: str) -> Once[Any]:
        def fit(progress: Progress) -> Any:
            corners, _ = hulls_of(scene.geometry)
            return fit_all(kind, corners, np.zeros(1, int), np.full(1, len(corners)), progress)

        return Once(fit)

    volumes = {kind: fitting(kind) for kind in kinds}

    def frame(number: int, progress: Progress = SILENT) -> Frame:
        kind, view = kinds[number // len(VIEWS)], number % len(VIEWS)
        volume = volumes[kind](progress)
        counted = sample_of(lines(view, COUNTED), structure, volume, progress)
        drawn = sample_of(lines(view, DRAWN), structure, volume, progress)
        sign = "=" if view == 0 else "along this direction ="
        caption = (
            f"{kind}, {VIEWS[view]}: pA/pB {sign} {counted.ratio:.2f}; of all lines "
            f"{100.0 * counted.hits_volume.mean():.0f}% hit the volume (not grey), "
            f"{100.0 * counted.hits_object.mean():.0f}% the object (green)"
        )
        polygons = edges_of(volume.polygons(np.array([0])))
        return frame_of([*coloured_lines(drawn), coloured(polygons, BLUE)], caption)

    return Exhibit(
        "volume_efficiency",
        "Volume Efficiency",
        "Lines that miss a volume, that hit it in vain, and that hit the object, for every kind",
        len(kinds) * len(VIEWS),
        frame,
    )


def coloured_lines(sample: LineSample) -> list[Lines]:
    """Return the lines of a sample in three colours."""
    segments = chords(sample.rays)
    volume, both = sample.hits_volume, sample.hits_object
    return [
        coloured(segments[~volume], (*GREY[:3], 0.35)),
        coloured(segments[volume & ~both], ORANGE),
        coloured(segments[both], GREEN),
    ]


def edges_of(polygons: Polygons) -> np.ndarray:
    """Return the edges of polygons as segments, (m, 2, 3)."""
    following = np.arange(1, len(polygons.points) + 1)
    following[polygons.offsets[1:] - 1] = polygons.offsets[:-1]
    return np.stack([polygons.points, polygons.points[following]], axis=1)
