"""Where all t would be zero no walk can tell what comes first: grids lost hits, now all refuse."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import Scene


@pytest.mark.parametrize("size", [1e-59, 1e-99])
def test_of_any_length(build, size):
    rng = np.random.default_rng(3)
    scene = Scene.from_triangles(size * rng.random((60, 3, 3)), "tiny")
    directions = rng.normal(size=(100, 3))
    origins = 0.5 * (scene.lower + scene.upper) - 2 * scene.diagonal * directions
    built = {name: build(name, scene) for name in ("naive", "grid")}
    refused = []
    for exponent in (0, 150, 200, 225, 250, 264, 280, 300):
        rays = Rays.from_arrays(origins, directions * 10.0**exponent)
        try:
            want, _ = built["naive"].trace(rays)
        except InputError:
            refused.append(exponent)
            with pytest.raises(InputError, match="make them shorter"):
                built["grid"].trace(rays)
            continue
        found, _ = built["grid"].trace(rays)
        assert (want.primitive >= 0).any()
        assert np.array_equal(found.primitive, want.primitive), exponent
        assert np.array_equal(found.t, want.t), exponent
    assert refused == [k for k in (225, 250, 264, 280, 300) if size * 10.0**-k < 1e-308]
