"""Lesson "ray_coherence": tinted cells list the sphere, the cone touches both, no ray leaves it."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.lessons.drawing import BLUE, GREEN, ORANGE, RED
from accelscope.core.structures.ray_coherence.condition import EXACT, LECTURE, cosine


@pytest.fixture(params=[None, "muddle"], ids=["soup", "muddle"])
def played(request, play_lesson):
    scene = request.param and request.getfixturevalue(request.param)
    return play_lesson("ray_coherence", scene, source=2, cells=5)


def of_colour(shapes, colours, colour, opacity):
    return shapes[(colours == (*colour[:3], opacity)).all(axis=1)]


def pairs(played):
    last = played.play.ends["other"]
    return [dataclasses.replace(played.settings, other=n) for n in (0, last // 2, last)]


def test_tinted_cells_are_those_that_list_the_other(played):
    for settings in pairs(played):
        picture, (source, other) = played.play.picture(settings), played.play.pair(settings)
        cells = np.arange(150)
        corners = played.play.structures[EXACT].corners_of(np.full(150, source), cells)
        lists = {
            bound: np.array([other in structure.list_of(source, cell)[0] for cell in cells])
            for bound, structure in played.play.structures.items()
        }
        assert not (lists[EXACT] & ~lists[LECTURE]).any()
        for colour, opacity, which in (
            (ORANGE, 0.5, lists[EXACT]), (RED, 0.25, lists[LECTURE] & ~lists[EXACT]),
        ):  # fmt: skip
            drawn = of_colour(picture.faces, picture.face_colours, colour, opacity)
            expected = corners[which][:, [(0, 1, 2), (0, 2, 3)]].reshape(-1, 3, 3)
            np.testing.assert_array_equal(drawn, expected)
        assert played.row("Cells", other=settings.other) == f"{lists[EXACT].sum()} of 150"
        assert played.row("Cells, Slide", other=settings.other) == f"{lists[LECTURE].sum()} of 150"


def test_the_cone_touches_both_spheres_and_no_ray_leaves_it(played):
    apart = 0
    for settings in pairs(played):
        picture, (source, other) = played.play.picture(settings), played.play.pair(settings)
        one, two = played.play.balls[[source, other]]
        line = two[:3] - one[:3]
        distance, radii = float(np.linalg.norm(line)), one[3] + two[3]
        assert (picture.face_colours[:, :3] == BLUE[:3]).all(axis=1).any()
        assert (picture.face_colours[:, :3] == GREEN[:3]).all(axis=1).any()
        least = float(played.row("Least Cosine of Rays", other=settings.other))
        if not distance > radii:
            assert "overlap" in picture.caption
            continue
        apart += 1
        bound = float(cosine(radii, distance, EXACT))
        assert bound - 1e-5 < least < bound + 0.1 * (1.0 - bound) + 1e-5
        cone = of_colour(picture.segments, picture.colours, ORANGE, 0.8)
        sides = cone[-12:]
        for ball, ends in ((one, sides[:, 0]), (two, sides[:, 1])):
            away = np.linalg.norm(ends - ball[:3], axis=1)
            np.testing.assert_allclose(away, ball[3], rtol=1e-9)
            # At right angles to the radius.
            along = ((sides[:, 1] - sides[:, 0]) * (ends - ball[:3])).sum(axis=1)
            np.testing.assert_allclose(along, 0.0, atol=1e-9 * distance**2)
    assert apart


def test_circles_are_the_caps(played):
    settings = pairs(played)[-1]
    picture, (source, other) = played.play.picture(settings), played.play.pair(settings)
    one, two = played.play.balls[[source, other]]
    line = two[:3] - one[:3]
    distance, radii = float(np.linalg.norm(line)), one[3] + two[3]
    for colour, bound in ((ORANGE, EXACT), (RED, LECTURE)):
        circle = of_colour(picture.segments, picture.colours, colour, 1.0)[:, 0] - one[:3]
        cosines = circle @ line / np.linalg.norm(circle, axis=1) / distance
        np.testing.assert_allclose(cosines, float(cosine(radii, distance, bound)), rtol=1e-9)
