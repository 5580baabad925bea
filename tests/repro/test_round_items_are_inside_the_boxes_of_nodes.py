"""A node's box around what is round is tight: the polyhedra around its items are larger than it."""

import numpy as np
import pytest
from accelscope.core.geometry.solids.description import Cone, Sphere
from accelscope.core.geometry.solids.making import mixed_of
from accelscope.core.scene import Scene
from accelscope.core.structures import structures

BVH = structures()["bvh"]


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(0)
    ends = rng.random((40, 2, 3))
    items = [Cone(base, apex, 0.1, 0.05, is_capped=False) for base, apex in ends]
    items += [Sphere(apex, 0.05) for _, apex in ends]
    geometry = mixed_of(items)
    lower, upper = geometry.boxes[:, :3].min(axis=0), geometry.boxes[:, 3:].max(axis=0)
    count = len(items)
    return Scene(
        "twigs", "twigs", geometry, np.arange(count, dtype=np.int32), 0,
        np.zeros(count, np.int32), ("twigs",), lower, upper,
    )  # fmt: skip


def test_a_hierarchy_over_round_items_is_valid(scene):
    assert BVH.build(scene, BVH.Settings()).validate() == []


def test_a_box_that_is_too_small_for_its_items_is_still_found(scene):
    tree = BVH.build(scene, BVH.Settings(max_leaf_size=100, C_trav=1e9))
    assert len(tree.arrays.size) == 1
    tree.arrays.volumes.rows[0, 4] -= 1e-9
    assert tree.validate() == ["items stick out of 1 nodes"]
