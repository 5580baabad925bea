"""Lessons "nodes_not_paying" and "overlapping_siblings": figures of the tree, worst first."""

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons.drawing import GREY, RED
from accelscope.core.lessons.efficiency import Settings
from accelscope.core.lessons.lesson import build
from accelscope.core.progress import SILENT

SPECS = "bvh:max_leaf_size=1", "bvh:arity=4,C_trav=3", "bvh:volume=kdop14"


def played_on(play_lesson, name, scene, spec):
    lesson = play_lesson(name, scene).lesson
    bvh = build(scene, spec)
    return bvh, lesson.play(lesson.subject(scene, given=[bvh]), lesson.Settings(), SILENT)


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat"])
def test_a_node_pays_as_the_inequality_says(lab, play_lesson, name, spec):
    bvh, play = played_on(play_lesson, "nodes_not_paying", lab.small_scene(name), spec)
    figures, width, settings = bvh.statistics(), bvh.width(), bvh.settings
    first, areas = bvh.arrays.first, bvh.areas
    rows = {row.label: row.text for row in play.picture(settings_of(play, 0)).rows}
    assert rows["Do Not Pay"] == str(figures.extra["nodes_not_paying"])
    assert rows["Do Not Pay, Expected"] == str(figures.extra["nodes_not_paying_expected"])
    verdicts = []
    for rank in range(1, play.ends["rank"] + 1):
        node = int(play.worst[rank - 1])
        children = np.arange(first[node], first[node] + width[node])
        below = np.array([references_below(bvh, child) for child in children])
        p = areas[children] / areas[node] if areas[node] > 0.0 else np.ones(len(children))
        left = settings.C_trav + settings.C_isect * float(p @ below)
        right = settings.C_isect * int(below.sum())
        picture = play.picture(settings_of(play, rank))
        rows = {row.label: row.text for row in picture.rows}
        assert rows["K B + sum p_i I_i"] == f"{left:.3f}"
        assert rows["sum I_i"] == f"{right:g}"
        assert ("does not pay" in picture.caption) == (left >= right)
        # The node itself is the first volume behind the root's.
        colours = {tuple(colour[:3]) for colour in picture.colours}
        assert (RED[:3] in colours) == (left >= right)
        verdicts.append(left < right)
    assert verdicts == sorted(verdicts)
    # Of those that do not pay, that with the greatest loss comes first: its share of the lines
    # through the root times what it costs each of them.
    gain = bvh.efficiency().gain[play.worst]
    loss = (gain * areas[play.worst])[gain <= 0.0]
    assert len(loss) == figures.extra["nodes_not_paying"]
    assert (np.diff(loss) >= 0.0).all()


def references_below(bvh, node):
    """How many references are below a node, by going down."""
    size, first, width = bvh.arrays.size, bvh.arrays.first, bvh.width()
    if size[node] > 0:
        return int(size[node])
    return sum(references_below(bvh, first[node] + child) for child in range(width[node]))


@pytest.mark.parametrize("spec", SPECS)
@pytest.mark.parametrize("name", ["suzanne", "mess", "one", "flat"])
def test_pairs_are_siblings_and_share_what_is_marked(lab, play_lesson, name, spec):
    bvh, play = played_on(play_lesson, "overlapping_siblings", lab.small_scene(name), spec)
    boxes, parents = bvh.arrays.volumes.boxes(), bvh.parents()
    assert len(play.pairs) == len({tuple(pair) for pair in play.pairs})
    overlap = np.zeros(len(boxes))
    for (parent, a, b), shared, share in zip(play.pairs, play.shared, play.shares, strict=True):
        assert parents[a] == parents[b] == parent
        assert a != b
        low, high = np.maximum(boxes[a, :3], boxes[b, :3]), np.minimum(boxes[a, 3:], boxes[b, 3:])
        expected = np.concatenate([low, high]) if (low <= high).all() else np.zeros(6)
        assert np.array_equal(shared, expected)
        around = surface_area(boxes[parent])
        assert share == pytest.approx(surface_area(expected) / around if around > 0.0 else 0.0)
        overlap[parent] += share
    assert overlap == pytest.approx(bvh.overlap(), rel=1e-9, abs=1e-12)
    areas = surface_area(play.shared)
    assert (np.diff(areas) <= 0.0).all()
    for rank in range(play.ends["rank"] + 1):
        picture = play.picture(settings_of(play, rank))
        assert GREY[:3] in {tuple(colour[:3]) for colour in picture.colours}
        if rank:
            assert f"{100.0 * play.shares[rank - 1]:.1f}%" in picture.caption


def settings_of(play, rank):
    return play.within(Settings(rank))
