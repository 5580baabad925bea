"""Heading, figures and caption are drawn, smaller where they must be, or a sentence says why not.

Text that is large twice, by Blender's scale and for a projector, has not left the viewport, nor has
it covered the caption; images have not been left out.
"""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy")

from accelscope.addon.drawing.labels import Room, meet
from accelscope.addon.drawing.texts import Screen
from accelscope.addon.drawing.words import (
    IMAGE_GAP,
    SMALLEST,
    TOO_SMALL,
    room_of_images,
    words_of,
)
from accelscope.core.lessons.picture import Image, Picture, Row

pytestmark = pytest.mark.bpy

CAPTION = "Step 7 of 12: what a caption says in a sentence or two about all that is drawn"
IMAGE = np.zeros((30, 40, 3))


def placed(size, width, height, n_rows, images=0, more=""):
    rows = tuple(Row(f"Figure {number}", f"{number} of {n_rows}{more}") for number in range(n_rows))
    picture = Picture(CAPTION, rows=rows, images=(Image("map", IMAGE),) * images)
    screen = Screen(size, (0.0, 0.0, 0.0))
    room = Room(50.0, 30.0, 50.0 + width, 30.0 + height)
    taken = []
    if images:
        taken.append(room_of_images(screen, picture.images, room))
    own, words = words_of(screen, picture, "A Heading", room, taken)
    return own, words, room, taken


@pytest.mark.parametrize("images", [0, 1, 2])
@pytest.mark.parametrize("size", [11.0, 19.0, 38.0])
@pytest.mark.parametrize("n_rows", [1, 7, 13])
def test_nothing_lies_on_anything(size, n_rows, images):
    own, words, room, taken = placed(size, 1000.0, 700.0, n_rows, images)
    places = [*words.heading, *words.figures, *words.caption]
    assert len(words.figures) == 2 * n_rows
    assert SMALLEST * size <= own.text_size <= size
    margin = 0.31 * own.text_size
    for number, place in enumerate(places):
        assert room.left - margin <= place.left < place.right <= room.right
        assert room.bottom - margin <= place.bottom < place.top <= room.top + margin
        # Backdrops of neighbouring lines may touch.
        assert not any(meet(place, other, -0.5) for other in places[:number])
        assert not any(meet(place, other, 0.0) for other in taken)


def test_text_is_as_large_as_it_is_asked_to_be_where_there_is_room():
    own, words, _, _ = placed(19.0, 1000.0, 700.0, 7)
    assert own.text_size == 19.0
    assert len(words.figures) == 14


@pytest.mark.parametrize(("width", "images"), [(600.0, 0), (1000.0, 2)])
def test_long_figures_end_before_the_edge_and_before_images(width, images):
    more = ", which is said in so many words that they reach from one side to the other"
    own, words, room, taken = placed(19.0, width, 700.0, 3, images, more)
    assert SMALLEST * 19.0 <= own.text_size < 19.0
    assert len(words.figures) == 6
    assert max(place.right for place in words.figures) <= room.right
    assert not any(meet(place, other, 0.0) for place in words.figures for other in taken)


def test_a_window_that_is_too_small_says_so():
    own, words, _, _ = placed(38.0, 500.0, 300.0, 30)
    assert own.text_size == SMALLEST * 38.0
    said = " ".join(text for text, *_ in own._texts)
    assert TOO_SMALL in said
    assert "Figure" not in said
    assert len(words.figures) >= 1


@pytest.mark.parametrize("height", [100.0, 300.0, 900.0])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_images_stand_inside(height, count):
    screen, room = Screen(19.0, (0.0, 0.0, 0.0)), Room(0.0, 0.0, 1000.0, height)
    place = room_of_images(screen, (Image("map", IMAGE),) * count, room)
    names = count * (2.0 * 19.0 + IMAGE_GAP)
    assert place.top == pytest.approx(place.bottom + 0.75 * count * (1000.0 - place.left) + names)
    if names < height:
        assert place.top <= height + 1e-9
    assert place.left >= 640.0
