"""The default octree over Blender's default cone, turned: an ordinary tree.

It was refused with more than 33,554,432 references to 62 triangles, and so was anything long and
thin that lies aslant, since boxes were what was sorted into cells.
"""

import numpy as np
import pytest
from accelscope.core.files import load_mesh_file
from accelscope.core.scene import Scene
from accelscope.core.structures import structures
from accelscope.core.structures.octree import DUPLICATION

RANDOM = "random_lines:count=2000"


def cylinder(sides, turn):
    angle = 2 * np.pi * np.arange(sides) / sides
    low = np.stack([0.01 * np.cos(angle), 0.01 * np.sin(angle), np.zeros(sides)], axis=1)
    high, after = low + np.array([0.0, 0.0, 1.0]), np.roll(low, -1, axis=0)
    lower = np.stack([low, after, high], axis=1)
    upper = np.stack([after, np.roll(high, -1, axis=0), high], axis=1)
    return np.concatenate([lower, upper]) @ turn


def turns(count):
    """Return rotations, (count, 3, 3)."""
    turn, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(count, 3, 3)))
    return turn


def build(corners, **settings):
    octree = structures()["octree"]
    return octree.build(Scene.from_triangles(corners, "thin"), octree.Settings(**settings))


def test_the_cone(evaluate, cases):
    record, naive = evaluate(
        cases / "cone_rotated.obj", "--structure", "octree", "naive", "--rays", RANDOM
    )
    figures = record["statistics"]
    assert record["scene"]["triangles"] == 62
    assert figures["N_OIV"] <= 16 * 62
    assert figures["N_V"] < 1000
    assert figures["sah"] < 0.5 * 62
    assert record["trace"]["N_IT"] < 0.3 * naive["trace"]["N_IT"]


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("storage", ["pointer", "implicit", "linear", "hash"])
def test_the_cone_however_it_is_turned(cases, seed, storage):
    corners = load_mesh_file(cases / "cone_rotated.obj").triangles @ turns(5)[seed]
    figures = build(corners, storage=storage).statistics()
    assert figures.N_OIV <= 16 * 62
    assert figures.sah < 0.5 * 62


@pytest.mark.parametrize("planes", ["middle", "adaptive"])
@pytest.mark.parametrize("sides", [3, 32, 1000])
def test_a_slanting_cylinder(planes, sides):
    tree = build(cylinder(sides, turns(1)[0]), planes=planes)
    assert tree.statistics().N_OIV / (2 * sides) <= DUPLICATION
    assert tree.validate() == []


def test_bamboo():
    places = np.random.default_rng(2).random((1500, 1, 1, 3))
    canes = np.stack([cylinder(6, turn) for turn in turns(1500)]) + places
    figures = build(canes.reshape(-1, 3, 3)).statistics()
    assert figures.N_OIV <= DUPLICATION * 18_000
    assert figures.sah < 18_000 / 25


def test_sixteen_triangles_make_few_cells():
    corners = np.random.default_rng(1).random((16, 3, 3))
    assert build(corners, max_leaf_size=0).statistics().N_V < 1000
