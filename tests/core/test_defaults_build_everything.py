"""With default settings every scene gives a tree, of bounded size and at a bounded expense.

The expense is counted: the references of all cells of one depth, summed over the depths.
"""

import itertools

import numpy as np
import pytest
from accelscope.core.geometry.triangles import all_triangles
from accelscope.core.scene import Scene
from accelscope.core.structures import structures
from accelscope.core.structures.bsp import DUPLICATION as BSP_LIMIT
from accelscope.core.structures.grid.resolution import (
    REFERENCES_PER_CELL,
    USUAL_DENSITY,
    expected_references,
    reference_terms,
)
from accelscope.core.structures.kdtree import DUPLICATION as KDTREE_LIMIT
from accelscope.core.structures.kdtree import FEW
from accelscope.core.structures.octree import DUPLICATION as OCTREE_LIMIT
from accelscope.core.structures.octree import levels_for
from accelscope.core.structures.subdivision.settings import depth_limit
from hard_scenes import HARD_SCENES

GRID_LIMIT = 2 * REFERENCES_PER_CELL * USUAL_DENSITY
"""Twice what is expected for a random place of the grid."""

LIMITS = {"octree": OCTREE_LIMIT, "kdtree": KDTREE_LIMIT, "bsp": BSP_LIMIT}


def choices_of(name):
    """Return every choice of the settings that decide which cells there are, and M = 0."""
    fields = structures()[name].Settings.__dataclass_fields__
    texts = [
        f"{key}={choice}"
        for key in ("planes", "directions", "assignment", "overlap", "storage", "order")
        if key in fields
        for choice in fields[key].metadata["choices"]
    ]
    return ["", "max_leaf_size=0", "mailbox=true", *texts] + [
        f"max_leaf_size=0,{text}" for text in texts if text.startswith("planes")
    ]


TREES = [(name, text) for name in LIMITS for text in choices_of(name)]


def references_by_depth(tree):
    """Return how many references the cells of each depth have in all; a leaf counts from there on.

    A cell that was split had every triangle of the leaves below it, once.
    """
    nodes, arrays = tree.topology(), tree.arrays.tree
    count = len(tree.scene)
    parent = np.zeros(len(nodes.depth), np.int64)
    for node, children in children_of(tree):
        parent[children] = node
    owner = np.repeat(nodes.leaves, np.diff(arrays.offsets))
    entries = owner * count + arrays.references
    depth, totals = int(nodes.depth.max()), []
    while depth >= 0:
        totals.append(len(entries))
        node, triangle = entries // count, entries % count
        node = np.where(nodes.depth[node] == depth, parent[node], node)
        entries = np.unique(node * count + triangle)
        depth -= 1
    return totals[::-1]


def children_of(tree):
    """Yield every inner node with the array of its children."""
    if tree.name == "octree":
        yield from enumerate(tree.built.children)
        return
    link = tree.arrays.tree.link
    inner = link & 3 != 3 if tree.name == "kdtree" else link > 0
    left = link >> 2 if tree.name == "kdtree" else link
    for node in np.flatnonzero(inner):
        yield node, np.array([left[node], left[node] + 1])


def test_there_is_something_to_test():
    assert len(TREES) >= 38
    assert len(HARD_SCENES) >= 15
    assert all(0 < len(make(300)) <= 300 for make in HARD_SCENES.values())


@pytest.mark.parametrize("scene", HARD_SCENES)
@pytest.mark.parametrize(("name", "text"), TREES)
def test_a_tree_of_bounded_size_at_a_bounded_expense(build, name, text, scene):
    corners = HARD_SCENES[scene](300)
    tree = build(name, Scene.from_triangles(corners, scene), text)
    assert tree.validate() == []
    totals = references_by_depth(tree)
    assert totals[0] == len(corners)
    assert totals[-1] == len(tree.arrays.tree.references)
    # As many at every depth, and no more depths than the setting says.
    limit = LIMITS[name] * len(corners)
    if name == "kdtree" and tree.settings.planes == "sah":
        # The heuristic stops by itself, well before what it may have.
        limit = 64 * len(corners)
        assert limit < FEW
    assert max(totals) <= limit
    is_octree = name == "octree"
    deepest = (
        levels_for(tree.settings, len(corners)) if is_octree else depth_limit(-1, len(corners))
    )
    assert len(totals) - 1 <= deepest


@pytest.mark.parametrize("scene", ["disc", "cone", "bamboo", "concentric", "through one point"])
@pytest.mark.parametrize("name", LIMITS)
def test_thousands_too(build, name, scene):
    corners = HARD_SCENES[scene](4000)
    figures = build(name, Scene.from_triangles(corners, scene)).statistics()
    assert figures.N_OIV / len(corners) <= (64 if name == "kdtree" else LIMITS[name])
    assert figures.N_IN > 1
    # The tree is better than none, by its own reckoning.
    assert figures.sah < len(corners)


@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_is_kept_and_used(build, name):
    """A tree with a higher limit refines those with lower ones, until nothing is in the way."""
    scene = Scene.from_triangles(HARD_SCENES["needles"](600), "needles")
    sizes = []
    for limit in (0.5, 1, 1.5, 2, 4, 8, 32):
        figures = build(name, scene, f"duplication={limit},max_leaf_size=2").statistics()
        assert figures.N_OIV / len(scene) <= max(limit, 1)
        sizes.append(figures.N_OIV)
    assert sizes == sorted(sizes)
    assert sizes[0] == len(scene)
    assert sizes[-1] > 4 * len(scene)


@pytest.mark.parametrize("name", LIMITS)
def test_who_gives_a_depth_gets_it(build, name):
    """Without a limit, as 0 says for any depth."""
    scene = Scene.from_triangles(HARD_SCENES["needles"](60), "needles")
    depth = 4 if name == "octree" else 12
    text = f"max_leaf_size=1,max_depth={depth}"
    given, unlimited, limited = (
        build(name, scene, f"{text},duplication={limit}").statistics() for limit in ("auto", 0, 2)
    )
    assert given.to_json() == unlimited.to_json()
    assert given.max_depth == depth
    assert limited.N_OIV <= 2 * len(scene) < given.N_OIV


@pytest.mark.parametrize("name", LIMITS)
def test_the_order_of_splitting_makes_no_difference_to_a_limit(build, name):
    scene = Scene.from_triangles(HARD_SCENES["bamboo"](600), "bamboo")
    figures = [
        build(name, scene, f"order={order},duplication=6,budget={budget}").statistics()
        for order, budget in itertools.product(("fifo", "priority", "depth_first"), (0, 10**6))
    ]
    assert figures[0].N_IN > 10
    for other in figures[1:]:
        assert np.array_equal(other.leaf_sizes, figures[0].leaf_sizes)
        assert np.array_equal(other.depths, figures[0].depths)
        assert other.sah == pytest.approx(figures[0].sah, rel=1e-12)


@pytest.mark.parametrize("scene", HARD_SCENES)
@pytest.mark.parametrize("name", ["grid", "macro_grid", "bvh", "sorted_volumes", "naive"])
def test_others_build_everything_too(build, name, scene):
    corners = HARD_SCENES[scene](300)
    structure = build(name, Scene.from_triangles(corners, scene))
    assert structure.validate() == []
    figures = structure.statistics()
    limit = GRID_LIMIT if "grid" in name else 1
    assert figures.N_OIV / len(corners) <= limit


@pytest.mark.parametrize("scene", HARD_SCENES)
@pytest.mark.parametrize("assignment", ["box", "exact"])
def test_references_of_a_grid_are_known_beforehand(build, assignment, scene):
    """The mean over many places of the grid is that of the closed form."""
    corners = HARD_SCENES[scene](100)
    size, resolution = np.ptp(corners, axis=(0, 1)), np.array([7, 5, 6])
    rng = np.random.default_rng(1)
    got = []
    for _ in range(200):
        # Two more triangles, of which each is a point, move the walls by up to a cell.
        shift = rng.random(3) * size / resolution
        ends = np.array([corners.min(axis=(0, 1)) - shift, corners.max(axis=(0, 1)) + size - shift])
        scene_here = Scene.from_triangles(
            np.concatenate([corners, np.repeat(ends[:, None], 3, axis=1)]), scene
        )
        text = f"resolution={2 * resolution[0]}x{2 * resolution[1]}x{2 * resolution[2]}"
        tree = build("grid", scene_here, f"{text},padding=0,assignment={assignment}")
        got.append(tree.statistics().N_OIV - 2)
    terms = reference_terms(all_triangles(corners), 2 * size, assignment == "exact")
    error = np.std(got) / np.sqrt(len(got))
    expected = expected_references(terms, 2 * resolution)
    assert abs(np.mean(got) - expected) < 4 * error + 1e-3 * expected
