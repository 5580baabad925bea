"""Cells that are made when a ray first enters them: the same hits, counters and cells."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import VISIT_EMPTY, VISIT_INNER, VISIT_LEAF
from accelscope.core.contract.lazy import LazyStructure
from accelscope.core.evaluation.pages.pictures import entered_by, walk_to_show
from accelscope.core.evaluation.pages.view import View
from accelscope.core.evaluation.rays.workloads import (
    RandomLinesSettings,
    RandomLinesWorkload,
    random_lines,
)
from accelscope.core.evaluation.records.experiment import Built, make_record, trace_rays
from accelscope.core.evaluation.records.report import figures, flatten, table
from accelscope.core.geometry.instances import instanced
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST, Rays
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures import general_structures, structures
from accelscope.sample_scenes import make_sample

LAZY = [
    name
    for name, kind in general_structures().items()
    if "lazy" in {field.name for field in dataclasses.fields(kind.Settings)}
]

ALSO_LAZY = [{"walk": walk} for walk in ("march", "segments", "heap", "neighbours")]
"""Walks that differ from others of `octree` in what they do with cells that are there: each is
compiled twice here, and shares with the others what it does with those that are not."""

MORE = {
    "grid": [{}, {"mailbox": True}, {"assignment": "exact"}, {"overlap": "open"}, {"padding": 0.0}],
    "octree": [
        {},
        {"mailbox": True, "assignment": "box"},
        {"planes": "adaptive", "max_leaf_size": 2},
        *ALSO_LAZY,
        {"walk": "neighbours", "links": "stored"},
    ],
}
"""Settings with which cells and walks are others."""

WITH = [
    pytest.param(
        name, more, id=name + "".join(f"-{key}={value}" for key, value in more.items()),
        marks=[pytest.mark.exhaustive] if more in ALSO_LAZY else [],
    )
    for name in LAZY for more in MORE[name]
]  # fmt: skip


def pair(name, scene, **more):
    """The structure whose cells the build makes, and the one whose cells rays make."""
    kind = structures()[name]
    return tuple(kind.build(scene, kind.Settings(lazy=lazy, **more)) for lazy in (False, True))


def beam(scene, count=300):
    """Rays through one corner of a scene, so that most of its cells are left alone."""
    rng = np.random.default_rng(3)
    size = scene.upper - scene.lower
    targets = scene.lower + size * (0.1 + 0.15 * rng.random((count, 3)))
    origins = scene.lower - size * np.array([0.5, 0.4, 0.3])
    return Rays.from_arrays(np.broadcast_to(origins, (count, 3)), targets - origins)


def lists(structure):
    """The items that the leaves list, by the leaf's box; of those that are made."""
    cells = structure.cells()
    is_made = cells.extra.get("is_made", np.ones(len(cells), bool))
    found = {}
    for place in np.flatnonzero(cells.is_leaf & is_made):
        found[cells.boxes[place].tobytes()] = list_of(structure, cells.numbers[place]).tobytes()
    return found


def list_of(structure, number):
    arrays = structure.arrays
    if hasattr(arrays, "tree"):
        arrays, nodes = arrays.tree, structure.topology()
        number = np.searchsorted(nodes.leaves, number)
    if hasattr(arrays, "begins"):
        return arrays.references[arrays.begins[number] : arrays.ends[number]]
    return arrays.references[arrays.offsets[number] : arrays.offsets[number + 1]]


def assert_same(found, wanted):
    (hits, counts), (want, want_counts) = found, wanted
    assert hits.t.tobytes() == want.t.tobytes()
    assert hits.primitive.tobytes() == want.primitive.tobytes()
    assert counts.counters == want_counts.counters
    assert np.array_equal(counts.values, want_counts.values)


def test_both_kinds_are_there():
    assert set(LAZY) == set(MORE)


@pytest.mark.parametrize(("name", "more"), WITH)
def test_hits_counters_and_cells_are_the_same(lab, name, more):
    scene = lab.small_scene("suzanne")
    eager, lazy = pair(name, scene, **more)
    assert isinstance(lazy, LazyStructure)
    assert lazy.made() == (0, 0.0, 0)
    rays = beam(scene)
    assert_same(lazy.trace(rays), eager.trace(rays))
    cells, _, passes = lazy.made()
    assert 0 < cells < len(eager.cells()) // 2
    assert 1 < passes < 10
    assert lists(lazy).items() <= lists(eager).items()
    assert lazy.validate() == []
    # The same rays once more: all cells are there. Others: only what is new is made.
    assert_same(lazy.trace(rays), eager.trace(rays))
    assert lazy.made().cells == cells
    everywhere, _ = lab.batch_of(lab.ray_families(scene, 20))
    for query in (ANY, CLOSEST, ALL):
        assert_same(lazy.trace(everywhere, query), eager.trace(everywhere, query))
    assert lazy.made().cells > cells
    assert lists(lazy).items() <= lists(eager).items()
    assert lazy.validate() == []


@pytest.mark.parametrize("name", LAZY)
def test_what_a_ray_enters_is_made(lab, name):
    """And little else: of single rays at most twice what they enter, and a few."""
    scene = lab.small_scene("suzanne")
    eager, _ = pair(name, scene)
    rays = beam(scene, 5)
    for index in range(len(rays)):
        _, lazy = pair(name, scene)
        steps = lazy.record(rays, index, CLOSEST)
        entered = eager.record(rays, index, CLOSEST)
        assert np.array_equal(steps.kind, entered.kind)
        assert steps.t_enter.tobytes() == entered.t_enter.tobytes()
        assert steps.tally() == entered.tally()
        assert steps.tally()["N_ETS"] <= lazy.made().cells
        assert lazy.made().cells <= 2 * steps.tally()["N_TS"] + 2
        is_made = dict(zip(lazy.cells().numbers, lazy.cells().extra["is_made"], strict=True))
        visits = [steps.events_of(kind) for kind in (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY)]
        assert all(is_made[cell] for cell in steps.cell[np.concatenate(visits)])


@pytest.mark.parametrize("name", LAZY)
def test_threads_make_no_difference(lab, name):
    scene = lab.small_scene("suzanne")
    rays, _ = lab.batch_of(lab.ray_families(scene, 20))
    traced = []
    for threads in (1, 3):
        _, lazy = pair(name, scene, mailbox=True)
        traced.append((lazy.trace(rays, threads=threads), lazy))
    (found, one), (wanted, three) = traced
    assert_same(found, wanted)
    assert (one.made().cells, one.made().passes) == (three.made().cells, three.made().passes)
    for mine, theirs in zip(one.arrays, three.arrays, strict=True):
        if isinstance(mine, np.ndarray):
            assert np.array_equal(mine, theirs)


@pytest.mark.parametrize("name", LAZY)
def test_hard_scenes_agree_with_brute_force(lab, name, scene_name):
    """With a mailbox: one that remembers a pass that was stopped would lose hits."""
    rays, names, want, _ = lab.truth(scene_name)
    _, lazy = pair(name, lab.small_scene(scene_name), mailbox=True)
    assert lab.differences(names, want, lazy.trace(rays, CLOSEST)[0]) == {}


def instances():
    """Twenty tetrahedra, turned and scaled, and four of such groups."""
    rng = np.random.default_rng(1)
    geometry = all_triangles(make_sample("tetra:size=2").triangles)
    for count in (20, 4):
        matrices = rng.normal(size=(count, 3, 4)) * [0.5, 0.5, 0.5, 4.0]
        geometry = instanced([geometry], np.zeros(count, int), matrices)
    return Scene.from_instances(geometry, "instances")


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", ["solids", "instances"])
@pytest.mark.parametrize("name", LAZY)
def test_over_other_items(lab, name, kind):
    scene = instances() if kind == "instances" else lab.small_scene("rings")
    eager, lazy = pair(name, scene, mailbox=True)
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, 400, 1))
    for query in (ANY, CLOSEST, ALL):
        assert_same(lazy.trace(rays, query), eager.trace(rays, query))
    assert lists(lazy).items() <= lists(eager).items()
    assert lazy.validate() == []
    naive = structures()["naive"]
    want, _ = naive.build(scene, naive.Settings()).trace(rays, CLOSEST)
    hits, counts = lazy.trace(rays, CLOSEST)
    assert hits.t.tobytes() == want.t.tobytes()
    assert np.array_equal(hits.primitive, want.primitive)
    steps = lazy.record(rays, 7, CLOSEST)
    assert steps.tally() == {name: each[7] for name, each in counts.by_name().items()}


@pytest.mark.parametrize("name", LAZY)
def test_records_tell_cells_and_time(lab, name):
    scene = lab.small_scene("suzanne")
    eager, lazy = pair(name, scene)
    settings = RandomLinesSettings(count=50)
    rays = RandomLinesWorkload.make(scene, settings)

    def record_of(structure):
        built = Built(structure, 0.0)
        traced = trace_rays(built, RandomLinesWorkload, settings, rays)
        return make_record(built, traced)

    record = record_of(lazy)
    made = record["trace"]["lazy"]
    assert made == lazy.made()._asdict()
    assert 0.0 < made["seconds"] < record["trace"]["seconds"]
    assert record["statistics"]["cells_made"] == made["cells"]
    if name == "grid":
        assert made["cells"] == lazy.cells().extra["is_made"].sum()
    assert flatten(record)["trace.lazy.cells"] == made["cells"]
    assert ("Rays", "Cells made", f"{made['cells']:,}") in figures(record)
    # Of the second batch only what that has made: nothing.
    assert record_of(lazy)["trace"]["lazy"] == {"cells": 0, "seconds": 0.0, "passes": 0}
    plain = record_of(eager)
    assert "lazy" not in plain["trace"]
    assert "cells_made" not in plain["statistics"]
    assert table([record, plain])


@pytest.mark.parametrize("name", LAZY)
def test_a_stop_between_passes_leaves_a_sound_structure(lab, name):
    class Impatient(Progress):
        """Stops the second pass."""

        begun = 0

        def report(self, done, total, text):
            self.begun += done == 0 and text.startswith("Tracing")
            if self.begun == 3:
                raise Cancelled

    scene = lab.small_scene("suzanne")
    eager, lazy = pair(name, scene)
    rays = beam(scene)
    with pytest.raises(Cancelled):
        lazy.trace(rays, progress=Impatient())
    assert lazy.validate() == []
    assert lazy.made().passes == 2
    assert_same(lazy.trace(rays), eager.trace(rays))


@pytest.mark.parametrize("name", LAZY)
def test_the_ray_of_a_picture_goes_through_cells_that_are_there(lab, name):
    """Though the picture's rays are the first to enter any."""
    scene = lab.small_scene("suzanne")
    _, lazy = pair(name, scene)
    walk = walk_to_show(View(scene), lazy, lazy.cells(), None)
    entered = entered_by(walk)
    assert len(entered) > 1
    assert len(walk.cells.places_of(entered)) == len(np.unique(entered))
    assert walk.cells.extra["is_made"][walk.cells.places_of(entered)].all()
