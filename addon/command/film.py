"""``accelscope film``: a lesson, picture by picture.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from ...core.errors import InputError
from ..stopping import held
from .arguments import OpenFile
from .lessons import (
    add_subject,
    folder_of,
    lesson_parser,
    played,
    refuse_output,
    say_if_speechless,
)
from .output import print_result, progress_of

MOST_FRAMES = 600
"""Frames of a film: of more values some are taken evenly."""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    film = lesson_parser(
        commands, "film", "a lesson's knob from its first to its last value, as PNG frames",
        "Write one picture per value of the knob that the lesson's film goes through.",
    )  # fmt: skip
    add_subject(film)
    film.add_argument("--out", metavar="DIR", required=True, help="where the frames go")
    film.add_argument(
        "--video", metavar="FILE.mp4", help="encode them as a video, too, which needs Blender"
    )
    film.add_argument(
        "--fps", type=int, default=4, metavar="N", help="pictures per second of it (default: 4)"
    )
    film.set_defaults(run=run_film)


def run_film(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Write the frames of a film."""
    from ...core.evaluation.pages.lesson_page import pictures_along, turns, write_files
    from ...core.evaluation.pages.lesson_pictures import LessonPainter

    folder = folder_of(arguments, arguments.out, "--out", f"{arguments.name}-00.png")
    assert folder is not None
    encode = encoder(arguments)
    lesson = played(arguments, open_file)
    progress = progress_of(arguments)
    say_if_speechless(arguments)
    pictures = pictures_along(lesson, turns(lesson, MOST_FRAMES), progress)
    painter = LessonPainter(lesson.subject.scene, pictures)
    names = write_files(folder, lesson, pictures, painter)
    if encode is not None:
        encode(folder, names, Path(arguments.video), arguments.fps)
    if not arguments.quiet:
        print_result(arguments, f"{len(names)} frames in {folder}: {names[0]} to {names[-1]}")
    return 0


def encoder(arguments: argparse.Namespace) -> Callable[..., None] | None:
    """Return what makes a video of pictures; None if none is asked for.

    Raises
    ------
    InputError
        If there is no Blender, or nothing can be written there.
    """
    if arguments.video is None:
        return None
    if not arguments.video:
        raise InputError("--video names no file")
    if not 1 <= arguments.fps <= 120:
        raise InputError(f"--fps must be 1 to 120, not {arguments.fps}")
    refuse_output(arguments, Path(arguments.video))
    try:
        with held():
            import bpy  # noqa: F401  only to see whether it is there
    except ImportError:
        raise InputError(
            "a video needs Blender; install it with: pip install 'accelscope[blender]'"
        ) from None
    from ..to_blender.video import encode

    return encode
