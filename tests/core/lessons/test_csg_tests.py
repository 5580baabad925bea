"""Lesson "csg_tests": tests of solids add up to the counters, fewer with each step of bounds."""

from accelscope.core.geometry.csg.settings import CuttingSettings
from accelscope.core.geometry.rays import Rays
from accelscope.core.sah.line_sample import random_lines
from accelscope.core.structures import structures


def test_tests_of_solids_are_the_counters(play_lesson):
    """Sums over solids are what the counters say of the same lines."""
    played = play_lesson("csg_tests")
    scene, play = played.scene, played.play
    rays = Rays.from_arrays(*random_lines(scene.lower, scene.upper, play.count, 1))
    kind = structures()["bvh"]
    for bounds in ("none", "upward", "cut"):
        structure = kind.build(scene.with_cutting(CuttingSettings(bounds)), kind.Settings())
        _, counts = structure.trace(rays)
        assert play.tests[bounds].sum() == counts["csg_tests"].sum()
        assert play.n_volume_tests[bounds] == counts["csg_volume_tests"].sum()
    assert play.tests["cut"].sum() < play.tests["upward"].sum() < play.tests["none"].sum()
