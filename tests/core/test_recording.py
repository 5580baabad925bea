"""Recording a ray is counting it: the log's tally is the counters' row, for every ray."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.events import (
    HIT,
    MAILBOX,
    POSTPONE,
    TEST,
    VISIT_EMPTY,
    VISIT_INNER,
    VISIT_LEAF,
)
from accelscope.core.contract.within import within_of
from accelscope.core.geometry.rays import ALL, ANY, CLOSEST
from accelscope.core.scene.placing import by_objects

QUERIES = {"closest": CLOSEST, "any": ANY, "all": ALL}


@pytest.mark.parametrize("sample", ["suzanne", "tetra", "soup", "cubes", "teapot_in_stadium"])
@pytest.mark.parametrize("query", QUERIES)
def test_tally_equals_counters(lab, build, variant, sample, query):
    name, text = variant
    if name == "naive" and sample not in ("cubes", "tetra"):
        pytest.skip("brute force records every triangle; two scenes will do")
    scene = lab.small_scene(sample)
    structure = build(name, scene, text)
    rays, _, _, _ = lab.truth(sample)
    rays = rays.select(np.arange(0, len(rays), max(len(rays) // 120, 1)))
    hits, counters = structure.trace(rays, QUERIES[query])
    for i in range(len(rays)):
        steps = structure.record(rays, i, QUERIES[query])
        row = {name: int(counters[name][i]) for name in steps.tally()}
        assert steps.tally() == row
        found = np.flatnonzero((steps.kind == HIT) | (steps.kind == POSTPONE))
        if hits.primitive[i] < 0:
            assert len(found) == 0
        else:
            last = found[np.flatnonzero(steps.level[found] == 0)[-1]]
            assert hit_by(steps, last, scene) == hits.primitive[i]
            assert steps.t_enter[last] == hits.t[i]


def hit_by(steps, event, scene):
    """The primitive of a hit: of one noted as an instance, that which was hit within it."""
    number = steps.primitive[event]
    if not (steps.level > 0).any():
        return number
    inner = within_of(steps, np.array([event]), 1)[0]
    assert inner < event
    return by_objects(scene).geometry.first[number] + steps.primitive[inner]


def test_a_batch_remembers_its_own_queries(lab, build):
    scene = lab.small_scene("soup")
    rays, _, _, _ = lab.truth("soup")
    structure = build("bvh", scene)
    mixed = np.arange(len(rays), dtype=np.uint8) % 3
    own = dataclasses.replace(rays, queries=mixed)
    got, counters = structure.trace(own)
    for query in (CLOSEST, ANY, ALL):
        hits, same = structure.trace(rays, query)
        mask = mixed == query
        assert np.array_equal(got.t[mask], hits.t[mask])
        assert np.array_equal(counters.values[mask], same.values[mask])
    i = int(np.flatnonzero((mixed == ANY) & (got.primitive >= 0))[0])
    assert structure.record(own, i).tally()["N_IT"] == counters["N_IT"][i]


def test_a_grid_is_walked_in_order(lab, build):
    scene = lab.small_scene("suzanne")
    grid = build("grid", scene, "resolution=9x8x7")
    resolution = np.array([9, 8, 7])
    rays, _, _, _ = lab.truth("suzanne")
    longest = 0
    for i in range(0, len(rays), max(len(rays) // 400, 1)):
        steps = grid.record(rays, i, ALL)
        visits = np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY))
        enter, leave = steps.t_enter[visits], steps.t_exit[visits]
        assert (np.diff(enter) >= 0).all()
        assert np.array_equal(enter[1:], leave[:-1])
        index = np.stack(np.unravel_index(steps.cell[visits], resolution), axis=1)
        # Every step goes to a neighbour across one wall, always the same way.
        assert (np.abs(np.diff(index, axis=0)).sum(axis=1) == 1).all()
        signs = np.sign(np.diff(index, axis=0))
        directions = np.sign(rays.directions[i])
        assert ((signs == 0) | (signs == directions)).all()
        longest = max(longest, visits.sum())
    assert longest > 15


def test_a_tree_is_walked_from_parents_to_children(lab, build):
    scene = lab.small_scene("suzanne")
    tree = build("bvh", scene)
    cells = tree.cells()
    box = np.empty_like(cells.boxes)
    box[cells.numbers] = cells.boxes
    rays, _, _, _ = lab.truth("suzanne")
    for i in range(0, len(rays), max(len(rays) // 200, 1)):
        steps = tree.record(rays, i)
        seen = set()
        best = rays.t_max[i]
        for kind, cell, t in zip(steps.kind, steps.cell, steps.t_enter, strict=True):
            if kind in (VISIT_INNER, VISIT_LEAF):
                assert cell not in seen
                seen.add(cell)
                assert t <= best
            if kind == HIT:
                best = min(best, t)


def test_postponed_hits_wait_for_their_cell(lab, build):
    """A hit beyond the cell is kept, other cells are looked at, then it is the answer."""
    scene = lab.small_scene("soup")
    grid = build("grid", scene, "resolution=12x12x12,mailbox=true")
    rays = lab.batch_of({"lines": lab.ray_families(scene, 1500)["random lines"]})[0]
    want, _ = build("naive", scene).trace(rays)
    accepted = overtaken = skipped = 0
    for i in range(len(rays)):
        steps = grid.record(rays, i)
        tested = steps.primitive[steps.kind == TEST]
        assert len(set(tested)) == len(tested), "the mailbox tests a triangle once"
        assert set(steps.primitive[steps.kind == MAILBOX]) <= set(tested)
        skipped += (steps.kind == MAILBOX).sum()
        waiting = np.flatnonzero(steps.kind == POSTPONE)
        if not len(waiting):
            continue
        first = waiting[0]
        found = np.isin(steps.kind, (HIT, POSTPONE))
        last = np.flatnonzero(found)[-1]
        assert steps.primitive[last] == want.primitive[i]
        if last == waiting[-1]:
            later = np.isin(steps.kind[last:], (VISIT_LEAF, VISIT_EMPTY))
            assert later.any(), "a postponed hit was accepted without going on"
        # The walk ends in the very cell that holds the hit.
        cell = np.flatnonzero(np.isin(steps.kind, (VISIT_LEAF, VISIT_EMPTY)))[-1]
        assert steps.t_enter[cell] <= want.t[i] <= steps.t_exit[cell]
        accepted += steps.primitive[first] == want.primitive[i]
        overtaken += steps.primitive[first] != want.primitive[i]
    assert accepted > 10
    assert overtaken > 10
    assert skipped > 100


def test_the_mailbox_saves_tests_and_changes_nothing_else(lab, build):
    scene = lab.small_scene("soup")
    rays, _, _, _ = lab.truth("soup")
    plain, before = build("grid", scene, "resolution=12x12x12").trace(rays)
    boxed, after = build("grid", scene, "resolution=12x12x12,mailbox=true").trace(rays)
    assert np.array_equal(plain.primitive, boxed.primitive)
    for name in ("N_TS", "N_ETS", "N_EETS", "volume_tests"):
        assert np.array_equal(before[name], after[name])
    assert np.array_equal(before["N_IT"], after["N_IT"] + after["mailbox_hits"])
    assert after["mailbox_hits"].sum() > 1000
    assert before["mailbox_hits"].sum() == 0


def test_a_long_walk_is_recorded_whole(build):
    from accelscope.core.geometry.rays import Rays
    from accelscope.sample_scenes import make_sample

    scene = make_sample("tetra:size=6")
    naive = build("naive", scene)
    ray = Rays.from_arrays([[9.0, 9.0, 9.0]], [[1.0, 0.0, 0.0]])
    steps = naive.record(ray, 0)
    assert steps.tally()["N_IT"] == len(scene) > 1024
    assert np.array_equal(steps.primitive[steps.kind == TEST], np.arange(len(scene)))


def test_threads_change_nothing(lab, build, structure_name):
    scene = lab.small_scene("soup")
    families = lab.ray_families(scene, 400)
    rays, _ = lab.batch_of(families)
    assert len(rays) > 2 * 4096
    structure = build(structure_name, scene)
    hits, counters = structure.trace(rays, threads=1)
    for threads in (2, 3, 7):
        other, others = structure.trace(rays, threads=threads)
        assert np.array_equal(hits.t, other.t)
        assert np.array_equal(hits.primitive, other.primitive)
        assert np.array_equal(counters.values, others.values)
