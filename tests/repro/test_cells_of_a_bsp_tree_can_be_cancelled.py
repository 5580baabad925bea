"""Cutting out the cells of a BSP tree reports as it goes, and gives the same in pieces."""

from __future__ import annotations

import numpy as np
import pytest
from accelscope.core.lessons.lesson import build
from accelscope.core.progress import Cancelled, Progress
from accelscope.core.structures.bsp import cells as bsp_cells
from accelscope.sample_scenes import make_sample


class StopsAt(Progress):
    """Stops at a report of cells."""

    def __init__(self, number):
        self.left = number

    def report(self, done, total, text):
        if text == "Cutting out cells":
            self.left -= 1
            if self.left < 0:
                raise Cancelled


@pytest.fixture(scope="module")
def tree():
    return build(make_sample("suzanne:subdivisions=0"), "bsp:max_depth=9")


def test_cells_in_pieces_are_the_same(tree, monkeypatch):
    whole = tree.cells()
    monkeypatch.setattr(bsp_cells, "AT_ONCE", 7)
    pieces = tree.cells()
    assert len(whole) > 100
    for name in ("boxes", "numbers", "areas"):
        assert getattr(whole, name).tobytes() == getattr(pieces, name).tobytes()
    for name in ("faces", "planes"):
        for a, b in zip(getattr(whole, name), getattr(pieces, name), strict=True):
            np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("number", [0, 3])
def test_a_stop_is_noticed_on_the_way(tree, monkeypatch, number):
    monkeypatch.setattr(bsp_cells, "AT_ONCE", 50)
    with pytest.raises(Cancelled):
        tree.cells(StopsAt(number))
