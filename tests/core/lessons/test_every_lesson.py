"""What every lesson promises: its place, its words, its pictures, and that every knob shows."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.lessons import lessons
from accelscope.core.lessons.lesson import Lesson
from accelscope.core.lessons.picture import MOST_SEGMENTS
from accelscope.core.lessons.slides import SLIDES
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.sample_scenes import make_sample

NAMES = list(lessons())


@functools.cache
def subject_of(name):
    lesson = lessons()[name]
    return lesson.subject(make_sample(lesson.sample))


@functools.cache
def played_once(name, key):
    """A lesson played with some of its knobs, which `key` has by name."""
    lesson = lessons()[name]
    return lesson.play(subject_of(name), lesson.Settings(**dict(key)), SILENT)


def played(name, settings):
    """A lesson played; knobs that play nothing anew have the same play, as they have on screen."""
    lesson = lessons()[name]
    return played_once(name, tuple(zip(lesson.replays, lesson.key(settings), strict=True)))


def picture_of(lesson: Lesson, settings):
    play = played(lesson.name, settings)
    return play.picture(play.within(settings))


def check_picture(picture):
    """Assert that a picture can be drawn and read."""
    count, n_faces = len(picture.segments), len(picture.faces)
    assert picture.segments.shape == (count, 2, 3)
    assert picture.colours.shape == (count, 4)
    assert picture.faces.shape == (n_faces, 3, 3)
    assert picture.face_colours.shape == (n_faces, 4)
    assert count <= MOST_SEGMENTS
    assert np.isfinite(picture.points()).all()
    for colours in (picture.colours, picture.face_colours):
        assert ((colours >= 0.0) & (colours <= 1.0)).all()
    assert picture.caption
    assert picture.caption == picture.caption.strip()
    assert not picture.caption.endswith(".")
    for mark in picture.marks:
        assert mark.text.strip()
        assert "\n" not in mark.text
    for row in picture.rows:
        assert row.label
        assert row.text
        assert not row.meaning.endswith(".")
    for image in picture.images:
        assert image.pixels.ndim == 3
        assert ((image.pixels >= 0.0) & (image.pixels <= 1.0)).all()


def values_of(lesson, play, field):
    """The ends of a knob and something between, or all choices."""
    meta = field.metadata
    if meta["choices"]:
        choices = list(meta["choices"])
        # Each that plays anew takes its time: the first, one between, and the last.
        some = sorted({0, len(choices) // 2, len(choices) - 1})
        return [choices[i] for i in some] if field.name in lesson.replays else choices
    if isinstance(field.default, bool):
        return [False, True]
    low, high = meta["minimum"], play.ends.get(field.name, meta["maximum"])
    assert low is not None, f"{lesson.name}: {field.name} has no minimum"
    assert high is not None, f"{lesson.name}: {field.name} has neither maximum nor end"
    if isinstance(field.default, tuple):
        return [field.default, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)]
    kind = type(field.default)
    return sorted({kind(low), kind(low + (high - low) / 2), kind(high)})


def looks_of(picture):
    """What one sees of a picture, to be compared."""
    return (
        picture.segments.tobytes(), picture.colours.tobytes(), picture.faces.tobytes(),
        picture.face_colours.tobytes(), tuple((m.text, tuple(m.position)) for m in picture.marks),
        tuple(image.pixels.tobytes() for image in picture.images),
    )  # fmt: skip


@pytest.mark.parametrize("name", NAMES)
def test_a_lesson_has_its_words(name):
    lesson = lessons()[name]
    assert name.isidentifier()
    assert lesson.slide in SLIDES
    for text in (lesson.label, lesson.begin, lesson.look_for, lesson.question, lesson.answer):
        assert text == text.strip()
        assert text
    assert not lesson.begin.endswith(".")
    assert lesson.question.endswith("?")
    knobs = [field.name for field in dataclasses.fields(lesson.Settings)]
    assert lesson.film in knobs
    assert set(lesson.replays) <= set(knobs)
    __import__(f"accelscope.core.{lesson.source}")


@pytest.mark.parametrize("name", NAMES)
def test_every_knob_changes_the_picture(name):
    """And pictures of one play do not depend on what was shown before."""
    lesson = lessons()[name]
    default = lesson.Settings()
    play = played(name, default)
    assert all(last >= 0 for last in play.ends.values())
    before = play.picture(play.within(default))
    check_picture(before)
    for settings in play.on_page(lesson, default):
        check_picture(picture_of(lesson, settings))
    for field in dataclasses.fields(lesson.Settings):
        # Where it has an effect only beside others, those are set so.
        beside = {
            other: condition[0]
            for other, condition in (field.metadata["only_for"] or {}).items()
            if not isinstance(condition, str)
        }
        looks = set()
        for value in values_of(lesson, play, field):
            settings = dataclasses.replace(default, **beside, **{field.name: value})
            picture = picture_of(lesson, settings)
            check_picture(picture)
            looks.add(looks_of(picture))
        assert len(looks) > 1, f"{field.name} changes nothing that one sees"
    assert looks_of(play.picture(play.within(default))) == looks_of(before)


class Stopped(Progress):
    """Stops whatever reports."""

    def report(self, done, total, text):
        raise Cancelled


@pytest.mark.parametrize("name", NAMES)
def test_a_play_reports_so_that_it_can_be_cancelled(name):
    lesson = lessons()[name]
    with pytest.raises(Cancelled):
        lesson.play(subject_of(name), lesson.Settings(), Stopped())


@pytest.mark.parametrize("name", [name for name in NAMES if lessons()[name].takes_ray])
def test_a_given_ray_is_the_one_that_is_shown(name):
    lesson = lessons()[name]
    subject, settings = subject_of(name), lesson.Settings()
    scene = subject.scene
    corners = np.stack([scene.lower, scene.upper])
    looks = set()
    for across in ((0.3, 0.4, 0.45), (0.7, 0.6, 0.55)):
        target = corners[0] + np.array(across) * (corners[1] - corners[0])
        origin = corners[0] - 0.2 * (corners[1] - corners[0])
        rays = Rays.from_arrays(origin[None], (target - origin)[None])
        play = lesson.play(dataclasses.replace(subject, rays=rays), settings, SILENT)
        pictures = [play.picture(each) for each in play.on_page(lesson, play.within(settings))]
        for picture in pictures:
            check_picture(picture)
        looks.add(tuple(looks_of(picture) for picture in pictures))
    assert len(looks) == 2
