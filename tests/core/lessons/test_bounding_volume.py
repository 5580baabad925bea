"""Lesson "bounding_volume": surfaces against closed forms and the hull, and times."""

import numpy as np
import pytest
from accelscope.core.lessons.bounding_volume import SHOWN, Settings
from accelscope.core.lessons.drawing import BLUE, RED

CLOSED = {
    "aabb": 1.0 / np.sqrt(12.0), "kdop14": 1.0, "kdop18": np.sqrt(2.0 / 3.0), "kdop26": 1.0,
    "smallest_sphere": np.sqrt(3.0) / np.pi,
}  # fmt: skip
"""Surface of the octahedron, 4 sqrt 3, in that of the volume."""


def test_surfaces_around_an_octahedron(play_lesson, octahedron):
    played = play_lesson("bounding_volume", octahedron)
    assert played.play.hull == pytest.approx(4.0 * np.sqrt(3.0), rel=1e-12)
    for kind, share in CLOSED.items():
        assert 1.0 / played.play.ratio(kind) == pytest.approx(share, rel=1e-6)
        assert played.row("Hull / Volume", volume=kind) == f"{share:.3f}"


@pytest.mark.parametrize("name", ["bunny", "one", "flat", "mess"])
def test_no_volume_is_smaller_than_the_hull(lab, play_lesson, read_charts, name):
    play = play_lesson("bounding_volume", lab.small_scene(name)).play
    assert all(time > 0.0 for time in play.times.values())
    for kind in SHOWN:
        assert play.ratio(kind) > 1.0 - 1e-6
    for chosen in SHOWN:
        (chart,) = read_charts(play, Settings(chosen))
        others = [(play.times[kind], play.ratio(kind)) for kind in SHOWN if kind != chosen]
        np.testing.assert_allclose(chart.stars(BLUE), others)
        point = play.times[chosen], play.ratio(chosen)
        np.testing.assert_allclose(chart.lines(RED)[0, 1], point)
    # More strips cannot be looser, and the exact sphere is none larger than the fast one.
    assert play.areas["kdop26"] <= min(play.areas["kdop14"], play.areas["kdop18"]) * (1 + 1e-9)
    assert play.areas["kdop14"] <= play.areas["aabb"] * (1 + 1e-9)
    assert play.areas["smallest_sphere"] <= play.areas["sphere"] * (1 + 1e-9)
