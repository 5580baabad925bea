"""Every walk ends, even in a structure that is damaged: with an answer or with an error.

A hang cannot be stopped in Blender: the thread that hangs is inside a kernel.
"""

import numpy as np
import pytest
from accelscope.core.contract.walk import NOWHERE, lost
from accelscope.core.evaluation.rays.workloads import RandomLinesSettings, RandomLinesWorkload
from accelscope.core.structures.naive import Naive
from accelscope.sample_scenes import make_sample


@pytest.fixture(scope="module")
def scene():
    return make_sample("bunny")


@pytest.fixture(scope="module")
def rays(scene):
    return RandomLinesWorkload.make(scene, RandomLinesSettings(count=300))


def no_numbers(array, seed):
    return np.full_like(array, np.nan)


def beyond(array, seed):
    return np.full_like(array, np.inf)


def all_alike(array, seed):
    return np.full_like(array, array.flat[0])


def shuffled(array, seed):
    return np.random.default_rng(seed).permutation(array)


def replace(structure, field, damage, seed):
    arrays = structure.arrays
    if hasattr(arrays, field):
        return arrays._replace(**{field: damage(getattr(arrays, field), seed)})
    damaged = damage(getattr(arrays.tree, field), seed)
    return arrays._replace(tree=arrays.tree._replace(**{field: damaged}))


@pytest.mark.parametrize("damage", [no_numbers, beyond, all_alike, shuffled])
@pytest.mark.parametrize(
    ("name", "text", "field"),
    [
        ("grid", "resolution=16x16x16", "cell_size"),
        ("macro_grid", "resolution=16x16x16", "cell_size"),
        ("kdtree", "walk=march", "split"),
        ("kdtree", "walk=neighbours", "split"),
        ("kdtree", "walk=neighbours,links=stored", "boxes"),
        ("octree", "walk=march", "planes"),
        ("octree", "walk=neighbours", "planes"),
        ("octree", "walk=neighbours,links=stored", "boxes"),
        ("bsp", "walk=march", "planes"),
    ],
)
def test_it_ends(build, scene, rays, name, text, field, damage):
    structure = build(name, scene, text)
    sound = structure.arrays
    for seed in range(4):
        structure.arrays = sound
        structure.arrays = replace(structure, field, damage, seed)
        try:
            hits, _ = structure.trace(rays)
        except RuntimeError as error:
            said = str(error)
        else:
            said = "" if (hits.primitive >= -1).all() else "a hit of no triangle"
        assert said == "" or "does not come to an end in bunny" in said


def test_that_it_has_lost_its_way_is_an_error(build, scene, rays):
    """Walls in disorder lead the macro-grid's leaps out of its regions."""
    structure = build("macro_grid", scene, "resolution=16x16x16")
    walls = [np.random.default_rng(1).permutation(each) for each in structure.arrays.walls]
    structure.arrays = structure.arrays._replace(walls=np.stack(walls))
    with pytest.raises(RuntimeError, match=r"macro_grid: the walk of \d+ of 300 rays, ray"):
        structure.trace(rays)


def test_lost_is_no_hit_and_no_miss():
    assert lost(Naive.COUNTERS).primitive == NOWHERE < -1
