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
from accelscope.core.lessons import exhibits_of
from accelscope.core.structures import structures
from accelscope.core.structures.bvh import BVH

CHOICES = {field.name: field.metadata["choices"] for field in dataclasses.fields(BVH.Settings)}
BUILDERS, OPTIMISERS = list(CHOICES["builder"]), list(CHOICES["optimise"])

EVERYTHING = [(builder, optimise) for builder in BUILDERS for optimise in OPTIMISERS]
REPRESENTATIVE = [
    *((builder, "none") for builder in BUILDERS),
    *(("ploc", optimise) for optimise in OPTIMISERS if optimise != "none"),
]
REST = [each for each in EVERYTHING if each not in REPRESENTATIVE]


class Bench:
    """A grid that is bent by a keyframed modifier, and everything one can do with it."""

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
        self.root.workloads.random_lines.count = 50

    def status(self) -> str:
        return self.current.status(self.bpy.context).text

    def is_whole(self) -> bool:
        """Say whether all that the session keeps belongs to one structure."""
        current, structure = self.current, self.current.built.structure
        # An animation is beside the structure, and has an exhibit of its own.
        beside = {"refit_over_timeline"} if current.timeline else set()
        return (
            structure.scene is current.snapshot.scene
            and len(current.cells) == len(structure.cells())
            and current.record["structure"]["name"] == structure.name
            and current.record["scene"]["triangles"] == len(structure.scene)
            and {e.name for e in current.showcase.exhibits}
            == {e.name for e in exhibits_of(structure)} | beside
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
        assert self.current.record["rays"]["count"] == 50

    def step_ray(self) -> None:
        self.do("step_ray")
        tally = self.current.steps.tally()
        assert tally == {name: int(self.current.traced.counters[name][0]) for name in tally}

    def show_frame(self) -> None:
        group, showcase = self.root.exhibits, self.current.showcase
        for exhibit in showcase.exhibits:
            group.chosen = exhibit.name
            for number in {0, exhibit.count - 1}:
                group.frame = number
                group.show = True
                assert showcase.shown == (exhibit.name, number)
                assert showcase.frame_shown.caption
        if not showcase.exhibits:
            assert not self.bpy.ops.accelscope.show_frame.poll()

    def step_frame(self) -> None:
        if self.current.showcase.exhibits:
            self.root.exhibits.frame = 0
            self.do("step_frame", by=1)

    def show_links(self) -> None:
        assert self.bpy.ops.accelscope.show_links.poll() == self.current.has_links()
        if self.current.has_links():
            self.do("show_links")

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
        if structure.name != "bvh":
            assert not self.bpy.ops.accelscope.refit.poll()
            return
        self.bpy.context.scene.frame_set(3)
        assert self.status() == "Out of date: the geometry of Grid has changed"
        if structure.parts is not None:
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
        if structure.name != "bvh":
            assert not self.bpy.ops.accelscope.compare_over_timeline.poll()
            return
        before = self.bpy.context.scene.frame_current
        if structure.parts is not None:
            with pytest.raises(RuntimeError, match="cuts triangles into pieces"):
                self.bpy.ops.accelscope.compare_over_timeline()
            assert self.current.built.structure is structure
        else:
            self.do("compare_over_timeline")
            assert len(self.current.timeline) == 6
            names = [exhibit.name for exhibit in self.current.showcase.exhibits]
            assert "refit_over_timeline" in names
        assert self.bpy.context.scene.frame_current == before
        assert self.status() == "Up to date"


WITHOUT_RESULTS = {"add_sample_scene", "cancel", "clear", "view_exhibit"}
"""Operators that make, wait for and show nothing of a structure's own."""

VERBS: list[Callable[[Bench], None]] = [
    Bench.build, Bench.trace, Bench.step_ray, Bench.show_frame, Bench.step_frame,
    Bench.show_links, Bench.bake, Bench.export, Bench.refit, Bench.show_frame, Bench.trace,
    Bench.step_ray, Bench.bake, Bench.export, Bench.compare_over_timeline, Bench.show_frame,
    Bench.export, Bench.build,
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


@pytest.mark.parametrize("name", structures())
def test_every_structure(bench: Bench, name: str) -> None:
    bench.root.structure = name
    check_all_verbs(bench)


def test_the_matrix_does_not_shrink() -> None:
    assert len(BUILDERS) >= 13
    assert len(OPTIMISERS) >= 6
    assert len(EVERYTHING) == len(set(EVERYTHING)) >= 78
    assert sorted(REPRESENTATIVE + REST) == sorted(EVERYTHING)
    assert {builder for builder, _ in REPRESENTATIVE} == set(BUILDERS)
    assert {optimise for _, optimise in REPRESENTATIVE} == set(OPTIMISERS)
    verbs = {module.name for module in pkgutil.iter_modules(operators.__path__)}
    assert {verb.__name__ for verb in VERBS} | WITHOUT_RESULTS == verbs
