"""The pictures of a volume's efficiency, lines in three colours, and a page with its figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ...lessons.solid_efficiency import VIEWS, volume_efficiency
from ...scene import Scene
from ...structures.bvh import BVH
from ..records.efficiency import COLUMNS
from ..records.report import Record, failure, write_text
from .lesson_page import REDUCTION
from .page import columns_table, figure_tags, page_of
from .picture_cameras import camera_around, picture_camera
from .png import write_png
from .view import View


def write_page(folder: Path, scene: Scene, records: Sequence[Record]) -> None:
    """Write a picture of every kind of volume in every view, and ``index.html``.

    Parameters
    ----------
    records : sequence of dict
        As :meth:`..records.efficiency.Measurement.of` returns them; of failed ones only the reason
        is shown.
    """
    kinds = [record["volume"] for record in records if "error" not in record]
    exhibit = volume_efficiency(BVH.build(scene, BVH.Settings()), kinds)
    frames = [exhibit.frame(number) for number in range(exhibit.count)]
    points = np.concatenate([frame.segments.reshape(-1, 3) for frame in frames])
    view = View(scene, camera_around(picture_camera(scene), points), REDUCTION)
    figures = []
    for number, frame in enumerate(frames):
        kind, name = kinds[number // len(VIEWS)], VIEWS[number % len(VIEWS)]
        file = f"{kind}-{name.replace(' ', '_')}.png"
        write_png(folder / file, view.with_lines(frame.segments, frame.colours))
        figures.append((file, frame.caption))
    table = columns_table([title for title, _ in COLUMNS], [cells_of(each) for each in records])
    body = f'{ABOUT}{table}{COLOURS}<div class="frames">{figure_tags(figures)}</div>'
    write_text(
        folder / "index.html", page_of(f"{scene.name}: efficiency of bounding volumes", body)
    )


def cells_of(record: Record) -> list[str]:
    """Return the cells of a record's row in the table."""
    if "error" in record:
        return [record["volume"], failure(record)]
    return [show(record) for _, show in COLUMNS]


ABOUT = """<p>B + p I &lt; I: B and I are times per ray on this machine, p is the share of lines
that hit the volume. p_SA and p_measured are the shares of the lines through the volume that hit
the object, from the areas of its convex hull and the volume, and counted.</p>"""

COLOURS = """<p>Grey lines miss the volume, orange ones hit it in vain, green ones hit the
object.</p>"""
