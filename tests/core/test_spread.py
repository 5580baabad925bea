"""The spread of a counter, from how often each count occurs, is NumPy's, to the last bit."""

import numpy as np
import pytest
from accelscope.core.evaluation.records.spread import spread


@pytest.mark.parametrize("largest", [0, 1, 50, 10**6, 10**12])
@pytest.mark.parametrize("count", [1, 2, 3, 99, 100, 101, 12345])
def test_as_numpy_has_it(count, largest):
    counts = np.random.default_rng(count).integers(0, largest, count, endpoint=True)
    assert spread(counts) == {
        "mean": counts.mean(),
        "minimum": counts.min(),
        "median": np.median(counts),
        "p99": np.percentile(counts, 99),
        "maximum": counts.max(),
    }


def test_of_a_column():
    values = np.arange(20).reshape(4, 5)
    assert spread(values[:, 2]) == spread(np.array([2, 7, 12, 17]))
