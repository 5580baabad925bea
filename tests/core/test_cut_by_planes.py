"""What a structure declares of itself is what its cells have."""

import pytest
from accelscope.core.structures import structures
from accelscope.sample_scenes import make_sample


@pytest.mark.parametrize("name", structures())
def test_planes_and_steps(name):
    kind = structures()[name]
    cells = kind.build(make_sample("soup:count=100"), kind.Settings()).cells()
    assert (cells.planes is not None) == kind.is_cut_by_planes
    assert (cells.divided is not None) == kind.is_cut_by_planes
