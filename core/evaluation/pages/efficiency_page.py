"""The pictures of a volume's efficiency, lines in three colours, and a page with its figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from string import Template

import numpy as np

from ...lessons.volume import VIEWS, volume_efficiency
from ...printing import in_html
from ...scene import Scene
from ...structures.bvh import BVH
from ..records.efficiency import COLUMNS
from ..records.report import Record, failure, write_text
from .exhibit_pictures import REDUCTION
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
        text = in_html(frame.caption)
        figures.append(
            f'<figure><img src="{file}" alt="{text}"><figcaption>{text}</figcaption></figure>'
        )
    titles = "".join(f"<th>{in_html(title)}</th>" for title, _ in COLUMNS)
    rows = "".join(f"<tr>{cells_of(record)}</tr>" for record in records)
    page = PAGE.substitute(
        scene=in_html(scene.name),
        table=f"<tr>{titles}</tr>{rows}",
        figures="\n".join(figures),
    )
    write_text(folder / "index.html", page)


def cells_of(record: Record) -> str:
    """Return the cells of a record's row in the table."""
    if "error" in record:
        reason = in_html(failure(record))
        return f"<td>{record['volume']}</td><td colspan={len(COLUMNS) - 1}>{reason}</td>"
    return "".join(f"<td>{in_html(show(record))}</td>" for _, show in COLUMNS)


PAGE = Template("""<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>AccelScope</title>
<style>
body { font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 110rem;
  padding: 0 1.5rem; color: #222; background: #fff; }
div { display: flex; flex-wrap: wrap; gap: 1.2rem; } figure { margin: 0; width: 25rem; }
img { width: 100%; border: 1px solid #ddd; } figcaption, p { color: #666; font-size: .85rem; }
table { border-collapse: collapse; font-size: .85rem; margin: 1rem 0 1.5rem; }
th, td { text-align: right; padding: .15rem 1rem .15rem 0; font-variant-numeric: tabular-nums; }
th { font-weight: 600; }
</style></head><body><h1>$scene: efficiency of bounding volumes</h1>
<p>B + p I &lt; I: B and I are times per ray on this machine, p is the share of lines that hit the
volume. p_SA and p_measured are the shares of the lines through the volume that hit the object,
from the areas of its convex hull and the volume, and counted.</p>
<table>$table</table>
<p>Grey lines miss the volume, orange ones hit it in vain, green ones hit the object.</p>
<div>
$figures
</div></body></html>
""")
