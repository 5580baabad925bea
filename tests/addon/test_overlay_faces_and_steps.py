"""The overlay draws polyhedra, planes and empty leaves, and colours by the steps of building."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

pytest.importorskip("bpy")
pytest.importorskip("gpu")

from accelscope.addon.drawing import overlay, selection
from accelscope.core.colours import EMPTY_TINT, INNER_COLOUR, depth_colours, face_opacity, ramp
from accelscope.core.contract.cells import NEVER, Cells, Polygons, rectangles
from overlay_canvas import (
    FROM_FRONT,
    HEIGHT,
    WIDTH,
    display,
    distances,
    look_at,
    make_cells,
    orthographic,
    pixel,
    row_of_boxes,
    set_cells,
)

pytestmark = pytest.mark.usefixtures("clean_overlay")


def prisms():
    """Return the two halves of a cube, cut along a diagonal plane."""
    low = [(-1, -1), (1, -1), (1, 1)]
    high = [(-1, -1), (1, 1), (-1, 1)]
    lists = []
    for base in (low, high):
        floor = [(*corner, -1) for corner in base]
        roof = [(*corner, 1) for corner in base]
        sides = [[floor[i - 1], floor[i], roof[i], roof[i - 1]] for i in range(3)]
        lists += [floor, roof, *sides]
    offsets = np.concatenate([[0], np.cumsum([len(points) for points in lists])])
    faces = Polygons(np.concatenate(lists).astype(float), offsets, np.repeat([0, 1], 5))
    boxes = np.tile((-1.0, -1, -1, 1, 1, 1), (2, 1))
    return boxes, faces


def edges_of_prism(faces, owner):
    polygons = np.split(faces.points, faces.offsets[1:-1])
    return np.array(
        [(face[i - 1], face[i]) for face, of in zip(polygons, faces.owners) if of == owner
         for i in range(len(face))]
    )  # fmt: skip


def test_polyhedra_are_drawn_as_what_they_are(canvas):
    boxes, faces = prisms()
    # The second is deeper but fuller: sections turn the order around.
    cells = Cells.sorted_by_depth(
        boxes, np.array([0, 1]), np.array([True, True]), np.array([0, 3]), faces=faces
    )
    set_cells(cells)
    view = look_at((4, -6, 3), (0, 0, 0))
    before = overlay.uploads()
    for owner in (0, 1):
        settings = display(depth_min=owner, depth_max=owner, colour_by="count", line_width=3.0)
        light = canvas.draw(settings, view).max(axis=2)
        distance = distances(edges_of_prism(faces, owner), view)
        assert light[distance > 0.71 * 3.0 + 1.0].max() == 0.0
        # Edges of empty leaves are faint.
        assert light[distance < 0.9].min() > (0.2 if owner == 0 else 0.7)
    assert overlay.uploads() == before + 1


def test_empty_leaves_are_tinted(canvas):
    boxes = row_of_boxes(4)
    depth = np.array([1, 1, 2, 2])
    set_cells(make_cells(boxes, depth, np.array([1, 1, 1, 0]), np.array([0, 2, 0, 0])))
    settings = display(tint_empty=True, hide_empty=True, opacity=0.8)
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    before = overlay.uploads()
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    x, y, z = (boxes[0, 3:] - boxes[0, :3]).tolist()
    area = 2 * 2 * (x * y + y * z + z * x)
    width, (y, z) = boxes[3, 3] - boxes[0, 0], (y, z)
    around = 2 * (width * y + y * z + z * width)
    alpha = face_opacity(area, around, overlay.TINT_COVER * 0.8)
    # Through the front and the back.
    tint = (1.0 - (1.0 - alpha) ** 2) * np.array(EMPTY_TINT)
    for place, expected in zip(middle, (tint, 0 * tint, tint, 0 * tint)):
        np.testing.assert_allclose(pixel(picture, place, 0.0), expected, atol=0.01)

    deeper = canvas.draw(display(tint_empty=True, depth_min=2), FROM_FRONT, orthographic())
    assert pixel(deeper, middle[0], 0.0).max() == 0.0
    assert pixel(deeper, middle[2], 0.0).max() > 0.1
    assert overlay.uploads() == before


def cells_with_planes():
    """Return a row of four inner nodes, each cut by an upright plane that faces the viewer."""
    boxes = row_of_boxes(4)
    corners = np.stack(
        [boxes[:, [0, 1, 2]], boxes[:, [3, 1, 2]], boxes[:, [3, 1, 5]], boxes[:, [0, 1, 5]]], axis=1
    )
    depth = np.array([0, 1, 2, 3])
    nothing = np.zeros(4, dtype=np.int32)
    planes = rectangles(corners, np.arange(4))
    return boxes, Cells.sorted_by_depth(boxes, depth, nothing == 1, nothing, planes=planes)


@pytest.mark.parametrize("colour_by", ["depth", "count"])
def test_planes_are_drawn_within_their_cells(canvas, colour_by):
    boxes, cells = cells_with_planes()
    set_cells(cells)
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    settings = display(planes=True, leaves_only=True, depth_max=3, colour_by=colour_by)
    picture = canvas.draw(settings, FROM_FRONT, orthographic())
    before = overlay.uploads()
    colours = depth_colours(cells.depth, 3) if colour_by == "depth" else [INNER_COLOUR] * 4
    alpha = pixel(picture, middle[0], 0.0).max() / max(colours[0])
    assert 0.05 < alpha < overlay.PLANE_COVER + 0.01
    for place, colour in zip(middle, colours):
        seen = pixel(picture, place, 0.0)
        np.testing.assert_allclose(seen, np.array(colour) * alpha, atol=0.01)
        assert pixel(picture, place, 0.35).max() == 0.0
    assert pixel(picture, 0.5 * (boxes[0, 3] + boxes[1, 0]), 0.0).max() == 0.0
    # They have outlines.
    settings.line_width = 5.0
    outlined = canvas.draw(settings, FROM_FRONT, orthographic())
    assert pixel(outlined, middle[1], 0.34).max() > 0.1

    some = canvas.draw(
        display(planes=True, leaves_only=True, depth_min=1, depth_max=2), FROM_FRONT, orthographic()
    )
    shown = [pixel(some, place, 0.0).max() > 0.02 for place in middle]
    assert shown == [False, True, True, False]
    without = canvas.draw(display(leaves_only=True), FROM_FRONT, orthographic())
    assert without.max() == 0.0
    assert overlay.uploads() == before


def stepped_cells():
    """Return a row of boxes: four cells in the order in which they are made, and divided.

    Each is divided by the next step into the next one, as far as boxes go: same box one level down.
    """
    boxes = row_of_boxes(4)
    order = np.array([0, 1, 2, 3], dtype=np.int32)
    return boxes, Cells.sorted_by_depth(
        np.concatenate([boxes, boxes[:3]]),
        np.array([0, 0, 0, 0, 1, 1, 1]),
        np.array([False, False, False, True, True, True, True]),
        np.array([0, 0, 0, 5, 2, 2, 2]),
        {"order": np.concatenate([order, order[:3] + 4])},
        replaced=np.concatenate([order[:3] + 4, np.full(4, NEVER)]),
    )


def test_colours_by_order(canvas):
    boxes, cells = stepped_cells()
    set_cells(cells)
    x = (boxes[:, 0] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    for depth, steps in ((0, np.arange(4)), (1, np.arange(4, 7))):
        settings = display(colour_by="order", line_width=5.0, depth_min=depth, depth_max=depth)
        row = canvas.draw(settings, FROM_FRONT, orthographic())[HEIGHT // 2, x.astype(int)]
        np.testing.assert_allclose(row[: len(steps)], ramp(steps / 6), atol=0.012)
    plain = make_cells(boxes, depth=np.arange(4))
    extent = selection.extent_of(plain)
    assert selection.coloured_by(extent, display(colour_by="order")) == "depth"


def test_planes_have_the_colour_of_the_step_that_cuts_their_cell(canvas):
    boxes, cells = stepped_cells()
    corners = np.stack(
        [boxes[:, [0, 1, 2]], boxes[:, [3, 1, 2]], boxes[:, [3, 1, 5]], boxes[:, [0, 1, 5]]], axis=1
    )
    cells = dataclasses.replace(cells, planes=rectangles(corners[:3], np.arange(3)))
    set_cells(cells)
    # Leaves lie one level down: what is seen of the first are outlines of planes.
    settings = display(
        planes=True, leaves_only=True, colour_by="order", depth_max=0, line_width=5.0
    )
    x = (boxes[:3, 0] / (2.0 * WIDTH / HEIGHT) + 1.0) * 0.5 * WIDTH
    row = canvas.draw(settings, FROM_FRONT, orthographic())[HEIGHT // 2, x.astype(int)]
    np.testing.assert_allclose(row, ramp(np.arange(4, 7) / 6), atol=0.012)


def test_a_hundred_thousand_empty_leaves_are_a_tint_of_the_first(monkeypatch, canvas):
    monkeypatch.setattr(selection, "MAXIMUM_FILLED", 3)
    boxes = row_of_boxes(4)
    set_cells(make_cells(boxes, depth=np.arange(4), count=0))
    picture = canvas.draw(display(tint_empty=True, hide_empty=True), FROM_FRONT, orthographic())
    middle = 0.5 * (boxes[:, 0] + boxes[:, 3])
    assert [pixel(picture, place, 0.0).max() > 0.02 for place in middle] == [True] * 3 + [False]
