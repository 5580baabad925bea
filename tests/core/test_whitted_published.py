"""How many rays pictures of the Standard Procedural Databases take: published, and ours exactly.

At 513 x 513 rays through the corners of pixels, depth 5, as E. Haines, Readme of the databases
3.14, 2005, has it in Database Analysis; and V. Havran, F. Sixta: Comparison of hierarchical grids,
1999, statistics beside their article in Ray Tracing News 12(1).

The first says that numbers "should all be within about 10%", and counts eye rays within a slightly
smaller angle (see test_spd_primary_hits.py). The second sends shadow rays from within glass
otherwise: to the lights on the outer side of the face that is hit from its inside. So counted, ours
are within 2% of his also in mount and gears, where without it they are 15% and 8% more. That he
does so is found from these counts, not from his words; the databases do not say.
"""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.workloads import WhittedSettings, WhittedWorkload
from accelscope.core.evaluation.records.experiment import Built, trace
from accelscope.core.scene.light_ways import ways_to_lights
from accelscope.core.scene.surfaces import surfaces_hit
from accelscope.core.scene.whitted.trees import OF_SHADOW as SHADOW
from accelscope.sample_scenes import make_sample

SETTINGS = WhittedSettings(width=513, height=513, pixel="corner")

OURS = {
    "balls": (263169, 954984, 175957, 0),
    "gears": (263169, 2253564, 305437, 200958),
    "jacks": (263169, 163053, 207175, 0),
    "lattice": (263169, 1163888, 236972, 0),
    "mount": (263169, 414454, 356190, 356190),
    "rings": (263169, 1084946, 315739, 0),
    "shells": (263169, 84734, 87796, 0),
    "sombrero": (263169, 181702, 0, 0),
    "teapot:size=12": (263169, 409580, 226316, 0),
    "tetra": (263169, 46260, 0, 0),
    "tree": (263169, 1097837, 0, 0),
}
"""Primary, shadow, reflected and refracted rays."""

HAINES = {
    "balls": (954368, 175095, 0), "gears": (2246955, 304643, 207564),
    "mount": (412922, 354769, 354769), "rings": (1085002, 315236, 0),
    "teapot:size=12": (407656, 225248, 0), "tetra": (46112, 0, 0), "tree": (1097419, 0, 0),
}  # fmt: skip
"""Shadow, reflected and refracted rays."""

HAVRAN = {
    "balls": (959244, 179884), "gears": (2088012, 494338), "lattice": (1180774, 243210),
    "mount": (361037, 710436), "rings": (1077336, 312879), "teapot:size=12": (406340, 226235),
    "tetra": (46262, 0), "tree": (1110323, 0),
}  # fmt: skip
"""Shadow rays, and reflected and refracted ones together."""


def to_the_outer_side(scene, traced):
    """How many shadow rays there are by each convention: ours, and that of the outer side."""
    rays, hits = traced.rays, traced.hits
    sent_on = np.flatnonzero((rays.classes != SHADOW) & (hits.primitive >= 0))
    surfaces = surfaces_hit(scene, rays, hits, sent_on)
    outer = np.where(surfaces.is_inside[:, None], -surfaces.normals, surfaces.normals)
    return [
        len(ways_to_lights(surfaces._replace(normals=normals), scene.lights).lights)
        for normals in (surfaces.normals, outer)
    ]


@pytest.mark.parametrize(
    "name", [each if each == "tetra" else pytest.param(each, marks=pytest.mark.exhaustive)
             for each in OURS],
)  # fmt: skip
def test_rays_of_each_class(build, name):
    scene = make_sample(name)
    traced = trace(Built(build("bvh", scene), 0.0), WhittedWorkload, SETTINGS)
    assert traced.rays.class_names == ("primary", "shadow", "reflected", "refracted")
    counts = tuple(np.bincount(traced.rays.classes, minlength=4).tolist())
    assert counts == OURS[name]
    _, shadow, reflected, refracted = counts
    for ours, published in zip((shadow, reflected, refracted), HAINES.get(name, ()), strict=False):
        assert ours == pytest.approx(published, rel=0.04)
    ours, to_outer_side = to_the_outer_side(scene, traced)
    assert ours == shadow
    for ours, published in zip(
        (to_outer_side, reflected + refracted), HAVRAN.get(name, ()), strict=False
    ):  # fmt: skip
        assert ours == pytest.approx(published, rel=0.04)
    if name == "tetra":
        assert abs(shadow - 46262) <= 3
