"""Extended Morton codes: bits by definition, and standard ones where nothing sets them apart."""

import dataclasses
from fractions import Fraction

import numpy as np
import pytest
from accelscope.core.contract.build_log import SPLIT
from accelscope.core.geometry.box import boxes_of
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh.builders.morton import codes as morton
from accelscope.core.structures.bvh.topology.tree import ranges_of

FAMILY = ("lbvh", "lbvh_parallel", "hlbvh", "ploc", "phr")


@pytest.fixture
def team():
    with Team(SILENT, "testing") as team:
        yield team


def settings_of(bits, **more):
    return morton.MortonSettings(morton_bits=str(bits), morton_codes="extended", **more)


def points(positions):
    """Boxes without extent, so that centroids are what is given."""
    return np.tile(np.asarray(positions, float), 2)


def kinds_by_definition(extent, bits, size_bits):
    """Halve the longest side, of equal ones the first; every seventh bit is of the size."""
    sides, kinds = [Fraction(side) for side in extent], []
    while len(kinds) < bits:
        if len(kinds) % 7 == 6 and kinds.count(3) < size_bits:
            kinds.append(3)
            continue
        axis = max(range(3), key=lambda axis: (sides[axis], -axis))
        sides[axis] /= 2
        kinds.append(axis)
    return kinds


@pytest.mark.parametrize("bits", [30, 63])
def test_without_size_bits_over_a_cube_they_are_the_standard_ones(bits, team):
    positions = np.random.default_rng(bits).random((2000, 3))
    positions[0], positions[1] = 0.0, 1.0
    boxes = points(positions)
    standard = morton.codes_of(boxes, morton.MortonSettings(morton_bits=str(bits)), team)
    assert np.array_equal(morton.codes_of(boxes, settings_of(bits, size_bits=0), team), standard)
    # The size of points is 0: they differ in what is left out.
    assert (morton.codes_of(boxes, settings_of(bits), team) != standard).any()


@pytest.mark.parametrize("bits", [30, 63])
@pytest.mark.parametrize("size_bits", [0, 1, 6, 9])
@pytest.mark.parametrize("extent", [(1, 1, 1), (8, 1, 1), (1, 3, 100), (5, 0, 7)])
def test_codes_by_definition(extent, size_bits, bits, team):
    """Numbers in the middle of cells: no rounding anywhere."""
    kinds = kinds_by_definition(extent, bits, size_bits)
    counts = [kinds.count(kind) for kind in range(4)]
    assert counts[3] == min(size_bits, bits // 7)
    rng = np.random.default_rng(bits)
    # As few high bits as float64 has room for beside the half of a cell.
    cells = np.array([rng.integers(0, 1 << min(count, 40), 300) for count in counts[:3]]).T
    shift = np.maximum(np.array(counts[:3]) - 40, 0)
    cells[2:6] = [1 << count >> 1 for count in np.minimum(counts[:3], 40)]
    positions = ((cells << shift) + 0.5) / 2.0 ** np.array(counts[:3]) * extent
    positions[0], positions[1] = 0.0, extent
    boxes, sizes = points(positions), np.zeros(len(positions), int)
    # In the middle of the scene, and within it, are some of all sizes.
    sizes[2:6] = np.array([0, 0.2, 0.55, 0.8]) * 2 ** counts[3]
    half = 0.5 * (sizes[2:6, None] + 0.5) / 2 ** counts[3] * extent
    if counts[3]:
        boxes[2:6] += np.concatenate([-half, half], axis=1)
    codes = morton.codes_of(boxes, settings_of(bits, size_bits=size_bits), team)
    for i in range(2, len(boxes)):
        numbers = [int(cell) << int(s) for cell, s in zip(cells[i], shift)]
        numbers = [n if length else 0 for n, length in zip(numbers, extent)] + [int(sizes[i])]
        left, want = counts.copy(), 0
        for kind in kinds:
            left[kind] -= 1
            want = want << 1 | numbers[kind] >> left[kind] & 1
        assert codes[i] == want


def test_no_axis_has_more_bits_than_float64(team):
    positions = np.random.default_rng(1).random((50, 3)) * [1.0, 0.0, 0.0]
    coding = morton.coding_over(points(positions), settings_of(63, size_bits=0), team)
    assert np.bincount(coding.kinds, minlength=3).tolist() == [52, 11, 0]
    _, order = morton.sort_by_code(points(positions), settings_of(63), team)
    assert np.array_equal(order, np.argsort(positions[:, 0]))
    for boxes in (np.zeros((5, 6)), points([[-1e100, 0, 1e100], [1e100, 0, -1e100]])):
        codes = morton.codes_of(boxes, settings_of(63), team)
        assert (codes >= 0).all()
    assert (morton.codes_of(np.ones((9, 6)), settings_of(30), team) == 0).all()


def test_large_ones_leave_small_ones_around_them(team):
    """Six bits of the place are the same, the seventh is not."""
    small = np.random.default_rng(2).random((64, 3)) * 0.01 + 0.3
    boxes = np.concatenate([points(small), points([[0, 0, 0], [1, 1, 1]])])
    boxes[10] = [0.0, 0.0, 0.0, 0.6, 0.6, 0.6]
    _, order = morton.sort_by_code(boxes, settings_of(63), team)
    near = [i for i in order.tolist() if i < 64]
    assert near[-1] == 10
    standard = [i for i in morton.sort_by_code(boxes, morton.MortonSettings(), team)[1] if i < 64]
    assert standard[-1] != 10


# --------------------------------------------------------------------------------------- trees


@pytest.mark.parametrize("builder", FAMILY)
def test_trees_and_hits(lab, build, builder):
    for name in ("mess", "cubes", "flat", "one"):
        scene = lab.small_scene(name)
        for text in ("", ",morton_bits=30,size_bits=9", ",max_leaf_size=1,size_bits=0"):
            built = build("bvh", scene, f"builder={builder},morton_codes=extended{text}")
            assert built.validate() == [], name
        rays, names, want, _ = lab.truth(name)
        got, _ = built.trace(rays)
        assert lab.differences(names, want, got) == {}


@pytest.mark.parametrize("builder", ["lbvh", "lbvh_parallel", "hlbvh"])
def test_planes_of_the_log_part_the_children(build, builder):
    """Where a bit of the place parts them; where one of the size does there is no plane."""
    rng = np.random.default_rng(4)
    size = np.concatenate([np.full(240, 0.1), np.full(40, 0.6), np.full(20, 2.0)])
    corners = (rng.random((300, 1, 3)) + size[:, None, None] * rng.random((300, 3, 3))) * [9, 1, 1]
    scene = Scene.from_triangles(corners, "muddle")
    text = f"builder={builder},morton_codes=extended,max_leaf_size=1"
    bvh = build("bvh", scene, text, log=True)
    log, boxes = bvh.build_log, boxes_of(scene.triangles)[bvh.triangles.ids]
    begin, end = ranges_of(bvh.arrays.first, bvh.arrays.size, bvh.width())
    assert (log.kind == SPLIT).all()
    by_codes = np.isnan(log.cost)
    assert by_codes.sum() > 20
    diagonal = np.linalg.norm(boxes[:, 3:] - boxes[:, :3], axis=1)
    n_by_size = 0
    for event in np.flatnonzero(by_codes).tolist():
        axis, position = log.axis[event], log.position[event]
        left, right = (slice(begin[c], end[c]) for c in log.cells[log.children[event]])
        if axis < 0:
            assert np.isnan(position)
            n_by_size += 1
            assert diagonal[left].max() <= diagonal[right].min()
            continue
        centres = boxes[:, [axis, 3 + axis]].mean(axis=1)
        assert centres[left].max() <= position + 1e-12
        assert centres[right].min() >= position - 1e-12
    assert n_by_size > 0


def test_settings_are_declared():
    fields = {field.name: field for field in dataclasses.fields(morton.MortonSettings)}
    assert "patent" in fields["morton_codes"].metadata["choices"]["extended"]
    assert fields["morton_codes"].default == "standard"


def test_the_highest_bit_of_numbers_that_a_float_rounds():
    powers = np.array([1 << k for k in range(63)])
    numbers = np.concatenate([[0], powers, powers - 1, powers + 1, [2**63 - 1]])
    assert morton.highest_bit(numbers).tolist() == [
        int(n).bit_length() - 1 for n in numbers.tolist()
    ]
