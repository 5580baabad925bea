"""The pages of lessons: one lesson with its knob to turn, and the handout of all of them."""

from __future__ import annotations

import base64
import dataclasses
import io
import json
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...errors import InputError
from ...lessons.lesson import Lesson, Play, Subject
from ...lessons.picture import Picture
from ...printing import in_html
from ...progress import SILENT, Progress
from ...settings import key_of, parse, parse_spec, to_text, value_to_text
from ...writing import write_bytes
from ..records.report import write_text
from .lesson_pictures import LessonPainter
from .page import figure_tags, page_of, rows_table
from .png import png_bytes, write_png

REDUCTION = 1.5
"""Pictures on the page of one lesson are smaller than files of them by this."""

MOST_TURNS = 25
"""Positions of the knob on the page of one lesson."""

BROWSERS = "chromium", "chromium-browser", "google-chrome", "chrome", "msedge"
"""What prints a page to PDF."""

PATIENCE = 600.0
"""Seconds that it may take."""


class Played(NamedTuple):
    """A lesson, what it is about, how its knobs stand, and the play."""

    lesson: Lesson
    subject: Subject
    settings: Any
    play: Play


def play(lesson: Lesson, subject: Subject, settings: Any, progress: Progress = SILENT) -> Played:
    """Play a lesson; knobs beyond their ends are turned back.

    Raises
    ------
    InputError
        If there is nothing to show of this subject.
    Cancelled
        From `progress`.
    """
    played = lesson.play(subject, settings, progress)
    return Played(lesson, subject, played.within(settings), played)


def pictures_along(
    played: Played, settings: Sequence[Any], progress: Progress = SILENT
) -> list[Picture]:
    """Return the pictures of several positions of the knobs; plays anew where one asks for it.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    lesson, play, found = played.lesson, played.play, []
    key = lesson.key(played.settings)
    for number, each in enumerate(settings):
        progress.report(number, len(settings), f"Pictures of {lesson.name}")
        if lesson.key(each) != key:
            play, key = lesson.play(played.subject, each, progress), lesson.key(each)
        found.append(play.picture(play.within(each)))
    return found


def pictures_that_tell(played: Played, progress: Progress = SILENT) -> list[Picture]:
    """Return the pictures that a page shows.

    Raises
    ------
    Cancelled
        From `progress`.
    """
    positions = played.play.on_page(played.lesson, played.settings)
    return pictures_along(played, positions, progress)


def turns(played: Played, most: int = MOST_TURNS) -> list[Any]:
    """Return the positions of the knob that a film goes through; some evenly if they are many."""
    lesson, values = played.lesson, played.play.film(played.lesson)
    chosen = np.unique(np.linspace(0, len(values) - 1, min(len(values), most)).round().astype(int))
    return [
        dataclasses.replace(played.settings, **{lesson.film: values[number]}) for number in chosen
    ]


def write_pictures(folder: Path, played: Played, progress: Progress = SILENT) -> list[str]:
    """Write the pictures that tell most as PNG files; return their names.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    pictures = pictures_that_tell(played, progress)
    return write_files(folder, played, pictures, LessonPainter(played.subject.scene, pictures))


def write_files(
    folder: Path, played: Played, pictures: Sequence[Picture], painter: LessonPainter
) -> list[str]:
    """Write pictures, and images that belong to them, as PNG files; return the pictures' names.

    Of images whose colours mean something, the raw numbers are written beside them, as NPY files.
    """
    names: list[str] = []
    digits = max(len(str(len(pictures) - 1)), 2)  # by name they stand in their order
    for number, picture in enumerate(pictures):
        stem_of_all = f"{played.lesson.name}-{number:0{digits}}"
        names.append(f"{stem_of_all}.png")
        write_png(folder / names[-1], painter.paint(picture))
        for image in picture.images:
            stem = folder / f"{stem_of_all}-{image.name}"
            write_png(stem.with_suffix(".png"), image.pixels)
            if image.values is not None:
                raw = io.BytesIO()
                np.save(raw, image.values)
                write_bytes(stem.with_suffix(".npy"), raw.getvalue())
    return names


# ------------------------------------------------------------------------------------- one lesson


def write_lesson_page(path: Path, played: Played, progress: Progress = SILENT) -> None:
    """Write one file with everything in it: words, pictures along the knob, figures.

    Raises
    ------
    InputError
        If the place cannot be written to.
    """
    positions = turns(played)
    pictures = pictures_along(played, positions, progress)
    painter = LessonPainter(played.subject.scene, pictures, REDUCTION)
    steps = []
    for number, (settings, picture) in enumerate(zip(positions, pictures, strict=True)):
        progress.report(number, len(pictures), "Painting")
        value = str(getattr(settings, played.lesson.film))
        steps.append(
            {
                "value": value,
                "image": as_data(painter.paint(picture)),
                "caption": picture.caption,
                "rows": [[row.label, row.text, row.meaning] for row in picture.rows],
            }
        )
    start = positions.index(played.settings) if played.settings in positions else 0
    label = next(
        field.metadata["label"]
        for field in dataclasses.fields(played.lesson.Settings)
        if field.name == played.lesson.film
    )
    data = json.dumps({"steps": steps, "start": start}).replace("</", "<\\/")
    body = (
        f"{words_before(played.lesson)}<p><label>{in_html(label)} "
        f'<input id="knob" type="range" min="0" max="{len(steps) - 1}" value="{start}">'
        '</label> <output id="value"></output></p>'
        '<div class="row"><figure class="lesson"><img id="picture" alt="">'
        '<figcaption id="caption"></figcaption></figure><table id="rows"></table>'
        "</div>"
        f"{words_after(played)}<script>const lesson = {data};{SCRIPT}</script>"
    )
    write_text(path, page_of(played.lesson.label, body))


def as_data(image: np.ndarray) -> str:
    """Return an image as the address of itself."""
    return "data:image/png;base64," + base64.b64encode(png_bytes(image)).decode("ascii")


def words_before(lesson: Lesson) -> str:
    """Return what is read before the pictures."""
    return (
        f'<p class="slide">{in_html(lesson.slide)}</p><p class="begin">{in_html(lesson.begin)}.</p>'
        f"<p><b>Look for:</b> {in_html(lesson.look_for)}.</p>"
    )


def command_of(played: Played) -> str:
    """Return the command that leads here again, for whoever has the scene."""
    lesson, subject = played.lesson, played.subject
    words = ["accelscope", "lesson", lesson.name]
    if subject.scene.source != f"sample:{lesson.sample}":
        words.append(subject.scene.source)
    if lesson.structures:
        first = subject.structures[0]
        name, texts = parse_spec(lesson.structures[0])
        own: Any = parse(type(first).Settings, texts, "") if name == first.name else None
        if first.settings != own:
            words += ["--structure", f"{first.name}:{to_text(first.settings)}"]
    for field in dataclasses.fields(lesson.Settings):
        value = getattr(played.settings, field.name)
        if value != field.default:
            words += [f"--{key_of(field)}", value_to_text(field, value)]
    return shlex.join(words)


def words_after(played: Played) -> str:
    """Return the question with its answer, and how to come here again."""
    lesson, scene = played.lesson, played.subject.scene
    settings = to_text(played.settings).replace(",", ", ")
    return (
        f'<details><summary>{in_html(lesson.question)}</summary><p class="begin">'
        f"{in_html(lesson.answer)}.</p></details>"
        f"<p>Scene {in_html(scene.name)}; {in_html(settings)}. "
        f"<code>{in_html(command_of(played))}</code>. "
        f"Source: <code>core/{in_html(lesson.source.replace('.', '/'))}.py</code></p>"
    )


SCRIPT = """
const at = id => document.getElementById(id);
function show() {
  const step = lesson.steps[at("knob").value];
  at("picture").src = step.image; at("picture").alt = step.caption;
  at("caption").textContent = step.caption; at("value").textContent = step.value;
  at("rows").replaceChildren(...step.rows.map(([label, text, meaning]) => {
    const row = document.createElement("tr"), head = document.createElement("th");
    const cell = document.createElement("td");
    row.title = meaning; head.textContent = label; cell.textContent = text;
    row.append(head, cell); return row; }));
}
at("knob").oninput = show; show();
"""


# ---------------------------------------------------------------------------------------- handout


class Handout:
    """A folder with a page of all lessons in the order of the lecture."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._contents: list[str] = []
        self._sections: list[str] = []

    def add(self, played: Played, progress: Progress = SILENT) -> None:
        """Add a lesson, with the pictures that tell most.

        Raises
        ------
        InputError
            If the place cannot be written to.
        """
        lesson = played.lesson
        pictures = pictures_that_tell(played, progress)
        painter = LessonPainter(played.subject.scene, pictures)
        names = write_files(self.folder, played, pictures, painter)
        figures = [(name, picture.caption) for name, picture in zip(names, pictures, strict=True)]
        rows = [(row.label, row.text) for row in pictures[-1].rows]
        table = rows_table("Figures of the last picture", rows) if rows else ""
        self._contents.append(
            f'<li><a href="#{lesson.name}">{in_html(lesson.label)}</a> '
            f"<small>{in_html(lesson.slide)}</small></li>"
        )
        self._sections.append(
            f'<section class="lesson" id="{lesson.name}"><h2>{in_html(lesson.label)}</h2>'
            f'{words_before(lesson)}<div class="frames two">{figure_tags(figures)}</div>'
            f"{table}{words_after(played)}</section>"
        )

    def add_failure(self, lesson: Lesson, reason: str) -> None:
        """Say why a lesson is not in it."""
        self._sections.append(
            f'<section class="lesson"><h2>{in_html(lesson.label)}</h2>'
            f'<p class="failed">{in_html(reason)}</p></section>'
        )

    def write_page(self) -> Path:
        """Write ``index.html`` beside the pictures; return its path."""
        contents = f'<ul class="contents">{"".join(self._contents)}</ul>'
        path = self.folder / "index.html"
        heading = "Acceleration techniques for ray tracing, lesson by lesson"
        write_text(path, page_of(heading, contents + "\n".join(self._sections) + OPEN))
        return path


OPEN = """<script>addEventListener("beforeprint", () =>
document.querySelectorAll("details").forEach(each => each.open = true));</script>"""
"""On paper there is no click that shows an answer."""


def browser() -> str | None:
    """Return a browser that prints pages to PDF, or None."""
    return next((path for name in BROWSERS if (path := shutil.which(name))), None)


def print_pdf(page: Path, pdf: Path, program: str) -> None:
    """Print a page with a browser; what stood there before goes first.

    Raises
    ------
    InputError
        If it does not.
    """
    pdf.unlink(missing_ok=True)
    with tempfile.TemporaryDirectory() as profile:
        words = [
            program, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}",
            "--no-pdf-header-footer", f"--print-to-pdf={pdf.resolve()}", page.resolve().as_uri(),
        ]  # fmt: skip
        try:
            subprocess.run(words, capture_output=True, timeout=PATIENCE, check=True)
        except (OSError, subprocess.SubprocessError) as error:
            raise InputError(f"{Path(program).name} could not print {page.name}") from error
    if not pdf.is_file():
        raise InputError(f"{Path(program).name} did not print {page.name} to {pdf.name}")
