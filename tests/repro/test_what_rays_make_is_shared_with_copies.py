"""What rays make of a structure, a copy that sees another camera has, too, and whole.

Blender traces through a copy of what was built, which has the lights and the camera of now. Of
`ray_classification` that copy alone knew where the cells lie that its rays had made: the next trace
ended as a defect, and the cells drawn were those before the first.
"""

import copy

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from accelscope.core.structures import structures
from accelscope.core.structures.ray_classification import RayClassificationSettings


@pytest.mark.parametrize("most_references", [0, 500])
def test_rays_through_copies_in_turn(lab, most_references):
    settings = RayClassificationSettings(most_references=most_references)
    scene = lab.small_scene("soup")
    rays, _, want, _ = lab.truth("soup")
    structure = structures()["ray_classification"].build(scene, settings)
    before = len(structure.cells())
    for _ in range(2):
        hits, _ = copy.copy(structure).trace(rays)
        assert np.array_equal(hits.t, want.t)
        assert np.array_equal(hits.primitive, want.primitive)
        assert len(structure.cells()) > before
        assert structure.validate() == []
    assert (structure.statistics().extra["lists_dropped"] > 0) == (most_references > 0)


def test_lists_of_coherence_through_copies_in_turn(build, lab):
    """With directions of their own every time, so that each copy makes lists."""
    scene = lab.small_scene("suzanne")
    structure, naive = build("ray_coherence", scene, "cells=4"), build("naive", scene)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        sources = rng.integers(len(scene), size=500)
        rays = Rays.from_arrays(
            scene.triangles[sources].mean(axis=1), rng.normal(size=(500, 3)), sources=sources,
            class_names=("reflected",),
        )  # fmt: skip
        hits, _ = copy.copy(structure).trace(rays)
        want, _ = naive.trace(rays)
        assert np.array_equal(hits.t, want.t)
        assert np.array_equal(hits.primitive, want.primitive)
        assert structure.validate() == []
        assert len(structure.cells()) == structure.made().cells + 1
