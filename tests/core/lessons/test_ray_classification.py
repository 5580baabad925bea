"""Lesson "ray_classification": blue rays are of the cell, and hit nothing but green candidates."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, GREEN
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.lessons.ray_classification import MOST_RAYS, Settings, sharp_edges
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "mess"]


@functools.cache
def played(name, settings, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("ray_classification").play(Subject(scene), settings, SILENT)


def some_cells(play):
    last = play.ends["cell"]
    return sorted({0, last // 3, last // 2, last})


@pytest.mark.parametrize("size", [1, 12])
@pytest.mark.parametrize("name", SCENES)
def test_blue_rays_are_of_the_cell_and_hit_green_items_only(lab, name, size):
    play = played(name, Settings(size), lab)
    hits, _ = build(play.scene, "naive").trace(play.rays)
    bounds, root = play.structure.known.bounds, play.structure.known.root
    for number in some_cells(play):
        cell = int(play.order[number])
        picture = play.picture(Settings(size, number))
        listed = play.candidates(cell)
        is_green = (picture.face_colours == (*GREEN[:3], 0.55)).all(axis=1)
        np.testing.assert_array_equal(picture.faces[is_green], play.scene.geometry.corners[listed])
        numbers = [mark.text for mark in picture.marks]
        assert numbers == [str(n + 1) for n in range(min(len(listed), 9))]
        nearest = play.structure.items.nearest[root[cell], listed]
        assert (np.diff(nearest) >= 0.0).all()
        mine = np.flatnonzero(play.cells == cell)
        assert set(hits.primitive[mine].tolist()) - {-1} <= set(listed.tolist())
        blue = picture.segments[(picture.colours == (*BLUE[:3], 0.8)).all(axis=1)]
        assert len(blue) == min(len(mine), MOST_RAYS)
        low, high = bounds[cell]
        axis = root[cell] // 2
        ways = play.rays.directions[mine]
        slopes = ways / np.abs(ways[:, axis : axis + 1])
        assert (np.abs(slopes) <= 1.0).all()
        assert (np.sign(ways[:, axis]) == (1 if root[cell] % 2 == 0 else -1)).all()
        for origin in blue[:, 0]:
            assert (origin >= low[:3]).all()
            assert (origin <= high[:3]).all()
        for which, dimension in ((1, 3), (2, 4)):
            own = slopes[:, (axis + which) % 3]
            assert (own >= low[dimension] - 1e-12).all()
            assert (own <= high[dimension] + 1e-12).all()
        # The beam holds all of them: no blue line ends outside, as far as the beam is drawn.
        beam = play.beam(cell)
        normals = np.cross(beam[:, 1] - beam[:, 0], beam[:, 2] - beam[:, 0])
        heights = np.einsum("ki,rki->rk", normals, blue[:, :1] - beam[None, :, 0])
        assert (heights <= 1e-9 * np.abs(normals).max()).all()


def test_larger_lists_make_fewer_cells(lab):
    made = [played(SCENES[0], Settings(size), lab).figures["cells_made"] for size in (1, 12, 200)]
    assert made[0] > made[1] > made[2]


def test_a_cube_bends_at_its_edges():
    from accelscope.core.geometry.box_shape import corners_of
    from accelscope.core.geometry.hull import hull_faces

    corners = corners_of(np.array([[0.0, 0, 0, 1, 2, 3]]))[0]
    edges = sharp_edges(hull_faces(corners))
    assert len(edges) == 12
    assert np.linalg.norm(edges[:, 1] - edges[:, 0], axis=1).sum() == pytest.approx(24.0)
