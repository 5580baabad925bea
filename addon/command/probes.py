"""``accelscope probes``: a picture of generalized rays, with what they have covered.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import functools
from typing import Any

from ...core.errors import InputError
from .arguments import SPECS, OpenFile, add_scene_options, opened, scenes_of, structure_specs
from .output import (
    Results,
    add_output_options,
    image_files,
    note_on,
    note_on_numba,
    progress_of,
    refuse_bad_outputs,
    say,
)

EXAMPLES = """\
examples:
  accelscope probes sample:room --image room.png --svg room.svg
  accelscope probes sample:facade --probe beam:depth=2,width=640,height=480 --image facade.png
  accelscope probes sample:suzanne --probe cone --structure bvh:volume=kdop14 --coverage cones.png
  accelscope probes sample:balls:size=1 --probe pyramid --structure octree --image balls.png
"""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "probes",
        help="a picture of generalized rays: cones, pyramids, beams",
        description="Cast probes that carry more than a point, and write what they see: the "
        "picture by exact areas, the share of each pixel that is covered, and visible polygons.",
        epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="one; without it, Blender's open file")
    add("--probe", default="beam", metavar="SPEC",
        help="cone, pyramid or beam, which is the default, [:key=value,...]: where the camera "
        "stands, width and height, what is its own")  # fmt: skip
    add("--structure", metavar="SPEC",
        help="what probes go through (default: what suits the probe)")  # fmt: skip
    add("--image", metavar="PATH.png", help="write the picture, and as numbers (.npy)")
    add("--coverage", metavar="PATH.png",
        help="write the share of each pixel that is covered, and as numbers (.npy)")  # fmt: skip
    add("--svg", metavar="PATH.svg", help="write the visible polygons; of beams only")
    add_output_options(parser)
    add_scene_options(parser)
    parser.set_defaults(run=run, pictures=None)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Cast the probes and write what was asked for; return the exit code.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments, the scene or the places to write to.
    """
    from ...core.evaluation.probes.kinds import probe_named
    from ...core.evaluation.records import probed
    from ...core.settings import parse, parse_spec

    name, texts = parse_spec(arguments.probe)
    probe = probe_named(name)
    settings: Any = parse(probe.Settings, texts, f"probe {name}")
    chosen = structure_specs(
        [arguments.structure or probe.structure], functools.partial(say, arguments)
    )
    if len(chosen) > 1:
        raise InputError("probes takes one structure; name it")
    structure, structure_settings = chosen[0]
    if arguments.svg and not probe.draws:
        raise InputError(f"probe {name} knows no outlines; leave --svg out, or choose beam")
    if arguments.svg and not arguments.svg.lower().endswith(".svg"):
        raise InputError(f"--svg writes SVG; call it something.svg, not '{arguments.svg}'")
    scenes = scenes_of(arguments.scenes, arguments.instances, open_file)
    if len(scenes) > 1:
        raise InputError(f"probes takes one SCENE, not {len(scenes)}")
    images = [
        str(each)
        for path, option in ((arguments.image, "--image"), (arguments.coverage, "--coverage"))
        for each in image_files(path, option)
    ]
    refuse_bad_outputs(arguments, arguments.scenes, [*images, arguments.svg])
    note_on_numba(arguments)

    progress = progress_of(arguments)
    _, open_one = scenes[0]
    scene = opened(open_one, progress)
    note_on(arguments, scene)
    with Results(arguments, probed.table, 1) as results:
        cast = probe.cast(scene, structure, structure_settings, settings, progress)
        for sentence in probed.notes_on_casting(scene, cast):
            say(arguments, f"{scene.name}: {sentence}")
        results.records.append(probed.make_record(scene, probe, settings, cast))
        write_files(arguments, cast)
    return results.exit_code


def write_files(arguments: argparse.Namespace, cast: Any) -> None:
    """Write the picture, what is covered and what is seen, if they were asked for."""
    import numpy as np

    from ...core.evaluation.pages.picture_files import write_numbers
    from ...core.evaluation.records.report import write_text

    if arguments.image:
        write_numbers(arguments.image, np.clip(cast.picture, 0.0, 1.0), cast.picture)
    if arguments.coverage:
        grey = np.repeat(np.clip(cast.covered, 0.0, 1.0)[:, :, None], 3, axis=2)
        write_numbers(arguments.coverage, grey, cast.covered)
    if arguments.svg:
        write_text(arguments.svg, cast.drawing)
