"""Which cells the display settings show, in words too; the overlay is switched on and off."""

from __future__ import annotations

import gc
import weakref
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("gpu")

import bpy
from accelscope.addon.drawing import overlay, selection
from overlay_canvas import display, make_cells, random_cells, set_cells

pytestmark = pytest.mark.usefixtures("clean_overlay")


@pytest.mark.parametrize("leaves_only", [False, True])
@pytest.mark.parametrize("hide_empty", [False, True])
@pytest.mark.parametrize("depths", [(0, 100), (3, 7), (5, 5), (7, 3), (11, 11), (12, 90), (0, 0)])
def test_runs_are_the_visible_cells(leaves_only, hide_empty, depths):
    cells = random_cells(700)
    settings = display(
        depth_min=depths[0], depth_max=depths[1], leaves_only=leaves_only, hide_empty=hide_empty
    )
    sections = selection.sections_of(cells)
    runs = selection.drawn_runs(sections, settings)
    drawn = np.concatenate([sections.order[first:last] for first, last in runs])
    np.testing.assert_array_equal(
        np.sort(drawn), np.flatnonzero(selection.visible(cells, settings))
    )
    assert len(runs) == 3  # draw calls, whatever the cells


def test_shown_text():
    settings = display(depth_max=1)
    assert overlay.shown_text(settings) == "no cells"
    set_cells(make_cells(np.zeros((4096, 6)), depth=(np.arange(4096) >= 1203) * 2))
    assert overlay.shown_text(settings) == "showing 1 203 of 4 096 cells"
    set_cells(make_cells(np.zeros((0, 6))))
    assert overlay.shown_text(settings) == "showing 0 of 0 cells"


def test_too_many_cells_are_cut_in_order_of_importance(monkeypatch):
    cells = random_cells(1000)
    leaves = int((cells.is_leaf & (cells.count > 0)).sum())
    inner = int((~cells.is_leaf).sum())
    monkeypatch.setattr(selection, "MAXIMUM_DRAWN", leaves + 10)
    set_cells(cells)
    runs = selection.drawn_runs(selection.sections_of(cells), display())
    assert [last - first for first, last in runs] == [leaves, 10, 0]
    assert (
        overlay.shown_text(display())
        == f"showing {leaves + 10} of 1 000 cells (at most {leaves + 10} are drawn)"
    )
    assert "most" not in overlay.shown_text(display(leaves_only=True, hide_empty=True))

    monkeypatch.setattr(selection, "MAXIMUM_HELD", leaves + inner + 5)
    # There the empty leaves find room, and what they leave is halved.
    sections, empty = selection.sections_of(cells), 1000 - leaves - inner
    half = (leaves + inner + 5 - empty) // 2
    ends = np.cumsum([leaves + inner + 5 - empty - half, half, empty])
    assert sections.ends.tolist() == ends.tolist()
    set_cells(cells)
    assert overlay.shown_text(display(hide_empty=True)).endswith(
        f"of 1 000 cells (at most {leaves + inner + 5} are kept, {leaves + 10} are drawn)"
    )


def test_enable_and_disable_are_idempotent():
    overlay.enable()
    handler = overlay._overlay.handler
    overlay.enable()
    assert overlay._overlay.handler is handler
    overlay.disable()
    overlay.disable()
    assert overlay._overlay.handler is None
    overlay.tag_redraw()


def test_disable_lets_go_of_the_cells():
    cells = random_cells(10)
    alive = weakref.ref(cells)
    set_cells(cells)
    del cells
    gc.collect()
    assert alive() is not None
    overlay.disable()
    gc.collect()
    assert alive() is None


def fake_blender(monkeypatch, settings, show_overlays=True):
    context = SimpleNamespace(
        scene=SimpleNamespace(accelscope=SimpleNamespace(display=settings), session_uid=1),
        space_data=SimpleNamespace(overlay=SimpleNamespace(show_overlays=show_overlays)),
        preferences=SimpleNamespace(system=SimpleNamespace(pixel_size=2.0)),
        window_manager=SimpleNamespace(windows=[]),
    )
    monkeypatch.setattr(overlay, "bpy", SimpleNamespace(context=context, types=bpy.types))
    return context


def test_callback_honours_show_overlays_and_missing_properties(monkeypatch):
    drawn = []
    settings = display()
    monkeypatch.setattr(overlay, "draw", lambda *arguments: drawn.append(arguments))
    fake_blender(monkeypatch, settings, show_overlays=False)
    overlay._draw_callback()
    context = fake_blender(monkeypatch, settings)
    overlay._draw_callback()
    del context.scene.accelscope  # the extension is being disabled
    overlay._draw_callback()
    assert drawn == [(settings, 2.0, True)]


def test_a_failure_is_reported_once_and_switches_off(monkeypatch, capsys):
    def fail(*arguments):
        raise RuntimeError("no graphics card today")

    monkeypatch.setattr(overlay, "draw", fail)
    fake_blender(monkeypatch, display())
    overlay.enable()
    for _ in range(3):
        overlay._draw_callback()
    assert capsys.readouterr().err.count("Error: no graphics card today") == 1
    set_cells(random_cells(3))  # something new to show: another attempt
    overlay._draw_callback()
    assert capsys.readouterr().err.count("Error: no graphics card today") == 1


def test_a_few_levels_take_the_whole_ramp():
    cells = make_cells(np.zeros((9, 6)), depth=np.arange(9), count=np.arange(9))
    extent = selection.extent_of(cells)
    assert selection.colour_maximum(extent, display()) == 8
    assert selection.colour_maximum(extent, display(depth_max=3)) == 3
    assert selection.colour_maximum(extent, display(depth_max=3, colour_by="count")) == 8
    assert (
        selection.colour_maximum(selection.extent_of(make_cells(np.zeros((0, 6)))), display()) == 0
    )
