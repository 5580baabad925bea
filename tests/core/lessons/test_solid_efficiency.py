"""Lesson "solid_efficiency": colours and shares are what rays hit; ratios of shadows are closed."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import GREEN, GREY, ORANGE
from accelscope.core.lessons.solid_efficiency import DIRECTIONS, DRAWN
from accelscope.core.structures import structures


def test_shadows_of_an_octahedron_in_its_box(play_lesson, octahedron):
    play = play_lesson("solid_efficiency", octahedron, volume="aabb").play
    # Half the sum of A |n . d| over all faces: 2 of 4 along an axis, sqrt 3 of 4 sqrt 3 there.
    # Parallel lines are spread evenly, and counted nearly as exactly: to 2.6e-4 of 20 000.
    for direction, share in (("x", 0.5), ("y", 0.5), ("z", 0.5), ("diagonal", 0.25)):
        assert play.counted[direction].ratio == pytest.approx(share, abs=5e-4)
    n = int(play.counted["all"].hits_volume.sum())
    p = 1.0 / np.sqrt(12.0)
    assert abs(play.counted["all"].ratio - p) < 4.0 * np.sqrt(p * (1.0 - p) / n)


@pytest.mark.parametrize("kind", ["aabb", "kdop26", "two_spheres"])
@pytest.mark.parametrize("name", ["suzanne", "mess", "one"])
def test_colours_are_what_the_naive_algorithm_hits(lab, play_lesson, name, kind):
    scene = lab.small_scene(name)
    played = play_lesson("solid_efficiency", scene, volume=kind)
    kind_of_naive = structures()["naive"]
    naive = kind_of_naive.build(scene, kind_of_naive.Settings())
    for direction in DIRECTIONS:
        drawn = played.play.drawn[direction]
        hits, _ = naive.trace(drawn.rays)
        assert np.array_equal(hits.primitive >= 0, drawn.hits_object)
        assert (drawn.hits_volume | ~drawn.hits_object).all()
        colours = played.picture(direction=direction).colours[:DRAWN, :3]
        counts = [
            int((colours == colour[:3]).all(axis=1).sum()) for colour in (GREY, ORANGE, GREEN)
        ]
        hit, both = int(drawn.hits_volume.sum()), int(drawn.hits_object.sum())
        assert counts == [DRAWN - hit, hit - both, both]
