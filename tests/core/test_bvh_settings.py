"""Settings of the hierarchy have an effect exactly where they say so."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from accelscope.core.settings import has_effect, key_of
from accelscope.core.structures.bvh.hierarchy import BVH
from accelscope.core.structures.bvh.settings import BVHSettings

CONDITIONAL = [
    (field, condition, choice)
    for field in dataclasses.fields(BVHSettings)
    for condition in field.metadata["only_for"] or {}
    for choice in BVHSettings.__dataclass_fields__[condition].metadata["choices"]
]
IDS = [f"{key_of(field)}-{choice}" for field, _, choice in CONDITIONAL]


def other_values(field):
    """Return values of a setting that differ from its default: both ends, or all other choices."""
    meta = field.metadata
    values = list(meta["choices"] or (meta["minimum"], meta["maximum"]))
    return [type(field.default)(value) for value in values if value != field.default]


@pytest.mark.parametrize(("field", "condition", "choice"), CONDITIONAL, ids=IDS)
def test_a_setting_changes_the_tree_where_it_says_so(field, condition, choice, lab):
    settings = BVHSettings(**{condition: choice, "max_leaf_size": 1})
    changes = False
    # Dwarfs beside a giant, where the shorter Morton codes are the same.
    for scene in map(lab.small_scene, ("suzanne", "mess")):
        before = BVH.build(scene, settings)
        for value in other_values(field):
            after = BVH.build(scene, dataclasses.replace(settings, **{field.name: value}))
            changes |= not (
                np.array_equal(before.arrays.first, after.arrays.first)
                and np.array_equal(before.triangles.ids, after.triangles.ids)
            )
    assert changes == has_effect(field, settings)
