"""What tests of ray coherence have in common: classes of rays, directions, an area light."""

import numpy as np
from accelscope.core.scene import AREA, Light

COHERENCE = "ray_coherence"
CLASSES = ("reflected", "shadow")


def unit(rng, n):
    d = rng.normal(size=(n, 3))
    return d / np.linalg.norm(d, axis=1, keepdims=True)


def area_light(scene):
    """A light of four corners above a scene, of a third of its size."""
    half_axes = scene.diagonal * np.array([[0.2, 0.0, 0.0], [0.0, 0.1, 0.05]])
    place = 0.5 * (scene.lower + scene.upper) + scene.diagonal * np.array([0.0, -1.0, 1.0])
    return Light(AREA, position=place, direction=np.array([0.0, 0.0, -1.0]), half_axes=half_axes)
