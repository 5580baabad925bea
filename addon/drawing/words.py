"""Where words and images of a lesson's picture stand on the screen: none lies on another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .labels import Room, meet
from .texts import Screen

if TYPE_CHECKING:  # only the types: their module brings Numba in
    from ...core.lessons.picture import Image, Picture, Row

IMAGE_SHARE = 0.36
"""Width of an image, as a share of the viewport's, where its height allows that."""

IMAGE_GAP = 4.0
"""Pixels between an image and its name."""

SMALLEST = 0.5
"""How much smaller words become where they would not fit otherwise."""

TOO_SMALL = "The viewport is too small for the figures: they are in the panel"


class Words(NamedTuple):
    """Where heading, figures and caption stand."""

    heading: list[Room]
    figures: list[Room]
    caption: list[Room]

    def fit(self, room: Room, taken: Sequence[Room]) -> bool:
        """Say whether they are inside a room, and neither on each other nor on what is taken."""
        above = [*self.heading, *self.figures]
        floor = max([room.bottom, *(each.top for each in self.caption)])
        is_inside = all(each.bottom >= floor and each.right <= room.right for each in above)
        return is_inside and not any(meet(one, other, 0.0) for one in above for other in taken)


def room_of_images(screen: Screen, images: Sequence[Image], room: Room) -> Room:
    """Return the lower right corner of a room, where images stand one above the other.

    As wide as all of them with their names are no higher than the room.
    """
    shapes = sum(image.pixels.shape[0] / image.pixels.shape[1] for image in images)
    names = len(images) * (2.0 * screen.text_size + IMAGE_GAP)
    width = min(IMAGE_SHARE * (room.right - room.left), (room.top - room.bottom - names) / shapes)
    width = max(width, 1.0)
    return room._replace(left=room.right - width, top=room.bottom + width * shapes + names)


def words_of(
    screen: Screen, picture: Picture, heading: str, room: Room, taken: Sequence[Room]
) -> tuple[Screen, Words]:
    """Return heading, figures and caption on a screen of their own: smaller where they must be.

    Parameters
    ----------
    screen : Screen
        Of the size that they have where there is room.
    taken : sequence of Room
        Where images are, in the lower right corner.
    """
    for size in np.linspace(1.0, SMALLEST, 11):
        own = Screen(size * screen.text_size, screen.behind)
        words = _add_words(own, heading, picture.rows, picture.caption, room, taken)
        if words.fit(room, taken):
            return own, words
    own = Screen(SMALLEST * screen.text_size, screen.behind)
    words = _add_words(own, heading, (), picture.caption, room, taken)
    top = min([room.top, *(each.bottom for each in words.heading)]) - own.line
    lines = own.in_lines(TOO_SMALL, room.right - room.left)
    figures = [own.add(text, room.left, top - n * own.line) for n, text in enumerate(lines)]
    return own, words._replace(figures=figures)


def _add_words(
    screen: Screen, heading: str, rows: Sequence[Row], caption: str, room: Room,
    taken: Sequence[Room],
) -> Words:  # fmt: skip
    """Add heading and figures at the upper left, the caption below."""
    above, figures, top = [], [], room.top - screen.text_size
    if heading:
        above.append(screen.add(heading, room.left, top))
        top -= 1.3 * screen.line
    across = max((screen.size_of(row.label)[0] for row in rows), default=0.0) + screen.text_size
    for row in rows:
        figures.append(screen.add(row.label, room.left, top))
        figures.append(screen.add(row.text, room.left + across, top))
        top -= screen.line
    right = min([room.right, *(each.left - screen.text_size for each in taken)])
    lines = screen.in_lines(caption, right - room.left)
    below = [
        screen.add(text, room.left, room.bottom + number * screen.line)
        for number, text in enumerate(reversed(lines))
    ]
    return Words(above, figures, below)
