"""Lesson "directional_cube": what is green is the list of the cell, and all that its rays hit."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import CLOSEST, Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.directional_cube import Settings
from accelscope.core.lessons.directions import corners_at, drawn_cells
from accelscope.core.lessons.drawing import GREEN, ORANGE
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "flat", "mess"]
KNOBS = [Settings(), Settings(longest=1), Settings("uniform", 5), Settings("uniform", 1)]


@functools.cache
def played(name, settings, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("directional_cube").play(Subject(scene), settings, SILENT)


def some_cells(play):
    last = play.ends["cell"]
    return sorted({0, last // 2, last})


@pytest.mark.parametrize("settings", KNOBS)
@pytest.mark.parametrize("name", SCENES)
def test_green_items_are_the_list_of_the_cell(lab, name, settings):
    play = played(name, settings, lab)
    buffer, lists = play.buffer, play.buffer.lists
    for number in some_cells(play):
        cell = int(play.order[number])
        places = lists.references[lists.first[cell] : lists.last[cell]]
        picture = play.picture(dataclasses.replace(settings, cell=number))
        is_green = (picture.face_colours == (*GREEN[:3], 0.55)).all(axis=1)
        want = play.scene.geometry.corners[buffer.geometry.ids[places]]
        np.testing.assert_array_equal(picture.faces[is_green], want)
        # Their numbers go up with the distance.
        numbers = [mark for mark in picture.marks if mark.text.isdigit()]
        assert [int(mark.text) for mark in numbers] == list(range(1, min(len(places), 9) + 1))
        assert (np.diff(lists.nearest[lists.first[cell] : lists.last[cell]]) >= 0.0).all()
        middles = 0.5 * (want.min(axis=1) + want.max(axis=1))
        np.testing.assert_allclose([mark.position for mark in numbers], middles[:9], rtol=1e-12)
        assert f"lists {len(places)} " in picture.caption


@pytest.mark.parametrize("name", SCENES)
def test_rays_through_the_orange_cell_hit_green_items_only(lab, name):
    play = played(name, Settings(), lab)
    buffer, naive = play.buffer, build(play.scene, "naive")
    origin = buffer.faces.origins[0]
    rng = np.random.default_rng(5)
    n_hits = 0
    for number in some_cells(play):
        cell = int(play.order[number])
        picture = play.picture(Settings(cell=number))
        (a, b, c, d) = corners_at(buffer, np.array([cell]), play.half)[0]
        # Its four borders are drawn in orange, a little before the cube.
        orange = picture.segments[(picture.colours == ORANGE).all(axis=1)]
        ring = origin + (np.stack([a, b, c, d]) - origin) * 1.004
        np.testing.assert_allclose(orange[:, 0], ring, rtol=1e-12)
        s, t = rng.random((2, 200, 1))
        ways = a + s * (b - a) + t * (d - a) - origin
        hits, _ = naive.trace(Rays.from_arrays(np.tile(origin, (200, 1)), ways), CLOSEST)
        found = set(hits.primitive[hits.primitive >= 0].tolist())
        lists = buffer.lists
        listed = lists.references[lists.first[cell] : lists.last[cell]]
        assert found <= set(buffer.geometry.ids[listed].tolist())
        n_hits += len(found)
    assert n_hits


@pytest.mark.parametrize("settings", KNOBS)
def test_figures_are_those_of_all_cells(lab, settings):
    play = played(SCENES[0], settings, lab)
    statistics, lists = play.buffer.statistics(), play.buffer.lists
    rows = {row.label: row.text.replace(" ", "") for row in play.picture(settings).rows}
    lengths = (lists.last - lists.first)[lists.children < 0]
    assert int(rows["Cells"]) == len(lengths)
    assert int(rows["With Objects"]) == (lengths > 0).sum()
    assert int(rows["References"]) == lengths.sum()
    assert int(rows["Longest List"]) == lengths.max() == statistics.extra["longest_list"]
    assert rows["Mean List"] == f"{statistics.extra['mean_list']:.3g}"


def test_too_many_cells_are_drawn_as_those_they_are_parts_of(lab):
    play = played(SCENES[0], Settings(longest=1), lab)
    buffer = play.buffer
    cells, lengths = drawn_cells(buffer)
    squares, lists = buffer.squares, buffer.lists
    assert len(cells) <= 1200 < len(play.order)
    # Each cell with something lies in one of those, and the longest list is the longest within.
    longest = dict.fromkeys(cells.tolist(), 0)
    for leaf in play.order.tolist():
        cell = leaf
        while cell not in longest:
            cell = int(squares.parent[cell])
        longest[cell] = max(longest[cell], int(lists.last[leaf] - lists.first[leaf]))
    assert list(longest.values()) == lengths.tolist()
