"""A node that was split by index, since its plane left one side empty, has no plane in the log.

A full sweep cuts a sorted list, which always divides something.
"""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.box import boxes_of
from accelscope.core.progress import SILENT
from accelscope.core.structures.bvh import BVHSettings
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.topology.tree import Primitives, ranges_of


@pytest.mark.parametrize("builder", ["binned_sah", "parallel_sah", "spatial_median", "phr"])
def test_planes_in_the_log_part_the_children(builder):
    # The smallest numbers there are: the half of an odd one is rounded.
    corners = 5e-324 * np.random.default_rng(4).integers(9, size=(60, 3, 3))
    settings = dataclasses.replace(BVHSettings(), builder=builder, max_leaf_size=1)
    grouping = BUILDERS[builder].build(
        Primitives(corners, boxes_of(corners)), settings, SILENT, log=True
    )
    boxes, log = boxes_of(corners)[grouping.order], grouping.log()
    begin, end = ranges_of(
        grouping.tree.first, grouping.tree.size, np.where(grouping.tree.size > 0, 0, 2)
    )
    assert len(log) == 59
    for axis, position, (left, right), cost in zip(log.axis, log.position, log.children, log.cost):
        if axis < 0:
            assert np.isnan(cost)
            continue
        centroids, plane = boxes[:, axis] + boxes[:, 3 + axis], 2.0 * position
        assert centroids[begin[left] : end[left]].max() <= plane
        assert centroids[begin[right] : end[right]].min() >= plane
