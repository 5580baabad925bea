"""Every exhibit of every structure, and the pictures that are made of them."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.evaluation.pages import pictures
from accelscope.core.evaluation.pages.exhibit_pictures import ExhibitPainter, frames_to_show
from accelscope.core.evaluation.pages.pictures import Gallery
from accelscope.core.evaluation.pages.view import BACKGROUND
from accelscope.core.evaluation.rays.workloads import workload_named
from accelscope.core.evaluation.records.experiment import Built, make_record, trace
from accelscope.core.geometry.box_shape import surface_area
from accelscope.core.lessons import exhibits_left_out, exhibits_of
from accelscope.core.lessons.exhibit import MOST_SEGMENTS, Exhibit, Frame
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
    for number in frames_to_show(exhibit.count):
        check_frame(exhibit.frame(number))


def test_frames_are_made_without_touching_the_structure(lab, build):
    structure = build("bvh", lab.small_scene("suzanne"), log=True)
    before = structure.cells(), structure.triangles.ids.copy()
    for exhibit in exhibits_of(structure):
        for number in frames_to_show(exhibit.count):
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


# -------------------------------------------------------------------------------------- pictures


@pytest.mark.parametrize(
    ("count", "shown"), [(1, [0]), (2, [0, 1]), (4, [0, 1, 2, 3]), (11, [0, 3, 7, 10])]
)
def test_frames_to_show(count, shown):
    assert frames_to_show(count) == shown


def exhibit_at(points):
    """Return an exhibit with a black line between two points, the second frame without any."""
    segments = np.array([points], dtype=float)
    frames = [
        Frame(segments, np.array([[0.0, 0, 0, 1]]), "a line"),
        Frame(segments[:0], np.zeros((0, 4)), "nothing"),
    ]
    return Exhibit("example", "Example", "A line <and> nothing", 2, frames.__getitem__)


def test_what_stands_beside_the_model_is_in_the_picture(lab):
    scene = lab.small_scene("cubes")
    painter = ExhibitPainter(scene)
    inside = painter.pictures_of(exhibit_at([scene.lower, scene.upper]))
    np.testing.assert_allclose(inside[1].image[0, 0], BACKGROUND)
    assert [each.caption for each in inside] == ["a line", "nothing"]
    far = scene.upper + np.array([9.0, 0, 0])
    line, nothing = painter.pictures_of(exhibit_at([far, far + np.array([0, 0, 2.0])]))
    assert (line.image != nothing.image).any(axis=2).sum() > 20
    # The model is in it, too, and smaller than before.
    sizes = [(each.image != BACKGROUND).any(axis=2).sum() for each in (inside[1], nothing)]
    assert 500 < sizes[1] < sizes[0]


def test_the_page_shows_all_exhibits(tmp_path, lab, build, monkeypatch):
    structure = build("naive", lab.small_scene("cubes"))
    exhibit = exhibit_at([structure.scene.lower, structure.scene.upper])
    monkeypatch.setattr(pictures, "exhibits_of", lambda structure: [exhibit])
    built = Built(structure, 1.0)
    workload = workload_named("random_lines")
    record = make_record(built, trace(built, workload, workload.Settings(count=10)))
    gallery = Gallery(tmp_path)
    gallery.add(built, [record])
    gallery.write_page()
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<h3>Example</h3><p>A line &lt;and&gt; nothing</p>" in page
    for number, caption in ((0, "a line"), (1, "nothing")):
        file = f"cubes-naive-example-{number}.png"
        assert (tmp_path / file).is_file()
        assert f'<img src="{file}" alt="{caption}"><figcaption>{caption}</figcaption>' in page
