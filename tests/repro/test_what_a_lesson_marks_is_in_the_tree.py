"""The cost curve marks the planes that the tree has; a refitted tree, which has others, has none.

Other lessons on the building are about triangles that have moved, too, and refuse such a tree.
"""

import numpy as np
import pytest
from accelscope.core.lessons import lessons
from accelscope.core.sah.split_curve import RULES, split_curve
from accelscope.core.scene import Scene
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.topology.build_log import splits_of_nodes
from accelscope.sample_scenes import make_sample

OF_THE_BUILDING = {
    "sah", "cost_curve", "axis_choice", "split_queues", "data_parallel_split", "reordering",
    "morton_codes", "morton_intervals", "radix_sort", "radix_split", "ploc", "phr",
    "rearranging", "reinsertion", "treelets", "rotations", "spatial_splits", "extended_codes",
}  # fmt: skip


@pytest.fixture(scope="module")
def scene():
    return make_sample("soup:count=200,edge=0.2")


def suiting(structure):
    return {name for name in OF_THE_BUILDING if not lessons()[name].suits(structure)}


@pytest.mark.parametrize("builder", RULES)
def test_the_planes_of_the_cost_curve(scene, builder):
    structure = BVH.build(scene, BVH.Settings(builder=builder), log=True)
    planes = splits_of_nodes(structure.build_log, len(structure.arrays.size))
    inner = np.flatnonzero(structure.arrays.size == 0)
    assert len(inner) > 30
    for node in inner:
        curve = split_curve(structure, node)
        axis, position = curve.axis[curve.best], curve.position[curve.best]
        assert axis == planes["split_axis"][node]
        assert position == planes["split_position"][node]
        assert curve.cost[curve.best] == planes["split_cost"][node]
        # The plane lies within the node.
        low, high = structure.arrays.volumes.boxes()[node].reshape(2, 3)
        assert low[axis] <= position <= high[axis]


@pytest.mark.parametrize("builder", sorted(set(BUILDERS) - {"sbvh"}))
@pytest.mark.parametrize("optimise", ["none", "reinsert", "treelet"])
def test_nothing_of_the_building_is_shown_of_a_refitted_tree(scene, builder, optimise):
    structure = BVH.build(scene, BVH.Settings(builder=builder, optimise=optimise), log=True)
    moved = Scene.from_triangles(scene.triangles[:, :, ::-1] * [1.0, 3.0, 1.0], "elsewhere")
    refitted = structure.refitted(moved)
    assert suiting(refitted) == set()
    with pytest.raises(ValueError, match="not split by comparing costs"):
        split_curve(refitted, 0)
    # Where it is back among the same triangles, nothing has become of it but a tree.
    assert suiting(refitted.refitted(scene)) == set()
    # Those who say nothing of how it was built take it.
    assert lessons()["levels"].suits(refitted) == lessons()["refit"].suits(refitted) == ""


def test_every_lesson_of_the_list_suits_some_tree(scene):
    shown = [
        suiting(BVH.build(scene, BVH.Settings(**choices), log=True))
        for choices in [
            *({"builder": builder} for builder in BUILDERS),
            *({"builder": "lbvh", "optimise": name} for name in ("reinsert", "treelet", "rotate")),
            {"builder": "lbvh", "morton_codes": "extended"},
        ]
    ]
    assert set.union(*shown) == OF_THE_BUILDING
    # Without a log there are none.
    assert suiting(BVH.build(scene, BVH.Settings(builder="ploc", optimise="reinsert"))) == set()
