"""Refit after any builder: tree, cells and figures are those of one structure."""

from __future__ import annotations

from typing import Any

import pytest


@pytest.fixture
def cube(bpy: Any) -> Any:
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    return bpy.context.object


@pytest.mark.parametrize("builder", ["ploc", "parallel_sah", "lbvh", "binned_sah"])
@pytest.mark.parametrize("optimise", ["none", "reinsert"])
def test_refit(bpy: Any, cube: Any, root: Any, current: Any, builder: str, optimise: str) -> None:
    root.structures.bvh.builder, root.structures.bvh.optimise = builder, optimise
    bpy.ops.accelscope.build()
    cube.scale.z = 2.0
    assert bpy.ops.accelscope.refit() == {"FINISHED"}
    structure = current.built.structure
    assert current.status(bpy.context).text == "Up to date"
    assert current.snapshot.scene is structure.scene
    boxes = structure.cells().boxes
    assert current.cells.boxes.tobytes() == boxes.tobytes()
    assert boxes[0, 5] == pytest.approx(2.0, abs=1e-5)


@pytest.mark.parametrize(
    "place",
    [
        "accelscope.core.structures.bvh.hierarchy.BVH.cells",
        "accelscope.core.structures.bvh.hierarchy.BVH.statistics",
        "accelscope.addon.drawing.overlay.set_cells",
    ],
)
def test_what_fails_leaves_everything_as_it_was(
    bpy: Any, cube: Any, current: Any, place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise KeyError("clusters")

    from accelscope.addon.drawing import overlay

    bpy.ops.accelscope.build()
    before = dict(vars(current)), overlay._overlay.drawn
    cube.scale.z = 2.0
    with monkeypatch.context() as patch:
        patch.setattr(place, fail)
        with pytest.raises(RuntimeError, match="Refitting failed"):
            bpy.ops.accelscope.refit()
    assert before == (vars(current), overlay._overlay.drawn)
    assert current.status(bpy.context).text == "Out of date: Cube was turned or scaled".replace(
        "Cube", cube.name
    )
    assert bpy.ops.accelscope.refit() == {"FINISHED"}
