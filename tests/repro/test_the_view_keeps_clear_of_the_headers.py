"""What a viewport is moved to show is not behind its headers, toolbar or sidebar."""

from types import SimpleNamespace

import pytest

pytestmark = pytest.mark.bpy

LENS = 50.0


def region(kind, alignment, x, y, width, height):
    return SimpleNamespace(type=kind, alignment=alignment, x=x, y=y, width=width, height=height)


def pixels(regions):
    """Return how many pixels are used to the left and right of the middle, below and above it."""
    from accelscope.addon.drawing.viewport import VIEW_SENSOR, slopes_of
    from accelscope.core.evaluation.pages.picture_cameras import MARGIN

    window = region("WINDOW", "NONE", 100, 50, 1000, 800)
    slopes = slopes_of(SimpleNamespace(regions=[window, *regions]), LENS)
    per_pixel = MARGIN * 2 * VIEW_SENSOR / LENS / 1000
    return tuple(slope / per_pixel for pair in slopes for slope in pair)


def test_alone(bpy):
    assert pixels([]) == pytest.approx((500, 500, 400, 400))


def test_header_and_tool_settings_one_below_the_other(bpy):
    header = region("HEADER", "TOP", 100, 824, 1000, 26)
    settings = region("TOOL_HEADER", "TOP", 100, 798, 1000, 26)
    assert pixels([header, settings]) == pytest.approx((500, 500, 400, 348))
    assert pixels([settings, header]) == pytest.approx((500, 500, 400, 348))


def test_a_header_at_the_bottom(bpy):
    assert pixels([region("HEADER", "BOTTOM", 100, 50, 1000, 26)])[2:] == pytest.approx((374, 400))


def test_toolbar_and_sidebar_on_either_side(bpy):
    toolbar = region("TOOLS", "LEFT", 100, 50, 60, 750)
    sidebar = region("UI", "RIGHT", 800, 50, 300, 750)
    assert pixels([toolbar, sidebar])[:2] == pytest.approx((440, 200))
    toolbar.alignment, sidebar.alignment = "RIGHT", "LEFT"
    toolbar.x, sidebar.x = 1040, 100
    assert pixels([toolbar, sidebar])[:2] == pytest.approx((200, 440))


def test_what_stands_beside_the_window_floats_or_is_hidden_covers_nothing(bpy):
    regions = [
        region("HEADER", "TOP", 100, 850, 1000, 26),
        region("UI", "RIGHT", 1100, 50, 300, 800),
        region("HUD", "FLOAT", 110, 60, 200, 100),
        region("TOOLS", "LEFT", 0, 0, 1, 1),
    ]
    assert pixels(regions) == pytest.approx((500, 500, 400, 400))
