"""validate() is empty for whatever is built, and finds planted damage."""

import re

import numpy as np
import pytest
from accelscope.core.contract.cells import OBJECT
from accelscope.core.contract.protocols import Linked
from accelscope.core.geometry.box import Boxes
from accelscope.core.structures import structures


def test_everything_built_is_sound(lab, build, variant, scene_name):
    name, text = variant
    assert build(name, lab.small_scene(scene_name), text).validate() == []


def test_cells_and_statistics_agree(lab, build, variant):
    name, text = variant
    structure = build(name, lab.small_scene("soup"), text)
    cells, figures = structure.cells(), structure.statistics()
    assert cells.is_leaf.sum() == figures.N_V
    assert (~cells.is_leaf).sum() == figures.N_IN
    assert (cells.count[cells.is_leaf] == 0).sum() == figures.N_EV
    assert cells.count.sum() == figures.N_OIV
    assert figures.max_depth == cells.depth.max()
    assert (np.diff(cells.depth) >= 0).all()
    # Those of a routed structure take turns if a part may get more.
    take_turns = "part" in cells.extra and structure.made() is not None
    numbers = np.sort(cells.numbers)
    assert (np.diff(numbers) > 0).all() if take_turns else (numbers == np.arange(len(cells))).all()
    assert (cells.boxes[:, :3] <= cells.boxes[:, 3:]).all()
    assert {len(values) for values in cells.attributes().values()} == {len(cells)}
    assert cells.space == OBJECT
    check_parents(cells)
    of_arrays = sum(array.nbytes for array in arrays_in(structure.arrays))
    # It may keep what its cells are made of, and the structures of meshes.
    of_meshes = any(counter.level for counter in structure.counters)
    if structure.made() is not None or of_meshes:
        assert structure.memory() >= of_arrays
    else:
        assert structure.memory() == of_arrays
    assert structure.memory() > 0
    for array in arrays_in((structure.arrays, structure.geometry)):
        assert array.flags.c_contiguous


def check_parents(cells):
    """Assert that all cells but the roots have a parent, one level up and around them."""
    place = np.empty(int(cells.numbers.max()) + 1, dtype=np.int64)
    place[cells.numbers] = np.arange(len(cells))
    below = np.flatnonzero(cells.parents >= 0)
    above = place[cells.parents[below]]
    assert np.array_equal(np.flatnonzero(cells.parents < 0), np.flatnonzero(cells.depth == 0))
    assert (cells.depth[below] == cells.depth[above] + 1).all()
    assert np.array_equal(np.unique(above), np.flatnonzero(~cells.is_leaf))
    if cells.faces is None:  # boxes around other volumes may stick out of those above
        assert (cells.boxes[below, :3] >= cells.boxes[above, :3]).all()
        assert (cells.boxes[below, 3:] <= cells.boxes[above, 3:]).all()


def arrays_in(record):
    """The arrays of a record, and of the records in it."""
    for value in record:
        if isinstance(value, np.ndarray):
            yield value
        elif isinstance(value, tuple):
            yield from arrays_in(value)


def test_boxes_of_a_tree_are_tight(lab, build, scene_name):
    scene = lab.small_scene(scene_name)
    for name, low, high in (("bvh", scene.lower, scene.upper), ("naive", scene.lower, scene.upper)):
        cells = build(name, scene).cells()
        root = cells.boxes[cells.depth == 0][0]
        assert np.array_equal(root, np.concatenate([low, high]))


def damaged(structure, **changes):
    structure.arrays = structure.arrays._replace(**changes)
    return structure


def swap_last(array):
    out = array.copy()
    out[[-1, -2]] = out[[-2, -1]]
    return out


def changed(array, index, value):
    out = array.copy()
    out[index] = value
    return out


@pytest.mark.parametrize(
    ("field", "damage", "words"),
    [
        ("offsets", lambda a: changed(a, -1, a[-1] - 1), "partition"),
        ("offsets", lambda a: changed(a, 0, 1), "partition"),
        ("offsets", lambda a: changed(a, len(a) // 2, a[-1] + 5), "partition"),
        ("references", lambda a: changed(a, a == a[0], a[-1]), "in no cell"),
        ("references", lambda a: a[::-1].copy(), "outside|out of order"),
        ("references", lambda a: np.roll(a, 7), "outside|out of order"),
    ],
)
def test_damage_to_a_grid_is_found(lab, build, field, damage, words):
    grid = build("grid", lab.small_scene("soup"), "resolution=6x5x4")
    assert grid.validate() == []
    damaged(grid, **{field: damage(getattr(grid.arrays, field))})
    violations = grid.validate()
    assert violations
    assert re.search(words, " ".join(violations))


def test_a_triangle_missing_from_one_of_its_cells_is_found(lab, build):
    """The invariant a walk rests on: every cell a triangle overlaps lists it."""
    grid = build("grid", lab.small_scene("soup"), "resolution=6x5x4")
    ids, counts = np.unique(grid.arrays.references, return_counts=True)
    victim = ids[counts > 3][0]
    place = int(np.flatnonzero(grid.arrays.references == victim)[1])
    offsets = grid.arrays.offsets.copy()
    offsets[np.searchsorted(offsets, place, side="right") :] -= 1
    damaged(grid, references=np.delete(grid.arrays.references, place), offsets=offsets)
    assert grid.validate() != []


@pytest.mark.parametrize(
    ("field", "damage"),
    [
        ("volumes", lambda v: Boxes(changed(v.rows, (0, 0), v.rows[0, 0] + 1e-3))),
        ("volumes", lambda v: Boxes(changed(v.rows, (-1, 4), v.rows[-1, 4] - 1e-3))),
        ("volumes", lambda v: Boxes(changed(v.rows, (5, 2), v.rows[5, 2] - 1.0))),
        ("size", lambda a: changed(a, np.flatnonzero(a > 1)[0], 1)),
        ("first", lambda a: changed(a, 0, 3)),
        ("first", lambda a: changed(a, -1, 0)),
    ],
)
def test_damage_to_a_tree_is_found(lab, build, field, damage):
    tree = build("bvh", lab.small_scene("soup"))
    assert tree.validate() == []
    damaged(tree, **{field: damage(getattr(tree.arrays, field))})
    assert tree.validate() != []


def test_a_wrong_order_of_triangles_is_found(lab, build):
    tree = build("bvh", lab.small_scene("soup"))
    ids = tree.triangles.ids.copy()
    ids[3] = ids[4]
    tree.geometry = tree.triangles._replace(ids=ids)
    assert tree.validate() != []


@pytest.mark.parametrize(
    "linked", [name for name, each in structures().items() if issubclass(each, Linked)]
)
def test_links_lead_to_cells_that_touch(lab, build, linked):
    """Where a structure has links, a leaf has one behind each face that is not in the border."""
    structure = build(linked, lab.small_scene("suzanne"))
    cells = structure.cells()
    by_number = np.empty_like(cells.boxes)
    by_number[cells.numbers] = cells.boxes
    for number in cells.numbers[cells.is_leaf][::50]:
        links = structure.links(int(number))
        own = by_number[number]
        inside = (own[:3] > by_number[0, :3]).sum() + (own[3:] < by_number[0, 3:]).sum()
        assert len(links) == inside
        others = by_number[links]
        assert (others[:, :3] <= own[3:]).all()
        assert (others[:, 3:] >= own[:3]).all()
