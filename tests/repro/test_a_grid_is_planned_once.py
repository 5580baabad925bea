"""The triangles are looked at once for the resolution of a grid that is left open."""

import numpy as np
import pytest
from accelscope.core.errors import InputError
from accelscope.core.evaluation.records.experiment import build
from accelscope.core.scene import Scene
from accelscope.core.structures import grid, structures


@pytest.fixture
def looks(monkeypatch):
    """Sizes of the scenes whose triangles were looked at, in turn."""
    found = []

    def counted(triangles, *arguments):
        found.append(len(triangles.ids))
        return original(triangles, *arguments)

    original = grid.reference_terms
    monkeypatch.setattr(grid, "reference_terms", counted)
    return found


@pytest.mark.parametrize("name", ["grid", "macro_grid"])
def test_a_default_build(lab, looks, name):
    scene, structure = lab.small_scene("suzanne"), structures()[name]
    build(scene, structure, structure.Settings())
    assert looks.count(len(scene)) == 1


def test_what_the_rule_aims_at_does_not_fit_but_fewer_cells_do(looks, monkeypatch):
    structure, asked = structures()["grid"], []

    def refuse(needed, what, advice):
        asked.append(needed)
        if len(asked) == 1:
            raise InputError("too many")

    monkeypatch.setattr(grid, "refuse_if_too_large", refuse)
    large = Scene.from_triangles(np.random.default_rng(1).random((500, 3, 3)), "large triangles")
    structure.refuse_too_large(large, structure.Settings())
    assert looks == [500]
    assert asked[1] < asked[0]
