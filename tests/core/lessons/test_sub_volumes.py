"""Lesson "sub_volumes": counted shares against surfaces and shadows, within their errors."""

import numpy as np
import pytest
from accelscope.core.lessons.lesson import build
from accelscope.core.lessons.solid_efficiency import DIRECTIONS
from accelscope.core.lessons.sub_volumes import BUNCH, BUNCHES, Settings, colour_of
from accelscope.core.progress import SILENT


@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat", "balls"])
def test_expected_shares_are_those_of_the_tree(lab, play_lesson, name):
    played = play_lesson("sub_volumes", lab.small_scene(name))
    (bvh,), play = played.subject.structures, played.play
    boxes = bvh.arrays.volumes.boxes()
    assert play.areas == pytest.approx(bvh.areas[[0, *play.nodes]], rel=1e-12)
    assert play.expected["all"] == pytest.approx(bvh.areas[play.nodes] / bvh.areas[0], rel=1e-12)
    size = boxes[:, 3:] - boxes[:, :3]
    sides = np.stack([size[:, 1] * size[:, 2], size[:, 2] * size[:, 0], size[:, 0] * size[:, 1]])
    for direction, (_, along) in DIRECTIONS.items():
        if along is not None:
            shadow = np.abs(along) / np.linalg.norm(along) @ sides
            if shadow[0] > 0.0:
                share = shadow[play.nodes] / shadow[0]
                assert play.expected[direction] == pytest.approx(share, rel=1e-9)
        # In the end, no share is off by more than chance makes it once in 16 000 times.
        counts, shares = play.counted(direction)
        n, p = counts[-1], play.expected[direction]
        if n > 0:
            assert (np.abs(shares[-1] - p) <= 4.0 * np.sqrt(p * (1.0 - p) / n) + 2.0 / n).all()


def test_shares_are_counted_among_the_lines_so_far(play_lesson, read_charts):
    played = play_lesson("sub_volumes")
    play = played.play
    for bunches in (1, 7, BUNCHES):
        fallen = slice(0, BUNCH * bunches)
        through = play.hits["all"][fallen].sum()
        both = play.parts_hit["all"][fallen].sum(axis=0)
        assert played.row("Lines through C", bunches=bunches) == str(through)
        for part in range(len(play.nodes)):
            text = played.row(f"p_{part}", bunches=bunches)
            assert text.startswith(f"{both[part] / through:.4f}, S_i / S = ")
    (chart,) = read_charts(play, Settings(7, 0))
    counts, shares = play.counted("all")
    for part in range(1, len(play.nodes)):
        curve = np.stack([counts[:7], np.minimum(shares[:7, part], chart.chart.top)], axis=1)
        np.testing.assert_allclose(chart.curve(colour_of(part, len(play.nodes))), curve, atol=1e-9)
    assert not (play.parts_hit["all"].any(axis=1) & ~play.hits["all"]).any()


@pytest.mark.parametrize("kind", ["smallest_sphere", "obb", "kdop14"])
def test_other_volumes(lab, play_lesson, kind):
    played = play_lesson("sub_volumes", lab.small_scene("suzanne"))
    bvh = build(played.scene, f"bvh:volume={kind}")
    play = played.lesson.play(
        played.lesson.subject(played.scene, given=[bvh]), played.settings, SILENT
    )
    assert play.areas == pytest.approx(bvh.areas[[0, *play.nodes]], rel=1e-9)
    said = [row.label for row in play.picture(play.within(played.settings)).rows]
    assert ("Sticking Out" in said) == (kind != "kdop14")
    for direction in DIRECTIONS:
        counts, shares = play.counted(direction)
        p, n = play.expected[direction], counts[-1]
        if kind == "smallest_sphere":  # a circle is what any direction sees of it
            radii = bvh.arrays.volumes.rows[:, 3]
            assert p == pytest.approx((radii[play.nodes] / radii[0]) ** 2, rel=1e-12)
        if kind == "kdop14":
            assert (np.abs(shares[-1] - p) <= 4.0 * np.sqrt(p * (1.0 - p) / n) + 2.0 / n).all()
