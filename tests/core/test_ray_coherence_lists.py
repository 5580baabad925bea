"""Ray coherence: whatever a ray meets is in the list of its cell."""

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import Rays
from coherence_cases import CLASSES, COHERENCE, area_light, unit
from directional_cases import lit


def check_lists(build, scene, text, count):
    """Whatever rays from random points of a sphere hit is listed, hit after hit."""
    structure = build(COHERENCE, scene, text)
    rng, balls = np.random.default_rng(2), structure.arrays.balls
    sources = rng.integers(len(scene), size=count)
    own = balls[sources]
    radius = np.cbrt(rng.random(count)) * own[:, 3]
    origins = own[:, :3] + radius[:, None] * unit(rng, count)
    ways = unit(rng, count)
    towards = rng.random(count) < 0.5
    targets = balls[rng.integers(len(scene), size=count), :3]
    ways[towards] = (targets - origins)[towards]
    ways[~ways.any(axis=1)] = 1.0
    rays = Rays.from_arrays(origins, ways, sources=sources, class_names=CLASSES)
    return check_listed(structure, build("naive", scene), rays, sources)


def check_lists_of_lights(build, scene, text, count):
    """Whatever is between points of the scene and points of a light's sphere is listed."""
    scene = dataclasses.replace(scene, lights=(*scene.lights, area_light(scene)))
    structure, rng = build(COHERENCE, scene, text), np.random.default_rng(3)
    balls = structure.arrays.balls[len(scene) :]
    places = np.flatnonzero(np.isfinite(balls[:, 3]))  # a sun has none
    targets = rng.choice(places, count)
    own = balls[targets]
    radius = np.cbrt(rng.random(count)) * own[:, 3]
    ends = own[:, :3] + radius[:, None] * unit(rng, count)
    begins = scene.lower + rng.random((count, 3)) * (scene.upper - scene.lower)
    rays = Rays.from_arrays(
        begins, ends - begins, 1.0, targets=targets, classes=CLASSES.index("shadow"),
        class_names=CLASSES,
    )  # fmt: skip
    return check_listed(structure, build("naive", scene), rays, len(scene) + targets)


def check_listed(structure, naive, rays, own):
    """What rays meet is in the lists of their cells; return how often they meet something."""
    spheres, cells = structure.cells_of(rays)
    np.testing.assert_array_equal(spheres, own)
    left, met = np.arange(len(rays)), 0
    structure.with_lists(*np.unique(np.stack([spheres, cells]), axis=1))  # one by one takes minutes

    @functools.cache
    def listed(sphere, cell):
        return frozenset(structure.list_of(sphere, cell)[0].tolist())

    while len(left):
        hits, _ = naive.trace(rays.select(left))
        is_hit = hits.primitive >= 0
        left, items, ts = left[is_hit], hits.primitive[is_hit], hits.t[is_hit]
        for sphere, cell, item in zip(
            spheres[left].tolist(), cells[left].tolist(), items.tolist(), strict=True
        ):
            assert item in listed(sphere, cell)
        met += len(left)
        rays.t_min[left] = np.nextafter(ts, np.inf)
        left = left[rays.t_min[left] < rays.t_max[left]]
    return met


@pytest.mark.parametrize("text", ["cells=8,light_cells=9", "cells=8,bound=lecture"])
def test_lists_are_conservative(build, lab, text):
    scene = lit(lab.small_scene("suzanne"))
    assert check_lists(build, scene, text, 3000) > 3000
    assert check_lists_of_lights(build, scene, text, 3000) > 500


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    "text",
    [
        "",
        "cells=8",
        "cells=3,bound=lecture",
        "cells=16,light_cells=128",
        "light_cells=5,bound=lecture",
        "most_references=100000",
    ],
)
def test_lists_are_conservative_for_a_million_rays(build, lab, text):
    """Of a scene that is closed, and of one of balls; from items, and to lights."""
    for name in ("suzanne", "balls"):
        scene = lit(lab.small_scene(name))
        check_lists(build, scene, text, 250_000)
        assert check_lists_of_lights(build, scene, text, 250_000) > 10_000
