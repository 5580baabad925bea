"""Lesson "kdop_strips": d and D by brute force; what is left shrinks down to the k-DOP itself."""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.half_spaces import measured
from accelscope.core.geometry.kdop import DIRECTIONS
from accelscope.core.lessons.kdop_strips import KINDS, STEPS


def test_all_kinds_are_there():
    assert set(KINDS) == {str(k) for k in DIRECTIONS}


@pytest.mark.parametrize("k", KINDS)
@pytest.mark.parametrize("name", ["bunny", "mess", "one", "flat"])
def test_strips_touch_and_what_is_left_is_the_k_dop(lab, play_lesson, name, k):
    scene = lab.small_scene(name)
    play = play_lesson("kdop_strips", scene, k=k).play
    points, last = scene.triangles.reshape(-1, 3), play.ends["frame"]
    assert last == STEPS * int(k) // 2
    reach = 1e-12 * np.abs(points).max()
    for strip, normal in enumerate(DIRECTIONS[int(k)]):
        along = points @ np.array(normal, float)
        low, high = play.bounds(STEPS * (strip + 1))
        assert low[strip] == pytest.approx(along.min(), abs=reach)
        assert high[strip] == pytest.approx(along.max(), abs=reach)
        # The marked points are on the planes.
        assert play.touched[strip] @ np.array(normal) == pytest.approx(
            [low[strip], high[strip]], abs=reach
        )
        # Before, both planes are before the object.
        low, high = play.bounds(STEPS * strip + 1)
        assert low[strip] < along.min()
        assert high[strip] > along.max()
    areas = [float(measured(play.left(frame))[0][0]) for frame in range(0, last + 1, 3)]
    assert all(b <= a * (1.0 + 1e-9) for a, b in itertools.pairwise(areas))
    own = float(play.volume.areas()[0])
    assert areas[-1] == pytest.approx(own, rel=1e-6, abs=1e-9 * areas[0])


def test_closed_forms_around_an_octahedron(play_lesson, octahedron):
    for k, share in (("6", 1 / np.sqrt(12)), ("14", 1.0), ("18", np.sqrt(2 / 3)), ("26", 1.0)):
        played = play_lesson("kdop_strips", octahedron, k=k)
        last = played.play.ends["frame"]
        assert played.row("Hull / Volume", frame=last) == f"{share:.3f}"
        assert float(played.row("d", frame=last)) == -float(played.row("D", frame=last))


def test_it_says_where_a_strip_is(play_lesson):
    played = play_lesson("kdop_strips")
    assert "slides from afar" in played.picture(frame=STEPS - 1).caption
    assert "Strip 1 of 7, n = (1, 0, 0): it touches" in played.picture(frame=STEPS).caption
    assert "Strip 2 of 7" in played.picture(frame=STEPS + 1).caption
    assert "Strip 7 of 7" in played.picture(frame=999).caption
