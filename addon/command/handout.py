"""``accelscope handout``: all lessons on a page, and on paper.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse

from ...core.errors import InputError
from .arguments import OpenFile
from .lessons import folder_of, lesson_parser, say_if_speechless
from .output import SOME_MISSING, complain, complain_of, print_result, progress_of, say


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    handout = lesson_parser(
        commands, "handout", "all lessons in the order of the lecture, as HTML and PDF",
        "Write a page with every lesson over its own scene, and print it to PDF if there is a\n"
        "Chromium, Chrome or Edge where commands are looked for (PATH).",
    )  # fmt: skip
    handout.add_argument("--out", metavar="DIR", required=True, help="where the page goes")
    handout.add_argument("--lesson", nargs="+", metavar="NAME", help="these lessons only")
    handout.set_defaults(run=run_handout)


def run_handout(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Write the handout; lessons that fail leave the others alone."""
    from ...core.evaluation.pages.lesson_page import Handout, browser, play, print_pdf
    from ...core.kernels import announcing
    from ...core.lessons import lesson_named, lessons
    from ...sample_scenes import make_sample

    folder = folder_of(arguments, arguments.out, "--out", "index.html")
    assert folder is not None
    chosen = [lesson_named(name) for name in arguments.lesson or lessons()]
    say_if_speechless(arguments)
    handout, progress, failed = Handout(folder), progress_of(arguments), 0
    for lesson in chosen:
        try:
            with announcing(progress, f"lesson {lesson.name}"):
                subject = lesson.subject(make_sample(lesson.sample), progress)
                handout.add(play(lesson, subject, lesson.Settings(), progress), progress)
        except Exception as error:  # a defect, too, is told, and is no reason to stop
            reason = complain_of(arguments, f"lesson {lesson.name}", error)
            handout.add_failure(lesson, reason)
            failed += 1
    page = handout.write_page()
    if not arguments.quiet:
        print_result(arguments, f"{len(chosen) - failed} lessons in {page}")
    if (program := browser()) is None:
        say(arguments, "no browser here prints to PDF; print the page with one of yours")
        return SOME_MISSING if failed else 0
    try:
        print_pdf(page, folder / "handout.pdf", program)
    except InputError as error:
        complain(f"{error}; print the page with another browser")
        failed += 1
    else:
        say(arguments, f"printed to {folder / 'handout.pdf'}")
    return SOME_MISSING if failed else 0
