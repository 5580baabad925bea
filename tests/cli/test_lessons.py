"""``accelscope lessons``, ``lesson``, ``film``, ``handout``: what they print, write and refuse."""

import html
import json
import shlex
import struct

import numpy as np
import pytest


def size_of(path):
    """Width and height of a PNG file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def test_lessons_are_listed_by_slide(run):
    from accelscope.core.lessons import lessons
    from accelscope.core.lessons.slides import SLIDES

    out = run("lessons")
    assert (out.code, out.err) == (0, "")
    lines = out.out.splitlines()
    slides = [line for line in lines if line and not line.startswith(" ")]
    assert slides == [slide for slide in SLIDES if slide in slides]
    named = [
        line.strip().partition(":")[0] for line in lines if line[:3].strip() and line[0] == " "
    ]
    assert named == list(lessons())
    listing = json.loads(run("lessons", "--json").out)
    assert [entry["name"] for entry in listing] == list(lessons())
    assert all(entry["question"].endswith("?") for entry in listing)


def test_a_lesson_in_words(run):
    out = run("lesson", "levels", "--level", 3, "--quiet")
    assert (out.code, out.out, out.err) == (0, "", "")
    out = run("lesson", "levels", "sample:tetra:size=3", "--level=1", "--structure",
              "bvh:max_leaf_size=1")  # fmt: skip
    assert out.code == 0
    assert "Level 1 of " in out.out
    assert ": 2 nodes" in out.out
    assert "Question: " in out.out
    assert "Source: core/structures/bvh/hierarchy.py" in out.out
    for words in (["--level", "1", "levels"], ["levels", "--level=1", "--"]):
        assert "Level 1 of " in run("lesson", *words, "sample:tetra:size=3").out
    # A knob beyond its end is turned back to it.
    last = run("lesson", "levels", "sample:tetra:size=3", "--level", 10**6).out.splitlines()[3]
    level, of, deepest = (last.split()[1], last.split()[2], last.split()[3])
    assert of == "of"
    assert level == deepest.rstrip(":")


def test_pictures_and_a_page_of_a_lesson(run, obj, tmp_path):
    out = run("lesson", "ray", obj(), "--pictures", tmp_path / "p", "--page", tmp_path / "ray.html")
    assert out.code == 0
    names = sorted(path.name for path in (tmp_path / "p").iterdir())
    assert names == [f"ray-{number:02}.png" for number in range(len(names))]
    assert len({size_of(tmp_path / "p" / name) for name in names}) == 1
    page = (tmp_path / "ray.html").read_text()
    assert page.count("data:image/png;base64,") > 1
    assert 'src="http' not in page
    assert "<details>" in page


def test_files_are_the_frames_of_an_animation(run, refused, obj, five):
    shift = np.arange(5.0)[:, None, None] * np.array([1.0, 3.0, -2.0])
    steps = [obj(five + n * shift, f"step{n}.obj") for n in range(3)]
    lesson, table = run("lesson", "refit", *steps), run("animate", *steps)
    assert lesson.code == 0
    last = table.out.splitlines()[-1].split()
    assert f"Frame 2: SAH {float(last[1]):.2f} refitted, {float(last[3]):.2f} built" in lesson.out
    # One file alone is deformed here.
    assert "Frame 8: " in run("lesson", "refit", steps[0]).out
    fewer = obj(five[:3], "fewer.obj")
    assert "was built over 5 triangles" in refused("lesson", "refit", steps[0], fewer)


def test_a_heat_map_as_numbers(run, tmp_path):
    out = run("lesson", "heat_map", "sample:tetra:size=3", "--width", 32, "--pictures", tmp_path)
    assert out.code == 0
    values = np.load(tmp_path / "heat_map-00-heat.npy")
    assert values.shape == (24, 32)
    assert values.max() > 0
    assert size_of(tmp_path / "heat_map-00-heat.png")[0] == 32


def test_a_film_has_a_frame_for_every_value(run, tmp_path):
    text = run("lesson", "levels", "sample:tetra:size=2").out
    deepest = int(text.partition("Level 1 of ")[2].partition(":")[0])
    out = run("film", "levels", "sample:tetra:size=2", "--out", tmp_path)
    assert out.code == 0
    assert f"{deepest + 1} frames in" in out.out
    assert len(list(tmp_path.glob("levels-*.png"))) == deepest + 1


def test_a_handout_of_some_lessons(run, tmp_path, monkeypatch):
    from accelscope.core.evaluation.pages import lesson_page

    monkeypatch.setattr(lesson_page, "browser", lambda: None)
    out = run("handout", "--lesson", "levels", "--out", tmp_path)
    assert out.code == 0
    assert "no browser here prints to PDF" in out.err
    page = (tmp_path / "index.html").read_text()
    assert page.count("<figure>") == 4
    assert '<a href="#levels">' in page
    assert "beforeprint" in page


def test_a_browser_that_fails_leaves_the_page(run, tmp_path, monkeypatch):
    from accelscope.core.evaluation.pages import lesson_page

    monkeypatch.setattr(lesson_page, "browser", lambda: "/bin/false")
    (tmp_path / "handout.pdf").write_text("an old one")
    out = run("handout", "--lesson", "levels", "--out", tmp_path)
    assert out.code == 1
    assert "1 lessons in" in out.out
    assert out.err.count("error:") == 1
    assert "print the page with another browser" in out.err
    assert (tmp_path / "index.html").is_file()
    assert not (tmp_path / "handout.pdf").exists()


def test_the_command_on_a_page_leads_back_to_it(run, tmp_path):
    page = tmp_path / "levels.html"
    run("lesson", "levels", "--page", page)
    assert "<code>accelscope lesson levels</code>" in page.read_text()
    words = ["levels", "sample:tetra:size=2", "--structure", "bvh:max_leaf_size=1", "--level", 2]
    run("lesson", *words, "--page", page)
    text = html.unescape(page.read_text().partition("<code>accelscope lesson ")[2])
    again = shlex.split(text.partition("</code>")[0])
    assert again[0] == "levels"
    assert again[1] == "sample:tetra:size=2"
    caption = run("lesson", *words).out.splitlines()[3]
    assert run("lesson", *again).out.splitlines()[3] == caption


def test_without_pillow_pictures_are_without_text(run, tmp_path, monkeypatch):
    from accelscope.core.evaluation.pages import lettering

    monkeypatch.setattr(lettering, "can_letter", lambda: False)
    out = run("lesson", "ray", "sample:tetra:size=2", "--pictures", tmp_path)
    assert out.code == 0
    assert "without text" in out.err
    assert (tmp_path / "ray-00.png").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["lesson", "none"], "there is no lesson 'none'; accelscope lessons lists them"),
        (["lesson", "radix_sor"], "perhaps radix_sort or radix_split is meant"),
        (["lesson", "levels", "--depth", "1"], "lesson levels has no setting 'depth'"),
        (["lesson", "levels", "--level"], "--level lacks its value"),
        (["lesson", "levels", "--level", "1", "--level=2"], "--level is given twice"),
        (["lesson", "levels", "--pic", "x"], "lesson levels has no setting 'pic'"),
        (["film", "levels", "--ou", "x"], "--out"),
        (["evaluate", "--level", "1"], "unrecognized arguments: --level"),
        (["lesson", "levels", "--level", "-1"], "level must be at least 0"),
        (["lesson", "levels", "--level", "x"], "level takes a whole number"),
        (["lesson", "levels", "a.obj", "b.obj"], "a lesson takes one SCENE, not 2"),
        (["lesson", "levels", "none.obj"], "none.obj"),
        (["lesson", "levels", "--structure", "grid"], "is no hierarchy of volumes"),
        (["lesson", "levels", "--pictures", ""], "--pictures names no folder"),
        (["lesson", "levels", "--page", ""], "--page names no file"),
        (["film", "levels"], "--out"),
        (["lesson", "levels", "--open-file"], "name at least one SCENE"),
    ],
)
def test_refusals(refused, arguments, said):
    assert said in refused(*arguments)


def test_an_output_does_not_overwrite_the_scene(refused, obj):
    mesh = obj()
    assert "overwrite" in refused("lesson", "levels", mesh, "--page", mesh)
