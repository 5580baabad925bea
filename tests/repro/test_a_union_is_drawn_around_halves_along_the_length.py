"""A union has its members around the halves along the longest side, whoever fits it.

In the order of the mesh a half of the triangles may lie anywhere. The lessons "solid_efficiency"
and "combined_volumes" and the records of `accelscope efficiency` tell of the same volume.
"""

import numpy as np
import pytest
from accelscope.core.evaluation.records.efficiency import EfficiencySettings, Measurement
from accelscope.core.geometry.kinds import COMBINED
from accelscope.core.lessons import lesson_named
from accelscope.core.progress import SILENT
from accelscope.core.scene import Scene


@pytest.fixture(scope="module")
def shuffled(lab):
    triangles = lab.small_scene("suzanne").triangles
    return Scene.from_triangles(np.random.default_rng(2).permutation(triangles), "shuffled")


def play(name, scene, **knobs):
    lesson = lesson_named(name)
    settings = lesson.Settings(**knobs)
    return lesson.play(lesson.subject(scene), settings, SILENT)


@pytest.mark.parametrize("kind", COMBINED)
def test_all_tell_of_the_same_volume(shuffled, kind):
    combined = play("combined_volumes", shuffled, volume=kind)
    counted = play("solid_efficiency", shuffled, volume=kind, direction="all").counted["all"]
    assert np.array_equal(counted.rays.origins, combined.sample.rays.origins)
    assert np.array_equal(counted.hits_volume, combined.sample.hits_volume)
    record = Measurement(shuffled, EfficiencySettings(lines=100)).of(kind)
    assert record["content"] == combined.contents[-1]


def test_two_boxes_around_two_heaps_leave_out_the_gap():
    """Two unit triangles far apart, in turn: the boxes together have twice the area of one."""
    heaps = np.tile(np.eye(3), (10, 1, 1))
    heaps[1::2, :, 0] += 10.0
    record = Measurement(Scene.from_triangles(heaps, "heaps"), EfficiencySettings(lines=100))
    assert record.of("two_boxes")["content"] == pytest.approx(2.0, rel=1e-12)
