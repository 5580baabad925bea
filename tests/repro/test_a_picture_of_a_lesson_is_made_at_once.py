"""What a knob shows is made of what was played: no more lines than are seen, nothing reckoned anew.

A cone that enters all of a tree had three million lines and took more than a second; areas of
unions were measured with every picture.
"""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import VISIT_INNER, VISIT_LEAF
from accelscope.core.geometry import combined
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.ray import PALETTE
from accelscope.core.lessons.ray_path import MOST_MET, MOST_VISITED, segments_of
from accelscope.core.lessons.walk_in_words import legend
from accelscope.core.progress import SILENT
from accelscope.sample_scenes import make_sample


def test_a_wide_cone_draws_the_last_cells_alone():
    lesson = lesson_named("ray")
    settings = lesson.Settings(cone=60.0, whole=True)
    play = lesson.play(lesson.subject(make_sample("soup:count=20000")), settings, SILENT)
    walk = play.walk
    segments, colours = segments_of(walk, palette=PALETTE)
    for kind, name in ((VISIT_INNER, "inner"), (VISIT_LEAF, "leaf")):
        visited = walk.steps.cell[walk.steps.events_of(kind)]
        assert len(visited) > 2 * MOST_VISITED
        last = walk.cells.boxes[walk.cells.places_of(np.unique(visited[-MOST_VISITED:]))]
        colour = getattr(PALETTE, name)
        is_drawn = (colours[:, :3] == colour[:3]).all(axis=1) & (colours[:, 3] < colour[3])
        ends = segments[is_drawn].reshape(-1, 24, 3)
        assert len(ends) == len(last)
        drawn = np.concatenate([ends.min(axis=1), ends.max(axis=1)], axis=1)
        np.testing.assert_array_equal(np.unique(drawn, axis=0), np.unique(last, axis=0))
    words = dict(legend(walk))
    assert words["leaf"].endswith(f"leaves with triangles, drawn: the last {MOST_VISITED}")
    caption = play.picture(settings).caption
    assert f"drawn: the last {MOST_VISITED} cells of a kind" in caption
    assert len(walk.met()) > MOST_MET
    assert len(segments) < 12 * 2 * MOST_VISITED + 3 * (MOST_MET + 2000) + 200


@pytest.mark.parametrize("volume", ["two_boxes", "two_spheres", "kdop26"])
def test_no_area_is_measured_for_a_picture(volume, monkeypatch):
    lesson = lesson_named("solid_efficiency")
    settings = lesson.Settings(volume=volume)
    play = lesson.play(lesson.subject(make_sample("suzanne:subdivisions=0")), settings, SILENT)

    def fails(*_, **__):
        pytest.fail("an area is measured")

    for module, name in ((combined, "measured_by_lines"), (combined, "measured")):
        monkeypatch.setattr(module, name, fails)
    monkeypatch.setattr("accelscope.core.geometry.kdop.measured_by_edges", fails)
    for direction in ("x", "all"):
        play.picture(dataclasses.replace(settings, direction=direction))
