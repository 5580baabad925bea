"""``accelscope evaluate``: every structure over every scene, traced with every set of rays.

Like :mod:`.main`, this imports no ``bpy``; a ``.blend`` brings it in.
"""

from __future__ import annotations

import argparse
import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from ...core.errors import InputError
from ...core.scene import Scene
from .arguments import (
    SPECS,
    OpenFile,
    add_scene_options,
    cutting_of,
    opened,
    refuse_bad_threads,
    scenes_of,
    structure_specs,
    take_scenes,
    workload_specs,
)
from .output import (
    Results,
    add_output_options,
    add_threads_option,
    note_on,
    note_on_numba,
    progress_of,
    refuse_bad_outputs,
    say,
)

if TYPE_CHECKING:
    from ...core.contract.structure import Structure
    from ...core.evaluation.rays.workloads import Workload
    from ...core.evaluation.records.experiment import Built, Traced
    from ...core.geometry.rays import Rays

EXAMPLES = """\
examples:
  accelscope evaluate bunny.obj
  accelscope evaluate bunny.obj --structure bvh grid --rays camera
  accelscope evaluate sample:tetra --structure grid:resolution=35x35x35,mailbox=true \\
      --rays random_lines:count=100000 --json result.json
"""


def add_parser(commands: argparse._SubParsersAction) -> None:
    """Declare the subcommand."""
    parser = commands.add_parser(
        "evaluate",
        help="build every structure over every scene and trace every set of rays",
        epilog=f"{SPECS}\n{EXAMPLES}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    add = parser.add_argument
    add("scenes", nargs="*", metavar="SCENE", help="without any, Blender's open file")
    add("--structure", nargs="+", metavar="SPEC", action="extend",
        help="structures, as accelscope list names them, or all (default: bvh)")  # fmt: skip
    add("--rays", nargs="+", metavar="SPEC", action="extend",
        help="camera, whitted, ambient, random_lines or file (default: random_lines)")  # fmt: skip
    add("--hits", metavar="PATH.npz", help="write hits and counters of every ray")
    add("--image", metavar="PATH.png",
        help="write the picture of rays such as whitted, as numbers (.npy), too")  # fmt: skip
    add_scene_options(parser)
    add_output_options(parser, "pictures of the cells over the mesh")
    add_threads_option(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace, open_file: OpenFile | None) -> int:
    """Run every combination, then write what was asked for; return the exit code.

    Raises
    ------
    InputError
        For whatever is wrong with the arguments or the places to write to.
    """
    from ...core.evaluation.rays.workloads import WORKLOADS
    from ...core.structures import module_names

    # Everything that can be refused is looked at before the first long computation.
    names = take_scenes(arguments, "structure", [*module_names(), "all"], "structure") or ["bvh"]
    rays = take_scenes(arguments, "rays", WORKLOADS, "rays") or ["random_lines"]
    chosen = structure_specs(names, functools.partial(say, arguments))
    workloads = workload_specs(rays)
    refuse_bad_threads(arguments.threads)
    scenes = scenes_of(arguments.scenes, arguments.instances, open_file, cutting_of(arguments))
    runs = len(scenes) * len(chosen) * len(workloads)
    for option, path in (("--hits", arguments.hits), ("--image", arguments.image)):
        if path and runs != 1:
            raise InputError(
                f"{option} takes one scene, structure and set of rays, not {runs} combinations"
            )
    images = image_files(arguments.image, workloads[0][0])
    rays_files = [settings.path for _, settings in workloads if hasattr(settings, "path")]
    refuse_bad_outputs(arguments, [*arguments.scenes, *rays_files], [arguments.hits, *images])
    note_on_numba(arguments)

    batch = Batch(arguments, chosen, workloads, runs)
    with batch.results:
        for name, open_one in scenes:
            batch.add_scene(name, open_one)
    return batch.results.exit_code


def image_files(path: str | None, workload: type[Workload]) -> list[str]:
    """Return the files that an image may be written to; none if none is asked for.

    Raises
    ------
    InputError
        If the rays make no picture, or its name is that of another kind of file.
    """
    if path is None:
        return []
    from ...core.evaluation.pages.picture_files import picture_files

    if not workload.FIGURES:
        raise InputError(
            f"rays {workload.name} make no picture; --image takes --rays whitted or ambient"
        )
    if Path(path).suffix.lower() != ".png":
        raise InputError(f"--image writes PNG; call it something.png, not '{path}'")
    return [str(each) for each in picture_files(path)]


class Asked(NamedTuple):
    """Rays that were asked for, and why there are none of them for a scene, if so."""

    workload: type[Workload]
    settings: Any
    rays: Rays | None
    refusal: str = ""


class Batch:
    """Combinations of scenes, structures and rays; what is refused is told and left out."""

    def __init__(
        self,
        arguments: argparse.Namespace,
        chosen: list[tuple[type[Structure], Any]],
        workloads: list[tuple[type[Workload], Any]],
        runs: int,
    ) -> None:
        from ...core.evaluation.records.report import table

        self.arguments, self.chosen, self.workloads = arguments, chosen, workloads
        self.progress = progress_of(arguments)
        self.results = Results(arguments, table, runs)
        self.gallery = None
        if arguments.pictures:
            from ...core.evaluation.pages.pictures import Gallery

            self.gallery = Gallery(Path(arguments.pictures))
            self.results.write_page = self.gallery.write_page

    def add_scene(self, name: str, open_one: Callable[[], Scene]) -> None:
        """Open a scene, then build every structure over it and trace every set of rays."""
        scene, reason = self.results.attempt(name, lambda: opened(open_one, self.progress))
        if scene is None:
            for structure_type, settings in self.chosen:
                self.add_failure(name, structure_type, settings, [reason] * len(self.workloads))
            return
        note_on(self.arguments, scene)
        asked = [self.rays_over(scene, name, *workload) for workload in self.workloads]
        for structure_type, settings in self.chosen:
            if any(each.rays is not None for each in asked):
                self.add_structure(scene, structure_type, settings, asked)
            else:
                self.add_failure(scene, structure_type, settings, [each.refusal for each in asked])

    def rays_over(self, scene: Scene, name: str, workload: type[Workload], settings: Any) -> Asked:
        """Make a set of rays, or tell why there is none."""
        where = f"{name}, rays {workload.name}"
        rays, refusal = self.results.attempt(where, lambda: workload.make(scene, settings))
        return Asked(workload, settings, rays, refusal)

    def add_failure(
        self, scene: Scene | str, structure_type: type[Structure], settings: Any, reasons: list[str]
    ) -> None:
        """Add the failed records of a structure, one per set of rays, and tell why on the page."""
        from ...core.evaluation.records.experiment import make_failed_record

        self.results.records += [
            make_failed_record(scene, structure_type, settings, *workload, reason)
            for workload, reason in zip(self.workloads, reasons, strict=True)
        ]
        if self.gallery:
            name = scene if isinstance(scene, str) else scene.name
            self.gallery.add_failure(name, structure_type, settings, reasons[0])
        self.results.keep()

    def add_structure(
        self, scene: Scene, structure_type: type[Structure], settings: Any, asked: list[Asked]
    ) -> None:
        """Build a structure and trace every set of rays."""
        from ...core.evaluation.records.experiment import build, make_failed_record

        where = f"{scene.name}, {structure_type.name}"
        built, reason = self.results.attempt(
            where,
            lambda: build(
                scene, structure_type, settings, self.progress, log=self.gallery is not None
            ),
        )
        if built is None:
            self.add_failure(scene, structure_type, settings, [reason] * len(self.workloads))
            return
        shown = []
        for each in asked:
            measured, reason = None, each.refusal
            if each.rays is not None:
                measured, reason = self.results.attempt(
                    f"{where}, rays {each.workload.name}",
                    functools.partial(self.measure, built, each, each.rays),
                )
            if measured is None:
                self.results.records.append(
                    make_failed_record(
                        scene, structure_type, settings, each.workload, each.settings, reason
                    )
                )
                continue
            record, traced = measured
            self.results.records.append(record)
            shown.append(traced.rays)
            self.results.keep()
            if self.arguments.hits:
                write_hits(self.arguments.hits, scene, traced)
            if self.arguments.image:
                from ...core.evaluation.pages.picture_files import write_picture

                assert traced.outcome is not None
                write_picture(self.arguments.image, traced.outcome)
        if self.gallery:
            records = self.results.records[-len(self.workloads) :]
            draw = functools.partial(self.gallery.add, built, records, shown)
            self.results.attempt(f"{where}, pictures", draw)
        self.results.keep()

    def measure(self, built: Built, asked: Asked, rays: Rays) -> tuple[dict[str, Any], Traced]:
        """Trace one set of rays; return the record, and what was traced."""
        from ...core.evaluation.records.experiment import make_record, refuse_not_finite, trace_rays

        traced = trace_rays(
            built, asked.workload, asked.settings, rays, self.arguments.threads, self.progress
        )
        record = make_record(built, traced, self.progress)
        refuse_not_finite(record)
        return record, traced


def write_hits(path: str, scene: Scene, traced: Any) -> None:
    """Write every ray, what it hit, and its counters.

    A hit has t, the instance, and the primitive: its number in the order of the file, or in that of
    the instance's mesh. The rays are as ``file:`` reads them.
    """
    from ...core.evaluation.rays.ray_files import columns_of
    from ...core.geometry.csg.trees import Csg
    from ...core.geometry.instances import owners_of
    from ...core.writing import replacing

    instance, primitive = owners_of(scene.geometry, traced.hits.primitive)
    if not (instance >= 0).any() and not isinstance(scene.geometry, Csg):
        primitive = np.where(primitive >= 0, scene.primitive_ids[primitive], -1)
    columns: dict[str, Any] = {
        "t": traced.hits.t,
        "primitive": primitive.astype(np.int32),
        "instance": instance.astype(np.int32),
        **columns_of(traced.rays),
        **traced.counters.by_name(),
    }
    with replacing(path) as file:
        np.savez_compressed(file, **columns)
