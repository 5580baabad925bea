"""Every builder, every optimiser, every verb of the add-on, as a script calls them.

The choices come from the settings, the verbs from the folder `operators`: what is added is in it.
"""

from __future__ import annotations

import dataclasses
import json
import pkgutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from accelscope import operators
from accelscope.core.contract.protocols import Refittable
from accelscope.core.contract.within import cells_with_instances
from accelscope.core.geometry.instances import Instanced, primitives_in
from accelscope.core.kernels import plain
from accelscope.core.lessons import lessons
from accelscope.core.scene import Scene
from accelscope.core.scene.camera_rays import PRIMARY
from accelscope.core.scene.placing import by_objects
from accelscope.core.structures import general_structures, structures
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.routed import ROUTES

CHOICES = {field.name: field.metadata["choices"] for field in dataclasses.fields(BVH.Settings)}
BUILDERS, OPTIMISERS = list(CHOICES["builder"]), list(CHOICES["optimise"])

EVERYTHING = [(builder, optimise) for builder in BUILDERS for optimise in OPTIMISERS]
REPRESENTATIVE = [
    *((builder, "none") for builder in BUILDERS),
    *(("ploc", optimise) for optimise in OPTIMISERS if optimise != "none"),
]
REST = [each for each in EVERYTHING if each not in REPRESENTATIVE]


def triangles_in(scene: Scene) -> int:
    """Those of every instance counted."""
    is_of_instances = isinstance(scene.geometry, Instanced)
    return primitives_in(scene.geometry) if is_of_instances else len(scene)


class Bench:
    """A grid that is bent by a keyframed modifier, and everything one can do with it.

    Attributes
    ----------
    count : int
        Rays that are traced.
    """

    count = 50

    def __init__(self, bpy: Any, folder: Path) -> None:
        from accelscope.addon.results import session

        self.bpy, self.folder, self.current = bpy, folder, session.current
        self.root = bpy.context.scene.accelscope
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=8, y_subdivisions=8, size=4)
        self.grid = bpy.context.object
        modifier = self.grid.modifiers.new("Bend", "SIMPLE_DEFORM")
        modifier.deform_method = "TWIST"
        for frame, angle in ((1, 0.1), (3, 2.0)):
            modifier.angle = angle
            modifier.keyframe_insert("angle", frame=frame)
        bpy.context.scene.frame_start, bpy.context.scene.frame_end = 1, 3
        bpy.context.scene.frame_set(1)
        self.root.workload = "random_lines"
        self.root.workloads.random_lines.count = self.count

    def status(self) -> str:
        return self.current.status(self.bpy.context).text

    def is_whole(self) -> bool:
        """Say whether all that the session keeps belongs to one structure."""
        current, structure = self.current, self.current.built.structure
        taken = current.snapshot.scene
        over = by_objects(taken) if structure.keeps_instances else taken
        same = over is taken and structure.scene is taken
        return (
            (same or len(structure.scene) == len(over))
            and len(current.cells) == len(cells_with_instances(structure))
            and current.record["structure"]["name"] == structure.name
            and current.record["scene"]["triangles"] == triangles_in(taken)
            and bool(current.history) == bool(current.timeline)
        )

    def do(self, verb: str, **arguments: Any) -> None:
        assert getattr(self.bpy.ops.accelscope, verb)(**arguments) == {"FINISHED"}, verb

    # One method per operator.

    def build(self) -> None:
        self.do("build")
        assert self.current.built.structure.validate() == []
        assert self.status() == "Up to date"

    def trace(self) -> None:
        self.do("trace")
        assert self.current.record["rays"]["count"] == self.count

    def step_ray(self) -> None:
        from accelscope.addon.results import lesson_view

        self.do("step_ray")
        assert lesson_view.current.subject.structures[0] is self.current.built.structure
        tally = lesson_view.current.play.walk.steps.tally()
        assert tally == {name: int(self.current.traced.counters[name][0]) for name in tally}

    def teach(self) -> None:
        """Teach a lesson about this structure, if it still has its log and one suits it."""
        from accelscope.addon.results import lesson_view

        structure, view = self.current.built.structure, lesson_view.current
        fitting = [
            name for name, lesson in lessons().items() if not lesson.suits(structure)
            and lesson.structures and lesson.name in QUICK
        ]  # fmt: skip
        for name in fitting:
            self.root.teaching.lesson = name
            self.do("teach", subject="MESH")
            assert view.lesson.name == name
            # What a ray does needs no log of the building.
            has_all = structure.build_log is not None or lessons()[name].takes_ray
            is_given = has_all and self.status() == "Up to date"
            assert (view.subject.structures[0] is structure) == is_given
            assert view.picture.caption
            assert view.fault == ""
            self.do("end_lesson")
        assert self.current.built.structure is structure

    def bake(self) -> None:
        self.do("bake")
        assert self.status() == "Up to date"

    def export(self) -> None:
        for kind in ("JSON", "CSV"):
            path = self.folder / f"figures.{kind.lower()}"
            self.do("export", filepath=str(path), format=kind)
            assert path.stat().st_size > 0
        written = json.loads((self.folder / "figures.json").read_text())["records"]
        assert written == json.loads(json.dumps([self.current.record, *self.current.timeline]))

    def refit(self) -> None:
        structure = self.current.built.structure
        if not isinstance(structure, Refittable):
            assert not self.bpy.ops.accelscope.refit.poll()
            return
        self.bpy.context.scene.frame_set(3)
        assert self.status() == "Out of date: the geometry of Grid has changed"
        if getattr(structure, "parts", None) is not None:
            with pytest.raises(RuntimeError, match="cuts triangles into pieces"):
                self.bpy.ops.accelscope.refit()
            assert self.current.built.structure is structure
            assert self.status().startswith("Out of date")
            self.build()
            return
        self.do("refit")
        assert self.current.record["method"] == "refit"
        assert self.current.built.structure.validate() == []
        assert self.status() == "Up to date"
        self.bpy.context.scene.frame_set(1)
        assert self.status() == "Out of date: the geometry of Grid has changed"
        self.bpy.context.scene.frame_set(3)
        assert self.status() == "Up to date"

    def compare_over_timeline(self) -> None:
        structure = self.current.built.structure
        if not isinstance(structure, Refittable):
            assert not self.bpy.ops.accelscope.compare_over_timeline.poll()
            return
        before = self.bpy.context.scene.frame_current
        if getattr(structure, "parts", None) is not None:
            with pytest.raises(RuntimeError, match="cuts triangles into pieces"):
                self.bpy.ops.accelscope.compare_over_timeline()
            assert self.current.built.structure is structure
        else:
            self.do("compare_over_timeline")
            assert len(self.current.timeline) == 6
            assert len(self.current.history) == 3
        assert self.bpy.context.scene.frame_current == before
        assert self.status() == "Up to date"


class SeenBench(Bench):
    """The same before a camera and below a lamp, from which structures are built and rays sent."""

    count = 24 * 18

    def __init__(self, bpy: Any, folder: Path) -> None:
        super().__init__(bpy, folder)
        bpy.ops.object.light_add(type="POINT", location=(1.0, -1.0, 4.0))
        bpy.ops.object.camera_add(location=(0.0, -7.0, 5.0), rotation=(0.95, 0.0, 0.0))
        bpy.context.scene.camera = bpy.context.object
        bpy.context.view_layer.objects.active = self.grid
        for obj in bpy.context.selected_objects:
            obj.select_set(obj == self.grid)
        self.root.workload = "camera"
        camera = self.root.workloads.camera
        camera.width, camera.height = 24, 18

    def trace(self) -> None:
        self.do("trace")
        rays = self.current.record["rays"]
        shadows = rays["classes"].get("shadow", 0)
        assert rays["count"] == self.count + shadows
        assert (shadows > 0) == self.root.workloads.camera.shadows

    def run_program(self) -> None:
        self.do("run_program")
        launch = self.current.launched["launch"]
        assert launch["calls"]["ray_generation"] == self.count
        assert launch["calls"]["closest_hit"] + launch["calls"]["miss"] == self.count

    def trace_in_vain(self) -> None:
        """Trace what there are no answers for: one line says what to do, and nothing is lost."""
        with pytest.raises(RuntimeError, match=r"rays only, not primary ones; .* structure Routed"):
            self.bpy.ops.accelscope.trace()
        assert self.current.traced is None
        assert not self.bpy.ops.accelscope.step_ray.poll()
        assert self.status() == "Up to date"


QUICK = "levels", "ray"
"""Lessons about any hierarchy, and about any structure: the others are tried in tests/core."""

OF_LESSONS = {
    "end_lesson", "explain_figure", "film_on_timeline", "open_lesson_image", "pick_ray",
    "play_film", "play_lesson", "read_source", "step_film", "step_lesson", "step_this_ray",
    "use_my_mesh", "use_this_view", "view_lesson",
}  # fmt: skip
"""Operators that go on with a lesson: see test_lessons.py and test_rays_of_lessons.py."""

WITHOUT_RESULTS = {
    "add_sample_scene",
    "cancel",
    "clear",
    "copy_program",
    "keep_picture",
    "stop_compiling",
} | OF_LESSONS
"""Operators that make nothing of a structure's own."""

VERBS: list[Callable[[Bench], None]] = [
    Bench.build, Bench.trace, Bench.step_ray, Bench.teach, Bench.bake, Bench.export, Bench.refit,
    Bench.teach, Bench.trace, Bench.step_ray, Bench.bake, Bench.export,
    Bench.compare_over_timeline, Bench.teach, Bench.export, Bench.build,
]  # fmt: skip
"""In an order in which one meets what the one before has left."""


def check_all_verbs(bench: Bench) -> None:
    for verb in VERBS:
        verb(bench)
        assert bench.is_whole(), verb.__name__


@pytest.fixture
def bench(bpy: Any, tmp_path: Path) -> Bench:
    return Bench(bpy, tmp_path)


def choose(bench: Bench, builder: str, optimise: str) -> None:
    bench.root.structure = "bvh"
    bench.root.structures.bvh.builder = builder
    bench.root.structures.bvh.optimise = optimise


@pytest.mark.parametrize(("builder", "optimise"), REPRESENTATIVE)
def test_every_builder_and_every_optimiser(bench: Bench, builder: str, optimise: str) -> None:
    choose(bench, builder, optimise)
    check_all_verbs(bench)


@pytest.mark.exhaustive
@pytest.mark.parametrize(("builder", "optimise"), REST)
def test_every_builder_with_every_optimiser(bench: Bench, builder: str, optimise: str) -> None:
    choose(bench, builder, optimise)
    check_all_verbs(bench)


@pytest.mark.parametrize("name", general_structures())
def test_every_structure(bench: Bench, name: str) -> None:
    bench.root.structure = name
    check_all_verbs(bench)


DIRECTIONAL = {name: each for name, each in structures().items() if each.answers is not None}


@pytest.mark.parametrize("name", DIRECTIONAL)
def test_every_directional_structure(bpy: Any, tmp_path: Path, name: str) -> None:
    """By itself with the rays of a camera, if it answers those."""
    bench = SeenBench(bpy, tmp_path)
    bench.root.structure = name
    answers_camera = PRIMARY in (DIRECTIONAL[name].answers or ())
    for verb in VERBS:
        if answers_camera or verb not in (Bench.trace, Bench.step_ray):
            getattr(bench, verb.__name__)()
        else:
            bench.trace_in_vain()
        assert bench.is_whole(), verb.__name__


@pytest.mark.parametrize("name", DIRECTIONAL)
def test_every_directional_structure_on_its_route(bpy: Any, tmp_path: Path, name: str) -> None:
    bench = SeenBench(bpy, tmp_path)
    bench.root.structure, bench.root.workloads.camera.shadows = "routed", True
    routes = [kind for kind in DIRECTIONAL[name].answers or () if kind in ROUTES]
    assert routes
    for kind in routes:
        setattr(bench.root.structures.routed, kind, name)
    for verb in VERBS:
        getattr(bench, verb.__name__)()
        assert bench.is_whole(), verb.__name__
        if verb is Bench.trace:
            shares = bench.current.record["trace"]["routes"]
            answered = {kind: shares[kind]["structure"] for kind in routes}
            assert set(answered.values()) == {name}


@pytest.mark.parametrize("name", structures())
def test_every_structure_runs_a_program(bpy: Any, tmp_path: Path, name: str) -> None:
    """Those that answer every ray, and are there before it comes; all others are refused."""
    bench = SeenBench(bpy, tmp_path)
    bench.root.structure = name
    bench.root.pipeline.program = "distance"
    with plain(True):  # each would compile a walk of its own
        bench.build()
        structure = bench.current.built.structure
        if structure.answers is None and structure.made() is None and name != "routed":
            bench.run_program()
        else:
            with pytest.raises(RuntimeError, match=r"not answer every ray|made by rays"):
                bench.run_program()
            assert bench.current.launched is None
    assert bench.is_whole()


def test_the_matrix_does_not_shrink() -> None:
    assert len(BUILDERS) >= 13
    assert len(OPTIMISERS) >= 6
    assert set(DIRECTIONAL) >= {"light_buffer", "image_directory", "ray_coherence"}
    assert len(EVERYTHING) == len(set(EVERYTHING)) >= 78
    assert sorted(REPRESENTATIVE + REST) == sorted(EVERYTHING)
    assert {builder for builder, _ in REPRESENTATIVE} == set(BUILDERS)
    assert {optimise for _, optimise in REPRESENTATIVE} == set(OPTIMISERS)
    verbs = {module.name for module in pkgutil.iter_modules(operators.__path__)}
    tried = {verb.__name__ for verb in [*VERBS, SeenBench.run_program]}
    assert tried | WITHOUT_RESULTS == verbs
