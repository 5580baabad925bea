"""``accelscope lessons`` and ``lesson``: the slides of the lecture, live.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import dataclasses
import functools
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.errors import InputError
from ...core.scene import Scene
from ...core.settings import describe
from ...core.writing import refuse_unwritable
from .animate import frames_of, is_blend
from .arguments import (
    SPECS,
    OpenFile,
    add_scene_options,
    cutting_of,
    opened,
    scenes_of,
    structure_specs,
)
from .output import (
    note_on,
    print_result,
    progress_of,
    refuse_to_overwrite,
    say,
)

if TYPE_CHECKING:
    from ...core.contract.structure import Structure
    from ...core.evaluation.pages.lesson_page import Played
    from ...core.lessons.lesson import Lesson
    from ...core.progress import Progress

EXAMPLES = """\
examples:
  accelscope lessons
  accelscope lesson levels
  accelscope lesson levels bunny.obj --level 3 --structure bvh:builder=median --pictures levels
  accelscope lesson levels --page levels.html
  accelscope lesson refit step0.obj step1.obj step2.obj
  accelscope film levels --out film
  accelscope handout --out handout
"""

DESCRIPTION = """\
Play a lesson: the picture of a slide, its figures and its words. Without a SCENE it is the
lesson's own. Its knobs are options, such as --level 3; accelscope lessons lists them.
"""


def add_parsers(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommands."""
    listing = commands.add_parser("lessons", help="the lessons, by the slides of the lecture")
    listing.add_argument("--json", action="store_const", const="-", help="as JSON")
    listing.set_defaults(run=run_list, quiet=False)

    one = lesson_parser(
        commands, "lesson", "play one lesson: figures, pictures, a page", DESCRIPTION
    )
    add_subject(one)
    one.add_argument("--pictures", metavar="DIR", help="write the pictures that tell most")
    one.add_argument(
        "--page", metavar="FILE", help="write one page with everything, and a knob to turn"
    )
    one.set_defaults(run=run_lesson)


def lesson_parser(
    commands: argparse._SubParsersAction, name: str, what: str, description: str
) -> argparse.ArgumentParser:
    """Declare a subcommand about lessons."""
    parser = commands.add_parser(
        name, help=what, description=description, epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False,
    )  # fmt: skip
    parser.add_argument(
        "--quiet", action="store_true", help="print errors only, no progress or remark"
    )
    return parser


def add_subject(parser: argparse.ArgumentParser) -> None:
    """Declare what a lesson is about."""
    add = parser.add_argument
    add("name", metavar="NAME", help="the lesson, as accelscope lessons lists it")
    add(
        "scenes",
        nargs="*",
        metavar="SCENE",
        help="one; without it, the lesson's own; refit takes the frames of an animation, too",
    )
    add("--structure", metavar="SPEC", help="a structure in the place of the lesson's first one")
    add("--open-file", action="store_true", help="the file that is open in Blender is the SCENE")
    add_scene_options(parser)


# ------------------------------------------------------------------------------------------- list


def run_list(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Print the lessons by slide."""
    from ...core.lessons import lessons

    if arguments.json:
        text = json.dumps([entry_of(lesson) for lesson in lessons().values()], indent=1)
    else:
        text = list_text(list(lessons().values()))
    print_result(arguments, text)
    return 0


def entry_of(lesson: Lesson) -> dict[str, Any]:
    """Return what there is to know of a lesson, as JSON takes it."""
    words = (
        "name",
        "label",
        "slide",
        "begin",
        "look_for",
        "question",
        "answer",
        "source",
        "sample",
    )
    return {
        **{name: getattr(lesson, name) for name in words},
        "structures": list(lesson.structures),
        "film": lesson.film,
        "knobs": describe(lesson.Settings),
    }


def list_text(lessons: Sequence[Lesson]) -> str:
    """Return lessons by slide for a person."""
    lines: list[str] = []
    slide = ""
    for lesson in lessons:
        if lesson.slide != slide:
            slide = lesson.slide
            lines += [""] * bool(lines) + [slide]
        lines.append(f"  {lesson.name}: {lesson.label}")
        for row in describe(lesson.Settings):
            assignment = f"--{row['key']} {row['default_text']}"
            lines.append(f"      {assignment}  {row['description']}; {row['takes']}")
    return "\n".join(lines)


# ------------------------------------------------------------------------------------- one lesson


def played(arguments: argparse.Namespace, open_file: OpenFile | None) -> Played:
    """Return the lesson that the arguments name, played.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, or if there is nothing to show of the scene.
    """
    from ...core.evaluation.pages.lesson_page import play
    from ...core.kernels import announcing
    from ...core.lessons import lesson_named
    from ...core.lessons.refit import history_of

    lesson = lesson_named(arguments.name)
    settings = lesson.parse(arguments.knobs)
    progress = progress_of(arguments)
    given: list[Structure] = []
    frames = frames_given(arguments, lesson, open_file, progress)
    if frames:
        scene = frames[0][1]().flat()
    else:
        scene = scene_of(arguments, lesson, open_file, progress)
    note_on(arguments, scene)
    with announcing(progress, f"lesson {lesson.name}"):
        if arguments.structure:
            ((entry, chosen),) = structure_specs(
                [arguments.structure], lambda text: say(arguments, text)
            )
            given.append(entry.build(scene, chosen, progress, log=True))
        subject = lesson.subject(scene, progress, given)
        if frames:
            scenes = ((number, open_one().flat()) for number, open_one in frames)
            history = history_of(scenes, subject.structures[0], progress)
            subject = dataclasses.replace(subject, history=history)
        return play(lesson, subject, settings, progress)


def frames_given(
    arguments: argparse.Namespace, lesson: Lesson, open_file: OpenFile | None, progress: Progress
) -> list[tuple[int, Callable[[], Scene]]]:
    """Return number and opener of every frame, if a lesson that takes an animation is given one.

    That is the timeline of a .blend, or several mesh files, one each.

    Raises
    ------
    InputError
        If the .blend cannot be read.
    """
    scenes = arguments.scenes
    is_animation = (
        len(scenes) > 1 or arguments.open_file or any(is_blend(scene) for scene in scenes)
    )
    if not lesson.takes_frames or not is_animation:
        return []
    if scenes and arguments.open_file:
        raise InputError("--open-file and a SCENE exclude each other")
    frames = frames_of(scenes, None, open_file is not None, progress)
    return [
        (number, functools.partial(opened, open_one, progress)) for number, _, open_one in frames
    ]


def scene_of(
    arguments: argparse.Namespace, lesson: Lesson, open_file: OpenFile | None, progress: Progress
) -> Scene:
    """Return the scene that is named, that which is open in Blender, or the lesson's own.

    Raises
    ------
    InputError
        If more than one is named, or it cannot be opened.
    """
    if len(arguments.scenes) > 1:
        raise InputError(f"a lesson takes one SCENE, not {len(arguments.scenes)}")
    if arguments.scenes and arguments.open_file:
        raise InputError("--open-file and a SCENE exclude each other")
    if not arguments.scenes and not arguments.open_file:
        from ...sample_scenes import make_sample

        return make_sample(lesson.sample)
    scenes = scenes_of(arguments.scenes, arguments.instances, open_file, cutting_of(arguments))
    return opened(scenes[0][1], progress)


def run_lesson(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Play a lesson, write what was asked for, and print its words and figures."""
    from ...core.evaluation.pages.lesson_page import write_lesson_page, write_pictures

    folder = folder_of(arguments, arguments.pictures, "--pictures", f"{arguments.name}-00.png")
    if arguments.page is not None:
        if not arguments.page:
            raise InputError("--page names no file")
        refuse_output(arguments, Path(arguments.page))
    lesson = played(arguments, open_file)
    progress = progress_of(arguments)
    if folder is not None:
        say_if_speechless(arguments)
        write_pictures(folder, lesson, progress)
    if arguments.page:
        say_if_speechless(arguments)
        write_lesson_page(Path(arguments.page), lesson, progress)
    if not arguments.quiet:
        print_result(arguments, text_of(lesson))
    return 0


def text_of(played: Played) -> str:
    """Return the words and figures of a lesson."""
    lesson = played.lesson
    picture = played.play.picture(played.settings)
    width = max((len(row.label) for row in picture.rows), default=0)
    lines = [f"{lesson.slide}: {lesson.label}", f"{lesson.begin}.", "", f"{picture.caption}."]
    lines += [f"  {row.label:{width}}  {row.text}" for row in picture.rows]
    lines += ["", f"Look for: {lesson.look_for}.", f"Question: {lesson.question}"]
    lines += [f"Answer: {lesson.answer}.", f"Source: core/{lesson.source.replace('.', '/')}.py"]
    return "\n".join(lines)


def refuse_output(arguments: argparse.Namespace, path: Path) -> None:
    """Raise InputError for an output that is the scene, or that cannot be written."""
    inputs = [*getattr(arguments, "scenes", ()), *filter(None, [arguments.open_path])]
    refuse_to_overwrite(inputs, [path])
    refuse_unwritable(path)


def folder_of(
    arguments: argparse.Namespace, name: str | None, option: str, file: str
) -> Path | None:
    """Return the folder that an option names; None if it was not given.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    if name is None:
        return None
    if not name:  # as of a variable of a shell that is not set
        raise InputError(f"{option} names no folder; . is the one you are in")
    refuse_output(arguments, Path(name) / file)
    return Path(name)


def say_if_speechless(arguments: argparse.Namespace) -> None:
    """Say that pictures will be without text, if they will."""
    from ...core.evaluation.pages.lettering import can_letter

    if not can_letter():
        say(arguments, "pictures are without text, since Pillow is not installed")
