"""The lesson on heat maps: a pixel's colour is the counter of its ray."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.rays import ALL, CLOSEST
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.heat_map import (
    BARS,
    COUNTERS,
    CROSS,
    Settings,
    brightest_of,
    camera_of,
    scale,
    viridis,
)
from accelscope.core.lessons.lesson import Subject
from accelscope.core.progress import SILENT
from accelscope.core.scene.camera_rays import camera_rays

LESSON = lesson_named("heat_map")


@pytest.mark.parametrize("name", ["bvh", "kdtree", "macro_grid"])
def test_colours_are_the_counters_of_the_rays(name, lab, build):
    structure = build(name, lab.small_scene("suzanne"))
    settings = Settings(width=40, column=3, row=2)
    play = LESSON.play(Subject(structure.scene, (structure,)), settings, SILENT)
    rays = camera_rays(camera_of(structure.scene), 40, 30)
    for stop, query in ((True, CLOSEST), (False, ALL)):
        _, counts = structure.trace(rays, query)
        for counter in COUNTERS:
            chosen = dataclasses.replace(settings, counter=counter.name, stop=stop)
            picture = play.picture(chosen)
            if counter not in structure.counters:
                assert picture.images == ()
                assert "does not count" in picture.caption
                continue
            (image,) = picture.images
            values = counts[counter.name].reshape(30, 40)
            np.testing.assert_array_equal(image.values, values)
            low, high = values.min(), brightest_of(values)
            expected = viridis((values - low) / ((high - low) or 1.0))
            # Below stands their histogram; pixels whose counter is 0 are in none of its bars.
            share = np.minimum((values[values > 0] - low) / ((high - low) or 1.0), 1.0)
            counted = np.bincount(np.minimum((BARS * share).astype(int), BARS - 1), minlength=BARS)
            strip = (image.pixels[30:] != 0.25).any(axis=2).sum(axis=0)
            bars = counted[np.minimum(np.arange(40) * BARS // 39, BARS - 1)]
            want = np.ceil((len(image.pixels) - 31) * bars / max(int(counted.max()), 1))
            np.testing.assert_array_equal(strip, want)
            is_cross = (image.pixels[:30] == CROSS).all(axis=2)
            assert 0 < is_cross.sum() <= 12
            np.testing.assert_allclose(image.pixels[:30][~is_cross], expected[~is_cross])
            rows = {row.label: row.text for row in picture.rows}
            assert rows["Chosen Pixel"] == str(values[2, 3])
            assert rows["Mean"] == f"{values.mean():.2f}"
            assert float(rows["Most"]) == values.max()


def test_the_scale_is_a_histogram():
    strip = scale(np.repeat([0.0, 0.999], [10, 5]), 64, 11)
    high = (strip != 0.25).any(axis=2).sum(axis=0)
    assert high[0] == 10
    assert high[63] == 5
    assert (high[1:63] == 0).all()


def test_viridis_grows_lighter_all_the_way():
    colours = viridis(np.linspace(0.0, 1.0, 101))
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    assert (np.diff(linear @ [0.2126, 0.7152, 0.0722]) > 0.0).all()
