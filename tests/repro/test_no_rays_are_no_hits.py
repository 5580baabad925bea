"""A selection among rays may be empty: then there are no hits, and that is no error."""

import numpy as np
from accelscope.core.geometry.rays import Rays
from accelscope.sample_scenes import make_sample


def test_no_rays_are_no_hits(build):
    rays = Rays.from_arrays(np.zeros((1, 3)), np.ones((1, 3))).select(np.zeros(0, int))
    hits, counters = build("bvh", make_sample("tetra:size=1")).trace(rays)
    assert len(hits.t) == len(hits.primitive) == len(counters["N_IT"]) == 0
