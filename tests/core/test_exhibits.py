"""Every exhibit of every structure, and the pictures that are made of them."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons import exhibits_left_out, exhibits_of
from accelscope.core.lessons.exhibit import MOST_SEGMENTS
from accelscope.core.structures import structures
from accelscope.core.structures.bvh import BVH

SMALL_SCENES = "suzanne", "one", "mess", "flat"

TELLING = "volume", "arity", "optimise"
"""Settings that exhibits of the same name depend on."""


def check_frame(frame):
    """Assert that a frame can be drawn."""
    count = len(frame.segments)
    assert frame.segments.shape == (count, 2, 3)
    assert frame.colours.shape == (count, 4)
    assert count <= MOST_SEGMENTS
    assert np.isfinite(frame.segments).all()
    assert ((frame.colours >= 0.0) & (frame.colours <= 1.0)).all()
    assert frame.caption
    assert frame.caption == frame.caption.strip()


@pytest.mark.parametrize("scene", SMALL_SCENES)
def test_frames_can_be_drawn(scene, lab, build):
    seen = set()
    for name, text in lab.ALL_VARIANTS:
        if not issubclass(structures()[name], BVH):  # no other structure has exhibits
            continue
        structure = build(name, lab.small_scene(scene), text, log=True)
        exhibits = exhibits_of(structure)
        assert len({exhibit.name for exhibit in exhibits}) == len(exhibits)
        for exhibit in exhibits:
            # Frames of the same kind look the same with most settings.
            kind = exhibit.name, *(getattr(structure.settings, key, "") for key in TELLING)
            if kind not in seen:
                seen.add(kind)
                check_exhibit(exhibit)


def check_exhibit(exhibit):
    """Assert that an exhibit has what panel, page and overlay need."""
    assert exhibit.name.isidentifier()
    assert exhibit.label
    assert exhibit.description
    assert not exhibit.description.endswith(".")
    assert exhibit.count >= 1
    assert all(0 <= number < exhibit.count for number in exhibit.on_page)
    for number in sorted({0, exhibit.count // 2, exhibit.count - 1}):
        check_frame(exhibit.frame(number))


def test_frames_are_made_without_touching_the_structure(lab, build):
    structure = build("bvh", lab.small_scene("suzanne"), log=True)
    before = structure.cells(), structure.triangles.ids.copy()
    for exhibit in exhibits_of(structure):
        for number in sorted({0, exhibit.count // 2, exhibit.count - 1}):
            exhibit.frame(number)
            again = exhibit.frame(number)
            np.testing.assert_array_equal(again.segments, exhibit.frame(number).segments)
    np.testing.assert_array_equal(structure.cells().boxes, before[0].boxes)
    np.testing.assert_array_equal(structure.triangles.ids, before[1])


def test_without_a_log_there_are_none_and_it_is_said(lab):
    scene = lab.small_scene("suzanne")
    settings = BVH.Settings(builder="ploc", optimise="reinsert")
    without, asked = BVH.build(scene, settings), BVH.build(scene, settings, log=True)
    names, all_names = ({each.name for each in exhibits_of(bvh)} for bvh in (without, asked))
    assert all_names - names == {
        "radix_sort", "radix_2_split", "ploc_clusters", "cost_over_steps", "reinsertions",
    }  # fmt: skip
    assert exhibits_left_out(asked) == ""
    assert "no log" in exhibits_left_out(without)
