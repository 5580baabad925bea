"""The plane with a slider: figures and picture follow it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from accelscope.core.sah.worked_example import PRINTED


@pytest.fixture
def layers(bpy: Any) -> Any:
    from accelscope.addon.drawing import overlay

    return overlay._overlay.layers


def figures(current: Any) -> dict[str, str]:
    return dict(current.split_view.rows)


def test_the_slide(bpy: Any, root: Any, current: Any, layers: Any) -> None:
    """The planes of the lecture's example, typed into the panel."""
    bpy.ops.accelscope.add_sample_scene(sample="sah_example")
    bpy.ops.accelscope.build()
    group = root.split_plane
    assert current.split_view.rows == []
    group.show = True
    for name, share in (("I", 9 / 81), ("II", 33 / 81), ("III", 71 / 81)):
        # A little to the right, since the scene has single precision.
        group.position = share + 1e-5
        assert float(figures(current)["Cost(V -> {L, R})"]) == pytest.approx(PRINTED[name], abs=0.1)
    shown = figures(current)
    assert [shown[name] for name in ("N_L", "N_R")] == ["12", "64"]
    assert [shown[name] for name in ("p_L", "p_R")] == ["0.90", "0.29"]
    assert shown["Cost(V)"] == "76.0"


def test_the_plane_is_drawn_where_the_slider_is(
    bpy: Any, root: Any, current: Any, layers: Any
) -> None:
    bpy.ops.mesh.primitive_monkey_add()
    bpy.ops.accelscope.build()
    group, scene = root.split_plane, current.built.structure.scene
    group.show = True
    for number, axis in enumerate("xyz"):
        group.axis = axis
        for share in (0.0, 0.25, 1.0):
            group.position = share
            position = scene.lower[number] + share * (scene.upper - scene.lower)[number]
            plane = current.split_view.plane
            assert plane.position == pytest.approx(position, abs=1e-6)
            assert len(scene) == plane.N_L + plane.N_R
            ends = layers["plane"].segments[:, :, number]
            assert (np.abs(ends - position) < 1e-5).all(axis=1).sum() >= 6
    group.t_tra, group.t_tri = 0.0, 2.0
    cost = 2.0 * (plane.p_L * plane.N_L + plane.p_R * plane.N_R)
    assert current.split_view.plane.cost == pytest.approx(cost)
    group.show = False
    assert layers == {}
    assert current.split_view.rows == []


def test_the_plane_outlives_a_build_and_goes_with_the_structure(
    bpy: Any, root: Any, current: Any, layers: Any
) -> None:
    root.split_plane.show = True
    assert layers == {}
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.accelscope.build()
    assert "plane" in layers
    before = layers["plane"].segments
    bpy.context.object.location.x = 5
    bpy.ops.accelscope.build()
    assert not np.array_equal(layers["plane"].segments, before)
    bpy.ops.accelscope.clear()
    assert layers == {}
    assert current.split_view is None
