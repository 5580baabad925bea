"""Lesson "raster_insertion": pixels show what their rays hit first; missed is exact less drawn."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import CLOSEST, Rays
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.directions import points_at, shadow_rays_seen
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.lessons.raster_insertion import Settings
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "cubes"]
KNOBS = [Settings(), Settings(1, 1), Settings(5, 3, 2)]


@functools.cache
def played(name, settings, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("raster_insertion").play(Subject(scene), settings, SILENT)


@pytest.mark.parametrize("settings", KNOBS)
@pytest.mark.parametrize("name", SCENES)
def test_a_pixel_shows_what_the_ray_through_its_middle_hits(lab, name, settings):
    play = played(name, settings, lab)
    buffer, width = play.buffer, len(play.drawn_items)
    middles = -1.0 + (np.arange(width) + 0.5) * (2.0 / width)
    v, u = (each.ravel() for each in np.meshgrid(middles, middles, indexing="ij"))
    origin = buffer.faces.origins[play.face]
    ways = points_at(buffer, play.face, u, v, 1.0) - origin
    rays = Rays.from_arrays(np.tile(origin, (len(ways), 1)), ways)
    hits, _ = build(play.scene, "naive").trace(rays, CLOSEST)
    shown = play.drawn_items.ravel()
    items = np.where(shown >= 0, buffer.geometry.ids[shown], -1)
    np.testing.assert_array_equal(items, hits.primitive)
    # What a pixel shows is in the list of what was drawn into its cell.
    size = settings.cells
    for pixel in np.flatnonzero(shown >= 0).tolist():
        j, i = (each // settings.pixels for each in divmod(pixel, width))
        cell = play.face * size**2 + j * size + i
        assert shown[pixel] in buffer.drawn_into(cell)


@pytest.mark.parametrize("settings", KNOBS)
@pytest.mark.parametrize("name", SCENES)
def test_figures_are_those_of_the_lists_and_of_the_rays(lab, name, settings):
    play = played(name, settings, lab)
    buffer, lists = play.buffer, play.buffer.lists
    size = settings.cells**2
    n_exact = n_drawn = n_missed = 0
    for n in range(size):
        cell = play.face * size + n
        exact = set(lists.references[lists.first[cell] : lists.last[cell]].tolist())
        found = set(buffer.drawn_into(cell).tolist())
        n_exact, n_drawn = n_exact + len(exact), n_drawn + len(found)
        n_missed += len(exact - found)
        assert play.missed[n] == len(exact - found)
    rows = {row.label: row.text.replace(" ", "") for row in play.picture(settings).rows}
    assert [int(rows[name]) for name in ("Listed Exactly", "Drawn", "Missed")] == [
        n_exact, n_drawn, n_missed,
    ]  # fmt: skip
    naive = build(play.scene, "naive")
    rays = shadow_rays_seen(play.scene, naive, SILENT)
    hits, _ = naive.trace(rays)
    _, counts = buffer.trace(rays)
    assert int(rows["Blocked"]) == (hits.primitive >= 0).sum()
    assert int(rows["Overlooked"]) == counts["overlooked"].sum()
    assert int(rows["Shadow Rays"]) == len(rays)
    assert play.n_overlooked >= len(play.overlooked_items) > 0 or not counts["overlooked"].any()


def test_more_pixels_and_dilation_overlook_less(lab):
    overlooked = [
        played("suzanne:subdivisions=0", settings, lab).n_overlooked
        for settings in (Settings(8, 1), Settings(8, 8), Settings(8, 8, 8))
    ]
    assert overlooked[0] > overlooked[1] > overlooked[2]


def test_boards_show_the_part_of_the_face_with_something(lab):
    play = played("suzanne:subdivisions=0", Settings(), lab)
    (low, width), size = play.window, play.size
    filled = (play.exact > 0).reshape(size, size)
    rows, columns = np.nonzero(filled)
    first = np.rint((low + 1.0) * size / 2.0).astype(int)
    count = round(width * size / 2.0)
    for places, begin in ((columns, first[0]), (rows, first[1])):
        assert begin <= places.min()
        assert places.max() < begin + count <= size
    for size in (play.size, len(play.drawn_items)):
        squares, number = play.squares(1, size)
        assert len(np.unique(number)) == len(squares) == round(width * size / 2.0) ** 2


def test_where_nothing_faces_the_light_there_are_no_rays(lab):
    play = played("mess", Settings(), lab)
    rows = {row.label: row.text for row in play.picture(Settings()).rows}
    assert [rows[name] for name in ("Shadow Rays", "Blocked", "Overlooked")] == ["0", "0", "0"]
