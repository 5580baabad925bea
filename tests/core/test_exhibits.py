"""Every exhibit of every structure, and the pictures that are made of them."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.geometry.box_shape import surface_area
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


# ---------------------------------------------------------------------------------------- levels


def test_levels(lab, build):
    structure = build("bvh", lab.small_scene("suzanne"))
    cells = structure.cells()
    (levels,) = (each for each in exhibits_of(structure) if each.name == "levels")
    assert levels.count == cells.depth.max() + 1
    for level in (0, 3, levels.count - 1):
        frame = levels.frame(level)
        shown = (cells.depth == level) | (cells.is_leaf & (cells.depth < level))
        assert len(frame.segments) == 12 * shown.sum()
        bright = frame.colours[:, 3] == 1.0
        assert bright.sum() == 12 * (cells.depth == level).sum()
        low, high = frame.segments.min(axis=(0, 1)), frame.segments.max(axis=(0, 1))
        # Whatever the level, what is drawn contains the scene.
        np.testing.assert_array_equal([low, high], [structure.scene.lower, structure.scene.upper])
    assert levels.frame(0).caption.startswith(f"Level 0 of {levels.count - 1}: 1 node; together 1")


def test_levels_of_many_nodes_show_the_largest(build):
    from accelscope.sample_scenes import make_sample

    structure = build("bvh", make_sample("suzanne"), "max_leaf_size=1")
    cells, levels = structure.cells(), exhibits_of(structure)[0]
    level = int(np.bincount(cells.depth).argmax())
    frame = levels.frame(level)
    shown = MOST_SEGMENTS // 12
    assert len(frame.segments) == 12 * shown
    sizes = np.sort(surface_area(cells.boxes[cells.depth == level]))[-shown:]
    ends = frame.segments.reshape(shown, 24, 3)
    drawn = surface_area(np.concatenate([ends.min(axis=1), ends.max(axis=1)], axis=1))
    np.testing.assert_array_equal(np.sort(drawn), sizes)
    assert frame.caption.endswith(f"drawn: {shown // 1000} {shown % 1000} volumes")
