"""A part that remembers its last occluder was handed rays of all classes to record one of its own.

It refused them, for those before the ray are walked first; or walked what was never sent to it.
"""

import numpy as np
import pytest
from accelscope.core.evaluation.rays.camera import CameraSettings, CameraWorkload
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene.camera_rays import CLASS_NAMES, SHADOW
from accelscope.core.structures import structures


def mixed_rays(scene, naive):
    """Primary and shadow rays of a picture in turns, as no workload sends them."""
    settings = CameraSettings(width=40, height=40, shadows=True)
    primary = CameraWorkload.make(scene, settings)
    generations = CameraWorkload.generations(scene, settings, primary)
    next(generations)
    shadow = generations.send(naive.trace(primary)[0])
    count = min(len(primary), len(shadow))
    columns = [
        np.stack([getattr(rays, name)[:count] for rays in (primary, shadow)], axis=1)
        for name in ("origins", "directions", "t_min", "t_max", "queries", "targets")
    ]
    origins, directions, t_min, t_max, queries, targets = (
        each.reshape(2 * count, *each.shape[2:]) for each in columns
    )
    classes = np.tile([CLASS_NAMES.index("primary"), CLASS_NAMES.index(SHADOW)], count)
    return Rays.from_arrays(
        origins, directions, t_max, t_min=t_min, queries=queries, classes=classes,
        class_names=CLASS_NAMES, targets=targets,
    )  # fmt: skip


@pytest.mark.parametrize("kept", ["light", "cell"])
def test_routed_records_what_a_part_remembers(lab, kept):
    scene = lab.small_scene("balls")
    routed_kind, naive = structures()["routed"], structures()["naive"]
    own = f"last_occluder={kept}"
    settings = routed_kind.Settings(shadow="light_buffer", shadow_settings=own)
    routed = routed_kind.build(scene, settings)
    rays = mixed_rays(scene, naive.build(scene, naive.Settings()))
    _, counts = routed.trace(rays)
    recalled = np.flatnonzero(counts["recalled"])
    assert len(recalled) > 20
    for index in [*recalled[::7].tolist(), *range(0, len(rays), 97)]:
        tally = routed.record(rays, index).tally()
        assert tally == {key: int(values[index]) for key, values in counts.by_name().items()}
