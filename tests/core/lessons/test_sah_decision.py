"""Lessons "sah_decision" and "one_more_level": the numbers of the slides, in their places."""

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.sah.worked_example import PRINTED

# N_L, N_R, p_L, p_R, Cost as the slides print them.
SLIDES = {
    "I": ("8", "68", "0.28", "0.91", "67.1"),
    "II": ("12", "64", "0.52", "0.67", "52.1"),
    "III": ("12", "64", "0.90", "0.29", "32.4"),
}


def test_the_slides_numbers_stand_in_their_places(play_lesson):
    decision, level = play_lesson("sah_decision"), play_lesson("one_more_level")
    for name, (n_left, n_right, p_left, p_right, cost) in SLIDES.items():
        picture = decision.picture(plane=name)
        texts = {mark.text: mark.colour for mark in picture.marks}
        assert texts[f"N_L = {n_left}   p_L = {p_left}"] == BLUE[:3]
        assert texts[f"N_R = {n_right}   p_R = {p_right}"] == ORANGE[:3]
        assert texts[f"Cost({name}) = {cost}"] == RED[:3]
        assert f"the slide prints {cost}" in picture.caption
        assert {"I", "II", "III"} <= set(texts)
    assert decision.row("Cost(V)", plane="V") == "76"
    # The slide prints 30.0 for X, from other p than it prints.
    assert "Cost(X) = 30.1" in [mark.text for mark in level.picture(planes="X").marks]
    assert "the slide prints 30.0" in level.picture(planes="X").caption
    assert "Cost(III+X) = 22.5" in [mark.text for mark in level.picture(planes="III+X").marks]
    assert level.row("Cost(III+X)", planes="III+X") == f"{PRINTED['III+X']}"


@pytest.mark.parametrize("name", ["suzanne", "one", "flat", "mess"])
def test_on_any_mesh_the_planes_lie_at_the_same_shares(lab, play_lesson, name):
    scene = lab.small_scene(name)
    decision, level = play_lesson("sah_decision", scene), play_lesson("one_more_level", scene)
    size = scene.upper - scene.lower
    cases = decision.play.cases
    for plane, share in (("I", 1 / 9), ("II", 11 / 27), ("III", 71 / 81)):
        (found,) = cases[plane].planes
        assert found.axis == np.argmax(size)
        want = scene.lower[found.axis] + share * size[found.axis]
        assert found.position == pytest.approx(want, rel=1e-12, abs=1e-12 * size.max())
        assert f"Cost({plane}) = " in decision.picture(plane=plane).caption
    x = cases["X"].planes[0]
    assert x.axis != cases["III"].planes[0].axis
    assert x.N_L + x.N_R == cases["III"].planes[0].N_R
    for planes in ("III", "X", "III+X"):
        picture = level.picture(planes=planes)
        assert np.isfinite(picture.points()).all()
        assert "undivided" in picture.caption
