"""Numbers of the panel have spaces between thousands: no line ends at one of them."""

import pytest
from accelscope.addon.results.wording import in_lines

CAPTION = "16 nodes; grey: 8 065 leaves above; drawn: 1 666 volumes"


@pytest.mark.parametrize("characters", range(16, 60))
def test_every_width(characters):
    lines = in_lines(CAPTION, characters)
    assert " ".join(lines) == CAPTION
    assert all(len(line) <= characters for line in lines)
    for number in ("8 065", "1 666"):
        assert sum(number in line for line in lines) == 1


def test_numbers_beside_each_other():
    assert in_lines("in frame 100 of 2 000 000", 16) == ["in frame 100 of", "2 000 000"]
    assert in_lines("level 18 1000 nodes", 8) == ["level 18", "1000", "nodes"]
    assert in_lines("of 1 000 000 000 000 cells", 16) == ["of", "1 000 000 000 000", "cells"]


def test_nothing_to_say():
    assert in_lines("", 16) == [""]
