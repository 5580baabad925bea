"""Lesson "beam_tree": orange lies where reflected rays go; unfolded, the apex is the eye."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.beam_tree import Settings, moved
from accelscope.core.lessons.beams import placed
from accelscope.core.lessons.drawing import ORANGE
from accelscope.core.lessons.lesson import Subject
from accelscope.core.probes.beam import MIRRORED
from accelscope.core.progress import SILENT
from accelscope.core.scene.whitted.optics import mirrored
from accelscope.sample_scenes import make_sample


@functools.cache
def played(spec="room:mirrors=2,open=true"):
    return lesson_named("beam_tree").play(Subject(make_sample(spec)), Settings(), SILENT)


def test_two_mirrors_reflect_each_other():
    play = played()
    assert [node.kind for node in play.nodes[1:]] == [MIRRORED] * (len(play.nodes) - 1)
    assert max(node.depth for node in play.nodes) >= 3


def test_what_is_orange_lies_on_rays_from_the_eye_that_the_mirror_reflects():
    play = played()
    eye = play.nodes[0].beam
    looked = 0
    for number, node in enumerate(play.nodes):
        if node.depth != 2:
            continue
        plane = play.prepared.convex.planes[play.polygon_of(node)]
        picture = play.picture(Settings(number))
        drawn = picture.faces[(picture.face_colours[:, :3] == ORANGE[:3]).all(axis=1)]
        for piece in range(len(node.pieces.items)):
            if node.pieces.items[piece] < 0:
                continue
            window = node.pieces.corners(piece)
            there = eye.on_plane(window, plane)
            ways = there - eye.apex
            away = mirrored(ways, np.broadcast_to(plane[:3], ways.shape))
            corners = placed(play.prepared, node, piece)
            across = np.cross(corners - there, away)
            assert np.abs(across).max() < 1e-9
            assert ((corners - there) * away).sum(axis=1).min() > -1e-9
            assert (np.abs(drawn - corners[0]).max(axis=2) < 1e-12).any()
            looked += 1
    assert looked > 3


def test_unfolded_each_apex_is_the_eye_and_pieces_lie_on_straight_lines_from_it():
    play = played()
    eye = play.nodes[0].beam
    for number, node in enumerate(play.nodes[1:], 1):
        matrix = play.to_virtual(node)
        np.testing.assert_allclose(moved(matrix, node.beam.apex), eye.apex, atol=1e-9)
        for piece in np.flatnonzero(node.pieces.items >= 0).tolist():
            corners = moved(matrix, placed(play.prepared, node, piece))
            ways = eye.directions(node.pieces.corners(piece))
            assert np.abs(np.cross(corners - eye.apex, ways)).max() < 1e-8
        text = play.picture(Settings(number, unfolded=True)).caption
        assert text.endswith("unfolded, its apex is the eye")


def test_without_a_mirror_it_says_what_is_missing():
    with pytest.raises(InputError, match="no mirror is seen in room; give a material a specular"):
        played("room:mirrors=0")
