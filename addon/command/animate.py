"""``accelscope animate``: refit against rebuild, frame by frame.

Frames come from the timeline of a .blend (or of the file that is open in Blender), or are mesh
files, one each. Like :mod:`.main`, this imports no ``bpy`` before it has to.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable
from pathlib import Path

from ...core.errors import InputError
from ...core.progress import Progress
from ...core.scene import Scene
from ...core.scene.placing import FLATTEN, OBJECTS
from .arguments import (
    SPECS,
    OpenFile,
    add_scene_options,
    open_scene,
    opened,
    refuse_bad_threads,
    scenes_of,
    structure_specs,
    workload_specs,
)
from .output import (
    Results,
    add_output_options,
    add_threads_option,
    note_on,
    progress_of,
    refuse_bad_outputs,
    say,
)

EXAMPLES = """\
examples:
  accelscope animate walk.blend --frames 1:24 --pictures walk
  accelscope animate walk.blend --structure bvh:builder=binned_sah --csv walk.csv
  accelscope animate step0.obj step1.obj step2.obj
"""

MOST_FRAMES = 100_000


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "animate",
        help="refit against rebuild over the frames of an animation",
        description="Keep the tree of the first frame and refit it to every other one; compare its "
        "cost with that of a tree built for that frame.",
        epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="a .blend, or mesh files, one per frame")
    add("--structure", default="bvh", metavar="SPEC", help="bvh or two_level[:key=value,...]")
    add("--frames", metavar="A:B[:STEP]",
        help="frames of the timeline; by default its own range")  # fmt: skip
    add("--rays", default="random_lines:count=20000", metavar="SPEC",
        help="what is traced in every frame (default: %(default)s)")  # fmt: skip
    add_scene_options(parser, are_flattened=True)
    add_output_options(parser, "curves over the frames")
    add_threads_option(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Compare over all frames and write what was asked for; return the exit code.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the frames or the places to write to.
    """
    from ...core.contract.protocols import Refittable
    from ...core.structures import structures_that_are

    chosen = structure_specs([arguments.structure], functools.partial(say, arguments))
    structure, settings = chosen[0]
    if len(chosen) > 1 or not issubclass(structure, Refittable):
        known = " or ".join(each.name for each in structures_that_are(Refittable))
        raise InputError(f"only {known} can be refitted, not {arguments.structure}")
    ((workload, workload_settings),) = workload_specs([arguments.rays])
    refuse_bad_threads(arguments.threads)
    numbers = frame_numbers(arguments.frames) if arguments.frames else None
    refuse_bad_outputs(arguments, arguments.scenes)

    from ...core.evaluation.pages.animation_page import write_page
    from ...core.evaluation.records.animation import METHODS, Comparison, table

    progress = progress_of(arguments)
    instances = OBJECTS if structure.keeps_instances else FLATTEN
    frames = frames_of(arguments.scenes, numbers, open_file is not None, progress, instances)
    found = Comparison(
        structure, settings, workload, workload_settings, arguments.threads, progress
    )
    remarks: set[str] = set()
    with Results(arguments, table, len(METHODS) * len(frames)) as results:
        results.records = found.records
        results.write_page = lambda: write_page(Path(arguments.pictures), found)
        for number, name, open_one in frames:
            scene: Scene | str = name
            try:
                scene = opened(open_one, progress)
                note_on(arguments, scene, remarks)
                found.add(number, scene)
            except Exception as error:  # told below: the other frames can still be compared
                if found.last is None:
                    raise  # without a first tree there is nothing to compare
                found.add_failure(number, scene, results.complain(f"frame {number}", error))
            results.keep()
    return results.exit_code


def frame_numbers(text: str) -> range:
    """Return the frames that ``A:B``, ``A:B:STEP`` or ``A`` means, B included.

    Raises
    ------
    InputError
        If it means none, or is written otherwise.
    """
    try:
        parts = [int(part) for part in text.split(":")]
        first, last, step = (*parts, *(parts[0], 1)[len(parts) - 1 :])
    except ValueError:
        raise InputError(f"--frames is A:B or A:B:STEP, such as 1:24, not '{text}'") from None
    if step < 1 or last < first:
        raise InputError(f"--frames {text} means no frame; the first comes before the last")
    if last - first >= MOST_FRAMES * step:
        raise InputError(f"--frames {text} means more than {MOST_FRAMES} frames; ask for fewer")
    return range(first, last + 1, step)


def is_blend(name: str) -> bool:
    """Say whether a scene is a file of Blender's own, which has a timeline."""
    return name.lower().endswith(".blend")


def frames_of(
    scenes: list[str],
    numbers: range | None,
    in_blender: bool,
    progress: Progress,
    instances: str = FLATTEN,
) -> list[tuple[int, str, Callable[[], Scene]]]:
    """Return number, name of the file, and opener of every frame that the arguments name.

    Parameters
    ----------
    instances : {OBJECTS, FLATTEN}

    Raises
    ------
    InputError
        If there is none, or the .blend cannot be read.
    """
    is_file = len(scenes) == 1 and is_blend(scenes[0])
    if not scenes and not in_blender:
        raise InputError("name a .blend, or mesh files, one per frame")
    if is_file or not scenes:
        if is_file:
            opened(functools.partial(open_scene, scenes[0], instances), progress)
        import bpy

        from ..from_blender import extraction, timeline

        chosen = timeline.frame_range(bpy.context.scene) if numbers is None else numbers
        name = scenes[0] if is_file else "open file"
        take = functools.partial(timeline.scene_at, bpy.context, extraction.VISIBLE)
        return [(number, name, functools.partial(take, number, instances)) for number in chosen]
    if numbers is not None:
        raise InputError("--frames belongs to the timeline of one .blend; mesh files are one each")
    openers = scenes_of(scenes, instances, None)
    return [(number, name, open_one) for number, (name, open_one) in enumerate(openers)]
