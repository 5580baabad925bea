"""The walks of a BSP tree: hits are those of brute force, and all visit the same leaves."""

import itertools

import numpy as np
import pytest
from accelscope.core.contract.events import HIT, POSTPONE, VISIT_EMPTY, VISIT_LEAF
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST
from accelscope.core.structures import structures
from bsp_trees import TREES, WALKS, lines, tree_of, walked


def rays_in_cells(tree, n):
    """Rays between corners of the polyhedra, from these, and within the planes."""
    rng = np.random.default_rng(4)
    cells = tree.cells()
    corners = cells.faces.points
    size = float(np.ptp(corners, axis=0).max())
    families = {}

    def pick():
        return corners[rng.integers(len(corners), size=n)]

    o = pick()
    families["corner to corner"] = o, pick() - o
    families["from corners"] = pick(), rng.normal(size=(n, 3))
    families["beyond corners"] = (o := pick()), o + 1e-14 * size - pick()
    if len(cells.planes.points):
        cut, offsets, _ = cells.planes
        which = rng.integers(len(offsets) - 1, size=n)
        a, b, c = (cut[offsets[which] + i] for i in range(3))
        w = rng.normal(size=(4, n, 1))
        o = a + w[0] * (b - a) + w[1] * (c - a)
        families["in planes"] = o, w[2] * (b - a) + w[3] * (c - a)
        families["along cuts"] = a - (b - a), b - a
        normal = np.cross(b - a, c - a)
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normal /= np.where(length > 0, length, 1)
        families["beside planes"] = o + 1e-12 * size * normal, w[2] * (b - a) + w[3] * (c - a)
        families["nearly in planes"] = o, w[2] * (b - a) + w[3] * (c - a) + 1e-13 * size * normal
    return families


@pytest.mark.parametrize("text", TREES)
def test_hits_are_those_of_brute_force(lab, scene_name, text):
    tree = tree_of(lab, scene_name, text)
    rays, names, want, _ = lab.truth(scene_name)
    in_cells, cell_names = lab.batch_of(rays_in_cells(tree, 200))
    naive = structures()["naive"]
    at_cells, _ = naive.build(lab.small_scene(scene_name), naive.Settings()).trace(in_cells)
    for walk, mailbox in itertools.product(WALKS, (False, True)):
        walked(tree, walk, mailbox)
        for query in (CLOSEST, ALL):
            got, _ = tree.trace(rays, query)
            assert lab.differences(names, want, got) == {}, (walk, mailbox, query)
        got, _ = tree.trace(rays, ANY)
        assert lab.any_differences(names, want, got) == {}, (walk, mailbox)
        got, _ = tree.trace(in_cells)
        assert lab.differences(cell_names, at_cells, got) == {}, (walk, mailbox)


def leaves(steps):
    """Return the leaves of a recorded walk, in order."""
    return steps.cell[np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY))]


@pytest.mark.parametrize("text", TREES)
@pytest.mark.parametrize("query", [CLOSEST, ALL])
def test_all_walks_visit_the_same_leaves(lab, scene_name, text, query):
    tree = tree_of(lab, scene_name, text)
    rays, _, _, _ = lab.truth(scene_name)
    in_cells, _ = lab.batch_of(rays_in_cells(tree, 15))
    for batch in (rays.select(np.arange(0, len(rays), 131)), in_cells):
        want = None
        for walk in WALKS:
            walked(tree, walk)
            got = [leaves(tree.record(batch, i, query)).tolist() for i in range(len(batch))]
            want = want or got
            assert got == want, walk
            _, counters = tree.trace(batch, query)
            assert counters["N_ETS"].tolist() == [len(each) for each in got]


@pytest.mark.parametrize("walk", WALKS)
@pytest.mark.parametrize("mailbox", [False, True])
def test_recording_is_counting(lab, walk, mailbox):
    tree = walked(tree_of(lab, "suzanne", "planes=sah"), walk, mailbox)
    rays, _, _, _ = lab.truth("suzanne")
    rays = rays.select(np.arange(0, len(rays), 61))
    for query in (CLOSEST, ANY, ALL):
        hits, counters = tree.trace(rays, query)
        for i in range(len(rays)):
            steps = tree.record(rays, i, query)
            assert steps.tally() == {name: int(counters[name][i]) for name in steps.tally()}
            found = steps.primitive[np.isin(steps.kind, (HIT, POSTPONE))]
            assert (found[-1] if len(found) else -1) == hits.primitive[i]


def test_marching_goes_down_from_the_root_for_every_leaf(lab):
    tree = tree_of(lab, "suzanne", "planes=sah")
    rays = lines(tree, 300)
    _, recursive = walked(tree, "recursive").trace(rays, ALL)
    _, march = walked(tree, "march").trace(rays, ALL)
    for i in range(len(rays)):
        steps = tree.record(rays, i, ALL)
        assert march["N_TS"][i] == (tree.grown.depth[leaves(steps)] + 1).sum()
        visits = np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY))
        # Consecutive cells touch exactly.
        assert np.array_equal(steps.t_enter[visits][1:], steps.t_exit[visits][:-1])
    assert (recursive["N_TS"] <= march["N_TS"]).all()
