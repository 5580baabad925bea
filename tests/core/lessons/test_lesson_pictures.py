"""Pictures of lessons as they are painted, and the pages that show them."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.evaluation.pages import pictures
from accelscope.core.evaluation.pages.lesson_pictures import LessonPainter, on_paper
from accelscope.core.evaluation.pages.lettering import Letters, free_place, lettered
from accelscope.core.evaluation.pages.pictures import Gallery
from accelscope.core.evaluation.pages.view import BACKGROUND
from accelscope.core.evaluation.rays.workloads import workload_named
from accelscope.core.evaluation.records.experiment import Built, make_record, trace
from accelscope.core.lessons import lesson_named, lessons, lessons_about
from accelscope.core.lessons.lesson import Play, any_structure
from accelscope.core.lessons.picture import Image, Mark, Picture
from accelscope.core.settings import setting

BLACK = np.array([[0.0, 0.0, 0.0, 1.0]])


@dataclasses.dataclass(frozen=True)
class FrameSettings:
    """The knob of a lesson that is a row of pictures."""

    frame: int = setting(0, "Frame", "Which picture", minimum=0)


class Frames(Play):
    """A row of pictures."""

    def __init__(self, *pictures):
        self.pictures, self.ends = pictures, {"frame": len(pictures) - 1}

    def picture(self, settings):
        return self.pictures[settings.frame]


def line_between(points, caption="a line"):
    return Picture(caption, np.array([points], dtype=float), BLACK)


def test_what_stands_beside_the_model_is_in_the_picture(lab):
    scene = lab.small_scene("cubes")
    far = scene.upper + np.array([9.0, 0, 0])
    both = [line_between([far, far + np.array([0, 0, 2.0])]), Picture("nothing")]
    near = LessonPainter(scene, [Picture("nothing")])
    away = LessonPainter(scene, both)
    line, nothing = (away.paint(each) for each in both)
    assert (line != nothing).any(axis=2).sum() > 20
    # The model is in it, too, and smaller than before.
    sizes = [(each != BACKGROUND).any(axis=2).sum() for each in (near.paint(both[1]), nothing)]
    assert 500 < sizes[1] < sizes[0]


def test_faces_text_and_images_are_seen(lab):
    scene = lab.small_scene("cubes")
    lower, upper = scene.lower - 1.0, scene.upper + 1.0
    front = np.array([[lower, [upper[0], lower[1], lower[2]], [upper[0], lower[1], upper[2]]]])
    red = np.array([[1.0, 0.0, 0.0, 0.5]])
    plain = Picture("nothing")
    painter = LessonPainter(scene, [Picture("", faces=front, face_colours=red)])
    seen = painter.paint(Picture("", faces=front, face_colours=red))
    before = painter.paint(plain)
    changed = (seen != before).any(axis=2)
    assert changed.sum() > 500
    # Half red and half of what is behind; the rim is smoothed.
    mixed = 0.5 * before[changed] + [0.5, 0.0, 0.0]
    assert (np.abs(seen[changed] - mixed).max(axis=1) < 0.01).mean() > 0.95
    marked = painter.paint(Picture("", marks=(Mark(0.5 * (lower + upper), "N_L = 12"),)))
    assert (marked != before).any(axis=2).sum() > 50
    beside = painter.paint(Picture("", images=(Image("map", np.ones((2, 1, 3))),)))
    assert beside.shape[0] == before.shape[0]
    assert beside.shape[1] == before.shape[1] + round(0.5 * before.shape[0])


def test_no_text_covers_another():
    texts = [Letters(100.0, 50.0, f"number {n}", (0.0, 0.0, 0.0)) for n in range(12)]
    image = np.ones((100, 300, 3))
    taken = []
    for each in texts:
        place = free_place(each, 60.0, 18.0, taken, 300, 100)
        if place is None:
            continue
        left, top = place
        box = left, top, left + 60.0, top + 18.0
        assert left >= 0.0
        assert top >= 0.0
        assert box[2] <= 300.0
        assert box[3] <= 100.0
        for other in taken:
            assert (
                box[0] >= other[2] or other[0] >= box[2] or box[1] >= other[3] or other[1] >= box[3]
            )
        taken.append(box)
    assert 3 <= len(taken) < len(texts)
    assert (lettered(image, texts) != image).any()
    # At the right border it stands to the left of its point; beside the picture, nowhere.
    assert free_place(texts[0]._replace(column=290.0), 60.0, 18.0, [], 300, 100)[0] < 230.0
    assert free_place(texts[0]._replace(column=301.0), 60.0, 18.0, [], 300, 100) is None


@pytest.mark.parametrize("colour", [(1.0, 1.0, 0.4), (0.0, 0.6, 1.0), (0.1, 0.1, 0.1), None])
def test_text_on_paper_is_dark(colour):
    red, green, blue = on_paper(colour)
    assert 0.2126 * red + 0.7152 * green + 0.0722 * blue <= 0.4201
    if colour == (0.1, 0.1, 0.1):
        assert (red, green, blue) == colour


def test_lessons_about_a_structure_suit_it(lab, build):
    for name in ("bvh", "kdtree", "naive"):
        structure = build(name, lab.small_scene("suzanne"), log=True)
        about = lessons_about(structure)
        assert {each.name for each in about} == {
            each.name
            for each in lessons().values()
            if len(each.structures) == 1
            and each.suits is not any_structure
            and not each.name.endswith("_shader")
            and each.name != "pipeline_states"
            and each.suits(structure) == ""
        }
        assert ("levels" in {each.name for each in about}) == (name == "bvh")


def test_the_page_shows_the_lessons_about_a_structure(tmp_path, lab, build, monkeypatch):
    structure = build("naive", lab.small_scene("cubes"))
    line = line_between([structure.scene.lower, structure.scene.upper], "a <line>")
    example = dataclasses.replace(
        lesson_named("levels"), name="example", label="Ex & ample", structures=("naive",),
        Settings=FrameSettings, film="frame", suits=any_structure,
        play=lambda *_: Frames(line, Picture("nothing")),
    )  # fmt: skip
    monkeypatch.setattr(pictures, "lessons_about", lambda structure: [example])
    built = Built(structure, 1.0)
    workload = workload_named("random_lines")
    record = make_record(built, trace(built, workload, workload.Settings(count=10)))
    gallery = Gallery(tmp_path)
    gallery.add(built, [record])
    gallery.write_page()
    page = (tmp_path / "index.html").read_text()
    assert "Ex &amp; ample" in page
    assert "a &lt;line&gt;" in page
    assert len(list(tmp_path.glob("*-example-*.png"))) == 2
