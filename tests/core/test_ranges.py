"""Runs of numbers: what is picked out of lists that are stored one behind the other."""

import numpy as np
import pytest
from accelscope.core.ranges import ranges


@pytest.mark.parametrize("dtype", [np.int64, np.int32, np.uint8])
@pytest.mark.parametrize(
    ("begins", "sizes"),
    [([], []), ([5], [0]), ([5], [3]), ([7, 0, 7], [2, 0, 4]), (0, [1, 2, 0, 3]), (1, [0, 0])],
)
def test_numbers_of_all_ranges(begins, sizes, dtype):
    each = np.broadcast_to(begins, len(sizes))
    wanted = [number for begin, size in zip(each, sizes) for number in range(begin, begin + size)]
    found = ranges(np.array(begins, dtype) if begins != 0 else 0, np.array(sizes, dtype))
    assert found.dtype == np.int64
    assert found.tolist() == wanted
