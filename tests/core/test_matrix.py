"""Every builder, every optimiser, every verb: what can be chosen together works together.

The settings' choices make the list, so that a builder that is added is in it. The whole of it is
marked `exhaustive`; every builder and every optimiser once, with all verbs, is part of every run.
"""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.pages.pictures import Gallery
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.evaluation.records.animation import animate
from accelscope.core.evaluation.records.experiment import Built, Traced, make_record, trace_rays
from accelscope.core.evaluation.records.report import flatten, write_csv, write_json
from accelscope.core.geometry.rays import CLOSEST
from accelscope.core.lessons import lessons_about
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.sample_scenes import make_sample

CHOICES = {
    field.name: list(field.metadata["choices"])
    for field in dataclasses.fields(BVH.Settings)
    if field.metadata["choices"]
}
BUILDERS, OPTIMISERS = CHOICES["builder"], CHOICES["optimise"]

EVERYTHING = [(builder, optimise) for builder in BUILDERS for optimise in OPTIMISERS]

REPRESENTATIVE = [
    *((builder, "none") for builder in BUILDERS),
    *(("ploc", optimise) for optimise in OPTIMISERS if optimise != "none"),
]

REST = [each for each in EVERYTHING if each not in REPRESENTATIVE]

OTHER_CHOICES = [
    (name, choice)
    for name, choices in CHOICES.items()
    if name not in ("builder", "optimise")
    for choice in choices
]
"""Of the default builder: every volume, arity, axis, ..."""

OTHERS_IN_EVERY_RUN = [
    next((name, choice) for choice in choices if choice != getattr(BVH.Settings(), name))
    for name, choices in CHOICES.items()
    if name not in ("builder", "optimise")
]
"""One that is not the default of each."""


def exhaustive_but(some, combinations):
    """Return parameters, of which all but some are marked."""
    return [
        pytest.param(*each, marks=[] if each in some else pytest.mark.exhaustive)
        for each in combinations
    ]


@pytest.fixture(scope="module")
def scene():
    return make_sample("soup:count=90,edge=0.3")


@pytest.fixture(scope="module")
def moved(scene):
    """The same triangles, twisted."""
    corners = scene.triangles.copy()
    angle = 1.5 * corners[..., 2]
    x, y = corners[..., 0].copy(), corners[..., 1].copy()
    corners[..., 0] = np.cos(angle) * x - np.sin(angle) * y
    corners[..., 1] = np.sin(angle) * x + np.cos(angle) * y
    return Scene.from_triangles(corners, "twisted")


@pytest.fixture(scope="module")
def rays(scene):
    return RandomLinesWorkload.make(scene, RandomLinesSettings(count=60))


def check_hits(structure, rays, truth):
    hits, counters = structure.trace(rays, CLOSEST)
    want, _ = truth.trace(rays, CLOSEST)
    assert hits.t.tobytes() == want.t.tobytes()
    assert np.array_equal(hits.primitive, want.primitive)
    return hits, counters


def check_lessons(structure):
    """Return the names of the lessons about it that can be played; at the ends of their films."""
    names = set()
    for lesson in lessons_about(structure):
        subject, settings = lesson.subject(structure.scene, given=[structure]), lesson.Settings()
        try:
            play = lesson.play(subject, settings, SILENT)
        except InputError:  # nothing of that kind in this tree
            continue
        film = play.film(lesson)
        for value in {film[0], film[-1]}:
            knobs = dataclasses.replace(settings, **{lesson.film: value})
            if lesson.key(knobs) == lesson.key(settings):
                picture = play.picture(play.within(knobs))
                assert np.isfinite(picture.points()).all()
                assert len(picture.segments) == len(picture.colours)
                assert picture.caption
        names.add(lesson.name)
    return names


def check_all_verbs(settings, scene, moved, rays, naive, folder):
    # build
    structure = BVH.build(scene, settings, log=True)
    assert structure.validate() == []
    # trace, and step through a ray
    hits, counters = check_hits(structure, rays, naive(scene))
    for index in range(0, len(rays), 20):
        tally = structure.record(rays, index, CLOSEST).tally()
        assert tally == {name: counters[name][index] for name in tally}
    # lessons, cells
    of_built = check_lessons(structure)
    assert {"levels", "nodes_not_paying", "overlapping_siblings"} <= of_built
    assert len(structure.cells()) == len(structure.arrays.size)
    # export
    built = Built(structure, 0.0)
    traced = Traced(
        RandomLinesWorkload, RandomLinesSettings(count=60), rays, hits, counters, 0.0, 2
    )
    record = make_record(built, traced)
    write_json(folder / "a.json", [record])
    write_csv(folder / "a.csv", [record])
    assert json.loads((folder / "a.json").read_text())["records"] == [
        json.loads(json.dumps(record))
    ]
    assert flatten(record)
    # refit, and all of it once more
    frames = [(1, scene), (2, moved)]
    if structure.parts is not None:
        with pytest.raises(InputError, match="cuts triangles into pieces"):
            structure.refitted(moved)
        with pytest.raises(InputError, match="cuts triangles into pieces"):
            animate(frames, BVH, settings, RandomLinesWorkload, RandomLinesSettings(count=20))
        return
    refitted = structure.refitted(moved)
    assert refitted.validate() == []
    check_hits(refitted, rays, naive(moved))
    assert len(refitted.cells()) == len(structure.cells())
    assert check_lessons(refitted) <= of_built
    make_record(Built(refitted, 0.0), None)
    assert refitted.refitted(scene).validate() == []
    # animate
    found = animate(frames, BVH, settings, RandomLinesWorkload, RandomLinesSettings(count=20))
    assert len(found.records) == 4


@pytest.fixture(scope="module")
def naive():
    from accelscope.core.structures import structure_named

    kind, known = structure_named("naive"), {}

    def build(scene):
        if scene.name not in known:
            known[scene.name] = kind.build(scene, kind.Settings())
        return known[scene.name]

    return build


@pytest.mark.parametrize(("builder", "optimise"), REPRESENTATIVE)
def test_every_builder_and_every_optimiser(scene, moved, rays, naive, tmp_path, builder, optimise):
    settings = BVH.Settings(builder=builder, optimise=optimise)
    check_all_verbs(settings, scene, moved, rays, naive, tmp_path)


@pytest.mark.exhaustive
@pytest.mark.parametrize(("builder", "optimise"), REST)
def test_every_builder_with_every_optimiser(scene, moved, rays, naive, tmp_path, builder, optimise):
    settings = BVH.Settings(builder=builder, optimise=optimise)
    check_all_verbs(settings, scene, moved, rays, naive, tmp_path)


@pytest.mark.parametrize(("name", "choice"), exhaustive_but(OTHERS_IN_EVERY_RUN, OTHER_CHOICES))
def test_every_other_choice(scene, moved, rays, naive, tmp_path, name, choice):
    settings = dataclasses.replace(BVH.Settings(), **{name: choice})
    check_all_verbs(settings, scene, moved, rays, naive, tmp_path)


@pytest.mark.exhaustive
@pytest.mark.parametrize(("builder", "optimise"), REPRESENTATIVE)
def test_pictures(scene, rays, moved, tmp_path, builder, optimise, small_pictures):
    """Of both trees; a lesson looks the same whatever the optimiser has left.

    Those of the default tree are part of every run: ``make demo`` makes them of every sample.
    """
    structure = BVH.build(scene, BVH.Settings(builder=builder, optimise=optimise), log=True)
    trees = [structure]
    if structure.parts is None:
        trees.append(structure.refitted(moved))
    gallery = Gallery(tmp_path)
    for tree in trees:
        built = Built(tree, 0.0)
        traced = trace_rays(built, RandomLinesWorkload, RandomLinesSettings(count=60), rays)
        gallery.add(built, [make_record(built, traced)], [rays])
    gallery.write_page()
    page = (tmp_path / "index.html").read_text()
    labels = {lesson.label for tree in trees for lesson in lessons_about(tree)}
    assert len(labels) >= 6
    for label in labels:  # once, of both trees
        assert page.count(f"<h3>{label}</h3>") == 1


def test_the_matrix_does_not_shrink():
    assert len(BUILDERS) >= 13
    assert len(OPTIMISERS) >= 6
    assert len(EVERYTHING) == len(set(EVERYTHING)) >= 78
    assert len(REPRESENTATIVE) == len(BUILDERS) + len(OPTIMISERS) - 1
    assert sorted(REPRESENTATIVE + REST) == sorted(EVERYTHING)
    assert {builder for builder, _ in REPRESENTATIVE} == set(BUILDERS)
    assert {optimise for _, optimise in REPRESENTATIVE} == set(OPTIMISERS)
    assert len(OTHER_CHOICES) >= 8 + 3 + 2 + 2 + 2
    assert {name for name, _ in OTHERS_IN_EVERY_RUN} == set(CHOICES) - {"builder", "optimise"}
    assert set(OTHERS_IN_EVERY_RUN) <= set(OTHER_CHOICES)
