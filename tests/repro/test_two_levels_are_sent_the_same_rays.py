"""Two levels over a scene without instances are sent the rays that every structure is sent.

Boxes of instances are rounded outward, and the scene was taken to be as large as those: random
lines, which start from its bounds, were others, by some 1e-7 of its size.
"""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import workloads
from accelscope.core.evaluation.records import experiment


@pytest.mark.parametrize("text", ["", "rebraid=partial", "shared=false"])
@pytest.mark.parametrize("sample", ["soup", "overlapping"])
def test_the_same_random_lines(lab, build, sample, text):
    scene, lines = lab.small_scene(sample), workloads()["random_lines"]
    traced = []
    for structure in (build("naive", scene), build("two_level", scene, text)):
        built = experiment.Built(structure, 0.0)
        traced.append(experiment.trace(built, lines, lines.Settings(count=500)))
    one, other = traced
    assert np.array_equal(one.rays.origins, other.rays.origins)
    assert np.array_equal(one.hits.t, other.hits.t)
    assert np.array_equal(one.hits.primitive, other.hits.primitive)
