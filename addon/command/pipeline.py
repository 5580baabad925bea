"""``accelscope pipeline``: DXR's shaders, as a program in Python, over a scene's camera.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in. A program is code: it runs
when it is named here, and nothing of a scene is ever run.
"""

from __future__ import annotations

import argparse
import functools
from typing import Any

from ...core.errors import InputError
from .arguments import (
    SPECS,
    OpenFile,
    add_scene_options,
    opened,
    refuse_bad_threads,
    scenes_of,
    structure_specs,
)
from .output import (
    Results,
    add_output_options,
    add_threads_option,
    image_files,
    note_on,
    note_on_numba,
    progress_of,
    refuse_bad_outputs,
    say,
)

EXAMPLES = """\
examples:
  accelscope pipeline sample:suzanne --image suzanne.png
  accelscope pipeline scene.blend --program shadows --image shadows.png --pixel 200,150
  accelscope pipeline bunny.obj --program mine.py --rays camera:width=1024,height=768 --json -
"""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "pipeline",
        help="run a ray tracing program of DXR's five kinds of shaders",
        description="Run ray generation, intersection, any hit, closest hit and miss shaders for "
        "every pixel of a camera, and count how often each is called.",
        epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="one; without it, Blender's open file")
    add("--program", default="lecture", metavar="NAME|FILE.py",
        help="lecture, which is the default, distance, shadows, mirror, leaves, masks, spheres, "
        "torus, or a file of your own, which is run")  # fmt: skip
    add("--structure", default="bvh", metavar="SPEC", help="what is traced against (default: bvh)")
    add("--rays", default="camera", metavar="SPEC",
        help="camera[:key=value,...]: where it stands, width and height")  # fmt: skip
    add("--image", metavar="PATH.png", help="write the picture, and as numbers (.npy)")
    add("--calls", metavar="PATH.png",
        help="write how often shaders were called for each pixel, and the numbers")  # fmt: skip
    add("--pixel", metavar="X,Y", help="tell the states of one pixel's rays, from the top left")
    add_output_options(parser)
    add_scene_options(parser)
    add_threads_option(parser)
    parser.set_defaults(run=run, pictures=None)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Run the program and write what was asked for; return the exit code.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scene, the program or the places to write to.
    """
    from ...core.evaluation.rays.camera import CameraWorkload
    from ...core.evaluation.records import launched
    from ...core.evaluation.records.experiment import build
    from ...core.pipeline.loading import program_at
    from ...core.settings import parse, parse_spec

    chosen = structure_specs([arguments.structure], functools.partial(say, arguments))
    if len(chosen) > 1:
        raise InputError("pipeline takes one structure; name it")
    structure, settings = chosen[0]
    name, texts = parse_spec(arguments.rays)
    if name != CameraWorkload.name:
        raise InputError(f"a program makes rays of its own from those of camera, not of {name}")
    view: Any = parse(launched.LaunchSettings, texts, "rays camera")
    CameraWorkload.refuse_impossible(view)
    pixel = None if arguments.pixel is None else pixel_of(arguments.pixel, view)
    refuse_bad_threads(arguments.threads)
    scenes = scenes_of(arguments.scenes, arguments.instances, open_file)
    if len(scenes) > 1:
        raise InputError(f"pipeline takes one SCENE, not {len(scenes)}")
    images = [*image_files(arguments.image, "--image"), *image_files(arguments.calls, "--calls")]
    inputs = [*arguments.scenes, *([arguments.program] * arguments.program.endswith(".py"))]
    refuse_bad_outputs(arguments, inputs, [str(each) for each in images])
    program = program_at(arguments.program)
    note_on_numba(arguments)

    progress = progress_of(arguments)
    _, open_one = scenes[0]
    scene = launched.seen_by(program, opened(open_one, progress))
    note_on(arguments, scene)
    with Results(arguments, launched.table, 1) as results:
        built = build(scene, structure, settings, progress)
        made = launched.run(built, program, view, arguments.threads, progress)
        states = None
        if pixel is not None:
            number = pixel[1] * view.width + pixel[0]
            states, _ = made.pipeline.record(made.rays, view.width, view.height, number)
        results.records.append(
            launched.make_record(
                built, arguments.program, made, view, arguments.threads, states, pixel or (0, 0)
            )
        )
        write_images(arguments, made.launched)
    return results.exit_code


def pixel_of(text: str, view: Any) -> tuple[int, int]:
    """Return the column and row that ``X,Y`` means.

    Raises
    ------
    InputError
        If it means no pixel of the picture.
    """
    try:
        x, y = (int(part) for part in text.replace("x", ",").split(","))
    except ValueError:
        raise InputError(f"--pixel is X,Y, such as 200,150, not '{text}'") from None
    if not (0 <= x < view.width and 0 <= y < view.height):
        raise InputError(
            f"pixel {x},{y} is not in the picture, which is {view.width} by {view.height}"
        )
    return x, y


def write_images(arguments: argparse.Namespace, made: Any) -> None:
    """Write the picture and the map of calls, if they were asked for."""
    from ...core.evaluation.pages.picture_files import map_of_calls, write_numbers

    if arguments.image:
        write_numbers(arguments.image, made.picture, made.colours)
    if arguments.calls:
        write_numbers(arguments.calls, map_of_calls(made.calls), made.calls)
