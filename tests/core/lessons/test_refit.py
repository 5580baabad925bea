"""Lesson "refit": boxes and costs are those of a refitted tree and of one built for the frame."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.evaluation.records.animation import animate
from accelscope.core.geometry.box_shape import box_segments
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import BLUE, ORANGE, RED
from accelscope.core.lessons.lesson import Subject
from accelscope.core.lessons.refit import (
    DEFORMATIONS,
    FRAMES,
    Settings,
    can_follow,
    deformed,
    history_of,
)
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVH

LESSON = lesson_named("refit")


def boxes_drawn(picture, colour):
    """The boxes of a colour, without the chart, about their common middle."""
    lines = picture.segments[(picture.colours == colour).all(axis=1)]
    return lines - lines[0, 0]


@pytest.mark.parametrize("name", ["suzanne", "one", "flat", "mess"])
@pytest.mark.parametrize("deformation", DEFORMATIONS)
def test_both_trees_are_shown_as_they_are(lab, play_lesson, read_charts, name, deformation):
    scene = lab.small_scene(name)
    played = play_lesson("refit", scene, deformation=deformation)
    (tree,) = played.subject.structures
    assert played.play.ends["frame"] == FRAMES - 1
    assert deformed(scene, deformation, 0.0) is scene
    for frame in (0, FRAMES - 1):
        there = deformed(scene, deformation, frame / (FRAMES - 1))
        refitted, rebuilt = tree.refitted(there), BVH.build(there, tree.settings)
        costs = [each.statistics().sah for each in (refitted, rebuilt)]
        (chart,) = read_charts(played.play, Settings(frame))
        for cost, colour in zip(costs, (ORANGE, BLUE), strict=True):
            curve = chart.curve(colour)
            assert len(curve) == FRAMES
            np.testing.assert_allclose(curve[frame], (frame, cost), atol=1e-9 * chart.chart.top)
        for level in range(played.play.ends["level"] + 1):
            picture = played.picture(frame=frame, level=level)
            assert f"{costs[0]:.2f} refitted, {costs[1]:.2f} built" in picture.caption
            for each, colour in ((refitted, ORANGE), (rebuilt, BLUE)):
                want = box_segments(each.arrays.volumes.boxes()[each.depths() == level])
                if len(want):
                    drawn = boxes_drawn(picture, colour)[: len(want)]
                    size = np.abs(want).max()
                    np.testing.assert_allclose(drawn, want - want[0, 0], atol=1e-12 * size)


def test_an_animation_that_was_compared_is_shown(lab, read_charts):
    scene = lab.small_scene("bunny")
    frames = [(number, deformed(scene, "twist", 0.2 * number)) for number in (3, 4, 8)]
    lines = RandomLinesSettings(count=100)
    found = animate(frames, BVH, BVH.Settings(), RandomLinesWorkload, lines)
    subject = Subject(frames[0][1], (found.original,), history=found.history)
    play = LESSON.play(subject, Settings(), SILENT)
    assert play.ends["frame"] == 2
    assert [moment.frame for moment in play.history] == [3, 4, 8]
    costs = [record["statistics"]["sah"] for record in found.records]
    picture = play.picture(Settings(2))
    assert f"Frame 8: SAH {costs[4]:.2f} refitted, {costs[5]:.2f} built anew" in picture.caption
    (chart,) = read_charts(play, Settings(2))
    for colour, own in ((ORANGE, costs[::2]), (BLUE, costs[1::2])):
        np.testing.assert_allclose(chart.curve(colour), [*zip((3, 4, 8), own, strict=True)])
    np.testing.assert_allclose(chart.lines(RED)[0], [(8.0, 0.0), (8.0, costs[4])], atol=1e-9)
    again = history_of(frames, found.original)
    for a, b in zip(again, found.history, strict=True):
        assert (a.frame, a.refit, a.rebuild) == (b.frame, b.refit, b.rebuild)


def test_who_can_follow(lab, build, play_lesson):
    assert "cannot follow" in can_follow(build("grid", lab.small_scene("soup")))
    with pytest.raises(InputError, match="triangles"):
        play_lesson("refit", lab.small_scene("balls"))
