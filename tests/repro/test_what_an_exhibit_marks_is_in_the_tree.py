"""The cost curve marks the planes that the tree has; a refitted tree, which has others, has none.

Other exhibits of the building are about triangles that have moved, too, and go the same way.
"""

import numpy as np
import pytest
from accelscope.core.lessons import exhibits_left_out, exhibits_of
from accelscope.core.sah.split_curve import RULES, split_curve
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.topology.build_log import splits_of_nodes
from accelscope.sample_scenes import make_sample

OF_THE_BUILDING = {
    "cost_curve", "split_queues", "min_reduction", "morton_curve", "radix_sort", "radix_2_split",
    "ploc_clusters", "cost_over_steps", "reinsertions", "treelets", "spatial_splits",
}  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    return make_sample("soup:count=200,edge=0.2")


def names_of(structure):
    return {exhibit.name for exhibit in exhibits_of(structure)}


@pytest.mark.parametrize("builder", RULES)
def test_the_planes_of_the_cost_curve(scene, builder):
    structure = BVH.build(scene, BVH.Settings(builder=builder), log=True)
    planes = splits_of_nodes(structure.build_log, len(structure.arrays.size))
    inner = np.flatnonzero(structure.arrays.size == 0)
    assert len(inner) > 30
    for node in inner:
        curve = split_curve(structure, node)
        assert curve.axis[curve.best] == planes["split_axis"][node]
        assert curve.position[curve.best] == planes["split_position"][node]
        assert curve.cost[curve.best] == planes["split_cost"][node]
        # The plane lies within the node.
        low, high = structure.arrays.volumes.boxes()[node].reshape(2, 3)
        assert (
            low[curve.axis[curve.best]]
            <= curve.position[curve.best]
            <= high[curve.axis[curve.best]]
        )


@pytest.mark.parametrize("builder", sorted(set(BUILDERS) - {"sbvh"}))
@pytest.mark.parametrize("optimise", ["none", "reinsert", "treelet"])
def test_nothing_of_the_building_is_shown_of_a_refitted_tree(scene, builder, optimise):
    structure = BVH.build(scene, BVH.Settings(builder=builder, optimise=optimise), log=True)
    moved = Scene.from_triangles(scene.triangles[:, :, ::-1] * [1.0, 3.0, 1.0], "elsewhere")
    refitted = structure.refitted(moved)
    assert not names_of(refitted) & OF_THE_BUILDING
    assert names_of(structure) - names_of(refitted) <= OF_THE_BUILDING
    assert exhibits_left_out(refitted)
    assert exhibits_left_out(structure) == ""
    with pytest.raises(ValueError, match="not split by comparing costs"):
        split_curve(refitted, 0)
    # Where it is back among the same triangles, nothing has become of it but a tree.
    assert not names_of(refitted.refitted(scene)) & OF_THE_BUILDING


def test_the_list_above_is_whole(scene):
    """Whatever some builder or optimiser shows and others do not, is about the building."""
    shown = [
        names_of(BVH.build(scene, BVH.Settings(builder=builder, optimise=optimise), log=True))
        for builder, optimise in [
            *((builder, "none") for builder in BUILDERS),
            ("lbvh", "reinsert"),
            ("lbvh", "treelet"),
        ]
    ]
    found = set.union(*shown) - set.intersection(*shown)
    # Of these triangles none is worth being cut.
    assert found | {"spatial_splits"} == OF_THE_BUILDING
