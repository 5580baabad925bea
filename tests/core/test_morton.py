"""Morton codes, radix sort, LBVH in both forms, HLBVH: by definition, and by closed forms."""

import dataclasses
import itertools
import threading

import numpy as np
import pytest
from accelscope.core.contract.workspace import MAXIMUM_DEPTH
from accelscope.core.geometry.box import boxes_of
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.parallel import Team
from accelscope.core.progress import SILENT, Cancelled, Progress
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.builders.morton import codes as morton
from accelscope.core.structures.bvh.builders.morton import hlbvh, lbvh, lbvh_parallel
from accelscope.core.structures.bvh.builders.morton import radix_sort as radix
from accelscope.core.structures.bvh.topology.tree import Primitives, make_splits, ranges_of
from accelscope.sample_scenes import make_sample

FAMILY = ("lbvh", "lbvh_parallel", "hlbvh", "ploc", "phr")


@pytest.fixture
def team():
    with Team(SILENT, "testing") as team:
        yield team


def grouping_of(builder, triangles, **changes):
    settings = dataclasses.replace(BVHSettings(), **changes)
    primitives = Primitives(all_triangles(triangles), boxes_of(triangles))
    return BUILDERS[builder].build(primitives, settings, SILENT)


def cubes(positions):
    """Triangles whose boxes are unit cubes."""
    return np.asarray(positions, float)[:, None] + np.array([[0.0, 0, 0], [1, 1, 0], [1, 0, 1]])


def lattice(k):
    """All positions of a grid of 2^k cells per axis, x slowest: (8^k, 3)."""
    return np.array(list(itertools.product(range(1 << k), repeat=3)))


def points(positions):
    """Boxes without extent, so that centroids are what is given."""
    return np.tile(np.asarray(positions, float), 2)


def coded(bits, **more):
    return morton.MortonSettings(morton_bits=str(bits), **more)


def codes_with(positions, bits, team):
    return morton.codes_of(points(positions), coded(bits), team)


# ------------------------------------------------------------------------------------------ codes


def interleaved(cell, per_axis):
    """Interleave three numbers by their binary digits, written out."""
    digits = [format(c, f"0{per_axis}b") for c in cell]
    return int("".join(x + y + z for x, y, z in zip(*digits, strict=True)), 2)


@pytest.mark.parametrize("bits", [3, 30, 63])
def test_codes_interleave_the_cells(bits, team):
    """Centroids in the middle of cells of a power of two: no rounding anywhere."""
    rng = np.random.default_rng(1)
    per_axis = bits // 3
    cells = rng.integers(0, 1 << per_axis, size=(500, 3))
    cells[0], cells[1] = 0, (1 << per_axis) - 1
    # The grid lies over the centroids: two of them are its corners.
    positions = cells + 0.5
    positions[0], positions[1] = 0.0, 1 << per_axis
    want = [interleaved(cell.tolist(), per_axis) for cell in cells]
    assert codes_with(positions, bits, team).tolist() == want


def test_x_is_highest_and_the_upper_border_belongs_to_the_last_cell(team):
    corners = lattice(1)
    assert codes_with(corners, 3, team).tolist() == list(range(8))
    assert codes_with([[0, 0, 0], [1, 0, 0], [1, 1, 1]], 63, team)[1] == sum(
        1 << 3 * i + 2 for i in range(21)
    )
    assert codes_with(corners, 63, team).max() == 2**63 - 1
    assert codes_with(corners, 30, team).max() == 2**30 - 1


def octants(k):
    """Positions of a grid in recursive octant order."""
    if k == 0:
        return np.zeros((1, 3), int)
    return np.concatenate([octants(k - 1) + (corner << k - 1) for corner in lattice(1)])


@pytest.mark.parametrize("bits", [30, 63])
@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_grid_is_in_recursive_octant_order(k, bits, team):
    positions = np.random.default_rng(k).permutation(lattice(k))
    codes, order = morton.sort_by_code(points(positions * 0.1 + 7.0), coded(bits), team)
    assert np.array_equal(positions[order], octants(k))
    assert (np.diff(codes) > 0).all()


def test_axes_without_extent_have_no_say(team):
    for scale in (0.0, 5e-324, 1e-310):  # the last two overflow a reciprocal
        positions = np.array([[0, 1, 0], [1, 0, scale], [2, 2, scale], [3, 3, 0]])
        flat = codes_with(positions * [1, 1, 0], 30, team)
        assert codes_with(positions, 30, team).tolist() == flat.tolist()
    assert (codes_with(np.ones((9, 3)), 63, team) == 0).all()
    assert (codes_with([[-1e100, 0, 1e100], [1e100, 0, -1e100]], 63, team) >= 0).all()


# ----------------------------------------------------------------------------------------- sorting


def random_codes(n, bits, seed=1):
    """Codes with many duplicates, and some that are far from the rest."""
    rng = np.random.default_rng(seed)
    codes = rng.integers(0, 1 << min(bits, 12), size=n) << rng.choice([0, bits - 12], size=n)
    codes[: n // 3] = codes[-(n // 3) :] if n >= 3 else codes[: n // 3]
    codes[::7] = (1 << bits) - 1
    return codes


@pytest.mark.parametrize("block", [64, 1 << 17])
@pytest.mark.parametrize("bits", [30, 63])
@pytest.mark.parametrize("n", [1, 2, 64, 65, 3000])
def test_every_pass_sorts_stably_by_the_digits_so_far(n, bits, block, team, monkeypatch):
    monkeypatch.setattr(radix, "BLOCK", block)
    run = Team.run
    monkeypatch.setattr(Team, "run", lambda self, work, total: run(self, work, total, block))
    codes = random_codes(n, bits)
    done = 0
    for got, order in radix.passes(codes.copy(), bits, team):
        done += radix.DIGIT
        want = np.argsort(codes & (1 << min(done, 63)) - 1, kind="stable")
        assert np.array_equal(order, want)
        assert np.array_equal(got, codes[want])
    assert done >= bits
    sorted_codes, order = radix.radix_sort(codes.copy(), bits, team)
    assert np.array_equal(order, np.argsort(codes, kind="stable"))
    assert np.array_equal(sorted_codes, codes[order])


@pytest.mark.parametrize("n", [1, 2, 1000])
def test_splits_by_every_bit_sort(n):
    codes = random_codes(n, 30)
    order = np.arange(n)
    for bit in range(30):
        place = radix.split(codes[order], bit)
        assert np.array_equal(np.sort(place), np.arange(n))
        moved = np.empty_like(order)
        moved[place] = order
        order = moved
        assert np.array_equal(order, np.argsort(codes & (2 << bit) - 1, kind="stable"))
    assert np.array_equal(order, np.argsort(codes, kind="stable"))


# -------------------------------------------------------------------------------------------- LBVH


def intervals_of(tree):
    """Return the intervals of references of all nodes."""
    begin, end = ranges_of(tree.first, tree.size, np.where(tree.size > 0, 0, 2))
    return set(zip(begin.tolist(), end.tolist(), strict=True))


def intervals_by_definition(codes):
    """Cut where the highest bit that differs becomes 1, the bits of the index behind the code's."""
    keys = [int(code) << 32 | index for index, code in enumerate(codes)]
    found, pending = set(), [(0, len(keys))]
    while pending:
        begin, end = pending.pop()
        found.add((begin, end))
        if end - begin > 1:
            bit = (keys[begin] ^ keys[end - 1]).bit_length() - 1
            middle = next(i for i in range(begin, end) if keys[i] >> bit & 1)
            pending += [(begin, middle), (middle, end)]
    return found


def awkward(lab):
    """Triangles by name: all scenes, and what has hardly any different codes."""
    scenes = {name: lab.small_scene(name).triangles for name in lab.SCENES}
    one = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    centred = one - one.min(axis=0) / 2 - one.max(axis=0) / 2
    scenes["two"] = np.stack([one, one + 3.0])
    scenes["identical"] = np.tile(one, (37, 1, 1))
    scenes["nested"] = centred * np.arange(1.0, 101)[:, None, None]
    scenes["needle"] = one * [1e-6, 1e-6, 1] + np.arange(300.0)[:, None, None] * [0, 0, 1.5]
    scenes["towards a point"] = one * 0.5 ** np.arange(80)[:, None, None]
    scenes["point far away"] = np.concatenate([cubes(lattice(3)), one[None] + 1e9])
    return scenes


def test_lbvh_is_the_tree_of_the_definition(lab, team, monkeypatch):
    for name, triangles in awkward(lab).items():
        for bits, subtree in (("30", 1 << 14), ("63", 16)):
            monkeypatch.setattr(lbvh, "SUBTREE", subtree)
            codes, order = morton.sort_by_code(boxes_of(triangles), coded(bits), team)
            grouping = grouping_of("lbvh", triangles, max_leaf_size=1, morton_bits=bits)
            assert np.array_equal(grouping.order, order), name
            assert intervals_of(grouping.tree) == intervals_by_definition(codes), name


def test_the_parallel_form_gives_the_same_tree(lab):
    for name, triangles in awkward(lab).items():
        for changes in ({"max_leaf_size": 1}, {}, {"morton_bits": "30", "max_leaf_size": 9}):
            one = grouping_of("lbvh", triangles, **changes)
            other = grouping_of("lbvh_parallel", triangles, **changes)
            assert np.array_equal(one.order, other.order), name
            for mine, theirs in zip(one.tree, other.tree, strict=True):
                assert np.array_equal(mine, theirs), name


def test_leaves_and_boxes_are_those_of_collapse(lab, build):
    """Statistics of trees whose leaves were chosen by other code must be the same, too."""
    scene = lab.small_scene("suzanne")
    for changes in ("max_leaf_size=2", "C_trav=3", "max_leaf_size=64,C_trav=20"):
        one = build("bvh", scene, f"builder=lbvh,{changes}").statistics()
        other = build("bvh", scene, f"builder=lbvh_parallel,{changes}").statistics()
        assert one.sah == other.sah
        assert one.leaf_sizes.tolist() == other.leaf_sizes.tolist()


# ------------------------------------------------------------------------------------------- HLBVH


@pytest.mark.parametrize("bits", ["30", "63"])
def test_treelets_are_whole(lab, bits, team):
    """Each is an interval of the tree, and within it the tree is that of LBVH."""
    for name, triangles in awkward(lab).items():
        grouping = grouping_of("hlbvh", triangles, max_leaf_size=1, morton_bits=bits)
        codes = morton.codes_of(boxes_of(triangles), coded(bits), team)[grouping.order]
        found = intervals_of(grouping.tree)
        cell = codes >> int(bits) - hlbvh.TREELET_BITS
        starts = np.flatnonzero(np.diff(cell, prepend=-1))
        assert len(np.unique(cell)) == len(starts), name
        for begin, end in itertools.pairwise([*starts.tolist(), len(codes)]):
            below = {(a, b) for a, b in found if begin <= a and b <= end}
            want = intervals_by_treelet(codes[begin:end], begin)
            assert below == want, name
        assert len(found) == 2 * len(codes) - 1


def intervals_by_treelet(codes, begin):
    """Return the intervals within a treelet; the bits of the index are those of its place."""
    keys = [int(code) << 32 | begin + index for index, code in enumerate(codes)]
    found, pending = set(), [(0, len(keys))]
    while pending:
        a, b = pending.pop()
        found.add((begin + a, begin + b))
        if b - a > 1:
            bit = (keys[a] ^ keys[b - 1]).bit_length() - 1
            middle = next(i for i in range(a, b) if keys[i] >> bit & 1)
            pending += [(a, middle), (middle, b)]
    return found


def test_one_treelet_is_lbvh(lab, monkeypatch):
    monkeypatch.setattr(hlbvh, "TREELET_BITS", 0)
    for triangles in awkward(lab).values():
        one, other = grouping_of("lbvh", triangles), grouping_of("hlbvh", triangles)
        assert np.array_equal(one.order, other.order)
        for mine, theirs in zip(one.tree, other.tree, strict=True):
            assert np.array_equal(mine, theirs)


@pytest.mark.parametrize("count", [1, 2, 5, 40, 64])
def test_the_upper_tree_is_as_deep_as_it_may_be(count):
    """Ever smaller boxes towards a point: by cost, the largest are cut off one after the other."""
    depths = {}
    for deepest in (6, 62):
        low = 0.25 ** np.arange(count)[:, None] * np.ones(3)
        boxes = np.random.default_rng(count).permutation(np.concatenate([low, 2 * low], axis=1))
        top, number = hlbvh.top_of(boxes, deepest, 16, make_splits(0))
        assert np.array_equal(np.sort(number), np.arange(count))
        roots = np.flatnonzero(top.size == 1)
        assert np.array_equal(np.sort(top.begin[roots]), np.arange(count))
        depth = {0: 0}
        for node in np.flatnonzero(top.size > 1).tolist():
            depth[top.first[node]] = depth[top.first[node] + 1] = depth[node] + 1
        depths[deepest] = max(depth[node] for node in roots.tolist())
    assert depths[6] <= 6
    if count >= 40:
        assert depths[62] > 10


# ------------------------------------------------------------------------------------ closed forms


@pytest.mark.parametrize("builder", FAMILY)
@pytest.mark.parametrize("s", [2, 3, 4, 5, 6])
def test_cost_over_tetra(build, s, builder):
    scene = make_sample(f"tetra:size={s}")
    shuffled = Scene.from_triangles(
        np.random.default_rng(s).permutation(scene.triangles), "shuffled"
    )
    for each, bits in itertools.product((scene, shuffled), ("30", "63")):
        text = f"builder={builder},morton_bits={bits},C_trav=1,C_isect=1"
        figures = build("bvh", each, f"{text},max_leaf_size=4").statistics()
        assert figures.expected_inner == pytest.approx(7 / 3 * (s - 1), rel=1e-12)
        assert figures.expected_tests == pytest.approx(4, rel=1e-12)
        assert figures.leaf_sizes.tolist() == [0, 0, 0, 0, 4 ** (s - 1)]
        single = build("bvh", each, f"{text},max_leaf_size=1").statistics()
        assert single.sah == pytest.approx(7 / 3 * (s - 1) + 3 + 4, rel=1e-12)


@pytest.mark.parametrize("bits", ["30", "63"])
@pytest.mark.parametrize("builder", ["lbvh", "lbvh_parallel"])
@pytest.mark.parametrize("k", [1, 2, 3])
def test_a_grid_of_cubes_is_the_perfect_kd_tree(build, k, builder, bits):
    positions = np.random.default_rng(k).permutation(lattice(k))
    scene = Scene.from_triangles(cubes(positions), "cubes")
    text = f"builder={builder},max_leaf_size=1,morton_bits={bits}"
    figures = build("bvh", scene, text).statistics()
    assert figures.expected_inner == pytest.approx(4 * (2**k - 1), rel=1e-12)
    assert figures.expected_leaves == pytest.approx(2**k, rel=1e-12)
    assert figures.depths.tolist() == [0] * (3 * k) + [8**k]


# ------------------------------------------------------------------------------ input, cancelling


@pytest.mark.parametrize("builder", FAMILY)
def test_awkward_input(lab, build, builder):
    for name, triangles in awkward(lab).items():
        scene = Scene.from_triangles(triangles, name)
        for text in ("", ",max_leaf_size=1,morton_bits=30", ",max_leaf_size=1024,bins=2,radius=1"):
            built = build("bvh", scene, f"builder={builder}{text}")
            assert built.validate() == [], name
            assert built.statistics().max_depth <= MAXIMUM_DEPTH


class CancelAt(Progress):
    """Cancels at a given report."""

    def __init__(self, number):
        self.left = number

    def report(self, done, total, text):
        self.left -= 1
        if self.left < 0:
            raise Cancelled


@pytest.mark.parametrize("builder", FAMILY)
def test_a_build_stops_at_any_report(builder, monkeypatch):
    monkeypatch.setattr(lbvh, "SUBTREE", 64)
    triangles = make_sample("suzanne:subdivisions=0").triangles
    primitives = Primitives(all_triangles(triangles), boxes_of(triangles))
    settings = dataclasses.replace(BVHSettings(), builder=builder)
    threads = set(threading.enumerate())
    stopped = 0
    for number in range(10_000):
        try:
            BUILDERS[builder].build(primitives, settings, CancelAt(number))
            break
        except Cancelled:
            stopped += 1
            assert set(threading.enumerate()) <= threads
    assert stopped > 10
    assert lbvh_parallel.BLOCK >= 1 << 16
