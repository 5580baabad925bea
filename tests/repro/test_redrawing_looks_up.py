"""What panel and overlay ask at every redraw is looked up, however many cells there are.

Lines and faces are prepared once, in the job.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from accelscope.addon.drawing import selection, shown
from accelscope.addon.drawing.drawable import TEXTURE_WIDTH, make_drawable
from accelscope.core.contract.cells import NEVER, Cells
from accelscope.core.printing import show_integer
from accelscope.core.settings import parse, parse_spec
from accelscope.core.structures import structure_named
from accelscope.sample_scenes import make_sample

TREES = (
    "kdtree", "kdtree:order=fifo,planes=longest", "octree", "octree:planes=adaptive", "bsp",
    "bsp:planes=fixed",
)  # fmt: skip


def display(**changed):
    settings = {
        "show": True, "depth_min": 0, "depth_max": 1000, "leaves_only": False,
        "hide_empty": True, "tint_empty": False, "planes": False,
        "opacity": 1.0, "line_width": 1.0, "colour_by": "depth",
    }  # fmt: skip
    return SimpleNamespace(**(settings | changed))


def cells_of(spec, scene="suzanne"):
    name, texts = parse_spec(spec)
    structure = structure_named(name)
    settings = parse(structure.Settings, texts, spec)
    return structure.build(make_sample(scene), settings, log=True).cells()


def binary_tree(levels):
    """Return the cells of a full binary tree, built level by level; every third leaf is empty."""
    n = 2**levels - 1
    number = np.arange(n)
    depth = np.floor(np.log2(number + 1)).astype(int)
    is_leaf = depth == levels - 1
    count = np.where(is_leaf & (number % 3 > 0), 2, 0)
    order = (number + 1) // 2
    divided = np.where(is_leaf, NEVER, number + 1)
    boxes = np.random.default_rng(1).random((n, 6))
    return Cells.sorted_by_depth(boxes, depth, is_leaf, count, {"order": order}, replaced=divided)


def ask(drawable, settings):
    """Ask what a redraw asks."""
    extent, sections = drawable.extent, drawable.sections
    selection.colour_maximum(extent, settings)
    shown.in_words(drawable, settings)
    selection.drawn_runs(sections, settings)
    for faces in (drawable.plane_faces, drawable.empty_faces):
        selection.depth_run(faces.depth, settings)
        faces.areas.total(settings.depth_min, settings.depth_max)


def test_a_redraw_of_a_million_cells_looks_at_as_few_numbers_as_one_of_a_thousand(counter):
    settings = display(leaves_only=True, tint_empty=True)

    def numbers(levels):
        drawable = counter.wrap(make_drawable(binary_tree(levels)))
        # Arrays are counted: going through all cells would be seen.
        assert counter.numbers(lambda: selection.visible(drawable.cells, settings)) >= 2**levels
        return counter.numbers(lambda: ask(drawable, settings))

    assert numbers(20) == numbers(10) < 2**10 / 2


@pytest.mark.parametrize("leaves_only", [False, True])
@pytest.mark.parametrize("hide_empty", [False, True])
@pytest.mark.parametrize("spec", ["kdtree", "octree", "bsp:planes=fixed"])
def test_numbers_are_those_of_going_through_all(spec, leaves_only, hide_empty):
    cells = cells_of(spec)
    drawable = make_drawable(cells)
    deepest = int(cells.depth.max())
    for low, high in ((0, deepest), (2, 5), (deepest, deepest), (deepest + 1, 1000), (4, 2)):
        settings = display(
            depth_min=low, depth_max=high, leaves_only=leaves_only, hide_empty=hide_empty
        )
        visible = selection.visible(cells, settings)
        runs = selection.runs(drawable.sections, settings)
        drawn = np.concatenate([drawable.sections.order[slice(*run)] for run in runs])
        np.testing.assert_array_equal(np.sort(drawn), np.flatnonzero(visible))
        assert selection.colour_maximum(drawable.extent, settings) == min(deepest, high)


@pytest.mark.parametrize("spec", TREES)
def test_a_cell_is_divided_when_its_children_are_made(spec):
    """An independent witness: the cells of a step fill the cell one level above with their box."""
    cells = cells_of(spec)
    order = cells.extra["order"]
    assert (cells.replaced[cells.is_leaf] == NEVER).all()
    inner = np.flatnonzero(~cells.is_leaf)
    assert len(inner) > 20
    assert (cells.replaced[inner] > order[inner]).all()
    assert len(np.unique(cells.replaced[inner])) == len(inner)
    for place in inner[:: max(len(inner) // 200, 1)]:
        made = np.flatnonzero(order == cells.replaced[place])
        assert (cells.depth[made] == cells.depth[place] + 1).all()
        low, high = cells.boxes[made, :3].min(axis=0), cells.boxes[made, 3:].max(axis=0)
        size = (cells.boxes[0, 3:] - cells.boxes[0, :3]).max()
        around = np.concatenate([low, high])
        np.testing.assert_allclose(around, cells.boxes[place], atol=1e-6 * size)


@pytest.mark.parametrize(
    "spec", ["bvh", "bvh:volume=kdop26", "bvh:volume=sphere", "bvh:volume=obb", "bsp", "kdtree"]
)
def test_what_is_drawn_is_bounded_and_said(spec, monkeypatch):
    cells = cells_of(spec)
    whole = make_drawable(cells)
    assert len(whole.sections.order) == len(cells)
    monkeypatch.setattr(selection, "MAXIMUM_HELD", 300)
    monkeypatch.setattr(selection, "MAXIMUM_CORNERS", 2500)
    some = make_drawable(cells)
    kept = len(some.sections.order)
    assert kept <= 300
    assert int(some.edges.starts[-1]) <= 2500
    assert f"of {show_integer(len(cells))} cells (at most {kept} are kept)" in (
        shown.in_words(some, display(hide_empty=False))
    )
    # Every kind keeps those nearest to the root.
    first = 0
    for end, part in zip(some.sections.ends, (cells.is_leaf, ~cells.is_leaf), strict=False):
        places = some.sections.order[first:end]
        nonempty = part & ((cells.count > 0) | ~cells.is_leaf)
        np.testing.assert_array_equal(places, np.flatnonzero(nonempty)[: len(places)])
        first = end


def test_no_texture_is_larger_than_any_card_can_hold():
    """OpenGL 4.1 and later promise 16384 texels; ours have rows of 4092."""
    assert TEXTURE_WIDTH <= 16384
    for texels in (2 * selection.MAXIMUM_HELD, 2 * selection.MAXIMUM_CORNERS):
        assert -(-texels // TEXTURE_WIDTH) <= 16384


def test_boxes_around_shapes_are_said(monkeypatch):
    from accelscope.core.structures.bvh import hierarchy

    monkeypatch.setattr(hierarchy, "MOST_SHAPES", 50)
    drawable = make_drawable(cells_of("bvh:volume=kdop14"))
    text = shown.in_words(drawable, display())
    assert text.endswith(
        "; the 50 nearest to the root in their shape, deeper ones as the boxes around them"
    )
    assert "shape" not in shown.in_words(make_drawable(cells_of("bvh")), display())
    n_boxes, n_edges = int(drawable.boxes.starts[-1]), int(drawable.edges.starts[-1])
    assert n_boxes == len(drawable.cells) - 50
    assert n_edges > 50 * 6
