"""Lesson "popular_kdops": the sides that are drawn make the surface, by kinds of normals."""

import numpy as np
import pytest
from accelscope.core.lessons.popular_kdops import KINDS


def area_of(triangles):
    sides = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()


@pytest.mark.parametrize("name", ["bunny", "one", "mess"])
def test_sides_make_the_surface(lab, play_lesson, name):
    play = play_lesson("popular_kdops", lab.small_scene(name)).play
    expected = {"6": {1}, "14": {1, 3}, "18": {1, 2}, "26": {1, 2, 3}}
    for k in KINDS:
        areas = {n: area_of(sides) for n, sides in play.sides[k].items()}
        assert sum(areas.values()) == pytest.approx(play.areas[k], rel=1e-6)
        assert {n for n, area in areas.items() if area > 1e-9 * play.areas[k]} <= expected[k]
    if name == "bunny":
        assert all(play.sides["26"][n].size for n in (1, 2, 3))


def test_figures_around_an_octahedron(play_lesson, octahedron):
    played = play_lesson("popular_kdops", octahedron)
    # Octahedron: surface 4 sqrt 3, content 4 / 3; the cube: 24 and 8; the 18-DOP: 8.485 and 2.
    assert played.row("Hull") == "S = 6.928"
    assert played.row("6-DOP") == "S = 24, V = 8"
    assert played.row("14-DOP") == played.row("26-DOP") == "S = 6.928, V = 1.333"
    assert played.row("18-DOP") == "S = 8.485, V = 2"


def test_marks_are_of_all_four(play_lesson):
    texts = [mark.text for mark in play_lesson("popular_kdops").picture().marks]
    assert [text.partition(":")[0] for text in texts] == [f"{k}-DOP" for k in KINDS]
