"""The curves of an animation and the trees of its last frame, as files and as a page."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ...contract.figures import look_up
from ...printing import in_html
from ..records.animation import METHODS, Comparison, growth
from ..records.report import Record, show_number, write_text
from .chart import Curve, line_chart
from .page import figure_tags, page_of
from .pictures import picture_of_levels
from .png import write_png
from .view import View

CHARTS = (
    ("cost", "SAH cost", ("statistics", "sah")),
    ("overlap", "Overlap of siblings", ("statistics", "overlap")),
    ("steps", "N_TS, traversal steps per ray", ("trace", "N_TS")),
    ("tests", "N_IT, triangle tests per ray", ("trace", "N_IT")),
    ("seconds", "Seconds to refit or to build", ("build", "seconds")),
)
"""Per chart its file, its title, and where the record has the figure."""


def curves_of(records: list[Record], path: tuple[str, ...]) -> list[Curve]:
    """Return one figure of the records over the frames, a curve per method."""
    return [
        Curve(
            method,
            np.array([record["frame"] for record in records[first::2]], dtype=np.float64),
            np.array([look_up(record, path) for record in records[first::2]], dtype=np.float64),
        )
        for first, method in enumerate(METHODS)
    ]


def write_page(folder: Path, comparison: Comparison) -> None:
    """Write a curve per figure, pictures of both trees of the last frame, and ``index.html``.

    Parameters
    ----------
    comparison : Comparison
        Of at least one frame; those that were refused are left out.
    """
    assert comparison.last is not None
    records = [record for record in comparison.records if "error" not in record]
    shown = []
    for name, title, path in CHARTS:
        write_text(folder / f"{name}.svg", line_chart(title, "frame", curves_of(records, path)))
        shown.append((f"{name}.svg", title))
    scene = comparison.last[0].structure.scene
    view = View(scene)
    for method, built, record in zip(METHODS, comparison.last, records[-2:], strict=True):
        caption, image = picture_of_levels(view, built.structure.cells())
        write_png(folder / f"{method}.png", image)
        cost = show_number(record["statistics"]["sah"])
        shown.append((f"{method}.png", f"Frame {record['frame']}, {method}: {caption}, SAH {cost}"))
    text = (
        f"{len(comparison.history)} frames, {len(scene)} triangles. In the last frame the cost of "
        f"the refitted tree is {growth(*records[-2:]):.3f} times that of a new one."
    )
    body = f'<p>{in_html(text)}</p><div class="row wide">{figure_tags(shown)}</div>'
    page = page_of(f"{scene.name}: refit against rebuild", body)
    write_text(folder / "index.html", page)
