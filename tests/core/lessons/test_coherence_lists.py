"""Lesson "coherence_lists": the first ray of a cell makes its list, colours are the walk's."""

import numpy as np
import pytest
from accelscope.core.geometry.rays import NOBODY
from accelscope.core.lessons.coherence_lists import LIGHT_CELLS, MOST_CELLS
from accelscope.core.lessons.drawing import GREEN, GREY, ORANGE
from accelscope.core.lessons.lesson import build
from accelscope.core.structures.ray_coherence import RayCoherence, RayCoherenceSettings


@pytest.fixture(params=[None, "muddle"], ids=["soup", "muddle"])
def played(request, play_lesson):
    return play_lesson(
        "coherence_lists", request.param and request.getfixturevalue(request.param), cells=4
    )


def test_lists_are_made_by_the_first_ray_of_their_cell(played):
    """Ray after ray through a new structure: what is there by then is what the picture counts."""
    play = played.play
    structure = RayCoherence.build(
        play.scene, RayCoherenceSettings(cells=4, light_cells=LIGHT_CELLS)
    )
    for ray in range(len(play.rays)):
        before = structure.made().cells
        structure.trace(play.rays.select(np.array([ray])), threads=1)
        made = structure.made().cells
        assert (made > before) == (play.arrived.first[ray] == ray)
        if ray % 97 == 0:
            assert played.row("Lists", ray=ray) == str(made)
            picture = played.picture(ray=ray)
            squares = (picture.face_colours[:, 3] == 0.3).sum() // 2
            assert squares == min(made, MOST_CELLS)
            said = "is made now" if made > before else f"for ray {play.arrived.first[ray]}"
            assert said in picture.caption


def test_colours_are_those_of_the_walk(played):
    play, shown = played.play, set()
    naive = build(play.scene, "naive")
    hits, _ = naive.trace(play.rays)
    for ray in range(0, len(play.rays), 3):
        items, nearest = play.structure.list_of(
            int(play.arrived.spheres[ray]), int(play.arrived.cells[ray])
        )
        tested, hit = play.walked(ray)
        states = play.states(items, tested, hit)
        assert (np.diff(nearest) >= 0.0).all()
        assert tested == items[: len(tested)].tolist()
        assert len(tested) == play.arrived.tests[ray]
        assert (hit >= 0) == (hits.primitive[ray] >= 0)
        if play.rays.targets[ray] == NOBODY:
            assert hit == hits.primitive[ray]
        assert states == [
            GREEN if item == hit else ORANGE if item in tested else GREY for item in items.tolist()
        ]
        shown |= set(states)
    assert shown == {GREEN, ORANGE, GREY}


def test_rays_leave_what_was_hit_and_go_to_the_light(played):
    rays = played.play.rays
    is_shadow = rays.targets != NOBODY
    assert 0 < is_shadow.sum() < len(rays)
    assert (rays.sources >= 0).all()
    spheres = played.play.arrived.spheres
    assert (spheres[is_shadow] == len(played.play.scene)).all()
    np.testing.assert_array_equal(spheres[~is_shadow], rays.sources[~is_shadow])
