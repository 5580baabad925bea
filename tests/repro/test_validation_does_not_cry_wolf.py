"""validate() has nothing to say of sound structures, and still finds damage."""

import numpy as np
import pytest
from accelscope.core.scene import Scene


def with_triangles_of_no_area(rng):
    triangles = rng.random((120, 1, 3)) + 0.15 * rng.normal(size=(120, 3, 3))
    triangles[:40, 1] = triangles[:40, 0]
    triangles[40:60] = triangles[40:60, :1]
    triangles[60:80, 2] = 2.0 * triangles[60:80, 1] - triangles[60:80, 0]
    return triangles


@pytest.mark.parametrize("text", ["", "assignment=exact", "assignment=exact,overlap=open"])
def test_grids_with_triangles_of_no_area(build, text):
    for seed in range(20):
        triangles = with_triangles_of_no_area(np.random.default_rng(seed))
        grid = build("grid", Scene.from_triangles(triangles, "degenerate"), text)
        assert grid.validate() == []


@pytest.mark.parametrize("planes", ["sah", "fixed", "autopartition"])
def test_bsps_over_flat_thin_and_mixed_scenes(build, planes):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        triangles = rng.random((100, 1, 3)) + 0.15 * rng.normal(size=(100, 3, 3))
        wide = 10.0 ** rng.uniform(-80, 80, size=(100, 1, 1)) * (triangles - 0.5)
        for some in (triangles * [1, 1, 0], triangles * [1, 1e-12, 1], triangles * 1e99, wide):
            bsp = build("bsp", Scene.from_triangles(some, "hard"), f"planes={planes}")
            assert bsp.validate() == []


def test_a_reference_lost_by_a_bsp_over_a_flat_scene_is_found(build):
    rng = np.random.default_rng(1)
    triangles = (rng.random((100, 1, 3)) + 0.15 * rng.normal(size=(100, 3, 3))) * [1, 1, 0]
    bsp = build("bsp", Scene.from_triangles(triangles, "flat"), "planes=fixed,max_leaf_size=2")
    tree, grown = bsp.arrays.tree, bsp.grown
    victim = int(np.bincount(tree.references).argmax())
    references = tree.references.copy()
    place = np.flatnonzero(references == victim)[0]
    offsets = tree.offsets.copy()
    offsets[np.searchsorted(offsets, place, side="right") :] -= 1
    references = np.delete(references, place)
    bsp.grown = grown._replace(references=references, offsets=offsets)
    bsp.with_walk(tree._replace(references=references, offsets=offsets))
    assert bsp.validate() != []
