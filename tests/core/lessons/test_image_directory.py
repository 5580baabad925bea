"""Lesson "image_directory": rays of certain cells hit what the cell says; colours are cells'."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from accelscope.core.geometry.rays import CLOSEST
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.drawing import GREEN, ORANGE
from accelscope.core.lessons.image_directory import (
    HEIGHT,
    PAPER,
    WIDTH,
    Settings,
    with_camera,
)
from accelscope.core.lessons.lesson import Subject, build
from accelscope.core.progress import SILENT
from accelscope.core.scene import ORTHOGRAPHIC, Camera
from accelscope.core.scene.camera_rays import camera_rays
from accelscope.sample_scenes import make_sample

SCENES = ["suzanne:subdivisions=0", "one", "flat", "mess", "sombrero:size=1"]
KNOBS = [Settings(), Settings(longest=64), Settings("uniform", 7), Settings("uniform", 1)]


@functools.cache
def played(name, settings, lab):
    scene = lab.small_scene(name) if name in lab.HAND_MADE else make_sample(name)
    return lesson_named("image_directory").play(Subject(scene), settings, SILENT)


def every(step):
    """Numbers of pixels, in every so many rows and columns."""
    return np.arange(WIDTH * HEIGHT).reshape(HEIGHT, WIDTH)[::step, ::step].ravel()


@pytest.mark.parametrize("settings", KNOBS)
@pytest.mark.parametrize("name", SCENES)
def test_rays_of_certain_cells_hit_what_the_cell_says(lab, name, settings):
    play = played(name, settings, lab)
    directory, pixels = play.directory, every(5)
    rays = camera_rays(directory.scene.camera, WIDTH, HEIGHT).select(pixels)
    hits, _ = build(play.scene, "naive").trace(rays, CLOSEST)
    leaves = play.leaf_of.ravel()[pixels]
    certain = directory.certain_items[leaves]
    items = np.append(directory.geometry.ids, [-2, -1])[certain]
    is_certain = certain >= -1
    np.testing.assert_array_equal(items[is_certain], hits.primitive[is_certain])
    # In others something is listed; what they hit is.
    for cell, hit in zip(leaves[~is_certain].tolist(), hits.primitive[~is_certain], strict=True):
        lists = directory.lists
        listed = directory.geometry.ids[lists.references[lists.first[cell] : lists.last[cell]]]
        assert len(listed)
        assert hit < 0 or hit in listed
    assert directory.statistics().extra["certain_share"] == directory.certain_share


@pytest.mark.parametrize("settings", KNOBS)
def test_pixels_lie_in_the_cells_that_the_walk_finds(lab, settings):
    play = played(SCENES[0], settings, lab)
    scene = play.directory.scene
    parallel = Camera(scene.camera.position, scene.camera.target, scene.camera.up, 45.0,
                      ORTHOGRAPHIC, scale=scene.diagonal)  # fmt: skip
    other = lesson_named("image_directory").play(
        Subject(dataclasses.replace(scene, camera=parallel)), settings, SILENT
    )
    for each in (play, other):
        rays = camera_rays(each.directory.scene.camera, WIDTH, HEIGHT)
        for pixel in every(61).tolist():
            steps = each.directory.record(rays, pixel)
            assert steps.cell[0] == each.leaf_of.ravel()[pixel]


@pytest.mark.parametrize("settings", KNOBS)
def test_the_image_has_the_colours_of_the_cells(lab, settings):
    play = played(SCENES[0], settings, lab)
    chosen = int(play.order[0])
    picture = play.picture(settings)
    (image,) = picture.images
    certain, green = play.certain[play.leaf_of], np.array(GREEN[:3])
    is_chosen = play.leaf_of == chosen
    assert (image.pixels[is_chosen] == ORANGE[:3]).all()
    share = min(1.6 * 0.55, 1.0)
    want = share * green + (1.0 - share) * PAPER
    is_covered = (certain >= 0) & ~is_chosen
    np.testing.assert_allclose(image.pixels[is_covered] - want, 0.0, atol=1e-15)
    assert is_covered.any() == (settings == Settings())
    lists = play.directory.lists
    np.testing.assert_array_equal(image.values, (lists.last - lists.first)[play.leaf_of])
    assert (image.values[certain == -1] == 0).all()
    # The shares of the rows are those of the pixels, but for pixels that borders pass through.
    assert abs((certain != -2).mean() - play.directory.certain_share) < 0.02
    assert abs(sum(play.shares.values()) - 1.0) < 1e-12


@pytest.mark.parametrize("name", SCENES)
def test_green_items_are_the_list(lab, name):
    play = played(name, Settings(), lab)
    directory, lists = play.directory, play.directory.lists
    for number in sorted({0, play.ends["cell"] // 2, play.ends["cell"]}):
        cell = int(play.order[number])
        places = lists.references[lists.first[cell] : lists.last[cell]]
        picture = play.picture(Settings(cell=number))
        is_green = (picture.face_colours == (*GREEN[:3], 0.6)).all(axis=1)
        want = play.scene.geometry.corners[directory.geometry.ids[places]]
        np.testing.assert_array_equal(picture.faces[is_green], want)


def test_a_camera_that_sees_nothing_has_an_empty_picture(lab):
    scene = lab.small_scene("one")
    away = 2.0 * scene.upper - scene.lower + scene.diagonal
    camera = Camera(away, 2.0 * away - scene.lower, np.array([0.0, 0.3, 1.0]), 40.0, name="Eye")
    scene, name = with_camera(dataclasses.replace(scene, camera=camera))
    assert name == "Eye"
    play = lesson_named("image_directory").play(Subject(scene), Settings(), SILENT)
    picture = play.picture(Settings())
    assert "100% of the picture is certain" in picture.caption
    assert {row.label: row.text for row in picture.rows}["Empty"] == "100.0%"
