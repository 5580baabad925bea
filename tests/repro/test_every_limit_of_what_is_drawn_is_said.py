"""Where fewer cells are drawn than are asked for, every reason is said."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")

from accelscope.addon.drawing import selection, shown
from accelscope.addon.drawing.drawable import make_drawable
from accelscope.core.contract.cells import Cells

pytestmark = pytest.mark.bpy

DISPLAY = SimpleNamespace(
    depth_min=0, depth_max=100, leaves_only=False, hide_empty=False, tint_empty=False,
    planes=False, colour_by="depth",
)  # fmt: skip


@pytest.mark.parametrize(
    ("held", "drawn", "said"),
    [
        (1000, 1000, "showing 200 of 200 cells"),
        (150, 1000, "showing 150 of 200 cells (at most 150 are kept)"),
        (1000, 60, "showing 60 of 200 cells (at most 60 are drawn)"),
        (150, 60, "showing 60 of 200 cells (at most 150 are kept, 60 are drawn)"),
        (60, 60, "showing 60 of 200 cells (at most 60 are kept)"),
    ],
)
def test_both_limits(monkeypatch, held, drawn, said):
    monkeypatch.setattr(selection, "MAXIMUM_HELD", held)
    monkeypatch.setattr(selection, "MAXIMUM_DRAWN", drawn)
    boxes = np.tile([0.0, 0, 0, 1, 1, 1], (200, 1))
    ones = np.ones(200, dtype=np.int32)
    cells = Cells.sorted_by_depth(boxes, ones, ones > 0, ones)
    assert shown.in_words(make_drawable(cells), DISPLAY) == said
