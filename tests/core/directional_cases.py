"""Scenes with lights in every awkward place, cameras of every kind, and rays to and from them."""

import dataclasses
import itertools

import numpy as np
from accelscope.core.geometry.rays import ANY, Rays
from accelscope.core.scene import ORTHOGRAPHIC, SPOT, SUN, Camera, Light
from accelscope.core.scene.camera_rays import CLASS_NAMES
from accelscope.core.scene.light import point_lights
from accelscope.core.structures import structures

LIGHT_BUFFER, IMAGE_DIRECTORY = "light_buffer", "image_directory"

SCENES = ["suzanne", "mess", "cubes", "flat", "one", "teapot", "balls", "gears", "jacks", "tree"]

SETTINGS = [
    "",
    "insert=box",
    "insert=cone",
    "full_occlusion=false",
    "max_list_size=1,max_depth=5",
    "division=uniform",
    "division=uniform,cells=1",
    "division=uniform,cells=7,insert=box",
    "division=uniform,cells=13,insert=cone,full_occlusion=false",
    "merge=equal",
    "merge=similar",
    "division=uniform,merge=similar",
]


def built(lab, name, scene, text=""):
    kind = structures()[name]
    return kind.build(scene, lab.settings_of(kind, text))


def lit(scene):
    """The scene with lights in every awkward place: far away, inside, on a vertex, on a face."""
    boxes = scene.boxes()
    middle = 0.5 * (scene.lower + scene.upper)
    corner = boxes[len(boxes) // 2, :3]
    places = [
        middle + scene.diagonal * np.array([0.6, -0.5, 0.9]),
        middle,
        corner,
        scene.upper,
        middle + 1e4 * scene.diagonal * np.array([0.3, 0.2, 1.0]),
    ]
    suns = [
        Light(SUN, direction=np.array(direction) / np.linalg.norm(direction))
        for direction in ((0.3, 0.2, -1.0), (0.0, 0.0, -1.0), (1.0, 1.0, 1.0))
    ]
    spot = Light(SPOT, position=places[0], direction=np.array([0.0, 0.0, -1.0]), angle=30.0)
    return dataclasses.replace(scene, lights=(*point_lights(*places), *suns, spot))


def shadow_rays_of(scene, seed=0, count=200):
    """Rays from all over the scene to every light, and along borders of cells and diagonals."""
    rng = np.random.default_rng(seed)
    size = scene.upper - scene.lower
    points = scene.lower + (rng.random((count, 3)) * 1.4 - 0.2) * size
    boxes = scene.boxes()
    points = np.concatenate([points, boxes[:40, :3], boxes[:40, 3:], [scene.lower, scene.upper]])
    origins, directions, targets, ends = [], [], [], []
    for number, light in enumerate(scene.lights):
        own = points
        if light.kind != SUN:
            # Along the edges, the diagonals and the middles of the faces of its cube.
            ways = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
            ways = np.concatenate([ways, ways * (1.0, 0.5, 0.25), ways * (0.0625, 1.0, -0.125)])
            ways = ways[np.abs(ways).sum(axis=1) > 0.0]
            own = np.concatenate([points, light.position + ways * 0.7 * scene.diagonal])
            own = own[(own != light.position).any(axis=1)]
            way = light.position - own
        else:
            way = np.broadcast_to(-light.direction, own.shape)
        origins.append(own)
        directions.append(way)
        targets.append(np.full(len(own), number))
        ends.append(np.full(len(own), np.inf if light.kind == SUN else 1.0))
    return Rays.from_arrays(
        np.concatenate(origins), np.concatenate(directions), np.concatenate(ends), queries=ANY,
        classes=1, class_names=CLASS_NAMES, targets=np.concatenate(targets),
    )  # fmt: skip


CAMERAS = {
    "outside": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 45.0),
    "wide": Camera(np.array([0.4, 0.1, 0.3]), np.ones(3), np.array([0.0, 0, 1]), 150.0),
    "shifted": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 60.0,
                      shift=(0.3, -0.2), pixel_aspect=2.0),
    "parallel": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([0.0, 0, 1]), 45.0,
                       ORTHOGRAPHIC, scale=3.0, shift=(0.1, 0.0)),
    "skew": Camera(np.array([3.0, -4, 2]), np.zeros(3), np.array([-0.3, 0.2, 0.9]), 45.0,
                   right=np.array([-0.9, -0.7, -0.2])),
}  # fmt: skip


def changed(rays, **columns):
    return dataclasses.replace(rays, **columns)
