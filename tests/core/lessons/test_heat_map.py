"""The lesson on heat maps: a pixel's colour is the counter of its ray."""

import dataclasses

import numpy as np
import pytest
from accelscope.core.geometry.rays import ALL, CLOSEST
from accelscope.core.lessons import lesson_named
from accelscope.core.lessons.heat_map import (
    BARS,
    BRIGHTEST,
    COARSE,
    COUNTERS,
    CROSS,
    Settings,
    Tally,
    camera_of,
    scale,
    viridis,
)
from accelscope.core.lessons.lesson import Subject
from accelscope.core.progress import SILENT, Cancelled, Progress
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
            low, high = values.min(), Tally.of(values).brightest
            expected = viridis((values - low) / ((high - low) or 1.0))
            # Below stands their histogram; pixels whose counter is 0 are in none of its bars.
            share = np.minimum((values[values > 0] - low) / ((high - low) or 1.0), 1.0)
            counted = np.bincount(np.minimum((BARS * share).astype(int), BARS - 1), minlength=BARS)
            strip = (image.pixels[30:] != 0.25).any(axis=2).sum(axis=0)
            bars = counted[np.minimum(np.arange(40) * BARS // 39, BARS - 1)]
            shares = np.log1p(bars) / np.log1p(max(int(counted.max()), 1))
            want = np.ceil(shares * (len(image.pixels) - 31))
            np.testing.assert_array_equal(strip, want)
            is_cross = (image.pixels[:30] == CROSS).all(axis=2)
            assert 0 < is_cross.sum() <= 12
            np.testing.assert_allclose(image.pixels[:30][~is_cross], expected[~is_cross])
            rows = {row.label: row.text for row in picture.rows}
            assert rows["Chosen Pixel"] == str(values[2, 3])
            assert rows["Mean"] == f"{values.mean():.2f}"
            assert float(rows["Most"]) == values.max()


class Drafts(Progress):
    """Keeps what is offered, with the values that it has then; cancels after so many."""

    def __init__(self, most=99):
        self.drafts, self.values, self.most = [], [], most

    def offer(self, draft):
        self.drafts.append(draft)
        self.values.append([draft.values(Settings(stop=stop)) for stop in (True, False)])

    def report(self, done, total, text):
        if len(self.drafts) == self.most:
            raise Cancelled


@pytest.mark.parametrize("width", [16, 37, 40])
def test_the_map_comes_coarse_first(width, lab, build, monkeypatch):
    structure = build("bvh", lab.small_scene("suzanne"))
    subject = Subject(structure.scene, (structure,))
    settings = Settings(column=3, row=2, width=width)
    traced, trace = [], structure.trace

    def noted(rays, query, **more):
        traced.append((query, len(rays)))
        return trace(rays, query, **more)

    monkeypatch.setattr(structure, "trace", noted)
    watch = Drafts()
    play = LESSON.play(subject, settings, watch)
    # Every ray once, with and without stopping.
    for query in (CLOSEST, ALL):
        assert sum(count for asked, count in traced if asked == query) == width * play.height
    assert [draft.apart for draft in watch.drafts] == [apart for apart in COARSE if apart > 1]
    for draft, then in zip(watch.drafts, watch.values, strict=True):
        rows, columns = (
            np.arange(count) // draft.apart * draft.apart for count in (play.height, width)
        )
        for stop, values in zip((True, False), then, strict=True):
            chosen = dataclasses.replace(settings, stop=stop)
            want = play.values(chosen)
            np.testing.assert_array_equal(values, want[np.ix_(rows, columns)])
            np.testing.assert_array_equal(draft.values(chosen), values)
            coarse, fine = draft.picture(chosen), play.picture(chosen)
            assert f"so far one of {draft.apart**2}:" in coarse.caption
            assert "so far" not in fine.caption
            # The chosen pixel is the same ray already.
            (number,), (other,) = (
                [row.text for row in each.rows if row.label == "Chosen Pixel"]
                for each in (coarse, fine)
            )
            assert number == other == str(want[2, 3])
            np.testing.assert_array_equal(coarse.segments, fine.segments)
            assert draft.ends == play.ends


@pytest.mark.parametrize("most", [1, 2])
def test_a_map_can_be_cancelled_between_its_passes(most, lab, build):
    structure = build("bvh", lab.small_scene("suzanne"))
    watch = Drafts(most)
    with pytest.raises(Cancelled):
        LESSON.play(Subject(structure.scene, (structure,)), Settings(width=40), watch)
    assert [draft.apart for draft in watch.drafts] == list(COARSE[:most])


def test_the_scale_is_a_histogram():
    strip = scale(np.array([0.0, 0.5, 0.999]), np.array([1000, 30, 1]), 64, 11)
    high = (strip != 0.25).any(axis=2).sum(axis=0)
    # Rounded up from 4.97 and 1.003 tenths of the logarithm of 1001.
    assert (high[0], high[32], high[63]) == (10, 5, 2)
    assert high.sum() == 17


def test_quantiles_are_those_of_all_pixels():
    rng = np.random.default_rng(3)
    for size in (1, 2, 7, 1000):
        values = rng.geometric(0.05, size) - 1
        tally = Tally.of(values)
        for share in (0.0, 0.25, 0.5, 0.95, 1.0):
            assert tally.quantile(share) == pytest.approx(np.quantile(values, share), rel=1e-12)
        assert tally.brightest == np.quantile(values, BRIGHTEST, method="higher")
        assert tally.mean == pytest.approx(values.mean(), rel=1e-12)


def test_viridis_grows_lighter_all_the_way():
    colours = viridis(np.linspace(0.0, 1.0, 101))
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    assert (np.diff(linear @ [0.2126, 0.7152, 0.0722]) > 0.0).all()
