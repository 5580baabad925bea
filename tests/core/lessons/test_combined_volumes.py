"""Lesson "combined_volumes": it saves the lines that members hit and it does not."""

import numpy as np
import pytest
from accelscope.core.geometry.kinds import COMBINED
from accelscope.core.lessons.around import SPHERE, outside_of
from accelscope.core.lessons.combined_volumes import MADE_OF
from accelscope.core.lessons.drawing import BLUE, GREEN, ORANGE


def area_of(triangles):
    sides = triangles[:, 1:] - triangles[:, :1]
    return 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()


def test_every_combination_is_compared():
    assert set(MADE_OF) == set(COMBINED)


@pytest.mark.parametrize("kind", MADE_OF)
@pytest.mark.parametrize("name", ["suzanne", "mess", "one"])
def test_who_hits_what(lab, play_lesson, name, kind):
    played = play_lesson("combined_volumes", lab.small_scene(name), volume=kind)
    play = played.play
    assert (play.sample.hits_volume | ~play.sample.hits_object).all()
    if "_and_" in kind:
        for hits in play.hits:  # inside of both members is inside of each
            assert (hits | ~play.sample.hits_volume).all()
        # So all that it saves are lines at the tightest.
        hit, fewest = play.sample.hits_volume.sum(), min(hits.sum() for hits in play.hits)
        assert play.saved().sum() == fewest - hit
    assert play.hits[play.best].sum() == min(hits.sum() for hits in play.hits)
    assert not (play.saved() & play.sample.hits_object).any()
    n = len(play.sample.rays)
    assert played.row("Saved") == f"{int(play.saved().sum())} of {n} lines"
    lines, bare = played.picture(with_lines=True), played.picture(with_lines=False)
    drawn = lines.colours[len(bare.colours) :, :3]
    some = slice(0, 160)
    both, within = play.sample.hits_object[some], play.sample.hits_volume[some]
    for colour, count in (
        (ORANGE, (within & ~both).sum()), (GREEN, both.sum()), (BLUE, play.saved()[some].sum())
    ):  # fmt: skip
        assert (drawn == colour[:3]).all(axis=1).sum() == count


@pytest.mark.parametrize("kind", MADE_OF)
def test_the_surface_that_is_drawn_is_that_of_the_combination(lab, play_lesson, kind):
    play = play_lesson("combined_volumes", lab.small_scene("suzanne"), volume=kind).play
    away = outside_of(play.volume, 0, play.surface.reshape(-1, 3))
    # A sphere is drawn by triangles between its points, which lie below it by their sagitta.
    sagitta = 1.0 - np.linalg.norm(SPHERE.mean(axis=1), axis=1).min()
    box, has_sphere = play.volume.boxes()[0], "sphere" in kind
    size = 0.5 * np.linalg.norm(box[3:] - box[:3])  # no sphere has a larger radius
    assert np.abs(away).max() < (sagitta if has_sphere else 1e-9) * size
    if "_and_" in kind:  # convex: four mean shadows are the surface
        exact = kind == "obb_and_kdop14"
        assert area_of(play.surface) == pytest.approx(play.areas[-1], rel=1e-9 if exact else 0.03)
