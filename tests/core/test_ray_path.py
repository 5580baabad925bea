"""The picture of a recorded walk holds what its events say, whole and event by event."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import (
    HIT,
    KIND_NAMES,
    POSTPONE,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
)
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons.ray_path import ON_DARK, Walk, links_of, segments_of
from accelscope.core.lessons.walk_in_words import event_text, legend
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

RAYS = 40


@pytest.fixture(scope="module")
def scene():
    return make_sample("tetra:size=4")


@pytest.fixture(scope="module", params=["grid", "octree"])
def walks(request, scene):
    """Walks of rays into the scene."""
    kind = structure_named(request.param)
    structure = kind.build(scene, dataclasses.replace(kind.Settings(), padding=0.01))
    rng = np.random.default_rng(4)
    ends = rng.uniform(scene.lower, scene.upper, (RAYS, 3))
    origins = 0.5 * (scene.lower + scene.upper) + scene.diagonal * rng.normal(size=(RAYS, 3))
    rays = Rays.from_arrays(origins, ends - origins)
    hits, _ = structure.trace(rays)
    cells = structure.cells()
    return [
        Walk(structure, cells, rays, i, float(hits.t[i]), structure.record(rays, i))
        for i in range(RAYS)
    ]


def drawn(walk, colour, event=None):
    """Return the segments in one colour of the palette."""
    segments, colours = segments_of(walk, event)
    assert np.isfinite(segments).all()
    return segments[(colours == getattr(ON_DARK, colour)).all(axis=1)]


def test_every_cell_and_triangle_once(walks):
    for walk in walks:
        steps = walk.steps
        for kind, colour in ((VISIT_INNER, "inner"), (VISIT_LEAF, "leaf"), (VISIT_EMPTY, "empty")):
            cells = np.unique(steps.cell[steps.kind == kind])
            segments = drawn(walk, colour)
            assert len(segments) == 12 * len(cells)
            boxes = walk.cells.boxes[np.isin(walk.cells.numbers, cells)]
            ends = segments.reshape(-1, 24, 3)
            np.testing.assert_array_equal(ends.min(axis=1), boxes[:, :3])
            np.testing.assert_array_equal(ends.max(axis=1), boxes[:, 3:])
        assert len(drawn(walk, "tested")) == 3 * len(np.unique(steps.primitive[steps.kind == TEST]))


def test_postponed_hits_are_marked_where_they_are(walks):
    marked = 0
    for walk in walks:
        steps = walk.steps
        postponed = steps.kind == POSTPONE
        n, triangles = postponed.sum(), np.unique(steps.primitive[postponed])
        segments = drawn(walk, "postponed")
        assert len(segments) == 3 * n + 3 * len(triangles)
        centres = segments[len(segments) - 3 * n :].mean(axis=1)
        ray = walk.rays.origins[walk.ray], walk.rays.directions[walk.ray]
        expected = ray[0] + steps.t_enter[postponed, None] * ray[1]
        np.testing.assert_allclose(centres, np.repeat(expected, 3, axis=0), atol=1e-12)
        marked += n
    assert marked > 0


def test_the_whole_walk_is_the_walk_up_to_its_last_event(walks):
    for walk in walks:
        whole = segments_of(walk)[0]
        last = segments_of(walk, len(walk.steps) - 1)[0]
        plain = len(drawn(walk, "current", len(walk.steps) - 1))
        ahead = len(drawn(walk, "ahead", len(walk.steps) - 1))
        assert len(whole) == len(last) - plain - ahead


def test_events_only_add(walks):
    for walk in walks[:5]:
        before = dict.fromkeys(("inner", "leaf", "empty", "tested", "postponed"), 0)
        reached = 0.0
        for event in range(len(walk.steps)):
            for name, count in before.items():
                now = len(drawn(walk, name, event))
                assert now >= count
                before[name] = now
            path = segments_of(walk, event)[0][0]
            length = np.linalg.norm(path[1] - path[0])
            assert length >= reached
            reached = length
            kind = walk.steps.kind[event]
            current = len(drawn(walk, "current", event))
            if kind in (TEST, HIT, POSTPONE):
                assert current == 3
            elif kind in (VISIT_INNER, VISIT_LEAF, VISIT_EMPTY):
                assert current == 12


def test_a_skipped_region_stands_for_its_cell(walks):
    """A structure that passes an empty cell and its neighbours in one step."""
    walk = next(each for each in walks if (each.steps.kind == VISIT_EMPTY).any())
    structure, cells = walk.structure, walk.cells
    empty = np.unique(walk.steps.cell[walk.steps.kind == VISIT_EMPTY])
    first = int(empty[0])
    region = np.array([-1.0, -2, -3, 1, 2, 3])
    directions = []

    def skip(number, direction):
        directions.append(direction)
        return region if number == first else None

    skipping = type("Skipping", (), {"scene": structure.scene, "region": staticmethod(skip)})()
    walk = walk._replace(structure=skipping)
    ends = drawn(walk, "skipped").reshape(24, 3)
    assert (*ends.min(axis=0), *ends.max(axis=0)) == tuple(region)
    assert len(drawn(walk, "empty")) == 12 * (len(empty) - 1)
    assert (directions[0] == walk.rays.directions[walk.ray]).all()
    assert cells.is_leaf[cells.numbers == first].all()
    texts = dict(legend(walk))
    assert texts["skipped"] == "1 skip of an empty region"


def test_the_legend_counts_what_the_walk_counted(walks):
    for walk in walks:
        numbers = {name: int(text.split()[0]) for name, text in legend(walk)}
        tally = walk.steps.tally()
        assert numbers.get("tested", 0) == tally["N_IT"]
        assert numbers.get("empty", 0) == tally["N_EETS"]
        assert numbers.get("leaf", 0) == tally["N_ETS"] - tally["N_EETS"]
        assert numbers.get("inner", 0) == tally["N_TS"] - tally["N_ETS"]
        assert all(number > 0 for number in numbers.values())


def test_events_in_words(walks):
    for walk in walks:
        for event, kind in enumerate(walk.steps.kind):
            text = event_text(walk.steps, event)
            assert text.startswith(KIND_NAMES[kind])
            assert "nan" not in text
            assert "inf" not in text
            assert ("triangle" in text) == (walk.steps.primitive[event] >= 0)


def test_links_lead_from_the_leaf_to_what_is_outlined(walks):
    cells = walks[0].cells
    leaf, other = np.flatnonzero(cells.is_leaf)[[0, 7]]
    centres = 0.5 * (cells.boxes[:, :3] + cells.boxes[:, 3:])
    links = cells.numbers[[other]]
    linked = type("Linked", (), {"links": staticmethod(lambda number: links)})()
    segments, colours, count = links_of(linked, cells, int(cells.numbers[leaf]))
    assert count == len(links)
    by_colour = {
        name: segments[(colours == getattr(ON_DARK, name)).all(axis=1)]
        for name in ("link", "linked", "leaf")
    }
    np.testing.assert_array_equal(by_colour["link"][0], centres[[leaf, other]])
    for name, place in (("leaf", leaf), ("linked", other)):
        ends = by_colour[name].reshape(24, 3)
        np.testing.assert_array_equal(ends.min(axis=0), cells.boxes[place, :3])
        np.testing.assert_array_equal(ends.max(axis=0), cells.boxes[place, 3:])
