"""Pictures of what is built around lights or a camera show all of its cells, and need no rays.

Before, a picture of a ray was wanted of every structure, of a class that these do not answer: there
was no picture at all. And the picture plane was seen by its own camera, as a grid over everything.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from accelscope.core.contract.needs import CAMERA
from accelscope.core.evaluation.pages.picture_cameras import camera_aside
from accelscope.core.evaluation.pages.pictures import Gallery
from accelscope.core.evaluation.pages.view import View
from accelscope.core.evaluation.records.experiment import Built, make_record
from accelscope.core.geometry.rays import Rays
from accelscope.core.scene import ORTHOGRAPHIC, SUN, Light
from accelscope.core.scene.camera_rays import REFLECTED, camera_axes
from accelscope.core.structures import structures
from accelscope.sample_scenes import make_sample

DIRECTIONAL = {name: each for name, each in structures().items() if each.answers is not None}

SMALL = {"ray_coherence": {"cells": 4, "light_cells": 8}}
"""Settings of those that have no depth."""


def rays_off_triangles(scene):
    """Rays that make cells, for there are none before."""
    sources = np.arange(len(scene))
    directions = np.random.default_rng(1).normal(size=(len(scene), 3))
    return Rays.from_arrays(
        scene.triangles.mean(axis=1), directions, sources=sources, class_names=(REFLECTED,)
    )


def scenes():
    tetra = make_sample("tetra:size=2")
    own = tetra.camera
    assert own is not None
    sun = Light(SUN, direction=np.array([0.6, 0.0, -0.8]))
    parallel = dataclasses.replace(own, kind=ORTHOGRAPHIC, scale=3.0)
    yield tetra
    yield dataclasses.replace(tetra, camera=None, lights=(*tetra.lights, sun))
    yield dataclasses.replace(tetra, camera=parallel)


@pytest.mark.parametrize("name", DIRECTIONAL)
def test_all_cells_are_seen(name, tmp_path):
    kind = DIRECTIONAL[name]
    for scene in scenes():
        structure = kind.build(scene, kind.Settings(**SMALL.get(name, {"max_depth": 5})))
        if structure.made() is not None:
            structure.trace(rays_off_triangles(scene))
        cells = structure.cells()
        camera = camera_aside(scene, cells.boxes, CAMERA in kind.needs)
        view = View(scene, camera)
        for corners in (cells.boxes[:, :3], cells.boxes[:, 3:], scene.triangles.reshape(-1, 3)):
            assert view.sees(corners)
        if CAMERA in kind.needs:
            # The picture is seen aslant, neither as its camera sees it nor edge-on.
            across = structure.faces.axes[0, 2]
            assert 0.3 < camera_axes(camera)[0] @ across < 0.95
    gallery = Gallery(tmp_path)
    built = Built(structure, 1.0)
    record = make_record(built, None)
    gallery.add(built, [{**record, "rays": {"name": "camera"}, "error": "not these rays"}])
    gallery.write_page()
    assert {path.stem.rpartition("-")[2] for path in tmp_path.glob("*.png")} == {"levels", "leaves"}
