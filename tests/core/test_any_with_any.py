"""Builder, volume, arity and optimiser are independent: any with any returns the bits of brute
force, and is sound."""

import itertools

import pytest
from accelscope.core.geometry.kinds import KINDS
from accelscope.core.geometry.rays import CLOSEST
from accelscope.core.structures.bvh import BVH
from accelscope.core.structures.bvh.builders import BUILDERS
from accelscope.core.structures.bvh.optimisers import OPTIMISERS

ARITIES = tuple(BVH.Settings.__dataclass_fields__["arity"].metadata["choices"])


def check(lab, build, text, scenes):
    for scene_name in scenes:
        rays, names, want, _ = lab.truth(scene_name)
        structure = build("bvh", lab.small_scene(scene_name), text)
        assert structure.validate() == []
        got, _ = structure.trace(rays, CLOSEST)
        assert lab.differences(names, want, got) == {}


def any_with_any(first, second):
    """Return every combination; each of `first` once and all of `second` for every run."""
    assert len(second) <= len(first)
    return [
        pytest.param(a, b, marks=[] if (i - j) % len(second) == 0 else pytest.mark.exhaustive)
        for (i, a), (j, b) in itertools.product(enumerate(first), enumerate(second))
    ]


@pytest.mark.parametrize(("builder", "volume"), any_with_any(BUILDERS, KINDS))
def test_builder_and_volume(lab, build, builder, volume):
    for arity in ARITIES:
        text = f"builder={builder},volume={volume},arity={arity},max_leaf_size=2"
        check(lab, build, text, ("soup", "mess"))


@pytest.mark.parametrize(("builder", "optimise"), any_with_any(BUILDERS, OPTIMISERS))
def test_builder_and_optimiser(lab, build, builder, optimise):
    text = f"builder={builder},optimise={optimise}"
    check(lab, build, text, ("soup", "mess", "cubes", "flat"))
