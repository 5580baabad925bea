"""Lesson "cone_at_edge": shares are those of rays in the same probe, what is orange is seen."""

from __future__ import annotations

import functools

import numpy as np
from accelscope.core.geometry.cones import ROUND, SQUARE
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.cone_at_edge import Settings
from accelscope.core.lessons.drawing import GREY, ORANGE
from accelscope.core.lessons.lesson import Subject
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample


@functools.cache
def played():
    scene = make_sample("suzanne:subdivisions=0")
    return lesson_named("cone_at_edge").play(Subject(scene), Settings(), SILENT)


def drawn(picture, colour, opacity):
    is_own = (picture.face_colours == (*colour[:3], opacity)).all(axis=1)
    return picture.faces[is_own]


def test_the_shares_are_those_of_256_rays_through_the_pixel():
    """The pixel is a square; seen aslant the pyramid is one of as much solid angle."""
    play = played()
    shares = play.shares[SQUARE]
    # A straight edge is off by half a ray in each row of 16, and here there are several.
    assert np.abs(shares - play.sampled).max() < 0.2
    assert abs((shares - play.sampled).mean()) < 0.003
    assert np.abs(shares - play.sampled)[(play.sampled > 0) & (play.sampled < 1)].mean() < 0.04


def test_what_is_orange_is_seen_and_what_is_grey_is_met_and_hidden():
    play = played()
    corners = play.scene.triangles
    for number in (0, 7, play.ends["pixel"]):
        for shape in (ROUND, SQUARE):
            pixel = int(play.order[number])
            seen = play.covered(pixel, shape)
            met, steps = play.covering.structure.cover(play.rays, pixel, play.spread(pixel, shape))
            picture = play.picture(Settings(number, shape))
            np.testing.assert_array_equal(drawn(picture, ORANGE, 0.6), corners[seen.items])
            hidden = np.setdiff1d(met, seen.items)
            np.testing.assert_array_equal(drawn(picture, GREY, 0.5), corners[hidden])
            rows = {row.label: row.text for row in picture.rows}
            assert rows["Covered"] == f"{seen.shares.sum():.4%}"
            assert int(rows["Met"]) == len(met) >= len(seen.items) == int(rows["Seen"])
            assert int(rows["Triangle Tests"]) == steps.tally()["N_IT"]
