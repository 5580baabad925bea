"""The pictures of a volume's efficiency, lines in three colours, and a page with its figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ...lessons.lesson import Subject
from ...lessons.solid_efficiency import Settings, play
from ...progress import SILENT
from ...scene import Scene
from ...structures.bvh import BVH
from ..records.efficiency import COLUMNS
from ..records.report import Record, failure, write_text
from .lesson_page import REDUCTION
from .lesson_pictures import LessonPainter
from .page import columns_table, figure_tags, page_of
from .png import write_png

VIEWS = "all", "x", "y", "z"
"""Directions of the lines in pictures."""


def write_page(folder: Path, scene: Scene, records: Sequence[Record]) -> None:
    """Write a picture of every kind of volume in every view, and ``index.html``.

    Parameters
    ----------
    records : sequence of dict
        As :meth:`..records.efficiency.Measurement.of` returns them; of failed ones only the reason
        is shown.
    """
    kinds = [record["volume"] for record in records if "error" not in record]
    subject = Subject(scene, (BVH.build(scene, BVH.Settings()),))
    shown = []
    for kind in kinds:
        played = play(subject, Settings(volume=kind), SILENT)
        shown += [
            (kind, view, played.picture(Settings(volume=kind, direction=view))) for view in VIEWS
        ]
    painter = LessonPainter(scene, [picture for _, _, picture in shown], REDUCTION)
    figures = []
    for kind, view, picture in shown:
        file = f"{kind}-{view}.png"
        write_png(folder / file, painter.paint(picture))
        figures.append((file, picture.caption))
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
